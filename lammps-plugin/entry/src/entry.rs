//! The functions that register the styles: `lammpsplugin_init`, which `plugin load` calls, and
//! `psidpd_register` for a LAMMPS without plugins.
//!
//! `lammpsplugin_init` fills LAMMPS's plugin structure, version one. Functions of LAMMPS are looked up
//! when they are needed, by their names in its C interface.

use crate::styles;
use crate::table::{Creator, Styles};
use crate::version;
use crate::{headers, host};
use std::ffi::{CString, c_char, c_int, c_void};
use std::sync::OnceLock;

/// The LAMMPS that the styles were compiled for, as `lammps_version()` counts: 20250722.
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
type Version = unsafe extern "C-unwind" fn(*mut c_void) -> c_int;
type Setting = unsafe extern "C-unwind" fn(*mut c_void, *const c_char) -> c_int;
type Error = unsafe extern "C-unwind" fn(*mut c_void, c_int, *const c_char);

/// Names a LAMMPS version as a number and in words.
fn named(number: &str) -> String {
    number.parse().map_or_else(|_| number.to_owned(), |n| format!("{n} ({})", version::in_words(n)))
}

/// The styles, for the LAMMPS at `lmp`; the error says why they must not run there, or cannot be loaded.
///
/// # Safety
/// `lmp` is a LAMMPS instance.
unsafe fn styles_for(lmp: *mut c_void) -> Result<&'static Styles, String> {
    let (Some(version), Some(setting)) =
        (styles::symbol(c"lammps_version"), styles::symbol(c"lammps_extract_setting"))
    else {
        return Err(format!(
            "The psidpd plugin was built for LAMMPS {}, and does not find the functions of LAMMPS's C interface here.",
            named(BUILT_FOR)
        ));
    };
    // SAFETY: these functions have these signatures in every LAMMPS library.
    let version = unsafe { std::mem::transmute::<*mut c_void, Version>(version) };
    // SAFETY: `lammps_extract_setting` has this signature in every LAMMPS library.
    let setting = unsafe { std::mem::transmute::<*mut c_void, Setting>(setting) };
    // SAFETY: `lmp` is a LAMMPS instance, whose layout its own functions know.
    let (host, tag) = unsafe { (version(lmp), setting(lmp, c"tagint".as_ptr())) };
    let openmpi = styles::symbol(c"ompi_mpi_comm_world").is_some();
    let (built, here) = if BUILT_FOR.parse() != Ok(host) {
        (format!("LAMMPS {}", named(BUILT_FOR)), format!("this is LAMMPS {}", named(&host.to_string())))
    } else if tag != 4 {
        ("32-bit atom IDs".to_owned(), format!("this LAMMPS has {}-bit ones", 8 * tag))
    } else if openmpi != (env!("PSIDPD_MPI") == "openmpi") {
        // MPI handles differ in size, and so does the layout of every LAMMPS class that holds one.
        ("another MPI than this LAMMPS uses".to_owned(), "the two do not mix".to_owned())
    } else if let Some((built, here)) = another_release() {
        (built, here)
    } else {
        return styles::load().map_err(|reason| {
            format!(
                "The styles of psidpd are not loaded: {reason}. Build the plugin again with 'psidpd lammps plugin'."
            )
        });
    };
    Err(format!(
        "The psidpd plugin was built for {built}, {here}: its styles are not loaded. \
         Build the plugin for this LAMMPS with 'psidpd lammps plugin'."
    ))
}

/// Why this is another release than that of the build, though the version number is the same: what the plugin was built for, and what
/// is here.
fn another_release() -> Option<(String, String)> {
    let built = env!("PSIDPD_LAMMPS_RELEASE");
    let here = host::release();
    if let Some(here) = here.filter(|here| !built.is_empty() && here != built) {
        return Some((format!("LAMMPS {built}"), format!("this is LAMMPS {here}")));
    }
    let header = headers::difference(env!("PSIDPD_LAMMPS_LAYOUT"), &host::headers()?)?;
    let built = format!("another LAMMPS {}", named(BUILT_FOR));
    Some((built, format!("whose classes differ from those of this one in {header}")))
}

/// Registers the styles in a LAMMPS that has no `plugin` command: call it with the handle of the
/// library interface (in Python, `L.lmp`), and again after each `clear`.
///
/// Returns null, or a text that says why nothing was registered; the text stays valid.
///
/// # Safety
/// `lmp` is null or a LAMMPS instance of this process.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn psidpd_register(lmp: *mut c_void) -> *const c_char {
    let styles = if lmp.is_null() {
        Err("psidpd_register: no LAMMPS instance".to_owned())
    } else {
        // SAFETY: the caller promises that `lmp` is null or an instance; null was refused above.
        unsafe { styles_for(lmp) }
    };
    match styles {
        Ok(styles) => {
            for style in styles.all() {
                // SAFETY: `styles_for` found that the C++ was compiled for this LAMMPS; the function copies the name.
                unsafe { (styles.insert)(lmp, style.kind, style.name, style.creator) };
            }
            std::ptr::null()
        }
        Err(text) => {
            CString::new(text).map_or(c"psidpd_register failed".as_ptr(), |t| t.into_raw().cast_const())
        }
    }
}

/// Constant of LAMMPS's library interface: stop on all ranks.
const LMP_ERROR_ALL: c_int = 2;

/// Registers the styles, unless this plugin was built for another LAMMPS.
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
    // SAFETY: LAMMPS passes its own instance to this function.
    let styles = match unsafe { styles_for(lmp) } {
        Ok(styles) => styles,
        Err(text) => {
            // SAFETY: LAMMPS passes its own instance to this function.
            unsafe { refuse(lmp, text) };
            return;
        }
    };
    // SAFETY: LAMMPS passes its registering function as a plain pointer; a null pointer becomes None.
    let Some(register) = (unsafe { std::mem::transmute::<*mut c_void, Option<Register>>(register) }) else {
        return;
    };
    for style in styles.all() {
        let mut registration = Registration {
            version: version_text(),
            style: style.kind,
            name: style.name,
            info: style.info,
            author: c"the psidpd developers".as_ptr(),
            creator: Some(style.creator),
            handle,
        };
        // SAFETY: LAMMPS copies the registration; its strings are static.
        unsafe { register(&raw mut registration, lmp) };
    }
}

/// The version in the words that LAMMPS prints of itself; LAMMPS prints a note where it differs from its own.
fn version_text() -> *const c_char {
    static TEXT: OnceLock<CString> = OnceLock::new();
    let words = || BUILT_FOR.parse().map_or_else(|_| BUILT_FOR.to_owned(), version::in_words);
    TEXT.get_or_init(|| CString::new(words()).unwrap_or_default()).as_ptr()
}

/// Prints why the styles are not loaded, and stops the script if the host can be stopped.
///
/// # Safety
/// `lmp` is a LAMMPS instance.
unsafe fn refuse(lmp: *mut c_void, text: String) {
    let Ok(text) = CString::new(text) else { return };
    let Some(error) = styles::symbol(c"lammps_error") else {
        // An old library has no such function: without the styles the script stops at its pair_style command.
        eprintln!("ERROR: {}", text.to_string_lossy());
        return;
    };
    // SAFETY: the symbol has this signature in every LAMMPS that has it.
    let error = unsafe { std::mem::transmute::<*mut c_void, Error>(error) };
    // LAMMPS throws an exception here, which must not unwind Rust values: the text leaks once.
    let text = text.into_raw();
    // SAFETY: the caller promises that `lmp` is an instance; the text is a C string.
    unsafe { error(lmp, LMP_ERROR_ALL, text) };
}
