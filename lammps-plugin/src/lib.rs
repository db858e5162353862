//! LAMMPS pair styles.
