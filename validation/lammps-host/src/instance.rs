//! LAMMPS within this process.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::PathBuf;
use std::ptr::null_mut;
use std::sync::{Mutex, MutexGuard, OnceLock};

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};

use super::bindings::LammpsLibrary;
use super::error::LammpsError;
use super::host::Host;

// Constants of the C interface, from the enumerations of library.h.
const INT: c_int = 0;
const INT_2D: c_int = 1;
const DOUBLE: c_int = 2;
const DOUBLE_2D: c_int = 3;
const STYLE_GLOBAL: c_int = 0;
const STYLE_ATOM: c_int = 1;
const TYPE_SCALAR: c_int = 0;
const TYPE_VECTOR: c_int = 1;
const SIZE_VECTOR: c_int = 3;
const SIZE_COLS: c_int = 5;

/// The library of the process. It is never unloaded, because MPI and LAMMPS's plugins do not survive that.
struct Loaded {
    path: PathBuf,
    functions: LammpsLibrary,
}

static LOADED: OnceLock<Loaded> = OnceLock::new();
/// The lock of every call: only one thread at a time may call LAMMPS and its MPI.
static CALLS: Mutex<()> = Mutex::new(());

fn exclusive() -> MutexGuard<'static, ()> {
    CALLS.lock().unwrap_or_else(|e| e.into_inner())
}

unsafe extern "C" {
    fn atexit(function: extern "C" fn()) -> c_int;
}

/// Finalises MPI once at the end of the process; otherwise MPICH leaves its shared memory behind.
extern "C" fn finalize_mpi() {
    // Another thread may be inside LAMMPS while the process ends; MPI must then stay as it is.
    let Ok(_guard) = CALLS.try_lock() else { return };
    if let Some(Ok(finalize)) = LOADED.get().map(|l| l.functions.lammps_mpi_finalize.as_ref()) {
        // SAFETY: `finalize` is LAMMPS's own function, which checks that MPI is initialised and not yet
        // finalised; the guard keeps other threads out of LAMMPS.
        unsafe { finalize() }
    }
}

fn load(host: &Host, _guard: &MutexGuard<()>) -> Result<&'static LammpsLibrary, LammpsError> {
    if let Some(loaded) = LOADED.get() {
        return if loaded.path == host.library {
            Ok(&loaded.functions)
        } else {
            Err(LammpsError::OtherLoaded { loaded: loaded.path.clone(), wanted: host.library.clone() })
        };
    }
    let open = |path: &PathBuf| {
        // SAFETY: `host` names LAMMPS's library and its MPI, whose initialisers have no preconditions. The
        // symbols are global, so that plugins find those of LAMMPS and LAMMPS finds those of this MPI.
        unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) }
            .map_err(|e| LammpsError::Load { path: path.clone(), reason: e.to_string() })
    };
    // MPI is never unloaded.
    if let Some(mpi) = &host.mpi_library {
        std::mem::forget(open(mpi)?);
    }
    let library = libloading::Library::from(open(&host.library)?);
    // SAFETY: `bindings.rs` has the types of LAMMPS's header, and LAMMPS's C interface keeps the type of a
    // function of one name.
    let functions = unsafe { LammpsLibrary::new(library) };
    let loaded = LOADED.get_or_init(|| Loaded { path: host.library.clone(), functions });
    // SAFETY: `finalize_mpi` lives as long as the process and never unwinds.
    unsafe { atexit(finalize_mpi) };
    Ok(&loaded.functions)
}

/// A function of the library, or an error if this version of LAMMPS lacks it.
macro_rules! function {
    ($library:expr, $name:ident) => {
        match &$library.$name {
            Ok(f) => Ok(*f),
            Err(_) => Err(LammpsError::NoFunction { name: stringify!($name) }),
        }
    };
}

fn c_string(text: &str) -> Result<CString, LammpsError> {
    CString::new(text)
        .map_err(|_| LammpsError::Request(format!("a text for LAMMPS contains a zero byte: {text:?}")))
}

