//! Particles into the order of cells.

mod count;
mod fill;
mod fractions;
mod span;

use super::{Arrays, Given, Machine, SLACK, Shared, vectors};
use crate::engine::error::EngineError;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::frame::Frame;
use crate::engine::sweep::grid::Grid;
use crate::engine::sweep::layer::OwnedOfRow;
use crate::engine::sweep::many_body::NEAR_BITS;
use crate::engine::sweep::pool::{Pool, part};
use crate::engine::sweep::quantum::Quantum;
use crate::engine::tally::Tally;
use count::{Count, CountSome};
use fill::{Fill, FillSome};
use fractions::Fractions;
use span::SpanSome;
use std::ops::Range;

impl<P: Compiled> Machine<P> {
    /// The extremes of the positions of owned particles.
    pub fn extremes(&mut self, pool: &Pool, given: &Given) -> Result<([f64; 3], [f64; 3]), EngineError> {
        let threads = pool.threads();
        let scratch = Shared(self.scratch.as_mut_ptr());
        pool.run(&|t| {
            // SAFETY: each thread has its own.
            let scratch = unsafe { &mut *scratch.at(t) };
            let span = SpanSome { given, particles: part(given.particles.owned, t, threads) };
            scratch.fault = None;
            match vectors::run(self.instructions, span) {
                Ok(span) => [scratch.low, scratch.high] = span,
                Err(fault) => scratch.fault = Some(fault),
            }
        });
        self.first_fault()?;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for scratch in &self.scratch {
            for c in 0..3 {
                low[c] = low[c].min(scratch.low[c]);
                high[c] = high[c].max(scratch.high[c]);
            }
        }
        if low[0] > high[0] { Ok(([0.0; 3], [0.0; 3])) } else { Ok((low, high)) }
    }

    /// The particles in the order of the bins of `grid`, and room for them in the arrays.
    pub fn find_order(
        &mut self,
        pool: &Pool,
        frame: Frame,
        grid: Grid,
        given: &Given,
    ) -> Result<(), EngineError> {
        (self.frame, self.grid) = (frame, grid);
        self.quantum = Quantum::new(&frame, &grid);
        let (threads, cells) = (pool.threads(), grid.cells());
        let all = given.particles.x.len();
        (self.all, self.owned) = (all, given.particles.owned);
        (self.thermostat, self.totals) = (given.thermostat, given.totals);
        self.cell.resize(all, 0);
        self.unit.resize(all, [0; 3]);
        self.counts.resize(threads * cells, 0);
        self.count(pool, given)?;
        self.add_up(threads);
        let crowded = |layer| (self.layer(layer).1 + self.next_layer(layer)) >> NEAR_BITS > 0;
        if (0..grid.layers).any(crowded) {
            return Err(EngineError::Host("2^25 particles or more in two layers next to each other"));
        }
        self.place(pool);
        self.make_room(given);
        self.find_owned();
        self.tallies.clear();
        self.tallies.resize(grid.layers, Tally::default());
        Ok(())
    }

