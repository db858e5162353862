//! What measures a fluid: runs, or in tests a fluid that is known.

use super::fluid::{Drag, Strengths};
use crate::Trouble;
use psidpd_observe::Measured;
use serde::Serialize;

/// The liquid in equilibrium, in the units of the model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Equilibrium {
    /// The pressure at the density of the goals.
    pub pressure: Measured,
    /// ∂p/∂ρ at the density of the goals.
    pub stiffness: Measured,
    pub tension: Measured,
    /// Density of the liquid between its vapours.
    pub liquid: Measured,
}

/// What depends on the drag.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flow {
    pub viscosity: Measured,
    pub diffusion: Measured,
    /// The step of the runs.
    pub dt: f64,
}

/// How carefully: the search needs less than the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Care {
    Search,
    /// Longer runs from another seed.
    Result(u64),
}

pub trait Instrument {
    fn equilibrium(&mut self, fluid: &Strengths, care: Care) -> Result<Equilibrium, Trouble>;
    /// `guess` is about the viscosity, which sets the speed of the flow.
    fn flow(&mut self, fluid: &Strengths, drag: &Drag, guess: f64, care: Care) -> Result<Flow, Trouble>;
}
