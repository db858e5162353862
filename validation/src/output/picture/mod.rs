//! Pictures of particles and of fields, as pixels.
//!
//! A picture is seen from infinitely far, so that lengths in it are lengths in the box: [`View`] says from
//! where, [`Projection`] where a point of the box comes to lie.

pub mod colour;
mod field;
mod image;
mod particles;
mod projection;

pub use field::{Field, FieldOptions, paint_field};
pub use image::Image;
pub(crate) use image::data_url;
pub use particles::{ParticleOptions, draw_coloured, draw_particles};
pub use projection::View;
