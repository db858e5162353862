//! Pictures of particles and of fields, as pixels; snapshots of a run, and films of them.
//!
//! A picture is seen from infinitely far, so that lengths in it are lengths in the box: [`View`] says from
//! where, [`projection::Projection`] where a point of the box comes to lie.

mod animation;
pub mod colour;
mod field;
mod image;
mod particles;
pub mod projection;
pub mod snapshot;

pub use animation::{animate, animation_url};
pub use field::{Field, FieldOptions, paint_field};
pub use image::{Image, data_url};
pub use particles::{ParticleOptions, draw_coloured, draw_particles};
pub use projection::View;
pub use snapshot::{remove_snapshots, write_snapshot};
