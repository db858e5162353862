//! LAMMPS inside this process.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::PathBuf;
use std::ptr::null_mut;
use std::sync::{Mutex, MutexGuard, OnceLock};

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};

use super::bindings::LammpsLibrary;
use super::error::LammpsError;
use super::host::Host;

// The C interface's numbers for what to extract (enumerations of library.h).
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

/// The library stays loaded as long as the process: MPI and LAMMPS's plugins do not survive unloading.
struct Loaded {
    path: PathBuf,
    functions: LammpsLibrary,
}

static LOADED: OnceLock<Loaded> = OnceLock::new();
/// Held during every call: neither LAMMPS nor MPI, as LAMMPS starts it, may be called from two threads at once.
static CALLS: Mutex<()> = Mutex::new(());

fn exclusive() -> MutexGuard<'static, ()> {
    CALLS.lock().unwrap_or_else(|e| e.into_inner())
}

unsafe extern "C" {
    fn atexit(function: extern "C" fn()) -> c_int;
}

/// Ends MPI once, when the process ends: without it, MPICH leaves its shared memory behind.
extern "C" fn finalize_mpi() {
    // A thread that is inside LAMMPS while the process ends: leave everything as it is.
    let Ok(_guard) = CALLS.try_lock() else { return };
    if let Some(Ok(finalize)) = LOADED.get().map(|l| l.functions.lammps_mpi_finalize.as_ref()) {
        // SAFETY: LAMMPS itself checks that MPI is initialised and not yet finalised; nobody else is in a call.
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
        // SAFETY: these are LAMMPS and the MPI it was linked with; their initialisers ask for nothing beforehand.
        // Global, so that plugins find LAMMPS's symbols and LAMMPS finds this MPI.
        unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) }
            .map_err(|e| LammpsError::Load { path: path.clone(), reason: e.to_string() })
    };
    // MPI stays loaded for good.
    if let Some(mpi) = &host.mpi_library {
        std::mem::forget(open(mpi)?);
    }
    let library = libloading::Library::from(open(&host.library)?);
    // SAFETY: the functions have the types of LAMMPS's own header; their names tell them.
    let functions = unsafe { LammpsLibrary::from_library(library) }
        .map_err(|e| LammpsError::Load { path: host.library.clone(), reason: e.to_string() })?;
    let loaded = LOADED.get_or_init(|| Loaded { path: host.library.clone(), functions });
    // SAFETY: registers a function that lives as long as the process and unwinds never.
    unsafe { atexit(finalize_mpi) };
    Ok(&loaded.functions)
}

/// A function of the library, or an error if this version of LAMMPS has none.
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
        .map_err(|_| LammpsError::Request(format!("a zero byte in what LAMMPS is to be told: {text:?}")))
}

/// What LAMMPS says went wrong since it was asked last; None if nothing did.
fn last_error(library: &LammpsLibrary, handle: *mut c_void) -> Option<String> {
    let has = library.lammps_has_error.as_ref().ok()?;
    let get = library.lammps_get_last_error_message.as_ref().ok()?;
    // SAFETY: the handle is LAMMPS's or null, for which recent versions keep a message of their own.
    if unsafe { has(handle) } == 0 {
        return None;
    }
    let mut buffer: [c_char; 2048] = [0; 2048];
    // SAFETY: LAMMPS writes at most as many characters as the buffer has.
    unsafe { get(handle, buffer.as_mut_ptr(), buffer.len() as c_int) };
    buffer[2047] = 0;
    // SAFETY: the buffer ends with a zero.
    let text = unsafe { CStr::from_ptr(buffer.as_ptr()) };
    Some(text.to_string_lossy().trim().to_owned())
}

/// The simulation box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulationBox {
    /// Lower corner.
    pub lo: [f64; 3],
    /// Upper corner.
    pub hi: [f64; 3],
    /// Tilt factors xy, xz, yz.
    pub tilt: [f64; 3],
    /// Which directions are periodic.
    pub periodic: [bool; 3],
}

/// A LAMMPS in this process, on one MPI rank.
///
/// Several may be open at once, on any threads: their calls take turns. Dropping one closes it; MPI ends with the process.
pub struct Lammps {
    library: &'static LammpsLibrary,
    /// Not sent between threads.
    handle: *mut c_void,
    /// LAMMPS may keep pointers to its arguments.
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
            // SAFETY: the handle came from LAMMPS and is not used again.
            unsafe { close(self.handle) }
        }
    }
}

