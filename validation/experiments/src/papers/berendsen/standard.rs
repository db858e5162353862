//! Sections 11.2 and 11.3: standard DPD, its pressure and compressibility; Lowe's thermostat beside drag and noise.

use crate::ExperimentError;
use crate::papers::case::{Reproduction, curve, line, points};
use crate::papers::context::{Context, Fluid};
use crate::run::Observed;
use crate::shipped::STANDARD;

/// a r_c⁴ of the model.
const A: f64 = 25.0;

pub fn alpha(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let measured = context.pressures("rho", &Fluid::of(STANDARD), &[3.0, 4.0, 6.0, 8.0])?;
    for &(rho, p) in &measured {
        let alpha = p.minus(rho).times(1.0 / (A * rho * rho));
        outcome.equal(format!("alpha at density {rho}"), alpha, [0.101, 0.001]);
    }
    let published = line(3.0, 9.0, |rho| rho + 0.101 * A * rho * rho);
    let series = vec![points("measured", &measured), curve("rho kT + 0.101 a rho²", published)];
    outcome.plot("pressure", "Standard DPD", ["density", "pressure"], series);
    Ok(())
}

pub fn water(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let [low, high] = [2.5, 3.5];
    let a = context.bulk("below", &Fluid::of(STANDARD), &[low])?.pressure();
    let b = context.bulk("above", &Fluid::of(STANDARD), &[high])?.pressure();
    let slope = b.minus(a).over(high - low);
    // 1 + 2 alpha a rho/kT with alpha = 0.101(1) is 16.15(15); water has 15.98.
    outcome.equal("dp/drho / kT at density 3", slope, [16.15, 0.15]);
    Ok(())
}

/// Runs standard DPD with Lowe's thermostat, or with drag and noise.
fn run(context: &Context, integrator: &str, dt: f64) -> Result<Observed, ExperimentError> {
    let changes = &[
        context.pick("box=8.0", "box=10.0"),
        &format!("integrator={integrator}"),
        &format!("equilibrate={}", (5.0 / dt) as u64),
        &format!("steps={}", (context.pick(40.0, 500.0) / dt) as u64),
        "observe.every=10",
    ];
    let fluid = Fluid { dt, changes, ..Fluid::of(STANDARD) };
    context.bulk(&format!("{integrator}-{dt}"), &fluid, &[3.0])
}

pub fn lowe_andersen(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let fine = [run(context, "lowe-andersen", 0.01)?, run(context, "velocity-verlet", 0.01)?];
    outcome.equal("kinetic temperature", fine[0].temperature(), 1.0);
    let [redrawn, dragged] = fine.map(|observed| observed.pressure());
    outcome.own("pressure, beside that with drag and noise", redrawn, dragged);
    // "Solves problems with temperature drift": at a long step it is nearer to kT.
    let coarse = [run(context, "lowe-andersen", 0.05)?, run(context, "velocity-verlet", 0.05)?];
    let [redrawn, dragged] = coarse.map(|observed| (observed.temperature().value - 1.0).abs());
    let name = "error of the temperature at a step of 0.05, over that with drag and noise";
    outcome.at_most(name, redrawn / dragged, 1.0);
    Ok(())
}
