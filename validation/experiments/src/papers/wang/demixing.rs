//! Figures 3 and 4, and which potential has a thermodynamic limit.

use super::{STRONG, WEAK};
use crate::ExperimentError;
use crate::papers::case::{Reproduction, bare, curve};
use crate::papers::context::{Context, edited};
use crate::shipped::SPLINE;
use psidpd_core::model::Model;
use psidpd_core::theory::thermodynamic_limit;
use psidpd_observe::Measured;

const WEAK_SCENE: &str = include_str!("../../../../scenes/full/spline-demixing-b08.toml");
const STRONG_SCENE: &str = include_str!("../../../../scenes/full/spline-demixing-b10.toml");

/// S(k) at the longest wave over the number of particles: 1/N without correlations, and of order 0.1 where liquid
/// has gathered in one place.
fn gathered(
    context: &Context,
    model: &str,
    scene: &str,
    outcome: &mut Reproduction,
) -> Result<Measured, ExperimentError> {
    let changes = ["box=10.0", "steps=2500", "output.dump=0", "observe.every=20"];
    let s = context.shipped("demixing", model, scene, &changes)?.profile("structure_factor", "s");
    outcome.plot("structure", "Structure factor", ["k", "S"], vec![curve("S", bare(&s))]);
    let particles = 2.0 * context.pick(1e3, 8e3);
    Ok(s.first().map_or(Measured::NONE, |(_, s)| s.times(1.0 / particles)))
}

/// Between a mixture, 0.001 in the small box, and a drop: S of a ball of all particles with a tenth of the volume is
/// half of N.
const APART: f64 = 0.05;

pub fn fig3(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let first = gathered(context, WEAK, WEAK_SCENE, outcome)?;
    outcome.at_most("S/N at the longest wave, B = 0.8", first, APART);
    Ok(())
}

pub fn fig4(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let first = gathered(context, STRONG, STRONG_SCENE, outcome)?;
    outcome.at_least("S/N at the longest wave, B = 1.0", first, APART);
    Ok(())
}

pub fn limit(_: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // The paper shows a drop at rest for 17.0, which the uniform fluid cannot be: 19.0, printed as well, is meant.
    for first in [17.0, 19.0] {
        // a A = 9.5 · A.
        let text = edited(SPLINE, &[&format!("pair.1.A={:?}", first / 9.5)])?;
        let fluid = Model::parse("model.toml", &text)?.at(0.5)?;
        let uniform = thermodynamic_limit(&fluid)?.is_err_and(|collapse| collapse.is_uniform());
        let name = format!("{first} W(0.8) - 9.5 W(1.0): the uniform fluid is bounded");
        outcome.equal(name, f64::from(!uniform), 1.0);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of W(r, R), not normalised, is π R³/8, and its sign is what decides about the uniform fluid.
    #[test]
    fn integrals_are_those_of_the_splines() {
        for first in [17.0, 19.0] {
            let text = edited(SPLINE, &[&format!("pair.1.A={:?}", first / 9.5)]).unwrap();
            let fluid = Model::parse("model.toml", &text).unwrap().at(0.5).unwrap();
            let found = psidpd_core::theory::MeanField::new(&fluid).unwrap().pair_integrals[0];
            let integral = std::f64::consts::PI / 8.0 * (first * 0.8f64.powi(3) - 9.5);
            assert!((found - integral).abs() < 1e-9, "{found} {integral}");
        }
    }
}
