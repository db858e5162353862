//! `ψ` as a function of one total density: a table, or an equation of state.

mod pressure;
pub mod pressure_table;
mod primitive;
mod spline;

pub use pressure::Pressure;
pub use spline::{Spline, SplineError};

use crate::document::{Columns, FileError, Value};
use std::path::Path;
use std::sync::Arc;

/// `ψ(n)` of the total of one density, `n = Σ_β ñ_β`.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Index of the density in [`Fluid::densities`](super::Fluid::densities).
    pub density: usize,
    /// The function `ψ(n)`.
    pub form: CurveForm,
}

/// The source of a curve.
#[derive(Debug, Clone)]
pub enum CurveForm {
    /// A spline through a table of `ψ(n)`.
    Table(Arc<Spline>),
    /// An equation of state `p(ρ)`.
    Pressure(Arc<Pressure>),
}

/// `ψ`, `ψ′` and `ψ″` of a block of densities.
#[derive(Debug, Clone, Default)]
pub struct CurveBlock {
    /// Values `ψ(n)`.
    pub psi: Vec<f64>,
    /// Slopes `ψ′(n)`.
    pub slope: Vec<f64>,
    /// Second derivatives `ψ″(n)`.
    pub curvature: Vec<f64>,
    work: Vec<f64>,
}

impl Curve {
    /// `ψ`, `ψ′` and `ψ″` at every `n`; where ψ is singular they are infinite or NaN.
    pub fn block(&self, n: &[f64], to: &mut CurveBlock) {
        for list in [&mut to.psi, &mut to.slope, &mut to.curvature] {
            list.resize(n.len(), 0.0);
        }
        match &self.form {
            CurveForm::Table(spline) => {
                for (lane, n) in n.iter().enumerate() {
                    [to.psi[lane], to.slope[lane], to.curvature[lane]] = spline.at(*n);
                }
            }
            CurveForm::Pressure(pressure) => pressure.block(n, to),
        }
    }

    /// `[ψ, ψ′, ψ″]` at one density.
    pub fn at(&self, n: f64) -> [f64; 3] {
        let mut block = CurveBlock::default();
        self.block(&[n], &mut block);
        [block.psi[0], block.slope[0], block.curvature[0]]
    }

    /// Describes the curve in words.
    pub fn describe(&self) -> String {
        match &self.form {
            CurveForm::Table(spline) => {
                let [low, high] = spline.ends();
                format!("table of {} points from {low} to {high}", spline.pieces().0.len())
            }
            CurveForm::Pressure(pressure) => format!("from the pressure {}", pressure.text),
        }
    }
}

/// The spline through the rows of the file that `value` names.
pub(crate) fn read_spline(value: &Value, directory: &Path, names: [&str; 2]) -> Result<Spline, FileError> {
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
