//! Vectors and names of directions.

use super::{FileError, Value};
pub use psidpd_observe::options::AXES;

/// Reads one number for each dimension; in two dimensions the third is 0.
pub fn vector(value: &Value, dimensions: usize) -> Result<[f64; 3], FileError> {
    match dimensions {
        2 => value.numbers("two numbers, as the model is two-dimensional").map(|[x, y]| [x, y, 0.0]),
        _ => value.numbers("three numbers"),
    }
}

pub fn axis(value: &Value, dimensions: usize) -> Result<usize, FileError> {
    value.one_of("axis", &AXES[..dimensions])
}