/// The error message since the last query; `None` without an error.
fn last_error(library: &LammpsLibrary, handle: *mut c_void) -> Option<String> {
    let has = library.lammps_has_error.as_ref().ok()?;
    let get = library.lammps_get_last_error_message.as_ref().ok()?;
    // SAFETY: the callers pass null or a handle that LAMMPS returned and that is not closed; LAMMPS accepts both.
    if unsafe { has(handle) } == 0 {
        return None;
    }
    let mut buffer: [c_char; 2048] = [0; 2048];
    // SAFETY: `buffer` is writable, and LAMMPS writes at most as many characters as the given length.
    unsafe { get(handle, buffer.as_mut_ptr(), buffer.len() as c_int) };
    buffer[2047] = 0;
    // SAFETY: the last element of `buffer` is zero, set by the line above.
    let text = unsafe { CStr::from_ptr(buffer.as_ptr()) };
    Some(text.to_string_lossy().trim().to_owned())
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulationBox {
    pub lo: [f64; 3],
    pub hi: [f64; 3],
    pub tilt: [f64; 3],
    pub periodic: [bool; 3],
}

/// A LAMMPS instance in this process, on one MPI rank.
///
/// Several instances may be open on any threads: their calls take turns. Dropping an instance closes it; MPI
/// ends with the process.
pub struct Lammps {
    library: &'static LammpsLibrary,
    /// The raw pointer keeps the instance on its thread.
    handle: *mut c_void,
    /// LAMMPS may keep pointers to its arguments, so they live as long as the instance.
    _args: Vec<CString>,
}

impl std::fmt::Debug for Lammps {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lammps").finish_non_exhaustive()
    }
}

impl Drop for Lammps {
    fn drop(&mut self) {
        let _guard = exclusive();
        if let Ok(close) = &self.library.lammps_close {
            // SAFETY: LAMMPS returned the handle to `open`, and `drop` is its last use.
            unsafe { close(self.handle) }
        }
    }
}

impl Lammps {
    /// Starts LAMMPS with `-log none -screen none -nocite` and `args`, which override these options.
    pub fn open(host: &Host, args: &[&str]) -> Result<Lammps, LammpsError> {
        let guard = exclusive();
        let library = load(host, &guard)?;
        let open = function!(library, lammps_open_no_mpi)?;
        function!(library, lammps_close)?;
        let mut argv = vec!["lammps"];
        for default in ["log", "screen"] {
            if !args.iter().any(|a| a.trim_start_matches('-') == default) {
                argv.extend([if default == "log" { "-log" } else { "-screen" }, "none"]);
            }
        }
        argv.push("-nocite");
        argv.extend(args);
        let doing = argv.join(" ");
        let argv = argv.into_iter().map(c_string).collect::<Result<Vec<_>, _>>()?;
        let mut pointers: Vec<*mut c_char> = argv.iter().map(|a| a.as_ptr().cast_mut()).collect();
        pointers.push(null_mut());
        // SAFETY: `pointers` has `argv.len()` pointers to C strings and a null at its end; LAMMPS does not
        // write to the strings, and `_args` keeps them as long as the instance.
        let handle = unsafe { open(argv.len() as c_int, pointers.as_mut_ptr(), null_mut()) };
        if handle.is_null() {
            return Err(LammpsError::Lammps {
                message: last_error(library, handle)
                    .unwrap_or_else(|| "it does not start, and does not say why".into()),
                doing,
            });
        }
        Ok(Lammps { library, handle, _args: argv })
    }

    /// Calls the library and then checks for errors of LAMMPS.
    fn call<T>(&self, doing: &str, f: impl FnOnce() -> T) -> Result<T, LammpsError> {
        let _guard = exclusive();
        let result = f();
        match last_error(self.library, self.handle) {
            None => Ok(result),
            Some(message) => Err(LammpsError::Lammps { message, doing: doing.into() }),
        }
    }

    /// Calls a function of LAMMPS's library that takes a text.
    fn call_with<T>(
        &self,
        f: unsafe extern "C" fn(*mut c_void, *const c_char) -> T,
        text: &str,
    ) -> Result<T, LammpsError> {
        let argument = c_string(text)?;
        // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made the text.
        self.call(text, || unsafe { f(self.handle, argument.as_ptr()) })
    }

    pub fn command(&self, command: &str) -> Result<(), LammpsError> {
        // The returned pointer belongs to LAMMPS and is dropped.
        self.call_with(function!(self.library, lammps_command)?, command).map(|_| ())
    }

