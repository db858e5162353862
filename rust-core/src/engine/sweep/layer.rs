//! The two passes over the pairs of one layer: of its particles with each other and with the next layer.
//!
//! What pairs add to a particle of the layer goes to the layer's own accumulators, what they add to one
//! of the next layer to accumulators that only this layer writes. Sums therefore do not depend on
//! which thread does which layer, nor when.

use super::arithmetic::{Arithmetic, Record};
use super::block::Block;
use super::evaluate::{self, Evaluation, add_to, collect_near, count_bits, evaluate};
use super::frame::Frame;
use super::grid::Grid;
use super::simd::{Isa, Quad, Reals, Scalar};
use super::terms::Terms;
use crate::engine::noise::PairNoise;
use crate::engine::tally::Tally;
use crate::model::kernel::Real;

/// Particles in the order of cells, and room for what pairs add to them. Behind the last particle come
/// copies of the first layer, one period further, if layers are periodic: the next layer of the last.
pub struct Swept<'a, T, R> {
    pub frame: &'a Frame,
    pub grid: &'a Grid,
    /// First particle of each bin, and one past the last.
    pub start: &'a [u32],
    /// Positions from the origin of the frame.
    pub x: [&'a [f32]; 3],
    pub records: &'a [R],
    /// Species; empty with one.
    pub species: &'a [u8],
    /// 1 for ghosts, 0 for others; empty if there are none.
    pub ghost: &'a [f32],
    /// The first owned particle of each row, and one past the last; empty if there are no ghosts.
    pub owned_of_row: &'a [[u32; 2]],
    pub particles: usize,
    pub terms: &'a Terms<T>,
    /// The many-body slopes, a number for each pass and species.
    pub slopes: &'a [f64],
    /// What to add to the number of a particle to get that of its accumulator, for each layer.
    pub offset: &'a [isize],
    /// Four numbers for each accumulator: force, and the density if there is one variable.
    pub sums: Shared<f64>,
    /// Densities, if there are more: `variables` numbers for each accumulator.
    pub densities: Shared<f64>,
    pub variables: usize,
    pub thermostat: Option<(PairNoise, f64)>,
}

/// A pointer that threads write disjoint parts through.
pub struct Shared<T>(pub *mut T);

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Shared<T> {}
// SAFETY: users write disjoint parts.
unsafe impl<T: Send> Send for Shared<T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// The pointer `at` elements on.
    ///
    /// # Safety
    /// Within the allocation.
    #[inline(always)]
    pub unsafe fn at(self, at: usize) -> *mut T {
        // SAFETY: the caller's.
        unsafe { self.0.add(at) }
    }
}

/// What the first pass of a layer leaves for the second.
#[derive(Debug, Clone, Default)]
pub struct NearPairs<T> {
    /// For each density: rows `−w′ ê` and the second particle, those of one particle after another.
    pub rows: Vec<Vec<[T; 4]>>,
    /// `r_i − r_j`, if virials are wanted.
    pub distances: Vec<Vec<[T; 3]>>,
    /// How many there are for each particle that has looked for any.
    pub counts: Vec<Vec<u32>>,
    /// These particles, where they are not all of the layer.
    pub members: Vec<u32>,
    /// `share` of each, if virials are wanted.
    pub shares: Vec<Vec<T>>,
}

impl<T> NearPairs<T> {
    fn clear(&mut self, passes: usize) {
        self.rows.resize_with(passes, Vec::new);
        self.distances.resize_with(passes, Vec::new);
        self.counts.resize_with(passes, Vec::new);
        self.shares.resize_with(passes, Vec::new);
        self.rows.iter_mut().for_each(Vec::clear);
        self.distances.iter_mut().for_each(Vec::clear);
        self.counts.iter_mut().for_each(Vec::clear);
        self.members.clear();
        self.shares.iter_mut().for_each(Vec::clear);
    }
}

/// Pairs of a block: enough to fill vectors, few enough for the first-level cache.
const ENOUGH: usize = 128;
/// Particles of a block.
const MEMBERS: usize = 64;

