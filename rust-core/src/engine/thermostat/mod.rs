//! The thermostat as an operator on velocities at fixed positions, apart from the forces.
//!
//! With `D = γ w_R²` a pair has the drag `−D (ê·v_ij) ê` and a noise of matching strength. For a time
//! Δt one vector for each pair determines both,
//!
//! ```text
//! g = ê √(½ Δt D),   |g|² = ½ Δt D,
//! ```
//!
//! which all updates here use: the drag is `−(2/Δt) g (g·v_ij)`, the noise `(2/Δt) √kT ξ g`. Since both
//! derive from the same `g`, its single precision in mixed precision changes the friction by rounding
//! errors, but not the equilibrium.
//!
//! [`PairThermostat::find_pairs`] finds the pairs, by the search of the sweep or, as `of_forces` explains, those of the last
//! forces; [`PairThermostat::draw`] draws their noise, and [`PairThermostat::act`] changes velocities: `midpoint` for all
//! pairs at once, `sequential` pair by pair. Results depend on positions, velocities and tags, not on the number of
//! threads, and by rounding on the order of particles in memory if pairs are those of the last forces. On a rank with
//! ghosts the midpoint rule exchanges data with the other ranks in rounds: see `rank`. A new update is a variant of
//! [`Update`] and its rule in one of these files.

mod block;
mod bodies;
mod distances;
mod effort;
mod encounter;
mod exchange;
mod fixed;
mod forces;
mod labels;
mod mass;
mod measure;
mod midpoint;
mod of_forces;
mod on_fixed;
mod particle_loops;
mod pass;
mod pulls;
mod rank;
mod sequential;
mod solution;
mod virial;
mod weights;

#[cfg(test)]
mod tests;

pub use bodies::Bodies;
pub use effort::Effort;
pub use pulls::Pulls;
pub use rank::{Need, Rank};

use super::error::EngineError;
use super::particles::Particles;
use super::plan::{Plan, ThermostatPlan};
use super::surroundings::Around;
use super::sweep::{ListedPairs, MARGIN, PairLists, PlanePairs, Pool};
use distances::Distances;
use encounter::{lowe_andersen, ornstein_uhlenbeck, shardlow};
use exchange::Exchange;
use labels::Labels;
use mass::Mass;
use on_fixed::OnFixed;
use pass::{Sums, fill};
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::noise::{Law, PairNoise};
use psidpd_passes::plane::list::ListTerms;
use psidpd_passes::plane::listed_noise::ListedNoise;
use psidpd_passes::plane::pair_sums::Noise;
use psidpd_passes::settings::{Precision, Settings};
use solution::Solution;

/// The rule that changes velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Update {
    /// The implicit midpoint rule over all pairs; see `midpoint.rs`.
    Midpoint,
    /// Drag alone, by the implicit Euler rule over all pairs: `(M + ½ΔtG) v′ = M v`.
    ImplicitDrag,
    /// The exact Ornstein–Uhlenbeck process of each pair in turn; see `encounter.rs`.
    OrnsteinUhlenbeck,
    /// Half an explicit and half an implicit step, for each pair in turn.
    Shardlow {
        /// Whether the pairs come in the opposite order.
        reversed: bool,
    },
    /// New relative velocities for randomly selected pairs, in turn.
    LoweAndersen,
}

/// Drag and noise of the pairs of one fluid.
#[derive(Debug)]
pub struct PairThermostat {
    plan: ThermostatPlan,
    dimensions: usize,
    kt: f64,
    dt: f64,
    set: InstructionSet,
    lists: PairLists,
    planes: Vec<PlanePairs>,
    /// Whether these are the pairs of a whole search: not while one is under way, nor after one that failed or panicked.
    has_pairs: bool,
    /// Whether pairs are computed in double precision.
    is_exact: bool,
    /// Of the sorted particles.
    masses: Vec<Mass>,
    labels: Labels,
    sums: Sums,
    solution: Solution,
    /// Factor of `g` in the impulse of each pair, without its own noise, by plane; used if the virial is requested.
    impulses: Vec<Vec<f64>>,
    /// See [`PairThermostat::drag_of_midpoint`].
    drag: [f64; 6],
    effort: Effort,
    kept: Kept,
    /// Whether the present pairs are those that an evaluation of forces has listed.
    are_of_forces: bool,
    on_fixed: OnFixed,
    exchange: Exchange,
    /// Noise of the pairs, and noise for other random numbers of a rule, once they are drawn.
    noise: Option<([PairNoise; 2], Law)>,
}

