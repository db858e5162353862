//! What the file with the styles has for the entry: the table that its `psidpd_styles` returns.

use std::ffi::{c_char, c_void};

/// Makes a style for a LAMMPS instance: its arguments are what LAMMPS calls a creator of its kind with.
pub type Creator = unsafe extern "C-unwind" fn();

/// One style. The texts are C strings that stay.
#[repr(C)]
pub struct Style {
    /// `pair` or `fix`.
    pub kind: *const c_char,
    /// As in the commands `pair_style` and `fix`.
    pub name: *const c_char,
    /// What it is, for the log.
    pub info: *const c_char,
    /// What makes it.
    pub creator: Creator,
}

/// All of them.
#[repr(C)]
pub struct Styles {
    /// For which LAMMPS and by which psidpd they were built: [`BUILT`].
    pub built: *const c_char,
    /// How many styles there are.
    pub count: usize,
    /// The first.
    pub first: *const Style,
    /// Puts a creator into the table of styles of its kind of a LAMMPS instance: kind, name, creator.
    pub insert: unsafe extern "C-unwind" fn(*mut c_void, *const c_char, *const c_char, Creator),
}

// SAFETY: all of it is immutable and lives as long as the process.
unsafe impl Sync for Style {}
// SAFETY: as above.
unsafe impl Sync for Styles {}

/// What the two files must agree in.
pub const BUILT: &str = concat!(env!("PSIDPD_LAMMPS_VERSION"), " ", env!("CARGO_PKG_VERSION"), "\0");
