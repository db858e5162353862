//! What registers the styles: `lammpsplugin_init`, which `plugin load` calls, and `psidpd_register` for a
//! LAMMPS that has no plugins.
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
    creator: Option<Creator>,
    handle: *mut c_void,
}

type Register = unsafe extern "C-unwind" fn(*mut Registration, *mut c_void);

unsafe extern "C-unwind" {
    fn psidpd_create_dpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_mdpd_psi(lmp: *mut c_void) -> *mut c_void;
    fn psidpd_create_dpd_spline(lmp: *mut c_void) -> *mut c_void;
    /// Of LAMMPS's library interface; resolved when LAMMPS loads the plugin.
    fn lammps_version(lmp: *mut c_void) -> c_int;
    fn lammps_extract_setting(lmp: *mut c_void, keyword: *const c_char) -> c_int;
    fn psidpd_insert_style(lmp: *mut c_void, name: *const c_char, creator: Creator);
    fn psidpd_mpi_fits() -> c_int;
}

type Creator = unsafe extern "C-unwind" fn(*mut c_void) -> *mut c_void;

const STYLES: [(&CStr, &CStr, Creator); 3] = [
    (c"dpd/psi", c"many-body DPD of any excess free energy", psidpd_create_dpd_psi),
    (c"mdpd/psi", c"Warren's A/B model, conservative, with the coefficients of mdpd", psidpd_create_mdpd_psi),
    (c"dpd/spline", c"DPD with a repulsive-attractive spline potential", psidpd_create_dpd_spline),
];

/// Why this plugin must not touch that LAMMPS; None if it was compiled for it.
///
/// # Safety
/// `lmp` is a LAMMPS instance.
unsafe fn trouble(lmp: *mut c_void) -> Option<String> {
    // SAFETY: `lmp` is a LAMMPS instance; these functions exist in every LAMMPS library and know its layout.
    let (host, tag) = unsafe { (lammps_version(lmp), lammps_extract_setting(lmp, c"tagint".as_ptr())) };
    // SAFETY: looks up a symbol, no more.
    let mpi = unsafe { psidpd_mpi_fits() } != 0;
    let (built, here) = if BUILT_FOR.parse() != Ok(host) {
        (format!("LAMMPS {BUILT_FOR}"), format!("this is LAMMPS {host}"))
    } else if tag != 4 {
        ("32-bit atom IDs".to_owned(), format!("this LAMMPS has {}-bit ones", 8 * tag))
    } else if !mpi {
        ("another MPI than this LAMMPS uses".to_owned(), "the two do not mix".to_owned())
    } else {
        return None;
    };
    Some(format!(
        "The psidpd plugin was built for {built}, {here}: its pair styles are not loaded. \
         Build the plugin for this LAMMPS with 'psidpd lammps plugin'."
    ))
}

/// Registers the pair styles in a LAMMPS that has no `plugin` command: call it with the handle of the
/// library interface (in Python, `L.lmp`), and again after each `clear`.
///
/// Returns null, or a text that says why nothing was registered; the text stays valid.
///
/// # Safety
/// `lmp` is null or a LAMMPS instance of the library that this plugin finds its symbols in.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn psidpd_register(lmp: *mut c_void) -> *const c_char {
    let trouble = if lmp.is_null() {
        Some("psidpd_register: no LAMMPS instance".to_owned())
    } else {
        // SAFETY: not null, so an instance of the LAMMPS library, as the caller promises.
        unsafe { trouble(lmp) }
    };
    if let Some(text) = trouble {
        return CString::new(text).map_or(c"psidpd_register failed".as_ptr(), |t| t.into_raw().cast_const());
    }
    for (name, _, creator) in STYLES {
        // SAFETY: an instance of the LAMMPS that the C++ was compiled for; it copies the name.
        unsafe { psidpd_insert_style(lmp, name.as_ptr(), creator) };
    }
    std::ptr::null()
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
    // SAFETY: LAMMPS passes its own instance.
    if let Some(text) = unsafe { trouble(lmp) } {
        // SAFETY: LAMMPS passes its own instance.
        unsafe { refuse(lmp, text) };
        return;
    }
    // SAFETY: LAMMPS passes its registering function as a plain pointer; a null pointer becomes None.
    let Some(register) = (unsafe { std::mem::transmute::<*mut c_void, Option<Register>>(register) }) else {
        return;
    };
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

/// Says why nothing is loaded, and stops the script if the host can be stopped.
///
/// # Safety
/// `lmp` is a LAMMPS instance.
unsafe fn refuse(lmp: *mut c_void, text: String) {
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
