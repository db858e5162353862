//! Figure 1: what the quadratic equation of state cannot have.

use super::{K2, K4};
use crate::ExperimentError;
use crate::papers::case::{Reproduction, exact};
use crate::papers::context::{Context, mean_field};

pub fn fig1(_: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let ratio = |model: &str, rho: f64| -> Result<f64, ExperimentError> {
        let theory = mean_field(model, 1.0)?;
        Ok(rho * theory.pressure_slope(&[rho]) / theory.pressure(&[rho]))
    };
    for rho in [1.0, 3.0, 10.0, 100.0] {
        outcome.at_most(
            format!("stiffness over pressure, k = 2, density {rho}"),
            exact(ratio(K2, rho)?),
            2.0,
        );
    }
    outcome.at_least("stiffness over pressure, k = 4, density 10", exact(ratio(K4, 10.0)?), 3.9);
    let theory = mean_field(K2, 1.0)?;
    let curve = |k: f64| -> Vec<(f64, f64)> {
        (1..=100)
            .map(|step| {
                let rho = 0.05 * f64::from(step);
                let p = theory.pressure(&[rho]);
                (p, if k > 0.0 { k * p } else { rho * theory.pressure_slope(&[rho]) })
            })
            .collect()
    };
    let lines = [("p = rho kT + 10 rho²", curve(0.0)), ("slope 2", curve(2.0))];
    outcome.plot("stiffness", "Inverse compressibility", ["pressure", "1/compressibility"], &[], &lines);
    Ok(())
}
