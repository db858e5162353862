//! The table `[parameters]`.

use super::names::check_identifier;
use crate::document::{FileError, Section};
use crate::number::Number;
use std::collections::{BTreeMap, BTreeSet};

/// Most parameters of a model: each may depend on all others.
const MOST_PARAMETERS: usize = 1000;

/// The `[parameters]` table: numbers, or formulas of other parameters, in any order.
pub fn read(root: &Section) -> Result<BTreeMap<String, f64>, FileError> {
    let mut known = BTreeMap::new();
    let Some(value) = root.get("parameters") else { return Ok(known) };
    let section = value.section()?;
    let mut waiting: Vec<(String, Number)> = Vec::new();
    let entries = section.entries();
    if entries.len() > MOST_PARAMETERS {
        return Err(value.error(format!("{} parameters, more than {MOST_PARAMETERS}", entries.len())));
    }
    for (name, value) in entries {
        check_identifier(&name)?;
        let number = Number::read(&value)?;
        if let Number::Formula(ast) = &number
            && ast.value.names().any(|(name, _)| name == "kT")
        {
            return Err(value.error(
                "a parameter has one value at all temperatures: write kT where the parameter is used",
            ));
        }
        waiting.push((name.value, number));
    }
    // Formulas may refer to each other: each pass evaluates those whose parameters are known, until none is left.
    let names: BTreeSet<String> = waiting.iter().map(|(n, _)| n.clone()).collect();
    while !waiting.is_empty() {
        let before = waiting.len();
        let mut still = Vec::new();
        for (name, number) in waiting {
            let ready = match &number {
                Number::Value(_) => true,
                Number::Formula(ast) => {
                    ast.value.names().all(|(n, _)| known.contains_key(n) || !names.contains(n))
                }
            };
            if ready {
                let value = number.evaluate(&known)?.value;
                known.insert(name, value);
            } else {
                still.push((name, number));
            }
        }
        if still.len() == before {
            let circle: Vec<&str> = still.iter().map(|(n, _)| n.as_str()).collect();
            let circle = circle.join(", ");
            return Err(section.error(format!("these parameters refer to each other in a circle: {circle}")));
        }
        waiting = still;
    }
    Ok(known)
}
