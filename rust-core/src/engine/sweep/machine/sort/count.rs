//! The bin of each particle, and how many there are in each.

use super::NOWHERE;
use super::fractions::{BLOCK, Fractions};
use crate::engine::error::EngineError;
use crate::engine::sweep::frame::Frame;
use crate::engine::sweep::layer::Shared;
use crate::engine::sweep::machine::Given;
use crate::engine::sweep::machine::vectors::Loop;
use std::ops::Range;

/// What all threads count with.
pub struct Count<'a> {
    pub given: &'a Given<'a>,
    pub frame: &'a Frame,
    pub fractions: Fractions<'a>,
    /// See [`Count::first_kind`].
    pub first_kind: u32,
    pub cell: Shared<u32>,
    pub unit: Shared<[u32; 3]>,
}

/// The particles of one thread.
pub struct CountSome<'a> {
    pub count: &'a Count<'a>,
    pub particles: Range<usize>,
    /// The thread's own.
    pub counts: &'a mut [u32],
}

impl Loop for CountSome<'_> {
    type Out = Result<(), EngineError>;

    #[inline(always)]
    fn run(self) -> Result<(), EngineError> {
        let CountSome { count, particles: Range { start: mut first, end }, counts } = self;
        counts.fill(0);
        let mut units = [[0; 3]; BLOCK];
        while let Some(x) = count.given.particles.x[first..end].first_chunk::<BLOCK>() {
            if count.are_images(first) {
                // SAFETY: of this thread's particles.
                unsafe { count.cell.at(first).cast::<[u32; BLOCK]>().write([NOWHERE; BLOCK]) };
                first += BLOCK;
                continue;
            }
            let near = count.fractions.of_block(x, &mut units);
            let cells = count.fractions.cells(&units);
            if !near || !count.are_plain(first) {
                count.one_by_one(first..first + BLOCK, &units, &cells, counts)?;
            } else if first + BLOCK <= count.given.particles.owned {
                // SAFETY: of this thread's particles; cells are of the grid.
                unsafe { count.all::<false>(first, x, &units, &cells, counts) };
            } else {
                // SAFETY: as above.
                unsafe { count.all::<true>(first, x, &units, &cells, counts) };
            }
            first += BLOCK;
        }
        let rest = &count.given.particles.x[first..end];
        if !rest.is_empty() {
            let mut x = [count.frame.origin; BLOCK];
            x[..rest.len()].copy_from_slice(rest);
            count.fractions.of_block(&x, &mut units);
            let cells = count.fractions.cells(&units);
            count.one_by_one(first..end, &units, &cells, counts)?;
        }
        Ok(())
    }
}

impl Count<'_> {
    /// Types from the first of these on all have a species; hosts that number them from one have none for zero.
    pub fn first_kind(given: &Given) -> u32 {
        given.kinds.iter().rposition(|s| *s < 0).map_or(0, |last| last as u32 + 1)
    }

    /// Whether all particles of a block take part, and have tags and types in range.
    #[inline(always)]
    fn are_plain(&self, first: usize) -> bool {
        let (particles, range) = (&self.given.particles, first..first + BLOCK);
        let types = self.given.kinds.len() as u32 - self.first_kind;
        let mut wrong = 0;
        for (tag, kind) in particles.tag[range.clone()].iter().zip(&particles.kind[range]) {
            let unknown = (*kind as u32).wrapping_sub(self.first_kind) >= types;
            wrong |= (*tag < 1) as u32 | unknown as u32;
        }
        wrong == 0
    }

    /// Whether all particles of a block are images.
    #[inline(always)]
    fn are_images(&self, first: usize) -> bool {
        let Some(ghost) = first.checked_sub(self.given.particles.owned) else { return false };
        let images = self.given.images.get(ghost..).and_then(|images| images.first_chunk::<BLOCK>());
        images.is_some_and(|images| images.iter().fold(true, |all, image| all & *image))
    }

    /// Whether a particle is a ghost that no owned particle needs: out of reach, or an image.
    #[inline(always)]
    fn is_idle(&self, k: usize, x: &[f64; 3]) -> bool {
        let Some(ghost) = k.checked_sub(self.given.particles.owned) else { return false };
        !self.frame.has(x) || self.given.images.get(ghost).is_some_and(|image| *image)
    }

    /// Counts a block of particles, of which some may be ghosts that nobody needs.
    ///
    /// # Safety
    /// Only the calling thread has these particles; cells are of the grid.
    #[inline(always)]
    unsafe fn all<const GHOSTS: bool>(
        &self,
        first: usize,
        x: &[[f64; 3]; BLOCK],
        units: &[[u32; 3]; BLOCK],
        cells: &[[u32; 3]; BLOCK],
        counts: &mut [u32],
    ) {
        // SAFETY: the caller's.
        unsafe {
            self.unit.at(first).cast::<[[u32; 3]; BLOCK]>().write(*units);
            for (lane, [a, b, c]) in cells.iter().enumerate() {
                let mut to = a + b + c;
                if GHOSTS && self.is_idle(first + lane, &x[lane]) {
                    to = NOWHERE;
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
        units: &[[u32; 3]; BLOCK],
        cells: &[[u32; 3]; BLOCK],
        counts: &mut [u32],
    ) -> Result<(), EngineError> {
        let given = self.given;
        for (k, (u, to)) in range.zip(units.iter().zip(cells)) {
            let x = &given.particles.x[k];
            let species = given.species_of(k);
            if species.is_some_and(|s| s < 0) {
                // SAFETY: of this thread's particles.
                unsafe { *self.cell.at(k) = NOWHERE };
                continue;
            }
            if species.is_none() || given.particles.tag[k] < 1 || !self.fractions.has(x) {
                return Err(fault_of(given, k));
            }
            if self.is_idle(k, x) {
                // SAFETY: as above.
                unsafe { *self.cell.at(k) = NOWHERE };
                continue;
            }
            let to = to.iter().sum();
            counts[to as usize] += 1;
            // SAFETY: as above.
            unsafe {
                *self.cell.at(k) = to;
                *self.unit.at(k) = *u;
            }
        }
        Ok(())
    }
}

/// What is wrong with a particle that cannot be sorted.
#[cold]
#[inline(never)]
fn fault_of(given: &Given, k: usize) -> EngineError {
    let (tag, kind) = (given.particles.tag[k], given.particles.kind[k]);
    match given.species_of(k) {
        None => EngineError::Kind { tag, kind },
        Some(_) if tag < 1 => EngineError::Tag { tag },
        Some(_) => EngineError::Position { tag },
    }
}
