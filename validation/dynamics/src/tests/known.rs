//! Observables of a few particles whose answers are known without the code.

use crate::particles::State;
use crate::run::{Integrator, Simulation};
use crate::scene::Scene;
use crate::tests::support::{self, IDEAL, IDEAL_MIXTURE, SET6, SOFT};
use nalgebra::Matrix3;
use psidpd_core::engine::pair_sums::{COMPONENTS, Evaluator};
use psidpd_core::engine::{PeriodicBox, Want};
use psidpd_observe::flux::{Drag, Flux, Line};
use psidpd_observe::frame::{Frame, View};
use psidpd_observe::meter::AnyMeter;
use psidpd_observe::meter::surface_tension::stretched_energy;
use psidpd_observe::{Measured, Observation, Recorded};
use std::f64::consts::PI;
use std::sync::Arc;

/// A model of particles without forces in a plane.
const FLAT: &str =
    "title = \"flat\"\ndimensions = 2\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

/// Particles and an observable that samples them.
struct Shown {
    simulation: Simulation,
    fluid: Evaluator,
    meter: AnyMeter,
}

impl Shown {
    /// Sets up the first observable of `observe` and particles at rest at `x` in a box of `lengths`.
    fn new(model: &str, kt: f64, lengths: &[f64], x: &[[f64; 3]], observe: &str) -> Shown {
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = {kt:?}\nseed = 1\nbox = {lengths:?}\ndensity = 1.0\ndt = 0.01\nsteps = 10\n\
             [observe]\n{observe}\n"
        );
        let scene = support::scene(model, &text).unwrap();
        let domain = scene.initial_state().domain;
        let state = State::at_rest(domain, vec![1.0; scene.model.species().len()], x.to_vec());
        let simulation = Simulation::new(&scene.model, kt, state, 1).unwrap();
        let fluid = Evaluator::new(scene.model.at(kt).unwrap()).unwrap();
        Shown { simulation, fluid, meter: scene.observe.requests[0].meter.clone() }
    }

    /// Takes a sample of the particles after `change` has edited their view.
    fn sample<'a>(&'a mut self, change: impl FnOnce(View<'a>) -> View<'a>) {
        let view = change(self.simulation.view(0.0));
        assert!(self.meter.sample(&Frame::new(view, &self.fluid)));
    }

    fn finish(&self) -> Vec<Observation> {
        self.meter.finish()
    }
}

fn value(observation: &Observation, column: &str) -> f64 {
    observation.get(column).unwrap().values[0]
}

/// Two pairs of soft spheres: one at distance r along the normal, one out of range. The energy `U = a (1 −
/// r)²/2` of the first changes to that at r/(1 ± ε), and the tension is −kT ln of the ratio of the mean
/// Boltzmann factors over 2 m ε A.
#[test]
fn the_tension_by_free_energy_knows_temperature_and_interfaces() {
    let (kt, change, r, area) = (2.0, 0.1, 0.5, 16.0);
    let energy = |r: f64| 12.5 * (1.0 - r).powi(2);
    let mean = |e: f64| 0.5 * (1.0 + (-(energy(r / (1.0 + e)) - energy(r)) / kt).exp());
    for interfaces in [1.0, 2.0] {
        let observe = format!("surface_tension = {{ interfaces = {interfaces}, perturbation = {change} }}");
        let (near, far) = ([[1.0, 1.0, 2.0], [1.0, 1.0, 2.5]], [[1.0, 1.0, 2.0], [1.0, 1.0, 4.0]]);
        let mut shown = Shown::new(SOFT, kt, &[4.0, 4.0, 6.0], &near, &observe);
        let flux = Flux::default();
        for x in [&near, &far] {
            let view = View { x, flux: Some(&flux), ..shown.simulation.view(0.0) };
            let view = View { conservative_pressure: [1.0, 2.0, 5.0, 0.0, 0.0, 0.0], ..view };
            assert!(shown.meter.sample(&Frame::new(view, &shown.fluid)));
        }
        let out = shown.finish();
        let expected = -kt * (mean(change) / mean(-change)).ln() / (2.0 * interfaces * change * area);
        let found = value(&out[0], "free_energy");
        assert!((found - expected).abs() < 1e-10, "{interfaces}: {found} {expected}");
        // Half the difference of the two samples, in which the tension is linear: a weight of 1 in the second.
        let share = |e: f64, weight: f64| (weight - 1.0) / mean(e);
        let weight = |e: f64| 2.0 * mean(e) - 1.0;
        let apart = share(change, weight(change)) - share(-change, weight(-change));
        let error = 0.5 * kt * apart.abs() / (2.0 * interfaces * change * area);
        let found = out[0].get("free_energy").unwrap().errors[0];
        assert!((found / error - 1.0).abs() < 1e-9 && error > 0.0, "{interfaces}: {found} {error}");
        let stress = value(&out[0], "stress_conservative");
        assert!((stress - 6.0 / interfaces * (5.0 - 1.5)).abs() < 1e-12, "{stress}");
    }
}

