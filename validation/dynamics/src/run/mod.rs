//! The native host: owns particles, makes their periodic images, integrates, and writes files.
//!
//! [`Simulation`] is the part without files: a [`State`], the engine and the steps. A [`Runner`] drives a
//! simulation through the stages of a [`Scene`](crate::scene::Scene), writes the requested files, and can
//! stop and resume by its [`checkpoint`]s; [`run_scene`] runs a scene without interruption.

mod about;
mod advice;
mod bounce;
mod bounds;
mod checkpoints;
mod error;
mod folder;
mod frames;
mod growing;
mod integrator;
mod length;
mod live;
mod looks;
mod memory;
mod outcome;
mod output;
mod reorder;
mod runner;
mod scene;
mod simulation;
mod thermo;
mod timing;
mod underway;
mod view;
mod watch;

pub use crate::checkpoint::{self, Means, Sums, Thermo};
pub use crate::integrator::Integrator;
pub use crate::particles::{BodyForce, State, StateError, Tags};
pub use advice::Advice;
pub(crate) use bounds::Surfaces;
pub use error::RunError;
pub use folder::Folder;
pub use length::Length;
pub use live::Live;
pub use memory::{bytes, check_memory};
pub use outcome::{Outcome, Progress, Summary};
pub use output::FILES;
pub use reorder::INTERVAL as REORDERING;
pub use runner::{Begin, Runner, Start, run_scene};
pub use simulation::Simulation;
pub use timing::{Iterations, Session, Timing};
pub use watch::{Deviation, Thermometer};

#[cfg(test)]
mod tests;
