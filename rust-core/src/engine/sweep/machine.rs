//! One precision's arrays, and the steps of an evaluation over them.

use super::arithmetic::Record;
use super::block::Block;
use super::compiled::{Compiled, Passes};
use super::frame::Frame;
use super::grid::Grid;
use super::layer::{NearPairs, Shared, Swept};
use super::pool::{Pool, part};
use super::settings::Instructions;
use super::terms::Terms;
use crate::engine::error::EngineError;
use crate::engine::excess_pass::{ExcessPass, Rows};
use crate::engine::noise::PairNoise;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::engine::tally::Tally;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Room behind the last particle: what whole vectors may read.
const SLACK: usize = 16;

/// Arrays in the order of cells, and what goes through them.
pub struct Machine<P: Compiled> {
    passes: Passes<P::Scalar, P::Record>,
    terms: Terms<P::Scalar>,
    frame: Frame,
    grid: Grid,
    cell: Vec<u32>,
    /// Fractions of the frame of the host's particles, in units of 2⁻³².
    unit: Vec<[u32; 3]>,
    /// Particles of each bin: by thread while counting, then where each thread's begin.
    counts: Vec<u32>,
    start: Vec<u32>,
    /// The host's number of each particle.
    pub order: Vec<u32>,
    x: [Vec<f32>; 3],
    records: Vec<P::Record>,
    species: Vec<u8>,
    ghost: Vec<f32>,
    owned_of_row: Vec<[u32; 2]>,
    offset: Vec<isize>,
    sums: Vec<f64>,
    densities: Vec<f64>,
    /// Densities, ψ and slopes in the order of cells.
    rows: Vec<f64>,
    excess: Vec<f64>,
    slopes: Vec<f64>,
    near: Vec<NearPairs<P::Scalar>>,
    tallies: Vec<Tally>,
    scratch: Vec<Scratch<P::Scalar>>,
    particles: usize,
    owned: usize,
    all: usize,
    columns: Vec<usize>,
    thermostat: Option<(PairNoise, f64)>,
    totals: bool,
}

/// A thread's own.
#[derive(Default)]
struct Scratch<T> {
    block: Block<T>,
    excess: ExcessPass,
    low: [f64; 3],
    high: [f64; 3],
    fault: Option<EngineError>,
}

/// What the host hands over.
pub struct Given<'a> {
    pub particles: Particles<'a>,
    /// Empty if nothing drags.
    pub v: &'a [[f64; 3]],
    /// Species of each type of particle; negative for those that take no part.
    pub kinds: &'a [i32],
    pub thermostat: Option<(PairNoise, f64)>,
    pub totals: bool,
}

impl<P: Compiled> Machine<P> {
    pub fn new(plan: &Plan, instructions: Instructions, threads: usize) -> Machine<P> {
        let terms = Terms::new(plan);
        let count = plan.species.len();
        let columns: Vec<usize> =
            plan.passes.iter().flat_map(|d| (0..count).map(move |s| d * count + s)).collect();
        let mut scratch: Vec<Scratch<P::Scalar>> = Vec::new();
        scratch.resize_with(threads, Scratch::default);
        for scratch in &mut scratch {
            scratch.block.set_passes(terms.passes.len());
        }
        let frame = Frame::around([0.0; 3], [1.0; 3], plan.dimensions, 1.0);
        Machine {
            passes: P::passes(instructions, count > 1),
            terms,
            frame,
            grid: Grid { bins: 1, rows: 1, layers: 1, row_axis: 1, layer_axis: 2, reach: 1.0, window: 1.0 },
            cell: Vec::new(),
            unit: Vec::new(),
            counts: Vec::new(),
            start: Vec::new(),
            order: Vec::new(),
            x: Default::default(),
            records: Vec::new(),
            species: Vec::new(),
            ghost: Vec::new(),
            owned_of_row: Vec::new(),
            offset: Vec::new(),
            sums: Vec::new(),
            densities: Vec::new(),
            rows: Vec::new(),
            excess: Vec::new(),
            slopes: Vec::new(),
            near: Vec::new(),
            tallies: Vec::new(),
            scratch,
            particles: 0,
            owned: 0,
            all: 0,
            columns,
            thermostat: None,
            totals: false,
        }
    }

    /// Numbers that a many-body pair needs of each particle.
    fn width(&self) -> usize {
        self.columns.len()
    }

