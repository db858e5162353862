//! Versions of the interface and of the library.

use std::ffi::c_char;

/// The version of this interface. It goes up when a function or structure changes its meaning or
/// layout or goes away, not when one is added.
pub const PSIDPD_ABI_VERSION: u32 = 3;

/// The PSIDPD_ABI_VERSION that the library was built with. A program must stop if it
/// differs from the one in its header.
#[unsafe(no_mangle)]
pub extern "C" fn psidpd_abi_version() -> u32 {
    PSIDPD_ABI_VERSION
}

/// The version of the library, such as "1.2.3"; always valid.
#[unsafe(no_mangle)]
pub extern "C" fn psidpd_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}