/// Of a small perturbation few samples are stretched, whose tension and error are those of all. Of a large one all are.
#[test]
fn few_stretched_samples_have_the_tension_of_all() {
    for (change, bound) in [(1e-4, 1e-4), (0.02, 1e-12)] {
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 0.7\nseed = 4\nbox = [4.0, 4.0, 9.0]\ndt = 0.01\nsteps = 10\n[initial]\n\
             kind = \"slab\"\nthickness = 4.0\ndensity = 6.0\n[observe]\nsurface_tension = {{ perturbation = {change} }}\n"
        );
        let scene = support::scene(SET6, &text).unwrap();
        let kt = 0.7;
        let mut run = Simulation::new(&scene.model, kt, scene.initial_state(), 4).unwrap();
        run.prepare(0.01, Want::FORCES).unwrap();
        run.advance(300, 0.01, Integrator::VelocityVerlet).unwrap();
        run.record_flux(Recorded::Sum);
        let fluid = Evaluator::new(scene.model.at(kt).unwrap()).unwrap();
        let mut meter = scene.observe.requests[0].meter.clone();
        let mut weights = Vec::new();
        for _ in 0..64 {
            run.advance(4, 0.01, Integrator::VelocityVerlet).unwrap();
            run.step(0.01, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
            let frame = Frame::new(run.view(0.0), &fluid);
            assert!(meter.sample(&frame));
            let energy = frame.evaluation().energy;
            let weight = |change: f64| ((energy - stretched_energy(&frame, 2, change)) / kt).exp();
            weights.push([change, -change].map(weight));
        }
        let mean = |c: usize| weights.iter().map(|w| w[c]).sum::<f64>() / 64.0;
        let area = 2.0 * 2.0 * change * 16.0;
        let value = -kt * (mean(0) / mean(1)).ln() / area;
        let rows: Vec<f64> = weights.iter().map(|w| -kt * (w[0] / mean(0) - w[1] / mean(1)) / area).collect();
        let error = Measured::mean(&rows).error;
        let out = meter.finish();
        let found = out[0].scalar("free_energy").unwrap();
        assert!((found.value / value - 1.0).abs() < bound, "{change}: {found:?} {value} {error}");
        assert!((found.error / error - 1.0).abs() < 10.0 * bound, "{change}: {found:?} {value} {error}");
    }
}

/// The drag of one pair.
fn drag(line: Line) -> Vec<Arc<Drag>> {
    let Line { d, f, .. } = line;
    let sum = COMPONENTS.map(|(a, b)| 0.5 * (d[a] * f[b] + d[b] * f[a]));
    vec![Arc::new(Drag { sum, friction: vec![line], ..Drag::default() })]
}

