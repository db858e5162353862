//! Integrators. Each advances positions and velocities by one step around one evaluation of the
//! forces, and says at which velocities that evaluation sees the particles: the dissipative force
//! depends on it.

mod groot_warren;
mod parts;
mod velocity_verlet;

pub(super) use parts::{Faults, Surroundings};

use psidpd_core::engine::Pool;

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
    pub image: &'a mut [[i32; 3]],
    pub mass: &'a [f64],
    pub before: &'a mut Before,
}

/// What an integrator keeps over the evaluation of the forces.
#[derive(Debug, Clone, Default)]
pub(super) struct Before {
    /// Velocities and forces of the step before, for integrators that need them again.
    v: Vec<[f64; 3]>,
    f: Vec<[f64; 3]>,
    /// Whether the integrator of the present step does.
    in_use: bool,
    /// A number by species.
    over_mass: Vec<f64>,
}

impl Motion<'_> {
    /// Makes room for velocities and forces of before.
    fn keep(&mut self) {
        self.before.in_use = true;
        self.before.v.resize(self.x.len(), [0.0; 3]);
        self.before.f.resize(self.x.len(), [0.0; 3]);
    }

    fn keep_nothing(&mut self) {
        self.before.in_use = false;
    }

    /// Computes a number of the mass of each species: a division for each, not for each particle.
    fn over_mass(&mut self, number: impl Fn(f64) -> f64) {
        self.before.over_mass.clear();
        self.before.over_mass.extend(self.mass.iter().map(|mass| number(*mass)));
    }
}

impl Integrator {
    /// Whether [`Integrator::after_forces`] can be left to the next step, which then does the same in the loop it
    /// makes anyway.
    pub(super) fn may_owe(self) -> bool {
        matches!(self, Integrator::VelocityVerlet)
    }

    /// From the end of one step to the point where the next needs its forces, with every particle in the box. With
    /// `owed` [`Integrator::after_forces`] of the step before, of the same `dt`, is still to be done.
    pub(super) fn before_forces(
        self,
        motion: Motion,
        dt: f64,
        owed: bool,
        around: Surroundings,
        pool: &Pool,
    ) -> Faults {
        debug_assert!(!owed || self.may_owe());
        match self {
            Integrator::VelocityVerlet => velocity_verlet::before_forces(motion, dt, owed, around, pool),
            Integrator::GrootWarren { lambda } => {
                groot_warren::before_forces(motion, dt, lambda, around, pool)
            }
        }
    }

    /// From there to the end of the step.
    pub(super) fn after_forces(self, motion: Motion, dt: f64, pool: &Pool) -> Faults {
        match self {
            Integrator::VelocityVerlet => velocity_verlet::after_forces(motion, dt, pool),
            Integrator::GrootWarren { .. } => groot_warren::after_forces(motion, dt, pool),
        }
    }
}
