//! What carried momentum in a step, as the integrator made it.
//!
//! A particle carries `m u` along its way, with the velocity `u` that moved it, and a pair the momentum that its force
//! transfers, along the line between its particles. In a steady state these two add up to the same normal pressure
//! everywhere, at any time step. Velocities at the ends of steps do not: in velocity Verlet they lack a kick by half of
//! the forces, drag and noise included, so that `⟨Σ m v²⟩` is too small by `¼ Δt² ⟨Σ f²/m⟩`, a term of first order.
//!
//! The random force, though it transfers momentum, is left out: it does not depend on the positions it acts at, so its mean
//! is 0.

use psidpd_core::engine::reference::COMPONENTS;

/// A straight line that momentum was carried along: to the mean pressure in a volume it adds `strength` `d ⊗ d`, divided by
/// the volume, times its part in the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// One end.
    pub from: [f64; 3],
    /// From the other end to this one.
    pub d: [f64; 3],
    /// Of a pair its force over `d`.
    pub strength: f64,
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
    /// Positions and species, if they are not those at the end of the step.
    pub at: Option<(Vec<[f64; 3]>, Vec<i32>)>,
}

impl Flux {
    /// `Σ strength d ⊗ d` of everything.
    pub fn sum(&self) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for acted in &self.forces {
            (0..6).for_each(|c| sum[c] += acted.share * acted.virial[c]);
        }
        for line in self.ways.iter().chain(&self.drag) {
            for (sum, (a, b)) in sum.iter_mut().zip(COMPONENTS) {
                *sum += line.strength * line.d[a] * line.d[b];
            }
        }
        sum
    }
}
