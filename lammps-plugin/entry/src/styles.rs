//! The file with the styles, beside this one.

use crate::table::{BUILT, Style, Styles};
use crate::whole;
use std::ffi::{CStr, CString, OsStr, c_char, c_int, c_void};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// Its name. LAMMPS loads what ends in `plugin.so` by itself: this does not.
const FILE: &str = "psidpd-styles.so";

/// Of `dlopen`: resolve everything at once; nothing of it is seen by others.
const NOW: c_int = 2;

/// What `dladdr` fills in.
#[repr(C)]
struct Place {
    file: *const c_char,
    base: *mut c_void,
    symbol: *const c_char,
    address: *mut c_void,
}

unsafe extern "C" {
    fn dlopen(file: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(handle: *mut c_void, name: *const c_char) -> *mut c_void;
    fn dlerror() -> *mut c_char;
    fn dladdr(address: *const c_void, place: *mut Place) -> c_int;
}

/// A symbol of what is loaded already.
pub fn symbol(name: &CStr) -> Option<*mut c_void> {
    // SAFETY: a look-up by name; null as a handle means all that is loaded.
    let found = unsafe { dlsym(std::ptr::null_mut(), name.as_ptr()) };
    (!found.is_null()).then_some(found)
}

/// The folders this library may be in: as it was named, and where links lead.
fn folders() -> Vec<PathBuf> {
    let mut place = Place {
        file: std::ptr::null(),
        base: std::ptr::null_mut(),
        symbol: std::ptr::null(),
        address: std::ptr::null_mut(),
    };
    // SAFETY: an address of this library, and a structure of the layout that the C library documents.
    let found = unsafe { dladdr((folders as fn() -> Vec<PathBuf>) as *const c_void, &raw mut place) };
    if found == 0 || place.file.is_null() {
        return vec![];
    }
    // SAFETY: dladdr has put a C string there, which lives as long as the library is loaded.
    let file = Path::new(OsStr::from_bytes(unsafe { CStr::from_ptr(place.file) }.to_bytes())).to_owned();
    let real = std::fs::canonicalize(&file).unwrap_or_default();
    [file, real].iter().filter_map(|file| file.parent().map(Path::to_owned)).collect()
}

fn last_error() -> String {
    // SAFETY: the text is the thread's own until the next call.
    let text = unsafe { dlerror() };
    if text.is_null() {
        return "unknown cause".to_owned();
    }
    // SAFETY: a C string, as above.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// The styles. Must be called only where they were built for the LAMMPS of this process: they need its symbols.
pub fn load() -> Result<&'static [Style], String> {
    table().map(|table| {
        // SAFETY: the table says how many there are, and stays.
        unsafe { std::slice::from_raw_parts(table.first, table.count) }
    })
}

/// All of the table of the styles; as [`load`].
pub fn table() -> Result<&'static Styles, String> {
    let path = folders()
        .into_iter()
        .map(|folder| folder.join(FILE))
        .find(|path| path.is_file())
        .ok_or_else(|| format!("{FILE} is not beside psidpdplugin.so: the two belong together"))?;
    if let Some((wanted, has)) = whole::sizes(&path)
        && has < wanted
    {
        return Err(format!("{} was cut short: it has {has} bytes of {wanted}", path.display()));
    }
    let name = CString::new(path.as_os_str().as_bytes()).map_err(|e| e.to_string())?;
    // SAFETY: the file is ours, and its initialisers are those of Rust and C++.
    let handle = unsafe { dlopen(name.as_ptr(), NOW) };
    if handle.is_null() {
        return Err(last_error());
    }
    // SAFETY: a look-up in what has just been loaded.
    let found = unsafe { dlsym(handle, c"psidpd_styles".as_ptr()) };
    if found.is_null() {
        return Err(last_error());
    }
    // SAFETY: the symbol has this signature in every version of the file.
    let styles = unsafe { std::mem::transmute::<*mut c_void, extern "C" fn() -> *const Styles>(found) };
    // SAFETY: it returns a static; its first field is a C string in every version.
    let table = unsafe { &*styles() };
    // SAFETY: as above.
    let built = unsafe { CStr::from_ptr(table.built) };
    if built.to_bytes_with_nul() != BUILT.as_bytes() {
        return Err(format!("{} is of another build ({})", path.display(), built.to_string_lossy()));
    }
    Ok(table)
}
