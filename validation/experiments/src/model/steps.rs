//! The step of short runs that measure a liquid, as runs advise it: forces three times, drag at every second step.

use psidpd_dynamics::integrator::{Coupling, Integrator};
use psidpd_dynamics::trial::{Piece, two_digits};

/// The lines of the step in a stage of a scene, without dt.
const STEP: &str = "integrator = \"force-gradient\"\nlambda = 0.17\nthermostat_every = 2\n";

pub const ADVISED: Integrator = Integrator::ForceGradient {
    lambda: 0.17,
    gradient: 1.0 / 24.0,
    coupling: Coupling { every: 2, ..Coupling::DEFAULT },
};

/// ωΔt of the runs: half the cost of certainty, and errors below a percent in nearly all fluids.
const STRIDE: f64 = 0.9;

/// A start that is no liquid yet needs short steps: their share of dt.
pub const FIRST: f64 = 0.15;

/// The stages of a run: with the first of two time steps it begins, with the second it settles and is measured for two times.
pub fn stages([first, dt]: [f64; 2], times: [f64; 2]) -> String {
    let [settle, measure] = times.map(|time| (time / dt).ceil().max(100.0));
    let stage = |(name, steps, dt): (&str, f64, f64)| {
        format!("\n[[stage]]\nname = \"{name}\"\nsteps = {steps}\ndt = {dt:?}\n{STEP}")
    };
    [("begin", 400.0, first), ("settle", settle, dt), ("measure", measure, dt)].map(stage).concat()
}

pub fn dt(piece: &Piece) -> f64 {
    two_digits(STRIDE / piece.frequency)
}
