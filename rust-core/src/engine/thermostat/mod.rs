//! The thermostat as an operator on velocities at fixed positions, apart from the forces.
//!
//! With `D = γ w_R²` a pair has the drag `−D (ê·v_ij) ê` and a noise of matching strength. For a time Δt
//! both are told by one vector for each pair,
//!
//! ```text
//! g = ê √(½ Δt D),   |g|² = ½ Δt D,
//! ```
//!
//! from which every update here is made: the drag is `−(2/Δt) g (g·v_ij)`, the noise `(2/Δt) √kT ξ g`. Since both
//! come from the same `g`, single precision of `g` changes the friction by rounding, but not the equilibrium.
//!
//! [`PairThermostat::find_pairs`] finds the pairs (`cells`, `planes`), [`PairThermostat::draw`] their noise, and
//! [`PairThermostat::act`] changes velocities: `midpoint` for all pairs at once, `sequential` pair by pair.
//! Results depend on positions, velocities and tags: not on the order of particles in memory, nor on the
//! number of threads. A new update is a variant of [`Update`] and its rule in one of these files.

mod bodies;
mod cells;
mod forces;
mod midpoint;
mod part;
mod pass;
mod planes;
mod pulls;
mod sequential;

#[cfg(test)]
mod tests;

pub use bodies::Bodies;
pub use pulls::Pull;

use super::error::EngineError;
use super::plan::{Plan, ThermostatPlan};
use super::sweep::Pool;
use cells::Cells;
use part::Part;
use pass::Sums;
use planes::Plane;
use psidpd_passes::noise::{Law, PairNoise};

/// How velocities are changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Update {
    /// The implicit midpoint rule over all pairs; see `midpoint.rs`.
    Midpoint,
    /// Drag alone, by the implicit Euler rule over all pairs: `(M + ½ΔtG) v′ = M v`.
    ImplicitDrag,
    /// The exact Ornstein–Uhlenbeck process of one pair after the other; see `sequential.rs`.
    OrnsteinUhlenbeck,
    /// Half explicit and half implicit, one pair after the other.
    Shardlow {
        /// Whether the pairs come in the opposite order.
        reversed: bool,
    },
    /// The relative velocity of some pairs, one after the other, drawn anew.
    LoweAndersen,
}

/// Drag and noise of one fluid, by pairs.
#[derive(Debug, Clone)]
pub struct PairThermostat {
    plan: ThermostatPlan,
    dimensions: usize,
    kt: f64,
    dt: f64,
    cells: Cells,
    planes: Vec<Plane>,
    /// By sorted particle.
    mass: Vec<f64>,
    sums: Sums,
    parts: Vec<Part>,
    /// By plane and pair, what `g` was multiplied by in turn, but for the noise; where distances are kept.
    impulses: Vec<Vec<f64>>,
    iterations: usize,
    /// Of the pairs; of whatever else a rule draws.
    noise: [PairNoise; 2],
}

impl PairThermostat {
    /// The thermostat of a fluid at temperature `kt`; `None` if nothing drags.
    pub fn new(plan: &Plan, kt: f64) -> Option<PairThermostat> {
        Some(PairThermostat {
            plan: plan.thermostat.clone()?,
            dimensions: plan.dimensions(),
            kt,
            dt: 0.0,
            cells: Cells::default(),
            planes: Vec::new(),
            mass: Vec::new(),
            sums: Sums::default(),
            parts: Vec::new(),
            impulses: Vec::new(),
            iterations: 0,
            noise: [PairNoise::default(); 2],
        })
    }

