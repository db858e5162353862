//! Loads the second file, which has the styles and lies beside this one.

use crate::table::{BUILT, Style, Styles};
use crate::whole;
use std::ffi::{CStr, CString, OsStr, c_char, c_int, c_void};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// LAMMPS loads files that end in `plugin.so` by itself; this name does not.
const FILE: &str = "psidpd-styles.so";

/// Flag of `dlopen`: it resolves all symbols at once, and keeps them from other libraries.
const NOW: c_int = 2;

/// The structure that `dladdr` fills.
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

/// Finds a symbol in all libraries that are loaded.
pub fn symbol(name: &CStr) -> Option<*mut c_void> {
    // SAFETY: dlsym only looks the name up; a null handle means all loaded libraries.
    let found = unsafe { dlsym(std::ptr::null_mut(), name.as_ptr()) };
    (!found.is_null()).then_some(found)
}

/// The file of the library with an address, as it was loaded.
pub fn file_of(address: *const c_void) -> Option<PathBuf> {
    let mut place = Place {
        file: std::ptr::null(),
        base: std::ptr::null_mut(),
        symbol: std::ptr::null(),
        address: std::ptr::null_mut(),
    };
    // SAFETY: dladdr only looks the address up, and `place` has the layout that the C library documents.
    let found = unsafe { dladdr(address, &raw mut place) };
    if found == 0 || place.file.is_null() {
        return None;
    }
    // SAFETY: dladdr has stored a C string there, which lives as long as the library is loaded.
    Some(Path::new(OsStr::from_bytes(unsafe { CStr::from_ptr(place.file) }.to_bytes())).to_owned())
}

/// The folders that may contain this library: of its path as loaded, and of the path with links resolved.
fn folders() -> Vec<PathBuf> {
    let Some(file) = file_of((folders as fn() -> Vec<PathBuf>) as *const c_void) else { return vec![] };
    let real = std::fs::canonicalize(&file).unwrap_or_default();
    [file, real].iter().filter_map(|file| file.parent().map(Path::to_owned)).collect()
}

fn last_error() -> String {
    // SAFETY: the text belongs to this thread until its next call of dlerror.
    let text = unsafe { dlerror() };
    if text.is_null() {
        return "unknown cause".to_owned();
    }
    // SAFETY: dlerror returned a C string, which is not null.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

impl Styles {
    pub fn all(&self) -> &[Style] {
        // SAFETY: the second file states the length of its static array, and is never unloaded.
        unsafe { std::slice::from_raw_parts(self.first, self.count) }
    }
}

/// The styles. Call this only where they were built for the LAMMPS of this process: they need its symbols.
pub fn load() -> Result<&'static Styles, String> {
    let path = folders().into_iter().map(|folder| folder.join(FILE)).find(|path| path.is_file()).ok_or_else(
        || format!("{FILE} is not in the folder of psidpdplugin.so: keep both files in one folder"),
    )?;
    if let Some((wanted, has)) = whole::sizes(&path)
        && has < wanted
    {
        return Err(format!("{} was cut short: it has {has} bytes of {wanted}", path.display()));
    }
    let name = CString::new(path.as_os_str().as_bytes()).map_err(|e| e.to_string())?;
    // SAFETY: the file belongs to this plugin; its initialisers are those of Rust and C++.
    let handle = unsafe { dlopen(name.as_ptr(), NOW) };
    if handle.is_null() {
        return Err(last_error());
    }
    // SAFETY: dlsym only looks the name up, in the library that was just loaded.
    let found = unsafe { dlsym(handle, c"psidpd_styles".as_ptr()) };
    if found.is_null() {
        return Err(last_error());
    }
    // SAFETY: the symbol has this signature in every version of the file.
    let styles = unsafe { std::mem::transmute::<*mut c_void, extern "C" fn() -> *const Styles>(found) };
    // SAFETY: the function returns a static; its first field is a C string in every version.
    let table = unsafe { &*styles() };
    // SAFETY: the second file fills its first field with a static C string.
    let built = unsafe { CStr::from_ptr(table.built) };
    if built.to_bytes_with_nul() != BUILT.as_bytes() {
        return Err(format!("{} is from another build ({})", path.display(), built.to_string_lossy()));
    }
    Ok(table)
}