impl PairThermostat {
    /// The thermostat of a fluid, at its temperature; `None` if all γ are 0. It uses the instructions
    /// and the precision of the settings.
    pub fn new(plan: &Plan, settings: &Settings) -> Option<PairThermostat> {
        let set = InstructionSet::new(settings.instructions).unwrap_or_else(InstructionSet::best);
        Some(PairThermostat {
            plan: plan.thermostat.clone()?,
            dimensions: plan.dimensions,
            kt: plan.kt,
            dt: 0.0,
            set,
            lists: PairLists::new(set, plan.dimensions),
            planes: Vec::new(),
            has_pairs: true,
            is_exact: settings.precision == Precision::Double,
            masses: Vec::new(),
            labels: Labels::default(),
            sums: Sums::default(),
            solution: Solution::default(),
            impulses: Vec::new(),
            drag: [0.0; 6],
            effort: Effort::default(),
            kept: Kept::default(),
            are_of_forces: false,
            on_fixed: OnFixed::default(),
            exchange: Exchange::default(),
            noise: None,
        })
    }

    /// Finds the pairs in range, and their `g` for a time `dt`. With `virial` [`PairThermostat::act`] computes its virial.
    ///
    /// # Errors
    /// Fails for a position that is not finite, for arrays of different lengths, a species or tag out of range, and for a
    /// box narrower than twice the range. Without pairs the thermostat can do nothing but search again.
    pub fn find_pairs(
        &mut self,
        pool: &Pool,
        bodies: &Bodies,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        self.find_pairs_among(None, pool, bodies, dt, virial)
    }

    fn find_pairs_among(
        &mut self,
        listed: Option<ListedPairs>,
        pool: &Pool,
        bodies: &Bodies,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        let Bodies { domain, x, tag, species, mass, frozen } = *bodies;
        let particles = Particles { x, tag, kind: species, owned: x.len() };
        let kinds: Vec<i32> = (0..self.plan.gamma.len().isqrt() as i32).collect();
        if mass.len() < kinds.len() || !(frozen.is_empty() || frozen.len() == x.len()) {
            return Err(EngineError::Host(
                "`mass` has one entry per species, `frozen` one per particle or none",
            ));
        }
        self.find(listed, pool, Around { domain, images: &[] }, &particles, &kinds, dt, virial, |k| {
            let rests = frozen.get(k).is_some_and(|frozen| *frozen);
            if rests { f64::INFINITY } else { mass[species[k] as usize] }
        })
    }

    /// Finds the pairs, with the mass of each particle of the host.
    #[allow(clippy::too_many_arguments)]
    fn find(
        &mut self,
        listed: Option<ListedPairs>,
        pool: &Pool,
        around: Around,
        particles: &Particles,
        species_of_kind: &[i32],
        dt: f64,
        virial: bool,
        mass: impl Fn(usize) -> f64 + Sync,
    ) -> Result<(), EngineError> {
        self.has_pairs = false;
        particles.check(26)?;
        particles.check_images(around.images)?;
        (self.dt, self.kept, self.exchange) = (dt, Kept { virial, middle: false }, Exchange::default());
        let mut is_long = false;
        self.noise = None;
        self.take(listed, particles.x, dt);
        if !self.are_of_forces {
            let range = [self.plan.longest, self.margin()];
            let PairThermostat { plan, lists, planes, .. } = self;
            let terms = |margin| ListTerms::new(weights::weights(plan, dt), margin);
            is_long = lists.find(pool, around, particles, species_of_kind, terms, range, planes)?;
        }
        self.measure(pool, around.domain, particles, species_of_kind, self.is_exact || is_long);
        let PairThermostat { plan, lists, planes, labels, .. } = self;
        labels.gather(pool, lists.order(), planes, particles, species_of_kind, plan.gamma.len().isqrt());
        let order = self.lists.order();
        fill(pool, &mut self.masses, order, |k| Mass::new(mass(k)));
        self.has_pairs = true;
        Ok(())
    }

    /// Sets what updates compute besides velocities, until the next search.
    pub fn keep(&mut self, kept: Kept) {
        self.kept = kept;
    }

    /// Stops a host that goes on after a search that has failed: some arrays may be those of other particles.
    fn assert_pairs(&self) {
        assert!(self.has_pairs, "the thermostat has no pairs, as the last search for them has failed");
    }

    /// Fraction by which the range of the search is extended.
    fn margin(&self) -> f64 {
        if self.is_exact { MARGIN } else { 0.0 }
    }

    /// The pairs for a time `dt`.
    fn terms(&self, dt: f64) -> ListTerms {
        ListTerms::new(weights::weights(&self.plan, dt), self.margin())
    }

