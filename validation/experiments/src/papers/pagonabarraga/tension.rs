//! Figure 12: the tension of the binary mixture, in mean field and measured.

use super::{BINARY, binary};
use crate::ExperimentError;
use crate::papers::case::{Reproduction, exact};
use crate::papers::context::{Context, mean_field};
use psidpd_core::model::Model;
use psidpd_observe::Measured;

pub fn fig12(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    // kT_c = rho (lambda - lambda_A) = 10 · 0.8.
    let model = Model::parse("model.toml", BINARY)?;
    let tension = |kt: f64| -> Result<f64, ExperimentError> {
        Ok(mean_field(BINARY, kt)?.composition_interface(10.0, 400)?.tension)
    };
    let critical =
        psidpd_core::theory::composition_critical_point(&|kt| Ok(model.at(kt)?), 10.0, [2.0, 20.0])?;
    outcome.equal("kT_c", exact(critical.parameter), 8.0, 1e-4);
    // γ ∝ (1 − T/T_c)^(3/2), eq. (40).
    let [near, nearer] = [0.04, 0.02];
    let exponent =
        (tension(8.0 * (1.0 - near))? / tension(8.0 * (1.0 - nearer))?).ln() / (near / nearer).ln();
    outcome.equal("exponent of the tension", exact(exponent), 1.5, 0.02);
    // The paper multiplies mean field by a number of its own, so that only the fall with temperature can be compared.
    let points: Vec<(f64, Measured)> =
        binary::tensions(context)?.into_iter().map(|(kt, tension)| (kt / 8.0, tension)).collect();
    if let [(_, cold), .., (_, warm)] = points[..] {
        outcome.at_least("tension by the stress at T = T_c/2", cold, 0.0);
        let gain = Measured { value: warm.value - cold.value, error: warm.error.hypot(cold.error) };
        outcome.at_most("what it gains up to T = 7 T_c/8", gain, 0.0);
    }
    let mut curve = Vec::new();
    for k in 0..20 {
        let kt = 3.0 + 0.25 * f64::from(k);
        curve.push((kt / 8.0, tension(kt)?));
    }
    outcome.plot(
        "tension",
        "Binary mixture",
        ["T/T_c", "tension"],
        &[("by the stress", points)],
        &[("mean field", curve)],
    );
    Ok(())
}
