//! Walls as a half-space of matter.

use super::matter::{
    STAGE, assert_same_bytes, assert_slices_add_up, assert_temperatures, balanced, deviation, named,
    observed, rough,
};
use super::*;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{PeriodicBox, faces};
use psidpd_core::model::wall::{SURPLUS, Surface};
use psidpd_observe::Recorded;
use psidpd_observe::frame::{Frame, View};

const BOX: &str =
    "[box]\nlengths = [3.0, 3.0, 5.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n";

/// Set 6 between a wall at rest and one that moves.
fn between(rest: &str) -> Scene {
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 6.05\n{BOX}\
         [[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\"]\nlocal_density = 2.3\nviscosity = 7.8\n\
         [[wall]]\nkind = \"continuum\"\nfaces = [\"zhi\"]\ndensity = 5.0\nlocal_density = 2.3\nvelocity = [0.5, -0.2, 0.0]\n{rest}"
    );
    support::scene(SET6, &text).unwrap()
}

/// A simulation of it that has settled.
fn settled(scene: &Scene) -> Simulation {
    let mut run = scene.simulation(scene.initial_state()).unwrap();
    advance(&mut run, 400, 0.01, Integrator::VelocityVerlet);
    run
}

/// The deviations of the energy, with the forces of walls in it, fall with Δt² where drag and noise are off.
#[test]
fn energy_between_walls_is_conserved_to_second_order() {
    let scene = between(STAGE);
    let mut run = settled(&scene);
    let starts: Vec<State> = (0..4)
        .map(|_| {
            advance(&mut run, 50, 0.01, Integrator::VelocityVerlet);
            run.state().clone()
        })
        .collect();
    let of = |dt: f64| deviation(&scene, &starts, Integrator::VelocityVerlet, [dt, 0.4]);
    let [coarse, fine] = [0.01, 0.00125].map(of);
    assert!(coarse < 3e-3 && fine < coarse / 25.0, "{coarse} {fine}");
}

/// In a gas whose only drag is that of a wall, one action takes velocities of zero to the covariance `kT/m (1 − exp(−2ζΔt/m))`, along the
/// face and across it, around the velocity of the wall's part in it. Variances of 4000 particles at one height are known to 2.2 %,
/// covariances to 1.6 %: five standard errors are exceeded by one of 45 numbers less than once in 30 000 seeds.
#[test]
fn noise_of_a_wall_has_the_covariance_of_its_friction() {
    let (kt, dt, mass) = (0.7, 0.3, 1.7);
    let wall = rough(Surface::Face { axis: 2, high: true }, [0.4, 0.0, 0.0]);
    let text = "title = \"g\"\nspecies = [\"A\"]\n";
    let model = Model::parse("m.toml", text).unwrap().with_walls(vec![wall]);
    let domain = PeriodicBox::orthogonal([0.0; 3], [4.0, 4.0, 6.0], [true, true, false]).unwrap();
    for height in [0.0, 0.3, 0.7] {
        let x = (0..4000).map(|k| [f64::from(k) * 0.001, 1.0, 6.0 - height]).collect();
        let state = State::at_rest(domain.clone(), vec![mass], x);
        let mut run = Simulation::new(&model, kt, state, 3).unwrap();
        run.prepare_for(Integrator::VelocityVerlet, dt, Want::FORCES).unwrap();
        run.step(dt, Integrator::VelocityVerlet, Want::FORCES).unwrap();
        let walls = run.engine().plan().walls();
        let [along, across, _] = walls[0].fields[0].friction.as_ref().unwrap().at(height);
        let v = &run.state().v;
        let mean = |f: &dyn Fn(&[f64; 3]) -> f64| v.iter().map(f).sum::<f64>() / v.len() as f64;
        let zeta = [along, along, across];
        let variance = zeta.map(|zeta| kt / mass * (1.0 - (-2.0 * zeta * dt / mass).exp()));
        let drift = 0.4 * (1.0 - (-along * dt / mass).exp());
        for a in 0..3 {
            let center = |v: &[f64; 3], c: usize| v[c] - if c == 0 { drift } else { 0.0 };
            let off = mean(&|v| center(v, a)) / (variance[a] / 4000.0).sqrt();
            assert!(off.abs() < 5.0, "{height}: mean {a} off by {off}");
            for b in 0..=a {
                let expected = if a == b { variance[a] } else { 0.0 };
                let error =
                    if a == b { 2f64.sqrt() } else { 1.0 } * (variance[a] * variance[b] / 4000.0).sqrt();
                let found = mean(&|v| center(v, a) * center(v, b));
                assert!((found - expected).abs() < 5.0 * error, "{height} {a}{b}: {found} {expected}");
            }
        }
    }
}

/// Beside walls an ideal gas has the temperature of its stage, however strong the drag, with every integrator whose thermostat is exact.
#[test]
fn a_gas_beside_walls_has_its_temperature() {
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 4.0\nsteps = 1\n{BOX}\
         [[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\", \"zhi\"]\ndrag = 200.0\n"
    );
    let scene = support::scene(IDEAL, &text).unwrap();
    for name in ["peters", "shardlow-s1", "aboba", "baoab", "two-stage", "force-gradient"] {
        assert_temperatures(&scene, name, |x| x[2] < 0.5 || x[2] > 4.5, 0.02);
    }
}

#[test]
fn walls_take_the_momentum_that_the_fluid_loses() {
    let scene = between(STAGE);
    let start = settled(&scene).state().clone();
    for (name, _) in Integrator::ALL.iter().filter(|(_, integrator)| integrator.has_time()) {
        let (given, _) = balanced(&scene, &start, name, 200);
        assert!(given.iter().any(|p| p.abs() > 1.0), "{name}: {given:?}");
    }
}

/// A particle of the heavier species, so slow that it stays and so cold that there is no noise, loses `m v (1 − exp(−ζΔt/m))` of its momentum
/// in each step. The virial of that force along the line to the face is in the pressure and in the recorded drag, and the wall has
/// taken the momentum.
#[test]
fn friction_of_a_wall_is_in_the_pressure() {
    let (mass, dt, z) = (3.0, 0.3, 0.2);
    for high in [false, true] {
        let wall = rough(Surface::Face { axis: 1, high }, [0.0; 3]);
        let text = "title = \"g\"\nspecies = [\"A\", \"B\"]\n";
        let model = Model::parse("m.toml", text).unwrap().with_walls(vec![wall]);
        let y = if high { 7.0 - z } else { 2.0 + z };
        let start = [3e-15, -1e-15, 2e-15];
        let state = State {
            domain: PeriodicBox::orthogonal([0.0, 2.0, 0.0], [4.0, 5.0, 6.0], [true, false, true]).unwrap(),
            mass: vec![1.0, mass],
            x: vec![[1.0, y, 1.0]],
            v: vec![start],
            species: vec![1],
            tag: vec![1],
            image: vec![[0; 3]],
        };
        for name in ["velocity-verlet", "baoab", "aboba", "force-gradient"] {
            let integrator = named(name);
            let mut run = Simulation::new(&model, 1e-60, state.clone(), 7).unwrap();
            run.record_flux(Recorded::Lines);
            run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
            let friction = run.engine().plan().walls()[0].fields[1].friction.clone().unwrap();
            let [along, across, _] = friction.at(z);
            let zeta = [along, across, along];
            for step in 0..3 {
                run.step(dt, integrator, Want::TOTALS).unwrap();
                let force: [f64; 3] = std::array::from_fn(|c| {
                    let before = start[c] * (-zeta[c] * dt / mass * f64::from(step)).exp();
                    -mass * before * (1.0 - (-zeta[c] * dt / mass).exp()) / dt
                });
                let d = [0.0, if high { -z } else { z }, 0.0];
                let (total, rest) = (run.pressure_tensor(), run.conservative_pressure_tensor());
                let flux = run.flux().unwrap();
                let drag = psidpd_observe::flux::Flux { drag: flux.drag.clone(), ..Default::default() }.sum();
                for (c, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                    let expected = 0.5 * (d[a] * force[b] + d[b] * force[a]);
                    for found in [120.0 * (total[c] - rest[c]), drag[c]] {
                        assert!((found - expected).abs() < 1e-8 * 1e-15, "{name} {c}: {found} {expected}");
                    }
                }
                for (found, force) in flux.on_walls(1)[0].into_iter().zip(force) {
                    assert!((found + force).abs() < 1e-8 * 1e-15, "{name}: {found} {force}");
                }
            }
        }
    }
}

/// Soft particles of two species, between walls of the second that move.
const PAIRS: &str = "title = \"p\"\nspecies = [\"A\", \"B\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 15\n\
     range = 1\n[[pair]]\nbetween = [\"A\", \"B\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n[[pair]]\nbetween = [\"B\", \"B\"]\n\
     form = \"soft\"\nstrength = 20\nrange = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

/// The meter's forces per area, times area and time, are the momentum that the fluid loses, to rounding, as a step of ABOBA has one kick: of masses
/// 1 and 3 at kT = 0.7, in space and in the plane, on areas of which no two are alike.
#[test]
fn the_meter_of_walls_has_the_momentum_that_the_fluid_loses() {
    for (model, lengths, boundary, faces, area) in [
        (
            PAIRS.to_owned(),
            "[3.0, 4.0, 5.0]",
            "\"periodic\", \"periodic\", \"reflecting\"",
            ["zlo", "zhi"],
            12.0,
        ),
        (
            PAIRS.to_owned(),
            "[3.0, 4.0, 5.0]",
            "\"reflecting\", \"periodic\", \"periodic\"",
            ["xlo", "xhi"],
            20.0,
        ),
        (
            format!("dimensions = 2\n{PAIRS}"),
            "[6.0, 7.0]",
            "\"periodic\", \"reflecting\"",
            ["ylo", "yhi"],
            6.0,
        ),
        (
            format!("dimensions = 2\n{PAIRS}"),
            "[6.0, 7.0]",
            "\"reflecting\", \"periodic\"",
            ["xlo", "xhi"],
            7.0,
        ),
    ] {
        let dimensions = if model.starts_with("dim") { 2 } else { 3 };
        let [low, high] = faces;
        let velocity = ["0.0", "0.4", "-0.3"].map(|v| if low.starts_with('x') { v } else { "0.0" });
        let velocity = if low == "zlo" { ["0.4", "-0.3", "0.0"] } else { velocity };
        let velocity = if low == "ylo" { ["0.4", "0.0", "0.0"] } else { velocity };
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 0.7\nseed = 5\ndensity = 3.0\n[masses]\nB = 3.0\n\
             [box]\nlengths = {lengths}\nboundary = [{boundary}]\n\
             [[wall]]\nkind = \"continuum\"\nspecies = \"B\"\nfaces = [\"{low}\"]\ndensity = 2.0\ndrag = 9.0\n\
             [[wall]]\nkind = \"continuum\"\nspecies = \"B\"\nfaces = [\"{high}\"]\nvelocity = [{}]\n\
             [[stage]]\nname = \"run\"\nsteps = 60\ndt = 0.01\nintegrator = \"aboba\"\n\
             [observe]\nevery = 1\nwall_force = true\n",
            velocity[..dimensions].join(", ")
        );
        let scene = support::scene(&model, &text).unwrap();
        let (out, lost, _) = observed(&scene, Recorded::Sum);
        for (c, axis) in ["x", "y", "z"].into_iter().enumerate().take(dimensions) {
            let on = |face: &str| out[0].scalar(&format!("{face}_{axis}")).unwrap().value;
            let taken = (on(low) + on(high)) * area * 0.6;
            let lost = lost[c];
            assert!((taken - lost).abs() < 1e-9 && lost.abs() > 1e-3, "{low} {axis}: {taken} {lost}");
            // Fluids push walls apart.
            assert!(!low.starts_with(axis) || on(low) < -1.0 && on(high) > 1.0, "{low} {axis}");
        }
    }
}

/// The configurational temperature of a particle in front of a wall is that of Boltzmann's distribution, an integral over its height.
#[test]
fn the_configurational_temperature_knows_walls() {
    let scene = between(STAGE);
    let kt = 0.7;
    let evaluator = Evaluator::new(scene.model.at(kt).unwrap()).unwrap();
    let state = State::at_rest(scene.domain.clone(), vec![1.0], vec![[1.0, 1.0, 1.0]]);
    let run = Simulation::new(&scene.model, kt, state, 1).unwrap();
    let (mut sums, mut forces) = ([0.0; 2], 0.0);
    let cells = 20_000;
    for k in 0..cells {
        let x = [[1.0, 1.0, 5.0 * (f64::from(k) + 0.5) / f64::from(cells)]];
        let frame = Frame::new(View { x: &x, ..run.view(0.0) }, &evaluator);
        let probability = (-frame.evaluation().energy / kt).exp();
        let terms = psidpd_observe::configurational::sums(&frame);
        forces += frame.evaluation().forces(frame.view.pool, &frame.evaluator.fluid)[0][2].abs();
        (0..2).for_each(|c| sums[c] += probability * terms[c]);
    }
    assert!((sums[0] / sums[1] / kt - 1.0).abs() < 2e-3 && forces > 1.0, "{}", sums[0] / sums[1]);
}

#[test]
fn slices_between_walls_add_up_to_the_momentum_flux() {
    assert_slices_add_up(between, 8, 1e-10);
}

#[test]
fn runs_between_walls_end_in_the_same_bytes() {
    assert_same_bytes(between);
}

/// A GPU refuses walls, with the reason.
#[test]
fn walls_are_not_on_a_gpu() {
    let mut run = settled(&between(STAGE));
    let error = run.use_device(crate::device::Device::Gpu(0)).unwrap_err().to_string();
    assert!(error.contains("not on a GPU: walls of matter"), "{error}");
}

/// Walls that a scene cannot have are refused, and what is read is what is asked for.
#[test]
fn walls_are_read_and_refused() {
    let scene = |wall: &str| {
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\ndensity = 3.0\nsteps = 3\n{BOX}[[wall]]\nkind = \"continuum\"\n{wall}\n"
        );
        support::scene(IDEAL_MIXTURE, &text)
    };
    let read =
        scene("faces = [\"zlo\", \"zhi\"]\nspecies = \"B\"\nvelocity = [0.5, 0.0, 0.0]\nviscosity = 0.8")
            .unwrap();
    let walls = read.model.walls();
    assert_eq!(walls.len(), 2);
    assert!(
        walls[1].surface.face() == Some((2, true))
            && walls[1].species == 1
            && (walls[1].density - 3.0).abs() < 1e-12
    );
    let drag = walls[0].drag[0].unwrap();
    let fluid = read.model.at(1.0).unwrap();
    let friction = fluid.walls[0].fields[0].friction.as_ref().unwrap();
    let surplus = SURPLUS[0] + SURPLUS[1] * (3.0f64 / 0.8).powi(2);
    assert!((friction.slip(0.8, 3.0, 1.0) + surplus).abs() < 1e-9 && drag > 1.0, "{drag}");
    assert_eq!(faces(&fluid.walls, &read.domain, 3).len(), 2);
    // The range of the drag is that of the wall, local densities are those that are stated, and matter is as dense as what moves.
    let own = scene("faces = [\"zlo\"]\nspecies = \"B\"\ndrag = 7.0\ndrag_range = 0.6").unwrap();
    let walls = own.model.at(1.0).unwrap().walls;
    let frictions: Vec<_> = walls[0].fields.iter().map(|field| field.friction.as_ref().unwrap()).collect();
    assert!(frictions.iter().all(|friction| friction.range() == 0.6));
    // At the face the trace of ζ is ρ γ 2π R³/30.
    let trace = |z: f64| 2.0 * frictions[0].at(z)[0] + frictions[0].at(z)[1];
    let expected = 3.0 * 7.0 * std::f64::consts::PI * 0.6f64.powi(3) / 15.0;
    assert!((trace(0.0) / expected - 1.0).abs() < 1e-6, "{} {expected}", trace(0.0));
    assert_eq!(between(STAGE).model.walls()[0].local_densities, [2.3]);
    let parts = "[[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 1.0\ndensity = 40.0\nfrozen = true\n\
                 [[part]]\nshape = \"rest\"\ndensity = 4.0\n";
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nsteps = 3\n{BOX}{parts}[[wall]]\nkind = \"continuum\"\nfaces = [\"zhi\"]\n"
    );
    let beside = support::scene(IDEAL, &text).unwrap();
    assert!((beside.model.walls()[0].density - 4.0).abs() < 1e-9, "{}", beside.model.walls()[0].density);
    // A wall without drag is smooth.
    let smooth = scene("faces = [\"zlo\"]\nspecies = \"B\"\ndrag = 0.0").unwrap();
    let fields = smooth.model.at(1.0).unwrap().walls[0].fields.clone();
    assert!(fields.len() == 2 && fields.iter().all(|field| field.friction.is_none()));
    for (wall, message) in [
        ("faces = [\"zlo\"]\nspecies = \"A\"\ndrag = -1.0", "must not be negative"),
        ("faces = [\"xlo\"]\nspecies = \"A\"", "periodic across this face"),
        ("faces = [\"zlo\"]", "several species"),
        ("faces = [\"top\"]\nspecies = \"A\"", "unknown face \"top\""),
        ("faces = []\nspecies = \"A\"", "names no face"),
        ("faces = [\"zlo\", \"zlo\"]\nspecies = \"A\"", "a face has two walls"),
        ("faces = [\"zlo\"]\nspecies = \"C\"", "unknown species \"C\""),
        ("faces = [\"zlo\"]\nspecies = \"A\"\nvelocity = [0.0, 0.0, 1.0]", "along its face only"),
        ("faces = [\"zlo\"]\nspecies = \"A\"\nviscosity = 1.0\ndrag = 2.0", "give one of them"),
        ("faces = [\"zlo\"]\nspecies = \"A\"\ndensity = -1.0", "must be positive"),
    ] {
        let error = scene(wall).unwrap_err().to_string();
        assert!(error.contains(message), "{wall}: {error}");
    }
}