    /// The distances of the pairs.
    fn distances(&self) -> Distances<'_> {
        Distances::new(&self.plan, self.dt, &self.labels.species)
    }

    /// Draws the noise of the pairs of the last search: sets what it follows from, as each pass over pairs computes it anew.
    ///
    /// # Panics
    /// Panics if the last search has failed, as all that follow here.
    pub fn draw(&mut self, seed: u64, step: u64, stream: Stream, law: Law) {
        self.assert_pairs();
        let noise = [0, 1].map(|k| PairNoise::of_stream(seed, step, 1 + 2 * u16::from(stream.0) + k));
        self.noise = Some((noise, law));
    }

    /// Changes the velocities `v`, in the particle order of the last search for pairs; returns the
    /// virial of the impulses over Δt, if it is requested.
    pub fn act(&mut self, pool: &Pool, update: Update, v: &mut [[f64; 3]]) -> [f64; 6] {
        self.assert_pairs();
        match update {
            Update::Midpoint => self.implicit(pool, v, true),
            Update::ImplicitDrag => self.implicit(pool, v, false),
            Update::OrnsteinUhlenbeck => self.in_turn(pool, v, ornstein_uhlenbeck, false, false),
            Update::Shardlow { reversed } => self.in_turn(pool, v, shardlow, reversed, false),
            Update::LoweAndersen => self.in_turn(pool, v, lowe_andersen, false, true),
        }
    }

    /// Temperature and rate of drag and noise at the velocities `v`, in the particle order of the last
    /// search for pairs, where a particle counts with its `weight`; `None` if no pair is in range.
    pub fn warmth(&self, v: &[[f64; 3]], weight: impl Fn(usize) -> f64) -> Option<Warmth> {
        self.assert_pairs();
        let order = self.lists.order();
        let counts: Vec<f64> = order.iter().map(|k| weight(*k as usize)).collect();
        let moving: f64 =
            self.masses.iter().zip(&counts).filter(|(mass, _)| mass.inertia > 0.0).map(|(_, w)| w).sum();
        let (mut squares, mut weights, mut rates) = (0.0, 0.0, 0.0);
        for plane in &self.planes {
            for [i, j, k] in plane.pairs() {
                let (a, b) = (v[order[i] as usize], v[order[j] as usize]);
                let g = plane.lists.own.g(k);
                let along: f64 = (0..3).map(|c| g[c] * (a[c] - b[c])).sum();
                let [of_i, of_j] = [i, j].map(|k| counts[k] * self.masses[k].inverse);
                let inverse = self.masses[i].inverse + self.masses[j].inverse;
                let square: f64 = g.iter().map(|g| g * g).sum();
                if inverse > 0.0 {
                    let count = 0.5 * (counts[i] + counts[j]);
                    squares += count * along * along / inverse;
                    weights += count * square;
                    rates += square * (of_i + of_j);
                }
            }
        }
        let freedom = self.dimensions as f64 * moving;
        // The division by Δt uses |g|² = ½ΔtD.
        (weights > 0.0).then(|| Warmth { kt: squares / weights, rate: 4.0 * rates / (self.dt * freedom) })
    }

    /// Number of iterations of the last implicit update.
    pub fn iterations(&self) -> usize {
        self.solution.progress.iterations
    }

    /// Iterations of all implicit updates so far.
    pub fn effort(&self) -> Effort {
        self.effort
    }
}

/// What an update computes besides velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Kept {
    /// Its virial, and for [`PairThermostat::pulls`] the impulses of a rule pair by pair.
    pub virial: bool,
    /// The velocities at which the midpoint rule has its drag, for [`PairThermostat::velocities_of_midpoint`].
    pub middle: bool,
}

/// Temperature of the particles as the thermostat measures it, and its rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warmth {
    /// kT of the relative velocities along pairs, `Σ D μ u²/Σ D`: flow on scales beyond the range hardly contributes.
    pub kt: f64,
    /// The rate at which drag alone removes kinetic energy from uncorrelated particles, `2 Σ
    /// D/μ` over the degrees of freedom.
    pub rate: f64,
}

/// The number of one of several independent noises of a step.
///
/// The noise in the forces is independent of all of these.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stream(pub u8);

/// The noise of the pairs of these particles, with the amplitude `√kT`; `None` at kT = 0.
///
/// # Panics
/// Panics if it has not been drawn.
fn noise_of(drawn: Option<([PairNoise; 2], Law)>, labels: &Labels, kt: f64) -> Option<Noise<'_>> {
    (kt > 0.0).then(|| {
        let ([noise, _], law) = drawn.expect("the noise of the pairs has been drawn");
        Noise { amplitude: kt.sqrt(), of_pairs: ListedNoise { noise, law, tags: &labels.tags } }
    })
}
