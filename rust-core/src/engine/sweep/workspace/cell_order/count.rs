//! Computes the cell of each particle, and the number of particles in each cell.

use super::fractions::{Fractions, OUTSIDE, SORT_BLOCK};
use crate::engine::error::EngineError;
use crate::engine::sweep::workspace::input::Input;
use crate::engine::vectors::Loop;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use std::ops::Range;

/// The cell of particles that are left out.
pub const NO_CELL: u32 = u32::MAX;

/// The input of all threads.
pub struct Count<'a> {
    pub input: &'a Input<'a>,
    pub geometry: &'a BoxGeometry,
    pub fractions: Fractions<'a>,
    /// Result of [`Count::first_kind`].
    pub first_kind: u32,
    /// Number of a ghost's cell minus that of an owned particle's at the same place.
    pub to_ghosts: u32,
}

/// The particles of one thread: their cells, each of the grid or [`NO_CELL`], the fractions of
/// particles with a cell, and the number of particles in each cell. Without `OPEN` all directions are periodic.
pub struct CountRange<'a, const OPEN: bool> {
    pub count: &'a Count<'a>,
    pub particles: Range<usize>,
    /// Cell of each of these particles.
    pub cell: &'a mut [u32],
    pub fixed32: &'a mut [[u32; 3]],
    /// Number of these particles in each cell.
    pub counts: &'a mut [u32],
}

impl<const OPEN: bool> Loop for CountRange<'_, OPEN> {
    type Out = Result<(), EngineError>;

    #[inline(always)]
    fn run(self) -> Result<(), EngineError> {
        let CountRange { count, particles, cell, fixed32: units, counts } = self;
        let mut first = particles.start;
        counts.fill(0);
        let mut fixed32 = [[0; 3]; SORT_BLOCK];
        let (cell_blocks, cell) = cell.as_chunks_mut::<SORT_BLOCK>();
        let (unit_blocks, units) = units.as_chunks_mut::<SORT_BLOCK>();
        let (x_blocks, rest) = count.input.particles.x[particles].as_chunks::<SORT_BLOCK>();
        for ((x, of_block), units_of_block) in x_blocks.iter().zip(cell_blocks).zip(unit_blocks) {
            if count.are_self_ghosts(first) {
                *of_block = [NO_CELL; SORT_BLOCK];
                first += SORT_BLOCK;
                continue;
            }
            let near = count.fractions.of_block::<OPEN>(x, &mut fixed32);
            let has_ghosts = first + SORT_BLOCK > count.input.particles.owned;
            let cells = match OPEN && has_ghosts {
                true => count.fractions.cells::<true>(&fixed32),
                false => count.fractions.cells::<false>(&fixed32),
            };
            if !near || !count.are_plain(first) {
                count.one_by_one(first, (&fixed32, &cells), of_block, units_of_block, counts)?;
            } else {
                *units_of_block = fixed32;
                match has_ghosts {
                    true => count.all::<true>(first, &cells, of_block, counts),
                    false => count.all::<false>(first, &cells, of_block, counts),
                }
            }
            first += SORT_BLOCK;
        }
        if !rest.is_empty() {
            let mut x = [count.geometry.origin; SORT_BLOCK];
            x[..rest.len()].copy_from_slice(rest);
            count.fractions.of_block::<OPEN>(&x, &mut fixed32);
            let cells = count.fractions.cells::<OPEN>(&fixed32);
            count.one_by_one(first, (&fixed32, &cells), cell, units, counts)?;
        }
        Ok(())
    }
}

impl Count<'_> {
    /// All types from this one on have a species; hosts that number types from one have no species for type zero.
    pub fn first_kind(input: &Input) -> u32 {
        input.species_of_type.iter().rposition(|s| *s < 0).map_or(0, |last| last as u32 + 1)
    }

    /// Whether no particle of a block is left out, and all tags and types are in range.
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

    /// The cell of a particle with these contributions of its coordinates; [`NO_CELL`] for a ghost that no owned particle
    /// needs: out of reach, or an image.
    #[inline(always)]
    fn cell(&self, k: usize, [a, b, c]: [u32; 3]) -> u32 {
        // Owned particles may be at the ends.
        let to = (a & (OUTSIDE - 1)) + (b & (OUTSIDE - 1)) + (c & (OUTSIDE - 1));
        let Some(ghost) = k.checked_sub(self.input.particles.owned) else { return to };
        let is_unneeded = (a | b | c) >= OUTSIDE || self.input.images.get(ghost).is_some_and(|image| *image);
        if is_unneeded { NO_CELL } else { to + self.to_ghosts }
    }

    /// Counts a block of particles, with `GHOSTS` some ghosts, which may be unneeded.
    #[inline(always)]
    fn all<const GHOSTS: bool>(
        &self,
        first: usize,
        cells: &[[u32; 3]; SORT_BLOCK],
        cell: &mut [u32; SORT_BLOCK],
        counts: &mut [u32],
    ) {
        for (lane, [a, b, c]) in cells.iter().enumerate() {
            let to = if GHOSTS { self.cell(first + lane, [*a, *b, *c]) } else { a + b + c };
            if !GHOSTS || to != NO_CELL {
                // SAFETY: `Fractions::cells` returns cells of the grid, each of which, and that of its ghosts, has a count.
                unsafe { *counts.get_unchecked_mut(to as usize) += 1 };
            }
            cell[lane] = to;
        }
    }

    /// Counts particles, a block or fewer, some of which may be left out or invalid.
    #[inline(never)]
    fn one_by_one(
        &self,
        first: usize,
        (fixed32, cells): (&[[u32; 3]; SORT_BLOCK], &[[u32; 3]; SORT_BLOCK]),
        cell: &mut [u32],
        units: &mut [[u32; 3]],
        counts: &mut [u32],
    ) -> Result<(), EngineError> {
        let input = self.input;
        for (lane, (cell, unit)) in cell.iter_mut().zip(units).enumerate() {
            let k = first + lane;
            let x = &input.particles.x[k];
            let species = input.species_of(k);
            *cell = NO_CELL;
            if species.is_some_and(|s| s < 0) {
                continue;
            }
            if species.is_none() || input.particles.tag[k] < 1 || !self.fractions.has(x) {
                return Err(fault_of(input, k));
            }
            *cell = self.cell(k, cells[lane]);
            if *cell == NO_CELL {
                continue;
            }
            *unit = fixed32[lane];
            counts[*cell as usize] += 1;
        }
        Ok(())
    }
}

/// The error for a particle that cannot be sorted.
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
