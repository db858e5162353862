//! Figure 12: the tension of the binary mixture in mean field.

use super::BINARY;
use crate::papers::case::{Outcome, exact};
use crate::papers::context::{Context, PaperError, mean_field};
use psidpd_core::model::Model;

pub fn fig12(_: &Context) -> Result<Outcome, PaperError> {
    let mut outcome = Outcome::default();
    // kT_c = rho (lambda - lambda_A) = 10 · 0.8.
    let model = Model::parse("model.toml", BINARY)?;
    let tension = |kt: f64| -> Result<f64, PaperError> {
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
    let mut curve = Vec::new();
    for k in 0..20 {
        let kt = 3.0 + 0.25 * f64::from(k);
        curve.push((kt / 8.0, tension(kt)?));
    }
    outcome.plot("tension", "Binary mixture", ["T/T_c", "tension"], &[], &[("mean field", curve)]);
    Ok(outcome)
}
