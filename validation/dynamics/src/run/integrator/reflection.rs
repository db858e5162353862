//! Particles that meet reflecting faces, or the round surfaces of walls, in a drift.
//!
//! They move on the exact path under the force held: see [`psidpd_core::engine::reflection`].

use crate::run::bounce::{Arc, fly};
use crate::run::bounds::Bounds;
use psidpd_core::engine::Place;
pub use psidpd_core::engine::reflection::Path;
use psidpd_core::engine::reflection::{self, Way};

/// The faces around particles, and how these move.
#[derive(Debug, Clone, Copy)]
pub struct Faces<'a> {
    pub bounds: &'a Bounds,
    pub mass: &'a [f64],
    pub path: Path,
    /// Whether the ways of the particles are recorded.
    pub records: bool,
    /// What the drift before has left beyond faces.
    pub beyond: &'a [Beyond],
}

/// A place of the step in its middle that lies beyond a face, where the particle waits: what the place of the path needs is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beyond {
    pub particle: usize,
    direction: usize,
    by: f64,
}

/// The particles of one thread before a drift.
#[derive(Clone, Copy)]
pub struct Before<'a> {
    /// The number of the first.
    pub first: usize,
    pub x: &'a [[f64; 3]],
    pub v: &'a [[f64; 3]],
    pub f: &'a [[f64; 3]],
    pub species: &'a [i32],
    pub image: &'a [[i32; 3]],
}

/// A particle that meets a face; one that meets a round surface has a bounce for each direction across it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounce {
    pub particle: usize,
    pub direction: usize,
    /// The round wall that it met.
    pub wall: Option<usize>,
    /// Place and velocity of the step at the end, and the velocity of the path; `None` if it moved further than across the box.
    pub end: Option<[f64; 3]>,
    /// The velocity that the faces have given.
    pub given: f64,
    /// How far the place of the step would lie beyond the face.
    beyond: f64,
    /// Place of the step at the start.
    start: f64,
    /// The way of the particle, with the places of the step at its ends and the velocities that carry momentum; empty if ways are not recorded.
    arcs: Vec<Arc>,
    /// How often it had crossed the box at the start.
    pub image: i32,
    /// The velocity across a round surface that it has given, in one of the bounces.
    push: f64,
}

impl Bounce {
    pub fn hit(&self, mass: f64) -> Hit {
        let (momentum, push) =
            (mass * self.given, mass * if self.wall.is_some() { self.push } else { self.given.abs() });
        Hit { wall: self.wall, direction: self.direction, momentum, push }
    }
}

/// A straight part of a particle's way, from `to − d`, with the velocity that carries its momentum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    pub particle: usize,
    pub to: [f64; 3],
    pub d: [f64; 3],
    pub u: [f64; 3],
}

/// The momentum that faces, or a round wall, have given to a particle in a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    pub wall: Option<usize>,
    pub direction: usize,
    pub momentum: f64,
    /// Its part across the surface, into the fluid.
    pub push: f64,
}

