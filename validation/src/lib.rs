//! psidpd: native runner and cross-code validator.
pub mod bench;
mod bulk;
mod calibrate;
mod check;
pub mod checkpoint;
pub mod cli;
mod crosscheck;
pub mod export;
mod files;
mod from_eos;
mod hardcases;
mod integrator;
pub mod lammps;
mod least_squares;
mod measure;
mod memory;
pub mod observe;
mod output;
mod papers;
mod pareto;
mod particles;
mod prediction;
pub mod report;
pub mod run;
pub mod scene;
mod sweep;
#[cfg(test)]
mod test_support;
mod theory_page;

#[global_allocator]
static ALLOCATOR: psidpd_core::memory::LargePages = psidpd_core::memory::LargePages;
