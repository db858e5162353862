//! LAMMPS's own pair style for a fluid, where it has one.

use super::origin::Origin;
use crate::ExperimentError;
use crate::fluids::dpd_model;
use crate::lammps::style::PairStyle;
use psidpd_core::engine::Pool;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::model::{Fluid, ForceLaw, Model, WarrenPair, warren_ab};
use std::num::NonZeroUsize;

/// The style for the fluid of a scene, found by the model's parameters and compared with its forces.
pub fn own_style(origin: &Origin) -> Result<Option<PairStyle>, ExperimentError> {
    let scene = origin.scene;
    let fluid = scene.model.at(origin.stage.kt)?;
    let [Some(thermostat)] = fluid.thermostats[..] else { return Ok(None) };
    let plain = scene.frozen.is_empty()
        && scene.body_forces.is_empty()
        && scene.domain.periodic() == [true; 3]
        && fluid.dimensions == 3
        && thermostat.exponent == 1.0;
    let Ok(text) = toml::from_str::<toml::Table>(scene.model.source().text()) else { return Ok(None) };
    let number = |name: &str| {
        let value = text.get("parameters")?.get(name)?;
        value.as_float().or_else(|| value.as_integer().map(|i| i as f64))
    };
    let (gamma, rc) = (thermostat.gamma, thermostat.range);
    if !plain {
        return Ok(None);
    }
    if let (Some(a), Some(b), Some(rd)) = (number("A"), number("B"), number("rd")) {
        let pair = WarrenPair { a, b, gamma, rc, rd, weight: None };
        let Ok(model) = warren_ab(&["F".to_owned()], &[Some(pair)], 3, ForceLaw::Conservative) else {
            return Ok(None);
        };
        return Ok(same(origin, fluid, &model)?.then_some(PairStyle::Mdpd(pair)));
    }
    if let Some(a) = number("a") {
        let model = dpd_model(a, gamma, rc)?;
        return Ok(same(origin, fluid, &model)?.then_some(PairStyle::Dpd { a, gamma, rc }));
    }
    Ok(None)
}

/// Whether LAMMPS computes another law than the model.
pub fn is_another_law(own: &PairStyle) -> bool {
    matches!(own, PairStyle::Mdpd(_))
}

/// Whether forces at the start are the same.
fn same(origin: &Origin, fluid: Fluid, other: &Model) -> Result<bool, ExperimentError> {
    let state = &origin.state;
    let kt = origin.stage.kt;
    let evaluate = |fluid: Fluid| {
        let evaluator = Evaluator::new(fluid).ok()?;
        let alone = Pool::new(NonZeroUsize::MIN);
        Some(
            evaluator
                .evaluate(&alone, &state.x, &state.species, &state.domain)
                .forces(&alone, &evaluator.fluid),
        )
    };
    let (Some(ours), Some(theirs)) = (evaluate(fluid), evaluate(other.at(kt)?)) else { return Ok(false) };
    let largest = ours.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    Ok(ours.iter().flatten().zip(theirs.iter().flatten()).all(|(a, b)| (a - b).abs() <= 1e-9 * largest))
}