/// One direction lies along the interface in a plane, two directions in space; P_T is their mean.
#[test]
fn the_tangential_pressure_is_the_mean_of_the_other_directions() {
    let flux = Flux {
        ways: vec![Line { from: [1.0, 1.0, 0.0], d: [0.3, 0.0, 0.0], f: [0.6, 0.0, 0.0] }],
        drag: drag(Line { from: [1.0, 2.0, 0.0], d: [0.0, 0.4, 0.0], f: [0.0, 1.2, 0.0] }),
        ..Flux::default()
    };
    let cases: [(&str, &[f64], f64); 2] = [(FLAT, &[4.0, 5.0], 1.0), (IDEAL, &[4.0, 5.0, 6.0], 2.0)];
    for (model, lengths, others) in cases {
        let mut shown = Shown::new(
            model,
            1.0,
            lengths,
            &[[1.0, 1.0, 0.0]],
            "stress_profile = { axis = \"y\", bins = 10 }",
        );
        shown.sample(|view| View { flux: Some(&flux), ..view });
        let out = shown.finish();
        let mean = |column: &str| out[0].get(column).unwrap().values.iter().sum::<f64>() / 10.0;
        let volume: f64 = lengths.iter().product();
        assert!((mean("tangential") - 2.0 * 0.09 / others / volume).abs() < 1e-14, "{others}");
        assert!((mean("normal") - 3.0 * 0.16 / volume).abs() < 1e-14, "{others}");
        // From the middle of one bin to the middle of the next the integral grows by half of each bin; a bin is 0.5 high.
        let (integral, difference) =
            (&out[0].get("integral").unwrap().values, &out[0].get("difference").unwrap().values);
        assert!(difference.iter().any(|p| *p != 0.0));
        for k in 1..10 {
            let expected = 0.25 * (difference[k - 1] + difference[k]);
            assert!((integral[k] - integral[k - 1] - expected).abs() < 1e-14, "{others}: {integral:?}");
        }
    }
}

/// Three particles of two species, all within one shell of volume s. Each of the N_A (N_A − 1)/2 pairs of
/// equals and of the N_A N_B pairs of unlike particles counts V/s.
#[test]
fn correlations_of_few_particles_count_pairs_and_not_squares() {
    let x = [[1.0, 1.0, 1.0], [1.5, 1.0, 1.0], [1.0, 1.6, 1.0]];
    let mut shown = Shown::new(IDEAL_MIXTURE, 1.0, &[4.0, 4.0, 5.0], &x, "rdf = { range = 1.0, bins = 1 }");
    shown.sample(|view| View { species: &[0, 0, 1], ..view });
    let out = shown.finish();
    let expected = 80.0 / (4.0 / 3.0 * PI);
    for (column, share) in [("g", 1.0), ("g_A_A", 1.0), ("g_A_B", 1.0), ("g_B_B", 0.0)] {
        let found = value(&out[0], column);
        assert!((found / expected - share).abs() < 1e-12, "{column}: {found} {expected}");
    }
    // Waves of half a turn and of one turn between the two particles of species A give |1 ± 1|²/2.
    let x = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let observe =
        format!("structure_factor = {{ range = {:?}, bins = 1, vectors = 1 }}", 2.0 * PI / 4.0 + 1e-9);
    let mut shown = Shown::new(IDEAL_MIXTURE, 1.0, &[4.0, 3.0, 3.0], &x, &observe);
    shown.sample(|view| view);
    assert!(value(&shown.finish()[0], "s").abs() < 1e-12);
    shown.sample(|view| View { x: &[[0.0; 3], [4.0, 0.0, 0.0]], ..view });
    assert!((value(&shown.finish()[0], "s") - 1.0).abs() < 1e-12);
    // Two particles of A and one of B at one point: S = N, S_AA = N_A, S_BB = N_B and S_AB = √(N_A N_B).
    let mut shown = Shown::new(IDEAL_MIXTURE, 1.0, &[4.0, 3.0, 3.0], &[[0.0; 3]; 3], &observe);
    shown.sample(|view| View { species: &[0, 0, 1], ..view });
    let out = shown.finish();
    for (column, expected) in [("s", 3.0), ("s_A_A", 2.0), ("s_A_B", 2f64.sqrt()), ("s_B_B", 1.0)] {
        assert!((value(&out[0], column) - expected).abs() < 1e-12, "{column}: {out:?}");
    }
}

/// A slab of layers, of a density of 50 beside one of 6.25, is 6 thick.
#[test]
fn a_slab_is_as_thick_as_it_is() {
    let at =
        |z: f64, count: usize| (0..count).map(move |k| [0.25 * (k % 8) as f64, 0.25 * (k / 8) as f64, z]);
    let layers = (0..60).map(|k| 0.2 * f64::from(k) + 0.1);
    let x: Vec<[f64; 3]> = layers.flat_map(|z| at(z, if (3.0..9.0).contains(&z) { 40 } else { 5 })).collect();
    let mut shown = Shown::new(IDEAL, 1.0, &[2.0, 2.0, 12.0], &x, "interface_width = { bins = 60 }");
    (0..10).for_each(|_| shown.sample(|view| view));
    let out = shown.finish();
    assert!((value(&out[0], "thickness") - 6.0).abs() < 0.1, "{out:?}");
    assert!(
        (value(&out[0], "liquid") - 50.0).abs() < 0.5 && (value(&out[0], "vapour") - 6.25).abs() < 0.1,
        "{out:?}"
    );
}

