//! Vectors and names of directions.

use super::{FileError, Value};

/// Reads one number for each dimension; in two dimensions the third is 0.
pub fn vector(value: &Value, dimensions: usize) -> Result<[f64; 3], FileError> {
    match dimensions {
        2 => value.numbers("two numbers, as the model is two-dimensional").map(|[x, y]| [x, y, 0.0]),
        _ => value.numbers("three numbers"),
    }
}

pub const AXES: [(&str, usize); 3] = [("x", 0), ("y", 1), ("z", 2)];

pub fn axis(value: &Value, dimensions: usize) -> Result<usize, FileError> {
    value.one_of("axis", &AXES[..dimensions])
}
