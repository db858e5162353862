//! Runs the engine as a host with ghosts does: periodic images are ghosts, slopes are copied to them,
//! and forces, energies and virials are returned to the owners.

use psidpd_core::engine::{
    Engine, Images, Newton, Particles, PassCounts, PeriodicBox, Request, Settings, Statistics, Step,
    Surroundings, Tally, Want,
};
use psidpd_core::model::Fluid;

/// Owned particles in a box.
#[derive(Clone, Copy)]
pub struct Owned<'a> {
    pub domain: &'a PeriodicBox,
    pub x: &'a [[f64; 3]],
    pub v: &'a [[f64; 3]],
    pub species: &'a [usize],
    pub tag: &'a [i32],
}

/// Results of an evaluation.
#[allow(dead_code)] // Not every user of this module looks at all of it.
pub struct Outcome {
    pub tally: Tally,
    pub forces: Vec<[f64; 3]>,
    pub densities: Vec<f64>,
    pub energy: Vec<f64>,
    pub virial: Vec<[f64; 6]>,
    pub counts: PassCounts,
    pub out_of_bounds: [u64; 2],
}

/// Evaluates all results, with drag and noise if there is a step.
pub fn evaluate(fluid: &Fluid, c: Owned, newton: Newton, step: Option<Step>) -> Outcome {
    let mut engine = Engine::new(fluid, Settings::default()).unwrap();
    engine.use_pair_sums_only(true);
    let owned = c.x.len();
    let mut images = Images::default();
    let (mut x, mut v, mut tag) = (c.x.to_vec(), c.v.to_vec(), c.tag.to_vec());
    let mut kind: Vec<i32> = c.species.iter().map(|s| *s as i32).collect();
    images.build(c.domain, fluid.dimensions, fluid.cutoff(), owned, &mut x);
    images.forward(1, &mut v);
    images.forward(1, &mut tag);
    images.forward(1, &mut kind);
    let particles = Particles { owned, x: &x, tag: &tag, kind: &kind };
    let request = Request { particles, v: &v, step, want: Want::ALL };
    let mut forces = vec![[0.0; 3]; x.len()];
    let mut pending = engine.first(Surroundings::ghosts(newton), &request, &mut forces).unwrap();
    let width = engine.plan().slope_width();
    let mut slopes = pending.slopes_mut()[..owned * width].to_vec();
    images.forward(width, &mut slopes);
    pending.slopes_mut().copy_from_slice(&slopes);
    let tally = pending.finish(&mut engine, &request, &mut forces).unwrap();
    let mut energy = engine.results().particle_energy.to_vec();
    let mut virial = engine.results().particle_virial.to_vec();
    if newton == Newton::On {
        images.reverse(&mut forces);
        // The loop adds energies and virials of ghosts to their owners, three numbers at a time.
        let mut low: Vec<[f64; 3]> = virial.iter().map(|w| [w[0], w[1], w[2]]).collect();
        let mut high: Vec<[f64; 3]> = virial.iter().map(|w| [w[3], w[4], w[5]]).collect();
        let mut e: Vec<[f64; 3]> = energy.iter().map(|e| [*e, 0.0, 0.0]).collect();
        for list in [&mut low, &mut high, &mut e] {
            images.reverse(list);
        }
        energy = e.iter().map(|e| e[0]).collect();
        virial = low.iter().zip(&high).map(|(a, b)| [a[0], a[1], a[2], b[0], b[1], b[2]]).collect();
    }
    forces.truncate(owned);
    energy.truncate(owned);
    virial.truncate(owned);
    let Statistics { counts, out_of_bounds, .. } = engine.statistics();
    Outcome {
        tally,
        forces,
        densities: engine.results().densities.to_vec(),
        energy,
        virial,
        counts,
        out_of_bounds,
    }
}
