//! The sweep computes the same forces as [the sums over pairs](super::pair_sums), by one traversal of
//! all cells, without a neighbour list. `docs/engine.md` explains it with figures. DPD particles move
//! so fast that a neighbour list would be valid for a few steps only and cost more than it saves.
//!
//! The crate `psidpd_passes` contains the loops over cells and pairs, `psidpd_threads` the threads. This module contains
//!
//! - [`terms`]: the plan as tables of numbers for those loops.
//! - [`region`]: the region of the sweep, and its cells.
//! - [`workspace`]: arrays, sorting, ψ, and the scheduler that sends planes through the passes.
//! - [`pair_lists`]: lists of the pairs in a range, for the thermostat apart from the forces.
//! - [`listed_pairs`]: what an evaluation lists pairs for on its way, and where.
//! - [`places`]: double-precision positions for those pairs.
//! - [`Sweep`]: the interface for hosts.

mod listed_pairs;
mod pair_lists;
mod places;
mod region;
mod terms;
mod times;
mod workspace;

pub(super) use listed_pairs::ListedFor;
pub(super) use pair_lists::{PairLists, PlanePairs, PlaneTerms, Sought};
pub(super) use places::{Images, MARGIN, Places};
pub use psidpd_threads::{Pool, ThreadCount, part};
pub use times::{Times, lap};

use super::counts::PassCounts;
use super::error::EngineError;
use super::exclusions::Exclusions;
use super::particles::Particles;
use super::plan::{Plan, ThermostatPlan};
use super::request::Request;
use super::surroundings::Around;
use crate::model::Fluid;
use crate::model::expression::TooLarge;
use listed_pairs::of_positions;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::arithmetic::{Double, Mixed};
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::plane::list::ListTerms;
use psidpd_passes::plane::pair_sums::Wide;
use psidpd_passes::settings::{Precision, Settings};
use psidpd_passes::tally::Tally;
pub(super) use region::UNFIT;
use region::{can_stretch, is_open, region};
use std::sync::Arc;
use std::time::Instant;
pub(super) use workspace::Sorted;
use workspace::{ForceSink, Input, Workspace};

/// The forces of one fluid. Without ghosts an evaluation is [`Sweep::evaluate`]. With ghosts a host
/// calls [`Sweep::first`], copies slopes from owners to ghosts, and calls [`Sweep::second`].
///
/// The passes read tables and arrays without checks of bounds: plan, pool and arrays belong together, and none can be
/// replaced by itself.
pub struct Sweep {
    pub(super) plan: Plan,
    /// The settings, with the instruction set in use.
    settings: Settings,
    set: InstructionSet,
    pool: Arc<Pool>,
    workspace: EitherPrecision,
    /// The workspace in the other precision: pairs in mixed precision are computed in double precision in a region that is
    /// too long.
    other: Option<EitherPrecision>,
    is_exchanged: bool,
    /// Additions to the densities of owned particles in the next evaluation: a row of
    /// [`Plan::slope_width`] for each, or an empty list.
    pub(super) added_densities: Vec<f64>,
    /// Pairs that do not interact.
    pub(super) exclusions: Exclusions,
    /// See [`Sweep::slopes_mut`].
    pub(super) slopes: Vec<f64>,
    owned: usize,
    all: usize,
    times: Times,
    /// Whether the arrays are those of a whole evaluation: not before the first, nor after one that failed or panicked.
    is_complete: bool,
    /// Whether [`Sweep::second`] may follow.
    ready: bool,
    /// The pairs that the next evaluation is asked to list.
    asked: Option<(ListTerms, ListedFor)>,
    /// What the last evaluation has listed pairs for that nobody has taken, and the number of its positions.
    listed: Option<(ListedFor, u64)>,
}

/// A workspace in mixed or in double precision.
enum EitherPrecision {
    Mixed(Box<Workspace<Mixed>>),
    Double(Box<Workspace<Double>>),
}

impl EitherPrecision {
    fn new(precision: Precision, plan: &Plan, set: InstructionSet, threads: usize) -> EitherPrecision {
        match precision {
            Precision::Mixed => EitherPrecision::Mixed(Box::new(Workspace::new(plan, set, threads))),
            Precision::Double => EitherPrecision::Double(Box::new(Workspace::new(plan, set, threads))),
        }
    }
}

/// Runs the same expression with the workspace of either precision.
macro_rules! with {
    ($both:expr, $workspace:ident => $do:expr) => {
        match $both {
            EitherPrecision::Mixed($workspace) => $do,
            EitherPrecision::Double($workspace) => $do,
        }
    };
}

