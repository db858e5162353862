//! Initial states from scenes.

mod lattice;
mod near;
mod random;

use super::{Arrangement, Initial, Part, Scene, State};
use chacha20::ChaCha8Rng;
use near::Near;
use rand::SeedableRng;
use rand::seq::SliceRandom;

/// The error of a part that has no room for its particles at their minimum distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crowded {
    pub part: usize,
    /// Number of particles that found a position.
    pub placed: usize,
}

/// The initial state of a scene. The algorithm alone fixes the stream of the generator, so all machines give the same state.
///
/// Particles of a crowded part are placed nevertheless, closer than their minimum distance; reading a
/// [`Scene`] detects this and refuses the file.
pub fn fill(scene: &Scene) -> (State, Option<Crowded>) {
    let mut random = ChaCha8Rng::seed_from_u64(scene.seed);
    match &scene.initial {
        Initial::Parts(parts) => place(scene, parts, &mut random),
        Initial::File { state, velocities, .. } => {
            let mut state = State { mass: scene.mass.clone(), ..State::clone(state) };
            if let Some(velocities) = velocities {
                let mass = state.species.iter().map(|s| scene.mass[*s as usize]);
                state.v = velocities.draw(mass, scene.kt, scene.model.dimensions(), &mut random);
                rest(&mut state, scene);
            }
            (state, None)
        }
    }
}

/// Sets the velocities of frozen particles to zero, and subtracts the mean velocity of all other particles.
fn rest(state: &mut State, scene: &Scene) {
    if scene.frozen.is_empty() {
        return;
    }
    let (mut momentum, mut total) = ([0.0; 3], 0.0);
    for k in 0..state.len() {
        if scene.frozen.contain(state.tag[k]) {
            state.v[k] = [0.0; 3];
            continue;
        }
        let mass = state.mass[state.species[k] as usize];
        total += mass;
        for c in 0..3 {
            momentum[c] += mass * state.v[k][c];
        }
    }
    for k in (0..state.len()).filter(|k| !scene.frozen.contain(state.tag[*k])) {
        for c in 0..3 {
            state.v[k][c] -= momentum[c] / total;
        }
    }
}

fn place(scene: &Scene, parts: &[Part], random: &mut ChaCha8Rng) -> (State, Option<Crowded>) {
    let count = parts.iter().map(|p| p.count).sum();
    let mut state = State {
        domain: scene.domain.clone(),
        mass: scene.mass.clone(),
        x: Vec::with_capacity(count),
        v: Vec::with_capacity(count),
        species: Vec::with_capacity(count),
        tag: (1..=count as i32).collect(),
        image: vec![[0; 3]; count],
    };
    let mut crowded = None;
    for (index, part) in parts.iter().enumerate() {
        let placed = place_one(scene, part, &mut state, random);
        if placed < part.count && crowded.is_none() {
            crowded = Some(Crowded { part: index, placed });
        }
    }
    (state, crowded)
}

/// Adds the particles of one part, and returns the number that found a position.
fn place_one(scene: &Scene, part: &Part, state: &mut State, random: &mut ChaCha8Rng) -> usize {
    let (count, dimensions) = (part.count, scene.model.dimensions());
    let mut species: Vec<i32> = Vec::with_capacity(count);
    for (kind, share) in part.composition.share(count).into_iter().enumerate() {
        species.resize(species.len() + share, kind as i32);
    }
    species.shuffle(random);
    let first = state.x.len();
    let mut placed = count;
    match part.arrangement {
        Arrangement::Lattice(lattice) => {
            state.x.extend(lattice::points(lattice, count, &part.shape, dimensions));
        }
        Arrangement::Random { min_distance: 0.0 } => {
            state.x.extend((0..count).map(|_| random::point(&part.shape, dimensions, random)));
        }
        Arrangement::Random { min_distance } => {
            let mut near = Near::new(&scene.domain, dimensions, min_distance, first + count);
            state.x.iter().for_each(|x| near.push(*x));
            let mut full = false;
            for k in 0..count {
                let x = match full {
                    true => random::point(&part.shape, dimensions, random),
                    false => {
                        random::point_apart(&part.shape, dimensions, &near, random).unwrap_or_else(|x| {
                            (full, placed) = (true, k);
                            x
                        })
                    }
                };
                near.push(x);
                state.x.push(x);
            }
        }
    }
    if dimensions == 2 {
        state.x[first..].iter_mut().for_each(|x| x[2] = 0.0);
    }
    match part.frozen {
        true => state.v.resize(first + count, [0.0; 3]),
        false => {
            let mass = species.iter().map(|s| scene.mass[*s as usize]);
            let thermal = part.velocities.draw(mass, scene.kt, dimensions, random);
            state.v.extend(thermal.into_iter().map(|v| std::array::from_fn(|c| v[c] + part.velocity[c])));
        }
    }
    state.species.extend(species);
    placed
}
