//! Driving LAMMPS.