/// The pairs that an evaluation has listed, with the geometry that it computes anyway, which a thermostat takes once or not at all.
#[derive(Debug)]
pub struct ListedPairs<'a> {
    sweep: &'a mut Sweep,
    listed: ListedFor,
    positions: u64,
}

impl ListedPairs<'_> {
    /// Whether the pairs are those of a thermostat for a time `dt` between particles at `x`.
    pub fn serve(&self, plan: &ThermostatPlan, dt: f64, x: &[[f64; 3]]) -> bool {
        self.listed.serves(plan, dt) && self.positions == of_positions(x)
    }

    /// Moves the pairs to `lists` and `planes`. Particles of a cell are in the order of the host.
    pub fn give(self, lists: &mut PairLists, planes: &mut Vec<PlanePairs>) {
        with!(&mut self.sweep.workspace, m => {
            let cells = &m.order;
            planes.resize_with(cells.grid.planes, PlanePairs::default);
            planes.iter_mut().enumerate().for_each(|(k, plane)| plane.lie_in(cells, k));
            lists.follow(cells);
            m.move_lists(planes.iter_mut().map(|plane| &mut plane.lists));
        });
    }
}

impl std::fmt::Debug for Sweep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sweep").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Sweep {
    /// Creates a sweep for `fluid`, whose types are species indices.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn new(fluid: &Fluid, settings: Settings) -> Result<Sweep, TooLarge> {
        Ok(Sweep::of_plan(Plan::new(fluid)?, settings, Arc::new(Pool::new(settings.threads))))
    }

    /// Creates the sweep of a given plan, with a thread pool that others may use too.
    pub(super) fn of_plan(plan: Plan, mut settings: Settings, pool: Arc<Pool>) -> Sweep {
        let set = InstructionSet::new(settings.instructions).unwrap_or_else(InstructionSet::best);
        settings.instructions = set.instructions();
        let threads = pool.threads();
        let workspace = EitherPrecision::new(settings.precision, &plan, set, threads);
        Sweep {
            plan,
            settings,
            set,
            pool,
            workspace,
            other: None,
            is_exchanged: false,
            added_densities: Vec::new(),
            exclusions: Exclusions::default(),
            slopes: Vec::new(),
            owned: 0,
            all: 0,
            times: Times::default(),
            is_complete: false,
            ready: false,
            asked: None,
            listed: None,
        }
    }

    /// Takes another plan of the same species and thermostat, and keeps what it is asked for. Counts begin anew.
    pub(super) fn exchange(&mut self, plan: Plan) {
        let Sweep { settings, times, .. } = *self;
        let (asked, pool) = (self.asked.take(), Arc::clone(&self.pool));
        let exclusions = std::mem::take(&mut self.exclusions);
        *self = Sweep { asked, times, exclusions, ..Sweep::of_plan(plan, settings, pool) };
    }

    /// The plan of the fluid's passes.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The settings, with the instruction set in use.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// The instruction set in use.
    pub(super) fn set(&self) -> InstructionSet {
        self.set
    }

    /// The pool of threads.
    pub fn pool(&self) -> &Arc<Pool> {
        &self.pool
    }

    /// Times of the parts of evaluations.
    pub fn times(&self) -> Times {
        self.times
    }

    /// Slopes `∂ψ/∂n` of owned particles, [`Plan::slope_width`] each, followed by those of ghosts, which the host writes
    /// after [`Sweep::first`]; none after [`Sweep::evaluate`].
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        &mut self.slopes
    }

    /// Counts of the passes since the sweep was created: search groups, batches of pairs (for each
    /// density, with noise, with energies and virials), blocks of particles with a ψ that depends on a
    /// density, and planes with forces. A pass that has never run has a count of zero.
    pub fn counts(&self) -> PassCounts {
        let counts = |of: &EitherPrecision| with!(of, m => m.counts());
        self.other.iter().map(counts).fold(counts(&self.workspace), |all, counts| all + counts)
    }

    /// Numbers of evaluations out of bounds, as
    /// [`Statistics::out_of_bounds`](super::Statistics::out_of_bounds).
    pub fn out_of_bounds(&self) -> [u64; 2] {
        let numbers = |of: &EitherPrecision| with!(of, m => m.out_of_bounds());
        let [low, high] = self.other.as_ref().map_or([0; 2], numbers);
        let [a, b] = numbers(&self.workspace);
        [a + low, b + high]
    }

    /// Whether particles in `domain` are near at most one image of each other, as a sweep without
    /// ghosts requires: periods are at least twice the cut-off, and edges are oriented as in LAMMPS,
    /// along the axes if some directions are open. Along these the edges do not matter. An evaluation may still find that
    /// particles are too far apart.
    pub fn fits(&self, domain: &PeriodicBox) -> bool {
        let (geometry, cutoff) = (BoxGeometry::of_box(domain, self.plan.dimensions), cutoff(&self.plan));
        is_open(domain, self.plan.dimensions)
            || geometry.filter(can_stretch).is_some_and(|geometry| {
                CellGrid::new(&geometry.stretched([0.0; 3], [0.0; 3], cutoff), cutoff, 1).is_some()
            })
    }

    /// Computes all forces on particles in a box, writes them to `force` or adds them to it, and
    /// returns the requested totals. Only densities and ψ are stored for all particles: each plane of
    /// cells passes through all steps in turn.
    ///
    /// Of what the request wants the sweep computes the totals only;
    /// [the sums over pairs](super::pair_sums) computes energies and virials of single particles.
    ///
    /// # Errors
    /// Fails for a position, ψ or force that is not finite, when some forces may have been written; also for
    /// a tag or type out of range, arrays of different lengths, ghosts, and a box that does not fit.
    pub fn evaluate(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<Tally, EngineError> {
        request.particles.check_no_ghosts()?;
        self.run(Around { domain, images: &[] }, request, force, add)?;
        self.slopes.clear();
        Ok(with!(&self.workspace, m => m.tally()))
    }

    /// Does all of an evaluation on a rank that needs no slopes of ghosts: adds to `force` all forces but the many-body forces
    /// of pairs with ghosts, and evaluates ψ; the other arguments are those of [`Sweep::evaluate`].
    ///
    /// # Errors
    /// Fails as [`Sweep::evaluate`], except that there may be ghosts.
    pub fn first(
        &mut self,
        around: Around,
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<(), EngineError> {
        self.run(around, request, force, true)?;
        let mut since = Instant::now();
        with!(&self.workspace, m => m.slopes_to_host(&self.pool, &mut self.slopes));
        lap(&mut since, &mut self.times.excess);
        self.ready = true;
        Ok(())
    }

    /// Sorts the particles, and runs all passes.
    fn run(
        &mut self,
        Around { domain, images }: Around,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<(), EngineError> {
        let Request { particles, v, step, want } = *request;
        (self.ready, self.is_complete) = (false, false);
        // Thirty-two times an index must fit into a word; copies of a plane have indices too.
        particles.check(26)?;
        (self.owned, self.all) = (particles.owned, particles.x.len());
        let thermostat = self.plan.noise_of(step, v, self.all)?;
        if force.len() < self.owned {
            return Err(EngineError::Host("the force array is too short"));
        }
        particles.check_images(images)?;
        let input = Input {
            particles,
            images,
            v,
            species_of_type: &self.plan.species_of_type,
            added_densities: &self.added_densities,
            exclusions: Some(&self.exclusions),
            thermostat,
            totals: want.energy || want.virial,
        };
        let can_list = input.thermostat.is_none() && self.exclusions.is_empty();
        let (listed, listed_for) = self.asked.take().filter(|_| can_list).unzip();
        self.listed = None;
        let set = self.set;
        let (plan, pool, times) = (&self.plan, &self.pool, &mut self.times);
        let mut since = Instant::now();
        let region = region(set, pool, (plan.dimensions, cutoff(plan)), domain, &input)?;
        let (geometry, grid) = region.cells(cutoff(plan), particles.x.len())?;
        let exchanges = self.settings.precision == Precision::Mixed && region.is_long(cutoff(plan));
        if exchanges != self.is_exchanged {
            let other = || EitherPrecision::new(Precision::Double, plan, set, pool.threads());
            std::mem::swap(&mut self.workspace, self.other.get_or_insert_with(other));
            self.is_exchanged = exchanges;
        }
        let out = ForceSink::new(force, add, particles.tag);
        with!(&mut self.workspace, m => {
            m.listed = listed;
            m.sort_into_cells(pool, geometry, grid, &input)?;
            lap(&mut since, &mut times.sort);
            m.run_all(pool, plan, &input, out, times)?;
            self.listed = listed_for.map(|listed_for| (listed_for, of_positions(particles.x)));
        });
        self.is_complete = true;
        Ok(())
    }

    /// Asks the next evaluation to list pairs. It lists them without excluded pairs, and if drag and noise are not among the forces.
    pub(super) fn ask_for_pairs(&mut self, asked: Option<(ListTerms, ListedFor)>) {
        (self.asked, self.listed) = (asked, None);
    }

    /// Takes lists that nobody needs, for the memory of the pairs that the next evaluation lists.
    pub(super) fn lend_lists(&mut self, planes: &mut [PlanePairs]) {
        let lists = planes.iter_mut().map(|plane| std::mem::take(&mut plane.lists));
        with!(&mut self.workspace, m => m.lend_lists(lists));
    }

    /// See [`Workspace::exchange_memory`]. An evaluation that waits for [`Sweep::second`] cannot be completed any more.
    pub(super) fn exchange_memory(&mut self, vectors: [&mut Vec<Wide>; 2]) {
        self.ready = false;
        with!(&mut self.workspace, m => m.exchange_memory(vectors));
    }

    /// The pairs that the last evaluation has listed, once.
    pub(super) fn listed_pairs(&mut self) -> Option<ListedPairs<'_>> {
        let (listed, positions) = self.listed.take().filter(|_| self.is_complete)?;
        Some(ListedPairs { sweep: self, listed, positions })
    }

    /// Copies the slopes of owned particles after [`Sweep::evaluate`], with room for `all`, for the
    /// energies and forces of single pairs. Without an evaluation they are zero.
    pub fn fetch_slopes(&mut self, all: usize) {
        self.slopes.clear();
        if self.is_complete {
            with!(&self.workspace, m => m.slopes_to_host(&self.pool, &mut self.slopes));
        }
        self.slopes.resize(self.plan.slope_width() * all, 0.0);
    }

    /// Adds to `force`, which [`Sweep::first`] has added to, the many-body forces of pairs with ghosts, and
    /// returns the requested totals.
    ///
    /// A pair of an owned particle and a ghost is computed for the owned particle alone, with half of
    /// its energy and virial: the rank of the ghost computes the other half.
    ///
    /// # Errors
    /// Fails for a force that is not finite, and for arrays of other lengths than in [`Sweep::first`].
    pub fn second(&mut self, particles: &Particles, force: &mut [[f64; 3]]) -> Result<Tally, EngineError> {
        if !(std::mem::take(&mut self.ready) && self.is_complete) {
            return Err(EngineError::Host("the second half of an evaluation needs the first half before it"));
        }
        if particles.x.len() != self.all || particles.owned != self.owned || force.len() < self.owned {
            return Err(EngineError::Host("particles changed between densities and forces"));
        }
        let (pool, slopes, times) = (&self.pool, &self.slopes, &mut self.times);
        let out = ForceSink::new(force, true, particles.tag);
        with!(&mut self.workspace, m => {
            let mut since = Instant::now();
            m.add_rim(pool, slopes, out)?;
            lap(&mut since, &mut times.second);
            Ok(m.tally())
        })
    }

    /// ψ and local densities of owned particles in the host's order, as [`Engine::excess`](super::Engine::excess) and
    /// [`Results::densities`](super::Results::densities); densities that forces do not need are zero. Without an evaluation
    /// there are none.
    pub fn local_densities(&self, excess: &mut Vec<f64>, densities: &mut Vec<f64>) {
        if !self.is_complete {
            return [excess, densities].into_iter().for_each(Vec::clear);
        }
        let variables = self.plan.densities.len() * self.plan.species.len();
        with!(&self.workspace, m => m.to_host(variables, excess, densities));
    }

    /// The host's numbers of its particles in the order of cells; a host that keeps its particles in
    /// this order makes sorting cheap. Empty without an evaluation.
    pub fn order(&self) -> &[u32] {
        if !self.is_complete {
            return &[];
        }
        with!(&self.workspace, m => &m.order.order)
    }

    /// The particles of the last evaluation in the order of cells.
    pub(super) fn sorted(&self) -> Sorted<'_> {
        with!(&self.workspace, m => m.sorted())
    }

    /// Size in bytes of the arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        let numbers = self.slopes.capacity() + self.added_densities.capacity();
        let memory = |of: &EitherPrecision| with!(of, m => m.memory());
        let workspaces = memory(&self.workspace) + self.other.as_ref().map_or(0, memory);
        numbers * size_of::<f64>() + self.exclusions.bytes() + workspaces
    }
}

/// The cut-off of the cells. Particles without interactions are sorted too.
fn cutoff(plan: &Plan) -> f64 {
    if plan.cutoff > 0.0 { plan.cutoff } else { 1.0 }
}

#[cfg(test)]
mod tests;
