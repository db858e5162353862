//! Converts positions, velocities and results between the units of LAMMPS and those of the model.

use crate::error::StyleError;
use crate::units::Scale;
use psidpd_core::engine::{EngineError, Step};

/// Positions and velocities in units of the model, and results in those of LAMMPS.
#[derive(Debug, Default)]
pub struct Converted {
    x: Vec<f64>,
    v: Vec<f64>,
    forces: Vec<f64>,
    pub densities: Vec<f64>,
    pub excess: Vec<f64>,
}

pub fn times<'a>(numbers: &[f64], factor: f64, out: &'a mut Vec<f64>) -> &'a [f64] {
    out.clear();
    out.extend(numbers.iter().map(|x| x * factor));
    out
}

impl Converted {
    /// Converts positions and velocities of LAMMPS to units of the model.
    pub fn take<'a>(
        &'a mut self,
        scale: &Scale,
        x: &'a [f64],
        v: &'a [f64],
        step: Option<Step>,
    ) -> Taken<'a> {
        if scale.is_one() {
            return Taken { x, v, step, forces: &mut self.forces };
        }
        Taken {
            x: times(x, 1.0 / scale.length, &mut self.x),
            v: times(v, 1.0 / scale.velocity(), &mut self.v),
            step: step.map(|step| Step { dt: step.dt / scale.time, ..step }),
            forces: &mut self.forces,
        }
    }
}

/// Positions and velocities in units of the model, and room for forces.
pub struct Taken<'a> {
    pub x: &'a [f64],
    pub v: &'a [f64],
    pub step: Option<Step>,
    forces: &'a mut Vec<f64>,
}

impl Taken<'_> {
    /// Runs `evaluate` on forces in units of the model, and adds them to `f`.
    pub fn add_forces<R>(
        self,
        scale: &Scale,
        f: &mut [f64],
        evaluate: impl FnOnce(&mut [[f64; 3]]) -> Result<R, EngineError>,
    ) -> Result<R, StyleError> {
        if scale.is_one() {
            return Ok(evaluate(f.as_chunks_mut::<3>().0)?);
        }
        self.forces.clear();
        self.forces.resize(f.len(), 0.0);
        let result = evaluate(self.forces.as_chunks_mut::<3>().0)?;
        for (f, force) in f.iter_mut().zip(&*self.forces) {
            *f += scale.force() * force;
        }
        Ok(result)
    }
}
