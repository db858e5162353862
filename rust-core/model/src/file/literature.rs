//! Published values of the fluid, for comparison with measured ones.

use crate::document::{FileError, Section, Value};

/// The quantities that the file may state.
pub const QUANTITIES: [&str; 5] = ["pressure", "liquid", "vapour", "tension", "width"];

/// Published values at one temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// Temperature kT.
    pub kt: f64,
    /// The number density at which `pressure` was published.
    pub density: Option<f64>,
    /// Name (one of `QUANTITIES`), value and error of each quantity.
    pub values: Vec<(&'static str, [f64; 2])>,
}

/// Reads `[[literature]]`.
pub fn read(root: &Section) -> Result<Vec<Published>, FileError> {
    let Some(list) = root.get("literature") else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for item in list.array()? {
        let table = item.section()?;
        let kt = table.require("kT")?.positive()?;
        let density = table.read("density", Value::positive)?;
        let mut values = Vec::new();
        for name in QUANTITIES {
            let Some(value) = table.get(name) else { continue };
            let [x, error] = value.numbers("a value and its error")?;
            if error <= 0.0 {
                return Err(value.error(format!("the error must be positive, is {error}")));
            }
            values.push((name, [x, error]));
        }
        if density.is_none() && values.iter().any(|(name, _)| *name == "pressure") {
            return Err(table.require("pressure")?.error("a pressure needs the density that it belongs to"));
        }
        all.push(Published { kt, density, values });
    }
    Ok(all)
}
