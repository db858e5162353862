//! Walls of matter that are cylinders and spheres.

mod flows;
mod scenes;

use super::matter::{
    STAGE, assert_same_bytes, assert_slices_add_up, assert_temperatures, balanced, deviation, named,
    observed, rough,
};
use super::*;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::model::wall::{Round, Surface};
use psidpd_observe::Recorded;
use psidpd_observe::frame::{Frame, View};

const CAPILLARY: &str =
    "shape = \"cylinder\"\nradius = 2.2\nfluid = \"inside\"\nvelocity = [0.0, 0.0, 0.3]\nviscosity = 7.8\n";
const CAVITY: &str = "shape = \"sphere\"\nradius = 2.1\nfluid = \"inside\"\n";
const FIBRE: &str = "shape = \"cylinder\"\naxis = \"x\"\nradius = 1.3\ncenter = [0.0, 1.7, 2.9]\nfluid = \"outside\"\nviscosity = 7.8\n";
const BALL: &str =
    "shape = \"sphere\"\nradius = 1.2\ncenter = [1.4, 2.9, 2.6]\nfluid = \"outside\"\nviscosity = 7.8\n";

/// Set 6 in a capillary, in a cavity, around a fibre and around a ball.
const ALL: [&str; 4] = [CAPILLARY, CAVITY, FIBRE, BALL];

fn beside(wall: &str, rest: &str) -> Scene {
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 6.05\nbox = [5.6, 5.5, 5.4]\n\
         [[wall]]\nkind = \"continuum\"\nlocal_density = 2.3\n{wall}{rest}"
    );
    support::scene(SET6, &text).unwrap()
}

fn settled(scene: &Scene) -> Simulation {
    let mut run = scene.simulation(scene.initial_state()).unwrap();
    advance(&mut run, 150, 0.01, Integrator::VelocityVerlet);
    run
}

/// The deviations of the energy fall with Δt² where drag and noise are off, beside every surface, and with every integrator that keeps it.
#[test]
fn energy_beside_round_walls_is_conserved_to_second_order() {
    let of_capillary = ["aboba", "two-stage", "force-gradient"].map(|name| (CAPILLARY, name));
    let cases = ALL.map(|wall| (wall, "velocity-verlet"));
    for (wall, name) in cases.into_iter().chain(of_capillary) {
        let scene = beside(wall, STAGE);
        let starts = [settled(&scene).state().clone()];
        let of = |dt: f64| deviation(&scene, &starts, named(name), [dt, 0.3]);
        let [coarse, fine] = [0.01, 0.0025].map(of);
        // Force-gradient is of fourth order away from the surface.
        let [most, falls] = if name == "force-gradient" { [1e-3, 3.0] } else { [6e-3, 7.0] };
        assert!(coarse < most && fine < coarse / falls, "{wall} {name}: {coarse} {fine}");
    }
}

/// No particle gets into the matter.
#[test]
fn round_walls_take_the_momentum_that_the_fluid_loses() {
    for wall in ALL {
        let scene = beside(wall, STAGE);
        let start = settled(&scene).state().clone();
        for (name, _) in Integrator::ALL.iter().filter(|(_, integrator)| integrator.has_time()) {
            let (given, run) = balanced(&scene, &start, name, 60);
            assert!(given.iter().any(|p| p.abs() > 0.1), "{wall} {name}: {given:?}");
            let surfaces = crate::run::Surfaces::of(&scene.model.at(1.0).unwrap().walls, &scene.domain);
            assert!(!run.state().x.iter().any(|x| surfaces.is_in_matter(x)), "{wall} {name}");
        }
    }
}

