//! Section 11.3: Lowe's thermostat beside drag and noise.

use crate::ExperimentError;
use crate::bulk::Observed;
use crate::models::STANDARD;
use crate::papers::case::{Reproduction, exact};
use crate::papers::context::Context;

fn run(context: &Context, integrator: &str, dt: f64) -> Result<Observed, ExperimentError> {
    let scene = format!(
        "kT = 1.0\nseed = 1\nbox = {:?}\ndensity = 3.0\ndt = {dt:?}\nintegrator = \"{integrator}\"\nequilibrate = {}\nsteps = {}\n\
         [initial]\nkind = \"lattice\"\n[output]\nthermo = 0\n[observe]\nevery = 10\ntemperature = true\npressure = true\n",
        context.pick(8.0, 10.0),
        (5.0 / dt) as u64,
        (context.pick(40.0, 500.0) / dt) as u64,
    );
    context.scene(&format!("{integrator}-{dt}"), STANDARD, &scene)
}

pub fn compare(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let fine = [run(context, "lowe-andersen", 0.01)?, run(context, "velocity-verlet", 0.01)?];
    outcome.equal("kinetic temperature", fine[0].temperature(), 1.0, 0.0);
    let [redrawn, dragged] = fine.map(|observed| observed.pressure());
    outcome.own("pressure, beside that with drag and noise", redrawn, dragged);
    // "Solves problems with temperature drift": at a long step it is nearer to kT.
    let coarse = [run(context, "lowe-andersen", 0.05)?, run(context, "velocity-verlet", 0.05)?];
    let [redrawn, dragged] = coarse.map(|observed| (observed.temperature().value - 1.0).abs());
    outcome.at_most(
        "error of the temperature at a step of 0.05, over that with drag and noise",
        exact(redrawn / dragged),
        1.0,
    );
    Ok(())
}
