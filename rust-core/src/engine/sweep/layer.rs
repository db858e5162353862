//! The first pass over the pairs of one layer: of its particles with each other and with the next layer.
//!
//! What pairs add to a particle of the layer goes to the layer's own accumulators, what they add to one
//! of the next layer to accumulators that only this layer writes. Sums therefore do not depend on
//! which thread does which layer, nor when.

use super::arithmetic::Arithmetic;
use super::block::{Block, GROUP};
use super::chunks::{Group, cut};
use super::evaluate::{Kit, evaluate};
use super::frame::Frame;
use super::grid::Grid;
use super::look::look;
use super::many_body::NearPairs;
use super::quantum::Quantum;
use super::scatter::{scatter, scatter_weights};
use super::simd::{Isa, Reals};
use super::terms::Terms;
use super::windows::{Spans, View, Windows};
use crate::engine::noise::PairNoise;
use crate::engine::tally::Tally;

/// Particles in the order of cells, and room for what pairs add to them. Behind the last particle come
/// copies of the first layer, one period further, if layers are periodic: the next layer of the last.
pub struct Swept<'a, T, R> {
    pub frame: &'a Frame,
    pub grid: &'a Grid,
    /// First particle of each bin, and one past the last; if layers are periodic, then those of the copy of the first
    /// layer, one past the last of which is the last.
    pub start: &'a [u32],
    /// Positions from the origin of the frame.
    pub x: [Shared<f32>; 3],
    /// The same in words.
    pub quantum: Quantum,
    pub q: [Shared<u16>; 3],
    pub records: Shared<R>,
    /// Species; not there with one.
    pub species: Shared<u8>,
    /// Which are ghosts; empty if there are none.
    pub ghost: &'a [bool],
    /// A bit for each particle that is not.
    pub owned: &'a [u8],
    /// Of each row, then of those of the copy of the first layer; empty if there are no ghosts.
    pub owned_of_row: &'a [OwnedOfRow],
    pub terms: &'a Terms<T>,
    /// The many-body slopes, a number for each pass and species.
    pub slopes: Shared<f64>,
    /// The same for pairs that are kept whole: rows of eight for all particles, then rows of the next eight …, with so
    /// many numbers each time.
    pub slope_rows: Shared<T>,
    pub slope_room: usize,
    /// What to add to the number of a particle to get that of its accumulator, for each layer.
    pub offset: &'a [isize],
    /// Four numbers for each accumulator: force, and the density if there is one variable.
    pub sums: Shared<f64>,
    /// Densities, if there are more: for each accumulator `variables` numbers, and as many more as fill rows of four.
    pub densities: Shared<f64>,
    pub variables: usize,
    pub thermostat: Option<(PairNoise, f64)>,
}

/// The owned particles of a row.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OwnedOfRow {
    /// The first, and one past the last.
    pub ends: [u32; 2],
    /// Whether the row has ghosts.
    pub with_ghosts: bool,
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
    /// The pointer, to read through.
    #[inline(always)]
    pub fn as_ptr(self) -> *const T {
        self.0
    }

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

impl<T, R> Swept<'_, T, R> {
    /// How much of a pair counts here: one, a half with a ghost.
    pub fn share(&self, i: usize, j: usize) -> f64 {
        if self.ghost.is_empty() {
            return 1.0;
        }
        1.0 - 0.5 * (self.ghost[i] as u8 + self.ghost[j] as u8) as f64
    }

    /// A bit for each of the sixteen particles from `at` on that is not a ghost.
    #[inline(always)]
    pub unsafe fn owned_bits(&self, at: usize) -> u32 {
        // SAFETY: there are bits for sixteen particles behind the last, and eight bytes behind those.
        unsafe {
            let bits = self.owned.as_ptr().add(at / 8).cast::<u32>().read_unaligned();
            bits >> (at % 8) & 0xffff
        }
    }

    /// Whether there is a ghost among the particles of a group.
    #[inline(always)]
    unsafe fn has_ghosts(&self, [first, count]: [usize; 2]) -> bool {
        // SAFETY: there are bits for the particles, and more than eight bytes behind them.
        let bits = unsafe { self.owned.as_ptr().add(first / 8).cast::<u64>().read_unaligned() };
        let all = (1 << count) - 1;
        bits >> (first % 8) & all != all
    }
}

