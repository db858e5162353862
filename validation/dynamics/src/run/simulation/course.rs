//! The steps of a run one after the other, and the present one as a whole where it is read.

use super::record::NeededDrag;
use super::{RunError, Simulation};
use crate::integrator::Integrator;
use crate::run::Thermo;
use psidpd_core::engine::Want;
use psidpd_core::engine::thermostat::Effort;
use psidpd_observe::flux::Recorded;
use std::time::Duration;

/// A simulation on its way.
///
/// Between two steps it is not whole: the last kick of a step is made with the first one of the next, a GPU collects steps and keeps
/// the particles, and some integrators compute no forces where a step ends. So nobody reads a simulation on its way: [`Course::ended`],
/// [`Course::whole`] and [`Course::totals`] complete the step, and what they give is right. Trajectories do not depend on who reads.
#[derive(Debug)]
pub struct Course {
    simulation: Simulation,
    /// What the present step was asked for.
    want: Want,
}

/// What a step does beside moving particles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Task {
    /// What is computed with the last forces, and of the thermostat.
    pub want: Want,
    /// What is recorded of the transport of momentum.
    pub flux: Recorded,
    /// What steps need of the drag before the thermostat acts again.
    pub drag_needed_later: NeededDrag,
    /// Whether this step or these ask for the virial of the thermostat.
    pub impulses: bool,
    /// Whether Monte Carlo tunes the length of its moves.
    pub settles: bool,
}

impl Course {
    pub fn of(simulation: Simulation) -> Course {
        Course { simulation, want: Want::FORCES }
    }

    /// Makes one step of `dt`.
    pub fn make(&mut self, dt: f64, integrator: Integrator, task: Task) -> Result<(), RunError> {
        let Task { want, flux, drag_needed_later, impulses, settles } = task;
        self.want = want;
        self.simulation.ask_for_impulses(Some(impulses));
        self.simulation.record_and_hold_flux(flux, drag_needed_later);
        self.simulation.set_settling(settles);
        self.simulation.begin_step(dt, integrator, want)
    }

    /// The simulation at the end of the present step: its particles, and what can be computed from them. Forces and totals may be
    /// those of other positions.
    pub fn ended(&mut self) -> Result<&mut Simulation, RunError> {
        self.simulation.end_step()?;
        self.simulation.fetch()?;
        Ok(&mut self.simulation)
    }

    /// The simulation at the end of the present step, with its forces and the totals that the step was asked for.
    pub fn whole(&mut self) -> Result<&mut Simulation, RunError> {
        self.simulation.end_step()?;
        self.simulation.refresh(self.want)?;
        self.ended()
    }

    /// The simulation as [`Course::ended`] or [`Course::whole`] has left it; nobody may have made a step since.
    pub(in crate::run) fn completed(&self) -> &Simulation {
        debug_assert!(self.simulation.motion.deferred.is_none() && self.is_here());
        &self.simulation
    }

    /// The totals of the present step, which was asked for [`Want::TOTALS`]; a GPU keeps its particles.
    pub fn totals(&mut self, time: f64) -> Result<Thermo, RunError> {
        self.simulation.end_step()?;
        self.simulation.refresh(self.want)?;
        Ok(Thermo::of(&self.simulation, time))
    }

    /// Whether the arrays of the host are those of the present step, so that [`Course::ended`] costs nothing.
    pub fn is_here(&self) -> bool {
        self.simulation.is_here()
    }

    pub fn number(&self) -> u64 {
        self.simulation.step_number()
    }

    pub fn particles(&self) -> usize {
        self.simulation.len()
    }

    /// Number of evaluations of ψ at a density below and above its bounds.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        self.simulation.out_of_bounds()
    }

    /// Iterations of the thermostat since the start of this session.
    pub fn effort(&self) -> Effort {
        self.simulation.effort()
    }

    /// The time in which one thread did the work of all.
    pub fn time_of_one_thread(&self) -> Duration {
        self.simulation.time_of_one_thread()
    }

    /// The GPU in words; `None` for the CPU.
    pub fn device_name(&self) -> Option<String> {
        self.simulation.device_name()
    }

    pub fn has_body_forces(&self) -> bool {
        self.simulation.has_body_forces()
    }
}
