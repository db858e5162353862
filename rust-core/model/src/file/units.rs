//! The units of a model's numbers.

use crate::document::{FileError, FileErrorKind, Section};

/// The units of a model, in SI. The unit of time is `length √(mass/energy)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Unit of length, in metres.
    pub length: f64,
    /// Unit of mass, in kilograms.
    pub mass: f64,
    /// Unit of energy, in joules.
    pub energy: f64,
}

/// Reads `[units]`, if it is there.
pub fn read(root: &Section) -> Result<Option<Units>, FileError> {
    let Some(value) = root.get("units") else {
        return Ok(None);
    };
    let table = value.section()?;
    let positive = |key: &str| {
        let value = table.require(key)?;
        match value.number()?.value {
            number if number > 0.0 && number.is_finite() => Ok(number),
            number => Err(value.error(FileErrorKind::Value(format!("must be positive, is {number}")))),
        }
    };
    Ok(Some(Units { length: positive("length")?, mass: positive("mass")?, energy: positive("energy")? }))
}
