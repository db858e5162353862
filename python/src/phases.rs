//! Mean-field phases as rows of a table.

use crate::errors::{exception, wrong};
use psidpd_core::model::Model;
use psidpd_core::theory::{MeanField, TheoryError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Named numbers, and a note on missing ones.
pub struct Row {
    values: Vec<(&'static str, f64)>,
    note: String,
}

impl Row {
    /// Adds the values of an answer; if there is none, adds NaN and the reason.
    fn put<T>(
        &mut self,
        names: &[&'static str],
        answer: Result<T, TheoryError>,
        values: impl FnOnce(T) -> Vec<f64>,
    ) {
        let found = match answer {
            Ok(found) => values(found),
            Err(why) => {
                let why = why.to_string();
                if !self.note.contains(&why) {
                    self.note.push_str(if self.note.is_empty() { "" } else { "; " });
                    self.note.push_str(&why);
                }
                Vec::new()
            }
        };
        self.values.extend(
            names.iter().enumerate().map(|(k, name)| (*name, found.get(k).copied().unwrap_or(f64::NAN))),
        );
    }
}

/// The phases of `model` at one temperature. Two species need a total density.
pub fn row(model: &Model, kt: f64, density: Option<f64>) -> PyResult<Row> {
    let theory = MeanField::new(&model.at(kt).map_err(exception)?).map_err(exception)?;
    let mut row = Row { values: vec![("kT", kt)], note: String::new() };
    let ends = |intervals: Vec<[f64; 2]>| match (intervals.first(), intervals.last()) {
        (Some(first), Some(last)) => vec![first[0], last[1]],
        _ => Vec::new(),
    };
    match (model.species().len(), density) {
        (1, _) => {
            row.put(&["vapour", "liquid", "pressure"], theory.binodal(), |b| {
                vec![b.vapour, b.liquid, b.pressure]
            });
            row.put(&["spinodal_low", "spinodal_high"], theory.spinodal(), ends);
            row.put(&["tension", "width"], theory.interface(201), |i| vec![i.tension, i.width]);
        }
        (2, Some(density)) => {
            let binodal = theory.composition_binodal(density);
            row.put(&["composition_low", "composition_high", "pressure"], binodal, |b| {
                vec![b.composition[0], b.composition[1], b.pressure[0]]
            });
            row.put(&["spinodal_low", "spinodal_high"], theory.composition_spinodal(density), ends);
            let interface = theory.composition_interface(density, 201);
            row.put(&["tension", "width"], interface, |i| vec![i.tension, i.width]);
        }
        (2, None) => {
            return Err(wrong("a mixture needs its total number density: phase_diagram(kT, density=…)"));
        }
        (species, _) => {
            return Err(wrong(format!(
                "phase diagrams are for one or two species, this model has {species}"
            )));
        }
    }
    Ok(row)
}

/// Rows as a pandas DataFrame.
pub fn frame<'py>(py: Python<'py>, rows: &[Row]) -> PyResult<Bound<'py, PyAny>> {
    let list = PyList::empty(py);
    for row in rows {
        let entry = PyDict::new(py);
        for (name, value) in &row.values {
            entry.set_item(name, value)?;
        }
        entry.set_item("note", &row.note)?;
        list.append(entry)?;
    }
    py.import("pandas")?.call_method1("DataFrame", (list,))
}