    /// Executes commands, one per line, up to the first error. `&` at the end of a line continues it, as do
    /// triple quotes; `jump` needs a file.
    pub fn commands(&self, commands: &str) -> Result<(), LammpsError> {
        split_commands(commands).iter().try_for_each(|c| self.command(c))
    }

    /// The version as a number: 20250722.
    pub fn version(&self) -> Result<i32, LammpsError> {
        let f = function!(self.library, lammps_version)?;
        // SAFETY: `open` made the handle, which only `drop` closes.
        self.call("asking for the version", || unsafe { f(self.handle) })
    }

    /// Whether this LAMMPS has a style, for example `has_style("pair", "mdpd")`.
    pub fn has_style(&self, category: &str, name: &str) -> Result<bool, LammpsError> {
        let f = function!(self.library, lammps_has_style)?;
        let (c, n) = (c_string(category)?, c_string(name)?);
        // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made both strings.
        self.call(&format!("looking for {category} style {name}"), || unsafe {
            f(self.handle, c.as_ptr(), n.as_ptr()) == 1
        })
    }

    pub fn natoms(&self) -> Result<usize, LammpsError> {
        let f = function!(self.library, lammps_get_natoms)?;
        // SAFETY: `open` made the handle, which only `drop` closes.
        let n = self.call("counting atoms", || unsafe { f(self.handle) })?;
        Ok(n as usize)
    }

