//! Target pressures that a fluid does not have: the corrected density is missing.

use super::findings::{Severity, Warning};
use psidpd_core::model::curve::CurveForm;
use psidpd_core::model::{ExcessFreeEnergy, Fluid};

/// A warning if the model states a pressure, and its density is not corrected for correlations.
pub fn missing(fluid: &Fluid) -> Option<Warning> {
    let target = fluid.excess.iter().find_map(|excess| match excess {
        ExcessFreeEnergy::Curve(curve) if matches!(curve.form, CurveForm::Pressure(_)) => Some(curve.density),
        _ => None,
    })?;
    let density = &fluid.densities[target];
    density.correction.iter().all(|c| c.is_identity()).then(|| Warning {
        id: "uncalibrated",
        severity: Severity::Warning,
        message: format!(
            "a run will not have the pressure that the model asks for: density {} has no correction for \
             the correlations of particles, which often cost a fifth of the pressure; find it with: psidpd calibrate \
             MODEL --kT {} --density LOW:HIGH --out FILE",
            density.name, fluid.kt
        ),
    })
}
