//! Converts positions, velocities and results between the units of LAMMPS and those of the model.

use crate::error::StyleError;
use crate::units::Scale;
use psidpd_core::engine::{EngineError, Request};

/// Positions and velocities in units of the model, and results in those of LAMMPS.
#[derive(Debug, Default)]
pub struct Converted {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub forces: Vec<f64>,
    pub densities: Vec<f64>,
    pub excess: Vec<f64>,
}

/// Views a flat array as vectors of three numbers, as LAMMPS stores them.
pub fn triples(flat: &[f64]) -> &[[f64; 3]] {
    flat.as_chunks::<3>().0
}

pub fn times<'a>(numbers: &[f64], factor: f64, out: &'a mut Vec<f64>) -> &'a [f64] {
    out.clear();
    out.extend(numbers.iter().map(|x| x * factor));
    out
}

/// A request in units of the model, and room for forces.
pub struct Taken<'a> {
    pub request: Request<'a>,
    pub forces: &'a mut Vec<f64>,
}

impl Taken<'_> {
    /// Runs `evaluate` on forces in units of the model, and adds them to `f`.
    pub fn add_forces<R>(
        self,
        scale: &Scale,
        f: &mut [f64],
        evaluate: impl FnOnce(&Request, &mut [[f64; 3]]) -> Result<R, EngineError>,
    ) -> Result<R, StyleError> {
        if scale.is_one() {
            return Ok(evaluate(&self.request, f.as_chunks_mut::<3>().0)?);
        }
        self.forces.clear();
        self.forces.resize(f.len(), 0.0);
        let result = evaluate(&self.request, self.forces.as_chunks_mut::<3>().0)?;
        f.iter_mut().zip(&*self.forces).for_each(|(f, force)| *f += scale.force() * force);
        Ok(result)
    }
}
