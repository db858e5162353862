//! Particles in a box, moved in steps.
//!
//! Each file has one part of a simulation with its methods: the `particles`, the `external` forces on them,
//! the `forces` between them, the `thermostat` where it is not part of these forces, and the `motion`. An
//! integrator composes a step of the operators in `motion` and `thermostat`.

mod cells;
mod conservative;
mod course;
mod device;
mod displaced;
mod external;
mod forces;
#[cfg(feature = "gpu")]
mod gpu;
mod monte_carlo;
mod motion;
mod particles;
mod record;
mod thermodynamics;
mod thermostat;
mod walls;

pub(super) use course::{Course, Task};
pub(super) use record::NeededDrag;
pub(super) use thermostat::Heat;

use super::{Integrator, RunError, State, reorder};
use crate::checkpoint::Held;
use conservative::Conservative;
use external::External;
use forces::Forces;
use monte_carlo::MonteCarlo;
use motion::Motion;
use particles::Particles;
use psidpd_core::engine::{Step, Want, check_reach};
use psidpd_core::model::Model;
use psidpd_observe::flux::Recorded;
use record::{Record, Spare};
use thermostat::Thermostat;

/// Particles in a box, with the forces of one fluid.
///
/// All buffers are reused from step to step.
///
/// Directions that are not periodic have reflecting walls.
///
/// Pair noise is keyed by the number of the step whose forces contain it: the forces before the first step
/// have number 0, and step `n` ends with forces of number `n`, as in LAMMPS.
#[derive(Debug)]
pub struct Simulation {
    particles: Particles,
    external: External,
    forces: Forces,
    conservative: Conservative,
    thermostat: Thermostat,
    motion: Motion,
    monte_carlo: MonteCarlo,
    seed: u64,
    pub(crate) number: u64,
    forces_at: Place,
    /// The transport of momentum in the present step; `None` without recording.
    record: Option<Box<Record>>,
    spare: Spare,
    /// The GPU that makes the steps; `None` for the CPU.
    #[cfg(feature = "gpu")]
    gpu: Option<Box<gpu::Gpu>>,
}

/// Where the present forces belong in the step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// At the positions where it ends.
    End,
    /// At positions on its way.
    Within,
    /// Nowhere: trial moves need no forces.
    Nowhere,
}

impl Simulation {
    /// Creates a simulation of `model` at temperature `kt` from `state`, at step 0. Positions outside the box are wrapped.
    pub fn new(model: &Model, kt: f64, state: State, seed: u64) -> Result<Simulation, RunError> {
        let fluid = model.at(kt)?;
        let particles = Particles::new(state, fluid.species.len(), fluid.dimensions)?;
        let domain = &particles.now().domain;
        check_reach(domain, fluid.dimensions, fluid.cutoff(), particles.now().len())?;
        let motion = Motion::within(domain, &fluid);
        if let Some(k) = particles.now().x.iter().position(|x| motion.bounds.rounds.is_in_matter(x)) {
            let fault = format!("particle {} starts in the matter of a wall", particles.now().tag[k]);
            return Err(RunError::State(fault));
        }
        let forces = Forces::new(model, kt)?;
        Ok(Simulation {
            particles,
            external: External::none(),
            thermostat: Thermostat::new(&forces),
            forces,
            conservative: Conservative::default(),
            motion,
            monte_carlo: MonteCarlo::default(),
            seed,
            number: 0,
            forces_at: Place::End,
            record: None,
            spare: Spare::default(),
            #[cfg(feature = "gpu")]
            gpu: None,
        })
    }

