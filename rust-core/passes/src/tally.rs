use std::ops::AddAssign;

/// The results that a step should compute besides forces. Other results are not computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Want {
    pub energy: bool,
    pub virial: bool,
    /// Energy of each particle: its ψ and half of its pair energies.
    pub particle_energy: bool,
    /// Virial of each particle: half of the virials of its pairs.
    pub particle_virial: bool,
    /// Every density of the model for each particle, also those that no force needs.
    pub densities: bool,
}

impl Want {
    /// Computes forces only.
    pub const FORCES: Want = Want {
        energy: false,
        virial: false,
        particle_energy: false,
        particle_virial: false,
        densities: false,
    };
    /// Computes the total energy and virial.
    pub const TOTALS: Want = Want { energy: true, virial: true, ..Want::FORCES };
    /// Computes all results.
    pub const ALL: Want =
        Want { particle_energy: true, particle_virial: true, densities: true, ..Want::TOTALS };

    /// Whether energies or virials of each particle are asked for.
    pub fn of_particles(self) -> bool {
        self.particle_energy || self.particle_virial
    }
}

/// Sums over the particles and pairs of one host or rank; the sums of all ranks add up.
///
/// Virials are sums of r_ij (x) F_ij: xx, yy, zz, xy, xz, yz, so that `p = rho kT + tr W/(dV)`. Entries that were not asked
/// for are unspecified.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Sum of psi over particles. The potential energy is `excess + pair`.
    pub excess: f64,
    /// Sum of phi over pairs.
    pub pair: f64,
    /// Virial of the conservative forces.
    pub virial: [f64; 6],
    /// Virial of the dissipative and random forces.
    pub thermostat_virial: [f64; 6],
    /// Virial of the dissipative forces alone.
    pub drag_virial: [f64; 6],
}

impl Tally {
    /// The potential energy `U`.
    pub fn energy(&self) -> f64 {
        self.excess + self.pair
    }

    /// The virial of all forces.
    pub fn total_virial(&self) -> [f64; 6] {
        std::array::from_fn(|k| self.virial[k] + self.thermostat_virial[k])
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Tally) {
        self.excess += other.excess;
        self.pair += other.pair;
        for k in 0..6 {
            self.virial[k] += other.virial[k];
            self.thermostat_virial[k] += other.thermostat_virial[k];
            self.drag_virial[k] += other.drag_virial[k];
        }
    }
}