// With up to seven bits before the first they fit into a word.
const _: () = assert!(GROUP <= 57);

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
        let layer_first = *swept.start.get_unchecked(layer * grid.rows * grid.bins);
        let passes = swept.terms.passes.len();
        if SEVERAL && swept.terms.whole {
            near.whole.clear(passes, TALLY);
        } else {
            near.clear(passes, layer_first);
        }
        let view = View::new(swept, layer);
        let ghosts = !swept.ghost.is_empty();
        let kit = Kit::<I, A>::new(swept);
        let mut spans = Spans::default();
        let mut row = 0;
        while row < grid.rows {
            let cell = (layer * grid.rows + row) * grid.bins;
            let windows = Windows::new(swept, &view, layer, row);
            let mut first = *swept.start.get_unchecked(cell) as usize;
            let end = *swept.start.get_unchecked(cell + grid.bins) as usize;
            // Ghosts look for owned particles only.
            if ghosts && windows.owned.iter().all(|[first, last]| first == last) {
                first = end;
            }
            while first < end {
                let count = GROUP.min(end - first);
                let group = [first, count];
                if grid.team == 8 {
                    find::<I, A, 8>(swept, &view, &windows, &mut spans, row, group, block);
                } else {
                    find::<I, A, 4>(swept, &view, &windows, &mut spans, row, group, block);
                }
                let mut slot = 0;
                while slot < count {
                    let last = count.min(slot + A::Reals::LANES);
                    part::<I, A, SEVERAL, TALLY>(swept, &kit, layer, block, near, [slot, last], &mut tally);
                    slot = last;
                }
                first += count;
            }
            row += 1;
        }
        tally
    }
}

/// Finds the pairs of a group: `count` particles of a row from `first` on.
#[inline(always)]
unsafe fn find<I: Isa, A: Arithmetic<I>, const MANY: usize>(
    swept: &Swept<A::Scalar, A::Record>,
    view: &View,
    windows: &Windows,
    spans: &mut Spans,
    row: usize,
    [first, count]: [usize; 2],
    block: &mut Block<A::Scalar>,
) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let ends = view.spans::<I, MANY>(swept, row, [first, count], &windows.there, spans);
        let group = Group { view, windows, ends, first, count };
        // Owned particles look at all there are.
        if windows.with_ghosts && swept.has_ghosts([first, count]) {
            cut::<I, A::Scalar, true, MANY>(swept, &group, spans, block);
        } else {
            cut::<I, A::Scalar, false, MANY>(swept, &group, spans, block);
        }
        if windows.crosses || ends.before | ends.after != 0 {
            look::<I, A::Scalar, true, MANY>(swept, &group, A::Reals::LANES, block);
        } else {
            look::<I, A::Scalar, false, MANY>(swept, &group, A::Reals::LANES, block);
        }
    }
}

/// A vector's worth of a group.
#[derive(Clone, Copy)]
pub struct Part {
    /// From which of the group to before which.
    pub slots: [usize; 2],
    /// The particle that is the first.
    pub first: usize,
    /// Their pairs, among those of the group.
    pub pairs: [usize; 2],
}

impl Part {
    pub fn count(self) -> usize {
        self.pairs[1] - self.pairs[0]
    }
}

/// Evaluates the pairs of a vector's worth of a group, and adds what they do.
#[inline(always)]
unsafe fn part<I: Isa, A: Arithmetic<I>, const SEVERAL: bool, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    kit: &Kit<I, A>,
    layer: usize,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
    [first, last]: [usize; 2],
    tally: &mut Tally,
) {
    // SAFETY: the contract of `simd`; there are records for a vector behind the last particle.
    unsafe {
        let pairs = [*block.begin.get_unchecked(first) as usize, *block.begin.get_unchecked(last) as usize];
        if pairs[0] == pairs[1] {
            return;
        }
        let part = Part { slots: [first, last], first: block.first + first, pairs };
        A::own(swept.records.as_ptr().add(part.first), &mut block.own);
        evaluate::<I, A, SEVERAL, TALLY>(swept, kit, block, near, part, tally);
        let offset = *swept.offset.get_unchecked(layer);
        // Forces first: rows of weights take the place of theirs.
        if !(SEVERAL && swept.terms.whole) {
            scatter::<I, A>(swept.sums, swept.variables, offset, block, part);
            near.add::<TALLY>(block, part);
        }
        if swept.variables > 1 {
            scatter_weights::<I, A, SEVERAL>(swept, offset, block, part);
        }
    }
}