    /// A thermodynamic quantity of the last step: `temp`, `pe`, `press`, `pxy`, `c_ID[2]` …
    pub fn thermo(&self, name: &str) -> Result<f64, LammpsError> {
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "_[]*".contains(c)) {
            return refuse(format!("'{name}' is not the name of a thermodynamic quantity"));
        }
        if self.library.lammps_eval.is_ok() {
            // `lammps_get_thermo` returns 0 for unknown names, so compound names are evaluated as expressions.
            return self.eval(name);
        }
        self.call_with(function!(self.library, lammps_get_thermo)?, name)
    }

    /// The value of an expression, as in an equal-style variable.
    pub fn eval(&self, expression: &str) -> Result<f64, LammpsError> {
        self.call_with(function!(self.library, lammps_eval)?, expression)
    }

    /// A setting such as `box_exist` or `nlocal`, with the names of `lammps_extract_setting`; −1 if it is unknown.
    pub fn setting(&self, name: &str) -> Result<i32, LammpsError> {
        self.call_with(function!(self.library, lammps_extract_setting)?, name)
    }

    pub fn simulation_box(&self) -> Result<SimulationBox, LammpsError> {
        if self.setting("box_exist")? != 1 {
            return refuse("LAMMPS has no box yet".into());
        }
        let f = function!(self.library, lammps_extract_box)?;
        let (mut lo, mut hi, mut tilt) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let (mut periodic, mut changes): ([c_int; 3], c_int) = ([0; 3], 0);
        let [xy, xz, yz] = &mut tilt;
        // SAFETY: `open` made the handle, which only `drop` closes; the check above ensures that a box exists.
        // The arrays have the lengths that the function fills, and its tilt factors are in the order xy, yz, xz.
        self.call("extracting the box", || unsafe {
            f(self.handle, lo.as_mut_ptr(), hi.as_mut_ptr(), xy, yz, xz, periodic.as_mut_ptr(), &mut changes)
        })?;
        Ok(SimulationBox { lo, hi, tilt, periodic: periodic.map(|p| p != 0) })
    }

    /// Refuses a request for an atom property with a wrong type or width, which LAMMPS does not check.
    fn check_property(&self, name: &str, width: usize, real: bool) -> Result<(), LammpsError> {
        let kind = self.call_with(function!(self.library, lammps_extract_atom_datatype)?, name)?;
        let (kind_is_real, two) = match kind {
            INT => (false, false),
            INT_2D => (false, true),
            DOUBLE => (true, false),
            DOUBLE_2D => (true, true),
            -1 => return refuse(format!("atoms have no property '{name}'")),
            _ => return refuse(format!("'{name}' is neither a 32-bit integer nor a double")),
        };
        if kind_is_real != real {
            let is = if kind_is_real { "a double" } else { "an integer" };
            return refuse(format!("'{name}' is {is}"));
        }
        let columns = match (two, name) {
            (false, "image") if width == 1 => 1,
            (false, "image") => 3,
            (false, _) => 1,
            (true, "x" | "v" | "f" | "omega" | "angmom" | "torque" | "vest") => 3,
            (true, "mu") => 4,
            (true, _) => {
                let size = function!(self.library, lammps_extract_atom_size)?;
                let text = c_string(name)?;
                // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made `text`.
                self.call(name, || unsafe { size(self.handle, text.as_ptr(), SIZE_COLS) })?.max(0) as usize
            }
        };
        if width == columns { Ok(()) } else { wrong_width(name, width, columns) }
    }

    /// Refuses a request for a per-atom compute or fix with a wrong width.
    fn check_columns(&self, name: &str, width: usize) -> Result<(), LammpsError> {
        let id = c_string(&name[2..])?;
        let size = if name.starts_with("c_") {
            let f = function!(self.library, lammps_extract_compute)?;
            // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made `id`.
            self.call(name, || unsafe { f(self.handle, id.as_ptr(), STYLE_ATOM, SIZE_COLS) })?
        } else {
            let f = function!(self.library, lammps_extract_fix)?;
            // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made `id`.
            self.call(name, || unsafe { f(self.handle, id.as_ptr(), STYLE_ATOM, SIZE_COLS, 0, 0) })?
        };
        if size.is_null() {
            return refuse(format!("no per-atom values '{name}'"));
        }
        // SAFETY: LAMMPS answers this request with a pointer to an int of its own; the check above excludes null.
        let columns = unsafe { *size.cast::<c_int>() }.max(0) as usize;
        let fits = width == columns.max(1) && columns != 1;
        if fits { Ok(()) } else { wrong_width(name, width, columns.max(1)) }
    }

    /// Values of all atoms, sorted by atom id: a property (`x`, `v`, `f`, `rho` …), a compute (`c_ID`), a fix
    /// (`f_ID`) or a `fix property/atom` (`d_NAME`); each atom has `width` values.
    ///
    /// The ids must run from 1 to the number of atoms. Computes that LAMMPS tallies during a step, such as `pe/atom`,
    /// need an output of that step that requests them, for example `compute reduce sum` in `thermo_style`.
    pub fn gather(&self, name: &str, width: usize) -> Result<Vec<f64>, LammpsError> {
        let unset = f64::from_bits(0x7ff8_7073_6964_7064);
        self.gather_any(name, width, true, unset, |x| x.to_bits() == unset.to_bits())
    }

    /// Integers of all atoms, sorted by atom id: `id`, `type`, `image` (one word with `width` 1, three with 3), `i_NAME` …
    pub fn gather_ints(&self, name: &str, width: usize) -> Result<Vec<i32>, LammpsError> {
        self.gather_any(name, width, false, i32::MIN, |x| *x == i32::MIN)
    }

    /// The type `T` must be f64 if `real` is set, else i32.
    fn gather_any<T: Copy>(
        &self,
        name: &str,
        width: usize,
        real: bool,
        unset: T,
        is_unset: impl Fn(&T) -> bool,
    ) -> Result<Vec<T>, LammpsError> {
        let text = c_string(name)?;
        let general = match name.as_bytes() {
            [b'c' | b'f', b'_', ..] if !real => return refuse(format!("'{name}' is a double")),
            [b'c' | b'f', b'_', ..] => self.check_columns(name, width).map(|()| true)?,
            [kind @ (b'd' | b'i'), b'_', ..] if (*kind == b'd') != real || width != 1 => {
                return refuse(format!(
                    "'{name}' has another type or width than requested: d_ is one double, i_ one integer"
                ));
            }
            [b'd' | b'i', b'_', ..] => true,
            _ => self.check_property(name, width, real).map(|()| false)?,
        };
        let f = if general {
            function!(self.library, lammps_gather)?
        } else {
            function!(self.library, lammps_gather_atoms)?
        };
        let mut all = vec![unset; self.natoms()? * width];
        let kind = c_int::from(real);
        // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made `text`. LAMMPS fills
        // natoms × width values of the type that `kind` names, which is `T`; the checks above ensure that its
        // own array has this width.
        self.call(&format!("gathering {name}"), || unsafe {
            f(self.handle, text.as_ptr(), kind, width as c_int, all.as_mut_ptr().cast())
        })?;
        if all.iter().all(is_unset) && !all.is_empty() {
            return Err(LammpsError::Lammps {
                message: "nothing was gathered: atom ids must run from 1 to the number of atoms".into(),
                doing: format!("gathering {name}"),
            });
        }
        Ok(all)
    }

    /// Sets a property of all atoms from values sorted by atom id. LAMMPS needs `atom_modify map yes` for this.
    pub fn scatter(&self, name: &str, width: usize, values: &[f64]) -> Result<(), LammpsError> {
        let f = function!(self.library, lammps_scatter_atoms)?;
        self.check_property(name, width, true)?;
        let natoms = self.natoms()?;
        if values.len() != natoms * width {
            let given = values.len();
            return refuse(format!("{given} values of {name} for {natoms} atoms with {width} each"));
        }
        let text = c_string(name)?;
        // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made `text`. LAMMPS reads
        // natoms × width doubles, the checked length of `values`, and does not write to them.
        self.call(&format!("scattering {name}"), || unsafe {
            f(self.handle, text.as_ptr(), 1, width as c_int, values.as_ptr().cast_mut().cast())
        })
    }

    fn extract_compute(&self, id: &str, what: c_int) -> Result<*mut c_void, LammpsError> {
        let f = function!(self.library, lammps_extract_compute)?;
        let text = c_string(id)?;
        // SAFETY: `open` made the handle, which only `drop` closes; `c_string` made `text`.
        let found = self.call(&format!("computing {id}"), || unsafe {
            f(self.handle, text.as_ptr(), STYLE_GLOBAL, what)
        })?;
        if found.is_null() {
            return refuse(format!("there is no compute '{id}' with such a value"));
        }
        Ok(found)
    }

    pub fn compute_scalar(&self, id: &str) -> Result<f64, LammpsError> {
        let value = self.extract_compute(id, TYPE_SCALAR)?;
        // SAFETY: LAMMPS answers a request for a scalar with a pointer to a double of its own;
        // `extract_compute` has refused null.
        Ok(unsafe { *value.cast::<f64>() })
    }

    pub fn compute_vector(&self, id: &str) -> Result<Vec<f64>, LammpsError> {
        let values = self.extract_compute(id, TYPE_VECTOR)?.cast::<f64>();
        let size = self.extract_compute(id, SIZE_VECTOR)?;
        // SAFETY: LAMMPS answers a request for the size with a pointer to an int of its own, and the vector
        // has that many doubles; no call that could change the vector comes in between.
        let slice = unsafe {
            let n = (*size.cast::<c_int>()).max(0) as usize;
            std::slice::from_raw_parts(values, n)
        };
        Ok(slice.to_vec())
    }
}

