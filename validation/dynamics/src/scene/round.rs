//! The surfaces of round walls: cylinders and spheres.

use super::number::{axis, vector};
use super::{FileError, PeriodicBox, Section, Value};
use psidpd_core::model::wall::Round;

/// Round surfaces, by whether they have an axis.
pub const SHAPES: [(&str, bool); 2] = [("cylinder", true), ("sphere", false)];

/// Where the fluid of a round wall is.
pub const FLUIDS: [(&str, bool); 2] = [("inside", true), ("outside", false)];

/// Keys of round walls alone.
const OF_ROUND: [&str; 4] = ["radius", "center", "axis", "fluid"];

/// The round surfaces of a scene's walls.
pub fn rounds(root: &Section, dimensions: usize, domain: &PeriodicBox) -> Result<Vec<Round>, FileError> {
    let mut all = Vec::new();
    for item in root.read("wall", Value::array)?.unwrap_or_default() {
        all.extend(read_round(&item.section()?, dimensions, domain)?);
    }
    Ok(all)
}

/// Reads the round surface of a wall; `None` for one with faces.
pub fn read_round(
    section: &Section,
    dimensions: usize,
    domain: &PeriodicBox,
) -> Result<Option<Round>, FileError> {
    let Some(shape) = section.get("shape") else {
        let stray = OF_ROUND.iter().find_map(|key| section.get(key));
        return match stray {
            Some(value) => {
                Err(value.error("belongs to a round wall").with_help("shape = \"cylinder\" or \"sphere\""))
            }
            None => Ok(None),
        };
    };
    if let Some(faces) = section.get("faces") {
        return Err(faces.error("the wall has a shape too: give faces of the box, or a shape"));
    }
    let has_axis = shape.one_of("shape", &SHAPES[usize::from(dimensions == 2)..])?;
    let along = match section.get("axis") {
        Some(value) if !has_axis => return Err(value.error("a sphere has no axis")),
        Some(value) => Some(axis(&value, dimensions)?),
        None => has_axis.then_some(2),
    };
    let across = [0, 1, 2].map(|c| c < dimensions && along != Some(c));
    let (low, lengths) = (domain.origin(), domain.lengths());
    let mut center = std::array::from_fn(|c| low[c] + 0.5 * lengths[c]);
    if let Some(value) = section.get("center") {
        if has_axis && value.as_array().is_some_and(|items| items.len() == 2) {
            let [a, b] = value.numbers("two numbers")?;
            (0..3).filter(|c| across[*c]).zip([a, b]).for_each(|(c, x)| center[c] = x);
        } else {
            center = vector(&value, dimensions)?;
        }
    }
    let radius = section.require("radius")?.positive()?;
    let inside = section.require("fluid")?.one_of("fluid", &FLUIDS)?;
    Ok(Some(Round { across, center, radius, inside }))
}
