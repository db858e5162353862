//! psidpd pair styles for LAMMPS: `dpd/psi`, `mdpd/psi` and `dpd/spline`, and the fix styles `dpd/splitting` and
//! `dpd/wall`. LAMMPS loads the entry, in `entry/`, which loads this.
//!
//! - [`style`]: one pair style's engine, in safe Rust; `evaluation`: its forces, in the units of LAMMPS;
//! - [`thermostat`]: drag and noise for the fix; `motion`: its loops over atoms;
//! - `walls`: walls of matter, of the fix `dpd/wall`; `reflection`: how round ones reflect;
//! - [`units`]: one unit of a model in those of LAMMPS; `converted`: conversion of positions,
//!   velocities and forces;
//! - [`bridge`]: the interface to C++, by cxx: slices, strings and exceptions, checked at compile time;
//! - `cpp/`: the styles that LAMMPS sees, compiled against the headers of one LAMMPS;
//! - `table`: the table of styles that the entry reads.
//!
//! The engine keeps its own cells, and leaves out pairs that `special_bonds` weakens or `neigh_modify` excludes; LAMMPS's
//! neighbour list is requested only where it alone knows which pairs act.

pub mod bridge;
mod converted;
mod error;
mod evaluation;
mod motion;
mod reflection;
pub mod style;
pub mod thermostat;
pub mod units;
mod walls;

#[cfg(lammps_host)]
mod table;

#[cfg(lammps_host)]
#[global_allocator]
static ALLOCATOR: psidpd_core::memory::LargePages = psidpd_core::memory::LargePages;
