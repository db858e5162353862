//! The program `psidpd`: its command line, and its parts under their names for tests and Python.

pub mod cli;

pub use psidpd_dynamics::{checkpoint, run, scene};
pub use psidpd_experiments::{self as experiments, bench};
pub use psidpd_formats as formats;
pub use psidpd_lammps_host::{self as lammps, export};
pub use psidpd_observe as observe;
pub use psidpd_report as report;

#[global_allocator]
static ALLOCATOR: psidpd_core::memory::LargePages = psidpd_core::memory::LargePages;