/// The rows around one: itself, the next of its layer, three of the next layer.
struct Windows {
    /// Where the first particles of the bins of each are.
    row: [*const u32; 5],
    /// 1 for rows that are there, 0 for others.
    there: [f32; 5],
    /// Added to the number of a particle: copies of the first layer are behind the last.
    behind: [u32; 5],
    /// Taken from the position of a particle that looks into each, in the period before, the same, and the
    /// next: entry `w + 5 (wrap + 1)` of x, y and z.
    shift: [[f32; 16]; 3],
    /// Whether any shift of the same period is not zero.
    crosses: bool,
    /// The first owned particle of each, and one past the last.
    owned: [[u32; 2]; 5],
}

impl Windows {
    fn new(swept: &Swept<impl Scalar, impl Record>, layer: usize, row: usize) -> Windows {
        let (frame, grid) = (swept.frame, swept.grid);
        let own = &swept.start[(layer * grid.rows + row) * grid.bins..];
        let mut windows = Windows {
            row: [own.as_ptr(); 5],
            there: [0.0; 5],
            behind: [0; 5],
            shift: [[0.0; 16]; 3],
            crosses: false,
            owned: [[0; 2]; 5],
        };
        let around = [(0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
        for (w, (across, up)) in around.into_iter().enumerate() {
            let mut to = [row as i64 + across, layer as i64 + up];
            let mut shift = [0.0; 3];
            let mut there = true;
            let mut behind = 0;
            if to[0] < 0 || to[0] >= grid.rows as i64 {
                // In two dimensions a layer is one row, and has none beside it.
                there = frame.periodic[grid.row_axis] && frame.dimensions == 3;
                let wrap = to[0].div_euclid(grid.rows as i64) as f64;
                to[0] = to[0].rem_euclid(grid.rows as i64);
                shift = frame.edge(grid.row_axis).map(|e| wrap * e);
            }
            if to[1] >= grid.layers as i64 {
                there &= frame.periodic[grid.layer_axis];
                to[1] = 0;
                behind = swept.particles as u32;
            }
            if !there {
                continue;
            }
            windows.there[w] = 1.0;
            windows.behind[w] = behind;
            windows.crosses |= shift != [0.0; 3];
            let cell = (to[1] as usize * grid.rows + to[0] as usize) * grid.bins;
            windows.row[w] = swept.start[cell..].as_ptr();
            if let Some(owned) = swept.owned_of_row.get(cell / grid.bins) {
                windows.owned[w] = *owned;
            }
            for (period, entry) in [(-1.0, w), (0.0, w + 5), (1.0, w + 10)] {
                for c in 0..3 {
                    let along = if c == 0 { period * frame.length[0] } else { 0.0 };
                    windows.shift[c][entry] = (shift[c] + along) as f32;
                }
            }
        }
        windows
    }
}

/// First pass: finds the pairs of `layer`, adds forces that need no density, and weights.
///
/// # Safety
/// The contract of `simd`; arrays are as [`Swept`] says; no other call is in the same layer.
#[inline(always)]
pub unsafe fn first_pass<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    layer: usize,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
) -> Tally {
    // SAFETY: the caller's.
    unsafe {
        let grid = swept.grid;
        let lanes = I::F32::LANES;
        let mut tally = Tally::default();
        near.clear(swept.terms.passes.len());
        let view = View::new(swept.frame, grid, layer);
        let limit = I::F32::splat(view.reach_squared);
        let ghosts = !swept.ghost.is_empty();
        let mut spans = Spans::default();
        block.clear();
        let mut row = 0;
        while row < grid.rows {
            let cell = (layer * grid.rows + row) * grid.bins;
            let windows = Windows::new(swept, layer, row);
            let mut i = *swept.start.get_unchecked(cell) as usize;
            let end = *swept.start.get_unchecked(cell + grid.bins) as usize;
            while i < end {
                let count = lanes.min(end - i);
                let across = view.spans::<I>(swept, row, i, count, &windows.there, &mut spans);
                if ghosts {
                    cut_with_ghosts::<I, A::Scalar>(swept, &windows, &spans, i, count, block);
                } else {
                    cut::<I, A::Scalar>(swept, &view, &windows, &spans, across, i, count, block);
                }
                let shifted = windows.crosses || across != 0;
                match (ghosts, shifted) {
                    (false, false) => look::<I, A::Scalar, false, false>(swept, &windows.shift, limit, block),
                    (false, true) => look::<I, A::Scalar, false, true>(swept, &windows.shift, limit, block),
                    (true, _) => look::<I, A::Scalar, true, false>(swept, &windows.shift, limit, block),
                }
                if block.count >= ENOUGH || block.members.len() >= MEMBERS {
                    flush::<I, A, SEVERAL, TALLY>(swept, layer, block, near, &mut tally);
                }
                i += count;
            }
            row += 1;
        }
        if !block.members.is_empty() {
            flush::<I, A, SEVERAL, TALLY>(swept, layer, block, near, &mut tally);
        }
        tally
    }
}

/// The bins, from the first to one past the last, in which particles of a vector look for others, for each
/// window.
#[derive(Default)]
struct Spans {
    low: [[i32; 16]; 5],
    end: [[i32; 16]; 5],
    /// Before they were cut at the ends of the row, and one row on.
    far_low: [[i32; 16]; 5],
    far_end: [[i32; 16]; 5],
}

/// A layer, in the numbers that spans are made of.
struct View {
    reach_squared: f32,
    row_width: f32,
    layer_edge: f32,
    /// Half the window of the row of the particle itself, in bins.
    half: f32,
    per_bin: f32,
    periodic: bool,
    tilted: bool,
    bins: i32,
}

impl View {
    #[inline(always)]
    fn new(frame: &Frame, grid: &Grid, layer: usize) -> View {
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
        }
    }

