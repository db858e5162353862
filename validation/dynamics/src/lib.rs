//! Molecular dynamics: particles, integrators, scenes, runs and their checkpoints.

#[cfg(test)]
extern crate self as psidpd_dynamics;

pub mod checkpoint;
pub mod device;
pub mod freezing;
pub mod integrator;
pub mod particles;
pub mod prediction;
pub mod run;
pub mod scene;
#[cfg(test)]
mod tests;
pub mod trial;
