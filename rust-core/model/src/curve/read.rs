use super::{Spline, SplineError};
use crate::document::{Columns, FileError, Value};
use std::path::Path;

/// The spline through the rows of the file that `value` names.
pub fn read_spline(value: &Value, directory: &Path, names: [&str; 2]) -> Result<Spline, FileError> {
    let mut table = Columns::read(value, directory, names)?;
    let [x, y] = std::mem::take(&mut table.columns);
    Spline::new(x, y).map_err(|error| {
        let row = match error {
            SplineError::NotMonotone(row) => row,
            _ => usize::MAX,
        };
        table.error(row, &error.to_string())
    })
}
