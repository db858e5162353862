//! The particles in the order of cells, as the passes over pairs read them. `workspace::sort` fills these arrays.

pub mod ghosts;
pub mod sorted;
