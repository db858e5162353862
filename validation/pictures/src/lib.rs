//! Pictures of particles and of fields as pixels, snapshots and films of a run, and its density on a grid.
//!
//! The viewpoint is at infinity, so that lengths in a picture are lengths in the box. [`View`] is the direction of view;
//! [`projection::Projection`] maps points of the box to pixels.

mod animation;
mod balls;
pub mod colour;
mod field;
mod grid;
mod image;
mod lettering;
mod particles;
pub mod projection;
pub mod snapshot;

pub use animation::animate;
pub use field::{Field, FieldOptions, paint_field};
pub use grid::{VTK, density_grid, remove_vtk, vtk_files, write_vtk};
pub use image::{Image, data_url};
pub use particles::{ParticleOptions, draw_coloured, draw_particles};
pub use projection::View;
pub use snapshot::{remove_snapshots, snapshots, write_snapshot};
