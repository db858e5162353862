//! `[masses]`: the mass of each species.

use super::{FileError, Initial, Section};

/// Reads the masses; by default those of the data file, or 1.
pub fn read(root: &Section, species: &[String], initial: &Initial) -> Result<Vec<f64>, FileError> {
    let mut mass = match initial {
        Initial::Parts(_) => vec![1.0; species.len()],
        Initial::File { state, .. } => state.mass.clone(),
    };
    let Some(value) = root.get("masses") else { return Ok(mass) };
    for (name, value) in value.section()?.entries() {
        mass[name.among("species", species.iter().zip(0usize..))?] = value.positive()?;
    }
    Ok(mass)
}
