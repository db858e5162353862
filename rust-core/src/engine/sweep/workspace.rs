//! One precision's arrays, and the steps of an evaluation over them.

mod excess;
mod host;
mod layout;
mod scheduler;
mod sort;

pub use host::ForceSink;

use crate::engine::error::EngineError;
use crate::engine::excess_pass::ExcessPass;
use crate::engine::noise::PairNoise;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::engine::settings::Instructions;
use crate::engine::sweep::compiled::{Compiled, Passes};
use crate::engine::sweep::ground::box_geometry::BoxGeometry;
use crate::engine::sweep::ground::cell_grid::CellGrid;
use crate::engine::sweep::ground::fixed_point::FixedPoint16;
use crate::engine::sweep::ground::pass_data::{OwnedOfColumn, PassData};
use crate::engine::sweep::ground::shared_ptr::SharedPtr;
use crate::engine::sweep::ground::terms::Terms;
use crate::engine::sweep::many_body::full_pair_cache::SLOPES_PER_PASS;
use crate::engine::sweep::many_body::in_range_pairs::InRangePairs;
use crate::engine::sweep::pair_batch::buffers::PairBuffers;
use crate::engine::sweep::pair_batch::scatter::Accumulator;
use crate::engine::sweep::simd::Scalar;
use crate::engine::tally::{Tally, Want};

/// Room behind the last particle: what whole vectors may read.
const VECTOR_PADDING: usize = 16;

/// Up to so many particles all arrays stay in the cache, and none of them is called there in advance. Tests have few.
const PREFETCH_THRESHOLD: usize = if cfg!(test) { 100 } else { 1 << 14 };

/// Arrays in the order of cells, and what goes through them.
pub struct Workspace<P: Compiled> {
    instructions: Instructions,
    passes: Passes<P::Scalar, P::PackedParticle>,
    terms: Terms<P::Scalar>,
    geometry: BoxGeometry,
    grid: CellGrid,
    cell: Vec<u32>,
    /// Fractions of the box geometry of the host's particles, in units of 2⁻³².
    fixed32: Vec<[u32; 3]>,
    /// Particles of each cell: by thread while counting, then where each thread's begin.
    counts: Vec<u32>,
    start: Vec<u32>,
    /// The host's number of each particle.
    pub order: Vec<u32>,
    x: [Vec<f32>; 3],
    fixed16_scale: FixedPoint16,
    fixed16: [Vec<u16>; 3],
    packed: Vec<P::PackedParticle>,
    species: Vec<u8>,
    ghost: Vec<bool>,
    owned_bits: Vec<u8>,
    owned_of_column: Vec<OwnedOfColumn>,
    accumulator_offset: Vec<isize>,
    sums: Vec<Accumulator>,
    densities: Vec<Accumulator>,
    /// Densities, ψ and slopes in the order of cells.
    densities_of_particles: Vec<f64>,
    excess: Vec<f64>,
    slopes: Vec<f64>,
    /// Slopes as the second pass reads them if pairs are kept in the full pair cache.
    packed_slopes: Vec<P::Scalar>,
    in_range: Vec<InRangePairs<P::Scalar>>,
    tallies: Vec<Tally>,
    scratch: Vec<ThreadScratch<P::Scalar>>,
    particles: usize,
    owned: usize,
    all: usize,
    variables: Vec<usize>,
    thermostat: Option<(PairNoise, f64)>,
    totals: bool,
}

/// Where threads write, each its own part.
struct SharedArrays<P: Compiled> {
    x: [SharedPtr<f32>; 3],
    fixed16: [SharedPtr<u16>; 3],
    packed: SharedPtr<P::PackedParticle>,
    species: SharedPtr<u8>,
    sums: SharedPtr<Accumulator>,
    densities: SharedPtr<Accumulator>,
    densities_of_particles: SharedPtr<f64>,
    excess: SharedPtr<f64>,
    slopes: SharedPtr<f64>,
    packed_slopes: SharedPtr<P::Scalar>,
    in_range: SharedPtr<InRangePairs<P::Scalar>>,
    tallies: SharedPtr<Tally>,
    scratch: SharedPtr<ThreadScratch<P::Scalar>>,
}

impl<P: Compiled> Clone for SharedArrays<P> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<P: Compiled> Copy for SharedArrays<P> {}

/// A thread's own.
struct ThreadScratch<T> {
    buffers: PairBuffers<T>,
    excess: ExcessPass,
    low: [f64; 3],
    high: [f64; 3],
    fault: Option<EngineError>,
    /// The lowest tag of the particles whose forces are not finite.
    lost: Option<i32>,
}

impl<T: Scalar> ThreadScratch<T> {
    fn new(passes: usize, instructions: Instructions) -> ThreadScratch<T> {
        let mut buffers = PairBuffers::default();
        buffers.set_passes(passes);
        let excess = ExcessPass::new(instructions);
        ThreadScratch { buffers, excess, low: [0.0; 3], high: [0.0; 3], fault: None, lost: None }
    }
}

