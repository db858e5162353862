//! Particles in a box, moved step by step.
//!
//! Each file has one part of a simulation, and what can be asked of it: the `particles`, what acts on them from
//! outside (`external`), the `forces` between them, the `thermostat` apart from these, and their `motion`. An integrator
//! composes a step of the operators in `motion` and `thermostat`.

mod displaced;
mod external;
mod forces;
mod monte_carlo;
mod motion;
mod particles;
mod record;
mod thermodynamics;
mod thermostat;

pub(super) use thermostat::Heat;

use super::error::RunError;
use super::reorder;
use crate::integrator::Integrator;
use crate::particles::State;
use external::External;
use forces::Forces;
use monte_carlo::MonteCarlo;
use motion::Motion;
use particles::Particles;
use psidpd_core::engine::{Step, Want, check_reach};
use psidpd_core::model::Model;
use record::Record;
use thermostat::Thermostat;

/// Particles in a box, and the forces of one fluid on them.
///
/// Every buffer is kept from step to step.
///
/// Directions of the box that are not periodic have walls that reflect.
///
/// Pair noise is keyed by the number of the step whose forces it is in: the forces before the first
/// step are those of step 0, and step `n` ends with forces of number `n`, as in LAMMPS.
#[derive(Debug, Clone)]
pub struct Simulation {
    particles: Particles,
    external: External,
    forces: Forces,
    thermostat: Thermostat,
    motion: Motion,
    monte_carlo: MonteCarlo,
    seed: u64,
    number: u64,
    /// Whether the forces are those of other positions than the present ones.
    stale: bool,
    /// What carries momentum in the present step, if somebody wants to know.
    record: Option<Box<Record>>,
}

impl Simulation {
    /// A simulation of `model` at temperature `kt` from `state`, at step 0. Positions outside the box
    /// are wrapped into it.
    ///
    /// # Errors
    /// The model does not hold at `kt`, or `state` is no state of it.
    pub fn new(model: &Model, kt: f64, state: State, seed: u64) -> Result<Simulation, RunError> {
        let fluid = model.at(kt)?;
        let particles = Particles::new(state, fluid.species.len(), fluid.dimensions)?;
        let domain = &particles.now().domain;
        check_reach(domain, fluid.dimensions, fluid.cutoff(), particles.now().len())?;
        let motion = Motion::within(domain, fluid.dimensions);
        let forces = Forces::new(model, kt)?;
        Ok(Simulation {
            particles,
            external: External::none(),
            thermostat: Thermostat::new(&forces),
            forces,
            motion,
            monte_carlo: MonteCarlo::default(),
            seed,
            number: 0,
            stale: false,
            record: None,
        })
    }