/// Masses of 1 and 3 in turns that flow with one parabola: the fluid has their mean density of mass, 2 ρ, and the viscosity that the
/// parabola has with it.
#[test]
fn the_viscosity_of_a_flow_knows_masses() {
    let x: Vec<[f64; 3]> = (0..480).map(|k| [0.5, 0.5, 0.0125 * (k as f64 + 0.5)]).collect();
    let observe = "poiseuille = { axis = \"z\", flow = \"x\", acceleration = 0.1, bins = 60 }";
    let mut shown = Shown::new(IDEAL_MIXTURE, 1.0, &[4.0, 2.0, 6.0], &x, observe);
    // z (3 − z) in the lower half, and against it in the upper.
    let along = |z: f64| if z < 3.0 { z * (3.0 - z) } else { -(z - 3.0) * (6.0 - z) };
    let v: Vec<[f64; 3]> = x.iter().map(|x| [0.2 * along(x[2]), 1.0, -1.0]).collect();
    let species: Vec<i32> = (0..480).map(|k| k % 2).collect();
    for _ in 0..10 {
        shown.sample(|view| View { v: &v, species: &species, masses: &[1.0, 3.0], ..view });
    }
    let out = shown.finish();
    // ρ a/(2 · 0.2), with 480 particles of mass 2 in 48.
    let expected = 20.0 * 0.1 / 0.4;
    assert!((value(&out[0], "viscosity") / expected - 1.0).abs() < 0.01, "{out:?}");
    assert!(value(&out[0], "deviation") < 0.01, "{out:?}");
}

/// One particle of A with one of two of B within the range of a density of neither: around the one of A there is w, around those of B
/// w and nothing.
#[test]
fn local_densities_are_those_of_one_species_at_another() {
    let model = "title = \"t\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
                 [excess_free_energy]\nA = \"(n_A + n_B)^2\"\nB = \"(n_A + n_B)^2\"\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";
    let x = [[1.0, 1.0, 1.0], [1.4, 1.0, 1.0], [3.5, 3.5, 3.5]];
    let mut shown = Shown::new(model, 1.0, &[5.0; 3], &x, "local_density = true");
    shown.sample(|view| View { species: &[0, 1, 1], ..view });
    let means = &shown.finish()[1];
    let w = 15.0 / (2.0 * PI) * 0.36;
    for (column, expected) in [("mean_A_B", w), ("mean_B_A", 0.5 * w), ("mean_A_A", 0.0), ("mean_B_B", 0.0)] {
        assert!((value(means, column) - expected).abs() < 1e-12, "{column}: {means:?}");
    }
    // Of the mean density of the others in the box.
    assert!((value(means, "relative_A_B") - w * 125.0 / 2.0).abs() < 1e-9, "{means:?}");
    assert!((value(means, "relative_B_A") - 0.5 * w * 125.0).abs() < 1e-9, "{means:?}");
}

/// A particle that went round the box along its second edge is displaced by that edge, tilt included.
#[test]
fn a_displacement_round_a_tilted_box_is_its_edge() {
    let mut shown =
        Shown::new(IDEAL, 1.0, &[5.0, 6.0, 7.0], &[[1.0, 1.0, 1.0]], "msd = { length = 2, spacing = 5 }");
    let edges = Matrix3::new(5.0, 1.5, -0.5, 0.0, 6.0, 2.0, 0.0, 0.0, 7.0);
    let domain = PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap();
    for images in [&[[0, 0, 0]], &[[0, 1, 0]], &[[2, 0, 1]]] {
        let view = View { domain: &domain, images, ..shown.simulation.view(0.0) };
        assert!(shown.meter.sample(&Frame::new(view, &shown.fluid)));
    }
    let found = &shown.finish()[0].get("msd").unwrap().values.clone();
    assert_eq!(found, &[1.5 * 1.5 + 36.0, 9.5 * 9.5 + 4.0 + 49.0]);
    // From 4.5 across the face to 0.5 of the next box is a way of 1.
    let mut shown =
        Shown::new(IDEAL, 1.0, &[5.0; 3], &[[4.5, 1.0, 1.0]], "msd = { length = 2, spacing = 5 }");
    shown.sample(|view| view);
    shown.sample(|view| View { x: &[[0.5, 1.0, 1.0]], images: &[[1, 0, 0]], ..view });
    assert_eq!(shown.finish()[0].get("msd").unwrap().values, [1.0]);
}

