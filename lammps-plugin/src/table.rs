//! The styles, as the entry finds them.

#[path = "../entry/src/table.rs"]
mod contract;

use contract::{BUILT, Creator, Style, Styles};
use std::ffi::{CStr, c_char, c_void};

unsafe extern "C-unwind" {
    fn psidpd_create_dpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_mdpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_dpd_spline(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_insert_style(lmp: *mut c_void, name: *const c_char, creator: Creator);
}

const fn style(name: &'static CStr, info: &'static CStr, creator: Creator) -> Style {
    Style { name: name.as_ptr(), info: info.as_ptr(), creator }
}

static STYLES: [Style; 3] = [
    style(c"dpd/psi", c"many-body DPD of any excess free energy", psidpd_create_dpd_psi),
    style(
        c"mdpd/psi",
        c"Warren's A/B model, conservative, with the coefficients of mdpd",
        psidpd_create_mdpd_psi,
    ),
    style(c"dpd/spline", c"DPD with a repulsive-attractive spline potential", psidpd_create_dpd_spline),
];

static TABLE: Styles = Styles {
    built: BUILT.as_ptr().cast(),
    count: STYLES.len(),
    first: STYLES.as_ptr(),
    insert: psidpd_insert_style,
};

/// The table of the styles.
#[unsafe(no_mangle)]
pub extern "C" fn psidpd_styles() -> *const Styles {
    &raw const TABLE
}
