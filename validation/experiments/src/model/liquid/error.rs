//! What is wrong with a data sheet, and what no fluid has.

use serde::Serialize;

/// Why a data sheet cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LiquidError {
    #[error("no {key}: {why}")]
    Missing { key: &'static str, why: &'static str },
    #[error("{0} and {1} state one thing twice: give one of them")]
    Twice(&'static str, &'static str),
    #[error(
        "no size of a particle: give molecules (with molar_mass), rc, or drop with particles; water with three molecules in a particle \
         has rc = 0.81 nm"
    )]
    NoSize,
    #[error(
        "{key} = {value} {unit}: a liquid has {low} to {high}; all numbers are in SI units, molar masses in kg/mol"
    )]
    Range { key: &'static str, value: f64, unit: &'static str, low: f64, high: f64 },
    #[error("a data sheet has no {0}")]
    Unknown(String),
}

/// A goal that no fluid of this form meets at this coarseness: the two numbers that conflict, and the nearest possible one. SI units.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Refusal {
    #[error(
        "compressibility {compressibility:.3e} 1/Pa and particles of {volume:.3e} m3 conflict: (1/kT) dp/drho is {stiffness:.0}, and \
         liquids above {most:.0} freeze. Nearest: particles of {nearest_volume:.3e} m3 at most{}, or a compressibility of \
         {nearest_compressibility:.3e} 1/Pa",
        molecules(.nearest_molecules)
    )]
    TooStiff {
        compressibility: f64,
        volume: f64,
        stiffness: f64,
        most: f64,
        nearest_volume: f64,
        nearest_molecules: Option<f64>,
        nearest_compressibility: f64,
    },
    #[error(
        "compressibility {compressibility:.3e} 1/Pa and particles of {volume:.3e} m3 conflict: (1/kT) dp/drho is {stiffness:.1}, and \
         liquids below {least:.0} boil. Nearest: particles of {nearest_volume:.3e} m3 at least{}",
        molecules(.nearest_molecules)
    )]
    TooSoft {
        compressibility: f64,
        volume: f64,
        stiffness: f64,
        least: f64,
        nearest_volume: f64,
        nearest_molecules: Option<f64>,
    },
    #[error(
        "tension {tension:.3e} N/m and particles of {volume:.3e} m3 conflict: the tension is {reduced:.1} kT/r_c2, and liquids above \
         {most:.0} freeze. Nearest: particles of {nearest_volume:.3e} m3 at most{}, or a tension of {nearest_tension:.3e} N/m",
        molecules(.nearest_molecules)
    )]
    TooTense {
        tension: f64,
        volume: f64,
        reduced: f64,
        most: f64,
        nearest_volume: f64,
        nearest_molecules: Option<f64>,
        nearest_tension: f64,
    },
    #[error(
        "{first} {first_wanted:.4e} and {second} {second_wanted:.4e} conflict at this coarseness: the nearest fluid that was found has \
         {first} {first_nearest:.4e} and {second} {second_nearest:.4e}{}",
        ending(.why)
    )]
    Pair {
        first: &'static str,
        first_wanted: f64,
        first_nearest: f64,
        second: &'static str,
        second_wanted: f64,
        second_nearest: f64,
        why: Option<String>,
    },
    #[error(
        "viscosity {viscosity:.3e} Pa s and particles of {volume:.3e} m3 conflict: with {} the liquid has {nearest:.3e} Pa s, \
         which is the nearest",
        drag(.end, .gamma)
    )]
    Viscosity {
        viscosity: f64,
        volume: f64,
        gamma: f64,
        /// The end of the drags that are tried, if this is one.
        end: Option<&'static str>,
        nearest: f64,
    },
    #[error("no liquid has these numbers: {why}")]
    NoLiquid { why: String },
}

fn drag(end: &Option<&str>, gamma: &f64) -> String {
    end.map_or_else(
        || format!("gamma = {gamma:.3}, the best that was found,"),
        |end| format!("the {end} drag"),
    )
}

fn molecules(count: &Option<f64>) -> String {
    count.map_or(String::new(), |count| format!(" ({count:.2} molecules)"))
}

fn ending(why: &Option<String>) -> String {
    why.as_ref().map_or(String::new(), |why| format!("; beyond it: {why}"))
}
