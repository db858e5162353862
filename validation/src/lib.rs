//! psidpd: native runner and cross-code validator.
pub mod bench;
pub mod bulk;
pub mod calibrate;
pub mod check;
pub mod checkpoint;
pub mod cli;
pub mod crosscheck;
pub mod export;
pub mod files;
pub mod hardcases;
pub mod lammps;
pub mod observe;
pub mod output;
pub mod papers;
pub mod pareto;
pub mod particles;
pub mod report;
pub mod run;
pub mod scene;

#[global_allocator]
static ALLOCATOR: psidpd_core::memory::LargePages = psidpd_core::memory::LargePages;
