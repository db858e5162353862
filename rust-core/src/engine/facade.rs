//! The engine, which computes all forces and chooses between the sweep and the sums over pairs for each evaluation.

use super::counts::PassCounts;
use super::error::EngineError;
use super::fault::Fault;
use super::pair_sums::{Corrections, PairSums};
use super::particles::{Particles, Step};
use super::path::{Path, Reason};
use super::plan::Plan;
use super::surroundings::{Around, SpecialPair, Surroundings};
use super::sweep::{Pool, Sweep, Times};
use crate::model::Fluid;
use crate::model::expression::TooLarge;
use psidpd_passes::cells::excluded::Mark;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::settings::Settings;
use psidpd_passes::tally::{Tally, Want};
use std::sync::Arc;

/// The forces of one fluid on the particles of a host.
///
/// [`Engine::forces`] evaluates particles without ghosts. With ghosts, or with pairs that the host lists, the host
/// calls [`Engine::first`], copies [`Engine::slopes_mut`] from owners to ghosts, and calls [`Engine::second`].
///
/// Every evaluation takes the fastest [`Path`] that can compute its request.
#[derive(Debug, Clone)]
pub struct Engine {
    pair_sums: PairSums,
    sweep: Sweep,
    pair_sums_only: bool,
    special: Vec<SpecialPair>,
    /// Whether the sweep has the special pairs.
    knows_special: bool,
    corrections: Corrections,
    /// Path of the last evaluation.
    path: Option<Path>,
    /// ψ of owned particles and their densities in the last evaluation, if they have been fetched.
    excess: Vec<f64>,
    densities: Vec<f64>,
}

/// The input of an evaluation, and the results that it should compute.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Owned particles and ghosts.
    pub particles: Particles<'a>,
    /// Velocities of particles and ghosts; may be empty if no thermostat acts.
    pub v: &'a [[f64; 3]],
    /// Seed, number and length of the time step, for the thermostat; `None` for conservative forces only.
    pub step: Option<Step>,
    /// The results to compute besides forces.
    pub want: Want,
}

/// Results for one configuration in a box, without a thermostat.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluated {
    /// The potential energy `U`, in the energy unit of the model.
    pub energy: f64,
    /// Virial `Σ r_ij ⊗ F_ij`: xx, yy, zz, xy, xz, yz.
    pub virial: [f64; 6],
    /// Uncorrected local densities; each particle has one for each density and species, density-major.
    pub densities: Vec<f64>,
    /// The force on each particle.
    pub forces: Vec<[f64; 3]>,
}

