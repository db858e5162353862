use super::check::{number_density, per_species};
use super::{Failure, Verdict, write_json};
use crate::report::Table;
use psidpd_core::model::Model;
use psidpd_core::theory::{MeanField, TheoryError, composition_critical_point, critical_point_of_model};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Mean field: equation of state, critical point, spinodal, binodal, surface tension.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The model file.
    model: PathBuf,
    /// kT.
    #[arg(long = "kT", value_name = "T", default_value_t = 1.0, allow_negative_numbers = true)]
    kt: f64,
    /// Number density, total or one for each species: where a mixture is looked at, and the middle of the
    /// table of the equation of state.
    #[arg(long, value_name = "RHO", value_delimiter = ',', value_parser = number_density)]
    density: Vec<f64>,
    /// Rows of the table.
    #[arg(long, default_value_t = 12)]
    rows: usize,
    /// Range of kT in which a critical point is looked for, as multiples of kT.
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', num_args = 1..=2, default_values_t = [0.05, 20.0])]
    search: Vec<f64>,
}

/// An answer, or why there is none: no coexistence is an answer too.
fn or_reason<T>(answer: Result<T, TheoryError>, show: impl FnOnce(T) -> Value) -> Value {
    match answer {
        Ok(found) => show(found),
        Err(why) => json!({ "none": why.to_string() }),
    }
}

pub fn run(arguments: &Arguments, json: Option<&Path>) -> Result<Verdict, Failure> {
    let model = Model::open(&arguments.model)?;
    let fluid = model.at(arguments.kt)?;
    let theory = MeanField::new(&fluid)?;
    let species = model.species().len();
    let densities =
        per_species(&arguments.density, species).unwrap_or_else(|| vec![3.0 / species as f64; species]);
    if densities.len() != species {
        let error = crate::check::CheckError::Densities { given: densities.len(), species };
        return Err(error.into());
    }
    let [low, high] = arguments.search[..] else {
        return Err(TheoryError::NoCriticalPoint(0.0, 0.0).into());
    };
    let range = [low * arguments.kt, high * arguments.kt];
    let total: f64 = densities.iter().sum();

    println!("{} at kT = {}", model.title(), arguments.kt);
    let mut table = Table::new(["density", "pressure", "dp/drho", "excess free energy per particle"]);
    let mut rows = Vec::new();
    for k in 1..=arguments.rows.min(10_000) {
        let scale = 2.0 * k as f64 / arguments.rows as f64;
        let rho: Vec<f64> = densities.iter().map(|d| d * scale).collect();
        let (p, slope) = (theory.pressure(&rho), theory.pressure_slope(&rho));
        let f = theory.excess_free_energy_density(&rho) / (scale * total);
        table.push([scale * total, p, slope, f].map(|x| format!("{x:.6}")));
        rows.push(json!({"density": scale * total, "pressure": p, "pressure_slope": slope, "excess": f}));
    }
    println!("{}", table.to_text());
    let middle = theory.pressure(&densities);
    let defined = middle.is_finite();
    if !defined {
        println!("at density {total} the pressure is {middle}: psi or its slope is no finite number there\n");
    }

    let answers: Vec<(&str, Value)> = match species {
        1 => vec![
            (
                "critical point",
                or_reason(
                    critical_point_of_model(&model, range),
                    |c| json!({"kT": c.parameter, "density": c.density, "pressure": c.pressure}),
                ),
            ),
            ("spinodal", or_reason(theory.spinodal(), |s| json!(s))),
            (
                "binodal",
                or_reason(theory.binodal(), |b| {
                    json!({"vapour": b.vapour, "liquid": b.liquid, "pressure": b.pressure,
                           "chemical_potential": b.chemical_potential})
                }),
            ),
            (
                "interface",
                or_reason(theory.interface(201), |i| json!({"tension": i.tension, "width": i.width})),
            ),
        ],
        2 => vec![
            (
                "critical point at this density",
                or_reason(
                    composition_critical_point(&|kt| Ok(model.at(kt)?), total, range),
                    |c| json!({"kT": c.parameter, "composition": c.composition, "pressure": c.pressure}),
                ),
            ),
            ("spinodal at this density", or_reason(theory.composition_spinodal(total), |s| json!(s))),
            (
                "binodal at this density",
                or_reason(
                    theory.composition_binodal(total),
                    |b| json!({"composition": b.composition, "pressure": b.pressure}),
                ),
            ),
            (
                "binodal at this pressure",
                or_reason(
                    theory.composition_binodal_at_pressure(theory.pressure(&densities)),
                    |b| json!({"composition": b.composition, "density": b.density, "pressure": b.pressure}),
                ),
            ),
            (
                "interface at this density",
                or_reason(
                    theory.composition_interface(total, 201),
                    |i| json!({"tension": i.tension, "width": i.width}),
                ),
            ),
        ],
        _ => Vec::new(),
    };
    for (name, value) in &answers {
        println!("{name}: {}", shown(value));
    }
    let mut all = json!({"title": model.title(), "kT": arguments.kt, "equation_of_state": rows});
    for (name, value) in answers {
        all[name.replace(' ', "_")] = value;
    }
    write_json(json, &all)?;
    Ok(if defined { Verdict::Good } else { Verdict::CheckFailed })
}

/// A value as a person reads it.
fn shown(value: &Value) -> String {
    match value {
        Value::Object(map) => match map.get("none").and_then(Value::as_str) {
            Some(why) => format!("none ({why})"),
            None => map.iter().map(|(k, v)| format!("{k} {}", shown(v))).collect::<Vec<_>>().join(", "),
        },
        Value::Array(items) if items.is_empty() => "none".into(),
        Value::Array(items) => items.iter().map(shown).collect::<Vec<_>>().join(" .. "),
        Value::Number(n) => n.as_f64().map_or_else(|| n.to_string(), |x| format!("{x:.6}")),
        other => other.to_string(),
    }
}