/// What a model without interactions does beside a wall without forces is known: uniform density at all times, no change of any speed, and a
/// pressure of ρkT from the particles that are there. The four shells of equal volume have a quarter of 6000 particles each, with a
/// standard deviation of 34; the pressure of some 10⁵ bounces is known to 1 %.
#[test]
fn an_ideal_gas_in_a_sphere_stays_as_it_is() {
    let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 5\nbox = 6.0\nsteps = 5\n[[part]]\nshape = \"rest\"\ncount = 6000\n\
                [[wall]]\nkind = \"continuum\"\nshape = \"sphere\"\nradius = 2.5\nfluid = \"inside\"\nstrength = 0.0\ndrag = 0.0\n\
                center = [2.8, 3.0, 3.3]\ndensity = 3.0\n";
    let scene = support::scene(IDEAL, text).unwrap();
    for name in ["velocity-verlet", "aboba", "two-stage"] {
        let (dt, integrator) = (0.1, named(name));
        let mut run = scene.simulation(scene.initial_state()).unwrap();
        run.set_thermostat(false);
        run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
        run.record_flux(Recorded::Sum);
        let speeds = |run: &Simulation| {
            let square = |v: &[f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            let mut all: Vec<(i32, f64)> =
                run.state().tag.iter().copied().zip(run.state().v.iter().map(square)).collect();
            all.sort_by_key(|(tag, _)| *tag);
            all
        };
        let (first, mut push) = (speeds(&run), 0.0);
        for _ in 0..60 {
            run.step(dt, integrator, Want::TOTALS).unwrap();
            push += run.flux().unwrap().on_walls(1)[0][3] / 60.0;
        }
        for ((_, a), (_, b)) in first.iter().zip(speeds(&run)) {
            assert!((a - b).abs() < 1e-9 * (1.0 + a), "{name}: {a} {b}");
        }
        let mut shells = [0.0; 4];
        for x in &run.state().x {
            let r = [x[0] - 2.8, x[1] - 3.0, x[2] - 3.3].iter().map(|d| d * d).sum::<f64>().sqrt();
            shells[((r / 2.5).powi(3) * 4.0).min(3.0) as usize] += 1.0;
        }
        assert!(shells.iter().all(|n| (n - 1500.0f64).abs() < 5.0 * 34.0), "{name}: {shells:?}");
        // 4πR² P with P V = ⅔ K.
        let expected = 2.0 * run.kinetic_energy() / 2.5;
        assert!((push / expected - 1.0).abs() < 0.05, "{name}: {push} {expected}");
    }
}

/// The virial theorem: in the mean, what presses on a cavity is the pressure of the scene's totals, whose volume is the box's, in the volume
/// of the fluid. The integral of both over the run differs by the change of Σ m x·v alone, which stays below 100 here; the law holds for
/// the two directions across a capillary.
#[test]
fn the_pressure_on_a_round_wall_is_that_of_its_fluid() {
    for (wall, directions) in [(CAVITY, 3), (CAPILLARY, 2)] {
        let scene = beside(wall, STAGE);
        let mut run = settled(&scene);
        let (dt, aboba) = (0.02, named("aboba"));
        run.prepare_for(aboba, dt, Want::TOTALS).unwrap();
        run.record_flux(Recorded::Sum);
        let surface = run.engine().plan().walls()[0].wall.surface;
        let radius = surface.round().unwrap().radius;
        let sums = |run: &Simulation| -> f64 {
            let (state, middle) = (run.state(), surface.round().unwrap().center);
            let across =
                |k: usize| (0..directions).map(|c| (state.x[k][c] - middle[c]) * state.v[k][c]).sum::<f64>();
            (0..state.len()).map(across).sum()
        };
        let first = sums(&run);
        let (mut of_wall, mut of_fluid, mut scale) = (0.0, 0.0, 0.0f64);
        for _ in 0..300 {
            run.step(dt, aboba, Want::TOTALS).unwrap();
            let flux = run.flux().unwrap();
            of_wall += dt * radius * flux.on_walls(1)[0][3];
            of_fluid += dt * flux.sum()[..directions].iter().sum::<f64>();
            scale += dt * 2.0 * run.kinetic_energy() * directions as f64 / 3.0;
        }
        // Noise of pairs is no part of the recorded flux.
        let off = of_wall - of_fluid + sums(&run) - first;
        assert!(
            off.abs() < 0.03 * scale && of_wall > 0.3 * scale,
            "{wall}: {of_wall} {of_fluid} {off} {scale}"
        );
    }
}

/// In a gas whose only drag is that of a wall, one action takes velocities of zero to the covariance `kT/m (1 − exp(−2ζΔt/m))` along the axis,
/// across the surface and around it, about the velocity of the wall's part in it. Variances of 4000 particles are known to 2.2 %, covariances
/// to 1.6 %: five standard errors are exceeded by one of 54 numbers less than once in 30 000 seeds.
#[test]
fn noise_of_a_round_wall_has_the_covariance_of_its_friction() {
    let (kt, dt, mass, radius) = (0.7, 0.3, 1.7, 1.5);
    for (dimensions, along, inside) in
        [(3, Some(2), true), (3, Some(0), false), (3, None, true), (3, None, false), (2, None, true)]
    {
        let across = [0, 1, 2].map(|c| c < dimensions && Some(c) != along);
        let mut velocity = [0.0; 3];
        along.into_iter().for_each(|c| velocity[c] = 0.4);
        let wall = rough(Surface::Round(Round { across, center: [3.0; 3], radius, inside }), velocity);
        let text = format!("title = \"g\"\ndimensions = {dimensions}\nspecies = [\"A\"]\n");
        let model = Model::parse("m.toml", &text).unwrap().with_walls(vec![wall]);
        let lengths = if dimensions == 2 { [6.0, 6.0, 1.0] } else { [6.0; 3] };
        let domain = PeriodicBox::orthogonal([0.0; 3], lengths, [true; 3]).unwrap();
        let height = 0.2;
        // A direction that is none of the axes, and two others.
        let mut n = [0.48, 0.6, 0.64];
        (0..3).filter(|c| !across[*c]).for_each(|c| n[c] = 0.0);
        let size = n.iter().map(|n| n * n).sum::<f64>().sqrt();
        let n = n.map(|n| n / size);
        let place = [0, 1, 2].map(|c| 3.0 + n[c] * if inside { radius - height } else { radius + height });
        let x = vec![if dimensions == 2 { [place[0], place[1], 0.0] } else { place }; 4000];
        let mut run = Simulation::new(&model, kt, State::at_rest(domain, vec![mass], x), 3).unwrap();
        run.prepare_for(Integrator::VelocityVerlet, dt, Want::FORCES).unwrap();
        run.step(dt, Integrator::VelocityVerlet, Want::FORCES).unwrap();
        let walls = run.engine().plan().walls();
        let [axial, normal, around] = walls[0].fields[0].friction.as_ref().unwrap().at(height);
        let mut e = [0.0, 0.0, 1.0];
        if let Some(axis) = along {
            e = [0, 1, 2].map(|c| if c == axis { 1.0 } else { 0.0 });
        } else if dimensions == 3 {
            // Any direction along a sphere.
            e = [0.8, -0.64, 0.0].map(|e| e / 0.8f64.hypot(0.64));
            assert!(e[0] * n[0] + e[1] * n[1] < 1e-12);
        }
        let t = [n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]];
        let local: Vec<[f64; 3]> = run
            .state()
            .v
            .iter()
            .map(|v| [e, n, t].map(|a| a[0] * v[0] + a[1] * v[1] + a[2] * v[2]))
            .collect();
        let zeta = [if dimensions == 2 { 0.0 } else { axial }, normal, around];
        let variance = zeta.map(|zeta| kt / mass * (1.0 - (-2.0 * zeta * dt / mass).exp()));
        let drift = velocity.iter().sum::<f64>() * (1.0 - (-axial * dt / mass).exp());
        let mean = |f: &dyn Fn(&[f64; 3]) -> f64| local.iter().map(f).sum::<f64>() / 4000.0;
        for a in (0..3).filter(|a| dimensions == 3 || *a > 0) {
            let center = |v: &[f64; 3], c: usize| v[c] - if c == 0 { drift } else { 0.0 };
            let off = mean(&|v| center(v, a)) / (variance[a] / 4000.0).sqrt();
            assert!(off.abs() < 5.0, "{along:?}: mean {a} off by {off}");
            for b in (0..=a).filter(|b| dimensions == 3 || *b > 0) {
                let expected = if a == b { variance[a] } else { 0.0 };
                let error =
                    if a == b { 2f64.sqrt() } else { 1.0 } * (variance[a] * variance[b] / 4000.0).sqrt();
                let found = mean(&|v| center(v, a) * center(v, b));
                assert!(
                    (found - expected).abs() < 5.0 * error,
                    "{along:?} {inside} {a}{b}: {found} {expected}"
                );
            }
        }
        assert!(dimensions == 3 || run.state().v.iter().all(|v| v[2] == 0.0));
    }
}

