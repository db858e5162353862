//! The momentum transport in a step, as the integrator made it.
//!
//! A particle carries `m u` along its path, with the velocity `u` that moved it. A pair carries the momentum that its force
//! transfers, along the line between its particles. In a steady state the sum of both gives the same normal pressure
//! everywhere, at any time step. The velocities at the ends of steps do not: in velocity Verlet they lack a kick by half of
//! the forces, drag and noise included, so that `⟨Σ m v²⟩` is too small by `¼ Δt² ⟨Σ f²/m⟩`, a term of first order.
//!
//! The random force transfers momentum too, but is left out: it does not depend on the positions, so its mean contribution
//! is 0.

use psidpd_core::engine::pair_sums::{COMPONENTS, PAIR_BLOCK};
use psidpd_core::engine::thermostat::Pulls;
use psidpd_core::engine::vectors::{Loop, run_best};
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
pub const BLOCK: usize = PAIR_BLOCK;

/// A block of lines as parallel arrays, of which the first `count` entries are lines.
#[derive(Debug, Clone)]
pub struct Lines {
    /// True if every `f` is parallel to `d`.
    pub parallel: bool,
    pub count: usize,
    /// The three arrays have the components of [`Line::from`]; so have `d` and `f`.
    pub from: [[f64; BLOCK]; 3],
    pub d: [[f64; BLOCK]; 3],
    pub f: [[f64; BLOCK]; 3],
}

impl Default for Lines {
    fn default() -> Lines {
        let none = [[0.0; BLOCK]; 3];
        Lines { parallel: true, count: 0, from: none, d: none, f: none }
    }
}

impl Lines {
    /// Passes lines on in blocks.
    pub fn in_blocks(
        &mut self,
        parallel: bool,
        all: impl Iterator<Item = Line>,
        mut visit: impl FnMut(&Lines),
    ) {
        (self.parallel, self.count) = (parallel, 0);
        for Line { from, d, f } in all {
            let at = self.count;
            for c in 0..3 {
                (self.from[c][at], self.d[c][at], self.f[c][at]) = (from[c], d[c], f[c]);
            }
            self.count += 1;
            if self.count == BLOCK {
                visit(self);
                self.count = 0;
            }
        }
        if self.count > 0 {
            visit(self);
        }
    }

    /// Adds the symmetric part of `Σ d ⊗ f` in the order xx, yy, zz, xy, xz, yz.
    pub fn add_to(&self, sums: &mut [f64; 6]) {
        let of_block = run_best(Sum { lines: self });
        sums.iter_mut().zip(of_block).for_each(|(sum, add)| *sum += add);
    }

    /// Becomes the lines between the particles of pairs, at most [`BLOCK`], which begin at the particles at `x`. `d` are the
    /// separations of the pairs, and `strengths` times `share` the forces divided by them. The particles lie at `displacements` from
    /// `x`, which are empty where they lie there.
    pub fn join<D: Copy + Into<f64>, S: Copy + Into<f64>>(
        &mut self,
        particles: impl Iterator<Item = [usize; 2]>,
        (x, displacements): (&[[f64; 3]], &[[f64; 3]]),
        pairs: Pull<D, S>,
    ) {
        self.parallel = displacements.is_empty();
        self.count = pairs.strengths.len();
        if self.parallel {
            for (k, [i, _]) in particles.enumerate() {
                (0..3).for_each(|c| self.from[c][k] = x[i][c]);
            }
            run_best(Join::<D, S, false> { lines: self, pairs });
        } else {
            for (k, [i, j]) in particles.enumerate() {
                let (of_i, of_j) = (displacements[i], displacements[j]);
                for c in 0..3 {
                    (self.from[c][k], self.d[c][k]) = (x[i][c], of_i[c] - of_j[c]);
                }
            }
            run_best(Join::<D, S, true> { lines: self, pairs });
        }
    }
}

/// Number of lines in a vector.
const LANES: usize = 8;

struct Sum<'a> {
    lines: &'a Lines,
}