    /// Sets the temperature of the thermostat and of every formula with kT.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), RunError> {
        if kt != self.kt() {
            self.forces.renew(kt, self.settings())?;
            self.thermostat.follow(&self.forces);
            self.monte_carlo.energy = None;
            self.conservative = Conservative::default();
        }
        Ok(())
    }

    pub fn step_number(&self) -> u64 {
        self.number
    }

    /// Restores a run from a checkpoint after step `number`, with the forces of that step: the next step is
    /// bit for bit the one of a run without interruption. Unlike [`Simulation::new`] it wraps no position,
    /// because one that rounding left on a face must stay there.
    ///
    /// `state` must have the particles, the box and the masses of this simulation.
    pub(super) fn restore(
        &mut self,
        number: u64,
        state: &State,
        forces: &[[f64; 3]],
        out_of_bounds: [u64; 2],
    ) {
        self.particles.replace_with(|present| present.copy_particles(state), forces);
        self.external.find_frozen(&mut self.particles);
        self.forces.earlier_out_of_bounds = out_of_bounds;
        self.thermostat.in_forces = None;
        (self.motion.deferred, self.motion.held) = (None, None);
        self.number = number;
        self.forces_at = Place::End;
        #[cfg(feature = "gpu")]
        self.forget_gpu(out_of_bounds);
    }

    /// Computes the forces of the present step at the present velocities, thermostat included. A run or a
    /// stage needs them before its first step.
    pub fn prepare(&mut self, dt: f64, want: Want) -> Result<(), RunError> {
        self.prepare_for(Integrator::default(), dt, want)
    }

    /// As [`Simulation::prepare`], for steps of `integrator`: without the thermostat, if that is not part of its forces.
    pub fn prepare_for(&mut self, integrator: Integrator, dt: f64, want: Want) -> Result<(), RunError> {
        self.compute_first(integrator, dt, want)?;
        self.fetch()
    }

    /// Computes the forces of the present step, which steps of `integrator` begin with.
    fn compute_first(&mut self, integrator: Integrator, dt: f64, want: Want) -> Result<(), RunError> {
        self.end_step()?;
        self.forget_impulses();
        self.forces_at = Place::End;
        self.motion.held = None;
        #[cfg(feature = "gpu")]
        if self.gpu.is_some() {
            return self.prepare_on_gpu(integrator, dt, want);
        }
        if !integrator.has_time() {
            return self.forces_or_infinite(want);
        }
        let coupling = integrator.at_setup(self, want);
        if let Some(coupling) = coupling {
            coupling.announce(self, dt);
        }
        match integrator.properties().drag_in_forces {
            true => self.forces_with_thermostat(dt, want),
            false => self.conservative_forces(want),
        }?;
        coupling.map_or(Ok(()), |coupling| coupling.rehearse(self, dt))
    }

    /// Computes pair forces, without body forces: with the noise and drag of `step`, or conservative forces only.
    pub fn compute(&mut self, want: Want, step: Option<Step>) -> Result<(), RunError> {
        self.forces.compute(&mut self.particles, want, step, self.number)
    }

    /// Makes one step of `dt`. The forces of the previous step must be present: see [`Simulation::prepare_for`]. After it
    /// all that can be read is that of the end of the step; of the totals, what it `want`s.
    pub fn step(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        self.begin_step(dt, integrator, want)?;
        self.end_step()?;
        self.refresh(want)?;
        self.fetch()
    }

    /// Makes so many steps, as [`Simulation::step`] without totals.
    pub fn advance(&mut self, steps: u64, dt: f64, integrator: Integrator) -> Result<(), RunError> {
        for _ in 0..steps {
            self.begin_step(dt, integrator, Want::FORCES)?;
        }
        self.end_step()?;
        self.refresh(Want::FORCES)?;
        self.fetch()
    }

    /// Makes `steps` steps, or one if that is 0, the last with totals and `flux`. What the thermostat does in steps up to its next
    /// action belongs to these: its last action before a sample is recorded too.
    pub fn advance_to_sample(
        &mut self,
        steps: u64,
        dt: f64,
        integrator: Integrator,
        flux: Recorded,
    ) -> Result<(), RunError> {
        let recorded = integrator.thermostat_every().min(steps);
        self.record_flux(Recorded::Nothing);
        self.ask_for_impulses(Some(false));
        self.advance(steps - recorded, dt, integrator)?;
        self.record_flux(flux);
        self.ask_for_impulses(Some(true));
        self.advance(recorded.saturating_sub(1), dt, integrator)?;
        self.step(dt, integrator, Want::TOTALS)
    }

    /// Makes a step except for its last kick, which the next step can include with the same bits. Until then,
    /// or until [`Simulation::end_step`], velocities are not those at the end of the step: see [`Course`].
    fn begin_step(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(RunError::TimeStep(dt));
        }
        if !self.thermostat.fits(integrator.properties().drag_in_forces) {
            // The present forces belong to another integrator.
            self.compute_first(integrator, dt, Want::FORCES)?;
        }
        #[cfg(feature = "gpu")]
        if self.gpu.is_some() {
            return self.step_on_gpu(dt, integrator, want);
        }
        if let Some(held) = self.motion.held.take() {
            self.particles.replace_forces(&held);
        }
        self.number += 1;
        if self.number.is_multiple_of(integrator.thermostat_every()) {
            self.forget_impulses();
        }
        self.open_record(dt);
        integrator.step(self, dt, want)?;
        if integrator.has_time() {
            self.rub(dt, want)?;
        }
        self.close_record(integrator);
        self.add_impulse_virials();
        self.forces_at = match (integrator.has_time(), integrator.properties().forces_at_end) {
            (_, true) => Place::End,
            (true, false) => Place::Within,
            (false, false) => Place::Nowhere,
        };
        // The order of trials must not depend on positions.
        if reorder::is_due(self.number) && integrator.has_time() {
            self.end_step()?;
            self.reorder();
        }
        Ok(())
    }

    fn forget_impulses(&mut self) {
        self.thermostat.impulse_virial = [0.0; 6];
        self.spare.keep_drag(std::mem::take(&mut self.thermostat.held_drag));
    }

    /// The virial and the drag that the thermostat holds until it acts again, for a checkpoint.
    pub(super) fn held(&self) -> Held {
        Held { virial: self.thermostat.impulse_virial, drag: self.thermostat.held_drag.clone() }
    }

    pub(super) fn hold(&mut self, held: &Held) {
        self.thermostat.impulse_virial = held.virial;
        self.thermostat.held_drag.clone_from(&held.drag);
    }

    /// Completes the step that [`Simulation::begin_step`] began, if its last kick is missing. On a GPU it returns the errors of
    /// steps before too.
    fn end_step(&mut self) -> Result<(), RunError> {
        #[cfg(feature = "gpu")]
        self.make_collected(false)?;
        self.make_deferred_kick()
    }

    /// Computes `want` at the end of the present step, if the integrator has computed forces at other
    /// positions only; trajectories do not depend on it.
    fn refresh(&mut self, want: Want) -> Result<(), RunError> {
        match self.forces_at {
            Place::End => return Ok(()),
            Place::Nowhere => self.forces_or_infinite(want)?,
            Place::Within => {
                // Particles that meet a face in the next step do so under the forces of this one.
                let held = self.motion.bounds.has_walls().then(|| self.particles.forces().to_vec());
                self.conservative_forces(want)?;
                self.motion.held = held;
            }
        }
        self.forces_at = Place::End;
        self.add_impulse_virials();
        Ok(())
    }

    /// Adds the virials of thermostats that are not part of the forces.
    fn add_impulse_virials(&mut self) {
        self.forces.add_thermostat_virial(self.thermostat.impulse_virial);
        self.forces.add_thermostat_virial(self.motion.wall_virial);
    }

    /// The time in which one thread did the work of all.
    pub fn time_of_one_thread(&self) -> std::time::Duration {
        self.forces.engine.pool().time_alone()
    }

    /// The forces with which the next step begins.
    pub(super) fn held_forces(&self) -> &[[f64; 3]] {
        self.motion.held.as_deref().unwrap_or(self.forces())
    }

    /// Sorts all particle arrays into the order of the last sweep, if there was one.
    fn reorder(&mut self) {
        let Simulation { particles, motion, external, forces, .. } = self;
        let Some(order) = forces.engine.results().order else { return };
        // What a step has kept is needed no more at its end.
        if particles.reorder(forces.engine.pool(), order, &mut motion.kept.v) {
            external.find_frozen(particles);
        }
    }
}