/// Mean square displacements of 1, 2, 3, 4 at intervals of half a time unit: D is their slope 2 over 2d.
#[test]
fn diffusion_knows_how_many_directions_there_are() {
    let cases: [(&str, &[f64], f64); 2] = [(FLAT, &[6.0, 6.0], 2.0), (IDEAL, &[6.0, 6.0, 6.0], 3.0)];
    for (model, lengths, d) in cases {
        let mut shown = Shown::new(model, 1.0, lengths, &[[0.0; 3]], "msd = { length = 4, spacing = 100 }");
        for k in 0..5 {
            let x = [[f64::from(k).sqrt(), 0.0, 0.0]];
            let view = View { x: &x, time: 0.5 * f64::from(k), ..shown.simulation.view(0.0) };
            assert!(shown.meter.sample(&Frame::new(view, &shown.fluid)));
        }
        let found = value(&shown.finish()[1], "diffusion");
        assert!((found - 2.0 / (2.0 * d)).abs() < 1e-12, "{d}: {found}");
    }
}

/// Soft spheres in a row, the middle one frozen: `F = a (1 − r)` and `∇²U = a − 2a (1 − r)/r` of the end particles alone.
#[test]
fn the_configurational_temperature_leaves_frozen_particles_out() {
    let x = [[1.0, 2.0, 2.0], [1.8, 2.0, 2.0], [2.7, 2.0, 2.0]];
    let mut shown = Shown::new(SOFT, 1.0, &[4.0; 3], &x, "temperature = true");
    shown.sample(|view| View { frozen: &[false, true, false], ..view });
    let square = |r: f64| (25.0 * (1.0 - r)).powi(2);
    let laplacian = |r: f64| 25.0 - 50.0 * (1.0 - r) / r;
    let expected = (square(0.8) + square(0.9)) / (laplacian(0.8) + laplacian(0.9));
    let found = value(&shown.finish()[0], "configurational");
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

/// Pairs a hundredth closer than the distance are of one cluster, pairs a hundredth farther are not.
#[test]
fn clusters_have_the_distance_that_they_are_given() {
    let x = [[1.0, 1.0, 1.0], [1.792, 1.0, 1.0], [3.0, 3.0, 3.0], [3.0, 3.808, 3.0]];
    let mut shown = Shown::new(IDEAL, 1.0, &[6.0; 3], &x, "clusters = { distance = 0.8 }");
    shown.sample(|view| view);
    let out = shown.finish();
    assert_eq!((value(&out[0], "count"), value(&out[0], "largest")), (3.0, 2.0));
    assert_eq!(value(&out[0], "mean_size"), 4.0 / 3.0);
}

/// The liquid density of a slab is the density of its plateau, which is the middle of the profile up to 2.1 from its centre. Both
/// values share the samples of the middle: over ten seeds they differ by 1.8 of the error at most. Three are exceeded by chance once
/// in 400 seeds. The tanh fit includes the interfaces and deviates more. The seed is fixed.
#[test]
fn the_density_of_a_slab_is_that_of_its_middle() {
    let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 5\nbox = [6.0, 6.0, 14.0]\ndt = 0.01\nequilibrate = 500\n\
                steps = 20000\n[initial]\nkind = \"slab\"\nthickness = 8.0\ndensity = 6.05\n[observe]\nevery = 10\n\
                interface_width = true\ndensity_profile = true\n";
    let (_, all) = super::run(&support::scene(SET6, text).unwrap());
    let out = super::find(&all, "interface_width");
    let liquid = out.scalar("liquid").unwrap();
    let profile = super::find(&all, "density_profile");
    let z = &profile.x.as_ref().unwrap().values;
    let density = &profile.get("density").unwrap().values;
    let middle: Vec<f64> =
        z.iter().zip(density).filter(|(z, _)| z.abs() < 2.0).map(|(_, rho)| *rho).collect();
    let middle = middle.iter().sum::<f64>() / middle.len() as f64;
    assert!((liquid.value - middle).abs() < 3.0 * liquid.error, "{liquid:?} {middle}");
    assert!(liquid.error < 0.003 && out.note.is_empty(), "{liquid:?} {}", out.note);
    let shape: Vec<(f64, f64)> = z.iter().copied().zip(density.iter().copied()).collect();
    let fit = psidpd_observe::profile::interface(&shape).unwrap();
    assert!(fit.liquid - middle > 4.0 * liquid.error, "{fit:?} {middle} {liquid:?}");
}

/// The configurational pressure of a pair of soft spheres is NkT/V + r F/(3V), whatever their velocities. A frozen particle out
/// of their range does not count in N.
#[test]
fn the_pressure_of_configurations_leaves_velocities_out() {
    let x = [[1.0, 2.0, 2.0], [1.8, 2.0, 2.0], [1.0, 2.0, 4.5]];
    let mut shown = Shown::new(SOFT, 1.5, &[4.0, 4.0, 5.0], &x, "pressure = true");
    let flux = Flux::default();
    // `½ Σ m v² = 7` adds 14/V to the trace, and the virial is r F = 0.8 · 25 · 0.2.
    let part = (14.0 / 3.0 + 4.0 / 3.0) / 80.0;
    let conservative = [part, part, part, 0.0, 0.0, 0.0];
    shown.sample(|view| View {
        flux: Some(&flux),
        kinetic_energy: 7.0,
        pressure: [9.0; 6],
        conservative_pressure: conservative,
        frozen: &[false, false, true],
        ..view
    });
    let found = value(&shown.finish()[0], "configurational");
    assert!((found - (2.0 * 1.5 + 4.0 / 3.0) / 80.0).abs() < 1e-12, "{found}");
}

/// Particles of masses 1 and 3 with velocities (2, 0, 0) and (−1, 1, 0) have the momentum (−1, 3, 0) and Σ m v² = 10. The flow
/// has 10/4 of that sum, and the rest is dNkT, in the plane and in space. A frozen particle counts in neither, whatever its velocity.
#[test]
fn flow_and_temperature_know_masses_and_frozen_particles() {
    let v = [[2.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [7.0, 7.0, 7.0]];
    let show = |dimensions: usize, observe: &str| {
        let model = IDEAL_MIXTURE.replace("species", &format!("dimensions = {dimensions}\nspecies"));
        let x = [[1.0, 1.0, if dimensions == 2 { 0.0 } else { 1.0 }]; 3];
        let mut shown = Shown::new(&model, 0.7, &[4.0; 3][..dimensions], &x, observe);
        for _ in 0..3 {
            shown.sample(|view| View {
                v: &v,
                species: &[0, 1, 1],
                masses: &[1.0, 3.0],
                frozen: &[false, false, true],
                ..view
            });
        }
        shown.finish()
    };
    let flow = show(3, "velocity_profile = { bins = 1 }").remove(0);
    for (column, expected) in [("velocity_x", -0.25), ("velocity_y", 0.75), ("velocity_z", 0.0)] {
        assert!((value(&flow, column) - expected).abs() < 1e-14, "{flow:?}");
    }
    for dimensions in [2, 3] {
        let expected = 7.5 / (2.0 * dimensions as f64);
        let found = show(dimensions, "temperature_profile = { bins = 1 }");
        assert!((value(&found[0], "temperature") - expected).abs() < 1e-14, "{found:?}");
        assert!((found[1].scalar("mean").unwrap().value - expected).abs() < 1e-14, "{found:?}");
    }
}

/// The trace of the pressure tensor times the volume, summed over all shells around a drop, is r·F of the one force there is.
#[test]
fn the_pressures_around_a_drop_have_the_trace_of_the_force() {
    let flux = Flux {
        drag: drag(Line { from: [3.0, 3.5, 3.0], d: [0.5, 0.0, 0.0], f: [2.0, 0.0, 0.0] }),
        ..Flux::default()
    };
    let cases: [(&str, &[f64], f64); 2] = [(FLAT, &[6.0; 2], 1.0), (IDEAL, &[6.0; 3], 2.0)];
    for (model, lengths, others) in cases {
        let volume = |r: f64| if others == 1.0 { PI * r * r } else { 4.0 / 3.0 * PI * r.powi(3) };
        let observe = "drop = { distance = 0.5, range = 3.0, bins = 30 }";
        let z = if others == 1.0 { 0.0 } else { 3.0 };
        let mut shown = Shown::new(model, 1.0, lengths, &[[3.0, 3.0, z]], observe);
        shown.sample(|view| View { flux: Some(&flux), ..view });
        let profile = &shown.finish()[1];
        let (normal, tangential) = (profile.get("normal").unwrap(), profile.get("tangential").unwrap());
        let trace: f64 = (0..30)
            .map(|k| {
                let shell = volume(0.1 * (k + 1) as f64) - volume(0.1 * k as f64);
                shell * (normal.values[k] + others * tangential.values[k])
            })
            .sum();
        assert!((trace - 1.0).abs() < 1e-10, "{others}: {trace}");
    }
}

/// The blocks whose scatter gives the error of one configuration are one and a half ranges wide; together they have every particle.
#[test]
fn blocks_of_a_configuration_are_wider_than_the_forces() {
    let x: Vec<[f64; 3]> =
        (0..1000).map(|k| [k % 10, k / 10 % 10, k / 100].map(|c| 0.6 * f64::from(c) + 0.1)).collect();
    let shown = Shown::new(SOFT, 1.0, &[6.0; 3], &x, "temperature = true");
    let frame = Frame::new(shown.simulation.view(0.0), &shown.fluid);
    let blocks = psidpd_observe::configurational::sums_of_blocks(&frame);
    assert_eq!(blocks.len(), 64);
    let all = psidpd_observe::configurational::sums(&frame);
    for c in 0..2 {
        let sum: f64 = blocks.iter().map(|block| block[c]).sum();
        assert!((sum - all[c]).abs() < 1e-9 * (1.0 + all[c].abs()), "{blocks:?}");
    }
}

/// The surface of a wall is where its frozen particles end, those of the other wall apart. The foot of the drop, which the wall
/// draws out, is below the fitted points. A sphere of radius 2.5 whose middle is 1 above the surface meets it at 114 degrees.
#[test]
fn the_angle_of_a_drop_above_its_foot() {
    let frozen = [[1.0, 1.0, 0.2], [3.0, 1.0, 0.9], [5.0, 1.0, 7.4], [2.0, 6.0, 0.5]];
    let place = |k: i32| [k % 40, k / 40 % 40, k / 1600].map(|c| 0.2 * f64::from(c) + 0.1);
    let away = |x: &[f64; 3]| (x[0] - 4.0).hypot(x[1] - 4.0);
    let is_liquid =
        |x: &[f64; 3]| x[2] > 0.9 && (away(x).hypot(x[2] - 1.9) < 2.5 || x[2] < 1.4 && away(x) < 3.4);
    let mut x = frozen.to_vec();
    x.extend((0..64_000).map(place).filter(is_liquid));
    let observe = "contact_angle = { above = 0.6, distance = 0.5, bins = [16, 32] }";
    let mut shown = Shown::new(IDEAL, 1.0, &[8.0; 3], &x, observe);
    let flags: Vec<bool> = (0..x.len()).map(|k| k < frozen.len()).collect();
    for _ in 0..2 {
        shown.sample(|view| View { frozen: &flags, ..view });
    }
    let out = shown.finish();
    assert!(out[0].note.contains("surface is 0.9000"), "{}", out[0].note);
    let (angle, expected) = (value(&out[0], "angle"), (-0.4f64).acos().to_degrees());
    assert!(
        (angle - expected).abs() < 3.0 && (value(&out[0], "radius") - 2.5).abs() < 0.08,
        "{angle} {expected}"
    );
}

/// Heights of a hanging drop are those in its box, which need not begin at 0.
#[test]
fn a_hanging_drop_is_where_its_box_is() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), IDEAL).unwrap();
    let x = [[3.1, 3.2, -4.2], [3.3, 3.0, -4.0], [3.0, 3.1, -3.8]];
    let atoms: String =
        x.iter().zip(1..).map(|(x, k)| format!("{k} 1 {} {} {}\n", x[0], x[1], x[2])).collect();
    let data = format!(
        "three\n\n3 atoms\n1 atom types\n\n0 6 xlo xhi\n0 6 ylo yhi\n-5 3 zlo zhi\n\nMasses\n\n1 1.0\n\nAtoms # atomic\n\n{atoms}"
    );
    std::fs::write(folder.path().join("three.data"), data).unwrap();
    let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 1\ndt = 0.01\nsteps = 10\n[initial]\nkind = \"data\"\n\
                file = \"three.data\"\n[observe]\npendant = { bins = [6, 16], distance = 1.0 }\n";
    let scene = Scene::parse("s.toml", text, folder.path()).unwrap();
    let simulation = scene.simulation(scene.initial_state()).unwrap();
    let fluid = Evaluator::new(scene.model.at(1.0).unwrap()).unwrap();
    let mut meter = scene.observe.requests[0].meter.clone();
    assert!(meter.sample(&Frame::new(simulation.view(0.0), &fluid)));
    let all = meter.finish();
    let field = all.iter().find(|o| o.name == "pendant_field").unwrap();
    let (z, density) = (field.get("z").unwrap(), field.get("density").unwrap());
    let filled = z.values.iter().zip(&density.values).filter(|(_, n)| **n > 0.0);
    let heights: Vec<f64> = filled.map(|(z, _)| *z).collect();
    assert!(!heights.is_empty() && heights.iter().all(|z| (-4.5..-3.5).contains(z)), "{heights:?}");
}

