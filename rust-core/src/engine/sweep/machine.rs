//! One precision's arrays, and the steps of an evaluation over them.

mod excess;
mod host;
mod layout;
mod sort;
mod stream;
pub mod vectors;

pub use host::Out;

use super::block::Block;
use super::compiled::{Compiled, Passes};
use super::frame::Frame;
use super::grid::Grid;
use super::layer::{OwnedOfRow, Shared, Swept};
use super::many_body::NearPairs;
use super::quantum::Quantum;
use super::scatter::Sum;
use super::settings::Instructions;
use super::simd::Scalar;
use super::terms::Terms;
use super::whole::SLOPES;
use crate::engine::error::EngineError;
use crate::engine::excess_pass::ExcessPass;
use crate::engine::noise::PairNoise;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::engine::tally::{Tally, Want};

/// Room behind the last particle: what whole vectors may read.
const SLACK: usize = 16;

/// Up to so many particles all arrays stay in the cache, and none of them is called there in advance. Tests have few.
const IN_CACHE: usize = if cfg!(test) { 100 } else { 1 << 14 };

/// Arrays in the order of cells, and what goes through them.
pub struct Machine<P: Compiled> {
    instructions: Instructions,
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
    quantum: Quantum,
    q: [Vec<u16>; 3],
    records: Vec<P::Record>,
    species: Vec<u8>,
    ghost: Vec<bool>,
    owned_bits: Vec<u8>,
    owned_of_row: Vec<OwnedOfRow>,
    offset: Vec<isize>,
    sums: Vec<Sum>,
    densities: Vec<Sum>,
    /// Densities, ψ and slopes in the order of cells.
    rows: Vec<f64>,
    excess: Vec<f64>,
    slopes: Vec<f64>,
    /// Slopes as the second pass reads them if pairs are kept whole.
    slope_rows: Vec<P::Scalar>,
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

/// Where threads write, each its own part.
struct Arrays<P: Compiled> {
    x: [Shared<f32>; 3],
    q: [Shared<u16>; 3],
    records: Shared<P::Record>,
    species: Shared<u8>,
    sums: Shared<Sum>,
    densities: Shared<Sum>,
    rows: Shared<f64>,
    excess: Shared<f64>,
    slopes: Shared<f64>,
    slope_rows: Shared<P::Scalar>,
    near: Shared<NearPairs<P::Scalar>>,
    tallies: Shared<Tally>,
    scratch: Shared<Scratch<P::Scalar>>,
}

impl<P: Compiled> Clone for Arrays<P> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<P: Compiled> Copy for Arrays<P> {}

/// A thread's own.
struct Scratch<T> {
    block: Block<T>,
    excess: ExcessPass,
    low: [f64; 3],
    high: [f64; 3],
    fault: Option<EngineError>,
    /// The lowest tag of the particles whose forces are not finite.
    lost: Option<i32>,
}

impl<T: Scalar> Scratch<T> {
    fn new(passes: usize, instructions: Instructions) -> Scratch<T> {
        let mut block = Block::default();
        block.set_passes(passes);
        let excess = ExcessPass::new(instructions);
        Scratch { block, excess, low: [0.0; 3], high: [0.0; 3], fault: None, lost: None }
    }
}

/// What the host hands over.
pub struct Given<'a> {
    pub particles: Particles<'a>,
    /// Whether each ghost is an image of a particle that is there too; empty if none is.
    pub images: &'a [bool],
    /// Empty if nothing drags.
    pub v: &'a [[f64; 3]],
    /// Species of each type of particle; negative for those that take no part.
    pub kinds: &'a [i32],
    pub thermostat: Option<(PairNoise, f64)>,
    pub totals: bool,
}

impl<'a> Given<'a> {
    pub fn new(
        particles: &Particles<'a>,
        images: &'a [bool],
        v: &'a [[f64; 3]],
        kinds: &'a [i32],
        thermostat: Option<(PairNoise, f64)>,
        want: Want,
    ) -> Given<'a> {
        Given { particles: *particles, images, v, kinds, thermostat, totals: want.energy || want.virial }
    }

    /// The species of a particle, unless its type is unknown.
    #[inline(always)]
    fn species_of(&self, k: usize) -> Option<i32> {
        self.kinds.get(self.particles.kind[k] as usize).copied()
    }
}

