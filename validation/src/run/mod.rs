//! The native host: owns particles, makes their periodic images, integrates, and writes files.
//!
//! [`Simulation`] is the part without files: a [`State`], the engine, and steps. A [`Runner`]
//! drives it through the stages of a [`Scene`](crate::scene::Scene), writes what the scene asks for, and
//! can be stopped and taken up again by its [`checkpoint`]s; [`run_scene`] is one that nothing interrupts.

mod body_force;
mod bounds;
mod by_tag;
pub mod checkpoint;
mod dump;
mod error;
mod folder;
mod forces;
mod growing;
pub mod integrator;
mod output;
pub(crate) mod reach;
mod reorder;
mod restart;
mod runner;
mod simulation;
mod state;
mod summary;
mod tags;
mod thermo;
mod timing;
mod underway;
mod walls;

pub use body_force::{BodyForce, Drive};
pub use dump::write_frame;
pub use error::RunError;
pub use integrator::Integrator;
pub(crate) use reorder::INTERVAL as REORDERING;
pub use restart::write_data;
pub use runner::{Begin, Outcome, Progress, Runner, Start, run_scene};
pub use simulation::Simulation;
pub use state::State;
pub use summary::{Means, Summary, Sums};
pub use tags::Tags;
pub use thermo::Thermo;
pub use timing::{Session, Timing};

#[cfg(test)]
mod tests;
