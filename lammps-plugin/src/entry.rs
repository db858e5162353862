//! `lammpsplugin_init`: what `plugin load` calls.
//!
//! The entry is Rust so that cargo keeps its symbol; the structure it fills is LAMMPS's plugin
//! interface, version one.

use std::ffi::{CStr, CString, c_char, c_int, c_void};

/// The LAMMPS this plugin was compiled for, as `lammps_version()` counts: 20250722.
const BUILT_FOR: &str = env!("PSIDPD_LAMMPS_VERSION");

/// LAMMPS's description of a plugin style.
#[repr(C)]
struct Registration {
    version: *const c_char,
    style: *const c_char,
    name: *const c_char,
    info: *const c_char,
    author: *const c_char,
    creator: Option<unsafe extern "C-unwind" fn(*mut c_void) -> *mut c_void>,
    handle: *mut c_void,
}

type Register = unsafe extern "C-unwind" fn(*mut Registration, *mut c_void);

unsafe extern "C-unwind" {
    fn psidpd_create_dpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_mdpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_dpd_spline(lmp: *mut c_void) -> *mut c_void;
    /// Of LAMMPS's library interface; resolved when LAMMPS loads the plugin.
    fn lammps_version(lmp: *mut c_void) -> c_int;
}

unsafe extern "C" {
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// Of LAMMPS's library interface: stop on all ranks.
const LMP_ERROR_ALL: c_int = 2;

/// Registers the pair styles, unless this plugin was built for another LAMMPS.
///
/// # Safety
/// Called by LAMMPS's `plugin load`, with its own instance, the handle of this library and the
/// function that registers styles.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn lammpsplugin_init(
    lmp: *mut c_void,
    handle: *mut c_void,
    register: *mut c_void,
) {
    // SAFETY: `lmp` is a LAMMPS instance and the function exists in every LAMMPS library.
    let host = unsafe { lammps_version(lmp) };
    if BUILT_FOR.parse() != Ok(host) {
        // SAFETY: as above.
        unsafe { refuse(lmp, host) };
        return;
    }
    // SAFETY: LAMMPS passes its registering function as a plain pointer; a null pointer becomes None.
    let Some(register) = (unsafe { std::mem::transmute::<*mut c_void, Option<Register>>(register) }) else {
        return;
    };
    const STYLES: [(&CStr, &CStr, unsafe extern "C-unwind" fn(*mut c_void) -> *mut c_void); 3] = [
        (c"dpd/psi", c"many-body DPD of any excess free energy", psidpd_create_dpd_psi),
        (
            c"mdpd/psi",
            c"Warren's A/B model, conservative, with the coefficients of mdpd",
            psidpd_create_mdpd_psi,
        ),
        (c"dpd/spline", c"DPD with a repulsive-attractive spline potential", psidpd_create_dpd_spline),
    ];
    for (name, info, creator) in STYLES {
        let mut registration = Registration {
            version: VERSION.as_ptr(),
            style: c"pair".as_ptr(),
            name: name.as_ptr(),
            info: info.as_ptr(),
            author: c"the psidpd developers".as_ptr(),
            creator: Some(creator),
            handle,
        };
        // SAFETY: LAMMPS copies the registration; its strings are static.
        unsafe { register(&raw mut registration, lmp) };
    }
}

/// LAMMPS prints a note if this differs from its own version text; the check that counts is ours.
const VERSION: &CStr = c"psidpd";

/// Says which LAMMPS this plugin is for, and stops the script if the host can be stopped.
///
/// # Safety
/// `lmp` is a LAMMPS instance.
unsafe fn refuse(lmp: *mut c_void, host: c_int) {
    let text = format!(
        "The psidpd plugin was built for LAMMPS {BUILT_FOR}, this is LAMMPS {host}: its pair styles are not \
         loaded. Build the plugin for this LAMMPS with 'psidpd lammps plugin'."
    );
    let Ok(text) = CString::new(text) else { return };
    // SAFETY: a symbol look-up in what is loaded; null means all of it.
    let error = unsafe { dlsym(std::ptr::null_mut(), c"lammps_error".as_ptr()) };
    if error.is_null() {
        // An old library: without the styles the script stops at its pair_style command.
        eprintln!("ERROR: {}", text.to_string_lossy());
        return;
    }
    type LammpsError = unsafe extern "C-unwind" fn(*mut c_void, c_int, *const c_char);
    // SAFETY: the symbol has this signature in every LAMMPS that has it.
    let error = unsafe { std::mem::transmute::<*mut c_void, LammpsError>(error) };
    // LAMMPS throws; the text leaks once, for nothing of ours may unwind it.
    let text = text.into_raw();
    // SAFETY: `lmp` is a LAMMPS instance, the text is a C string.
    unsafe { error(lmp, LMP_ERROR_ALL, text) };
}
