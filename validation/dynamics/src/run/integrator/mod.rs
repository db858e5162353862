//! The steps of integrators, each a composition of drift, kick, forces and thermostat, which are the operators of a simulation.
//!
//! A file here states one step, or steps that differ in one operator, what is exact in them and at which velocity the
//! temperature is measured.

mod aboba;
mod baoab;
mod coupling;
mod dpd_vv;
mod force_gradient;
mod groot_warren;
mod lowe_andersen;
mod monte_carlo;
pub(super) mod parts;
mod peters;
pub(super) mod reflection;
mod self_consistent;
mod shardlow;
mod two_stage;
mod velocity_verlet;

use super::{Integrator, RunError, Simulation};
use crate::integrator::{Counterpart, Coupling};
use psidpd_core::engine::Want;
use psidpd_core::engine::noise::Law;
use reflection::Path;

impl Integrator {
    /// The thermostat whose virial is part of the pressure before the first step, as `fix dpd/splitting` in LAMMPS has it at setup.
    pub(in crate::run) fn at_setup(self, system: &Simulation, want: Want) -> Option<Coupling> {
        let has_setup = matches!(self.properties().lammps, Counterpart::Splitting);
        self.coupling().filter(|_| has_setup && want.virial && system.step_number() == 0)
    }

    /// A step of `dt`, whose number is set. Of `want`, what is computed with the last forces.
    pub(super) fn step(self, system: &mut Simulation, dt: f64, want: Want) -> Result<(), RunError> {
        match self {
            Integrator::VelocityVerlet => velocity_verlet::step(system, dt, want),
            Integrator::GrootWarren { lambda } => groot_warren::step(system, dt, want, lambda),
            Integrator::DpdVv { noise } => dpd_vv::step(system, dt, want, noise),
            Integrator::SelfConsistent { noise } => self_consistent::step(system, dt, want, noise),
            Integrator::ShardlowS1 { noise } => shardlow::first(system, dt, want, noise),
            Integrator::ShardlowS2 { noise } => shardlow::second(system, dt, want, noise),
            Integrator::Peters { noise } => peters::step(system, dt, want, noise),
            Integrator::LoweAndersen => lowe_andersen::step(system, dt, want),
            Integrator::Aboba(coupling) => aboba::step(system, dt, want, coupling),
            Integrator::Baoab(coupling) => baoab::step(system, dt, want, coupling),
            Integrator::ForceGradient { lambda, gradient, coupling } => {
                force_gradient::step(system, dt, want, [lambda, gradient], coupling)
            }
            Integrator::TwoStage { lambda, coupling } => two_stage::step(system, dt, want, lambda, coupling),
            Integrator::MonteCarlo { sweeps, max_move } => monte_carlo::step(system, want, sweeps, max_move),
        }
    }
}
