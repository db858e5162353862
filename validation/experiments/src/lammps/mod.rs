//! LAMMPS in experiments: [`host`] runs scripts, [`style`] and [`deck`] write them, [`log`] and [`frames`] read what comes of
//! them.

pub mod deck;
pub mod frames;
pub mod host;
pub mod log;
pub mod style;