impl Engine {
    /// Creates an engine for `fluid`; types are species indices unless [`Engine::map_kinds`] maps them.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn new(fluid: &Fluid, settings: Settings) -> Result<Engine, TooLarge> {
        Engine::with_pool(fluid, settings, Arc::new(Pool::new(settings.threads)))
    }

    /// Creates an engine with a given thread pool, which others may use too.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn with_pool(fluid: &Fluid, settings: Settings, pool: Arc<Pool>) -> Result<Engine, TooLarge> {
        Ok(Engine::of_plan(Plan::new(fluid)?, settings, pool))
    }

    /// Creates an engine with a faulty sweep, for tests that a check finds the fault.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    #[doc(hidden)]
    pub fn with_fault(fluid: &Fluid, settings: Settings, fault: Fault) -> Result<Engine, TooLarge> {
        let mut plan = Plan::new(fluid)?;
        plan.fault = Some(fault);
        Ok(Engine::of_plan(plan, settings, Arc::new(Pool::new(settings.threads))))
    }

    fn of_plan(plan: Plan, settings: Settings, pool: Arc<Pool>) -> Engine {
        Engine {
            pair_sums: PairSums::of_plan(plan.clone()),
            sweep: Sweep::of_plan(plan, settings, pool),
            pair_sums_only: false,
            special: Vec::new(),
            knows_special: true,
            corrections: Corrections::default(),
            path: None,
            excess: Vec::new(),
            densities: Vec::new(),
        }
    }

    /// The plan of the fluid's passes.
    pub fn plan(&self) -> &Plan {
        self.sweep.plan()
    }

    /// The settings of the sweep, with the instruction set in use.
    pub fn settings(&self) -> Settings {
        self.sweep.settings()
    }

    /// The pool of threads.
    pub fn pool(&self) -> &Arc<Pool> {
        self.sweep.pool()
    }

    /// Times of the parts of sweeps.
    pub fn times(&self) -> Times {
        self.sweep.times()
    }

    /// Number of runs of each pass.
    pub fn counts(&self) -> PassCounts {
        self.pair_sums.counts() + self.sweep.counts()
    }

    /// Numbers of evaluations of ψ with a density below its bounds, and above, since the engine was
    /// made. Only densities that the particle's ψ depends on nonlinearly count.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        let (a, b) = (self.pair_sums.out_of_bounds(), self.sweep.out_of_bounds());
        [a[0] + b[0], a[1] + b[1]]
    }

    /// Maps the host's types to species: entry `kind` is the species of type `kind`, negative for
    /// particles that do not interact.
    ///
    /// # Errors
    /// Fails for a species index out of range.
    pub fn map_kinds(&mut self, kinds: &[i32]) -> Result<(), EngineError> {
        self.pair_sums.map_kinds(kinds)?;
        self.sweep.map_kinds(kinds)
    }

    /// Sets the pairs with reduced strength for later evaluations, until the host changes them or renumbers its particles.
    ///
    /// Within the cut-off two particles must meet in one image only. A sweep leaves these pairs out,
    /// and those with a factor above 0 are then added. Pairs that the host lists have factors in its
    /// list; special pairs do not apply to them.
    pub fn set_special_pairs(&mut self, pairs: impl IntoIterator<Item = SpecialPair>) {
        self.special.clear();
        self.special.extend(pairs.into_iter().filter(|pair| pair.factor != 1.0));
        self.knows_special = false;
    }

    /// Sets `marks` that exclude pairs from later evaluations, in addition to special pairs with a
    /// factor of 0: one mark for each particle and ghost, or none; see [`Mark::excludes`]. Marks do not
    /// apply to pairs that the host lists.
    pub fn set_exclusions(&mut self, marks: impl IntoIterator<Item = Mark>, between_molecules: bool) {
        self.sweep.exclusions_mut().mark(marks, between_molecules);
    }

    /// Restricts all evaluations to sums over pairs, for tests and for measurements of the sweep's speed-up.
    pub fn use_pair_sums_only(&mut self, only: bool) {
        self.pair_sums_only = only;
    }

    /// The path that the last evaluation took; `None` before the first.
    pub fn path(&self) -> Option<Path> {
        self.path
    }

    /// The path that an evaluation of `want` would take.
    pub fn path_for(&self, surroundings: Surroundings, want: Want) -> Path {
        let fits = match surroundings {
            Surroundings::Listed(..) => return Path::PairSums(Reason::ListedPairs),
            Surroundings::Box(domain) => self.sweep.fits(domain),
            Surroundings::Ghosts(around, _) => self.sweep.fits(around.domain),
        };
        if self.pair_sums_only {
            Path::PairSums(Reason::Asked)
        } else if want.of_particles() {
            Path::PairSums(Reason::ParticleValues)
        } else if want.densities && !self.sweep_has_all_densities() {
            Path::PairSums(Reason::Densities)
        } else if !fits {
            Path::PairSums(Reason::Box)
        } else {
            Path::Sweep
        }
    }

    /// Describes a path and its settings: "cell sweep, mixed precision, avx2, 2 threads".
    pub fn describe(&self, path: Path) -> String {
        let Settings { precision, instructions, threads } = self.settings();
        match path {
            Path::Sweep => format!("{path}, {precision} precision, {instructions}, {threads} thread(s)"),
            Path::PairSums(_) => format!("{path}; double precision, 1 thread"),
        }
    }

    /// Whether forces need every density of the model.
    fn sweep_has_all_densities(&self) -> bool {
        let plan = self.plan();
        plan.density_passes().len() == plan.densities().count()
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
            densities: self.local_densities().to_vec(),
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
        let Request { particles, v, step, want } = request;
        match self.begin(Surroundings::Box(domain), *want) {
            Path::Sweep => {
                self.find_corrections(Around { domain, images: &[] }, particles)?;
                let mut tally = self.sweep.evaluate(domain, particles, v, *step, *want, force, add)?;
                if !self.corrections.is_empty() {
                    self.sweep.fetch_slopes(particles.owned);
                    tally += self.correct(request, force)?;
                }
                self.fetch(*want);
                let factor = Fault::factor(Fault::Virial, self.plan().fault);
                tally.virial.iter_mut().chain(&mut tally.thermostat_virial).for_each(|w| *w *= factor);
                Ok(tally)
            }
            Path::PairSums(_) => {
                self.pair_sums.set_special_pairs(&self.special, self.sweep.exclusions());
                self.pair_sums.first(Surroundings::Box(domain), particles, want.densities)?;
                self.finish(request, force, add)
            }
        }
    }

    /// The first half of an evaluation, which needs no slopes of ghosts. The second half has the same
    /// `request`, and the same `force`, to which either half adds its part; sums over pairs add all
    /// forces in the second half.
    ///
    /// # Errors
    /// Fails for a position, ψ or force that is not finite, a tag or type out of range, arrays of different
    /// lengths, and listed pairs of particles that do not exist.
    pub fn first(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<(), EngineError> {
        let Request { particles, v, step, want } = request;
        let around = match (self.begin(surroundings, *want), surroundings) {
            (Path::Sweep, Surroundings::Ghosts(around, _)) => around,
            (Path::Sweep, Surroundings::Box(domain)) => Around { domain, images: &[] },
            _ => {
                self.pair_sums.set_special_pairs(&self.special, self.sweep.exclusions());
                return self.pair_sums.first(surroundings, particles, want.densities);
            }
        };
        self.find_corrections(around, particles)?;
        self.sweep.first(around, particles, v, *step, *want, force)
    }

    /// Computes the contributions of special pairs to a sweep, which leaves them out, and adds those to the densities.
    fn find_corrections(&mut self, around: Around, particles: &Particles) -> Result<(), EngineError> {
        let Engine { pair_sums, sweep, special, corrections, .. } = self;
        let (exclusions, densities) = sweep.beside_mut();
        exclusions.check(particles.x.len())?;
        let excluded = |i, j| exclusions.excludes(i, j);
        corrections.find(
            pair_sums.plan(),
            special,
            excluded,
            around,
            particles,
            pair_sums.kinds(),
            densities,
        )?;
        if !self.knows_special {
            exclusions.set(special);
            self.knows_special = true;
        }
        Ok(())
    }

    /// Adds the forces of special pairs to those of a sweep, whose slopes are complete; returns
    /// their contribution to the totals.
    fn correct(&self, request: &Request, force: &mut [[f64; 3]]) -> Result<Tally, EngineError> {
        let Request { particles, v, step, want } = request;
        let (plan, slopes) = (self.sweep.plan(), self.sweep.slopes());
        let thermostat = step
            .filter(|_| plan.thermostat.is_some())
            .map(|s| (PairNoise::new(s.seed, s.number), 1.0 / s.dt.sqrt()));
        self.corrections.add_forces(plan, slopes, particles, v, thermostat, *want, force)
    }

    /// Slopes `∂ψ/∂n` of owned particles, followed by room for those of ghosts, [`Plan::slope_width`] each.
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        match self.path {
            Some(Path::PairSums(_)) => self.pair_sums.slopes_mut(),
            _ => self.sweep.slopes_mut(),
        }
    }

    /// The second half of an evaluation: adds the rest of the forces to `force`, and returns the requested
    /// totals.
    ///
    /// Only the sums over pairs compute forces on ghosts, if the host returns these to their owners.
    /// The sweep leaves ghosts without forces: the rank of the other particle computes the pair too,
    /// and this rank counts half of its energy and virial.
    ///
    /// # Errors
    /// Fails for a force that is not finite, and for arrays of other lengths than in [`Engine::first`].
    pub fn second(&mut self, request: &Request, force: &mut [[f64; 3]]) -> Result<Tally, EngineError> {
        match self.path {
            Some(Path::PairSums(_)) => self.finish(request, force, true),
            _ => {
                let mut tally = self.sweep.second(&request.particles, force)?;
                if !self.corrections.is_empty() {
                    tally += self.correct(request, force)?;
                }
                self.fetch(request.want);
                Ok(tally)
            }
        }
    }

    /// Chooses the path of a new evaluation.
    fn begin(&mut self, surroundings: Surroundings, want: Want) -> Path {
        let path = self.path_for(surroundings, want);
        self.path = Some(path);
        self.excess.clear();
        self.densities.clear();
        path
    }

    /// The second half of an evaluation by sums over pairs.
    fn finish(&mut self, request: &Request, force: &mut [[f64; 3]], add: bool) -> Result<Tally, EngineError> {
        if !add {
            force.fill([0.0; 3]);
        }
        let Request { particles, v, step, want } = request;
        self.pair_sums.second(particles, v, *step, *want, force)
    }

    /// Stores the densities of a sweep that was asked for them.
    fn fetch(&mut self, want: Want) {
        if want.densities {
            self.sweep.local_densities(&mut self.excess, &mut self.densities);
        }
    }

    /// Uncorrected local densities of owned particles in the last evaluation, one for each density and
    /// species, density-major. If the request did not include densities and [`Engine::sum_densities`]
    /// was not called, the slice is empty after a sweep, and has zeros for densities that no force
    /// needs after an evaluation by sums over pairs.
    pub fn local_densities(&self) -> &[f64] {
        match self.path {
            Some(Path::PairSums(_)) => self.pair_sums.local_densities(),
            _ => &self.densities,
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
        let variables = self.plan().densities().count() * self.plan().species().len();
        match self.path {
            // The list of pairs still exists.
            Some(Path::PairSums(_)) => self.pair_sums.sum_all_densities(None),
            _ if !self.densities.is_empty() => Ok(&self.densities),
            Some(Path::Sweep) if self.sweep_has_all_densities() => {
                self.sweep.local_densities(&mut self.excess, &mut self.densities);
                Ok(&self.densities)
            }
            None => {
                self.densities.resize(particles.owned * variables, 0.0);
                Ok(&self.densities)
            }
            Some(Path::Sweep) => {
                self.pair_sums.set_special_pairs(&self.special, self.sweep.exclusions());
                let all = self.pair_sums.sum_all_densities(Some((surroundings, particles)))?;
                self.densities.extend_from_slice(all);
                Ok(&self.densities)
            }
        }
    }

    /// ψ of owned particles in the last evaluation, without the terms that act as pair potentials.
    pub fn excess(&mut self) -> &[f64] {
        match self.path {
            Some(Path::PairSums(_)) => self.pair_sums.excess(),
            Some(Path::Sweep) if self.excess.is_empty() => {
                self.sweep.local_densities(&mut self.excess, &mut Vec::new());
                &self.excess
            }
            _ => &self.excess,
        }
    }

    /// Energy of each particle and ghost, if the last evaluation was asked for it: its ψ and half of its pair energies.
    pub fn particle_energy(&self) -> &[f64] {
        self.pair_sums.particle_energy()
    }

    /// Virial of each particle and ghost, if the last evaluation was asked for it: half of the virials of its pairs.
    pub fn particle_virial(&self) -> &[[f64; 6]] {
        self.pair_sums.particle_virial()
    }

    /// Copies the slopes of owned particles to [`Engine::slopes_mut`] after [`Engine::forces`], with
    /// room for `all`; [`Engine::single`] needs them.
    pub fn fetch_slopes(&mut self, all: usize) {
        match self.path {
            Some(Path::PairSums(_)) => {
                let length = self.plan().slope_width() * all;
                self.pair_sums.slopes_mut().resize(length, 0.0);
            }
            _ => self.sweep.fetch_slopes(all),
        }
    }

    /// Pair energy, and conservative force along `ê_ij`, of particles `i` and `j` of the given types at the distance
    /// `r`, with the slopes of ψ in the last evaluation.
    ///
    /// The energy is that of the terms that belong to pairs: `φ`, and ψ where it is linear in a
    /// density. The force includes the many-body part, if slopes are available.
    pub fn single(&self, kinds: [i32; 2], r: f64, particles: [usize; 2]) -> (f64, f64) {
        let slopes = match self.path {
            Some(Path::PairSums(_)) => self.pair_sums.slopes(),
            _ => self.sweep.slopes(),
        };
        self.pair_sums.single_at(kinds, r, slopes, particles)
    }

    /// The host's numbers of its particles in the order of cells; a host that keeps its particles in
    /// this order makes sorting cheap. `None` if the last evaluation was no sweep.
    pub fn order(&self) -> Option<&[u32]> {
        (self.path == Some(Path::Sweep)).then(|| self.sweep.order())
    }

    /// Size in bytes of the arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        let held = self.excess.capacity() + self.densities.capacity();
        let special = self.special.capacity() * size_of::<SpecialPair>() + self.corrections.memory();
        self.pair_sums.memory() + self.sweep.memory() + special + held * size_of::<f64>()
    }
}

#[cfg(test)]
mod special_tests;
#[cfg(test)]
mod tests;
