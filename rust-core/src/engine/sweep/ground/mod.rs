//! What every pass stands on: geometry, the cell grid, coordinates, packed particles and tables of terms.

pub mod arithmetic;
pub mod box_geometry;
pub mod cell_grid;
pub mod fixed_point;
pub mod pass_data;
pub mod shared_ptr;
pub mod terms;
