//! The equation of state: PC-SAFT by FeOs (P. Rehner, G. Bauer, J. Gross, Ind. Eng. Chem. Res. 62, 5347 (2023)), its tension
//! by density functional theory. Only with the feature `eos`.

use super::Substance;
use crate::ExperimentError;

/// A saturated liquid, in SI units.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(not(feature = "eos"), allow(dead_code, reason = "made by the equation of state alone"))]
pub struct Liquid {
    /// mol/m³.
    pub density: f64,
    /// Vapour pressure, Pa.
    pub pressure: f64,
    /// Isothermal, 1/Pa.
    pub compressibility: f64,
    pub tension: f64,
    /// Density and pressure of the compressed liquid at the same temperature, ascending.
    pub compressed: Vec<(f64, f64)>,
}

/// The saturated liquid of a substance at a temperature in K.
#[cfg(not(feature = "eos"))]
pub fn liquid(_: &Substance, _: f64) -> Result<Liquid, ExperimentError> {
    Err(ExperimentError::NotBuilt)
}

/// The saturated liquid of a substance at a temperature in K.
#[cfg(feature = "eos")]
pub fn liquid(substance: &Substance, temperature: f64) -> Result<Liquid, ExperimentError> {
    use feos::core::parameter::PureRecord;
    use feos::core::{Contributions, PhaseEquilibrium, SolverOptions, State};
    use feos::dft::interface::PlanarInterface;
    use feos::pcsaft::{PcSaftAssociationRecord, PcSaftFunctional, PcSaftParameters, PcSaftRecord};
    use quantity::{KELVIN, METER, MOL, NEWTON, PASCAL};

    let failed = |why: &dyn std::fmt::Display| ExperimentError::Equation(why.to_string());
    let mut record = serde_json::json!({
        "identifier": { "name": substance.name },
        "molarweight": 1e3 * substance.molar_mass,
        "m": substance.m,
        "sigma": substance.sigma,
        "epsilon_k": substance.epsilon_k,
    });
    if let Some([volume, energy]) = substance.association {
        record["association_sites"] =
            serde_json::json!([{ "kappa_ab": volume, "epsilon_k_ab": energy, "na": 1.0, "nb": 1.0 }]);
    }
    let record: PureRecord<PcSaftRecord, PcSaftAssociationRecord> =
        serde_json::from_value(record).map_err(|e| failed(&e))?;
    let functional = PcSaftFunctional::new(PcSaftParameters::new_pure(record).map_err(|e| failed(&e))?);
    let kelvin = temperature * KELVIN;
    let phases = PhaseEquilibrium::pure(&&functional, kelvin, None, SolverOptions::default())
        .map_err(|e| failed(&e))?;
    let saturated = phases.liquid();
    let per_volume = MOL / METER.powi::<3>();
    let pressure = |factor: f64| {
        let state = State::new_pure(&&functional, kelvin, saturated.density * factor)?;
        Ok::<f64, feos::core::FeosError>((state.pressure(Contributions::Total) / PASCAL).into_value())
    };
    let density = (saturated.density / per_volume).into_value();
    let compressed = [1.05, 1.1, 1.15, 1.2]
        .into_iter()
        .map(|factor| Ok((density * factor, pressure(factor)?)))
        .collect::<Result<Vec<_>, feos::core::FeosError>>()
        .map_err(|e| failed(&e))?;
    let interface = PlanarInterface::from_pdgt(&phases, 1024, false)
        .and_then(|interface| interface.solve(None))
        .map_err(|e| failed(&e))?;
    let tension = interface.surface_tension.ok_or_else(|| failed(&"no surface tension"))?;
    Ok(Liquid {
        density,
        pressure: pressure(1.0).map_err(|e| failed(&e))?,
        compressibility: (saturated.isothermal_compressibility() * PASCAL).into_value(),
        tension: (tension / (NEWTON / METER)).into_value(),
        compressed,
    })
}

#[cfg(all(test, feature = "eos"))]
mod tests {
    use super::*;

    #[test]
    fn decane_is_as_measured() {
        let found = liquid(&Substance::find("decane").unwrap(), 298.15).unwrap();
        // 726.6 kg/m³ and 23.4 mN/m are those of the liquid; PC-SAFT is made to have the first within 1 %.
        assert!((found.density * 0.142285 / 726.6 - 1.0).abs() < 0.01, "{found:?}");
        assert!((found.tension / 0.0234 - 1.0).abs() < 0.03, "{found:?}");
        assert!(liquid(&Substance::find("water").unwrap(), 5000.0).is_err(), "beyond its critical point");
    }
}