/// A particle of mass 3 that meets one of two walls without forces gives it 2 m v, and the other nothing.
#[test]
fn the_wall_that_is_met_takes_the_momentum() {
    let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 0.7\nseed = 5\ndensity = 1.0\nsteps = 5\ndt = 0.02\n[masses]\nA = 3.0\n\
                [box]\nlengths = [3.0, 4.0, 5.0]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
                [[wall]]\nkind = \"continuum\"\nfaces = [\"zlo\", \"zhi\"]\ndensity = 3.0\nstrength = 0.0\ndrag = 0.0\n";
    let scene = support::scene(IDEAL, text).unwrap();
    for (z, v, wall) in [(0.01, -2.0, 0), (4.99, 2.0, 1)] {
        let domain = scene.initial_state().domain;
        let mut state = State::at_rest(domain, vec![3.0], vec![[1.0, 1.0, z]]);
        state.v = vec![[0.5, 0.0, v]];
        let mut run = scene.simulation(state).unwrap();
        scene.enter(&scene.stages[0], &mut run).unwrap();
        let integrator = scene.stages[0].integrator;
        run.prepare_for(integrator, 0.02, Want::TOTALS).unwrap();
        run.record_flux(Recorded::Sum);
        run.step(0.02, integrator, Want::TOTALS).unwrap();
        let taken = run.flux().unwrap().on_walls(2);
        for (k, force) in taken.iter().enumerate() {
            let expected = if k == wall { 2.0 * 3.0 * v / 0.02 } else { 0.0 };
            assert!((force[2] - expected).abs() < 1e-6 && force[0].abs() < 1e-9, "{wall}: {taken:?}");
        }
        assert!((run.state().v[0][2] + v).abs() < 1e-9);
    }
}
