//! The contract between the entry and the file with the styles: the table that `psidpd_styles` returns.

use std::ffi::{c_char, c_void};

/// Makes a style for a LAMMPS instance. The real signature is that of LAMMPS's creators of the style's kind.
pub type Creator = unsafe extern "C-unwind" fn();

/// A style. Its texts are static C strings.
#[repr(C)]
pub struct Style {
    /// Command of the style: `pair` or `fix`.
    pub kind: *const c_char,
    /// Name of the style in the commands `pair_style` and `fix`.
    pub name: *const c_char,
    /// Description of the style, for the log.
    pub info: *const c_char,
    pub creator: Creator,
}

#[repr(C)]
pub struct Styles {
    /// The LAMMPS, a digest of its headers and the psidpd version of the build: [`BUILT`].
    pub built: *const c_char,
    /// Number of styles.
    pub count: usize,
    /// First element of an array of `count` styles.
    pub first: *const Style,
    /// Registers a creator in a LAMMPS instance: arguments are instance, kind, name and creator.
    pub insert: unsafe extern "C-unwind" fn(*mut c_void, *const c_char, *const c_char, Creator),
}

// SAFETY: a style is immutable, and its pointers lead to statics.
unsafe impl Sync for Style {}
// SAFETY: the table is immutable, and its pointers lead to statics.
unsafe impl Sync for Styles {}

/// The versions in which the two files must agree.
pub const BUILT: &str = concat!(
    env!("PSIDPD_LAMMPS_VERSION"),
    " ",
    env!("PSIDPD_LAMMPS_HEADERS"),
    " ",
    env!("CARGO_PKG_VERSION"),
    "\0"
);