    /// The spans of the particles from `i` on, a vector of them; they end at the ends of the row, except for
    /// particles of which bits are set in what is returned, whose spans go on in other periods.
    #[inline(always)]
    unsafe fn spans<I: Isa>(
        &self,
        swept: &Swept<impl Scalar, impl Record>,
        row: usize,
        i: usize,
        count: usize,
        there: &[f32; 5],
        out: &mut Spans,
    ) -> u32 {
        // SAFETY: the contract of `simd`.
        unsafe {
            let x = I::F32::load(swept.x[0].as_ptr().add(i));
            let y = I::F32::load(swept.x[1].as_ptr().add(i));
            let z = I::F32::load(swept.x[2].as_ptr().add(i));
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
                half[1] = (all - above).larger(zero).root() * per_bin;
                half[2] = (left - below).larger(zero).root() * per_bin;
                half[3] = left.larger(zero).root() * per_bin;
                half[4] = (left - above).larger(zero).root() * per_bin;
            }
            let most = I::F32::constant(self.bins as f64);
            let one = I::F32::constant(1.0);
            let mut across = 0;
            if self.periodic {
                // The longest span is that of the particle's own row.
                across = (bin - half[0]).mask_below(zero) | (most - one).mask_below(bin + half[0]);
                across &= (1u32 << count) - 1;
            }
            let mut w = 0;
            while w < 5 {
                let h = *half.get_unchecked(w) * I::F32::splat(*there.get_unchecked(w));
                let (low, end) = (out.low.get_unchecked_mut(w), out.end.get_unchecked_mut(w));
                if across != 0 {
                    // One row on, so that truncation rounds down.
                    (bin + most - h).store_whole(out.far_low.get_unchecked_mut(w).as_mut_ptr());
                    (bin + most + h + one).store_whole(out.far_end.get_unchecked_mut(w).as_mut_ptr());
                }
                (bin - h).larger(zero).smaller(most).store_whole(low.as_mut_ptr());
                // Rows out of reach, or not there, get a span without length.
                (bin + h + one).smaller(most).where_below(zero, h).store_whole(end.as_mut_ptr());
                w += 1;
            }
            across
        }
    }
}

/// Fractional coordinates along the first edge.
#[inline(always)]
unsafe fn fraction_along<I: Isa>(frame: &Frame, x: I::F32, y: I::F32, z: I::F32) -> I::F32 {
    let sz = if frame.dimensions == 3 {
        z * I::F32::constant(1.0 / frame.length[2])
    } else {
        I::F32::constant(0.0)
    };
    let sy = (y - I::F32::constant(frame.tilt[2]) * sz) * I::F32::constant(1.0 / frame.length[1]);
    let along = x - I::F32::constant(frame.tilt[0]) * sy - I::F32::constant(frame.tilt[1]) * sz;
    along * I::F32::constant(1.0 / frame.length[0])
}