/// What the host hands over.
pub struct Input<'a> {
    pub particles: Particles<'a>,
    /// Whether each ghost is an image of a particle that is there too; empty if none is.
    pub images: &'a [bool],
    /// Empty if nothing drags.
    pub v: &'a [[f64; 3]],
    /// Species of each type of particle; negative for those that take no part.
    pub species_of_type: &'a [i32],
    pub thermostat: Option<(PairNoise, f64)>,
    pub totals: bool,
}

impl<'a> Input<'a> {
    pub fn new(
        particles: &Particles<'a>,
        images: &'a [bool],
        v: &'a [[f64; 3]],
        species_of_type: &'a [i32],
        thermostat: Option<(PairNoise, f64)>,
        want: Want,
    ) -> Input<'a> {
        Input {
            particles: *particles,
            images,
            v,
            species_of_type,
            thermostat,
            totals: want.energy || want.virial,
        }
    }

    /// The species of a particle, unless its type is unknown.
    #[inline(always)]
    fn species_of(&self, k: usize) -> Option<i32> {
        self.species_of_type.get(self.particles.kind[k] as usize).copied()
    }
}

impl<P: Compiled> Workspace<P> {
    pub fn new(plan: &Plan, instructions: Instructions, threads: usize) -> Workspace<P> {
        let terms = Terms::new(plan);
        let count = plan.species.len();
        let variables: Vec<usize> =
            plan.passes.iter().flat_map(|d| (0..count).map(move |s| d * count + s)).collect();
        let scratch = (0..threads).map(|_| ThreadScratch::new(terms.passes.len(), instructions)).collect();
        let geometry = BoxGeometry::enclosing([0.0; 3], [1.0; 3], plan.dimensions, 1.0);
        Workspace {
            instructions,
            passes: P::passes(instructions, count > 1 || terms.full_cache),
            terms,
            geometry,
            grid: CellGrid {
                cells_per_column: 1,
                columns_per_plane: 1,
                planes: 1,
                column_axis: 1,
                plane_axis: 2,
                search_cutoff: 1.0,
                range_half_width: 1.0,
                i_cluster_size: 4,
                i_cluster_extent: 1.0,
            },
            cell: Vec::new(),
            fixed32: Vec::new(),
            counts: Vec::new(),
            start: Vec::new(),
            order: Vec::new(),
            x: Default::default(),
            fixed16_scale: FixedPoint16::default(),
            fixed16: Default::default(),
            packed: Vec::new(),
            species: Vec::new(),
            ghost: Vec::new(),
            owned_bits: Vec::new(),
            owned_of_column: Vec::new(),
            accumulator_offset: Vec::new(),
            sums: Vec::new(),
            densities: Vec::new(),
            densities_of_particles: Vec::new(),
            excess: Vec::new(),
            slopes: Vec::new(),
            packed_slopes: Vec::new(),
            in_range: Vec::new(),
            tallies: Vec::new(),
            scratch,
            particles: 0,
            owned: 0,
            all: 0,
            variables,
            thermostat: None,
            totals: false,
        }
    }

    /// Numbers that a many-body pair needs of each particle.
    fn width(&self) -> usize {
        self.variables.len()
    }

    /// Numbers of the first eight slopes of all particles, of copies, and of a vector behind.
    fn packed_slope_stride(&self) -> usize {
        let copies = if self.is_plane_axis_periodic() { self.plane(0).1 } else { 0 };
        SLOPES_PER_PASS * (self.particles + copies + VECTOR_PADDING)
    }

