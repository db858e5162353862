//! `[box]`.

use psidpd_core::document::{FileError, FileErrorKind, Section};
use psidpd_core::engine::PeriodicBox;

/// Reads the box. In two dimensions particles are at z = 0, in the middle of a third edge of 1.
pub fn read(root: &Section, dimensions: usize) -> Result<PeriodicBox, FileError> {
    let section = root.require("box")?.section()?;
    let value = section.require("lengths")?;
    let (origin, lengths) = match dimensions {
        2 => {
            let [x, y] = value.numbers("two lengths, as the model is two-dimensional")?;
            ([0.0, 0.0, -0.5], [x, y, 1.0])
        }
        _ => ([0.0; 3], value.numbers("three lengths")?),
    };
    if let Some(length) = lengths.iter().find(|l| **l <= 0.0) {
        return Err(value.error(FileErrorKind::Value(format!("must be positive, is {length}"))));
    }
    section.finish()?;
    PeriodicBox::orthogonal(origin, lengths, [true; 3])
        .map_err(|e| value.error(FileErrorKind::Value(e.to_string())))
}

/// Refuses a box in which two images of a particle would share the noise of a pair.
pub fn check_width(
    root: &Section,
    domain: &PeriodicBox,
    dimensions: usize,
    range: f64,
) -> Result<(), FileError> {
    let lengths = domain.lengths();
    let Some(length) = lengths[..dimensions].iter().find(|l| **l < 2.0 * range) else {
        return Ok(());
    };
    let value = match root.get("box") {
        Some(value) => value.section()?.require("lengths")?,
        None => root.require("initial")?.section()?.require("file")?,
    };
    let message = format!(
        "a length of {length} is less than twice the range {range} of the thermostat: two images of a \
         particle would be in reach of one neighbour, and both pairs would share their noise"
    );
    Err(value.error(FileErrorKind::Value(message)).with_help(format!(
        "make the box at least {} long, or set thermostat = false in every stage",
        2.0 * range
    )))
}
