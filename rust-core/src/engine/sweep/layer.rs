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
    /// How many there are for each particle.
    pub counts: Vec<Vec<u32>>,
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
        self.shares.iter_mut().for_each(Vec::clear);
    }
}

/// Pairs of a block: enough to fill vectors, few enough for the first-level cache.
const ENOUGH: usize = 320;
/// Particles of a block.
const MEMBERS: usize = 96;

/// A row that particles of another look for neighbours in.
#[derive(Clone, Copy, Default)]
struct Window {
    /// The first bin of the row.
    cell: usize,
    /// Added to the number of a particle: copies of the first layer are behind the last.
    behind: usize,
    /// Taken from the position of the particle that looks.
    shift: [f32; 3],
    there: bool,
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
        let mut tally = Tally::default();
        near.clear(swept.terms.passes.len());
        let row_width = (swept.frame.height(grid.row_axis) / grid.rows as f64) as f32;
        let layer_width = (swept.frame.height(grid.layer_axis) / grid.layers as f64) as f32;
        let reach_squared = (grid.reach * grid.reach) as f32;
        let tilted = swept.frame.is_tilted();
        let per_bin = (grid.bins as f64 / swept.frame.length[0]) as f32;
        let period = swept.frame.length[0] as f32;
        let periodic = swept.frame.periodic[0];
        let bins = grid.bins as i32;
        let limit = I::F32::splat(reach_squared);
        let ghosts = !swept.ghost.is_empty();
        let layer_edge = (layer + 1) as f32 * layer_width;
        block.clear();
        let mut row = 0;
        while row < grid.rows {
            let cell = (layer * grid.rows + row) * grid.bins;
            let windows = windows(swept.frame, grid, layer, row, swept.particles);
            let (low_edge, high_edge) = (row as f32 * row_width, (row + 1) as f32 * row_width);
            let mut i = *swept.start.get_unchecked(cell) as usize;
            let end = *swept.start.get_unchecked(cell + grid.bins) as usize;
            while i < end {
                let x = *swept.x[0].get_unchecked(i);
                let y = *swept.x[1].get_unchecked(i);
                let z = *swept.x[2].get_unchecked(i);
                let (across, up) = if grid.row_axis == 1 { (y, z) } else { (z, y) };
                block.members.push(i as u32);
                block.begin.push(block.count as u32);
                // Half the chord of the sphere of reach in each row, in bins.
                let mut half = [(grid.window * grid.bins as f64) as f32; 5];
                let mut bin = x * per_bin;
                if tilted {
                    bin = fraction_along(swept.frame, x, y, z) * grid.bins as f32;
                } else {
                    let below = (across - low_edge).max(0.0);
                    let above = (high_edge - across).max(0.0);
                    let over = (layer_edge - up).max(0.0);
                    let (below, above, over) = (below * below, above * above, over * over);
                    let left = reach_squared - over;
                    half[1] = (reach_squared - above).max(0.0).sqrt() * per_bin;
                    half[2] = (left - below).max(0.0).sqrt() * per_bin;
                    half[3] = left.max(0.0).sqrt() * per_bin;
                    half[4] = (left - above).max(0.0).sqrt() * per_bin;
                }
                let mut w = 0;
                while w < 5 {
                    let window = windows.get_unchecked(w);
                    if !window.there || *half.get_unchecked(w) <= 0.0 {
                        w += 1;
                        continue;
                    }
                    // Shifted so that truncation rounds down.
                    let low: i32 = (bin - half.get_unchecked(w) + bins as f32).to_int_unchecked();
                    let high: i32 = (bin + half.get_unchecked(w) + bins as f32).to_int_unchecked();
                    let (mut low, mut high) = (low - bins, high - bins);
                    if w == 0 {
                        low = low.max(0);
                    }
                    let place = [x - window.shift[0], y - window.shift[1], z - window.shift[2]];
                    if !periodic || (low >= 0 && high < bins) {
                        low = low.max(0);
                        high = high.min(bins - 1);
                        if low <= high {
                            let first = if w == 0 { Some(i + 1) } else { None };
                            look::<I, A::Scalar>(
                                swept.start,
                                swept.x,
                                swept.ghost,
                                ghosts,
                                window,
                                low,
                                high,
                                first,
                                place,
                                limit,
                                i,
                                block,
                            );
                        }
                    } else {
                        // Parts of the window that lie in other periods.
                        let mut wrap = -1;
                        while wrap <= 1 {
                            let (a, b) = ((low - wrap * bins).max(0), (high - wrap * bins).min(bins - 1));
                            if a <= b {
                                let first = if w == 0 && wrap == 0 { Some(i + 1) } else { None };
                                let place = [place[0] - wrap as f32 * period, place[1], place[2]];
                                look::<I, A::Scalar>(
                                    swept.start,
                                    swept.x,
                                    swept.ghost,
                                    ghosts,
                                    window,
                                    a,
                                    b,
                                    first,
                                    place,
                                    limit,
                                    i,
                                    block,
                                );
                            }
                            wrap += 1;
                        }
                    }
                    w += 1;
                }
                if block.count >= ENOUGH || block.members.len() >= MEMBERS {
                    flush::<I, A, SEVERAL, TALLY>(swept, layer, block, near, &mut tally);
                }
                i += 1;
            }
            row += 1;
        }
        if !block.members.is_empty() {
            flush::<I, A, SEVERAL, TALLY>(swept, layer, block, near, &mut tally);
        }
        tally
    }
}