/// Lines of a profile are moved with the particles: a line where all particles are is in the middle slice, wherever that is in the box.
#[test]
fn lines_are_centred_with_the_particles() {
    for z in [4.5, 0.3, 5.95] {
        let at = |z: f64| [1.0, 1.0, z.rem_euclid(6.0)];
        let x = [at(z - 0.2), at(z), at(z + 0.2)];
        let flux = Flux {
            ways: vec![Line { from: at(z + 0.05), d: [0.0, 0.0, 0.1], f: [0.0, 0.0, 2.0] }],
            ..Flux::default()
        };
        let observe = "stress_profile = { axis = \"z\", bins = 5, recentre = true }";
        let mut shown = Shown::new(IDEAL, 1.0, &[4.0, 4.0, 6.0], &x, observe);
        shown.sample(|view| View { flux: Some(&flux), ..view });
        let normal = &shown.finish()[0].get("normal").unwrap().values.clone();
        let expected = 0.2 / (4.0 * 4.0 * 1.2);
        assert!(
            (normal[2] - expected).abs() < 1e-14 && normal.iter().sum::<f64>() == normal[2],
            "{z}: {normal:?}"
        );
    }
}

/// Shells of a drop lie about its centre of mass, which is not the circular mean of a drop that is longer to one side; also where it
/// crosses faces of the box.
#[test]
fn shells_lie_about_the_centre_of_mass() {
    let row = [0.0, 0.0, 0.0, 0.0, 0.0, 0.9, 1.8, 2.7];
    let centre = row.iter().sum::<f64>() / 8.0;
    for low in [2.0, -0.4, 6.9] {
        let at = |x: f64| [(low + x).rem_euclid(8.0), 3.0, 5.0];
        let x = row.map(at);
        let flux = Flux {
            drag: drag(Line { from: at(centre + 1.57), d: [0.04, 0.0, 0.0], f: [3.0, 0.0, 0.0] }),
            ..Flux::default()
        };
        let observe = "drop = { distance = 1.0, range = 3.0, bins = 30 }";
        let mut shown = Shown::new(IDEAL, 1.0, &[8.0, 8.0, 8.0], &x, observe);
        shown.sample(|view| View { flux: Some(&flux), ..view });
        let out = shown.finish();
        let normal = &out.iter().find(|o| o.name == "drop_profile").unwrap().get("normal").unwrap().values;
        let volume = 4.0 / 3.0 * PI * (1.6f64.powi(3) - 1.5f64.powi(3));
        assert!((normal[15] * volume - 0.12).abs() < 1e-12, "{low}: {normal:?}");
        assert!(normal.iter().enumerate().all(|(k, p)| k == 15 || *p == 0.0), "{low}: {normal:?}");
    }
}
