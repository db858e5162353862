//! The input of an evaluation, and its results.

use super::particles::Particles;
use super::step::Step;
use psidpd_passes::tally::Want;

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

/// Values of single particles in the last evaluation, and their order.
#[derive(Debug, Clone, Copy, Default)]
pub struct Results<'a> {
    /// Uncorrected local densities of owned particles, one for each density and species, density-major. If the request
    /// did not include densities and they were not summed afterwards, the slice is empty after a sweep, and has zeros for
    /// densities that no force needs after an evaluation by sums over pairs.
    pub densities: &'a [f64],
    /// Energy of each particle and ghost, its ψ and half of its pair energies, if it was asked for.
    pub particle_energy: &'a [f64],
    /// Virial of each particle and ghost, half of the virials of its pairs, if it was asked for.
    pub particle_virial: &'a [[f64; 6]],
    /// The host's numbers of its particles in the order of cells; a host that keeps its particles in this order makes
    /// sorting cheap. `None` if the evaluation was no sweep.
    pub order: Option<&'a [u32]>,
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