    /// Writes the slopes of particles from number `from` on as the second pass reads them.
    ///
    /// # Safety
    /// No other thread writes or reads theirs.
    unsafe fn write_packed_slopes(&self, to: SharedPtr<P::Scalar>, from: usize, slopes: &[f64]) {
        if !self.terms.full_cache {
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
        let room = self.packed_slope_stride();
        for (k, row) in slopes.chunks_exact(self.width()).enumerate() {
            for (c, slopes) in row.chunks(SLOPES_PER_PASS).enumerate() {
                // SAFETY: the caller's.
                let to = unsafe { to.at(c * room + SLOPES_PER_PASS * (from + k)) };
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
    unsafe fn write_few_slopes<const W: usize>(&self, to: SharedPtr<P::Scalar>, from: usize, slopes: &[f64]) {
        let densities_of_particles = slopes.as_chunks::<W>().0;
        // SAFETY: the caller's.
        let to = unsafe {
            std::slice::from_raw_parts_mut(
                to.at(SLOPES_PER_PASS * from),
                SLOPES_PER_PASS * densities_of_particles.len(),
            )
        };
        for (to, row) in to.as_chunks_mut::<SLOPES_PER_PASS>().0.iter_mut().zip(densities_of_particles) {
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

    /// Particles of plane `plane`, and the first of them.
    fn plane(&self, plane: usize) -> (usize, usize) {
        let per_plane = self.grid.columns_per_plane * self.grid.cells_per_column;
        let first = self.start[plane * per_plane] as usize;
        (first, self.start[(plane + 1) * per_plane] as usize - first)
    }

    /// Whether the first plane follows the last.
    fn is_plane_axis_periodic(&self) -> bool {
        self.geometry.periodic[self.grid.plane_axis]
    }

    /// Whether arrays over all particles are beyond the cache.
    fn exceeds_cache(&self) -> bool {
        self.all > PREFETCH_THRESHOLD
    }

    /// How many particles the plane behind `plane` has.
    fn next_plane(&self, plane: usize) -> usize {
        if plane + 1 < self.grid.planes {
            self.plane(plane + 1).1
        } else if self.is_plane_axis_periodic() {
            self.plane(0).1
        } else {
            0
        }
    }

    /// The arrays that threads write disjoint parts of.
    fn arrays(&mut self) -> SharedArrays<P> {
        SharedArrays {
            x: self.x.each_mut().map(|x| SharedPtr(x.as_mut_ptr())),
            fixed16: self.fixed16.each_mut().map(|fixed16| SharedPtr(fixed16.as_mut_ptr())),
            packed: SharedPtr(self.packed.as_mut_ptr()),
            species: SharedPtr(self.species.as_mut_ptr()),
            sums: SharedPtr(self.sums.as_mut_ptr()),
            densities: SharedPtr(self.densities.as_mut_ptr()),
            densities_of_particles: SharedPtr(self.densities_of_particles.as_mut_ptr()),
            excess: SharedPtr(self.excess.as_mut_ptr()),
            slopes: SharedPtr(self.slopes.as_mut_ptr()),
            packed_slopes: SharedPtr(self.packed_slopes.as_mut_ptr()),
            in_range: SharedPtr(self.in_range.as_mut_ptr()),
            tallies: SharedPtr(self.tallies.as_mut_ptr()),
            scratch: SharedPtr(self.scratch.as_mut_ptr()),
        }
    }

    fn data(&self, arrays: SharedArrays<P>) -> PassData<'_, P::Scalar, P::PackedParticle> {
        PassData {
            geometry: &self.geometry,
            grid: &self.grid,
            start: &self.start,
            x: arrays.x,
            fixed16_scale: self.fixed16_scale,
            fixed16: arrays.fixed16,
            packed: arrays.packed,
            species: arrays.species,
            ghost: &self.ghost,
            owned: &self.owned_bits,
            owned_of_column: &self.owned_of_column,
            terms: &self.terms,
            slopes: arrays.slopes,
            packed_slopes: arrays.packed_slopes,
            packed_slope_stride: self.packed_slope_stride(),
            accumulator_offset: &self.accumulator_offset,
            sums: SharedPtr(arrays.sums.0.cast()),
            densities: SharedPtr(arrays.densities.0.cast()),
            variables: self.variables.len(),
            thermostat: self.thermostat,
        }
    }

    /// The first pass of one plane.
    ///
    /// # Safety
    /// No other thread does the same plane.
    unsafe fn first_of_plane(
        &self,
        data: &PassData<P::Scalar, P::PackedParticle>,
        arrays: SharedArrays<P>,
        plane: usize,
        buffers: &mut PairBuffers<P::Scalar>,
        in_range: &mut InRangePairs<P::Scalar>,
    ) {
        let (first, own) = self.plane(plane);
        let begin = (first as isize + self.accumulator_offset[plane]) as usize;
        let count = own + self.next_plane(plane);
        let variables = self.width();
        // SAFETY: these accumulators are the plane's own.
        unsafe {
            // Zeros; as bytes they are written in the widest vectors.
            arrays.sums.at(begin).write_bytes(0, count);
            if variables > 1 {
                let quads = variables.div_ceil(4);
                arrays.densities.at(quads * begin).write_bytes(0, quads * count);
            }
            let pass = self.passes.first[self.totals as usize];
            *arrays.tallies.at(plane) = pass(data, plane, buffers, in_range);
        }
    }

    /// The accumulators of a particle of a plane: its plane's, and that of the plane before.
    fn accumulators(&self, plane: usize) -> (isize, Option<isize>) {
        let before = match plane {
            0 if self.is_plane_axis_periodic() => {
                Some(self.accumulator_offset[self.grid.planes - 1] + self.particles as isize)
            }
            0 => None,
            _ => Some(self.accumulator_offset[plane - 1]),
        };
        (self.accumulator_offset[plane], before)
    }

    /// The second pass of one plane.
    ///
    /// # Safety
    /// No other thread does the same plane, and slopes of it and the next are there.
    unsafe fn second_of_plane(
        &self,
        data: &PassData<P::Scalar, P::PackedParticle>,
        arrays: SharedArrays<P>,
        plane: usize,
        in_range: &InRangePairs<P::Scalar>,
    ) {
        let pass = self.passes.second[self.totals as usize];
        // SAFETY: the caller's.
        unsafe { pass(data, plane, in_range, &mut (*arrays.tallies.at(plane)).virial) };
    }
}
