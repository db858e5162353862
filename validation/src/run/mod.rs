//! The native host: owns particles, makes their periodic images, integrates, and writes files.
//!
//! [`Simulation`] is the part without files: a [`State`], the engine, and steps. [`run_scene`] drives
//! it through the stages of a [`Scene`](crate::scene::Scene) and writes what the scene asks for.

mod body_force;
mod dump;
mod error;
pub mod integrator;
mod restart;
mod runner;
mod simulation;
mod state;
mod summary;
mod tags;
mod thermo;
mod walls;

pub use body_force::BodyForce;
pub use dump::write_frame;
pub use error::RunError;
pub use integrator::Integrator;
pub use restart::write_data;
pub use runner::{Progress, run_scene};
pub use simulation::Simulation;
pub use state::State;
pub use summary::{Means, Summary};
pub use tags::Tags;
pub use thermo::Thermo;

#[cfg(test)]
mod tests;
