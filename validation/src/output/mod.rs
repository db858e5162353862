//! What a run leaves for other programs and for the eye: frames, descriptions, pictures.
//!
//! Writers are functions of one [`Frame`] without memory between frames, so that a file that was cut back
//! to the end of a frame can be continued. [`Configuration`] is a frame read from a file, of whichever of
//! the formats that psidpd writes. [`picture`] makes pixels of it.

pub mod about;
mod animation;
mod configuration;
mod error;
mod frame;
pub mod picture;
pub mod snapshot;
mod xyz;

pub use about::{About, AboutDensity, AboutStage, Expected, THERMO};
pub use animation::{animate, animation_url};
pub use configuration::{Configuration, Which};
pub use error::OutputError;
pub use frame::Frame;
pub use snapshot::{remove_snapshots, write_snapshot};
pub use xyz::{read_xyz, write_xyz};
