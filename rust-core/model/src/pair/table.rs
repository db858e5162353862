use super::{FormEntry, PairForm};
use crate::curve::{Spline, read_spline};
use crate::document::keys::{Key, OPTIONAL, REQUIRED, ValueKind, keys};
use crate::document::{FileError, Place, Section};
use crate::number::Number;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A potential given by a table of `r` and `φ`: the cubic spline through its rows, not shifted, so that
/// the table should end at zero. Below the first row φ′ continues linearly.
#[derive(Debug, Clone)]
pub struct TablePair {
    /// The spline through the rows.
    pub spline: Arc<Spline>,
    /// The distance at which it is cut.
    pub range: f64,
}

/// The form `table` in the model file.
#[derive(Debug, Clone)]
pub struct TableEntry {
    spline: Arc<Spline>,
    /// The name of the file in the model.
    file: Place,
    range: Option<Number>,
}

impl FormEntry for TableEntry {
    type Form = TablePair;

    const KEYS: &'static [Key] = keys! {
        "file": ValueKind::TableFile, REQUIRED,
            "Rows of `r` and `phi`, as for a table of psi; the cubic spline through them. It is not shifted, \
             and must end at 0."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"table\"\nfile = \"phi.txt\"";
        "range": ValueKind::NumberOrFormula, OPTIONAL,
            "The distance at and beyond which the potential is zero; the last `r` of the table if left out."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"table\"\nfile = \"phi.txt\"\nrange = 1.0";
    };

    fn read(table: &Section, directory: &Path) -> Result<TableEntry, FileError> {
        let file = table.require("file")?;
        Ok(TableEntry {
            spline: Arc::new(read_spline(&file, directory, ["r", "phi"])?),
            file: file.place.clone(),
            range: table.read("range", Number::read)?,
        })
    }

    fn bind(&self, constants: &BTreeMap<String, f64>) -> Result<TablePair, FileError> {
        let [_, last] = self.spline.ends();
        let range = match &self.range {
            Some(number) => number.positive(constants)?,
            None => last,
        };
        if let Some(number) = self.range.as_ref().filter(|_| range > last) {
            let message = format!("is beyond the last r of the table, {last}");
            return Err(number.evaluate(constants)?.error(message));
        }
        check(&self.spline, range).map_err(|message| self.file.error(message))?;
        Ok(TablePair { spline: Arc::clone(&self.spline), range })
    }
}

/// Refuses a potential that jumps at its range, which would not conserve energy.
fn check(spline: &Spline, range: f64) -> Result<(), String> {
    let [first, _] = spline.ends();
    if !(first >= 0.0 && range > first) {
        return Err(format!("goes from r = {first} to {range}: r must rise from 0 or more"));
    }
    let largest = (0..=1000)
        .map(|k| spline.at(first + (range - first) * k as f64 / 1000.0)[0].abs())
        .fold(0.0, f64::max);
    let end = spline.at(range)[0];
    if end.abs() > 1e-6 * largest {
        return Err(format!(
            "phi is {end} at the range {range}: it must end at 0, or energy is not conserved"
        ));
    }
    Ok(())
}

impl PairForm for TablePair {
    fn range(&self) -> f64 {
        self.range
    }

    #[inline(always)]
    fn at(&self, r: f64) -> (f64, f64) {
        let [phi, slope, _] = self.spline.at(r);
        (phi, slope)
    }
}
