//! Updates pairs one after the other.
//!
//! The pairs of a particle are updated one after the other, particles in the order of cells, and planes
//! in an order of their own: every second plane first. These run at once, as no two of them share
//! particles. The order depends on positions and tags alone.

use super::PairThermostat;
use super::distances::Distances;
use super::encounter::Encounter;
use super::mass::Mass;
use super::virial::add_virial;
use crate::engine::sweep::{PlanePairs, Pool};
use psidpd_passes::noise::Law;
use psidpd_passes::plane::list::pairs_of_each;
use psidpd_passes::plane::listed_noise::ListedNoise;

/// Sets of planes that are updated at once, one set after the other: no two planes of a set are neighbours.
fn sets(planes: &[PlanePairs]) -> [Vec<usize>; 3] {
    let count = planes.len();
    // The last plane has pairs with the first, which may be in the same set.
    let closes = count % 2 == 1 && count > 1 && !planes[count - 1].next.is_empty();
    let paired = count - usize::from(closes);
    let last = if closes { vec![count - 1] } else { Vec::new() };
    [(0..paired).step_by(2).collect(), (1..paired).step_by(2).collect(), last]
}

/// A plane during an update: its velocities and those of the next plane.
struct Share<'a> {
    plane: &'a PlanePairs,
    own: &'a mut [[f64; 3]],
    next: &'a mut [[f64; 3]],
    /// Masses.
    of_own: &'a [Mass],
    of_next: &'a [Mass],
    virial: [f64; 6],
    /// Factor of `g` in the impulse of each pair without its noise, if the virial is requested.
    impulses: &'a mut Vec<f64>,
}

/// Random numbers of the pairs of a plane.
struct Draws {
    xi: Vec<f32>,
    /// Empty if a rule does not ask for them.
    chances: Vec<f32>,
}

impl PairThermostat {
    /// Applies a rule to all pairs in turn, perhaps in the opposite order; `draws` where it asks for a chance.
    pub(super) fn in_turn(
        &mut self,
        pool: &Pool,
        v: &mut [[f64; 3]],
        rule: fn(&Encounter) -> f64,
        reversed: bool,
        draws: bool,
    ) -> [f64; 6] {
        let PairThermostat { plan, planes, lists, labels, masses, kt, dt, noise, impulses, kept, .. } = self;
        let distances = &Distances::new(plan, *dt, &labels.species);
        impulses.resize_with(planes.len(), Vec::new);
        let (planes, kt) = (&planes[..], *kt);
        let distances = kept.virial.then_some(distances);
        let (noise, law) = noise.expect("the noise of the pairs has been drawn");
        let [noise, of_chances] = noise.map(|noise| ListedNoise { noise, law, tags: &labels.tags });
        let of_chances = ListedNoise { law: Law::Uniform, ..of_chances };
        let mut sorted: Vec<[f64; 3]> = lists.order().iter().map(|k| v[*k as usize]).collect();
        let mut virial = [0.0; 6];
        let mut sets = sets(planes);
        if reversed {
            sets.reverse();
        }
        for set in sets {
            let mut rest = &mut sorted[..];
            let mut slices: Vec<Option<&mut [[f64; 3]]>> =
                planes.iter().map(|p| rest.split_off_mut(..p.own.len())).collect();
            let mut records: Vec<Option<&mut Vec<f64>>> = impulses.iter_mut().map(Some).collect();
            let mut shares: Vec<Share> = Vec::with_capacity(set.len());
            for number in set {
                let plane = &planes[number];
                let above = if number + 1 < planes.len() { number + 1 } else { 0 };
                let own = slices[number].take().unwrap_or_default();
                let next = if plane.next.is_empty() { None } else { slices[above].take() };
                let Some(impulses) = records[number].take() else { continue };
                impulses.clear();
                impulses.resize(if kept.virial { plane.lists.own.count() } else { 0 }, 0.0);
                shares.push(Share {
                    plane,
                    own,
                    next: next.unwrap_or_default(),
                    of_own: &masses[plane.own.clone()],
                    of_next: &masses[plane.next.clone()],
                    virial: [0.0; 6],
                    impulses,
                });
            }
            pool.each(&mut shares, |share| {
                let list = &share.plane.lists.own;
                let chances = if draws { of_chances.of_list(list) } else { Vec::new() };
                let draws = Draws { xi: noise.of_list(list), chances };
                share.update(kt, reversed, &draws, distances, rule);
            });
            for share in shares {
                (0..6).for_each(|c| virial[c] += share.virial[c] / *dt);
            }
        }
        for (k, v_sorted) in lists.order().iter().zip(sorted) {
            v[*k as usize] = v_sorted;
        }
        virial
    }
}

impl Share<'_> {
    fn update(
        &mut self,
        kt: f64,
        reversed: bool,
        draws: &Draws,
        distances: Option<&Distances>,
        rule: impl Fn(&Encounter) -> f64,
    ) {
        let plane = self.plane;
        let particles = pairs_of_each(&plane.lists.own.start);
        let mut meet = |i, k| self.encounter([i, k], kt, draws, distances, &rule);
        match reversed {
            true => particles.rev().for_each(|(i, of_i)| of_i.rev().for_each(|k| meet(i, k))),
            false => particles.for_each(|(i, of_i)| of_i.for_each(|k| meet(i, k))),
        }
    }

    #[inline(always)]
    fn encounter(
        &mut self,
        [i, k]: [usize; 2],
        kt: f64,
        draws: &Draws,
        distances: Option<&Distances>,
        rule: &impl Fn(&Encounter) -> f64,
    ) {
        let list = &self.plane.lists.own;
        let (j, g) = (list.second(k), list.g(k));
        let (own, beyond) = (self.own.len(), j.wrapping_sub(self.own.len()));
        let (other, inverse) = match j < own {
            true => (self.own[j], self.of_own[j]),
            false => (self.next[beyond], self.of_next[beyond]),
        };
        let inverse = [self.of_own[i], inverse].map(|mass| mass.inverse);
        let sum = inverse[0] + inverse[1];
        // A pair of frozen particles does not move.
        if sum == 0.0 {
            return;
        }
        let v = self.own[i];
        let square = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
        if square == 0.0 {
            return;
        }
        let chance = draws.chances.get(k).map_or(0.0, |xi| 0.5 + f64::from(*xi) / 12f64.sqrt());
        let encounter = Encounter {
            along: (v[0] - other[0]) * g[0] + (v[1] - other[1]) * g[1] + (v[2] - other[2]) * g[2],
            a: square * sum,
            square,
            mu: 1.0 / sum,
            kt,
            xi: f64::from(draws.xi[k]),
            chance,
        };
        let impulse = rule(&encounter);
        for c in 0..3 {
            self.own[i][c] += impulse * inverse[0] * g[c];
        }
        let other = if j < own { &mut self.own[j] } else { &mut self.next[beyond] };
        for c in 0..3 {
            other[c] -= impulse * inverse[1] * g[c];
        }
        if let Some(distances) = distances {
            let ratio = distances.per_length(self.plane.own.start + i, list.j_from + j, g);
            add_virial(&mut self.virial, g, impulse * ratio);
            self.impulses[k] = rule(&Encounter { xi: 0.0, ..encounter });
        }
    }
}