/// A vector's worth of particles that one particle is to be compared with: from the first to one past the last
/// of them, of which those beyond a vector are in the next chunk.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct Chunk {
    from: u32,
    to: u32,
    /// The particle's number in the block, and the shift it sees them with.
    member: u32,
    shift: u32,
}

/// Cuts the spans of `count` particles from `i` on into chunks.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
unsafe fn cut<I: Isa, T: Scalar>(
    swept: &Swept<T, impl Record>,
    view: &View,
    windows: &Windows,
    spans: &Spans,
    across: u32,
    i: usize,
    count: usize,
    block: &mut Block<T>,
) {
    // SAFETY: the arrays are as `Swept` says, chunks have room.
    unsafe {
        let lanes = I::F32::LANES;
        let mut found = 0;
        let first_member = block.members.len();
        let mut k = 0;
        while k < count {
            block.members.push((i + k) as u32);
            k += 1;
        }
        let mut c = 0;
        while c < 3 {
            let from = swept.x[c].as_ptr().add(i);
            I::F32::load(from).store(block.place[c].as_mut_ptr().add(first_member));
            c += 1;
        }
        let rows = windows.row;
        let behind = windows.behind;
        let mut chunks = block.chunks.as_mut_ptr();
        let mut k = 0;
        while k < count {
            let i = i + k;
            let member = first_member + k;
            if across >> k & 1 == 1 {
                found = cut_across(view, windows, spans, k, i, member, lanes, block, found);
                chunks = block.chunks.as_mut_ptr();
                k += 1;
                continue;
            }
            let mut w = 0;
            while w < 5 {
                let low = *spans.low.get_unchecked(w).get_unchecked(k) as usize;
                let end = *spans.end.get_unchecked(w).get_unchecked(k) as usize;
                let to = *rows[w].add(end) + behind[w];
                let from = if w == 0 { i as u32 + 1 } else { *rows[w].add(low) + behind[w] };
                let to = to.max(from);
                let length = to - from;
                if length > 2 * lanes as u32 {
                    found = add_many_chunks(block, found, from, length, member, w + 5, lanes as u32);
                    chunks = block.chunks.as_mut_ptr();
                } else {
                    // Both are written, and counted as needed: there is no branch to foresee.
                    let chunk = Chunk { from, to, member: member as u32, shift: w as u32 + 5 };
                    *chunks.add(found) = chunk;
                    *chunks.add(found + 1) = Chunk { from: from + lanes as u32, ..chunk };
                    found += (w == 0 || length > 0) as usize + (length > lanes as u32) as usize;
                }
                w += 1;
            }
            k += 1;
        }
        block.chunk_count = found;
    }
}

/// The same in open space with ghosts: these look for owned particles only, and are no members of the block
/// if there are none.
#[inline(always)]
unsafe fn cut_with_ghosts<I: Isa, T: Scalar>(
    swept: &Swept<T, impl Record>,
    windows: &Windows,
    spans: &Spans,
    i: usize,
    count: usize,
    block: &mut Block<T>,
) {
    // SAFETY: the arrays are as `Swept` says, chunks have room.
    unsafe {
        let lanes = I::F32::LANES;
        let mut found = 0;
        let mut k = 0;
        while k < count {
            let i = i + k;
            let member = block.members.len();
            let is_ghost = *swept.ghost.get_unchecked(i) > 0.0;
            let before = found;
            let mut w = 0;
            while w < 5 {
                let low = *spans.low.get_unchecked(w).get_unchecked(k) as usize;
                let end = *spans.end.get_unchecked(w).get_unchecked(k) as usize;
                let mut to = *windows.row[w].add(end);
                let mut from = if w == 0 { i as u32 + 1 } else { *windows.row[w].add(low) };
                if is_ghost {
                    let [first, last] = windows.owned[w];
                    from = from.max(first);
                    to = to.min(last);
                }
                let always = w == 0 && !is_ghost;
                found = add_chunks(block, found, from, to.saturating_sub(from), member, w + 5, always, lanes);
                w += 1;
            }
            if found > before || !is_ghost {
                block.members.push(i as u32);
                let mut c = 0;
                while c < 3 {
                    *block.place[c].get_unchecked_mut(member) = *swept.x[c].get_unchecked(i);
                    c += 1;
                }
            }
            k += 1;
        }
        block.chunk_count = found;
    }
}

