//! Lists of all pairs in the range of a thermostat, plane by plane, for integrators that apply it apart from the forces.
//!
//! Particles are in the order of cells, and within a cell in the order of their tags: the order
//! depends on positions and tags alone.

mod plane_pairs;

pub use plane_pairs::PlanePairs;

use super::region::region;
use super::terms::terms;
use super::workspace::{CellOrder, Input, SharedParticles, SortedParticles};
use crate::engine::error::EngineError;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::engine::surroundings::Around;
use psidpd_passes::cells::excluded::Excluded;
use psidpd_passes::cells::sorted::SortedCells;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::arithmetic::MixedParticle;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::plane::distances::{DistanceInputs, ShellCounts, Shells, count_pairs};
use psidpd_passes::plane::laplacians::{
    DensitySums, LaplacianBuffers, LaplacianInputs, PairTerms, sum_laplacians,
};
use psidpd_passes::plane::list::{ListBuffers, ListInputs, ListTerms, list_pairs};
use psidpd_threads::{Pool, part, take};

/// Margin of the search in a long region, in units of its coordinates: both positions are rounded along three axes.
const UNITS_OF_MARGIN: f64 = 4.0 / 4_294_967_296.0;

/// The largest margin.
const MOST_MARGIN: f64 = 1e-2;

/// The largest fraction by which the range may be shortened in a box hardly twice as wide.
const MOST_LOSS: f64 = 1e-3;

/// Pairs of the particles of a plane of cells with each other and with the next plane.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlaneTerms {
    /// The host's index of each particle of the plane, and then of the next.
    pub hosts: Vec<u32>,
    pub pairs: PairTerms,
}

/// What [`PairLists::sum_laplacians`] finds besides densities and their gradients.
#[derive(Debug)]
pub struct Sought<'a> {
    /// Whether it sums second derivatives.
    pub second: bool,
    /// The pairs of all planes.
    pub pairs: Option<&'a mut Vec<PlaneTerms>>,
}

const FAR_APART: EngineError = EngineError::Host(
    "particles are so far apart, or the box is so long, that the pairs of the thermostat cannot be found",
);

/// Sorted particles, and scratch arrays.
#[derive(Debug, Default)]
pub struct PairLists {
    set: InstructionSet,
    dimensions: usize,
    cells: CellOrder,
    particles: SortedParticles<MixedParticle>,
    buffers: Vec<ListBuffers>,
    of_laplacians: Vec<LaplacianBuffers>,
    /// The sorted index of each particle of the host, beyond all for particles that are left out.
    pub place: Vec<u32>,
}

/// Sorted cells and their particles, as loops over pairs need them.
fn sorted_cells<'a>(
    set: InstructionSet,
    cells: &'a CellOrder,
    shared: &SharedParticles<'a, MixedParticle>,
) -> SortedCells<'a> {
    SortedCells {
        set,
        geometry: &cells.geometry,
        grid: &cells.grid,
        start: &cells.start,
        x: shared.x,
        fixed16: shared.fixed16,
        fixed16_scale: shared.fixed16_scale,
        excluded: Excluded::default(),
    }
}

impl PairLists {
    pub fn new(set: InstructionSet, dimensions: usize) -> PairLists {
        PairLists { set, dimensions, ..PairLists::default() }
    }

    /// The host's index of each sorted particle.
    pub fn order(&self) -> &[u32] {
        &self.cells.order
    }

