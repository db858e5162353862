//! The first pass over the pairs of one layer: of its particles with each other and with the next layer.
//!
//! What pairs add to a particle of the layer goes to the layer's own accumulators, what they add to one
//! of the next layer to accumulators that only this layer writes. Sums therefore do not depend on
//! which thread does which layer, nor when.

use super::arithmetic::Arithmetic;
use super::block::Block;
use super::chunks::{cut, cut_with_ghosts};
use super::evaluate::{self, Evaluation, evaluate};
use super::frame::Frame;
use super::grid::Grid;
use super::look::look;
use super::many_body::{NearPairs, keep_near};
use super::scatter::{scatter, scatter_weights};
use super::simd::{Isa, Reals, Scalar};
use super::terms::Terms;
use super::windows::{Spans, View, Windows};
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

/// Pairs of a block: enough to fill vectors, few enough for the first-level cache.
const ENOUGH: usize = 128;
/// Particles of a block.
const MEMBERS: usize = 64;

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