/// The same for a particle whose spans go on in other periods.
#[inline(never)]
#[allow(clippy::too_many_arguments)]
unsafe fn cut_across<T: Scalar>(
    view: &View,
    windows: &Windows,
    spans: &Spans,
    k: usize,
    i: usize,
    member: usize,
    lanes: usize,
    block: &mut Block<T>,
    mut found: usize,
) -> usize {
    // SAFETY: bins are of the row; chunks have room.
    unsafe {
        let bins = view.bins;
        let mut w = 0;
        while w < 5 {
            let own = w == 0;
            let mut low = *spans.far_low.get_unchecked(w).get_unchecked(k) - bins;
            let end = *spans.far_end.get_unchecked(w).get_unchecked(k) - bins;
            let row = *windows.row.get_unchecked(w);
            let behind = *windows.behind.get_unchecked(w);
            if own {
                low = 0;
            } else if *windows.there.get_unchecked(w) == 0.0 {
                w += 1;
                continue;
            }
            if low < 0 {
                let (from, to) = (*row.add((low + bins) as usize) + behind, *row.add(bins as usize) + behind);
                found = add_chunks(block, found, from, to - from, member, w, false, lanes);
                low = 0;
            }
            let to = *row.add(end.min(bins) as usize) + behind;
            let from = if own { i as u32 + 1 } else { *row.add(low as usize) + behind };
            found = add_chunks(block, found, from, to.saturating_sub(from), member, w + 5, own, lanes);
            if end > bins {
                let (from, to) = (*row + behind, *row.add((end - bins) as usize) + behind);
                found = add_chunks(block, found, from, to - from, member, w + 10, false, lanes);
            }
            w += 1;
        }
    }
    found
}

/// Appends the chunks of the `length` particles from `from` on, at least one if `always`; returns how many
/// chunks there are then.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
unsafe fn add_chunks<T: Scalar>(
    block: &mut Block<T>,
    found: usize,
    from: u32,
    length: u32,
    member: usize,
    shift: usize,
    always: bool,
    lanes: usize,
) -> usize {
    // SAFETY: chunks have room for two more; more make room.
    unsafe {
        let lanes = lanes as u32;
        if length > 2 * lanes {
            return add_many_chunks(block, found, from, length, member, shift, lanes);
        }
        // Both are written, and counted as needed: there is no branch to foresee.
        let chunk = Chunk { from, to: from + length, member: member as u32, shift: shift as u32 };
        let out = block.chunks.as_mut_ptr().add(found);
        *out = chunk;
        *out.add(1) = Chunk { from: from + lanes, ..chunk };
        found + (always || length > 0) as usize + (length > lanes) as usize
    }
}

#[cold]
#[inline(never)]
fn add_many_chunks<T: Scalar>(
    block: &mut Block<T>,
    found: usize,
    from: u32,
    length: u32,
    member: usize,
    shift: usize,
    lanes: u32,
) -> usize {
    let pieces = length.div_ceil(lanes);
    let end = from + length;
    block.reserve_chunks(found + pieces as usize);
    for p in 0..pieces {
        let from = from + p * lanes;
        let to = end.min(from + lanes);
        block.chunks[found + p as usize] = Chunk { from, to, member: member as u32, shift: shift as u32 };
    }
    found + pieces as usize
}

