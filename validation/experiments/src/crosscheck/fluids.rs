//! The fluids that the codes are compared in: Warren's sets 5 and 6.

use crate::ExperimentError;
use psidpd_core::model::{ForceLaw, Model, WarrenPair, warren_ab, warren_ab_text};

/// One of Warren's parameter sets, with what he measured at kT = 1 (Phys. Rev. E 68, 066702, Table 2).
#[derive(Debug, Clone, Copy)]
pub struct WarrenSet {
    /// Its name in the paper.
    pub name: &'static str,
    /// `B`; `A` is −40, `r_c` 1 and `r_d` 0.75 in both.
    pub b: f64,
    /// Coexisting liquid density.
    pub liquid: f64,
    /// Its error.
    pub liquid_error: f64,
    /// Surface tension and its error.
    pub tension: (f64, f64),
    /// Width of the interface and its error.
    pub width: (f64, f64),
    /// The shipped model file.
    pub file: &'static str,
}

/// Set 5: the lighter liquid.
pub const SET5: WarrenSet = WarrenSet {
    name: "set 5",
    b: 40.0,
    liquid: 5.08,
    liquid_error: 0.01,
    tension: (4.95, 0.03),
    width: (0.78, 0.05),
    file: include_str!("../../../models/warren2003-set5.toml"),
};

/// Set 6: the denser liquid.
pub const SET6: WarrenSet = WarrenSet {
    name: "set 6",
    b: 25.0,
    liquid: 6.05,
    liquid_error: 0.01,
    tension: (7.45, 0.04),
    width: (0.66, 0.03),
    file: include_str!("../../../models/warren2003-set6.toml"),
};

/// `r_c`.
pub const RC: f64 = 1.0;
/// `r_d`.
pub const RD: f64 = 0.75;
/// `A`.
pub const A: f64 = -40.0;
/// γ of the runs with a thermostat: σ = 6 at kT = 1.
pub const GAMMA: f64 = 18.0;

impl WarrenSet {
    fn pair(&self, gamma: f64) -> [Option<WarrenPair>; 1] {
        [Some(WarrenPair { a: A, b: self.b, gamma, rc: RC, rd: RD })]
    }

    /// The model with friction `gamma` and one of the two force laws.
    pub fn model(&self, law: ForceLaw, gamma: f64) -> Result<Model, ExperimentError> {
        Ok(warren_ab(&["F".to_owned()], &self.pair(gamma), 3, law)?)
    }

    /// The text of the same model file.
    pub fn model_text(&self, law: ForceLaw, gamma: f64) -> Result<String, ExperimentError> {
        Ok(warren_ab_text(&["F".to_owned()], &self.pair(gamma), 3, law)?)
    }

    /// The shipped model.
    pub fn shipped(&self) -> Result<Model, ExperimentError> {
        Ok(Model::parse(self.name, self.file)?)
    }
}