impl Faces<'_> {
    /// The particles that meet a face if `rule` moves them, in their order. `rule` makes position and velocity of position, velocity,
    /// force, and a number of the species.
    pub fn met<R>(&self, before: Before, over_mass: &[f64], rule: R) -> Vec<Bounce>
    where
        R: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let Path { time, kicked, shift, ahead } = self.path;
        let mut bounces = Vec::new();
        for c in self.bounds.walls() {
            let [low, high] = [self.bounds.low[c], self.bounds.high[c]];
            for (k, ((x, v), (f, s))) in
                before.x.iter().zip(before.v).zip(before.f.iter().zip(before.species)).enumerate()
            {
                let (to, v) = rule(x[c], v[c], f[c], over_mass[*s as usize]);
                let a = f[c] / self.mass[*s as usize];
                let waits = x[c] <= low || x[c] >= high;
                let beyond = if waits { self.beyond(before.first + k, c) } else { 0.0 };
                let (from, u) = (x[c] + beyond - shift * a, v - kicked * a);
                // A parabola is within the triangle of its ends and of the point where their tangents meet.
                let (middle, end) = (from + 0.5 * time * u, from + time * (u + 0.5 * time * a));
                let (least, most) = (to.min(from).min(middle).min(end), to.max(from).max(middle).max(end));
                if least >= low && most <= high && beyond == 0.0 {
                    continue;
                }
                let is_inside = (low..=high).contains(&to);
                let mut arcs = Vec::new();
                let show = |arc| {
                    if self.records {
                        arcs.push(arc)
                    }
                };
                let flown = fly([from.clamp(low, high), u], a, [low, high], time, show);
                // Beyond the mirror image of the box.
                let escaped = !(2.0 * low - high..=2.0 * high - low).contains(&to);
                if is_inside && beyond == 0.0 && flown.is_some_and(|end| end.given == 0.0) {
                    continue;
                }
                let place = flown.map_or(to, |end| end.x + self.path.shift_at_end() * a);
                let inside = place.clamp(low, high);
                let end = flown.filter(|_| !escaped).map(|end| [inside, v + end.given, end.u]);
                let beyond = place - inside;
                for arc in &mut arcs {
                    arc.given += v + ahead * a;
                }
                let given = flown.map_or(0.0, |end| end.given);
                let (wall, image, push) = (None, before.image[k][c], 0.0);
                bounces.push(Bounce {
                    particle: k,
                    direction: c,
                    wall,
                    end,
                    given,
                    beyond,
                    start: x[c],
                    arcs,
                    image,
                    push,
                });
            }
        }
        for (wall, place) in self.bounds.rounds.iter() {
            self.met_round((wall, place), before, over_mass, &rule, &mut bounces);
        }
        bounces.sort_by_key(|bounce| bounce.particle);
        // Surfaces that are round are a range or more from all others.
        for of_one in bounces.chunk_by_mut(|a, b| a.particle == b.particle) {
            for k in 1..of_one.len() {
                if of_one[..k].iter().any(|other| other.direction == of_one[k].direction) {
                    of_one[k].end = None;
                }
            }
        }
        bounces
    }

    /// Adds the bounces of particles that meet a round surface.
    fn met_round<R>(
        &self,
        (wall, place): (usize, &Place),
        before: Before,
        over_mass: &[f64],
        rule: &R,
        bounces: &mut Vec<Bounce>,
    ) where
        R: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let Place::Round { round, .. } = place else { return };
        let ahead = self.path.ahead;
        for (k, (x, (v, (f, s)))) in
            before.x.iter().zip(before.v.iter().zip(before.f.iter().zip(before.species))).enumerate()
        {
            let moved = [0, 1, 2].map(|c| rule(x[c], v[c], f[c], over_mass[*s as usize]));
            let [to, v] = [moved.map(|moved| moved.0), moved.map(|moved| moved.1)];
            let a = f.map(|f| f / self.mass[*s as usize]);
            let mut arcs: [Vec<Arc>; 3] = Default::default();
            let show = |arc: reflection::Arc| {
                let Some((_, arm)) = place.arm(x).filter(|_| self.records) else { return };
                for c in (0..3).filter(|c| round.across[*c]) {
                    let given = arc.given[c] + v[c] + ahead * a[c];
                    let x = x[c] + (arc.arm[c] - arm[c]);
                    arcs[c].push(Arc { time: arc.time, x, u: arc.u[c], a: arc.a[c], given });
                }
            };
            let beyond = || [0, 1, 2].map(|c| self.beyond(before.first + k, c));
            let met = match self.path.meet(place, x, [to, v], a, beyond, show) {
                Way::Free => continue,
                Way::Lost => None,
                Way::Met(met) => Some(met),
            };
            let mut push = met.map_or(0.0, |met| met.push);
            for c in (0..3).filter(|c| round.across[*c]) {
                bounces.push(Bounce {
                    particle: k,
                    direction: c,
                    wall: Some(wall),
                    end: met.map(|met| [met.x[c], met.v[c], met.u[c]]),
                    given: met.map_or(0.0, |met| met.given[c]),
                    beyond: met.map_or(0.0, |met| met.beyond[c]),
                    start: x[c],
                    arcs: std::mem::take(&mut arcs[c]),
                    image: before.image[k][c],
                    push: std::mem::take(&mut push),
                });
            }
        }
    }

    fn beyond(&self, particle: usize, direction: usize) -> f64 {
        let left = self.beyond.iter().find(|b| b.particle == particle && b.direction == direction);
        left.map_or(0.0, |beyond| beyond.by)
    }

    /// What `bounces` leave beyond faces for the drift behind this one, in the order of particles.
    pub fn left(&self, bounces: &[Bounce], first: usize) -> Vec<Beyond> {
        if self.path.shift_at_end() == 0.0 {
            return Vec::new();
        }
        let left = bounces.iter().filter(|bounce| bounce.beyond != 0.0);
        left.map(|b| Beyond { particle: first + b.particle, direction: b.direction, by: b.beyond }).collect()
    }

    /// The way of a particle that met faces in `bounces` and ended at `x` with the velocity `v` under the acceleration `a`.
    pub fn legs(&self, bounces: &[Bounce], x: [f64; 3], v: [f64; 3], a: [f64; 3]) -> Vec<Leg> {
        let Path { time, ahead, .. } = self.path;
        let bounced = [0, 1, 2].map(|c| bounces.iter().find(|b| b.direction == c));
        let mut times: Vec<f64> = bounces.iter().flat_map(|b| b.arcs.iter().map(|arc| arc.time)).collect();
        times.push(time);
        times.sort_by(f64::total_cmp);
        let particle = bounces.first().map_or(0, |b| b.particle);
        // The place and the velocity along a direction at a time between two others.
        let along = |c: usize, at: f64, during: f64| match bounced[c] {
            None => {
                let u = v[c] + ahead * a[c];
                (x[c] - (time - at) * u, u)
            }
            Some(Bounce { arcs, start, .. }) => {
                let arc = arcs.iter().rev().find(|arc| arc.time <= during).unwrap_or(&arcs[0]);
                // The ends are those of the step.
                let place = match at {
                    0.0 => *start,
                    at if at == time => x[c],
                    at => arc.place(at),
                };
                (place, arc.given)
            }
        };
        let leg = |pair: &[f64]| {
            let (from, to) = (pair[0], pair[1]);
            let at = [0, 1, 2].map(|c| along(c, to, from));
            let d = std::array::from_fn(|c| at[c].0 - along(c, from, from).0);
            Leg { particle, to: at.map(|at| at.0), d, u: at.map(|at| at.1) }
        };
        times.windows(2).filter(|pair| pair[0] < pair[1]).map(leg).collect()
    }
}