impl<P: Compiled> Machine<P> {
    pub fn new(plan: &Plan, instructions: Instructions, threads: usize) -> Machine<P> {
        let terms = Terms::new(plan);
        let count = plan.species.len();
        let columns: Vec<usize> =
            plan.passes.iter().flat_map(|d| (0..count).map(move |s| d * count + s)).collect();
        let scratch = (0..threads).map(|_| Scratch::new(terms.passes.len(), instructions)).collect();
        let frame = Frame::around([0.0; 3], [1.0; 3], plan.dimensions, 1.0);
        Machine {
            instructions,
            passes: P::passes(instructions, count > 1 || terms.whole),
            terms,
            frame,
            grid: Grid {
                bins: 1,
                rows: 1,
                layers: 1,
                row_axis: 1,
                layer_axis: 2,
                reach: 1.0,
                window: 1.0,
                team: 4,
                joined: 1.0,
            },
            cell: Vec::new(),
            unit: Vec::new(),
            counts: Vec::new(),
            start: Vec::new(),
            order: Vec::new(),
            x: Default::default(),
            quantum: Quantum::default(),
            q: Default::default(),
            records: Vec::new(),
            species: Vec::new(),
            ghost: Vec::new(),
            owned_bits: Vec::new(),
            owned_of_row: Vec::new(),
            offset: Vec::new(),
            sums: Vec::new(),
            densities: Vec::new(),
            rows: Vec::new(),
            excess: Vec::new(),
            slopes: Vec::new(),
            slope_rows: Vec::new(),
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

    /// Numbers of the first eight slopes of all particles, of copies, and of a vector behind.
    fn slope_room(&self) -> usize {
        let copies = if self.is_ring() { self.layer(0).1 } else { 0 };
        SLOPES * (self.particles + copies + SLACK)
    }

    /// Writes the slopes of particles from number `from` on as the second pass reads them.
    ///
    /// # Safety
    /// No other thread writes or reads theirs.
    unsafe fn write_slope_rows(&self, to: Shared<P::Scalar>, from: usize, slopes: &[f64]) {
        if !self.terms.whole {
            return;
        }
        match self.width() {
            // SAFETY: the caller's.
            2 => return unsafe { self.write_few_slopes::<2>(to, from, slopes) },
            // SAFETY: the caller's.
            3 => return unsafe { self.write_few_slopes::<3>(to, from, slopes) },
            // SAFETY: the caller's.
            4 => return unsafe { self.write_few_slopes::<4>(to, from, slopes) },
            _ => {}
        }
        let room = self.slope_room();
        for (k, row) in slopes.chunks_exact(self.width()).enumerate() {
            for (c, slopes) in row.chunks(SLOPES).enumerate() {
                // SAFETY: the caller's.
                let to = unsafe { to.at(c * room + SLOPES * (from + k)) };
                for (c, slope) in slopes.iter().enumerate() {
                    // SAFETY: as above.
                    unsafe { *to.add(c) = P::Scalar::of(*slope) };
                }
            }
        }
    }

    /// The same of `W` slopes of each particle, no more than are read at once.
    ///
    /// # Safety
    /// As above.
    unsafe fn write_few_slopes<const W: usize>(&self, to: Shared<P::Scalar>, from: usize, slopes: &[f64]) {
        let rows = slopes.as_chunks::<W>().0;
        // SAFETY: the caller's.
        let to = unsafe { std::slice::from_raw_parts_mut(to.at(SLOPES * from), SLOPES * rows.len()) };
        for (to, row) in to.as_chunks_mut::<SLOPES>().0.iter_mut().zip(rows) {
            for (to, slope) in to.iter_mut().zip(row) {
                *to = P::Scalar::of(*slope);
            }
        }
    }

    fn first_fault(&mut self) -> Result<(), EngineError> {
        for scratch in &mut self.scratch {
            if let Some(fault) = scratch.fault.take() {
                return Err(fault);
            }
        }
        Ok(())
    }

    /// A force that is not finite: that of the lowest tag.
    fn lost(&mut self) -> Result<(), EngineError> {
        match self.scratch.iter_mut().filter_map(|scratch| scratch.lost.take()).min() {
            None => Ok(()),
            Some(tag) => Err(EngineError::Force { tag }),
        }
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

    /// Whether arrays over all particles are beyond the cache.
    fn is_far(&self) -> bool {
        self.all > IN_CACHE
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

    /// The arrays that threads write disjoint parts of.
    fn arrays(&mut self) -> Arrays<P> {
        Arrays {
            x: self.x.each_mut().map(|x| Shared(x.as_mut_ptr())),
            q: self.q.each_mut().map(|q| Shared(q.as_mut_ptr())),
            records: Shared(self.records.as_mut_ptr()),
            species: Shared(self.species.as_mut_ptr()),
            sums: Shared(self.sums.as_mut_ptr()),
            densities: Shared(self.densities.as_mut_ptr()),
            rows: Shared(self.rows.as_mut_ptr()),
            excess: Shared(self.excess.as_mut_ptr()),
            slopes: Shared(self.slopes.as_mut_ptr()),
            slope_rows: Shared(self.slope_rows.as_mut_ptr()),
            near: Shared(self.near.as_mut_ptr()),
            tallies: Shared(self.tallies.as_mut_ptr()),
            scratch: Shared(self.scratch.as_mut_ptr()),
        }
    }

    fn swept(&self, arrays: Arrays<P>) -> Swept<'_, P::Scalar, P::Record> {
        Swept {
            frame: &self.frame,
            grid: &self.grid,
            start: &self.start,
            x: arrays.x,
            quantum: self.quantum,
            q: arrays.q,
            records: arrays.records,
            species: arrays.species,
            ghost: &self.ghost,
            owned: &self.owned_bits,
            owned_of_row: &self.owned_of_row,
            terms: &self.terms,
            slopes: arrays.slopes,
            slope_rows: arrays.slope_rows,
            slope_room: self.slope_room(),
            offset: &self.offset,
            sums: Shared(arrays.sums.0.cast()),
            densities: Shared(arrays.densities.0.cast()),
            variables: self.columns.len(),
            thermostat: self.thermostat,
        }
    }

    /// The first pass of one layer.
    ///
    /// # Safety
    /// No other thread does the same layer.
    unsafe fn first_of_layer(
        &self,
        swept: &Swept<P::Scalar, P::Record>,
        arrays: Arrays<P>,
        layer: usize,
        block: &mut Block<P::Scalar>,
        near: &mut NearPairs<P::Scalar>,
    ) {
        let (first, own) = self.layer(layer);
        let begin = (first as isize + self.offset[layer]) as usize;
        let count = own + self.next_layer(layer);
        let variables = self.width();
        // SAFETY: these accumulators are the layer's own.
        unsafe {
            // Zeros; as bytes they are written in the widest vectors.
            arrays.sums.at(begin).write_bytes(0, count);
            if variables > 1 {
                let quads = variables.div_ceil(4);
                arrays.densities.at(quads * begin).write_bytes(0, quads * count);
            }
            let pass = self.passes.first[self.totals as usize];
            *arrays.tallies.at(layer) = pass(swept, layer, block, near);
        }
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

    /// The second pass of one layer.
    ///
    /// # Safety
    /// No other thread does the same layer, and slopes of it and the next are there.
    unsafe fn second_of_layer(
        &self,
        swept: &Swept<P::Scalar, P::Record>,
        arrays: Arrays<P>,
        layer: usize,
        near: &NearPairs<P::Scalar>,
    ) {
        let pass = self.passes.second[self.totals as usize];
        // SAFETY: the caller's.
        unsafe { pass(swept, layer, near, &mut (*arrays.tallies.at(layer)).virial) };
    }
}
