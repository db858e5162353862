//! Particles into the order of cells.

use super::{Given, Machine, SLACK, Shared, Sum};
use crate::engine::error::EngineError;
use crate::engine::sweep::arithmetic::Record;
use crate::engine::sweep::compiled::Compiled;
use crate::engine::sweep::frame::Frame;
use crate::engine::sweep::grid::Grid;
use crate::engine::sweep::many_body::NEAR_BITS;
use crate::engine::sweep::pool::{Pool, part};
use crate::engine::sweep::quantum::Quantum;
use crate::engine::tally::Tally;

impl<P: Compiled> Machine<P> {
    /// The extremes of the positions of owned particles.
    pub fn extremes(&mut self, pool: &Pool, given: &Given) -> Result<([f64; 3], [f64; 3]), EngineError> {
        let threads = pool.threads();
        let scratch = Shared(self.scratch.as_mut_ptr());
        pool.run(&|t| {
            // SAFETY: each thread has its own.
            let scratch = unsafe { &mut *scratch.at(t) };
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            scratch.fault = None;
            for k in part(given.particles.owned, t, threads) {
                let x = &given.particles.x[k];
                let sum = x[0].abs() + x[1].abs() + x[2].abs();
                if sum.is_nan() || sum > 1e100 {
                    if species_of(given, k).is_some_and(|s| s < 0) {
                        continue;
                    }
                    scratch.fault = Some(EngineError::Position { tag: given.particles.tag[k] });
                    return;
                }
                for c in 0..3 {
                    low[c] = low[c].min(x[c]);
                    high[c] = high[c].max(x[c]);
                }
            }
            (scratch.low, scratch.high) = (low, high);
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

    /// Sorts the particles into the bins of `grid`.
    pub fn sort(&mut self, pool: &Pool, frame: Frame, grid: Grid, given: &Given) -> Result<(), EngineError> {
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
        self.place(pool, given);
        self.copy_first_layer();
        Ok(())
    }

    /// The bin of each particle, and how many of each thread's particles are in each.
    fn count(&mut self, pool: &Pool, given: &Given) -> Result<(), EngineError> {
        let (threads, cells) = (pool.threads(), self.grid.cells());
        let (frame, grid) = (&self.frame, &self.grid);
        let inverse = frame.length.map(|l| 1.0 / l);
        let (cell, unit, counts, scratch) = (
            Shared(self.cell.as_mut_ptr()),
            Shared(self.unit.as_mut_ptr()),
            Shared(self.counts.as_mut_ptr()),
            Shared(self.scratch.as_mut_ptr()),
        );
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch, counts and part of the particles.
            let (scratch, counts) =
                unsafe { (&mut *scratch.at(t), std::slice::from_raw_parts_mut(counts.at(t * cells), cells)) };
            scratch.fault = None;
            counts.fill(0);
            let all = part(given.particles.x.len(), t, threads);
            let mut first = all.start;
            while first < all.end {
                let some = first..all.end.min(first + AT_ONCE);
                let mut units = [[0; 3]; AT_ONCE];
                let fine = fractions(frame, &inverse, &given.particles.x[some.clone()], &mut units);
                for (k, u) in some.clone().zip(&units) {
                    let species = species_of(given, k);
                    if species.is_some_and(|s| s < 0) {
                        // SAFETY: of this thread's part.
                        unsafe { *cell.at(k) = NOWHERE };
                        continue;
                    }
                    let known = species.is_some() && given.particles.tag[k] > 0;
                    if !known || !(fine || is_fine(frame, &inverse, &given.particles.x[k])) {
                        scratch.fault = Some(fault_of(given, k));
                        return;
                    }
                    // Ghosts out of reach of all that are owned.
                    if k >= given.particles.owned && !frame.has(&given.particles.x[k]) {
                        // SAFETY: as above.
                        unsafe { *cell.at(k) = NOWHERE };
                        continue;
                    }
                    let to = grid.cell(*u);
                    // SAFETY: cells are of the grid; the rest is of this thread's part.
                    unsafe {
                        *counts.get_unchecked_mut(to) += 1;
                        *cell.at(k) = to as u32;
                        *unit.at(k) = *u;
                    }
                }
                first = some.end;
            }
        });
        self.first_fault()
    }

    /// Turns counts into where each thread's particles of a bin begin.
    fn add_up(&mut self, threads: usize) {
        let cells = self.grid.cells();
        let per_layer = self.grid.rows * self.grid.bins;
        self.start.resize(cells + 1 + if self.is_ring() { per_layer } else { 0 }, 0);
        let mut sum = 0;
        for cell in 0..cells {
            self.start[cell] = sum;
            for t in 0..threads {
                let count = &mut self.counts[t * cells + cell];
                let next = sum + *count;
                *count = sum;
                sum = next;
            }
        }
        self.start[cells] = sum;
        self.particles = sum as usize;
        // The copy of the first layer.
        for cell in cells + 1..self.start.len() {
            self.start[cell] = sum + self.start[cell - cells];
        }
    }

    /// Fills the arrays in the order of bins, and lays out accumulators.
    fn place(&mut self, pool: &Pool, given: &Given) {
        let (threads, cells) = (pool.threads(), self.grid.cells());
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
        self.order.resize(self.particles, 0);
        self.records.resize(total + SLACK, P::Record::default());
        self.species.resize(if several { total.max(1) } else { 0 }, 0);
        self.ghost.resize(if with_ghosts { total + SLACK } else { 0 }, false);
        let frame = &self.frame;
        let tilted = frame.is_tilted();
        let flat = if frame.dimensions == 3 { 1.0 } else { 0.0 };
        let scale =
            [frame.length[0] / TWO_TO_32, frame.length[1] / TWO_TO_32, flat * frame.length[2] / TWO_TO_32];
        let (order, records, species, ghost) = (
            Shared(self.order.as_mut_ptr()),
            Shared(self.records.as_mut_ptr()),
            Shared(self.species.as_mut_ptr()),
            Shared(self.ghost.as_mut_ptr()),
        );
        let x =
            [Shared(self.x[0].as_mut_ptr()), Shared(self.x[1].as_mut_ptr()), Shared(self.x[2].as_mut_ptr())];
        let q =
            [Shared(self.q[0].as_mut_ptr()), Shared(self.q[1].as_mut_ptr()), Shared(self.q[2].as_mut_ptr())];
        let quantum = self.quantum;
        let (cell, unit, counts) = (&self.cell, &self.unit, Shared(self.counts.as_mut_ptr()));
        let moving = given.thermostat.is_some();
        pool.run(&|t| {
            // SAFETY: counts are this thread's own; every particle has a place of its own.
            unsafe {
                let counts = std::slice::from_raw_parts_mut(counts.at(t * cells), cells);
                for k in part(given.particles.x.len(), t, threads) {
                    let to = *cell.get_unchecked(k);
                    if to == NOWHERE {
                        continue;
                    }
                    let place = counts.get_unchecked_mut(to as usize);
                    let s = *place as usize;
                    *place += 1;
                    let position = given.particles.x.get_unchecked(k);
                    let u = *unit.get_unchecked(k);
                    let mut point = [u[0] as f64 * scale[0], u[1] as f64 * scale[1], u[2] as f64 * scale[2]];
                    if tilted {
                        point = frame.point(&u.map(|u| u as f64 / TWO_TO_32));
                    }
                    for c in 0..3 {
                        *x[c].at(s) = point[c] as f32;
                        *q[c].at(s) = quantum.of(point[c]);
                    }
                    let kind = if several { species_of(given, k).unwrap_or(0) as u32 } else { 0 };
                    let v = if moving { *given.v.get_unchecked(k) } else { [0.0; 3] };
                    *records.at(s) = P::Record::new(u, position, &v, given.particles.tag[k] as u32, kind);
                    *order.at(s) = k as u32;
                    if several {
                        *species.at(s) = kind as u8;
                    }
                    if with_ghosts {
                        *ghost.at(s) = k >= given.particles.owned;
                    }
                }
            }
        });
        self.find_owned();
        self.lay_out();
    }

    /// The owned particles of each row, if there are ghosts.
    fn find_owned(&mut self) {
        self.owned_of_row.clear();
        self.owned_bits.clear();
        if self.ghost.is_empty() {
            return;
        }
        let bits = |ghosts: &[bool]| ghosts.iter().enumerate().map(|(k, g)| (!g as u8) << k).sum::<u8>();
        self.owned_bits.extend(self.ghost.chunks(8).map(bits));
        self.owned_bits.resize(self.owned_bits.len() + SLACK, 0);
        let bins = self.grid.bins;
        for row in 0..self.grid.rows * self.grid.layers {
            let (first, end) = (self.start[row * bins] as usize, self.start[(row + 1) * bins] as usize);
            let ghosts = &self.ghost[first..end];
            let owned = match ghosts.iter().position(|g| !*g) {
                Some(a) => {
                    let b = ghosts.iter().rposition(|g| !*g).unwrap_or(a);
                    [(first + a) as u32, (first + b + 1) as u32]
                }
                None => [0, 0],
            };
            self.owned_of_row.push(owned);
        }
    }

    /// Accumulators of a layer: of its own particles, then of those of the next.
    fn lay_out(&mut self) {
        let layers = self.grid.layers;
        self.offset.clear();
        let mut sum = 0;
        for layer in 0..layers {
            let (first, own) = self.layer(layer);
            self.offset.push(sum as isize - first as isize);
            sum += own + self.next_layer(layer);
        }
        self.sums.resize(sum.max(1), Sum::default());
        let variables = self.width();
        self.densities.resize(if variables > 1 { variables * sum } else { 0 }, 0.0);
        self.tallies.clear();
        self.tallies.resize(layers, Tally::default());
    }

    /// Copies of the first layer behind the last, one period further.
    fn copy_first_layer(&mut self) {
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

/// The bin of particles that take no part.
const NOWHERE: u32 = u32::MAX;

const TWO_TO_32: f64 = 4_294_967_296.0;

#[inline(always)]
fn species_of(given: &Given, k: usize) -> Option<i32> {
    given.kinds.get(given.particles.kind[k] as usize).copied()
}

/// What is wrong with a particle that cannot be sorted.
#[cold]
#[inline(never)]
fn fault_of(given: &Given, k: usize) -> EngineError {
    let (tag, kind) = (given.particles.tag[k], given.particles.kind[k]);
    match species_of(given, k) {
        None => EngineError::Kind { tag, kind },
        Some(_) if tag < 1 => EngineError::Tag { tag },
        Some(_) => EngineError::Position { tag },
    }
}

/// Particles whose fractions are computed at once.
const AT_ONCE: usize = 32;

/// Adding this leaves the nearest whole number in the low bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Far below what a whole number in the low bits holds.
const FAR: f64 = 1e15;

/// Fractions of the frame in units of 2⁻³²; they wrap along periods, and are never beyond the ends where there are
/// none. Whether all are finite and not too far away.
#[inline(always)]
fn fractions(frame: &Frame, inverse: &[f64; 3], x: &[[f64; 3]], units: &mut [[u32; 3]; AT_ONCE]) -> bool {
    let mut scaled = [[0.0; 3]; AT_ONCE];
    if frame.is_tilted() {
        for (t, x) in scaled.iter_mut().zip(x) {
            *t = frame.fraction(x, inverse).map(|s| s * TWO_TO_32);
        }
    } else {
        let flat = if frame.dimensions == 3 { inverse[2] } else { 0.0 };
        let scale = [inverse[0] * TWO_TO_32, inverse[1] * TWO_TO_32, flat * TWO_TO_32];
        for (t, x) in scaled.iter_mut().zip(x) {
            for c in 0..3 {
                t[c] = (x[c] - frame.origin[c]) * scale[c];
            }
        }
    }
    let mut fine = true;
    for t in scaled.as_flattened() {
        // Not where it is not a number.
        fine &= t.abs() < FAR;
    }
    for (u, t) in units.as_flattened_mut().iter_mut().zip(scaled.as_flattened()) {
        *u = (t + WHOLE).to_bits() as u32;
    }
    if !frame.periodic.iter().all(|p| *p) {
        for (u, t) in units.iter_mut().zip(&scaled) {
            for c in 0..3 {
                if !frame.periodic[c] {
                    u[c] = t[c].clamp(0.0, TWO_TO_32 - 1.0) as u32;
                }
            }
        }
    }
    fine
}

fn is_fine(frame: &Frame, inverse: &[f64; 3], x: &[f64; 3]) -> bool {
    frame.fraction(x, inverse).iter().all(|s| (s * TWO_TO_32).abs() < FAR)
}