/// A particle that is so slow that it stays and so cold that there is no noise loses `m v (1 − exp(−ζΔt/m))` along each direction of the surface.
/// The virial of that force along the line to the nearest point of the surface is in the pressure and in the recorded drag, and the wall
/// has taken the momentum.
#[test]
fn friction_of_a_round_wall_is_in_the_pressure() {
    let (mass, dt, z) = (3.0, 0.3, 0.2);
    for inside in [true, false] {
        let round = Round { across: [true, false, true], center: [3.0; 3], radius: 1.5, inside };
        let wall = rough(Surface::Round(round), [0.0; 3]);
        let model =
            Model::parse("m.toml", "title = \"g\"\nspecies = [\"A\"]\n").unwrap().with_walls(vec![wall]);
        let domain = PeriodicBox::orthogonal([0.0; 3], [6.0; 3], [true; 3]).unwrap();
        let side = if inside { 1.0 } else { -1.0 };
        // The place is along (0.6, 0, 0.8), and the velocity across, around and along.
        let place = [0.6, 0.0, 0.8].map(|n| 3.0 + n * (1.5 - side * z));
        let mut state = State::at_rest(domain, vec![mass], vec![place]);
        let local = [2e-15, -1e-15, 3e-15];
        let [n, t, e] = [[-0.6 * side, 0.0, -0.8 * side], [0.8, 0.0, -0.6], [0.0, 1.0, 0.0]];
        let turned =
            |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| v[0] * n[c] + v[1] * t[c] + v[2] * e[c]) };
        state.v = vec![turned(local)];
        let mut run = Simulation::new(&model, 1e-60, state, 7).unwrap();
        run.record_flux(Recorded::Lines);
        run.prepare_for(Integrator::VelocityVerlet, dt, Want::TOTALS).unwrap();
        let [along, across, around] =
            run.engine().plan().walls()[0].fields[0].friction.as_ref().unwrap().at(z);
        run.step(dt, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
        let force = [across, around, along].map(|zeta| -mass * (1.0 - (-zeta * dt / mass).exp()) / dt);
        let force = turned(std::array::from_fn(|c| force[c] * local[c]));
        let d = n.map(|n| z * n);
        let (total, rest) = (run.pressure_tensor(), run.conservative_pressure_tensor());
        let flux = run.flux().unwrap();
        let drag = psidpd_observe::flux::Flux { drag: flux.drag.clone(), ..Default::default() }.sum();
        for (c, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            let expected = 0.5 * (d[a] * force[b] + d[b] * force[a]);
            for found in [216.0 * (total[c] - rest[c]), drag[c]] {
                assert!((found - expected).abs() < 1e-8 * 1e-15, "{inside} {c}: {found} {expected}");
            }
        }
        let taken = flux.on_walls(1)[0];
        for c in 0..3 {
            assert!((taken[c] + force[c]).abs() < 1e-8 * 1e-15, "{taken:?} {force:?}");
        }
        let push: f64 = (0..3).map(|c| n[c] * force[c]).sum();
        assert!((taken[3] - push).abs() < 1e-8 * 1e-15 && push < 0.0, "{taken:?} {push}");
    }
}

