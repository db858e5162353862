//! The functions of LAMMPS's library, each looked up by its name.

/// Makes `LammpsLibrary` from declarations: a field for each function, or the error of a LAMMPS version that lacks it.
macro_rules! library {
    ($(pub fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        pub struct LammpsLibrary {
            $(pub $name: Result<unsafe extern "C" fn($($argument: $type),*) $(-> $result)?, libloading::Error>,)*
            /// The functions are part of the library, which is unloaded when this is dropped.
            _library: libloading::Library,
        }

        impl LammpsLibrary {
            /// # Safety
            /// The functions of the library that have these names have these types.
            pub unsafe fn new(library: libloading::Library) -> LammpsLibrary {
                LammpsLibrary {
                    // SAFETY: the caller answers for the types.
                    $($name: unsafe { library.get(stringify!($name).as_bytes()) }.map(|function| *function),)*
                    _library: library,
                }
            }
        }
    };
}
