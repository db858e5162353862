//! The particles in the order of cells, as the passes over pairs read them.
//! `workspace::sorted_particles` sorts them.

pub mod excluded;
pub mod sorted;
