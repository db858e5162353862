//! What carried momentum in a step, as the integrator made it.
//!
//! A particle carries `m u` along its way, with the velocity `u` that moved it, and a pair the momentum that its force
//! transfers, along the line between its particles. In a steady state these two add up to the same normal pressure
//! everywhere, at any time step. Velocities at the ends of steps do not: in velocity Verlet they lack a kick by half of
//! the forces, drag and noise included, so that `⟨Σ m v²⟩` is too small by `¼ Δt² ⟨Σ f²/m⟩`, a term of first order.
//!
//! The random force, though it transfers momentum, is left out: it does not depend on the positions it acts at, so its mean
//! is 0.

use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::pair_sums::COMPONENTS;

/// A straight line that momentum was carried along: to the mean pressure in a volume it adds `d ⊗ f`, divided by the volume,
/// times its part in the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// One end.
    pub from: [f64; 3],
    /// From the other end to this one.
    pub d: [f64; 3],
    /// Of a pair the force on the particle at `from`. It is along `d` but in kicks by forces at displaced positions.
    pub f: [f64; 3],
}

/// What a line belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    /// A particle.
    Particle,
    /// A pair.
    Pair,
}

/// What carried momentum in a step.
#[derive(Debug, Clone, Default)]
pub struct Flux {
    /// The ways of the particles.
    pub ways: Vec<Line>,
    /// Drag of the pairs, averaged over the step.
    pub drag: Vec<Line>,
    /// Where conservative forces acted.
    pub forces: Vec<Acted>,
}

/// Conservative forces at positions of a step.
#[derive(Debug, Clone)]
pub struct Acted {
    /// For which part of the step.
    pub share: f64,
    /// Their virial.
    pub virial: [f64; 6],
    /// Where the particles were, if not where they are at the end of the step.
    pub at: Option<Place>,
}

/// Where particles were when forces acted on them.
#[derive(Debug, Clone)]
pub struct Place {
    /// Positions.
    pub x: Vec<[f64; 3]>,
    /// Species.
    pub species: Vec<i32>,
    /// What the forces were computed at, if that was elsewhere.
    pub displaced: Option<Displaced>,
}

/// Displaced positions, of the same particles.
#[derive(Debug, Clone)]
pub struct Displaced {
    /// Positions, which no period is taken from.
    pub x: Vec<[f64; 3]>,
    /// A box that they are in along its directions with walls.
    pub domain: PeriodicBox,
}

impl Flux {
    /// `Σ d ⊗ f` of everything, its symmetric part.
    pub fn sum(&self) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for acted in &self.forces {
            (0..6).for_each(|c| sum[c] += acted.share * acted.virial[c]);
        }
        for line in self.ways.iter().chain(&self.drag) {
            for (sum, (a, b)) in sum.iter_mut().zip(COMPONENTS) {
                *sum += 0.5 * (line.d[a] * line.f[b] + line.d[b] * line.f[a]);
            }
        }
        sum
    }
}
