//! The table of styles that the entry reads.

#[path = "../entry/src/table.rs"]
mod contract;

use contract::{BUILT, Creator, Style, Styles};
use std::ffi::{CStr, c_char, c_int, c_void};

/// Signature of the function by which LAMMPS makes a pair style.
type MakePair = unsafe extern "C-unwind" fn(*mut c_void) -> *mut c_void;
/// Signature of the function by which LAMMPS makes a fix, with the arguments of the command.
type MakeFix = unsafe extern "C-unwind" fn(*mut c_void, c_int, *mut *mut c_char) -> *mut c_void;

unsafe extern "C-unwind" {
    fn psidpd_create_dpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_mdpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_dpd_spline(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_dpd_splitting(lmp: *mut c_void, narg: c_int, arg: *mut *mut c_char) -> *mut c_void;
    fn psidpd_create_dpd_wall(lmp: *mut c_void, narg: c_int, arg: *mut *mut c_char) -> *mut c_void;
    fn psidpd_insert_style(lmp: *mut c_void, kind: *const c_char, name: *const c_char, creator: Creator);
}

const fn style(name: &'static CStr, info: &'static CStr, creator: MakePair) -> Style {
    // SAFETY: all function pointers have one size; LAMMPS calls this one by the signature that `kind` states.
    let creator = unsafe { std::mem::transmute::<MakePair, Creator>(creator) };
    Style { kind: c"pair".as_ptr(), name: name.as_ptr(), info: info.as_ptr(), creator }
}

const fn fix(name: &'static CStr, info: &'static CStr, creator: MakeFix) -> Style {
    // SAFETY: all function pointers have one size; LAMMPS calls this one by the signature that `kind` states.
    let creator = unsafe { std::mem::transmute::<MakeFix, Creator>(creator) };
    Style { kind: c"fix".as_ptr(), name: name.as_ptr(), info: info.as_ptr(), creator }
}

static STYLES: [Style; 5] = [
    style(c"dpd/psi", c"many-body DPD of any excess free energy", psidpd_create_dpd_psi),
    style(
        c"mdpd/psi",
        c"Warren's A/B model, conservative, with the coefficients of mdpd",
        psidpd_create_mdpd_psi,
    ),
    style(c"dpd/spline", c"DPD with a repulsive-attractive spline potential", psidpd_create_dpd_spline),
    fix(
        c"dpd/splitting",
        c"time integration with drag and noise apart from the forces",
        psidpd_create_dpd_splitting,
    ),
    fix(c"dpd/wall", c"walls of matter", psidpd_create_dpd_wall),
];

static TABLE: Styles = Styles {
    built: BUILT.as_ptr().cast(),
    count: STYLES.len(),
    first: STYLES.as_ptr(),
    insert: psidpd_insert_style,
};

#[unsafe(no_mangle)]
pub extern "C" fn psidpd_styles() -> *const Styles {
    &raw const TABLE
}
