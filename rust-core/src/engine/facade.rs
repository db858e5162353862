//! The engine, which computes all forces and chooses between the sweep and the sums over pairs for each evaluation.

use super::counts::PassCounts;
use super::error::EngineError;
use super::evaluate::{DevicePath, Evaluate};
use super::pair_sums::PairSums;
use super::particles::Particles;
use super::path::{Path, Reason};
use super::plan::Plan;
use super::request::{Evaluated, Request, Results};
use super::surroundings::{Around, Newton, SpecialPair, Surroundings};
use super::sweep::{Pool, Sweep, Times, UNFIT};
use super::sweep_path::SweepPath;
use super::walls::{self, OnWall};
use crate::model::Fluid;
use crate::model::expression::TooLarge;
use psidpd_passes::cells::excluded::Mark;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::settings::Settings;
use psidpd_passes::tally::{Tally, Want};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The forces of one fluid on the particles of a host.
///
/// [`Engine::forces`] evaluates particles without ghosts. With ghosts, or with pairs that the host lists, the host
/// calls [`Engine::first`], copies the [`Pending::slopes_mut`] from owners to ghosts, and calls [`Pending::finish`].
///
/// Every evaluation takes the fastest [`Path`] that can compute its request.
#[derive(Debug)]
pub struct Engine {
    pair_sums: PairSums,
    sweep: SweepPath,
    device: Option<Box<dyn DevicePath>>,
    pair_sums_only: bool,
    /// Path of the last evaluation.
    path: Option<Path>,
    /// Number of the last evaluation, different for all engines.
    number: u64,
    /// What each wall takes in the last evaluation that added it up.
    on_walls: Vec<OnWall>,
    /// Whether every evaluation adds that up, or those of totals.
    always_sums_walls: bool,
}

/// The first half of an evaluation, whose second half needs the slopes of ghosts.
#[derive(Debug)]
#[must_use]
pub struct Pending {
    slopes: Vec<f64>,
    number: u64,
    /// The box, if there are walls.
    walls_in: Option<Box<PeriodicBox>>,
}

/// Times and counts of an engine's work since it was made.
#[derive(Debug, Clone, Copy)]
pub struct Statistics {
    /// Times of the parts of sweeps.
    pub times: Times,
    /// Number of runs of each pass.
    pub counts: PassCounts,
    /// Numbers of evaluations of ψ with a density below its bounds, and above. Only densities that the particle's ψ
    /// depends on nonlinearly count.
    pub out_of_bounds: [u64; 2],
}

impl Pending {
    /// Slopes `∂ψ/∂n` of owned particles, followed by room for those of ghosts, [`Plan::slope_width`] each.
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        &mut self.slopes
    }

    /// The second half of the evaluation of `engine`, with the `request` of the first: adds the rest of the forces to
    /// `force`, and returns the requested totals.
    ///
    /// Only the sums over pairs compute forces on ghosts, if the host returns these to their owners.
    /// The sweep leaves ghosts without forces: the rank of the other particle computes the pair too,
    /// and this rank counts half of its energy and virial.
    ///
    /// # Errors
    /// Fails for a force that is not finite, for arrays of other lengths than in [`Engine::first`], and if the engine has
    /// begun another evaluation.
    pub fn finish(
        self,
        engine: &mut Engine,
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, EngineError> {
        if self.number != engine.number {
            return Err(EngineError::Host("the engine has begun another evaluation since this first half"));
        }
        let path = engine.last_mut();
        *path.slopes_mut() = self.slopes;
        let mut tally = path.second(request, force)?;
        if let Some(domain) = &self.walls_in {
            tally += engine.add_walls(domain, request, force);
        }
        Ok(tally)
    }
}