    /// Finds the pairs in range, with their `g` for a time `dt`. With `virial` their distances are kept, from which
    /// [`PairThermostat::act`] can tell the virial of what it did.
    ///
    /// # Errors
    /// A position that is not finite; a box narrower than twice the range.
    pub fn find_pairs(
        &mut self,
        pool: &Pool,
        bodies: &Bodies,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        self.dt = dt;
        self.cells.sort(pool, bodies, self.dimensions, self.plan.longest)?;
        self.mass.clear();
        self.mass.extend(self.cells.order.iter().map(|k| {
            let k = *k as usize;
            let frozen = bodies.frozen.get(k).is_some_and(|frozen| *frozen);
            if frozen { f64::INFINITY } else { bodies.mass[bodies.species[k] as usize] }
        }));
        self.planes.resize_with(self.cells.planes(), Plane::default);
        let (cells, scale) = (&self.cells, planes::Scale::new(&self.plan, dt));
        let mut work: Vec<_> = self.planes.iter_mut().enumerate().collect();
        pool.each(&mut work, |(number, plane)| plane.fill(cells, *number, &scale, virial));
        Ok(())
    }

    /// Draws the noise of the pairs that were found.
    pub fn draw(&mut self, pool: &Pool, seed: u64, step: u64, stream: Stream, law: Law) {
        let noise = [0, 1].map(|k| PairNoise::of_stream(seed, step, 1 + 2 * stream.0 + k));
        self.noise = noise;
        let tags = &self.cells.tag;
        pool.each(&mut self.planes, |plane| plane.draw(tags, noise[0], law));
    }

    /// Changes the velocities `v`, in the order of the particles that pairs were found of; returns the virial of the
    /// impulses over Δt, if distances were kept.
    pub fn act(&mut self, pool: &Pool, update: Update, v: &mut [[f64; 3]]) -> [f64; 6] {
        match update {
            Update::Midpoint => self.implicit(pool, v, true),
            Update::ImplicitDrag => self.implicit(pool, v, false),
            other => self.in_turn(pool, v, other),
        }
    }

    /// What drag and noise see at the velocities `v`, in the order of the particles that pairs were found of; `None` if
    /// no pair is in range.
    pub fn warmth(&self, v: &[[f64; 3]]) -> Option<Warmth> {
        let moving = self.mass.iter().filter(|m| m.is_finite()).count();
        let (mut squares, mut weights, mut rates) = (0.0, 0.0, 0.0);
        for plane in &self.planes {
            for (i, ends) in plane.start.windows(2).enumerate() {
                for pair in &plane.pairs[ends[0] as usize..ends[1] as usize] {
                    let j = pair.j as usize;
                    let j =
                        j.checked_sub(plane.own.len()).map_or(plane.own.start + j, |k| plane.next.start + k);
                    let i = plane.own.start + i;
                    let (a, b) = (v[self.cells.order[i] as usize], v[self.cells.order[j] as usize]);
                    let g = pair.g.map(f64::from);
                    let along: f64 = (0..3).map(|c| g[c] * (a[c] - b[c])).sum();
                    let inverse = 1.0 / self.mass[i] + 1.0 / self.mass[j];
                    let square: f64 = g.iter().map(|g| g * g).sum();
                    if inverse > 0.0 {
                        squares += along * along / inverse;
                        weights += square;
                        rates += square * inverse;
                    }
                }
            }
        }
        let freedom = (self.dimensions * moving) as f64;
        // |g|² = ½ΔtD.
        (weights > 0.0).then(|| Warmth { kt: squares / weights, rate: 4.0 * rates / (self.dt * freedom) })
    }

    /// How many iterations the last implicit update took.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// How many pairs are in range.
    pub fn pairs(&self) -> usize {
        self.planes.iter().map(|plane| plane.pairs.len()).sum()
    }
}

/// What the thermostat sees of the particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warmth {
    /// kT of the relative velocities along pairs, `Σ D μ u²/Σ D`: flow on scales beyond the range hardly counts.
    pub kt: f64,
    /// The rate at which drag alone takes kinetic energy from particles without correlations, `2 Σ D/μ` over the degrees of
    /// freedom.
    pub rate: f64,
}

/// Which of several independent noises of one step.
///
/// The noise inside the forces is another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stream(pub u8);
