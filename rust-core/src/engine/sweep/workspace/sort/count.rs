//! The cell of each particle, and how many there are in each.

use super::NO_CELL;
use super::fractions::{Fractions, SORT_BLOCK};
use crate::engine::error::EngineError;
use crate::engine::sweep::ground::box_geometry::BoxGeometry;
use crate::engine::sweep::ground::shared_ptr::SharedPtr;
use crate::engine::sweep::workspace::Input;
use crate::engine::vectors::Loop;
use std::ops::Range;

/// What all threads count with.
pub struct Count<'a> {
    pub input: &'a Input<'a>,
    pub geometry: &'a BoxGeometry,
    pub fractions: Fractions<'a>,
    /// See [`Count::first_kind`].
    pub first_kind: u32,
    pub cell: SharedPtr<u32>,
    pub fixed32: SharedPtr<[u32; 3]>,
}

/// The particles of one thread.
pub struct CountRange<'a> {
    pub count: &'a Count<'a>,
    pub particles: Range<usize>,
    /// The thread's own.
    pub counts: &'a mut [u32],
}

impl Loop for CountRange<'_> {
    type Out = Result<(), EngineError>;

    #[inline(always)]
    fn run(self) -> Result<(), EngineError> {
        let CountRange { count, particles: Range { start: mut first, end }, counts } = self;
        counts.fill(0);
        let mut fixed32 = [[0; 3]; SORT_BLOCK];
        while let Some(x) = count.input.particles.x[first..end].first_chunk::<SORT_BLOCK>() {
            if count.are_self_ghosts(first) {
                // SAFETY: of this thread's particles.
                unsafe { count.cell.at(first).cast::<[u32; SORT_BLOCK]>().write([NO_CELL; SORT_BLOCK]) };
                first += SORT_BLOCK;
                continue;
            }
            let near = count.fractions.of_block(x, &mut fixed32);
            let cells = count.fractions.cells(&fixed32);
            if !near || !count.are_plain(first) {
                count.one_by_one(first..first + SORT_BLOCK, &fixed32, &cells, counts)?;
            } else if first + SORT_BLOCK <= count.input.particles.owned {
                // SAFETY: of this thread's particles; cells are of the grid.
                unsafe { count.all::<false>(first, x, &fixed32, &cells, counts) };
            } else {
                // SAFETY: as above.
                unsafe { count.all::<true>(first, x, &fixed32, &cells, counts) };
            }
            first += SORT_BLOCK;
        }
        let rest = &count.input.particles.x[first..end];
        if !rest.is_empty() {
            let mut x = [count.geometry.origin; SORT_BLOCK];
            x[..rest.len()].copy_from_slice(rest);
            count.fractions.of_block(&x, &mut fixed32);
            let cells = count.fractions.cells(&fixed32);
            count.one_by_one(first..end, &fixed32, &cells, counts)?;
        }
        Ok(())
    }
}

impl Count<'_> {
    /// Types from the first of these on all have a species; hosts that number them from one have none for zero.
    pub fn first_kind(input: &Input) -> u32 {
        input.species_of_type.iter().rposition(|s| *s < 0).map_or(0, |last| last as u32 + 1)
    }

    /// Whether all particles of a block take part, and have tags and types in range.
    #[inline(always)]
    fn are_plain(&self, first: usize) -> bool {
        let (particles, range) = (&self.input.particles, first..first + SORT_BLOCK);
        let types = self.input.species_of_type.len() as u32 - self.first_kind;
        let mut wrong = 0;
        for (tag, kind) in particles.tag[range.clone()].iter().zip(&particles.kind[range]) {
            let unknown = (*kind as u32).wrapping_sub(self.first_kind) >= types;
            wrong |= (*tag < 1) as u32 | unknown as u32;
        }
        wrong == 0
    }

    /// Whether all particles of a block are images.
    #[inline(always)]
    fn are_self_ghosts(&self, first: usize) -> bool {
        let Some(ghost) = first.checked_sub(self.input.particles.owned) else { return false };
        let images = self.input.images.get(ghost..).and_then(|images| images.first_chunk::<SORT_BLOCK>());
        images.is_some_and(|images| images.iter().fold(true, |all, image| all & *image))
    }

    /// Whether a particle is a ghost that no owned particle needs: out of reach, or an image.
    #[inline(always)]
    fn is_unneeded(&self, k: usize, x: &[f64; 3]) -> bool {
        let Some(ghost) = k.checked_sub(self.input.particles.owned) else { return false };
        !self.geometry.contains(x) || self.input.images.get(ghost).is_some_and(|image| *image)
    }

    /// Counts a block of particles, of which some may be ghosts that nobody needs.
    ///
    /// # Safety
    /// Only the calling thread has these particles; cells are of the grid.
    #[inline(always)]
    unsafe fn all<const GHOSTS: bool>(
        &self,
        first: usize,
        x: &[[f64; 3]; SORT_BLOCK],
        fixed32: &[[u32; 3]; SORT_BLOCK],
        cells: &[[u32; 3]; SORT_BLOCK],
        counts: &mut [u32],
    ) {
        // SAFETY: the caller's.
        unsafe {
            self.fixed32.at(first).cast::<[[u32; 3]; SORT_BLOCK]>().write(*fixed32);
            for (lane, [a, b, c]) in cells.iter().enumerate() {
                let mut to = a + b + c;
                if GHOSTS && self.is_unneeded(first + lane, &x[lane]) {
                    to = NO_CELL;
                } else {
                    *counts.get_unchecked_mut(to as usize) += 1;
                }
                *self.cell.at(first + lane) = to;
            }
        }
    }

    /// Counts particles of which some may take no part, or may be wrong.
    #[inline(never)]
    fn one_by_one(
        &self,
        range: Range<usize>,
        fixed32: &[[u32; 3]; SORT_BLOCK],
        cells: &[[u32; 3]; SORT_BLOCK],
        counts: &mut [u32],
    ) -> Result<(), EngineError> {
        let input = self.input;
        for (k, (u, to)) in range.zip(fixed32.iter().zip(cells)) {
            let x = &input.particles.x[k];
            let species = input.species_of(k);
            if species.is_some_and(|s| s < 0) {
                // SAFETY: of this thread's particles.
                unsafe { *self.cell.at(k) = NO_CELL };
                continue;
            }
            if species.is_none() || input.particles.tag[k] < 1 || !self.fractions.has(x) {
                return Err(fault_of(input, k));
            }
            if self.is_unneeded(k, x) {
                // SAFETY: as above.
                unsafe { *self.cell.at(k) = NO_CELL };
                continue;
            }
            let to = to.iter().sum();
            counts[to as usize] += 1;
            // SAFETY: as above.
            unsafe {
                *self.cell.at(k) = to;
                *self.fixed32.at(k) = *u;
            }
        }
        Ok(())
    }
}

/// What is wrong with a particle that cannot be sorted.
#[cold]
#[inline(never)]
fn fault_of(input: &Input, k: usize) -> EngineError {
    let (tag, kind) = (input.particles.tag[k], input.particles.kind[k]);
    match input.species_of(k) {
        None => EngineError::Kind { tag, kind },
        Some(_) if tag < 1 => EngineError::Tag { tag },
        Some(_) => EngineError::Position { tag },
    }
}