    /// Finds the pairs of `particles` within `range`, extended by the fraction `margin` where the box
    /// is wide enough, for each plane of cells; two ghosts form no pair. Particles of a type with a
    /// negative species are left out. `terms` are the pairs that are listed with a margin.
    ///
    /// Positions are fractions of the region of the particles, in units of 2⁻³². Where that is so long that pairs have to be
    /// measured in double precision the margin is larger, and the result is true.
    ///
    /// # Errors
    /// Fails for a position that is not finite, for arrays of different lengths, for a box narrower than twice the range
    /// or skew along an open direction, and if particles are too far apart.
    #[allow(clippy::too_many_arguments)]
    pub fn find(
        &mut self,
        pool: &Pool,
        Around { domain, images }: Around,
        particles: &Particles,
        species_of_kind: &[i32],
        terms: impl FnOnce(f64) -> ListTerms,
        [range, margin]: [f64; 2],
        planes: &mut Vec<PlanePairs>,
    ) -> Result<bool, EngineError> {
        let input =
            Input { particles: *particles, images, species_of_type: species_of_kind, ..Input::default() };
        let (margin, is_long) = self.sort(pool, domain, &input, [range, margin])?;
        let terms = &terms(margin);
        self.fill(pool, &input, terms.species() > 1);
        let set = self.set;
        planes.resize_with(self.cells.grid.planes, PlanePairs::default);
        self.buffers.resize_with(pool.threads(), ListBuffers::default);
        let PairLists { cells, particles, buffers, .. } = self;
        let (cells, shared) = (&*cells, particles.share());
        let inputs = &ListInputs { cells: sorted_cells(set, cells, &shared), packed: shared.packed, terms };
        let (count, threads) = (planes.len(), pool.threads());
        let mut rest = &mut planes[..];
        let of_thread = |(t, buffers): (usize, _)| {
            let numbers = part(count, t, threads);
            (buffers, take(&mut rest, numbers.len()), numbers)
        };
        let mut work: Vec<_> = buffers.iter_mut().enumerate().map(of_thread).collect();
        pool.each(&mut work, |(buffers, planes, numbers)| {
            for (number, plane) in numbers.clone().zip(planes.iter_mut()) {
                plane.lie_in(cells, number);
                // SAFETY: `fill` has filled all particles and copies above, and no thread writes them here.
                unsafe { list_pairs(set, inputs, number, buffers, &mut plane.lists) };
            }
        });
        Ok(is_long)
    }

    /// Counts the pairs of `particles` in `bins` shells up to `range`, and lists by sorted indices those of which single precision does not
    /// tell the shell: by thread, with as many `species` as kinds. There are no ghosts.
    ///
    /// # Errors
    /// Fails as [`PairLists::find`], and where the box is too long for single precision.
    pub fn count(
        &mut self,
        pool: &Pool,
        domain: &PeriodicBox,
        particles: &Particles,
        species: &[i32],
        [range, margin]: [f64; 2],
        bins: usize,
    ) -> Result<Vec<ShellCounts>, EngineError> {
        let input = Input { particles: *particles, species_of_type: species, ..Input::default() };
        let (_, is_long) = self.sort(pool, domain, &input, [range, margin])?;
        // Rounding of both positions, and sixteen units in the last digit of a distance.
        let per_length = bins as f64 / range;
        let error = per_length * (self.cells.geometry.extent() * UNITS_OF_MARGIN + 1e-6 * range);
        if is_long || error > 0.25 {
            return Err(FAR_APART);
        }
        self.fill(pool, &input, species.len() > 1);
        let (set, cells, shared) = (self.set, &self.cells, self.particles.share());
        let shells = Shells { per_length, count: bins, error };
        let inputs = &DistanceInputs {
            cells: sorted_cells(set, cells, &shared),
            packed: shared.packed,
            species: species.len(),
            shells,
        };
        let threads = pool.threads();
        let mut counts: Vec<(usize, ShellCounts)> =
            (0..threads).map(|t| (t, ShellCounts::new(species.len(), &shells))).collect();
        pool.each(&mut counts, |(t, counts)| {
            for plane in part(cells.grid.planes, *t, threads) {
                // SAFETY: `fill` has filled all particles and copies above, and no thread writes them here.
                unsafe { count_pairs(set, inputs, plane, counts) };
            }
        });
        Ok(counts.into_iter().map(|(_, counts)| counts).collect())
    }