#[test]
fn slices_across_round_walls_add_up_to_the_momentum_flux() {
    for wall in [CAPILLARY, BALL] {
        assert_slices_add_up(|rest| beside(wall, rest), 4, 1e-9);
    }
}

/// The meter's forces per area, times area and time, are the momentum that the fluid loses and a body force gives, to rounding, as a step
/// of ABOBA has one kick; what presses on the wall is positive.
#[test]
fn the_meter_of_round_walls_has_the_momentum_that_the_fluid_loses() {
    use std::f64::consts::PI;
    let flat = "title = \"p\"\ndimensions = 2\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 15\n\
                range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
    let circle = "shape = \"sphere\"\nradius = 1.6\nfluid = \"outside\"\ndrag = 9.0\n";
    for (model, wall, name, area) in [
        (SET6, CAPILLARY, "cylinder", 2.0 * PI * 2.2 * 5.4),
        (SET6, FIBRE, "cylinder", 2.0 * PI * 1.3 * 5.6),
        (SET6, BALL, "sphere", 4.0 * PI * 1.44),
        (flat, circle, "sphere", 2.0 * PI * 1.6),
    ] {
        let dimensions = if model == flat { 2 } else { 3 };
        let [lengths, pull] = if dimensions == 2 {
            ["[5.6, 5.5]", "[0.0, 0.3]"]
        } else {
            ["[5.6, 5.5, 5.4]", "[0.0, 0.2, 0.3]"]
        };
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 0.7\nseed = 5\ndensity = 8.0\nbox = {lengths}\n\
             [[wall]]\nkind = \"continuum\"\n{wall}[[body_force]]\nacceleration = {pull}\n\
             [[stage]]\nname = \"run\"\nsteps = 60\ndt = 0.01\nintegrator = \"aboba\"\n\
             [observe]\nevery = 1\nwall_force = true\n"
        );
        let scene = support::scene(model, &text).unwrap();
        let (out, lost, run) = observed(&scene, Recorded::Sum);
        let force = if dimensions == 2 { [0.0, 0.3, 0.0] } else { [0.0, 0.2, 0.3] };
        for (c, axis) in ["x", "y", "z"].into_iter().enumerate().take(dimensions) {
            let taken = out[0].scalar(&format!("{name}_{axis}")).unwrap().value * area * 0.6;
            let lost = lost[c] + 0.6 * force[c] * run.len() as f64;
            assert!((taken - lost).abs() < 1e-8 && lost.abs() > 1e-3, "{wall} {axis}: {taken} {lost}");
        }
        assert!(out[0].scalar(&format!("{name}_normal")).unwrap().value > 0.3, "{wall}");
    }
}

