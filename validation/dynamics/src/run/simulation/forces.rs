//! Forces between particles: the engine of one model at one temperature, and the totals of its last evaluation.

use super::conservative::Conservative;
use super::particles::Particles;
use super::{RunError, Simulation};
use crate::particles::State;
use psidpd_core::engine::pair_sums::has_particle_sums;
use psidpd_core::engine::{
    self, Engine, PeriodicBox, Precision, Request, Settings, Step, Surroundings, Tally, Want,
};
use psidpd_core::model::Model;

#[derive(Debug)]
pub(super) struct Forces {
    model: Model,
    pub engine: Engine,
    pub tally: Tally,
    /// Evaluations of ψ below and above density bounds, counted by engines of earlier temperatures.
    pub earlier_out_of_bounds: [u64; 2],
    /// Those of this engine that are not counted.
    besides_out_of_bounds: [u64; 2],
    /// See [`has_particle_sums`].
    pub has_particle_sums: bool,
}

impl Forces {
    pub fn new(model: &Model, kt: f64) -> Result<Forces, RunError> {
        let (settings, fluid) =
            (Settings { precision: Precision::Double, ..Settings::default() }, model.at(kt)?);
        Ok(Forces {
            engine: Engine::new(&fluid, settings)?,
            has_particle_sums: has_particle_sums(&fluid),
            model: model.clone(),
            tally: Tally::default(),
            earlier_out_of_bounds: [0; 2],
            besides_out_of_bounds: [0; 2],
        })
    }

    /// Computes pair forces, without body forces: with the noise and drag of `step`, or conservative forces
    /// only. Errors name the step by its `number`.
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
        let request = Request { particles: particles_of(state), v: &state.v, step, want };
        let failed = |source| RunError::Engine { step: number, source };
        self.tally = self.engine.forces(&state.domain, &request, force, false).map_err(failed)?;
        Ok(())
    }

    /// Computes the conservative forces alone. Totals and counts stay those of [`Forces::compute`].
    pub fn compute_besides(
        &mut self,
        state: &State,
        number: u64,
        force: &mut [[f64; 3]],
    ) -> Result<(), RunError> {
        let counted = self.engine.statistics().out_of_bounds;
        let request = Request { particles: particles_of(state), v: &state.v, step: None, want: Want::FORCES };
        let failed = |source| RunError::Engine { step: number, source };
        self.engine.forces(&state.domain, &request, force, false).map_err(failed)?;
        let now = self.engine.statistics().out_of_bounds;
        (0..2).for_each(|k| self.besides_out_of_bounds[k] += now[k] - counted[k]);
        Ok(())
    }

    /// Refuses boxes so narrow that a particle has two images of one neighbour within the range of the noise.
    pub fn check_width(&self, domain: &PeriodicBox) -> Result<(), RunError> {
        let Some(range) = self.engine.plan().noise_range() else { return Ok(()) };
        let periodic = domain.periodic();
        let heights = (0..self.engine.plan().dimensions()).filter(|k| periodic[*k]).map(|k| domain.height(k));
        let height = heights.fold(f64::INFINITY, f64::min);
        // Heights are computed from an inverse matrix; the limit leaves room for its rounding.
        if height < 2.0 * range * (1.0 - 1e-12) {
            Err(RunError::BoxTooNarrow { height, range })
        } else {
            Ok(())
        }
    }

    /// Adds the virial of thermostat impulses that are not part of the forces.
    pub fn add_thermostat_virial(&mut self, virial: [f64; 6]) {
        (0..6).for_each(|c| self.tally.thermostat_virial[c] += virial[c]);
    }

    /// Takes another temperature, or other settings.
    pub fn renew(&mut self, kt: f64, settings: Settings) -> Result<(), RunError> {
        let out_of_bounds = self.out_of_bounds();
        let fluid = self.model.at(kt)?;
        self.engine.renew(&fluid, settings)?;
        self.has_particle_sums = has_particle_sums(&fluid);
        (self.earlier_out_of_bounds, self.besides_out_of_bounds) = (out_of_bounds, [0; 2]);
        Ok(())
    }

    pub fn out_of_bounds(&self) -> [u64; 2] {
        let now = self.engine.statistics().out_of_bounds;
        std::array::from_fn(|k| self.earlier_out_of_bounds[k] + now[k] - self.besides_out_of_bounds[k])
    }
}

fn particles_of(state: &State) -> engine::Particles<'_> {
    engine::Particles { owned: state.len(), x: &state.x, tag: &state.tag, kind: &state.species }
}

impl Simulation {
    /// Sets the settings of later evaluations; the default is double precision on one thread.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), RunError> {
        self.forces.renew(self.kt(), settings)?;
        self.thermostat.follow(&self.forces);
        self.conservative = Conservative::default();
        Ok(())
    }

    pub fn settings(&self) -> Settings {
        self.forces.engine.settings()
    }

    pub fn engine(&self) -> &Engine {
        &self.forces.engine
    }

    /// Describes for people how steps that need forces only are evaluated.
    pub fn evaluation(&self) -> String {
        if let Some(name) = self.device_name() {
            return format!("{name}, in single precision, with positions exact to 2^-32 of the box");
        }
        let path = self.engine().path_for(Surroundings::Box(&self.particles.now().domain), Want::FORCES);
        path.describe(self.settings())
    }

    pub fn model(&self) -> &Model {
        &self.forces.model
    }

    pub fn kt(&self) -> f64 {
        self.engine().plan().kt()
    }

    pub fn dimensions(&self) -> usize {
        self.forces.engine.plan().dimensions()
    }

    /// Number of evaluations of ψ at a density below and above its bounds.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        #[cfg(feature = "gpu")]
        if let Some(counts) = self.out_of_bounds_on_gpu() {
            return counts;
        }
        self.forces.out_of_bounds()
    }

    /// Sets whether the pair sums do every evaluation; they are slower and use double precision.
    pub fn use_pair_sums_only(&mut self, only: bool) {
        self.forces.engine.use_pair_sums_only(only);
    }

    /// Energies and virials of the last evaluation, as far as it computed them.
    pub fn tally(&self) -> &Tally {
        &self.forces.tally
    }
}