/// Compares particles with their chunks, and appends the pairs within reach.
#[inline(always)]
unsafe fn look<I: Isa, T: Scalar, const GHOSTS: bool, const SHIFTS: bool>(
    swept: &Swept<T, impl Record>,
    shifts: &[[f32; 16]; 3],
    limit: I::F32,
    block: &mut Block<T>,
) {
    // SAFETY: the contract of `simd`; arrays have a vector's room behind their last particle.
    unsafe {
        let lanes = I::F32::LANES;
        block.reserve(block.count + lanes * block.chunk_count);
        block.begin.resize(block.members.len() + 1, 0);
        let out = block.j.as_mut_ptr();
        let begin = block.begin.as_mut_ptr();
        let place = [block.place[0].as_ptr(), block.place[1].as_ptr(), block.place[2].as_ptr()];
        let x = [swept.x[0].as_ptr(), swept.x[1].as_ptr(), swept.x[2].as_ptr()];
        let chunks = block.chunks.as_ptr();
        // Masks first, then what they select: the two in one loop wait for each other.
        let masks = block.masks.as_mut_ptr();
        let many = block.chunk_count;
        let mut c = 0;
        while c < many {
            let chunk = chunks.add(c);
            let j = (*chunk).from as usize;
            let member = (*chunk).member as usize;
            let mut p = [*place[0].add(member), *place[1].add(member), *place[2].add(member)];
            if SHIFTS {
                let shift = (*chunk).shift as usize;
                p[0] -= *shifts[0].get_unchecked(shift);
                p[1] -= *shifts[1].get_unchecked(shift);
                p[2] -= *shifts[2].get_unchecked(shift);
            }
            let dx = I::F32::splat(p[0]) - I::F32::load(x[0].add(j));
            let dy = I::F32::splat(p[1]) - I::F32::load(x[1].add(j));
            let dz = I::F32::splat(p[2]) - I::F32::load(x[2].add(j));
            let mut r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz));
            if GHOSTS {
                // Two ghosts are no concern of this rank.
                let i = *block.members.get_unchecked(member) as usize;
                let far = I::F32::splat(*swept.ghost.get_unchecked(i) * 1e15);
                r2 = far.mul_add(I::F32::load(swept.ghost.as_ptr().add(j)), r2);
            }
            let left = ((*chunk).to - (*chunk).from).min(lanes as u32);
            *masks.add(c) = r2.mask_below(limit) & ((1u32 << left) - 1);
            c += 1;
        }
        let mut count = block.count;
        let mut c = 0;
        while c < many {
            let (chunk, mask) = (chunks.add(c), *masks.add(c));
            I::collect((*chunk).from, mask, out.add(count));
            count += mask.count_ones() as usize;
            // Every member has a chunk; its last one leaves where the next begins.
            *begin.add((*chunk).member as usize + 1) = count as u32;
            c += 1;
        }
        block.count = count;
    }
}

/// Evaluates the pairs of a block and adds what they do.
#[inline(always)]
unsafe fn flush<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    layer: usize,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let count = block.count;
        block.reserve(count);
        // Lanes behind the last pair: some particle, and far away.
        let j = block.j.as_mut_ptr().add(count);
        let mut k = 0;
        while k < 16 {
            *j.add(k) = 0;
            k += 1;
        }
        let moving = swept.thermostat.is_some();
        A::spread(swept.records.as_ptr(), block, moving);
        A::separate(swept.frame, swept.records.as_ptr(), block, count, moving);
        let r = block.r.as_mut_ptr().add(count);
        let mut k = 0;
        while k < 16 {
            *r.add(k) = A::Scalar::of(1e30);
            k += 1;
        }
        if SEVERAL || TALLY || swept.variables > 1 {
            block.spread_members();
        }
        if SEVERAL {
            let species = swept.terms.species as u32;
            let mut k = 0;
            while k < count + 16 {
                let a = *swept.species.get_unchecked(block.i[k] as usize);
                let b = *swept.species.get_unchecked(block.j[k] as usize);
                *block.species_i.get_unchecked_mut(k) = a;
                *block.species_j.get_unchecked_mut(k) = b;
                *block.kind.get_unchecked_mut(k) = a as u32 * species + b as u32;
                k += 1;
            }
        }
        if TALLY {
            share(swept.ghost, block);
        }
        let with = Evaluation { terms: swept.terms, thermostat: swept.thermostat };
        evaluate::<I, A::Reals, SEVERAL, TALLY>(&with, block, tally);
        if TALLY {
            evaluate::virial::<A::Reals>(block, &block.conservative, &mut tally.virial);
            if moving {
                evaluate::virial::<A::Reals>(block, &block.thermostat, &mut tally.thermostat_virial);
            }
        }
        let plain = swept.variables == 1;
        match (moving, plain) {
            (false, false) => evaluate::rows::<A::Reals, false, false>(block),
            (false, true) => evaluate::rows::<A::Reals, false, true>(block),
            (true, false) => evaluate::rows::<A::Reals, true, false>(block),
            (true, true) => evaluate::rows::<A::Reals, true, true>(block),
        }
        let offset = *swept.offset.get_unchecked(layer);
        scatter::<I, A>(swept.sums, offset, block);
        if swept.variables > 1 {
            scatter_weights::<A::Scalar>(swept, offset, block);
        }
        if !swept.ghost.is_empty() {
            near.members.extend_from_slice(&block.members);
        }
        let mut pass = 0;
        while pass < swept.terms.passes.len() {
            keep_near::<I, A, TALLY>(swept, pass, block, near);
            pass += 1;
        }
        block.clear();
    }
}