impl Lammps {
    /// Starts LAMMPS with `-log none -screen none -nocite` and further arguments, which override these.
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
        // SAFETY: as many arguments as counted, ended by a null; LAMMPS does not write to them, and they outlive it.
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

    /// Calls the library and asks for LAMMPS's errors afterwards.
    fn call<T>(&self, doing: &str, f: impl FnOnce() -> T) -> Result<T, LammpsError> {
        let _guard = exclusive();
        let result = f();
        match last_error(self.library, self.handle) {
            None => Ok(result),
            Some(message) => Err(LammpsError::Lammps { message, doing: doing.into() }),
        }
    }

    /// Carries out one command of the input language.
    pub fn command(&self, command: &str) -> Result<(), LammpsError> {
        let f = function!(self.library, lammps_command)?;
        let text = c_string(command)?;
        // SAFETY: an open LAMMPS and a C string; what it returns belongs to LAMMPS.
        self.call(command, || unsafe {
            f(self.handle, text.as_ptr());
        })
    }

    /// Carries out commands, one to a line, up to the first that fails. `&` at a line's end continues it, as do triple
    /// quotes; `jump` needs a file.
    pub fn commands(&self, commands: &str) -> Result<(), LammpsError> {
        split_commands(commands).iter().try_for_each(|c| self.command(c))
    }

    /// The version as a number: 20250722.
    pub fn version(&self) -> Result<i32, LammpsError> {
        let f = function!(self.library, lammps_version)?;
        // SAFETY: an open LAMMPS.
        self.call("asking for the version", || unsafe { f(self.handle) })
    }

    /// Whether this LAMMPS has a style: `has_style("pair", "mdpd")`.
    pub fn has_style(&self, category: &str, name: &str) -> Result<bool, LammpsError> {
        let f = function!(self.library, lammps_has_style)?;
        let (c, n) = (c_string(category)?, c_string(name)?);
        // SAFETY: an open LAMMPS and two C strings.
        self.call(&format!("looking for {category} style {name}"), || unsafe {
            f(self.handle, c.as_ptr(), n.as_ptr()) == 1
        })
    }

    /// The number of atoms.
    pub fn natoms(&self) -> Result<usize, LammpsError> {
        let f = function!(self.library, lammps_get_natoms)?;
        // SAFETY: an open LAMMPS.
        let n = self.call("counting atoms", || unsafe { f(self.handle) })?;
        Ok(n as usize)
    }