/// The configurational temperature of a particle beside a round wall is that of Boltzmann's distribution, an integral over its distance from
/// the axis or the centre.
#[test]
fn the_configurational_temperature_knows_round_walls() {
    for (wall, directions) in [(CAPILLARY, 2), (CAVITY, 3), (BALL, 3)] {
        let (scene, kt) = (beside(wall, STAGE), 0.7);
        let evaluator = Evaluator::new(scene.model.at(kt).unwrap()).unwrap();
        let Surface::Round(round) = evaluator.fluid.walls[0].wall.surface else { panic!() };
        let x = [0, 1, 2].map(|c| round.center[c] + if c == 1 && !round.inside { 1.5 } else { 0.0 });
        let state = State::at_rest(scene.domain.clone(), vec![1.0], vec![x]);
        let run = Simulation::new(&scene.model, kt, state, 1).unwrap();
        let [from, to] = if round.inside { [0.0, round.radius] } else { [round.radius, 2.5] };
        let (mut sums, mut forces) = ([0.0; 2], 0.0);
        let cells = 20_000;
        for k in 0..cells {
            let c = from + (to - from) * (f64::from(k) + 0.5) / f64::from(cells);
            let x = [[round.center[0] + 0.6 * c, round.center[1] + 0.8 * c, round.center[2]]];
            let frame = Frame::new(View { x: &x, ..run.view(0.0) }, &evaluator);
            let probability = c.powi(directions - 1) * (-frame.evaluation().energy / kt).exp();
            let terms = psidpd_observe::configurational::sums(&frame);
            forces += frame.evaluation().forces(frame.view.pool, &frame.evaluator.fluid)[0][1].abs();
            (0..2).for_each(|c| sums[c] += probability * terms[c]);
        }
        let found = sums[0] / sums[1] / kt;
        assert!((found - 1.0).abs() < 2e-3 && forces > 1.0, "{wall}: {found}");
    }
}

