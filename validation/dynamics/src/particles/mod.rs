//! Particles and body forces, which scenes, runs and files build on.

mod body_force;
mod box_by_edges;
mod data_file;
mod state;
mod tags;
mod thermal;

pub use body_force::BodyForce;
pub use data_file::StateError;
pub use state::State;
pub use tags::Tags;
pub use thermal::maxwell;