    /// Sums of all particles over their pairs, for the Laplacian of the energy: in the order of cells, for each particle and each species of
    /// the other one for each density of the plan, which has a pass for each and no walls. There are no ghosts, and types are species.
    ///
    /// # Errors
    /// Fails as [`PairLists::find`], and where the box is too long for single precision.
    pub fn sum_laplacians(
        &mut self,
        pool: &Pool,
        domain: &PeriodicBox,
        particles: &Particles,
        plan: &Plan,
        [range, margin]: [f64; 2],
        sought: Sought,
    ) -> Result<Vec<DensitySums>, EngineError> {
        let input =
            Input { particles: *particles, species_of_type: &plan.species_of_type, ..Input::default() };
        let (_, is_long) = self.sort(pool, domain, &input, [range, margin])?;
        if is_long {
            return Err(FAR_APART);
        }
        self.fill(pool, &input, plan.species.len() > 1);
        let (set, rest, terms) = (self.set, (self.dimensions - 1) as f64, &terms(plan));
        self.of_laplacians.resize_with(pool.threads(), LaplacianBuffers::default);
        let PairLists { cells, particles, of_laplacians, .. } = self;
        let (cells, shared) = (&*cells, particles.share());
        let cells_of_all = sorted_cells(set, cells, &shared);
        let Sought { second, mut pairs } = sought;
        let inputs = &LaplacianInputs { cells: cells_of_all, packed: shared.packed, terms, rest, second };
        let (of_each, is_kept) = (inputs.width() * terms.species, pairs.is_some());
        // Each plane has sums of its own for its particles and for those of the next, so that threads do not matter.
        let (count, threads) = (cells.grid.planes, pool.threads());
        let mut kept = pairs.as_deref_mut().map(std::mem::take).unwrap_or_default();
        kept.resize_with(count, PlaneTerms::default);
        let mut planes: Vec<_> =
            kept.into_iter().map(|kept| (PlanePairs::default(), Vec::new(), kept)).collect();
        let mut rest = &mut planes[..];
        let of_thread = |(t, buffers): (usize, _)| {
            let numbers = part(count, t, threads);
            (take(&mut rest, numbers.len()), numbers, buffers)
        };
        let mut work: Vec<_> = of_laplacians.iter_mut().enumerate().map(of_thread).collect();
        pool.each(&mut work, |(planes, numbers, buffers)| {
            for (number, (plane, sums, kept)) in numbers.clone().zip(planes.iter_mut()) {
                plane.lie_in(cells, number);
                sums.resize((plane.own.len() + plane.next.len()) * of_each, DensitySums::default());
                let kept = is_kept.then(|| {
                    let of_plane = plane.own.clone().chain(plane.next.clone());
                    kept.hosts.clear();
                    kept.hosts.extend(of_plane.map(|k| cells.order[k]));
                    kept.pairs.clear();
                    &mut kept.pairs
                });
                // SAFETY: `fill` has filled all particles and copies above, and no thread writes them here.
                unsafe { sum_laplacians(set, inputs, number, buffers, sums, kept) };
            }
        });
        let mut all = vec![DensitySums::default(); cells.particles() * of_each];
        let mut rest = &mut all[..];
        let mut work: Vec<_> = (0..count)
            .map(|number| {
                let (plane, own, _) = &planes[number];
                let (before, theirs, _) = &planes[number.checked_sub(1).unwrap_or(count - 1)];
                let of_own = plane.own.len() * of_each;
                let of_next =
                    if before.next == plane.own { &theirs[before.own.len() * of_each..] } else { &[] };
                (take(&mut rest, of_own), &own[..of_own], of_next)
            })
            .collect();
        pool.each(&mut work, |(to, own, of_next)| {
            to.copy_from_slice(own);
            to.iter_mut().zip(of_next.iter()).for_each(|(to, add)| to.add(add));
        });
        if let Some(pairs) = pairs {
            *pairs = planes.into_iter().map(|(.., kept)| kept).collect();
        }
        Ok(all)
    }

