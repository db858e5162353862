//! Exports to the formats of other codes.

pub mod eam;
pub mod lammps;
