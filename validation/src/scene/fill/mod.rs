//! Initial states from their description.

mod lattice;
mod random;

use super::{Filling, Initial, Placement, Scene};
use crate::run::State;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// The initial state of a scene. The generator's stream is fixed by its algorithm, not by the machine.
pub fn fill(scene: &Scene) -> State {
    let mut random = ChaCha8Rng::seed_from_u64(scene.seed);
    match &scene.initial {
        Initial::Filling(filling) => place(scene, filling, &mut random),
        Initial::File { state, velocities, .. } => {
            let mut state = State { mass: scene.mass.clone(), ..State::clone(state) };
            if let Some(velocities) = velocities {
                let mass = state.species.iter().map(|s| scene.mass[*s as usize]);
                state.v = velocities.draw(mass, scene.kt, scene.model.dimensions(), &mut random);
            }
            state
        }
    }
}

fn place(scene: &Scene, initial: &Filling, random: &mut ChaCha8Rng) -> State {
    let (count, dimensions) = (initial.count, scene.model.dimensions());
    let mut species: Vec<i32> = Vec::with_capacity(count);
    for (kind, share) in initial.composition.share(count).into_iter().enumerate() {
        species.resize(species.len() + share, kind as i32);
    }
    species.shuffle(random);
    // In fractions of the box.
    let mut low = [0.0; 3];
    let mut high = [1.0; 3];
    if let Placement::Slab { axis, thickness } = initial.placement {
        let half = 0.5 * thickness / scene.domain.lengths()[axis];
        (low[axis], high[axis]) = (0.5 - half, 0.5 + half);
    }
    let fractions = match initial.placement {
        Placement::Random | Placement::Slab { .. } => random::fractions(count, low, high, random),
        Placement::Lattice => lattice::fractions(count, scene.domain.lengths(), dimensions),
    };
    let mut x: Vec<[f64; 3]> = Vec::with_capacity(count);
    for mut s in fractions {
        if dimensions == 2 {
            s[2] = 0.5;
        }
        x.push(scene.domain.point(s));
    }
    let mass = species.iter().map(|s| scene.mass[*s as usize]);
    let v = initial.velocities.draw(mass, scene.kt, dimensions, random);
    State {
        domain: scene.domain.clone(),
        mass: scene.mass.clone(),
        x,
        v,
        species,
        tag: (1..=count as i32).collect(),
        image: vec![[0; 3]; count],
    }
}
