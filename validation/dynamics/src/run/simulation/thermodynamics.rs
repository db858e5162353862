//! Energies, temperature and pressure of the present step.

use super::Simulation;

impl Simulation {
    /// `U` of the last evaluation that computed energies.
    pub fn potential_energy(&self) -> f64 {
        self.tally().energy()
    }

    pub fn kinetic_energy(&self) -> f64 {
        let k = self.particles.momentum_flux();
        0.5 * (k[0] + k[1] + k[2])
    }

    /// Number of degrees of freedom of the kinetic energy: `d` for each mobile particle, less one for each
    /// direction along which the total momentum is conserved.
    pub fn degrees_of_freedom(&self) -> usize {
        let conserved = self.conserved()[..self.dimensions()].iter().filter(|c| **c).count();
        (self.dimensions() * self.mobile()).saturating_sub(conserved)
    }

    /// `kT` from the kinetic energy of the mobile particles, as in LAMMPS's `compute temp`; 0 without degrees
    /// of freedom. A flow counts as heat.
    pub fn temperature(&self) -> f64 {
        match self.degrees_of_freedom() {
            0 => 0.0,
            freedom => 2.0 * self.kinetic_energy() / freedom as f64,
        }
    }

    fn over_volume(&self, virial: [f64; 6]) -> [f64; 6] {
        let volume = self.particles.now().domain.volume(self.dimensions());
        let flux = self.particles.momentum_flux();
        std::array::from_fn(|k| (flux[k] + virial[k]) / volume)
    }

    /// `(Σ m v v + W)/V` with the virial of all forces, thermostat included, as in LAMMPS's `compute
    /// pressure`; order xx, yy, zz, xy, xz, yz. The last evaluation must have computed a virial.
    pub fn pressure_tensor(&self) -> [f64; 6] {
        self.over_volume(self.tally().total_virial())
    }

    /// As [`Simulation::pressure_tensor`], with the virial of conservative forces alone, which has less noise.
    ///
    /// The two means differ by a term of order Δt: the drag of velocity Verlet uses the velocity that brought
    /// particles to their positions, which is correlated with their distance.
    pub fn conservative_pressure_tensor(&self) -> [f64; 6] {
        self.over_volume(self.tally().virial)
    }

    pub fn scalar_pressure(&self, tensor: [f64; 6]) -> f64 {
        tensor[..self.dimensions()].iter().sum::<f64>() / self.dimensions() as f64
    }
}