    /// Another temperature for the thermostat and for every formula with kT.
    ///
    /// # Errors
    /// The model does not hold at `kt`.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), RunError> {
        if kt != self.kt() {
            self.forces.set_temperature(kt)?;
            self.thermostat.follow(&self.forces);
            self.monte_carlo.forget_energy();
        }
        Ok(())
    }

    /// The number of the present step.
    pub fn step_number(&self) -> u64 {
        self.number
    }

    /// Sets it, for a run that goes on from step `number`.
    pub fn set_step_number(&mut self, number: u64) {
        self.number = number;
    }

    /// Takes up a run where a checkpoint left it: after step `number`, with the forces of that step, so
    /// that the next step is bit for bit the one that would have followed. Unlike [`Simulation::new`] it
    /// wraps no position: one that rounding left on a face must stay there.
    ///
    /// `state` must be of the particles, the box and the masses that the simulation was made with.
    pub(super) fn restore(
        &mut self,
        number: u64,
        state: &State,
        forces: &[[f64; 3]],
        out_of_bounds: [u64; 2],
    ) {
        self.particles.replace(state, forces);
        self.external.find_frozen(&mut self.particles);
        self.forces.count_out_of_bounds_from(out_of_bounds);
        self.thermostat.forget_forces();
        self.motion.forget_kick();
        self.number = number;
        self.stale = false;
    }

    /// Computes the forces of the present step at the present velocities, thermostat included, as a run or a stage
    /// needs before its first step.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn prepare(&mut self, dt: f64, want: Want) -> Result<(), RunError> {
        self.prepare_for(Integrator::default(), dt, want)
    }

    /// The same for steps of an integrator: without the thermostat, if it acts apart from the forces there.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn prepare_for(&mut self, integrator: Integrator, dt: f64, want: Want) -> Result<(), RunError> {
        self.end_step()?;
        self.thermostat.begin_step();
        self.stale = false;
        if !integrator.has_time() {
            return self.forces_or_infinite(want);
        }
        match integrator.properties().drag_in_forces {
            true => self.forces_with_thermostat(dt, want),
            false => self.conservative_forces(want),
        }
    }

    /// Computes forces between particles, with noise and drag of `step`, or conservative ones only; no body
    /// forces.
    ///
    /// # Errors
    /// The box is too narrow for the noise, or a position, ψ or force is not finite.
    pub fn compute(&mut self, want: Want, step: Option<Step>) -> Result<(), RunError> {
        self.forces.compute(&mut self.particles, want, step, self.number)
    }

    /// One step of `dt`. The forces of the step before must be there: see [`Simulation::prepare_for`].
    ///
    /// # Errors
    /// A position, velocity or force that is not finite, ψ singular, or a particle that moved further
    /// than across the box.
    pub fn step(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        self.begin_step(dt, integrator, want)?;
        self.end_step()?;
        if want == Want::FORCES { Ok(()) } else { self.refresh(want) }
    }

    /// Steps of `dt` that nothing is wanted of.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn advance(&mut self, steps: u64, dt: f64, integrator: Integrator) -> Result<(), RunError> {
        for _ in 0..steps {
            self.begin_step(dt, integrator, Want::FORCES)?;
        }
        self.end_step()
    }

    /// A step but for a kick that may as well be made when the next begins, with the same bits: until then, or until
    /// [`Simulation::end_step`], velocities are not those at the end of the step.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub(super) fn begin_step(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(RunError::TimeStep(dt));
        }
        if !self.thermostat.fits(integrator.properties().drag_in_forces) {
            // Forces of another integrator.
            self.prepare_for(integrator, dt, Want::FORCES)?;
        }
        self.number += 1;
        self.thermostat.begin_step();
        self.monte_carlo.begin_step(!integrator.has_time());
        self.open_record(dt);
        integrator.step(self, dt, want)?;
        self.close_record(integrator);
        self.forces.add_thermostat_virial(self.thermostat.impulse_virial());
        self.stale = !integrator.properties().forces_at_end;
        // The order of trials must not depend on where particles are.
        if reorder::is_due(self.number) && integrator.has_time() {
            self.end_step()?;
            self.reorder();
        }
        Ok(())
    }

    /// Ends the step that [`Simulation::begin_step`] has begun, if it is not at its end.
    ///
    /// # Errors
    /// A velocity that is not finite.
    pub(super) fn end_step(&mut self) -> Result<(), RunError> {
        self.make_deferred_kick()
    }

    /// Computes what is wanted at the end of the present step, where the integrator has computed forces at other positions
    /// only; trajectories do not depend on it.
    ///
    /// # Errors
    /// As [`Simulation::compute`].
    pub(super) fn refresh(&mut self, want: Want) -> Result<(), RunError> {
        if !self.stale {
            return Ok(());
        }
        match self.monte_carlo.is_at_work() {
            true => self.forces_or_infinite(want)?,
            false => self.conservative_forces(want)?,
        }
        self.stale = false;
        self.forces.add_thermostat_virial(self.thermostat.impulse_virial());
        Ok(())
    }

    /// Brings all arrays over particles into the order of the last sweep, if there was one.
    fn reorder(&mut self) {
        let Some(order) = self.forces.order() else { return };
        if self.particles.reorder(self.forces.pool(), order) {
            self.external.find_frozen(&mut self.particles);
        }
    }
}
