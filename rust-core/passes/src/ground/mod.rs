//! The basis of all other modules: geometry, the cell grid, fixed-point coordinates, packed particles,
//! and the terms of a fluid as tables.

pub mod arithmetic;
pub mod box_geometry;
pub mod cell_grid;
pub mod fixed_point;
pub mod species_pairs;
pub mod terms;
