use super::density::DensityEntry;
use crate::curve::{Spline, read_spline};
use crate::document::{FileError, Located, Place, Section, Value};
use crate::expression::Ast;
use crate::number::read_formula;
use std::path::Path;
use std::sync::Arc;

/// The entry of one species' `ψ` in the file.
#[derive(Debug, Clone)]
pub enum ExcessEntry {
    /// The file has no `[excess_free_energy]`: ψ = 0.
    None,
    /// A formula of the densities.
    Formula(Located<Ast>),
    /// A table of one density's total.
    Table { spline: Arc<Spline>, density: usize },
    /// The pressure as a formula of one density's total.
    Pressure { formula: Located<Ast>, density: usize },
    /// The pressure as a table of one density's total.
    PressureTable { spline: Arc<Spline>, density: usize, place: Place },
    /// Slopes that may have no ψ, by the names of the variables, and the formula that is reported as energy.
    Slopes { slopes: Vec<(Located<String>, Located<Ast>)>, energy: Option<Located<Ast>> },
}

/// Reads `[excess_free_energy]`, with an entry for every species.
pub fn read(
    root: &Section,
    species: &Located<Vec<String>>,
    densities: &[DensityEntry],
    directory: &Path,
) -> Result<Vec<ExcessEntry>, FileError> {
    let mut all = vec![ExcessEntry::None; species.value.len()];
    let Some(value) = root.get("excess_free_energy") else { return Ok(all) };
    let section = value.section()?;
    for (name, value) in section.entries() {
        let index: usize = name.among("species", species.value.iter().zip(0..))?;
        all[index] = match value.as_section() {
            None => ExcessEntry::Formula(read_formula(&value)?),
            Some(table) => read_curve(&table, species.value.len(), densities, directory)?,
        };
    }
    match all.iter().position(|e| matches!(e, ExcessEntry::None)) {
        None => Ok(all),
        Some(missing) => Err(section
            .error(format!("species {} has no entry", species.value[missing]))
            .with_help(format!("write {} = \"0\" if it has none", species.value[missing]))),
    }
}

/// Reads `{ table = "file" }` or `{ pressure = "formula" }`, with `density = "name"` where there are
/// several; or `{ slopes = { n = "formula" } }`.
fn read_curve(
    table: &Section,
    species: usize,
    densities: &[DensityEntry],
    directory: &Path,
) -> Result<ExcessEntry, FileError> {
    let file = table.get("table");
    let pressure = table.get("pressure");
    let (slopes, energy, named) = (table.get("slopes"), table.get("energy"), table.get("density"));
    if let Some(slopes) = slopes {
        let others = [("table", &file), ("pressure", &pressure), ("density", &named)];
        if let Some((name, Some(other))) = others.iter().find(|(_, v)| v.is_some()) {
            return Err(other.error(format!("slopes exclude {name}")));
        }
        return read_slopes(&slopes, energy);
    }
    if let Some(energy) = energy {
        return Err(energy.error("has no meaning without slopes"));
    }
    let density = read_density(named, table, densities)?;
    match (file, pressure) {
        (Some(file), None) => {
            Ok(ExcessEntry::Table { spline: Arc::new(read_spline(&file, directory, ["n", "psi"])?), density })
        }
        (None, Some(pressure)) if species == 1 => {
            if let Some(section) = pressure.as_section() {
                section.only(["table"])?;
                let file = section.require("table")?;
                let spline = Arc::new(read_spline(&file, directory, ["rho", "p"])?);
                return Ok(ExcessEntry::PressureTable { spline, density, place: file.place.clone() });
            }
            let names_file = |text: &str| {
                let extension = Path::new(text).extension().and_then(|e| e.to_str());
                extension.is_some_and(|e| e.bytes().all(|b| b.is_ascii_alphabetic()))
            };
            let formula =
                read_formula(&pressure).map_err(|error| match pressure.as_str().is_some_and(names_file) {
                    true => {
                        error.with_help("p(rho) in a file is written { pressure = { table = \"p.csv\" } }")
                    }
                    false => error,
                })?;
            Ok(ExcessEntry::Pressure { formula, density })
        }
        (None, Some(pressure)) => Err(pressure
            .error("gives psi for a model of one species only")
            .with_help("write psi of each species as a formula or a table")),
        (Some(_), Some(pressure)) => Err(pressure.error("excludes a table")),
        (None, None) => {
            Err(table.error("expected a formula, { table = \"file\" } or { pressure = \"formula\" }"))
        }
    }
}

fn read_slopes(slopes: &Value, energy: Option<Value>) -> Result<ExcessEntry, FileError> {
    let section = slopes.section()?;
    let slopes = section
        .entries()
        .into_iter()
        .map(|(name, value)| Ok((name, read_formula(&value)?)))
        .collect::<Result<Vec<_>, FileError>>()?;
    let energy = energy.map(|e| read_formula(&e)).transpose()?;
    Ok(ExcessEntry::Slopes { slopes, energy })
}

/// The density that a curve depends on: the named density, or the only one.
fn read_density(
    named: Option<Value>,
    table: &Section,
    densities: &[DensityEntry],
) -> Result<usize, FileError> {
    let names: Vec<&str> = densities.iter().map(|d| d.name.as_str()).collect();
    match (named, densities) {
        (Some(value), _) => value.string()?.among("density", names.iter().zip(0..)),
        (None, [_]) => Ok(0),
        (None, []) => {
            Err(table.error("depends on a density, and the model has none").with_help("write a [density.n]"))
        }
        (None, _) => Err(table
            .error(format!("does not say which density it depends on: {}", names.join(", ")))
            .with_help("write density = \"name\" in the braces")),
    }
}
