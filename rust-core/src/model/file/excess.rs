use super::density::DensityEntry;
use super::number::read_formula;
use super::species_index;
use super::table::read_spline;
use crate::document::{FileError, FileErrorKind, Located, Section, Value};
use crate::model::curve::Spline;
use crate::model::expression::Ast;
use std::path::Path;
use std::sync::Arc;

/// What the file says of one species' `ψ`.
#[derive(Debug, Clone)]
pub enum ExcessEntry {
    /// No `[excess_free_energy]` at all: ψ = 0.
    None,
    /// A formula of the densities.
    Formula(Located<Ast>),
    /// A table of one density's total.
    Table { spline: Arc<Spline>, density: usize },
    /// The pressure as a formula of one density's total.
    Pressure { formula: Located<Ast>, density: usize },
}

/// Reads `[excess_free_energy]`: every species, or none.
pub fn read(
    root: &Section,
    species: &Located<Vec<String>>,
    densities: &[DensityEntry],
    directory: &Path,
) -> Result<Vec<ExcessEntry>, FileError> {
    let mut all = vec![ExcessEntry::None; species.value.len()];
    let Some(value) = root.get("excess_free_energy") else {
        return Ok(all);
    };
    let section = value.section()?;
    for (name, value) in section.entries() {
        let index = species_index(&species.value, &name, section.source())?;
        all[index] = match value.as_section() {
            None => ExcessEntry::Formula(read_formula(&value, section.source())?),
            Some(table) => {
                let entry = read_curve(&table, species.value.len(), densities, directory)?;
                table.finish()?;
                entry
            }
        };
    }
    match all.iter().position(|e| matches!(e, ExcessEntry::None)) {
        None => Ok(all),
        Some(missing) => Err(section
            .error(FileErrorKind::Value(format!("species {} has no entry", species.value[missing])))
            .with_help(format!("write {} = \"0\" if it has none", species.value[missing]))),
    }
}

/// `{ table = "file" }` or `{ pressure = "formula" }`, with `density = "name"` where there are several.
fn read_curve(
    table: &Section,
    species: usize,
    densities: &[DensityEntry],
    directory: &Path,
) -> Result<ExcessEntry, FileError> {
    let value = |message: &str| FileErrorKind::Value(message.into());
    let file = table.get("table");
    let pressure = table.get("pressure");
    let density = read_density(table.get("density"), table, densities)?;
    match (file, pressure) {
        (Some(file), None) => {
            Ok(ExcessEntry::Table { spline: Arc::new(read_spline(&file, directory, ["n", "psi"])?), density })
        }
        (None, Some(pressure)) if species == 1 => {
            Ok(ExcessEntry::Pressure { formula: read_formula(&pressure, table.source())?, density })
        }
        (None, Some(pressure)) => Err(pressure
            .error(value("gives psi for a model of one species only"))
            .with_help("write psi of each species as a formula or a table")),
        (Some(_), Some(pressure)) => Err(pressure.error(value("excludes a table"))),
        (None, None) => {
            Err(table.error(value("expected a formula, { table = \"file\" } or { pressure = \"formula\" }")))
        }
    }
}

/// The density that a curve depends on: the one named, or the only one.
fn read_density(
    named: Option<Value>,
    table: &Section,
    densities: &[DensityEntry],
) -> Result<usize, FileError> {
    let known = || densities.iter().map(|d| d.name.as_str()).collect::<Vec<_>>().join(", ");
    match (named, densities) {
        (Some(value), _) => {
            let name = value.string()?.value;
            densities.iter().position(|d| d.name == name).ok_or_else(|| {
                value.error(FileErrorKind::UnknownName { what: "density", name, known: known() })
            })
        }
        (None, [_]) => Ok(0),
        (None, []) => Err(table
            .error(FileErrorKind::Value("depends on a density, and the model has none".into()))
            .with_help("write a [density.n]")),
        (None, _) => Err(table
            .error(FileErrorKind::Value(format!("does not say which density it depends on: {}", known())))
            .with_help("write density = \"name\" in the braces")),
    }
}