/// The rows around one: itself, the next of its layer, three of the next layer.
fn windows(frame: &Frame, grid: &Grid, layer: usize, row: usize, particles: usize) -> [Window; 5] {
    let mut windows = [Window::default(); 5];
    let around = [(0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
    for (window, (across, up)) in windows.iter_mut().zip(around) {
        let mut to = [row as i64 + across, layer as i64 + up];
        let mut shift = [0.0; 3];
        let mut behind = 0;
        window.there = true;
        if to[0] < 0 || to[0] >= grid.rows as i64 {
            // In two dimensions a layer is one row, and has none beside it.
            window.there = frame.periodic[grid.row_axis] && frame.dimensions == 3;
            let wrap = to[0].div_euclid(grid.rows as i64);
            to[0] = to[0].rem_euclid(grid.rows as i64);
            let edge = frame.edge(grid.row_axis);
            for c in 0..3 {
                shift[c] = wrap as f64 * edge[c];
            }
        }
        if to[1] >= grid.layers as i64 {
            window.there &= frame.periodic[grid.layer_axis];
            to[1] = 0;
            behind = particles;
        }
        window.cell = (to[1] as usize * grid.rows + to[0] as usize) * grid.bins;
        window.behind = behind;
        window.shift = shift.map(|s| s as f32);
    }
    windows
}

/// Fractional coordinate along the first edge.
#[inline(always)]
fn fraction_along(frame: &Frame, x: f32, y: f32, z: f32) -> f32 {
    let (x, y, z) = (x as f64, y as f64, z as f64);
    let sz = if frame.dimensions == 3 { z / frame.length[2] } else { 0.0 };
    let sy = (y - frame.tilt[2] * sz) / frame.length[1];
    ((x - frame.tilt[0] * sy - frame.tilt[1] * sz) / frame.length[0]) as f32
}

/// Appends the particles of the bins `low..=high` of a row that are within reach of `place`.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
unsafe fn look<I: Isa, T: Scalar>(
    start: &[u32],
    x: [&[f32]; 3],
    ghost: &[f32],
    ghosts: bool,
    window: &Window,
    low: i32,
    high: i32,
    first: Option<usize>,
    place: [f32; 3],
    limit: I::F32,
    i: usize,
    block: &mut Block<T>,
) {
    // SAFETY: the contract of `simd`; arrays have a vector's room behind their last particle.
    unsafe {
        let mut from = *start.get_unchecked(window.cell + low as usize) as usize + window.behind;
        let to = *start.get_unchecked(window.cell + high as usize + 1) as usize + window.behind;
        if let Some(first) = first {
            from = first;
        }
        if from >= to {
            return;
        }
        block.reserve(block.count + (to - from));
        let (px, py, pz) = (I::F32::splat(place[0]), I::F32::splat(place[1]), I::F32::splat(place[2]));
        let number = <I::U32 as super::simd::Words>::splat(i as u32);
        let far = if ghosts { I::F32::splat(*ghost.get_unchecked(i) * 1e15) } else { px };
        let (out_i, out_j) = (block.i.as_mut_ptr(), block.j.as_mut_ptr());
        let mut count = block.count;
        let mut j = from;
        while j < to {
            let dx = px - I::F32::load(x[0].as_ptr().add(j));
            let dy = py - I::F32::load(x[1].as_ptr().add(j));
            let dz = pz - I::F32::load(x[2].as_ptr().add(j));
            let mut r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz));
            if ghosts {
                // Two ghosts are no concern of this rank.
                r2 = far.mul_add(I::F32::load(ghost.as_ptr().add(j)), r2);
            }
            super::simd::Words::store(number, out_i.add(count));
            count += I::collect_below(r2, limit, j as u32, to - j, out_j.add(count));
            j += I::F32::LANES;
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
        block.begin.push(count as u32);
        // Lanes behind the last pair: some particle with itself.
        let mut k = count;
        while k < count + 16 {
            *block.i.get_unchecked_mut(k) = 0;
            *block.j.get_unchecked_mut(k) = 0;
            k += 1;
        }
        let moving = swept.thermostat.is_some();
        A::separate(swept.frame, swept.records.as_ptr(), block, count, moving);
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
        let mut m = 0;
        while m < block.members.len() {
            let from = *block.begin.get_unchecked(m) as usize;
            let to = *block.begin.get_unchecked(m + 1) as usize;
            let mut sum = I::Quad::zero();
            let mut p = from;
            while p < to {
                let row = A::load_quad(block.rows.as_ptr().add(4 * p));
                let at = base.add(4 * *block.j.get_unchecked(p) as usize);
                sum = sum.add(row);
                I::Quad::load(at).sub(row).store(at);
                p += 1;
            }
            add_to(base.add(4 * *block.members.get_unchecked(m) as usize), sum.mul(sign));
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
        let mut k = 0;
        while k < found {
            *block.near_code.get_unchecked_mut(k) = A::encode(*block.near_j.get_unchecked(k));
            k += 1;
        }
        let rows = &mut near.rows[pass];
        rows.reserve(found + 16);
        let out = rows.as_mut_ptr().add(rows.len()).cast::<A::Scalar>();
        let mut k = 0;
        while k < found {
            let columns = [
                A::Reals::load(block.near[0].as_ptr().add(k)),
                A::Reals::load(block.near[1].as_ptr().add(k)),
                A::Reals::load(block.near[2].as_ptr().add(k)),
                A::Reals::load(block.near_code.as_ptr().add(k)),
            ];
            A::Reals::rows(columns, out.add(4 * k));
            k += A::Reals::LANES;
        }
        rows.set_len(rows.len() + found);
        let counts = &mut near.counts[pass];
        let mut m = 0;
        while m < block.members.len() {
            counts.push(count_bits(&block.bits, block.begin[m] as usize, block.begin[m + 1] as usize));
            m += 1;
        }
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
            let mut p = 0;
            let mut m = 0;
            while m < counts.len() {
                let i = first + m;
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
