//! The step of short runs that measure a liquid, as runs advise it: forces three times, drag at every second step.

use psidpd_dynamics::integrator::{Coupling, Integrator};
use psidpd_dynamics::trial::{Piece, two_digits};

/// The lines of the step in a stage of a scene, without dt.
pub const STEP: &str = "integrator = \"force-gradient\"\nlambda = 0.17\nthermostat_every = 2\n";

pub const ADVISED: Integrator = Integrator::ForceGradient {
    lambda: 0.17,
    gradient: 1.0 / 24.0,
    coupling: Coupling { every: 2, ..Coupling::DEFAULT },
};

/// ωΔt of the runs: half the cost of certainty, and errors below a percent in nearly all fluids.
const STRIDE: f64 = 0.9;

/// A start that is no liquid yet needs short steps: their share of dt.
pub const FIRST: f64 = 0.15;

pub fn dt(piece: &Piece) -> f64 {
    two_digits(STRIDE / piece.frequency)
}