    /// Sorts particles for a search within `range`, and returns its margin, and whether pairs have to be measured in double precision.
    fn sort(
        &mut self,
        pool: &Pool,
        domain: &PeriodicBox,
        input: &Input,
        [range, margin]: [f64; 2],
    ) -> Result<(f64, bool), EngineError> {
        input.particles.check(26)?;
        input.particles.check_images(input.images)?;
        let set = self.set;
        let region = region(set, pool, (self.dimensions, range * (1.0 + margin)), domain, input)?;
        let is_long = region.is_long(range);
        let extent = region.geometry.extent();
        let margin = if is_long { margin.max(extent / range * UNITS_OF_MARGIN) } else { margin };
        if margin > MOST_MARGIN {
            return Err(FAR_APART);
        }
        let range = self.range_within(domain, extent, range, margin)?;
        let (geometry, mut grid) = region.cells(range, input.particles.x.len())?;
        // Updates of single pairs need an even number of planes, so that planes updated at
        // once have no neighbour in common.
        if geometry.periodic[grid.plane_axis] {
            grid.planes = grid.planes.max(2);
        }
        self.cells.sort(pool, set, geometry, grid, input)?;
        self.sort_by_tags(pool, input.particles.tag);
        Ok((margin, is_long))
    }

    /// Takes over the order of a sweep.
    pub fn follow(&mut self, cells: &CellOrder) {
        self.cells.order.clone_from(&cells.order);
        cells.find_places(&mut self.place);
    }

    /// The range of the search in a region of this extent; slightly less than `range` in a box that is
    /// exactly twice as wide: drag and noise at the range are almost zero there.
    fn range_within(
        &self,
        domain: &PeriodicBox,
        extent: f64,
        range: f64,
        margin: f64,
    ) -> Result<f64, EngineError> {
        let periodic = domain.periodic();
        let heights = (0..self.dimensions).filter(|k| periodic[*k]).map(|k| domain.height(k));
        let height = heights.fold(f64::INFINITY, f64::min);
        if height < 2.0 * range * (1.0 - 1e-12) {
            return Err(EngineError::Host("the box is narrower than twice the range of the thermostat"));
        }
        let within = CellGrid::cutoff_within(height, extent.max(4.0 * range));
        // The comparison is false for NaN.
        let is_wide = within >= range * (1.0 - MOST_LOSS);
        if is_wide { Ok(within.min(range * (1.0 + margin))) } else { Err(FAR_APART) }
    }

    /// Sorts the particles of each cell by their tags.
    fn sort_by_tags(&mut self, pool: &Pool, tags: &[i32]) {
        let CellOrder { start, order, grid, .. } = &mut self.cells;
        let (cells, threads) = (grid.cell_count(), pool.threads());
        let mut rest = &mut order[..];
        let mut work: Vec<_> = (0..threads)
            .map(|t| {
                let part = part(cells, t, threads);
                let count = start[part.end] - start[part.start];
                (&start[part.start..=part.end], take(&mut rest, count as usize))
            })
            .collect();
        pool.each(&mut work, |(starts, order)| {
            for cell in starts.windows(2).filter(|ends| ends[1] - ends[0] > 1) {
                let [from, to] = [cell[0], cell[1]].map(|place| (place - starts[0]) as usize);
                order[from..to].sort_unstable_by_key(|k| tags[*k as usize]);
            }
        });
        self.cells.find_places(&mut self.place);
    }

    /// Fills the arrays in the order of cells.
    fn fill(&mut self, pool: &Pool, input: &Input, multispecies: bool) {
        self.particles.make_room(&self.cells, multispecies);
        let (set, cells, threads) = (self.set, &self.cells, pool.threads());
        let shared = &self.particles.share();
        pool.run(&|t| {
            // SAFETY: `whole_vectors` gives threads disjoint indices that begin at whole vectors; no
            // thread reads the arrays meanwhile.
            unsafe { shared.fill(set, cells, input, cells.whole_vectors(t, threads)) };
        });
        self.particles.copy_first_plane(&self.cells);
    }
}