    /// A thermodynamic quantity of the last step: `temp`, `pe`, `press`, `pxy`, `c_ID[2]` …
    pub fn thermo(&self, name: &str) -> Result<f64, LammpsError> {
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "_[]*".contains(c)) {
            return Err(LammpsError::Request(format!("'{name}' is no name of a thermodynamic quantity")));
        }
        if self.library.lammps_eval.is_ok() {
            // The other function gives 0 for names that LAMMPS does not know.
            return self.eval(name);
        }
        let f = function!(self.library, lammps_get_thermo)?;
        let text = c_string(name)?;
        // SAFETY: an open LAMMPS and a C string.
        self.call(name, || unsafe { f(self.handle, text.as_ptr()) })
    }

    /// The value of an expression, as in an equal-style variable.
    pub fn eval(&self, expression: &str) -> Result<f64, LammpsError> {
        let f = function!(self.library, lammps_eval)?;
        let text = c_string(expression)?;
        // SAFETY: an open LAMMPS and a C string.
        self.call(expression, || unsafe { f(self.handle, text.as_ptr()) })
    }

    /// A setting such as `box_exist` or `nlocal`, by the names of LAMMPS's `lammps_extract_setting`; −1 if unknown.
    pub fn setting(&self, name: &str) -> Result<i32, LammpsError> {
        let f = function!(self.library, lammps_extract_setting)?;
        let text = c_string(name)?;
        // SAFETY: an open LAMMPS and a C string.
        self.call(name, || unsafe { f(self.handle, text.as_ptr()) })
    }

    /// The simulation box.
    pub fn simulation_box(&self) -> Result<SimulationBox, LammpsError> {
        if self.setting("box_exist")? != 1 {
            return Err(LammpsError::Request("LAMMPS has no box yet".into()));
        }
        let f = function!(self.library, lammps_extract_box)?;
        let (mut lo, mut hi, mut tilt) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let (mut periodic, mut changes): ([c_int; 3], c_int) = ([0; 3], 0);
        let [xy, xz, yz] = &mut tilt;
        // SAFETY: an open LAMMPS with a box; the arrays have the lengths that the function fills. Its order is xy, yz, xz.
        self.call("extracting the box", || unsafe {
            f(self.handle, lo.as_mut_ptr(), hi.as_mut_ptr(), xy, yz, xz, periodic.as_mut_ptr(), &mut changes)
        })?;
        Ok(SimulationBox { lo, hi, tilt, periodic: periodic.map(|p| p != 0) })
    }

    /// Refuses a request for a property of atoms with another type or width than it has: LAMMPS does not check this.
    fn check_property(&self, name: &str, width: usize, real: bool) -> Result<(), LammpsError> {
        let datatype = function!(self.library, lammps_extract_atom_datatype)?;
        let text = c_string(name)?;
        // SAFETY: an open LAMMPS and a C string.
        let kind = self.call(name, || unsafe { datatype(self.handle, text.as_ptr()) })?;
        let (kind_is_real, two) = match kind {
            INT => (false, false),
            INT_2D => (false, true),
            DOUBLE => (true, false),
            DOUBLE_2D => (true, true),
            -1 => {
                return Err(LammpsError::Request(format!("atoms have no property '{name}'")));
            }
            _ => {
                return Err(LammpsError::Request(format!(
                    "'{name}' is neither a 32-bit integer nor a double"
                )));
            }
        };
        if kind_is_real != real {
            let is = if kind_is_real { "a double" } else { "an integer" };
            return Err(LammpsError::Request(format!("'{name}' is {is}")));
        }
        let columns = match (two, name) {
            (false, "image") => {
                return if width == 3 || width == 1 { Ok(()) } else { Err(wrong_width(name, width, 3)) };
            }
            (false, _) => 1,
            (true, "x" | "v" | "f" | "omega" | "angmom" | "torque" | "vest") => 3,
            (true, "mu") => 4,
            (true, _) => {
                let size = function!(self.library, lammps_extract_atom_size)?;
                // SAFETY: an open LAMMPS and a C string.
                self.call(name, || unsafe { size(self.handle, text.as_ptr(), SIZE_COLS) })?.max(0) as usize
            }
        };
        if width == columns { Ok(()) } else { Err(wrong_width(name, width, columns)) }
    }

    /// Refuses a request for a per-atom compute or fix of another width than it has.
    fn check_columns(&self, name: &str, width: usize) -> Result<(), LammpsError> {
        let id = c_string(&name[2..])?;
        let size = if name.starts_with("c_") {
            let f = function!(self.library, lammps_extract_compute)?;
            // SAFETY: an open LAMMPS and a C string.
            self.call(name, || unsafe { f(self.handle, id.as_ptr(), STYLE_ATOM, SIZE_COLS) })?
        } else {
            let f = function!(self.library, lammps_extract_fix)?;
            // SAFETY: an open LAMMPS and a C string.
            self.call(name, || unsafe { f(self.handle, id.as_ptr(), STYLE_ATOM, SIZE_COLS, 0, 0) })?
        };
        if size.is_null() {
            return Err(LammpsError::Request(format!("no per-atom values '{name}'")));
        }
        // SAFETY: for this request the pointer is to LAMMPS's own int.
        let columns = unsafe { *size.cast::<c_int>() }.max(0) as usize;
        if width == columns.max(1) && !(width == 1 && columns == 1) {
            Ok(())
        } else {
            Err(wrong_width(name, width, columns.max(1)))
        }
    }

    /// Values of all atoms, by atom id: a property (`x`, `v`, `f`, `rho` …), a compute (`c_ID`), a fix (`f_ID`) or a
    /// `fix property/atom` (`d_NAME`); `width` values to an atom.
    ///
    /// Ids must run from 1 to the number of atoms. Computes that LAMMPS tallies during a step, such as `pe/atom`, need an
    /// output of that step that asks for them, for example `compute reduce sum` in `thermo_style`.
    pub fn gather(&self, name: &str, width: usize) -> Result<Vec<f64>, LammpsError> {
        let unset = f64::from_bits(0x7ff8_7073_6964_7064);
        let all = self.gather_any(name, width, true, unset)?;
        if all.iter().all(|x| x.to_bits() == unset.to_bits()) && !all.is_empty() {
            return Err(not_gathered(name));
        }
        Ok(all)
    }

    /// Integers of all atoms, by atom id: `id`, `type`, `image` (one word with `width` 1, three with 3), `i_NAME` …
    pub fn gather_ints(&self, name: &str, width: usize) -> Result<Vec<i32>, LammpsError> {
        let all = self.gather_any(name, width, false, i32::MIN)?;
        if all.iter().all(|x| *x == i32::MIN) && !all.is_empty() {
            return Err(not_gathered(name));
        }
        Ok(all)
    }

    /// `T` is f64 where `real`, else i32.
    fn gather_any<T: Copy>(
        &self,
        name: &str,
        width: usize,
        real: bool,
        unset: T,
    ) -> Result<Vec<T>, LammpsError> {
        let text = c_string(name)?;
        let general = match name.as_bytes() {
            [b'c' | b'f', b'_', ..] if !real => {
                return Err(LammpsError::Request(format!("'{name}' is a double")));
            }
            [b'c' | b'f', b'_', ..] => {
                self.check_columns(name, width)?;
                true
            }
            [b'd' | b'i', b'_', ..] => {
                if (name.as_bytes()[0] == b'd') != real || width != 1 {
                    return Err(LammpsError::Request(format!(
                        "'{name}' is not what was asked for: d_ is one double, i_ one integer"
                    )));
                }
                true
            }
            _ => {
                self.check_property(name, width, real)?;
                false
            }
        };
        let f = if general {
            function!(self.library, lammps_gather)?
        } else {
            function!(self.library, lammps_gather_atoms)?
        };
        let mut all = vec![unset; self.natoms()? * width];
        let kind = c_int::from(real);
        // SAFETY: an open LAMMPS; it fills natoms × width values of the type that `kind` says, which is T, and the checks
        // above have made sure that its own array is that wide.
        self.call(&format!("gathering {name}"), || unsafe {
            f(self.handle, text.as_ptr(), kind, width as c_int, all.as_mut_ptr().cast())
        })?;
        Ok(all)
    }

    /// Sets a property of all atoms from values by atom id. LAMMPS needs `atom_modify map yes` for it.
    pub fn scatter(&self, name: &str, width: usize, values: &[f64]) -> Result<(), LammpsError> {
        let f = function!(self.library, lammps_scatter_atoms)?;
        self.check_property(name, width, true)?;
        let natoms = self.natoms()?;
        if values.len() != natoms * width {
            return Err(LammpsError::Request(format!(
                "{} values of {name} for {natoms} atoms with {width} each",
                values.len()
            )));
        }
        let text = c_string(name)?;
        // SAFETY: an open LAMMPS; it reads natoms × width doubles and writes none.
        self.call(&format!("scattering {name}"), || unsafe {
            f(self.handle, text.as_ptr(), 1, width as c_int, values.as_ptr().cast_mut().cast())
        })
    }

    fn extract_compute(&self, id: &str, what: c_int) -> Result<*mut c_void, LammpsError> {
        let f = function!(self.library, lammps_extract_compute)?;
        let text = c_string(id)?;
        // SAFETY: an open LAMMPS and a C string.
        let found = self.call(&format!("computing {id}"), || unsafe {
            f(self.handle, text.as_ptr(), STYLE_GLOBAL, what)
        })?;
        if found.is_null() {
            return Err(LammpsError::Request(format!("there is no compute '{id}' with such a value")));
        }
        Ok(found)
    }

    /// The global scalar of a compute.
    pub fn compute_scalar(&self, id: &str) -> Result<f64, LammpsError> {
        let value = self.extract_compute(id, TYPE_SCALAR)?;
        // SAFETY: for a scalar the pointer is to LAMMPS's own double.
        Ok(unsafe { *value.cast::<f64>() })
    }

    /// The global vector of a compute.
    pub fn compute_vector(&self, id: &str) -> Result<Vec<f64>, LammpsError> {
        let values = self.extract_compute(id, TYPE_VECTOR)?.cast::<f64>();
        let size = self.extract_compute(id, SIZE_VECTOR)?;
        // SAFETY: for the size the pointer is to LAMMPS's own int; the vector has that many doubles, and no call that could
        // change it comes between.
        let slice = unsafe {
            let n = (*size.cast::<c_int>()).max(0) as usize;
            std::slice::from_raw_parts(values, n)
        };
        Ok(slice.to_vec())
    }
}

fn wrong_width(name: &str, asked: usize, has: usize) -> LammpsError {
    LammpsError::Request(format!("'{name}' has {has} values to an atom, not {asked}"))
}

fn not_gathered(name: &str) -> LammpsError {
    LammpsError::Lammps {
        message: "nothing was gathered: atom ids must run from 1 to the number of atoms".into(),
        doing: format!("gathering {name}"),
    }
}

/// Commands of a text: continued lines joined, empty lines and comments left out.
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