fn refuse<T>(message: String) -> Result<T, LammpsError> {
    Err(LammpsError::Request(message))
}

fn wrong_width(name: &str, asked: usize, has: usize) -> Result<(), LammpsError> {
    refuse(format!("'{name}' has {has} values to an atom, not {asked}"))
}

/// Splits a text into commands: joins continued lines, and drops empty lines and comments.
fn split_commands(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut open = String::new();
    for line in text.lines() {
        open.push_str(line);
        if open.matches("\"\"\"").count() % 2 == 1 {
            open.push('\n');
            continue;
        }
        if let Some(begun) = open.trim_end().strip_suffix('&') {
            open = begun.to_owned();
            continue;
        }
        let command = std::mem::take(&mut open);
        let command = command.trim();
        if !command.is_empty() && !command.starts_with('#') {
            commands.push(command.to_owned());
        }
    }
    if !open.trim().is_empty() {
        commands.push(open.trim().to_owned());
    }
    commands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_of_a_text() {
        let text = "units lj\n\n# a remark\n  mass 1 &\n  1.0\nprint \"\"\"a\nb\"\"\"\nrun 0 &";
        assert_eq!(split_commands(text), ["units lj", "mass 1   1.0", "print \"\"\"a\nb\"\"\"", "run 0"]);
        assert!(split_commands("").is_empty());
    }
}
