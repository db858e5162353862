//! `[masses]`: the mass of each species.

use super::composition::unknown_species;
use super::{FileError, Initial, Section};

/// Reads the masses; by default those of the data file, or 1.
pub fn read(root: &Section, species: &[String], initial: &Initial) -> Result<Vec<f64>, FileError> {
    let mut mass = match initial {
        Initial::Parts(_) => vec![1.0; species.len()],
        Initial::File { state, .. } => state.mass.clone(),
    };
    let Some(value) = root.get("masses") else { return Ok(mass) };
    let section = value.section()?;
    for (name, value) in section.entries() {
        let Some(index) = species.iter().position(|s| *s == name.value) else {
            let kind = unknown_species(&name.value, species);
            return Err(name.error(kind));
        };
        mass[index] = value.positive()?;
    }
    Ok(mass)
}
