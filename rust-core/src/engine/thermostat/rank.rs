//! The midpoint rule on one of several ranks, whose ghosts stand for the particles of others.
//!
//! A pair of an owned particle and a ghost is computed on both ranks, and its impulse added to the
//! owned particle alone. The rule returns what it [needs](Need), the host gets that from the other
//! ranks, and the rule continues. All ranks decide by the same sums, so that they need the same.

use super::PairThermostat;
use super::exchange::Round;
use super::pass::{Wide, add_to_host, each_of_host};
use crate::engine::error::EngineError;
use crate::engine::particles::Particles;
use crate::engine::surroundings::Around;
use crate::engine::sweep::{ListedPairs, Pool};

/// The particles of a rank, owned particles first, and their surroundings.
#[derive(Debug, Clone, Copy)]
pub struct Rank<'a> {
    /// The box, at least twice as wide as the range along its periodic directions, and flags of the
    /// ghosts that are images along these.
    pub around: Around<'a>,
    /// Owned particles and ghosts.
    pub particles: Particles<'a>,
    /// Species of each type; negative for types that are left out.
    pub species_of_kind: &'a [i32],
    /// Mass of each owned particle; infinite for a fixed velocity.
    pub mass: &'a [f64],
}

/// The host's task for the next round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Need {
    /// No task: the velocities are final. Contains the virial of this rank, if it is requested.
    Nothing([f64; 6]),
    /// Sum these numbers over all ranks.
    Totals([f64; 3]),
    /// Copy the vectors of owners to their ghosts.
    Ghosts,
}

const CHANGED: EngineError = EngineError::Host("particles changed while their thermostat acted");

impl PairThermostat {
    /// Finds the pairs of a rank, as [`PairThermostat::find_pairs`].
    ///
    /// # Errors
    /// Fails as [`PairThermostat::find_pairs`], and for arrays of different lengths.
    pub fn find_pairs_of_rank(
        &mut self,
        pool: &Pool,
        rank: &Rank,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        self.find_pairs_of_rank_among(None, pool, rank, dt, virial)
    }

    pub(super) fn find_pairs_of_rank_among(
        &mut self,
        listed: Option<ListedPairs>,
        pool: &Pool,
        rank: &Rank,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        let Rank { around, particles, species_of_kind, mass } = *rank;
        if mass.len() != particles.owned {
            return Err(EngineError::Host("`mass` must have one entry per owned particle"));
        }
        let species = self.plan.gamma.len().isqrt() as i32;
        if species_of_kind.iter().any(|s| *s >= species) {
            return Err(EngineError::Host("a type is mapped to a species the model does not have"));
        }
        // Ghosts are moved by their owners.
        let mass = |k: usize| mass.get(k).copied().unwrap_or(f64::INFINITY);
        self.find(listed, pool, around, &particles, species_of_kind, dt, virial, mass)?;
        self.exchange.owned = particles.owned;
        Ok(())
    }

    /// Begins the midpoint rule for the pairs and noise of the last search. `vectors` are velocities of
    /// all particles, ghosts included.
    ///
    /// # Errors
    /// Fails if the number of vectors is not that of the particles.
    pub fn begin_midpoint(&mut self, pool: &Pool, vectors: &mut [[f64; 3]]) -> Result<Need, EngineError> {
        self.check(vectors)?;
        self.exchange.first = self.begin(pool, vectors, true);
        Ok(self.show_direction(pool, vectors))
    }

    /// Continues with the result of the host's task: totals, or the `vectors` of ghosts. `v` are the
    /// velocities of owned particles, which the last round changes.
    ///
    /// # Errors
    /// Fails if no round is under way, and if the number of vectors is not that of the particles.
    pub fn go_on(
        &mut self,
        pool: &Pool,
        totals: [f64; 3],
        vectors: &mut [[f64; 3]],
        v: &mut [[f64; 3]],
    ) -> Result<Need, EngineError> {
        self.check(vectors)?;
        if v.len() > vectors.len() {
            return Err(CHANGED);
        }
        match self.exchange.round {
            Round::Start => Err(EngineError::Host("the thermostat must begin before it continues")),
            Round::Direction => {
                self.take_ghosts(vectors);
                self.exchange.round = Round::Curvature;
                let [curvature, square] = self.curvature(pool);
                Ok(Need::Totals([self.exchange.first, curvature, square]))
            }
            Round::Curvature => match self.advance(pool, totals) {
                true => Ok(self.show_direction(pool, vectors)),
                false if self.wants_middle() => {
                    vectors[..v.len()].copy_from_slice(v);
                    add_to_host(pool, &self.lists.place, &self.sums.p, 1.0, &mut vectors[..v.len()]);
                    self.exchange.round = Round::Middle;
                    Ok(Need::Ghosts)
                }
                false => Ok(self.end(pool, v, [0.0; 6])),
            },
            Round::Middle => {
                self.sums.gather(pool, self.lists.order(), vectors);
                let virial = self.virial_of_vectors(pool, v.len(), true);
                Ok(self.end(pool, v, virial))
            }
        }
    }

    fn check(&self, vectors: &[[f64; 3]]) -> Result<(), EngineError> {
        if self.has_pairs && vectors.len() == self.lists.place.len() { Ok(()) } else { Err(CHANGED) }
    }

    /// Asks for the direction of ghosts.
    fn show_direction(&mut self, pool: &Pool, vectors: &mut [[f64; 3]]) -> Need {
        let owned = &mut vectors[..self.exchange.owned];
        each_of_host(pool, &self.lists.place, &self.sums.p, owned, |to, p| *to = [p[0], p[1], p[2]]);
        self.exchange.round = Round::Direction;
        Need::Ghosts
    }

    fn end(&mut self, pool: &Pool, v: &mut [[f64; 3]], virial: [f64; 6]) -> Need {
        add_to_host(pool, &self.lists.place, &self.solution.change, 2.0, v);
        self.exchange.round = Round::Start;
        Need::Nothing(virial)
    }

    fn take_ghosts(&mut self, vectors: &[[f64; 3]]) {
        for ([x, y, z], place) in vectors.iter().zip(&self.lists.place).skip(self.exchange.owned) {
            // Particles that are left out have no place.
            if let Some(p) = self.sums.p.get_mut(*place as usize) {
                *p = Wide([*x, *y, *z, 0.0]);
            }
        }
    }
}
