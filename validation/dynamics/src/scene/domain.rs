//! `[box]`, or `box = …`: the lengths and boundaries of the box.

use super::{FileError, PeriodicBox, Section, Value};

/// The names of boundaries, and whether they are periodic.
pub const BOUNDARIES: [(&str, bool); 2] = [("periodic", true), ("reflecting", false)];

/// Reads the box. In two dimensions particles lie at z = 0, in the middle of a third edge of length 1.
pub fn read(root: &Section, dimensions: usize) -> Result<PeriodicBox, FileError> {
    let value = root.require("box")?;
    let Some(section) = value.as_section() else { return build(&value, dimensions, [true; 3]) };
    let lengths = section.require("lengths")?;
    let periodic = read_boundary(&section, dimensions)?;
    build(&lengths, dimensions, periodic.unwrap_or([true; 3]))
}

/// Reads the boundary of a scene that has its box from a file; `None` if the scene gives no boundary.
pub fn read_boundary_alone(root: &Section, dimensions: usize) -> Result<Option<[bool; 3]>, FileError> {
    let Some(value) = root.get("box") else { return Ok(None) };
    let message = || "the initial file gives the box: remove the lengths".to_owned();
    let section = value.as_section().ok_or_else(|| value.error(message()))?;
    if let Some(lengths) = section.get("lengths") {
        return Err(lengths.error(message()));
    }
    read_boundary(&section, dimensions)
}

fn build(value: &Value, dimensions: usize, periodic: [bool; 3]) -> Result<PeriodicBox, FileError> {
    let lengths = read_lengths(value, dimensions)?;
    if let Some(length) = lengths.iter().find(|l| **l <= 0.0) {
        return Err(value.error(format!("must be positive, is {length}")));
    }
    let origin = if dimensions == 2 { [0.0, 0.0, -0.5] } else { [0.0; 3] };
    PeriodicBox::orthogonal(origin, lengths, periodic).map_err(|e| value.error(e.to_string()))
}

/// Reads one length for each direction, or one for all.
fn read_lengths(value: &Value, dimensions: usize) -> Result<[f64; 3], FileError> {
    let third = |z: f64| if dimensions == 2 { 1.0 } else { z };
    if value.as_number().is_some() {
        let length = value.positive()?;
        return Ok([length, length, third(length)]);
    }
    match dimensions {
        2 => value.numbers("two lengths, as the model is two-dimensional").map(|[x, y]| [x, y, third(1.0)]),
        _ => value.numbers("three lengths"),
    }
}

fn read_boundary(section: &Section, dimensions: usize) -> Result<Option<[bool; 3]>, FileError> {
    let mut periodic = [true; 3];
    let Some(value) = section.get("boundary") else { return Ok(None) };
    match value.as_array() {
        None => periodic[..dimensions].fill(value.one_of("boundary", &BOUNDARIES)?),
        Some(items) if items.len() == dimensions => {
            for (periodic, item) in periodic.iter_mut().zip(items) {
                *periodic = item.one_of("boundary", &BOUNDARIES)?;
            }
        }
        Some(items) => {
            return Err(value
                .error(format!("expected one for each of {dimensions} directions, found {}", items.len())));
        }
    }
    Ok(Some(periodic))
}

/// Refuses a box so narrow that two images of a particle would share the noise of a pair.
pub fn check_width(
    root: &Section,
    domain: &PeriodicBox,
    dimensions: usize,
    range: f64,
) -> Result<(), FileError> {
    let (lengths, periodic) = (domain.lengths(), domain.periodic());
    let narrow = |k: &usize| periodic[*k] && lengths[*k] < 2.0 * range;
    let Some(length) = (0..dimensions).find(narrow).map(|k| lengths[k]) else {
        return Ok(());
    };
    let lengths = root.get("box").map(|value| match value.as_section() {
        Some(section) => section.get("lengths"),
        None => Some(value),
    });
    let value = match lengths.flatten() {
        Some(value) => value,
        None => root.require("initial")?.section()?.require("file")?,
    };
    Err(value
        .error(format!(
            "a length of {length} is less than twice the range {range} of the thermostat: two images of a \
         particle would be in reach of one neighbour, and both pairs would share their noise"
        ))
        .with_help(format!(
            "make the box at least {} long, or set thermostat = false in every stage",
            2.0 * range
        )))
}
