//! The file that LAMMPS loads. It links to the C library only, so that any LAMMPS can load it and learn which LAMMPS
//! the styles were built for. The styles are in a second file beside it, which links to the C++ of that LAMMPS.
//!
//! - `entry`: `lammpsplugin_init`, which `plugin load` calls, and `psidpd_register`, for a LAMMPS without plugins;
//! - `styles`: loads the second file, whose contract is `table`;
//! - `host`: finds out which release of LAMMPS this process has, and where its headers are, which `headers` compares;
//! - `version`: the date of a LAMMPS version in words;
//! - `whole`: checks whether the second file is complete.

#[cfg(lammps_host)]
mod entry;
#[cfg(any(lammps_host, test))]
mod headers;
#[cfg(lammps_host)]
mod host;
#[cfg(lammps_host)]
mod styles;
#[cfg(lammps_host)]
mod table;
#[cfg(any(lammps_host, test))]
mod version;
#[cfg(lammps_host)]
mod whole;
