use super::names::check_identifier;
use crate::continuation::Continuation;
use crate::document::{FileError, FileErrorKind, Located, Section, Value};
use crate::kernel::KernelKind;
use crate::number::Number;
use std::collections::BTreeMap;

/// A `[density.NAME]` table.
#[derive(Debug, Clone)]
pub struct DensityEntry {
    pub name: String,
    pub kernel: KernelKind,
    pub force_kernel: KernelKind,
    pub range: Number,
    pub includes_self: bool,
    /// Coefficients by (felt by, density of), row-major; empty for the identity.
    pub correction: Vec<Vec<Number>>,
    pub bounds: Option<[Number; 2]>,
    pub below: Continuation,
}

/// Most densities of a model.
const MOST_DENSITIES: usize = 16;

/// Reads every `[density.*]`, in the order of the file.
pub fn read(
    root: &Section,
    species: &[String],
    parameters: &BTreeMap<String, f64>,
) -> Result<Vec<DensityEntry>, FileError> {
    let Some(value) = root.get("density") else { return Ok(Vec::new()) };
    let section = value.section()?;
    let mut densities: Vec<DensityEntry> = Vec::new();
    let entries = section.entries();
    if entries.len() > MOST_DENSITIES {
        return Err(value.error(format!("{} densities, more than {MOST_DENSITIES}", entries.len())));
    }
    for (name, value) in entries {
        check_identifier(&name)?;
        let Some(table) = value.as_section() else {
            return Err(value
                .error(FileErrorKind::WrongType { expected: "a table", found: "something else" })
                .with_help("densities have names: write [density.n]"));
        };
        let entry = read_one(name.clone(), &table, species)?;
        check_clashes(&name, species, parameters, &densities)?;
        densities.push(entry);
    }
    Ok(densities)
}

fn read_one(name: Located<String>, table: &Section, species: &[String]) -> Result<DensityEntry, FileError> {
    let choices: Vec<(&str, KernelKind)> = KernelKind::ALL.iter().map(|k| (k.name(), *k)).collect();
    let kernel = table.require("kernel")?.one_of("kernel", &choices)?;
    let force_kernel =
        table.read("force_kernel", |value| value.one_of("kernel", &choices))?.unwrap_or(kernel);
    let range = Number::require(table, "range")?;
    let includes_self = table.read("self", Value::boolean)?.unwrap_or(false);
    let correction = table.read("correction", |value| read_correction(value, species))?;
    let correction = correction.unwrap_or_else(|| vec![Vec::new(); species.len() * species.len()]);
    let bounds = table.read("bounds", |value| {
        let [low, high] = &value.array()?[..] else { return Err(value.error("expected [lowest, highest]")) };
        Ok([Number::read(low)?, Number::read(high)?])
    })?;
    let below = table.read("below", |value| match bounds {
        Some(_) => value.one_of("continuation", &Continuation::NAMED),
        None => Err(value.error("has no meaning without bounds")),
    })?;
    let below = below.unwrap_or_default();
    let name = name.value;
    Ok(DensityEntry { name, kernel, force_kernel, range, includes_self, correction, bounds, below })
}

/// Reads one polynomial for all pairs of species, or a table of `"A|B"`: the density of A felt by B.
fn read_correction(value: &Value, species: &[String]) -> Result<Vec<Vec<Number>>, FileError> {
    let coefficients = |value: &Value| -> Result<Vec<Number>, FileError> {
        let items = value.array()?;
        if items.is_empty() || items.len() > 16 {
            return Err(value.error("expected 1 to 16 coefficients in ascending powers"));
        }
        items.iter().map(Number::read).collect()
    };
    let count = species.len();
    if value.as_array().is_some() {
        return Ok(vec![coefficients(value)?; count * count]);
    }
    let Some(pairs) = value.as_section() else {
        return Err(value.error(FileErrorKind::WrongType {
            expected: "coefficients or a table of \"A|B\" = coefficients",
            found: "something else",
        }));
    };
    let mut all = vec![Vec::new(); count * count];
    for (key, value) in pairs.entries() {
        let Some((of, by)) = key.value.split_once('|') else {
            return Err(key.error("expected \"A|B\", the density of A felt by B"));
        };
        let index = |name: &str| {
            key.clone().map(|_| name.trim().to_owned()).among("species", species.iter().zip(0usize..))
        };
        all[index(by)? * count + index(of)?] = coefficients(&value)?;
    }
    Ok(all)
}

/// Fails if a variable of a density has the name of a parameter or of another density's variable.
fn check_clashes(
    name: &Located<String>,
    species: &[String],
    parameters: &BTreeMap<String, f64>,
    others: &[DensityEntry],
) -> Result<(), FileError> {
    let variables = |density: &str| {
        let mut names = vec![density.to_owned()];
        names.extend(species.iter().map(|s| format!("{density}_{s}")));
        names
    };
    let mine = variables(&name.value);
    let taken = parameters
        .keys()
        .cloned()
        .chain(others.iter().flat_map(|d| variables(&d.name)))
        .find(|n| mine.contains(n));
    match taken {
        None => Ok(()),
        Some(taken) => {
            Err(name.error(format!("its variable {taken} has the name of another variable or parameter")))
        }
    }
}
