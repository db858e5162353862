//! Converts positions, velocities and results between the units of LAMMPS and those of the model.

use crate::error::StyleError;
use crate::units::Scale;
use psidpd_core::engine::{EngineError, Particles, Request, Step};

/// Positions and velocities in units of the model, and results in those of LAMMPS.
#[derive(Debug, Default)]
pub struct Converted {
    x: Vec<f64>,
    v: Vec<f64>,
    forces: Vec<f64>,
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

impl Converted {
    /// Converts positions, velocities and the time step of LAMMPS to units of the model.
    pub fn take<'a>(&'a mut self, scale: &Scale, request: &Request<'a>) -> Taken<'a> {
        if scale.is_one() {
            return Taken { request: *request, forces: &mut self.forces };
        }
        let Request { particles, v, step, want } = *request;
        let x = times(particles.x.as_flattened(), 1.0 / scale.length, &mut self.x);
        let v = times(v.as_flattened(), 1.0 / scale.velocity(), &mut self.v);
        let step = step.map(|step| Step { dt: step.dt / scale.time, ..step });
        let particles = Particles { x: triples(x), ..particles };
        Taken { request: Request { particles, v: triples(v), step, want }, forces: &mut self.forces }
    }
}

/// A request in units of the model, and room for forces.
pub struct Taken<'a> {
    request: Request<'a>,
    forces: &'a mut Vec<f64>,
}

impl<'a> Taken<'a> {
    /// The particles in units of the model.
    pub fn particles(&self) -> Particles<'a> {
        self.request.particles
    }

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
        for (f, force) in f.iter_mut().zip(&*self.forces) {
            *f += scale.force() * force;
        }
        Ok(result)
    }
}
