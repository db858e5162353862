//! Where a particle looks for others: in which rows, and there from which bin to which.

use super::arithmetic::Record;
use super::block::GROUP;
use super::frame::Frame;
use super::layer::Swept;
use super::simd::{Isa, Reals, Scalar};
use crate::model::kernel::Real;

/// The rows around one: itself, the next of its layer, three of the next layer.
pub struct Windows {
    /// Where the first particles of the bins of each are.
    pub row: [*const u32; 5],
    /// 1 for rows that are there, 0 for others.
    pub there: [f32; 5],
    /// Added to the positions of particles there, in the period before, the same, and the next: entry
    /// `w + 5 (wrap + 1)`.
    pub shift: [[u32; 3]; 15],
    /// Whether any shift of the same period is not zero.
    pub crosses: bool,
    /// The first owned particle of each, and one past the last.
    pub owned: [[u32; 2]; 5],
    /// Whether there are ghosts among those who look.
    pub with_ghosts: bool,
}

impl Windows {
    pub fn new(swept: &Swept<impl Scalar, impl Record>, view: &View, layer: usize, row: usize) -> Windows {
        let (frame, grid) = (swept.frame, swept.grid);
        let own = &swept.start[(layer * grid.rows + row) * grid.bins..];
        let mut windows = Windows {
            row: [own.as_ptr(); 5],
            there: [0.0; 5],
            shift: [[0; 3]; 15],
            crosses: false,
            owned: [[0; 2]; 5],
            with_ghosts: false,
        };
        let around = [(0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
        for (w, (across, up)) in around.into_iter().enumerate() {
            let mut to = [row as i64 + across, layer as i64 + up];
            let mut wrap = 0;
            let mut there = true;
            if to[0] < 0 || to[0] >= grid.rows as i64 {
                // In two dimensions a layer is one row, and has none beside it.
                there = frame.periodic[grid.row_axis] && frame.dimensions == 3;
                wrap = to[0].div_euclid(grid.rows as i64);
                to[0] = to[0].rem_euclid(grid.rows as i64);
            }
            if to[1] >= grid.layers as i64 {
                // The copy of the first.
                there &= frame.periodic[grid.layer_axis];
            }
            if !there {
                continue;
            }
            windows.there[w] = 1.0;
            windows.crosses |= wrap != 0;
            let cell = (to[1] as usize * grid.rows + to[0] as usize) * grid.bins;
            windows.row[w] = swept.start[cell..].as_ptr();
            if let Some(owned) = swept.owned_of_row.get(cell / grid.bins) {
                windows.owned[w] = owned.ends;
                windows.with_ghosts |= w == 0 && owned.with_ghosts;
            }
            for period in 0..3 {
                windows.shift[w + 5 * period] = view.shift[(wrap + 1) as usize][period];
            }
        }
        windows
    }
}

/// A bin for each window and particle of a group.
pub type Bins = [[i32; GROUP]; 5];

/// The bins, from the first to one past the last, in which particles of a group look for others.
#[derive(Default)]
pub struct Spans {
    pub low: Bins,
    pub end: Bins,
    /// From where to the end of the row they look in the period before, and to where in the next.
    pub before: Bins,
    pub after: Bins,
}

/// A layer, in the numbers that spans are made of.
pub struct View {
    pub reach_squared: f32,
    pub row_width: f32,
    pub layer_edge: f32,
    /// Half the window of the row of the particle itself, in bins.
    pub half: f32,
    pub per_bin: f32,
    pub periodic: bool,
    pub tilted: bool,
    pub bins: i32,
    /// Two particles no further apart than this along x look together.
    pub joined: f32,
    /// Added to the positions of particles in rows of the period before, the same, and the next, and there in the same
    /// three periods along x.
    shift: [[[u32; 3]; 3]; 3],
}

impl View {
    #[inline(always)]
    pub fn new(swept: &Swept<impl Scalar, impl Record>, layer: usize) -> View {
        let (frame, grid) = (swept.frame, swept.grid);
        let layer_width = frame.height(grid.layer_axis) / grid.layers as f64;
        View {
            reach_squared: (grid.reach * grid.reach) as f32,
            row_width: (frame.height(grid.row_axis) / grid.rows as f64) as f32,
            layer_edge: ((layer + 1) as f64 * layer_width) as f32,
            half: (grid.window * grid.bins as f64) as f32,
            per_bin: (grid.bins as f64 / frame.length[0]) as f32,
            periodic: frame.periodic[0],
            tilted: frame.is_tilted(),
            bins: grid.bins as i32,
            joined: (grid.joined * frame.length[0] / grid.bins as f64) as f32,
            shift: [-1.0, 0.0, 1.0].map(|wrap| {
                [-frame.length[0], 0.0, frame.length[0]].map(|along| {
                    let [x, y, z] = frame.edge(grid.row_axis).map(|e| wrap * e);
                    [x + along, y, z].map(|shift| 0x1_0001 * u32::from(swept.quantum.shift(shift)))
                })
            }),
        }
    }

    /// The spans of a group: `count` particles from `first` on, of which each `MANY` may look together.
    #[inline(always)]
    pub unsafe fn spans<I: Isa, const MANY: usize>(
        &self,
        swept: &Swept<impl Scalar, impl Record>,
        row: usize,
        [first, count]: [usize; 2],
        there: &[f32; 5],
        out: &mut Spans,
    ) -> Ends {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut ends = Ends::default();
            let mut at = 0;
            while at < count {
                let i = first + at;
                let mut x = swept.x.map(|x| x.as_ptr().add(i));
                let left = count - at;
                let mut lanes = [[0.0; 16]; 3];
                if left < I::F32::LANES {
                    // The last in the place of those that are not there.
                    for c in 0..3 {
                        lanes[c] = [*x[c].add(left - 1); 16];
                        std::ptr::copy_nonoverlapping(x[c], lanes[c].as_mut_ptr(), left);
                        x[c] = lanes[c].as_ptr();
                    }
                }
                let x = [I::F32::load(x[0]), I::F32::load(x[1]), I::F32::load(x[2])];
                self.spans_of_vector::<I, MANY>(swept, row, x, at, there, out, &mut ends);
                at += I::F32::LANES;
            }
            ends
        }
    }

    /// The spans of particles at `x`, `y`, `z`, those of a group from `at` on.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn spans_of_vector<I: Isa, const MANY: usize>(
        &self,
        swept: &Swept<impl Scalar, impl Record>,
        row: usize,
        [x, y, z]: [I::F32; 3],
        at: usize,
        there: &[f32; 5],
        out: &mut Spans,
        ends: &mut Ends,
    ) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let zero = I::F32::constant(0.0);
            let whole = I::F32::splat(self.half);
            let mut half = [whole; 5];
            let mut bin = x * I::F32::splat(self.per_bin);
            if self.tilted {
                bin = fraction_along::<I>(swept.frame, x, y, z) * I::F32::constant(self.bins as f64);
            } else {
                // Half the chord of the sphere of reach in each row.
                let (across, up) = if swept.grid.row_axis == 1 { (y, z) } else { (z, y) };
                let low_edge = I::F32::splat(row as f32 * self.row_width);
                let high_edge = I::F32::splat((row + 1) as f32 * self.row_width);
                let below = (across - low_edge).larger(zero);
                let above = (high_edge - across).larger(zero);
                let over = (I::F32::splat(self.layer_edge) - up).larger(zero);
                let (below, above) = (below * below, above * above);
                let all = I::F32::splat(self.reach_squared);
                let left = all - over * over;
                let per_bin = I::F32::splat(self.per_bin);
                half[1] = I::root_or_more(all - above) * per_bin;
                half[2] = I::root_or_more(left - below) * per_bin;
                half[3] = I::root_or_more(left) * per_bin;
                half[4] = I::root_or_more(left - above) * per_bin;
            }
            let most = I::F32::constant(self.bins as f64);
            let one = I::F32::constant(1.0);
            let [mut before, mut after] = [0; 2];
            if self.periodic {
                // The longest span is that of the particle's own row.
                before = (bin - half[0]).mask_below(zero);
                after = (most - one).mask_below(bin + half[0]);
            }
            // Team by team, if no team is too far apart.
            let first = I::first_of::<MANY>(x);
            let far = I::F32::splat(self.joined);
            let close = (x - first).mask_below(far) & (first - x).mask_below(far);
            let together = close.trailing_ones() as usize >= I::F32::LANES;
            let mut w = 0;
            while w < 5 {
                // Rows that are not there get a span without length.
                let h = *half.get_unchecked(w) * I::F32::splat(*there.get_unchecked(w));
                let (mut low, mut end) = (bin - h, bin + h + one);
                end = end.where_below(zero, h);
                if together {
                    (low, end) = (I::least_of::<MANY>(low), I::greatest_of::<MANY>(end));
                }
                if before != 0 {
                    let low = (low + most).smaller(most);
                    low.store_whole(out.before.get_unchecked_mut(w).as_mut_ptr().add(at));
                }
                if after != 0 {
                    let over = (end - most).larger(zero);
                    over.store_whole(out.after.get_unchecked_mut(w).as_mut_ptr().add(at));
                }
                let low = low.larger(zero).smaller(most);
                low.store_whole(out.low.get_unchecked_mut(w).as_mut_ptr().add(at));
                end.smaller(most).store_whole(out.end.get_unchecked_mut(w).as_mut_ptr().add(at));
                w += 1;
            }
            ends.before |= before << at;
            ends.after |= after << at;
            ends.together |= (together as u32) << (at / I::F32::LANES);
        }
    }
}

/// How the spans of a group end.
#[derive(Clone, Copy, Default)]
pub struct Ends {
    /// Particles whose spans go on in the period before, and in the next: a bit for each.
    pub before: u32,
    pub after: u32,
    /// Vectors in which spans are those of each team together: a bit for each.
    pub together: u32,
}

/// Fractional coordinates along the first edge.
#[inline(always)]
pub unsafe fn fraction_along<I: Isa>(frame: &Frame, x: I::F32, y: I::F32, z: I::F32) -> I::F32 {
    let sz = if frame.dimensions == 3 {
        z * I::F32::constant(1.0 / frame.length[2])
    } else {
        I::F32::constant(0.0)
    };
    let sy = (y - I::F32::constant(frame.tilt[2]) * sz) * I::F32::constant(1.0 / frame.length[1]);
    let along = x - I::F32::constant(frame.tilt[0]) * sy - I::F32::constant(frame.tilt[1]) * sz;
    along * I::F32::constant(1.0 / frame.length[0])
}
