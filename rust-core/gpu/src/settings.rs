//! What a host passes to a simulation, and what it gets back.

use psidpd_core::engine::{PeriodicBox, Tally};

/// Box, masses and forces from outside.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The box. Directions that are not periodic have reflecting walls, except the third of a two-dimensional model.
    pub domain: PeriodicBox,
    /// Mass of each species.
    pub mass: Vec<f64>,
    /// Seed of the pair noise.
    pub seed: u64,
    /// Whether drag and noise act.
    pub thermostat: bool,
    /// Accelerations of the particles with the mark [`body_force_mark`] of their index.
    pub body_forces: Vec<BodyForce>,
}

/// A constant acceleration of marked particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyForce {
    /// The acceleration; the force is the mass times the acceleration.
    pub acceleration: [f64; 3],
    /// Direction along which the upper half of the box has the opposite acceleration.
    pub reversed_along: Option<usize>,
}

/// The mark of a frozen particle: it has no velocity, and acts on the others.
pub const FROZEN: u32 = 1;

/// Most body forces of a simulation.
pub const MOST_BODY_FORCES: usize = 15;

/// The mark of particles that the body force `index` acts on.
pub fn body_force_mark(index: usize) -> u32 {
    2 << index
}

/// Particles in any order; all lists have one length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Positions. They are rounded to 2⁻³² of the box (2⁻³¹ between walls).
    pub x: Vec<[f64; 3]>,
    /// Velocities, rounded to single precision.
    pub v: Vec<[f64; 3]>,
    /// Forces with which the next step begins, rounded to single precision. Empty before
    /// [`GpuSimulation::prepare`](crate::GpuSimulation::prepare).
    pub force: Vec<[f64; 3]>,
    /// Species indices from 0.
    pub species: Vec<i32>,
    /// Unique positive numbers that stay with the particles.
    pub tag: Vec<i32>,
    /// Number of box edges that a particle has travelled in each direction.
    pub image: Vec<[i32; 3]>,
    /// Sums of [`FROZEN`] and of [`body_force_mark`].
    pub marks: Vec<u32>,
}

/// The rule of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Velocity Verlet with drag and uniform noise in the forces.
    VelocityVerlet,
    /// Two stages of conservative forces, `v += λΔt F/m; x += ½Δt v; v += (1 − 2λ)Δt F/m; x += ½Δt v; v += λΔt F/m`, then
    /// the implicit midpoint thermostat with Gaussian noise, after every `every`-th step for a time `every · Δt`.
    TwoStage {
        /// The parameter λ.
        lambda: f64,
        /// The parameter ξ of the force-gradient step: the middle kick has the forces at `x + ξ Δt² F/m`. 0 without.
        gradient: f64,
        /// Steps from one action of the thermostat to the next.
        every: u64,
    },
}

/// Sums over particles and pairs at the end of a step. Tensors have the order xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Energies and virials; that of the thermostat is of its impulses over Δt where it is not part of the forces.
    pub tally: Tally,
    /// `Σ m v v`.
    pub momentum_flux: [f64; 6],
    /// `Σ m v`.
    pub momentum: [f64; 3],
    /// The sum of all forces on frozen particles.
    pub support_force: [f64; 3],
}