impl Loop for Sum<'_> {
    type Out = [f64; 6];

    #[inline(always)]
    fn run(self) -> [f64; 6] {
        let Lines { count, d, f, .. } = self.lines;
        COMPONENTS.map(|(a, b)| {
            let [of_a, of_b] = [(a, b), (b, a)].map(|(a, b)| (&d[a][..*count], &f[b][..*count]));
            let (mut lanes, mut rest) = ([0.0; LANES], 0.0);
            for (d, f) in [of_a, of_b] {
                let ((d, d_rest), (f, f_rest)) = (d.as_chunks::<LANES>(), f.as_chunks::<LANES>());
                d.iter().zip(f).for_each(|(d, f)| (0..LANES).for_each(|k| lanes[k] += d[k] * f[k]));
                rest += d_rest.iter().zip(f_rest).map(|(d, f)| d * f).sum::<f64>();
            }
            0.5 * (lanes.iter().sum::<f64>() + rest)
        })
    }
}

/// Pairs and forces on them, in either precision.
#[derive(Debug, Clone, Copy)]
pub struct Pull<'a, D = f64, S = f64> {
    pub d: [&'a [D]; 3],
    pub strengths: &'a [S],
    pub share: f64,
}

/// Sets `d` and `f` of lines between pairs; `d` holds the displacements, if there are any.
struct Join<'a, D, S, const DISPLACED: bool> {
    lines: &'a mut Lines,
    pairs: Pull<'a, D, S>,
}

impl<D: Copy + Into<f64>, S: Copy + Into<f64>, const DISPLACED: bool> Loop for Join<'_, D, S, DISPLACED> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Join { lines: Lines { d, f, .. }, pairs: Pull { d: of_pairs, strengths, share } } = self;
        for ((d, f), of_pair) in d.iter_mut().zip(f).zip(of_pairs) {
            for (((d, f), of_pair), strength) in d.iter_mut().zip(f).zip(of_pair).zip(strengths) {
                let (of_pair, strength): (f64, f64) = ((*of_pair).into(), (*strength).into());
                *d = of_pair - if DISPLACED { *d } else { 0.0 };
                *f = share * strength * of_pair;
            }
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
    /// The lines, whose sum [`Frame::carried_pressure`](crate::frame::Frame::carried_pressure) takes.
    Lines,
}

/// The components of the force on a wall of matter, and what presses on it across its surface, added up over the surface.
pub type OnWall = [f64; 4];

#[derive(Debug, Clone, Default)]
pub struct Flux {
    pub recorded: Recorded,
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
    /// `Σ d ⊗ f` in the order xx, yy, zz, xy, xz, yz, if sums are recorded.
    pub sum: [f64; 6],
    /// The positions of the particles at the time, and the pairs, in parts that do not depend on the number of threads; none if only
    /// the sum is recorded.
    pub x: Vec<[f64; 3]>,
    #[serde(with = "arrays")]
    pub pairs: Vec<Pulls>,
    /// The lines of the friction of walls.
    pub friction: Vec<Line>,
}

/// The arrays of pairs are written like other things.
mod arrays {
    use super::{Deserialize, Pulls};
    use serde::{Deserializer, Serializer};

    type Arrays = (Vec<u32>, [Vec<f64>; 3], Vec<f64>);

    pub fn serialize<S: Serializer>(pairs: &[Pulls], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(pairs.iter().map(|Pulls { i, d, strengths }| (i, d, strengths)))
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<Pulls>, D::Error> {
        let pulls = |(i, d, strengths): Arrays| Pulls { i, d, strengths };
        Ok(Vec::<Arrays>::deserialize(from)?.into_iter().map(pulls).collect())
    }
}

/// Conservative forces at positions of a step.
#[derive(Debug, Clone)]
pub struct Acted {
    /// The fraction of the step for which these forces acted.
    pub share: f64,
    /// Their virial, if sums are recorded.
    pub virial: [f64; 6],
    /// The forces on walls of matter.
    pub on_walls: Vec<OnWall>,
    /// The positions of the particles, if they differ from those at the end of the step and lines are recorded.
    pub at: Option<Place>,
    /// The drag that acts besides at the same positions; none if it does not, or if [`Flux::drag`] has its lines.
    pub dragged: Option<Dragged>,
}

/// Drag along the lines of forces.
#[derive(Debug, Clone)]
pub struct Dragged {
    /// The fraction of the step for which it acts.
    pub share: f64,
    /// The velocities at which it acts.
    pub v: Vec<[f64; 3]>,
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

    /// The symmetric part of `Σ d ⊗ f` over all lines, if the sum is recorded.
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