/// Only momentum along a smooth cylinder is conserved.
#[test]
fn round_walls_conserve_momentum_along_a_smooth_cylinder_alone() {
    for (wall, conserved) in [
        ("shape = \"cylinder\"\naxis = \"y\"\nradius = 2.0\nfluid = \"inside\"\ndrag = 0.0\n", 1),
        (CAPILLARY, 0),
        ("shape = \"sphere\"\nradius = 2.0\nfluid = \"inside\"\ndrag = 0.0\n", 0),
    ] {
        let scene = beside(wall, STAGE);
        let run = scene.simulation(scene.initial_state()).unwrap();
        assert_eq!(run.degrees_of_freedom(), 3 * run.len() - conserved, "{wall}");
    }
}

/// Beside round walls an ideal gas has the temperature of its stage, however strong the drag.
#[test]
fn a_gas_beside_round_walls_has_its_temperature() {
    for wall in [CAPILLARY, CAVITY, BALL] {
        let wall: String = wall
            .lines()
            .filter(|l| !l.starts_with("visc") && !l.starts_with("velo"))
            .collect::<Vec<_>>()
            .join("\n");
        let text = format!(
            "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\ndensity = 4.0\nsteps = 1\nbox = [5.6, 5.5, 5.4]\n\
             [[wall]]\nkind = \"continuum\"\n{wall}\ndrag = 200.0\ndrag_range = 1.0\n"
        );
        let scene = support::scene(IDEAL, &text).unwrap();
        let surfaces = crate::run::Surfaces::of(&scene.model.at(1.0).unwrap().walls, &scene.domain);
        let place = *surfaces.iter().next().unwrap().1;
        for name in ["shardlow-s1", "aboba", "two-stage", "force-gradient"] {
            assert_temperatures(&scene, name, |x| place.distance(x) < 0.4, 0.03);
        }
    }
}

#[test]
fn runs_beside_round_walls_end_in_the_same_bytes() {
    for wall in [CAPILLARY, BALL] {
        assert_same_bytes(|rest| beside(wall, rest));
    }
}

/// Trial moves into the matter are refused.
#[test]
fn trial_moves_stay_out_of_the_matter() {
    for wall in ALL {
        let scene = beside(
            wall,
            "[[stage]]\nname = \"mc\"\nsteps = 4\nintegrator = \"monte-carlo\"\nmax_move = 0.4\n",
        );
        let (stage, mut run) = (&scene.stages[0], scene.simulation(scene.initial_state()).unwrap());
        scene.enter(stage, &mut run).unwrap();
        run.prepare_for(stage.integrator, stage.dt, Want::FORCES).unwrap();
        run.advance(4, stage.dt, stage.integrator).unwrap();
        let surfaces = crate::run::Surfaces::of(&scene.model.at(1.0).unwrap().walls, &scene.domain);
        assert!(!run.state().x.iter().any(|x| surfaces.is_in_matter(x)), "{wall}");
    }
}
