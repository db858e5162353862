//! The functions of LAMMPS's C library interface (`library.h`) that are used, loaded at run time.

use libloading::{Error, Library};
use std::ffi::{c_char, c_int, c_void};

/// Declares the library. A function that a version of LAMMPS lacks does not prevent loading.
macro_rules! library {
    ($($name:ident($($argument:ident: $kind:ty),*) $(-> $result:ty)?;)*) => {
        pub struct LammpsLibrary {
            $(pub $name: Result<unsafe extern "C" fn($($argument: $kind),*) $(-> $result)?, Error>,)*
            /// The functions are gone when it is unloaded.
            _library: Library,
        }

        impl LammpsLibrary {
            /// Finds the functions.
            ///
            /// # Safety
            /// `library` is LAMMPS: its functions of these names have these types, as `library.h` declares them.
            pub unsafe fn of(library: Library) -> LammpsLibrary {
                LammpsLibrary {
                    // SAFETY: the caller answers for the types; the pointers are kept beside the library.
                    $($name: unsafe { library.get(concat!(stringify!($name), "\0")) }.map(|f| *f),)*
                    _library: library,
                }
            }
        }
    };
}

type Handle = *mut c_void;
type Text = *const c_char;

library! {
    lammps_open_no_mpi(argc: c_int, argv: *mut *mut c_char, ptr: *mut Handle) -> Handle;
    lammps_close(handle: Handle);
    lammps_mpi_finalize();
    lammps_command(handle: Handle, cmd: Text) -> *mut c_char;
    lammps_get_natoms(handle: Handle) -> f64;
    lammps_get_thermo(handle: Handle, keyword: Text) -> f64;
    lammps_extract_box(
        handle: Handle, boxlo: *mut f64, boxhi: *mut f64, xy: *mut f64, yz: *mut f64, xz: *mut f64, pflags: *mut c_int,
        boxflag: *mut c_int
    );
    lammps_extract_setting(handle: Handle, keyword: Text) -> c_int;
    lammps_extract_atom_datatype(handle: Handle, name: Text) -> c_int;
    lammps_extract_atom_size(handle: Handle, name: Text, kind: c_int) -> c_int;
    lammps_extract_compute(handle: Handle, id: Text, style: c_int, kind: c_int) -> *mut c_void;
    lammps_extract_fix(
        handle: Handle, id: Text, style: c_int, kind: c_int, nrow: c_int, ncol: c_int
    ) -> *mut c_void;
    lammps_eval(handle: Handle, expr: Text) -> f64;
    lammps_gather_atoms(handle: Handle, name: Text, kind: c_int, count: c_int, data: *mut c_void);
    lammps_scatter_atoms(handle: Handle, name: Text, kind: c_int, count: c_int, data: *mut c_void);
    lammps_gather(handle: Handle, name: Text, kind: c_int, count: c_int, data: *mut c_void);
    lammps_version(handle: Handle) -> c_int;
    lammps_has_style(handle: Handle, category: Text, name: Text) -> c_int;
    lammps_has_error(handle: Handle) -> c_int;
    lammps_get_last_error_message(handle: Handle, buffer: *mut c_char, size: c_int) -> c_int;
}