#[inline(never)]
fn share<T: Scalar>(ghost: &[f32], block: &mut Block<T>) {
    for k in 0..block.count {
        let mut share = 1.0;
        if !ghost.is_empty() {
            share -= 0.5 * (ghost[block.i[k] as usize] + ghost[block.j[k] as usize]) as f64;
        }
        block.share[k] = T::of(share);
    }
    let count = block.count;
    block.share[count..count + 16].fill(T::default());
}

/// Adds the rows of a block to both particles of each pair.
#[inline(always)]
unsafe fn scatter<I: Isa, A: Arithmetic<I>>(sums: Shared<f64>, offset: isize, block: &Block<A::Scalar>) {
    // SAFETY: the contract of `simd`; accumulators are there for every particle of the layer and the next.
    unsafe {
        // The second particle gets minus the row, so the weight in it is negative.
        const SIGN: [f64; 4] = [1.0, 1.0, 1.0, -1.0];
        let sign = I::Quad::load(SIGN.as_ptr());
        let base = sums.0.offset(4 * offset);
        let (begin, members) = (block.begin.as_ptr(), block.members.as_ptr());
        let (rows, j) = (block.rows.as_ptr(), block.j.as_ptr());
        let mut p = 0;
        let mut m = 0;
        while m < block.members.len() {
            let to = *begin.add(m + 1) as usize;
            let mut sum = I::Quad::zero();
            while p < to {
                let row = A::load_quad(rows.add(4 * p));
                let at = base.add(4 * *j.add(p) as usize);
                sum = sum.add(row);
                I::Quad::load(at).sub(row).store(at);
                p += 1;
            }
            add_to(base.add(4 * *members.add(m) as usize), sum.mul(sign));
            m += 1;
        }
    }
}

/// Adds weights where there are several densities or species.
#[inline(always)]
unsafe fn scatter_weights<T: Scalar>(swept: &Swept<T, impl Record>, offset: isize, block: &Block<T>) {
    // SAFETY: as `scatter`.
    unsafe {
        let species = swept.terms.species;
        let width = swept.variables;
        let base = swept.densities.0.offset(width as isize * offset);
        let passes = swept.terms.passes.len();
        let mut p = 0;
        while p < block.count {
            let (mut si, mut sj) = (0, 0);
            if species > 1 {
                si = *block.species_i.get_unchecked(p) as usize;
                sj = *block.species_j.get_unchecked(p) as usize;
            }
            let at_i = base.add(width * *block.i.get_unchecked(p) as usize + sj);
            let at_j = base.add(width * *block.j.get_unchecked(p) as usize + si);
            let mut d = 0;
            while d < passes {
                let w = block.weight.get_unchecked(d).get_unchecked(p).wide();
                *at_i.add(d * species) += w;
                *at_j.add(d * species) += w;
                d += 1;
            }
            p += 1;
        }
    }
}

/// Room for `more`, an eighth in advance: twice as much, as vectors grow by themselves, would be a good part of
/// all memory.
#[inline(always)]
fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 8));
    }
}

