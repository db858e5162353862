//! Numbers with a range, vectors and names of directions.

use psidpd_core::document::{FileError, FileErrorKind, Value};

/// Reads a number above zero.
pub fn positive(value: &Value) -> Result<f64, FileError> {
    let number = value.number()?.value;
    if number > 0.0 {
        Ok(number)
    } else {
        Err(value.error(FileErrorKind::Value(format!("must be positive, is {number}"))))
    }
}

/// Reads one number for each dimension; in two dimensions the third is 0.
pub fn vector(value: &Value, dimensions: usize) -> Result<[f64; 3], FileError> {
    match dimensions {
        2 => value.numbers("two numbers, as the model is two-dimensional").map(|[x, y]| [x, y, 0.0]),
        _ => value.numbers("three numbers"),
    }
}

pub const AXES: [(&str, usize); 3] = [("x", 0), ("y", 1), ("z", 2)];

pub fn axis(value: &Value, dimensions: usize) -> Result<usize, FileError> {
    Ok(value.one_of("axis", &AXES[..dimensions])?.value)
}
