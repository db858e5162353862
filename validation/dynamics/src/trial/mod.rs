//! Errors of a time step, measured on a small piece of a fluid.
//!
//! The error of a long step against ωΔt is no power law: it rises like a wall near ωΔt = 1 of the fastest particles, and where the
//! wall stands depends on masses, drag and how often stiff encounters are. So a piece of the fluid runs at the step in question, and
//! its temperatures, kinetic and configurational, tell the error. That of the pressure follows from the thermal pressure of the fluid.
//!
//! The frequency of a species is that of its forces: with velocities of Maxwell's distribution, forces change at the rate
//! `Ḟ = −H v`, and
//!
//! ```text
//! ω⁴ = ⟨Ḟ·Ḟ⟩/(d kT m) = (H m⁻¹ H)_ii/m_i
//! ```
//!
//! the mean square of the curvature that a particle feels. The mean curvature itself, ∇²U, is small in fluids whose attraction and
//! repulsion cancel, although each encounter is stiff.

mod piece;
mod samples;

pub use piece::{Composition, NoPiece, Piece};
pub use samples::StepErrors;

/// The longest step that is advised, in units of 1/ω of the fastest species. Of twelve random fluids of one to three species, masses
/// 0.1 to 10 and drag κ/ω of 0.1 to 6, with or without a pole of ψ, one stopped at any ωΔt: bounds hold the local density of each
/// species, and the sum of two reached the pole, which no step is short enough for. Of the others the largest error
/// that a short trial found was 1.1 % at ωΔt = 0.9, 2.7 % at 1.2 (eleven were tried there) and 19 % at 1.5. With the mean square of
/// ∇²U in place of this ω, 1.2 is 0.85 to 0.98 in simple liquids.
pub const CAP: f64 = 1.2;

/// The error that an advised step may have.
pub const GOAL: f64 = 0.01;

/// A number that people set: a step has two digits.
pub fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

/// An error in percent, with two digits; one too small to matter is bounded.
pub fn percent(error: f64) -> String {
    match 100.0 * error {
        percent if percent < 0.01 => "less than 0.01 %".to_owned(),
        percent => format!("{} %", two_digits(percent)),
    }
}

#[cfg(test)]
mod tests;