    /// The bin of each particle, and how many of each thread's particles are in each.
    fn count(&mut self, pool: &Pool, given: &Given) -> Result<(), EngineError> {
        let (threads, cells) = (pool.threads(), self.grid.cells());
        let count = Count {
            given,
            frame: &self.frame,
            fractions: Fractions::new(&self.frame, &self.grid),
            first_kind: Count::first_kind(given),
            cell: Shared(self.cell.as_mut_ptr()),
            unit: Shared(self.unit.as_mut_ptr()),
        };
        let (counts, scratch) = (Shared(self.counts.as_mut_ptr()), Shared(self.scratch.as_mut_ptr()));
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch, counts and part of the particles.
            unsafe {
                let counts = std::slice::from_raw_parts_mut(counts.at(t * cells), cells);
                let particles = part(given.particles.x.len(), t, threads);
                let some = CountSome { count: &count, particles, counts };
                (*scratch.at(t)).fault = vectors::run(self.instructions, some).err();
            }
        });
        self.first_fault()
    }

    /// Turns counts into where each thread's particles of a bin begin.
    fn add_up(&mut self, threads: usize) {
        let cells = self.grid.cells();
        let per_layer = self.grid.rows * self.grid.bins;
        self.start.resize(cells + 1 + if self.is_ring() { per_layer } else { 0 }, 0);
        let [first, rest @ ..] = &mut self.start[..] else { return };
        *first = 0;
        // How many there are in each bin, then where it begins, and last where it ends: the beginning of the next.
        let ends = &mut rest[..cells];
        ends.copy_from_slice(&self.counts[..cells]);
        for counts in self.counts[..threads * cells].chunks_exact(cells).skip(1) {
            for (end, count) in ends.iter_mut().zip(counts) {
                *end += count;
            }
        }
        let mut sum = 0;
        for end in &mut *ends {
            let many = *end;
            *end = sum;
            sum += many;
        }
        for counts in self.counts[..threads * cells].chunks_exact_mut(cells) {
            for (end, count) in ends.iter_mut().zip(counts) {
                let many = *count;
                *count = *end;
                *end += many;
            }
        }
        self.particles = sum as usize;
        // The copy of the first layer.
        for cell in cells + 1..self.start.len() {
            self.start[cell] = sum + self.start[cell - cells];
        }
    }

    /// The particles in the order of bins: within one in the order of their numbers.
    fn place(&mut self, pool: &Pool) {
        let (threads, cells) = (pool.threads(), self.grid.cells());
        self.order.resize(self.particles, 0);
        let (cell, all) = (&self.cell, self.all);
        let (order, counts) = (Shared(self.order.as_mut_ptr()), Shared(self.counts.as_mut_ptr()));
        pool.run(&|t| {
            // SAFETY: counts are this thread's own; every particle has a place of its own.
            unsafe {
                let counts = std::slice::from_raw_parts_mut(counts.at(t * cells), cells);
                for k in part(all, t, threads) {
                    let to = *cell.get_unchecked(k);
                    if to == NOWHERE {
                        continue;
                    }
                    let place = counts.get_unchecked_mut(to as usize);
                    *order.at(*place as usize) = k as u32;
                    *place += 1;
                }
            }
        });
    }

    /// Room for the particles and the copies of the first layer.
    fn make_room(&mut self, given: &Given) {
        let copies = if self.is_ring() { self.layer(0).1 } else { 0 };
        let total = self.particles + copies;
        let with_ghosts = given.particles.owned < given.particles.x.len();
        let several = self.terms.species > 1;
        for x in &mut self.x {
            x.resize(total + SLACK, 0.0);
        }
        // A chunk of sixteen, and one that is not used, may begin behind the last.
        for q in &mut self.q {
            q.resize(total + 4 * SLACK, 0);
        }
        self.records.resize(total + SLACK, P::Record::default());
        self.species.resize(if several { total.max(1) } else { 0 }, 0);
        self.ghost.resize(if with_ghosts { (total + SLACK).next_multiple_of(8) } else { 0 }, false);
    }

    /// Fills some places of the arrays: from a multiple of [`SLACK`] on, and up to one, or to the last.
    ///
    /// # Safety
    /// No other thread fills them, nor reads them meanwhile; behind the last whole vectors are written.
    pub(super) unsafe fn fill_places(&self, arrays: Arrays<P>, given: &Given, places: Range<usize>) {
        let several = self.terms.species > 1;
        let fill = &Fill {
            given,
            frame: &self.frame,
            quantum: self.quantum,
            order: &self.order,
            unit: &self.unit,
            x: arrays.x,
            q: arrays.q,
            records: arrays.records,
            species: several.then_some(arrays.species),
            far: self.is_far(),
        };
        let instructions = self.instructions;
        match (given.thermostat.is_some(), several) {
            (true, true) => vectors::run(instructions, FillSome::<_, true, true> { fill, places }),
            (true, false) => vectors::run(instructions, FillSome::<_, true, false> { fill, places }),
            (false, true) => vectors::run(instructions, FillSome::<_, false, true> { fill, places }),
            (false, false) => vectors::run(instructions, FillSome::<_, false, false> { fill, places }),
        }
    }

    /// Who is a ghost, and the owned particles of each row, those of copies too, if there are ghosts.
    fn find_owned(&mut self) {
        self.owned_of_row.clear();
        self.owned_bits.clear();
        if self.ghost.is_empty() {
            return;
        }
        for (ghost, k) in self.ghost.iter_mut().zip(&self.order) {
            *ghost = *k as usize >= self.owned;
        }
        if self.is_ring() {
            let (_, copies) = self.layer(0);
            self.ghost.copy_within(..copies, self.particles);
        }
        self.owned_bits.extend(self.ghost.as_chunks::<8>().0.iter().map(bits_of_owned));
        self.owned_bits.resize(self.owned_bits.len() + SLACK, 0);
        let bins = self.grid.bins;
        for row in 0..(self.start.len() - 1) / bins {
            let (first, end) = (self.start[row * bins] as usize, self.start[(row + 1) * bins] as usize);
            let ghosts = &self.ghost[first..end];
            let mut owned = OwnedOfRow { ends: [0; 2], with_ghosts: ghosts.contains(&true) };
            if let Some(a) = ghosts.iter().position(|g| !*g) {
                let b = ghosts.iter().rposition(|g| !*g).unwrap_or(a);
                owned.ends = [first + a, first + b + 1].map(|at| at as u32);
            }
            self.owned_of_row.push(owned);
        }
    }

    /// Copies of the first layer behind the last, one period further.
    pub(super) fn copy_first_layer(&mut self) {
        if !self.is_ring() {
            return;
        }
        let (n, copies) = (self.particles, self.layer(0).1);
        let edge = self.frame.edge(self.grid.layer_axis);
        for c in 0..3 {
            let shift = (edge[c] * self.quantum.per_length).round() as i64 as u16;
            for k in 0..copies {
                self.x[c][n + k] = (self.x[c][k] as f64 + edge[c]) as f32;
                self.q[c][n + k] = self.q[c][k].wrapping_add(shift);
            }
        }
        self.records.copy_within(..copies, n);
        if !self.species.is_empty() {
            self.species.copy_within(..copies, n);
        }
    }
}

/// A bit for each of eight particles that is not a ghost.
#[inline(always)]
fn bits_of_owned(ghosts: &[bool; 8]) -> u8 {
    // The product has the lowest bit of each byte next to each other at its top.
    let bytes = u64::from_le_bytes(ghosts.map(u8::from));
    !(bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// The bin of particles that take no part.
const NOWHERE: u32 = u32::MAX;

const TWO_TO_32: f64 = 4_294_967_296.0;

/// Far below what a whole number in the low bits of a double holds.
const FAR: f64 = 1e15;

#[cfg(test)]
mod tests;
