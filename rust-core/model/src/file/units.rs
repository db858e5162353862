//! The units of a model's numbers.

use crate::document::{FileError, Section};

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
    let Some(value) = root.get("units") else { return Ok(None) };
    let table = value.section()?;
    let positive = |key: &str| table.require(key)?.positive();
    Ok(Some(Units { length: positive("length")?, mass: positive("mass")?, energy: positive("energy")? }))
}
