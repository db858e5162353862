//! The momentum transport in a step, as the integrator made it.
//!
//! A particle carries `m u` along its path, with the velocity `u` that moved it. A pair carries the momentum that its force
//! transfers, along the line between its particles. In a steady state the sum of both gives the same normal pressure
//! everywhere, at any time step. The velocities at the ends of steps do not: in velocity Verlet they lack a kick by half of
//! the forces, drag and noise included, so that `⟨Σ m v²⟩` is too small by `¼ Δt² ⟨Σ f²/m⟩`, a term of first order.
//!
//! The random force transfers momentum too, but is left out: it does not depend on the positions, so its mean contribution
//! is 0.

use psidpd_core::engine::pair_sums::COMPONENTS;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A straight line of momentum transport. It adds `d ⊗ f` times its fraction in a volume, divided by that volume, to the
/// mean pressure in the volume.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// The first end of the line.
    pub from: [f64; 3],
    /// The vector from the other end to `from`.
    pub d: [f64; 3],
    /// For a pair, the force on the particle at `from`. It is parallel to `d` except in kicks by forces at displaced positions.
    pub f: [f64; 3],
}

/// The number of lines in a block.
pub const BLOCK: usize = 256;

/// Lines of one carrier as parallel arrays, of which the first `count` entries are lines.
#[derive(Debug, Clone)]
pub struct Lines {
    pub carrier: Carrier,
    /// True if every `f` is parallel to `d`.
    pub parallel: bool,
    pub count: usize,
    /// The three arrays have the components of [`Line::from`]; so have `d` and `f`.
    pub from: [[f64; BLOCK]; 3],
    pub d: [[f64; BLOCK]; 3],
    pub f: [[f64; BLOCK]; 3],
}

impl Lines {
    /// No lines.
    pub fn of(carrier: Carrier, parallel: bool) -> Lines {
        let none = [[0.0; BLOCK]; 3];
        Lines { carrier, parallel, count: 0, from: none, d: none, f: none }
    }

    /// Passes lines on in blocks.
    pub fn in_blocks(
        carrier: Carrier,
        parallel: bool,
        all: impl Iterator<Item = Line>,
        mut visit: impl FnMut(&Lines),
    ) {
        let mut lines = Lines::of(carrier, parallel);
        for Line { from, d, f } in all {
            let at = lines.count;
            for c in 0..3 {
                (lines.from[c][at], lines.d[c][at], lines.f[c][at]) = (from[c], d[c], f[c]);
            }
            lines.count += 1;
            if lines.count == BLOCK {
                visit(&lines);
                lines.count = 0;
            }
        }
        if lines.count > 0 {
            visit(&lines);
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    Particle,
    Pair,
}

/// What a step records of the transport of momentum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Recorded {
    #[default]
    Nothing,
    /// The sum over all lines.
    Sum,
    /// The lines.
    Lines,
}

/// The components of the force on a wall of matter, and what presses on it across its surface, added up over the surface.
pub type OnWall = [f64; 4];

#[derive(Debug, Clone, Default)]
pub struct Flux {
    /// The paths of the particles.
    pub ways: Vec<Line>,
    /// The drag of the pairs, averaged over the step, of each action of a thermostat.
    pub drag: Vec<Arc<Drag>>,
    /// The positions at which conservative forces acted.
    pub forces: Vec<Acted>,
    /// What friction and reflection give to each wall of matter.
    pub on_walls: Vec<OnWall>,
}

/// The drag of the pairs in one action of a thermostat, averaged over the step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Drag {
    /// `Σ d ⊗ f` in the order xx, yy, zz, xy, xz, yz.
    pub sum: [f64; 6],
    /// The lines, in parts that do not depend on the number of threads; none if only the sum is recorded.
    pub lines: Vec<Vec<Line>>,
}

/// Conservative forces at positions of a step.
#[derive(Debug, Clone)]
pub struct Acted {
    /// The fraction of the step for which these forces acted.
    pub share: f64,
    pub virial: [f64; 6],
    /// The forces on walls of matter.
    pub on_walls: Vec<OnWall>,
    /// The positions of the particles, if they differ from those at the end of the step and lines are recorded.
    pub at: Option<Place>,
}

/// The positions of the particles at the time when forces acted on them.
#[derive(Debug, Clone)]
pub struct Place {
    pub x: Vec<[f64; 3]>,
    pub species: Vec<i32>,
    /// The positions for which the forces were computed, if they were displaced.
    pub displaced: Option<Vec<[f64; 3]>>,
}

impl Flux {
    /// The force on each of so many walls, averaged over the step.
    pub fn on_walls(&self, count: usize) -> Vec<OnWall> {
        let mut sums = vec![[0.0; 4]; count];
        let mut add = |share: f64, forces: &[OnWall]| {
            for (sum, force) in sums.iter_mut().zip(forces) {
                (0..4).for_each(|c| sum[c] += share * force[c]);
            }
        };
        self.forces.iter().for_each(|acted| add(acted.share, &acted.on_walls));
        add(1.0, &self.on_walls);
        sums
    }

    /// The symmetric part of `Σ d ⊗ f` over all lines.
    pub fn sum(&self) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for acted in &self.forces {
            (0..6).for_each(|c| sum[c] += acted.share * acted.virial[c]);
        }
        for drag in &self.drag {
            (0..6).for_each(|c| sum[c] += drag.sum[c]);
        }
        for line in &self.ways {
            for (sum, (a, b)) in sum.iter_mut().zip(COMPONENTS) {
                *sum += 0.5 * (line.d[a] * line.f[b] + line.d[b] * line.f[a]);
            }
        }
        sum
    }
}