/// Keeps the pairs within the range of a density for the second pass.
#[inline(always)]
unsafe fn keep_near<I: Isa, A: Arithmetic<I>, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    pass: usize,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        if block.count == 0 {
            let counts = &mut near.counts[pass];
            counts.resize(counts.len() + block.members.len(), 0);
            return;
        }
        let found = collect_near::<I, A::Reals, TALLY>(&swept.terms.passes[pass], block);
        A::encode_all(block.near_j.as_ptr(), block.near_code.as_mut_ptr(), found);
        let rows = &mut near.rows[pass];
        make_room(rows, found + 16);
        let out = rows.as_mut_ptr().add(rows.len()).cast::<A::Scalar>();
        let near_at = [block.near[0].as_ptr(), block.near[1].as_ptr(), block.near[2].as_ptr()];
        let code = block.near_code.as_ptr();
        let mut k = 0;
        while k < found {
            let columns = [
                A::Reals::load(near_at[0].add(k)),
                A::Reals::load(near_at[1].add(k)),
                A::Reals::load(near_at[2].add(k)),
                A::Reals::load(code.add(k)),
            ];
            A::Reals::rows(columns, out.add(4 * k));
            k += A::Reals::LANES;
        }
        rows.set_len(rows.len() + found);
        let counts = &mut near.counts[pass];
        let members = block.members.len();
        make_room(counts, members);
        let out = counts.as_mut_ptr().add(counts.len());
        let (begin, bits) = (block.begin.as_ptr(), block.bits.as_ptr());
        let mut from = 0;
        let mut m = 0;
        while m < members {
            let to = *begin.add(m + 1) as usize;
            *out.add(m) = count_bits(bits, from, to);
            from = to;
            m += 1;
        }
        counts.set_len(counts.len() + members);
        if TALLY {
            for k in 0..found {
                near.distances[pass].push([block.near_d[0][k], block.near_d[1][k], block.near_d[2][k]]);
            }
            for p in 0..block.count {
                if block.bits[p / 64] >> (p % 64) & 1 == 1 {
                    near.shares[pass].push(block.share[p]);
                }
            }
        }
    }
}

/// Second pass: many-body forces of the pairs that the first has kept.
///
/// # Safety
/// As [`first_pass`].
#[inline(always)]
pub unsafe fn second_pass<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    layer: usize,
    near: &NearPairs<A::Scalar>,
    virial: &mut [f64; 6],
) {
    // SAFETY: the caller's.
    unsafe {
        let grid = swept.grid;
        let first = swept.start[layer * grid.rows * grid.bins] as usize;
        let offset = *swept.offset.get_unchecked(layer);
        let base = swept.sums.0.offset(4 * offset);
        let species = swept.terms.species;
        let width = swept.terms.passes.len() * species;
        let mut pass = 0;
        while pass < swept.terms.passes.len() {
            let rows = near.rows.get_unchecked(pass);
            let counts = near.counts.get_unchecked(pass);
            let slopes = swept.slopes.as_ptr().add(pass * species);
            let some = !swept.ghost.is_empty();
            let mut p = 0;
            let mut m = 0;
            while m < counts.len() {
                let i = if some { *near.members.get_unchecked(m) as usize } else { first + m };
                let end = p + *counts.get_unchecked(m) as usize;
                let mut sum = I::Quad::zero();
                let own = slopes.add(width * i);
                let si = if SEVERAL { *swept.species.get_unchecked(i) as usize } else { 0 };
                while p < end {
                    let row = rows.as_ptr().add(p).cast::<A::Scalar>();
                    let j = A::decode(*row.add(3)) as usize;
                    let there = slopes.add(width * j);
                    let slope = if SEVERAL {
                        *own.add(*swept.species.get_unchecked(j) as usize) + *there.add(si)
                    } else {
                        *own + *there
                    };
                    let force = A::load_quad(row).mul(I::Quad::splat(slope));
                    sum = sum.add(force);
                    let at = base.add(4 * j);
                    I::Quad::load(at).sub(force).store(at);
                    if TALLY {
                        let share = near.shares[pass][p].wide();
                        add_dyad(near.distances[pass][p], *rows.get_unchecked(p), slope * share, virial);
                    }
                    p += 1;
                }
                add_to(base.add(4 * i), sum);
                m += 1;
            }
            pass += 1;
        }
    }
}

#[inline(never)]
fn add_dyad<T: Scalar>(d: [T; 3], g: [T; 4], factor: f64, virial: &mut [f64; 6]) {
    let d = d.map(T::wide);
    let f = [g[0].wide() * factor, g[1].wide() * factor, g[2].wide() * factor];
    for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        virial[k] += f[a] * d[b];
    }
}
