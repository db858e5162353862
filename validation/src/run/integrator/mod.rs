//! Integrators. Each advances positions and velocities by one step around one evaluation of the
//! forces, and says at which velocities that evaluation sees the particles: the dissipative force
//! depends on it.

mod groot_warren;
mod velocity_verlet;

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Integrator {
    /// Velocity Verlet, as `fix nve` of LAMMPS.
    ///
    /// `v += ½Δt f/m; x += Δt v; f = F(x, v); v += ½Δt f/m`. The dissipative force sees the half-step
    /// velocity.
    #[default]
    VelocityVerlet,
    /// The modified velocity Verlet of Groot and Warren (J. Chem. Phys. 107, 4423 (1997)).
    ///
    /// `x += Δt v + ½Δt² f/m; ṽ = v + λΔt f/m; f′ = F(x, ṽ); v += ½Δt (f + f′)/m`. The dissipative
    /// force sees the predicted velocity `ṽ`; λ = ½ is velocity Verlet.
    GrootWarren {
        /// λ.
        lambda: f64,
    },
}

/// The particles that an integrator moves, without ghosts.
pub(super) struct Motion<'a> {
    pub x: &'a mut [[f64; 3]],
    pub v: &'a mut [[f64; 3]],
    pub f: &'a [[f64; 3]],
    pub species: &'a [i32],
    pub mass: &'a [f64],
    /// Velocities and forces of the step before, for integrators that need them again.
    pub before: &'a mut Before,
}

/// What an integrator keeps over the evaluation of the forces.
#[derive(Debug, Clone, Default)]
pub(super) struct Before {
    pub v: Vec<[f64; 3]>,
    pub f: Vec<[f64; 3]>,
}

impl Before {
    /// Turns round the component `k` of what is kept of particle `i`, which a wall has reflected.
    pub fn turn(&mut self, i: usize, k: usize) {
        for kept in [&mut self.v, &mut self.f] {
            if let Some(vector) = kept.get_mut(i) {
                vector[k] = -vector[k];
            }
        }
    }
}

impl Integrator {
    /// From the end of one step to the point where the next needs its forces.
    pub(super) fn before_forces(self, motion: Motion, dt: f64) {
        match self {
            Integrator::VelocityVerlet => velocity_verlet::before_forces(motion, dt),
            Integrator::GrootWarren { lambda } => groot_warren::before_forces(motion, dt, lambda),
        }
    }

    /// From there to the end of the step.
    pub(super) fn after_forces(self, motion: Motion, dt: f64) {
        match self {
            Integrator::VelocityVerlet => velocity_verlet::after_forces(motion, dt),
            Integrator::GrootWarren { .. } => groot_warren::after_forces(motion, dt),
        }
    }
}