impl Engine {
    /// Creates an engine for `fluid`; types are species indices unless [`Engine::map_kinds`] maps them.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn new(fluid: &Fluid, settings: Settings) -> Result<Engine, TooLarge> {
        Ok(Engine::of_plan(Plan::new(fluid)?, settings, Arc::new(Pool::new(settings.threads))))
    }

    fn of_plan(plan: Plan, settings: Settings, pool: Arc<Pool>) -> Engine {
        Engine {
            on_walls: vec![OnWall::default(); plan.walls.len()],
            always_sums_walls: false,
            pair_sums: PairSums::of_plan(plan.clone()),
            sweep: SweepPath::new(Sweep::of_plan(plan, settings, pool)),
            device: None,
            pair_sums_only: false,
            path: None,
            number: 0,
        }
    }

    /// Takes the same model at another temperature, or other settings. The map of types and the restriction to sums over
    /// pairs stay; with another number of species types are species indices again. Counts begin anew; there are no special
    /// pairs, no exclusions and no device.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn renew(&mut self, fluid: &Fluid, settings: Settings) -> Result<(), TooLarge> {
        let mut plan = Plan::new(fluid)?;
        // The passes read tables by species without checks.
        if plan.species.len() == self.plan().species.len() {
            plan.species_of_type.clone_from(&self.plan().species_of_type);
        }
        self.replace(plan, settings);
        Ok(())
    }

    fn replace(&mut self, plan: Plan, settings: Settings) {
        let pool = match settings.threads == self.settings().threads {
            true => Arc::clone(self.pool()),
            false => Arc::new(Pool::new(settings.threads)),
        };
        let Engine { pair_sums_only, always_sums_walls, .. } = *self;
        *self = Engine { pair_sums_only, always_sums_walls, ..Engine::of_plan(plan, settings, pool) };
    }

    /// The plan of the fluid's passes.
    pub fn plan(&self) -> &Plan {
        &self.sweep.plan
    }

    /// The sweep, which lists pairs for a thermostat.
    pub(super) fn sweep_mut(&mut self) -> &mut Sweep {
        &mut self.sweep.sweep
    }

    /// The settings of the sweep, with the instruction set in use.
    pub fn settings(&self) -> Settings {
        self.sweep.sweep.settings()
    }

    /// The pool of threads.
    pub fn pool(&self) -> &Arc<Pool> {
        self.sweep.sweep.pool()
    }

    /// Times and counts of the engine's work since it was made.
    pub fn statistics(&self) -> Statistics {
        let (sweep, sums) = (&self.sweep.sweep, &self.pair_sums);
        let (a, b) = (sums.excess_pass.out_of_bounds, sweep.out_of_bounds());
        let c = self.device.as_ref().map_or([0; 2], |device| device.out_of_bounds());
        Statistics {
            times: self.sweep.times(),
            counts: sums.counts + sweep.counts(),
            out_of_bounds: [a[0] + b[0] + c[0], a[1] + b[1] + c[1]],
        }
    }

    /// Maps the host's types to species: entry `kind` is the species of type `kind`, negative for
    /// particles that do not interact.
    ///
    /// # Errors
    /// Fails for a species index out of range.
    pub fn map_kinds(&mut self, kinds: &[i32]) -> Result<(), EngineError> {
        self.pair_sums.plan.map_kinds(kinds)?;
        if let Some(device) = &mut self.device {
            device.map_kinds(kinds);
        }
        self.sweep.map_kinds(kinds)
    }

    /// Makes later evaluations on a GPU, or on none, and returns the one before.
    ///
    /// The GPU computes forces and totals; sums over pairs compute what else is requested. There may be no special
    /// pairs and no exclusions.
    pub fn use_device(&mut self, mut device: Option<Box<dyn DevicePath>>) -> Option<Box<dyn DevicePath>> {
        if let Some(device) = &mut device {
            device.map_kinds(&self.plan().species_of_type);
        }
        std::mem::replace(&mut self.device, device)
    }

    /// The GPU in words, if there is one.
    pub fn device_name(&self) -> Option<String> {
        self.device.as_ref().map(|device| device.name())
    }

    /// Sets the pairs with reduced strength for later evaluations, until the host changes them or renumbers its particles.
    ///
    /// Within the cut-off two particles must meet in one image only. A sweep leaves these pairs out,
    /// and those with a factor above 0 are then added. Pairs that the host lists have factors in its
    /// list; special pairs do not apply to them.
    pub fn set_special_pairs(&mut self, pairs: impl IntoIterator<Item = SpecialPair>) {
        self.sweep.set_special(pairs);
    }

    /// Sets `marks` that exclude pairs from later evaluations, in addition to special pairs with a
    /// factor of 0: one mark for each particle and ghost, or none; see [`Mark::excludes`]. Marks do not
    /// apply to pairs that the host lists.
    pub fn set_exclusions(&mut self, marks: impl IntoIterator<Item = Mark>, between_molecules: bool) {
        self.sweep.sweep.exclusions.mark(marks, between_molecules);
    }

    /// Restricts all evaluations to sums over pairs, for tests and for measurements of the sweep's speed-up.
    pub fn use_pair_sums_only(&mut self, only: bool) {
        self.pair_sums_only = only;
    }

    /// The path that the last evaluation took; `None` before the first.
    pub fn path(&self) -> Option<Path> {
        self.path
    }

    /// Number of pair potentials that the sweep leaves to a search around particles of rare species, as their ranges are longer than those of
    /// the rest of the fluid; decided anew in every evaluation without ghosts.
    pub fn potentials_apart(&self) -> usize {
        self.sweep.long.as_ref().map_or(0, |long| long.which.len())
    }

    /// The path that an evaluation of `want` would take.
    pub fn path_for(&self, surroundings: Surroundings, want: Want) -> Path {
        let Some(Around { domain, .. }) = surroundings.around() else {
            return Path::PairSums(Reason::ListedPairs);
        };
        let fits = match &self.device {
            Some(device) => device.fits(domain),
            None => self.sweep.fits(domain),
        };
        if self.pair_sums_only {
            Path::PairSums(Reason::Asked)
        } else if want.of_particles() {
            Path::PairSums(Reason::ParticleValues)
        } else if want.densities && (self.device.is_some() || !self.sweep.has_all_densities()) {
            Path::PairSums(Reason::Densities)
        } else if !fits {
            Path::PairSums(Reason::Box)
        } else if self.device.is_some() {
            Path::Device
        } else {
            Path::Sweep
        }
    }

    /// Energy, virial, densities and conservative forces of particles at `x`, of a type each, in a box.
    ///
    /// Positions may be outside the box: along periodic directions they stand for an image.
    ///
    /// # Errors
    /// Fails as [`Engine::forces`], and if the numbers of types and positions differ.
    pub fn evaluate(
        &mut self,
        x: &[[f64; 3]],
        domain: &PeriodicBox,
        kinds: &[i32],
    ) -> Result<Evaluated, EngineError> {
        let count = i32::try_from(x.len()).map_err(|_| EngineError::Host("more than 2^31 particles"))?;
        let tag: Vec<i32> = (1..=count).collect();
        let particles = Particles { owned: x.len(), x, tag: &tag, kind: kinds };
        let want = Want { densities: true, ..Want::TOTALS };
        let mut forces = vec![[0.0; 3]; x.len()];
        let request = Request { particles, v: &[], step: None, want };
        let tally = self.forces(domain, &request, &mut forces, false)?;
        Ok(Evaluated {
            energy: tally.energy(),
            virial: tally.virial,
            densities: self.results().densities.to_vec(),
            forces,
        })
    }

    /// Computes all forces on particles in a box without ghosts, writes them to `force` or adds them to
    /// it, and returns the requested totals.
    ///
    /// # Errors
    /// Fails for a position, ψ or force that is not finite, when some forces may have been written;
    /// also for a tag or type out of range, arrays of different lengths, and ghosts.
    pub fn forces(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<Tally, EngineError> {
        let path = self.begin(Surroundings::Box(domain), request.want)?;
        let mut tally = match path.whole(domain, request, force, add) {
            Err(UNFIT) if self.path == Some(Path::Sweep) => {
                self.take_pair_sums().whole(domain, request, force, add)?
            }
            done => done?,
        };
        if !self.plan().walls.is_empty() {
            self.fetch_slopes(request.particles.owned);
            tally += self.add_walls(domain, request, force);
        }
        Ok(tally)
    }

    /// Adds the forces of walls, whose densities are among those of the evaluation before.
    fn add_walls(&mut self, domain: &PeriodicBox, request: &Request, force: &mut [[f64; 3]]) -> Tally {
        let Request { particles, want, .. } = request;
        let sums = want.energy || want.virial || self.always_sums_walls;
        let mut on_walls = std::mem::take(&mut self.on_walls);
        let slopes = std::mem::take(self.last_mut().slopes_mut());
        let (plan, pool) = (self.plan(), self.pool());
        let faces = walls::faces(&plan.walls, domain, plan.dimensions);
        let tally = walls::add_forces(pool, plan, (&faces, particles), &slopes, sums, force, &mut on_walls);
        *self.last_mut().slopes_mut() = slopes;
        self.on_walls = on_walls;
        tally
    }

    /// What each wall takes in the last evaluation of totals, or in the last of all with [`Engine::always_sum_walls`]; of a rank, what
    /// its own particles give.
    pub fn on_walls(&self) -> &[OnWall] {
        &self.on_walls
    }

    /// Makes every evaluation add up what walls take.
    pub fn always_sum_walls(&mut self) {
        self.always_sums_walls = true;
    }

    /// Sums over pairs, for particles that are too far apart for a sweep, which has not begun then.
    fn take_pair_sums(&mut self) -> &mut dyn Evaluate {
        self.path = Some(Path::PairSums(Reason::FarApart));
        self.tell_pair_sums();
        &mut self.pair_sums
    }

    /// The first half of an evaluation, which needs no slopes of ghosts. The second half, [`Pending::finish`], has the
    /// same `request`, and the same `force`, to which either half adds its part; sums over pairs add all forces in the
    /// second half.
    ///
    /// # Errors
    /// Fails for a position, ψ or force that is not finite, a tag or type out of range, arrays of different
    /// lengths, and listed pairs of particles that do not exist.
    pub fn first(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<Pending, EngineError> {
        let mut path = self.begin(surroundings, request.want)?;
        match path.first(surroundings, request, force) {
            Err(UNFIT) if self.path == Some(Path::Sweep) => {
                // Other ranks may sweep: these leave ghosts without forces too.
                let surroundings = match surroundings {
                    Surroundings::Ghosts(around, _) => Surroundings::Ghosts(around, Newton::Off),
                    others => others,
                };
                path = self.take_pair_sums();
                path.first(surroundings, request, force)?;
            }
            done => done?,
        }
        let path = self.last_mut();
        let slopes = std::mem::take(path.slopes_mut());
        let around = surroundings.around().filter(|_| !self.plan().walls.is_empty());
        Ok(Pending {
            slopes,
            number: self.number,
            walls_in: around.map(|around| Box::new(around.domain.clone())),
        })
    }

    /// Chooses the path of a new evaluation.
    fn begin(&mut self, surroundings: Surroundings, want: Want) -> Result<&mut dyn Evaluate, EngineError> {
        static NUMBER: AtomicU64 = AtomicU64::new(1);
        self.number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = self.path_for(surroundings, want);
        let has_walls = !self.plan().walls.is_empty();
        if has_walls && surroundings.around().is_none() {
            return Err(EngineError::Host("walls need a box, which a list of pairs does not have"));
        }
        if has_walls && path == Path::Device {
            return Err(EngineError::Device("a GPU computes no walls".to_owned()));
        }
        if path == Path::Device && self.sweep.leaves_out() {
            return Err(EngineError::Device("a GPU leaves no pairs out and scales none".to_owned()));
        }
        self.path = Some(path);
        self.sweep.forget();
        if path != Path::Sweep {
            self.sweep.sweep.ask_for_pairs(None);
            self.tell_pair_sums();
        }
        Ok(self.last_mut())
    }

    /// The path of the last evaluation.
    fn last_mut(&mut self) -> &mut dyn Evaluate {
        match (self.path, &mut self.device) {
            (Some(Path::PairSums(_)), _) => &mut self.pair_sums,
            (Some(Path::Device), Some(device)) => &mut **device,
            _ => &mut self.sweep,
        }
    }

    /// Gives the sums over pairs the special and excluded pairs.
    fn tell_pair_sums(&mut self) {
        self.pair_sums.set_special_pairs(&self.sweep.special, &self.sweep.sweep.exclusions);
    }

    /// Values of single particles in the last evaluation.
    pub fn results(&self) -> Results<'_> {
        let order = (self.path == Some(Path::Sweep)).then(|| self.sweep.sweep.order());
        match self.path {
            Some(Path::PairSums(_)) => self.pair_sums.results(),
            // Densities after an evaluation on a GPU are summed by this engine.
            _ => Results { densities: &self.sweep.densities, order, ..Results::default() },
        }
    }

    /// Every density of the model in the last evaluation, for `particles` that have not moved since;
    /// sums those that it did not compute. Before the first evaluation they are zero. Forces, slopes
    /// and the paths of later evaluations do not change.
    ///
    /// # Errors
    /// Fails as [`Engine::first`].
    pub fn sum_densities(
        &mut self,
        surroundings: Surroundings,
        particles: &Particles,
    ) -> Result<&[f64], EngineError> {
        match self.path {
            // The list of pairs still exists.
            Some(Path::PairSums(_)) => return self.pair_sums.sum_all_densities(None),
            Some(Path::Sweep) if self.sweep.fetch_densities() => {}
            Some(Path::Device) if !self.sweep.densities.is_empty() => {}
            Some(Path::Sweep | Path::Device) => {
                self.tell_pair_sums();
                let all = self.pair_sums.sum_all_densities(Some((surroundings, particles)))?;
                self.sweep.densities.extend_from_slice(all);
            }
            None => {
                let variables = self.plan().densities().count() * self.plan().species.len();
                self.sweep.densities.resize(particles.owned * variables, 0.0);
            }
        }
        Ok(self.results().densities)
    }

    /// ψ of owned particles in the last evaluation, without the terms that act as pair potentials.
    pub fn excess(&mut self) -> &[f64] {
        match self.path {
            Some(Path::PairSums(_)) => &self.pair_sums.excess,
            Some(Path::Sweep) => self.sweep.excess(),
            Some(Path::Device) | None => &[],
        }
    }

    /// Gets the slopes of owned particles after [`Engine::forces`], with room for `all` particles and ghosts;
    /// [`Engine::single`] needs them.
    pub fn fetch_slopes(&mut self, all: usize) {
        self.last_mut().fetch_slopes(all);
    }

    /// The slopes of the last evaluation, for the host to write those of ghosts. There are none before
    /// [`Engine::fetch_slopes`] or [`Pending::finish`].
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        self.last_mut().slopes_mut()
    }

    /// Pair energy, and conservative force along `ê_ij`, of particles `i` and `j` of the given types at the distance
    /// `r`, with the slopes of ψ in the last evaluation.
    ///
    /// The energy is that of the terms that belong to pairs: `φ`, and ψ where it is linear in a
    /// density. The force includes the many-body part, if slopes are available.
    pub fn single(&mut self, kinds: [i32; 2], r: f64, particles: [usize; 2]) -> (f64, f64) {
        let slopes = std::mem::take(self.last_mut().slopes_mut());
        let found = self.pair_sums.single(kinds, r, &slopes, particles);
        *self.last_mut().slopes_mut() = slopes;
        found
    }

    /// Size in bytes of the arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        self.pair_sums.memory() + self.sweep.memory()
    }
}

#[cfg(test)]
mod tests;