    /// The extremes of the positions.
    pub fn extremes(&mut self, pool: &Pool, given: &Given) -> Result<([f64; 3], [f64; 3]), EngineError> {
        let threads = pool.threads();
        let scratch = Shared(self.scratch.as_mut_ptr());
        pool.run(&|t| {
            // SAFETY: each thread has its own.
            let scratch = unsafe { &mut *scratch.at(t) };
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            scratch.fault = None;
            for k in part(given.particles.x.len(), t, threads) {
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

    fn first_fault(&mut self) -> Result<(), EngineError> {
        for scratch in &mut self.scratch {
            if let Some(fault) = scratch.fault.take() {
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Sorts the particles into the bins of `grid`.
    pub fn sort(&mut self, pool: &Pool, frame: Frame, grid: Grid, given: &Given) -> Result<(), EngineError> {
        (self.frame, self.grid) = (frame, grid);
        let (threads, cells) = (pool.threads(), grid.cells());
        let all = given.particles.x.len();
        (self.all, self.owned) = (all, given.particles.owned);
        (self.thermostat, self.totals) = (given.thermostat, given.totals);
        self.cell.resize(all, 0);
        self.unit.resize(all, [0; 3]);
        self.counts.resize(threads * cells, 0);
        self.count(pool, given)?;
        self.add_up(threads);
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
            for k in part(given.particles.x.len(), t, threads) {
                let species = species_of(given, k);
                if species.is_some_and(|s| s < 0) {
                    // SAFETY: of this thread's part.
                    unsafe { *cell.at(k) = NOWHERE };
                    continue;
                }
                let u = units(frame, &inverse, &given.particles.x[k]);
                let (Some(_), Some(u), true) = (species, u, given.particles.tag[k] > 0) else {
                    scratch.fault = Some(fault_of(given, k));
                    return;
                };
                let to = grid.cell(u);
                // SAFETY: cells are of the grid; the rest is of this thread's part.
                unsafe {
                    *counts.get_unchecked_mut(to) += 1;
                    *cell.at(k) = to as u32;
                    *unit.at(k) = u;
                }
            }
        });
        self.first_fault()
    }

    /// Turns counts into where each thread's particles of a bin begin.
    fn add_up(&mut self, threads: usize) {
        let cells = self.grid.cells();
        self.start.resize(cells + 1, 0);
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
    }

    /// Particles of layer `layer`, and the first of them.
    fn layer(&self, layer: usize) -> (usize, usize) {
        let per_layer = self.grid.rows * self.grid.bins;
        let first = self.start[layer * per_layer] as usize;
        (first, self.start[(layer + 1) * per_layer] as usize - first)
    }

    /// Whether the first layer follows the last.
    fn is_ring(&self) -> bool {
        self.frame.periodic[self.grid.layer_axis]
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
        self.order.resize(self.particles, 0);
        self.records.resize(total.max(1), P::Record::default());
        self.species.resize(if several { total.max(1) } else { 0 }, 0);
        self.ghost.resize(if with_ghosts { total + SLACK } else { 0 }, 0.0);
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
                    }
                    let kind = if several { species_of(given, k).unwrap_or(0) as u32 } else { 0 };
                    let v = if moving { *given.v.get_unchecked(k) } else { [0.0; 3] };
                    *records.at(s) = P::Record::new(u, position, &v, given.particles.tag[k] as u32, kind);
                    *order.at(s) = k as u32;
                    if several {
                        *species.at(s) = kind as u8;
                    }
                    if with_ghosts {
                        *ghost.at(s) = if k < given.particles.owned { 0.0 } else { 1.0 };
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
        if self.ghost.is_empty() {
            return;
        }
        let bins = self.grid.bins;
        for row in 0..self.grid.rows * self.grid.layers {
            let (first, end) = (self.start[row * bins] as usize, self.start[(row + 1) * bins] as usize);
            let ghosts = &self.ghost[first..end];
            let owned = match ghosts.iter().position(|g| *g == 0.0) {
                Some(a) => {
                    let b = ghosts.iter().rposition(|g| *g == 0.0).unwrap_or(a);
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
        self.sums.resize(4 * sum.max(1), 0.0);
        let variables = self.width();
        self.densities.resize(if variables > 1 { variables * sum } else { 0 }, 0.0);
        self.near.resize_with(layers, NearPairs::default);
        self.tallies.clear();
        self.tallies.resize(layers, Tally::default());
    }

    /// How many particles the layer behind `layer` has.
    fn next_layer(&self, layer: usize) -> usize {
        if layer + 1 < self.grid.layers {
            self.layer(layer + 1).1
        } else if self.is_ring() {
            self.layer(0).1
        } else {
            0
        }
    }

    /// Copies of the first layer behind the last, one period further.
    fn copy_first_layer(&mut self) {
        if !self.is_ring() {
            return;
        }
        let (n, copies) = (self.particles, self.layer(0).1);
        let edge = self.frame.edge(self.grid.layer_axis);
        for c in 0..3 {
            for k in 0..copies {
                self.x[c][n + k] = (self.x[c][k] as f64 + edge[c]) as f32;
            }
        }
        self.records.copy_within(..copies, n);
        if !self.species.is_empty() {
            self.species.copy_within(..copies, n);
        }
    }

    fn swept(&mut self) -> Swept<'_, P::Scalar, P::Record> {
        Swept {
            frame: &self.frame,
            grid: &self.grid,
            start: &self.start,
            x: [&self.x[0], &self.x[1], &self.x[2]],
            records: &self.records,
            species: &self.species,
            ghost: &self.ghost,
            owned_of_row: &self.owned_of_row,
            particles: self.particles,
            terms: &self.terms,
            slopes: &self.slopes,
            offset: &self.offset,
            sums: Shared(self.sums.as_mut_ptr()),
            densities: Shared(self.densities.as_mut_ptr()),
            variables: self.columns.len(),
            thermostat: self.thermostat,
        }
    }

    /// The first pass over all layers.
    pub fn first(&mut self, pool: &Pool) {
        let layers = self.grid.layers;
        let ranges: Vec<(usize, usize)> = (0..layers)
            .map(|l| {
                let (first, own) = self.layer(l);
                let begin = (first as isize + self.offset[l]) as usize;
                (begin, begin + own + self.next_layer(l))
            })
            .collect();
        let variables = self.width();
        let pass = self.passes.first[self.totals as usize];
        let (near, tallies, scratch) = (
            Shared(self.near.as_mut_ptr()),
            Shared(self.tallies.as_mut_ptr()),
            Shared(self.scratch.as_mut_ptr()),
        );
        let next = AtomicUsize::new(0);
        let swept = self.swept();
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch, each layer is done once, and writes its own.
            unsafe {
                let scratch = &mut *scratch.at(t);
                scratch.block.reserve(1024);
                loop {
                    let layer = next.fetch_add(1, Ordering::Relaxed);
                    if layer >= layers {
                        return;
                    }
                    let (begin, end) = ranges[layer];
                    std::slice::from_raw_parts_mut(swept.sums.at(4 * begin), 4 * (end - begin)).fill(0.0);
                    if variables > 1 {
                        let count = variables * (end - begin);
                        std::slice::from_raw_parts_mut(swept.densities.at(variables * begin), count)
                            .fill(0.0);
                    }
                    *tallies.at(layer) = pass(&swept, layer, &mut scratch.block, &mut *near.at(layer));
                }
            }
        });
    }

    /// The accumulators of a particle of a layer: its layer's, and that of the layer before.
    fn accumulators(&self, layer: usize) -> (isize, Option<isize>) {
        let before = match layer {
            0 if self.is_ring() => Some(self.offset[self.grid.layers - 1] + self.particles as isize),
            0 => None,
            _ => Some(self.offset[layer - 1]),
        };
        (self.offset[layer], before)
    }

    /// ψ and its slopes at the densities of the first pass.
    pub fn excess(&mut self, pool: &Pool, plan: &Plan, tag: &[i32]) -> Result<(), EngineError> {
        let (width, n) = (self.width(), self.particles);
        let copies = if self.is_ring() { self.layer(0).1 } else { 0 };
        self.excess.resize(n, 0.0);
        self.rows.resize(width * n, 0.0);
        self.slopes.resize(width * (n + copies), 0.0);
        if plan.excess.iter().all(|e| matches!(e, crate::engine::excess::ExcessPlan::Constant(0.0))) {
            self.excess.fill(0.0);
            return Ok(());
        }
        let own: Vec<f64> = self.own_weights(plan);
        let (excess, slopes, rows, scratch) = (
            Shared(self.excess.as_mut_ptr()),
            Shared(self.slopes.as_mut_ptr()),
            Shared(self.rows.as_mut_ptr()),
            Shared(self.scratch.as_mut_ptr()),
        );
        let next = AtomicUsize::new(0);
        let this = &*self;
        pool.run(&|t| {
            // SAFETY: each thread has its own scratch, each layer is done once, and writes its own.
            let scratch = unsafe { &mut *scratch.at(t) };
            scratch.fault = None;
            loop {
                let layer = next.fetch_add(1, Ordering::Relaxed);
                if layer >= this.grid.layers {
                    return;
                }
                let (first, count) = this.layer(layer);
                // SAFETY: as above.
                let (excess, slopes, densities) = unsafe {
                    (
                        std::slice::from_raw_parts_mut(excess.at(first), count),
                        std::slice::from_raw_parts_mut(slopes.at(width * first), width * count),
                        std::slice::from_raw_parts_mut(rows.at(width * first), width * count),
                    )
                };
                this.gather_densities(layer, &own, densities);
                let mut rows = Rows { first, columns: &this.columns, densities, excess, slopes };
                let species = |s: usize| match (this.ghost.get(s), this.species.get(s)) {
                    (Some(ghost), _) if *ghost > 0.0 => -1,
                    (_, Some(species)) => *species as i32,
                    _ => 0,
                };
                let tag = |s: usize| tag[this.order[s] as usize];
                if let Err(fault) = scratch.excess.run(plan, first..first + count, species, tag, &mut rows) {
                    scratch.fault = Some(fault);
                    return;
                }
            }
        });
        self.first_fault()?;
        self.slopes.copy_within(..width * copies, width * n);
        Ok(())
    }

    /// `w(0)` by species and column, where a density counts the particle itself.
    fn own_weights(&self, plan: &Plan) -> Vec<f64> {
        let (count, width) = (plan.species.len(), self.width());
        let mut own = vec![0.0; count * width];
        for (k, d) in plan.passes.iter().enumerate() {
            if plan.densities[*d].includes_self {
                for s in 0..count {
                    own[s * width + k * count + s] = plan.densities[*d].kernel.value(0.0);
                }
            }
        }
        own
    }

    /// Densities of the particles of a layer.
    fn gather_densities(&self, layer: usize, own: &[f64], out: &mut [f64]) {
        let (first, count) = self.layer(layer);
        let width = self.width();
        let (here, before) = self.accumulators(layer);
        for k in 0..count {
            let s = (first + k) as isize;
            let species = self.species.get(first + k).map_or(0, |s| *s as usize);
            for c in 0..width {
                let of = |at: isize| match width {
                    1 => self.sums[4 * at as usize + 3],
                    _ => self.densities[width * at as usize + c],
                };
                let mut n = of(s + here);
                if let Some(before) = before {
                    n += of(s + before);
                }
                out[width * k + c] = n + own[species * width + c];
            }
        }
    }

    /// Slopes from the order of cells to the host's, those of particles it owns.
    pub fn slopes_to_host(&self, out: &mut Vec<f64>) {
        let width = self.width();
        out.clear();
        out.resize(width * self.all, 0.0);
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k < self.owned {
                out[width * k..][..width].copy_from_slice(&self.slopes[width * s..][..width]);
            }
        }
    }

    /// Slopes of ghosts from the host.
    pub fn slopes_from_host(&mut self, slopes: &[f64]) {
        let width = self.width();
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k >= self.owned {
                self.slopes[width * s..][..width].copy_from_slice(&slopes[width * k..][..width]);
            }
        }
    }

    /// The second pass over all layers.
    pub fn second(&mut self, pool: &Pool) {
        if self.terms.passes.is_empty() {
            return;
        }
        let layers = self.grid.layers;
        let pass = self.passes.second[self.totals as usize];
        let (near, tallies) = (Shared(self.near.as_mut_ptr()), Shared(self.tallies.as_mut_ptr()));
        let next = AtomicUsize::new(0);
        let swept = self.swept();
        pool.run(&|_| {
            loop {
                let layer = next.fetch_add(1, Ordering::Relaxed);
                if layer >= layers {
                    return;
                }
                // SAFETY: each layer is done once, and writes its own.
                unsafe { pass(&swept, layer, &*near.at(layer), &mut (*tallies.at(layer)).virial) };
            }
        });
    }

    /// Writes the forces on owned particles, or adds them to what is there.
    pub fn forces(
        &mut self,
        pool: &Pool,
        force: &mut [[f64; 3]],
        add: bool,
        tag: &[i32],
    ) -> Result<(), EngineError> {
        let out = Shared(force.as_mut_ptr());
        let next = AtomicUsize::new(0);
        let lost: Mutex<Option<i32>> = Mutex::new(None);
        let this = &*self;
        pool.run(&|_| {
            loop {
                let layer = next.fetch_add(1, Ordering::Relaxed);
                if layer >= this.grid.layers {
                    return;
                }
                let (first, count) = this.layer(layer);
                let (here, before) = this.accumulators(layer);
                for s in first..first + count {
                    let k = this.order[s] as usize;
                    if k >= this.owned {
                        continue;
                    }
                    let at = 4 * (s as isize + here) as usize;
                    let mut f = [this.sums[at], this.sums[at + 1], this.sums[at + 2]];
                    if let Some(before) = before {
                        let at = 4 * (s as isize + before) as usize;
                        for c in 0..3 {
                            f[c] += this.sums[at + c];
                        }
                    }
                    if !(f[0] + f[1] + f[2]).is_finite() {
                        let mut lost = lost.lock().unwrap_or_else(|e| e.into_inner());
                        *lost = Some(lost.map_or(tag[k], |t| t.min(tag[k])));
                    }
                    // SAFETY: `k` is an owned particle, and no other thread's.
                    unsafe {
                        let out = &mut *out.at(k);
                        if add {
                            for c in 0..3 {
                                f[c] += out[c];
                            }
                        }
                        *out = f;
                    }
                }
            }
        });
        match lost.into_inner().unwrap_or_else(|e| e.into_inner()) {
            None => Ok(()),
            Some(tag) => Err(EngineError::Force { tag }),
        }
    }

    /// Energies and virials of the last evaluation, summed in the order of layers.
    pub fn tally(&self) -> Tally {
        let mut tally = Tally::default();
        for layer in &self.tallies {
            tally += *layer;
        }
        if self.totals {
            for (s, excess) in self.excess.iter().enumerate() {
                if self.ghost.get(s).is_none_or(|g| *g == 0.0) {
                    tally.excess += excess;
                }
            }
        }
        tally
    }

    /// ψ of owned particles and their densities, `variables` each, in the host's order.
    pub fn to_host(&self, variables: usize, excess: &mut Vec<f64>, densities: &mut Vec<f64>) {
        let width = self.width();
        excess.clear();
        excess.resize(self.owned, 0.0);
        densities.clear();
        densities.resize(variables * self.owned, 0.0);
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k < self.owned {
                excess[k] = self.excess[s];
                for (c, v) in self.columns.iter().enumerate() {
                    densities[variables * k + v] = self.rows[width * s + c];
                }
            }
        }
    }

    pub fn out_of_bounds(&self) -> [u64; 2] {
        let mut sum = [0; 2];
        for scratch in &self.scratch {
            for k in 0..2 {
                sum[k] += scratch.excess.out_of_bounds[k];
            }
        }
        sum
    }

    /// Bytes held in arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        fn bytes<T>(array: &Vec<T>) -> usize {
            array.capacity() * size_of::<T>()
        }
        let near: usize = self
            .near
            .iter()
            .map(|n| {
                n.rows.iter().map(bytes).sum::<usize>()
                    + n.counts.iter().map(bytes).sum::<usize>()
                    + n.distances.iter().map(bytes).sum::<usize>()
                    + n.shares.iter().map(bytes).sum::<usize>()
            })
            .sum();
        near + bytes(&self.cell)
            + bytes(&self.unit)
            + bytes(&self.counts)
            + bytes(&self.start)
            + bytes(&self.order)
            + self.x.iter().map(bytes).sum::<usize>()
            + bytes(&self.records)
            + bytes(&self.species)
            + bytes(&self.ghost)
            + bytes(&self.sums)
            + bytes(&self.densities)
            + bytes(&self.rows)
            + bytes(&self.excess)
            + bytes(&self.slopes)
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

/// Fractions of the frame in units of 2⁻³²; they wrap along periods. `None` if the position is not finite.
#[inline(always)]
fn units(frame: &Frame, inverse: &[f64; 3], x: &[f64; 3]) -> Option<[u32; 3]> {
    let s = frame.fraction(x, inverse);
    let t = s.map(|s| s * TWO_TO_32);
    // Far below what a whole number of 64 bits holds.
    let far = t[0].abs() + t[1].abs() + t[2].abs();
    if far.is_nan() || far > 1e18 {
        return None;
    }
    let mut u = [0; 3];
    for c in 0..3 {
        // SAFETY: finite and in range, as just seen.
        let whole: i64 = unsafe { t[c].to_int_unchecked() };
        u[c] = if frame.periodic[c] { whole as u32 } else { whole.clamp(0, u32::MAX as i64) as u32 };
    }
    Some(u)
}
