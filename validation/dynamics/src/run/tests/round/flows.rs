//! Flows through capillaries.

use super::*;

/// The flow of standard DPD along a capillary: the viscosity by a parabola through the velocity away from the wall, the radius where
/// Poiseuille's flow of the known viscosity ends, and the force on the wall over the body force. The standard error of the radius is 0.02
/// in 10 r_c and 6000 steps, and one of 1 % in the viscosity makes 0.01.
fn flow_in_capillary(radius: f64, length: f64, steps: [usize; 2]) -> (f64, f64, f64) {
    const STANDARD: &str = include_str!("../../../../../models/standard-dpd.toml");
    let (pull, width) = (0.9 / (radius * radius), 2.0 * radius + 1.0);
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 3\ndensity = 3.0\nbox = [{width}, {width}, {length}]\n\
         [[wall]]\nkind = \"continuum\"\nshape = \"cylinder\"\nradius = {radius}\nfluid = \"inside\"\nviscosity = 0.85\n\
         [[body_force]]\nacceleration = [0.0, 0.0, {pull}]\n[[stage]]\nname = \"run\"\nsteps = 1\ndt = 0.03\nintegrator = \"aboba\"\n"
    );
    let scene = support::scene(STANDARD, &text).unwrap();
    let (stage, mut run) = (&scene.stages[0], scene.simulation(scene.initial_state()).unwrap());
    scene.enter(stage, &mut run).unwrap();
    run.prepare_for(stage.integrator, stage.dt, Want::FORCES).unwrap();
    run.advance(steps[0] as u64, stage.dt, stage.integrator).unwrap();
    run.record_flux(Recorded::Sum);
    const RINGS: usize = 40;
    let mut rings = [[0.0; 3]; RINGS];
    let mut taken = 0.0;
    for _ in 0..steps[1] {
        run.step(stage.dt, stage.integrator, Want::FORCES).unwrap();
        taken += run.flux().unwrap().on_walls(1)[0][2] / steps[1] as f64;
        for (x, v) in run.state().x.iter().zip(&run.state().v) {
            let square = (x[0] - 0.5 * width).powi(2) + (x[1] - 0.5 * width).powi(2);
            let ring = &mut rings[((square / (radius * radius) * RINGS as f64) as usize).min(RINGS - 1)];
            ring[0] += 1.0;
            ring[1] += square;
            ring[2] += v[2];
        }
    }
    // A straight line through the velocity by the square of the distance, away from the wall.
    let fitted: Vec<[f64; 3]> =
        rings.into_iter().filter(|[n, square, _]| *n > 0.0 && (square / n).sqrt() < radius - 1.0).collect();
    let sum = |f: &dyn Fn(&[f64; 3]) -> f64| fitted.iter().map(f).sum::<f64>();
    let n = sum(&|r| r[0]);
    let (x, y) = (sum(&|r| r[1]) / n, sum(&|r| r[2]) / n);
    let slope =
        sum(&|r| r[0] * (r[1] / r[0] - x) * (r[2] / r[0] - y)) / sum(&|r| r[0] * (r[1] / r[0] - x).powi(2));
    let density: f64 = fitted.iter().map(|r| r[0]).sum::<f64>()
        / (fitted.len() as f64 * std::f64::consts::PI * radius * radius / RINGS as f64
            * length
            * steps[1] as f64);
    let viscosity = -density * pull / (4.0 * slope);
    let known = (x + 4.0 * 0.85 * y / (density * pull)).sqrt();
    println!("radius {radius}: density {density:.4}, viscosity {viscosity:.4}, {known:.3}");
    (viscosity, known, taken / (pull * run.len() as f64))
}

/// The capillary of the page on walls is a scene.
#[test]
fn the_capillary_of_the_page_runs() {
    let page = include_str!("../../../../../../docs/walls.md");
    let blocks = page.split("```toml\n").skip(1).map(|block| block.split("```").next().unwrap());
    let block = blocks.into_iter().find(|block| block.contains("shape     = \"cylinder\"")).unwrap();
    let text = format!("title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\ndensity = 3.0\nsteps = 5\n{block}");
    let scene = support::scene(include_str!("../../../../../models/standard-dpd.toml"), &text).unwrap();
    let mut run = scene.simulation(scene.initial_state()).unwrap();
    advance(&mut run, 5, 0.01, Integrator::VelocityVerlet);
    assert_eq!(run.len(), (3.0 * 90.0 * std::f64::consts::PI).round() as usize);
}

/// In a steady flow through a capillary its wall takes what the body force gives, and the liquid does not slip.
#[test]
fn a_liquid_flows_through_a_capillary_by_poiseuilles_law() {
    let (viscosity, radius, force) = flow_in_capillary(3.0, 10.0, [2000, 6000]);
    assert!((viscosity / 0.85 - 1.0).abs() < 0.3, "{viscosity}");
    assert!((radius - 3.0).abs() < 0.2 && (force - 1.0).abs() < 0.05, "{radius} {force}");
}

/// The same to a few hundredths of the range, in capillaries of several radii.
#[test]
#[ignore = "takes minutes"]
fn liquids_do_not_slip_in_capillaries() {
    for radius in [2.0, 3.0, 4.0] {
        let (_, found, force) = flow_in_capillary(radius, 16.0, [6000, 40_000]);
        assert!((found - radius).abs() < 0.1 && (force - 1.0).abs() < 0.02, "{radius}: {found} {force}");
    }
}
