//! Forces between the particles: the engine of one model at one temperature, and the totals of its last evaluation.

use super::particles::Particles;
use super::{RunError, Simulation};
use psidpd_core::engine::{
    self, Engine, Fault, PassCounts, PeriodicBox, Plan, Pool, Precision, Request, Settings, Step,
    Surroundings, Tally, Want,
};
use psidpd_core::model::Model;

#[derive(Debug, Clone)]
pub(super) struct Forces {
    model: Model,
    kt: f64,
    engine: Engine,
    tally: Tally,
    all_densities: bool,
    pair_sums_only: bool,
    /// What engines of earlier temperatures counted.
    earlier_out_of_bounds: [u64; 2],
}

impl Forces {
    /// # Errors
    /// The model does not hold at `kt`.
    pub fn new(model: &Model, kt: f64) -> Result<Forces, RunError> {
        let settings = Settings { precision: Precision::Double, ..Settings::default() };
        Ok(Forces {
            engine: Engine::new(&model.at(kt)?, settings)?,
            model: model.clone(),
            kt,
            tally: Tally::default(),
            all_densities: false,
            pair_sums_only: false,
            earlier_out_of_bounds: [0; 2],
        })
    }

    /// Computes forces between particles, with noise and drag of `step`, or conservative ones only; no body forces.
    /// Errors name the step by its `number`.
    pub fn compute(
        &mut self,
        particles: &mut Particles,
        want: Want,
        step: Option<Step>,
        number: u64,
    ) -> Result<(), RunError> {
        let (state, force) = particles.forces_mut();
        if let Some(step) = step {
            if !(step.dt > 0.0 && step.dt.is_finite()) {
                return Err(RunError::TimeStep(step.dt));
            }
            self.check_width(&state.domain)?;
        }
        let step = step.filter(|_| self.plan().needs_velocities());
        let want = Want { densities: want.densities || self.all_densities, ..want };
        let particles =
            engine::Particles { owned: state.len(), x: &state.x, tag: &state.tag, kind: &state.species };
        let request = Request { particles, v: &state.v, step, want };
        let failed = |source| RunError::Engine { step: number, source };
        self.tally = self.engine.forces(&state.domain, &request, force, false).map_err(failed)?;
        Ok(())
    }

    /// Makes the totals of the last evaluation infinite.
    pub fn set_infinite(&mut self) {
        self.tally = Tally { excess: f64::INFINITY, virial: [f64::INFINITY; 6], ..Tally::default() };
    }

    /// Refuses boxes in which a particle meets two images of one neighbour within the range of the noise.
    pub fn check_width(&self, domain: &PeriodicBox) -> Result<(), RunError> {
        let Some(range) = self.plan().noise_range() else { return Ok(()) };
        let periodic = domain.periodic();
        let heights = (0..self.plan().dimensions()).filter(|k| periodic[*k]).map(|k| domain.height(k));
        let height = heights.fold(f64::INFINITY, f64::min);
        // Widths come from an inverse matrix: leave room for its rounding.
        if height < 2.0 * range * (1.0 - 1e-12) {
            Err(RunError::BoxTooNarrow { height, range })
        } else {
            Ok(())
        }
    }

    /// Adds the virial of impulses that the thermostat gave apart from the forces.
    pub fn add_thermostat_virial(&mut self, virial: [f64; 6]) {
        (0..6).for_each(|c| self.tally.thermostat_virial[c] += virial[c]);
    }

    pub fn plan(&self) -> &Plan {
        self.engine.plan()
    }

    pub fn settings(&self) -> Settings {
        self.engine.settings()
    }

    pub fn pool(&self) -> &Pool {
        self.engine.pool()
    }

    pub fn kt(&self) -> f64 {
        self.kt
    }

    /// The order of the particles in the last sweep, if there was one.
    pub fn order(&self) -> Option<&[u32]> {
        self.engine.order()
    }

    pub fn count_out_of_bounds_from(&mut self, earlier: [u64; 2]) {
        self.earlier_out_of_bounds = earlier;
    }

    /// # Errors
    /// The model does not hold at `kt`.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), RunError> {
        let (settings, pool) = (self.engine.settings(), self.engine.pool().clone());
        self.replace(Engine::with_pool(&self.model.at(kt)?, settings, pool)?);
        self.kt = kt;
        Ok(())
    }

    fn replace(&mut self, engine: Engine) {
        self.earlier_out_of_bounds = self.out_of_bounds();
        self.engine = engine;
        self.engine.use_pair_sums_only(self.pair_sums_only);
    }

    fn out_of_bounds(&self) -> [u64; 2] {
        let now = self.engine.out_of_bounds();
        std::array::from_fn(|k| self.earlier_out_of_bounds[k] + now[k])
    }
}

impl Simulation {
    /// Makes forces wrong from now on, until settings or the temperature are set: for tests that others notice it.
    ///
    /// # Errors
    /// As [`Simulation::set_settings`].
    #[doc(hidden)]
    pub fn falsify(&mut self, fault: Fault) -> Result<(), RunError> {
        let Forces { model, kt, engine, .. } = &self.forces;
        let engine = Engine::with_fault(&model.at(*kt)?, engine.settings(), fault)?;
        self.forces.replace(engine);
        Ok(())
    }

    /// Settings for the evaluations to come; by default double precision on one thread.
    ///
    /// # Errors
    /// The model does not hold at the present temperature: never, since it did before.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), RunError> {
        let Forces { model, kt, .. } = &self.forces;
        self.forces.replace(Engine::new(&model.at(*kt)?, settings)?);
        self.thermostat.follow(&self.forces);
        Ok(())
    }

    /// How forces are computed.
    pub fn settings(&self) -> Settings {
        self.forces.settings()
    }

    /// The engine, for what it can tell of itself.
    pub fn engine(&self) -> &Engine {
        &self.forces.engine
    }

    /// The path of steps that want forces only, for people.
    pub fn evaluation(&self) -> String {
        let Forces { engine, all_densities, .. } = &self.forces;
        let want = Want { densities: *all_densities, ..Want::FORCES };
        engine.describe(engine.path_for(Surroundings::Box(self.domain()), want))
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.forces.model
    }

    /// kT.
    pub fn kt(&self) -> f64 {
        self.forces.kt
    }

    /// The plan of the engine.
    pub fn plan(&self) -> &Plan {
        self.forces.plan()
    }

    /// 2 or 3.
    pub fn dimensions(&self) -> usize {
        self.forces.plan().dimensions()
    }

    /// How many evaluations of ψ met a density below its bounds, and above them.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        self.forces.out_of_bounds()
    }

    /// How often each pass of the engine has run, since the temperature was last changed.
    pub fn counts(&self) -> PassCounts {
        self.forces.engine.counts()
    }

    /// Local densities of the particles in the last evaluation, if [`Simulation::sum_all_densities`] asked for them: one
    /// for each density and species, density-major.
    pub fn local_densities(&self) -> &[f64] {
        self.forces.engine.local_densities()
    }

    /// Whether evaluations compute every density of the model.
    pub fn sum_all_densities(&mut self, all: bool) {
        self.forces.all_densities = all;
    }

    /// Whether every evaluation is done by the reference, which is slower and in double precision.
    pub fn use_pair_sums_only(&mut self, only: bool) {
        self.forces.pair_sums_only = only;
        self.forces.engine.use_pair_sums_only(only);
    }

    /// Energies and virials of the last evaluation, as far as they were wanted.
    pub fn tally(&self) -> &Tally {
        &self.forces.tally
    }
}
