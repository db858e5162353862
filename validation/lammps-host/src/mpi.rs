//! Finds the MPI that a LAMMPS library uses, with its headers and launcher.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::error::{LammpsError, PathError};

#[derive(Debug)]
pub(super) struct Mpi {
    pub include: PathBuf,
    pub library: Option<PathBuf>,
    pub mpirun: Option<PathBuf>,
}

/// The two kinds of MPI, whose handles differ in type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flavour {
    OpenMpi,
    Mpich,
}

impl Flavour {
    /// The kind by the name of the library in the loader: MPICH and its relatives share `libmpi.so.12`.
    fn of(library: &Path) -> Flavour {
        let name = library.file_name().unwrap_or_default().to_string_lossy();
        if name.contains("mpich") || name.ends_with("libmpi.so.12") {
            Flavour::Mpich
        } else {
            Flavour::OpenMpi
        }
    }

    /// Whether a folder has an `mpi.h` of this kind.
    fn has_header(self, folder: &Path) -> bool {
        // Some `mpi.h` files are not UTF-8.
        let text = fs::read(folder.join("mpi.h")).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        match self {
            Flavour::OpenMpi => text.contains("OPEN_MPI"),
            Flavour::Mpich => text.contains("MPICH_VERSION"),
        }
    }

    fn package(self) -> &'static str {
        match self {
            Flavour::OpenMpi => "Open MPI's headers; Debian: apt install libopenmpi-dev",
            Flavour::Mpich => "MPICH's headers; Debian: apt install libmpich-dev",
        }
    }
}

/// The MPI library that a LAMMPS library uses, if any.
pub(super) fn library_of(lammps: &Path) -> Result<Option<PathBuf>, LammpsError> {
    let ldd = Path::new("ldd");
    let out =
        Command::new(ldd).arg(lammps).stdin(Stdio::null()).output().map_err(PathError::at("run", ldd))?;
    mpi_among(&String::from_utf8_lossy(&out.stdout)).map_err(|name| LammpsError::Load {
        path: lammps.to_owned(),
        reason: format!("it needs {name}, which is not installed: install that MPI"),
    })
}

/// Parses the output of `ldd`; the error is the name of a missing library.
fn mpi_among(ldd: &str) -> Result<Option<PathBuf>, String> {
    for line in ldd.lines() {
        let Some((name, rest)) = line.trim().split_once(" => ") else { continue };
        if !(name.starts_with("libmpi.so") || name.starts_with("libmpich.so")) {
            continue;
        }
        let path = rest.split(" (").next().unwrap_or_default().trim();
        return if path.starts_with('/') { Ok(Some(path.into())) } else { Err(name.to_owned()) };
    }
    Ok(None)
}

/// The headers and the launcher of an MPI library; `prefix` is the folder of LAMMPS.
pub(super) fn installed(library: &Path, prefix: &Path) -> Result<Mpi, LammpsError> {
    let flavour = Flavour::of(library);
    let bin = prefix.join("bin");
    let (packages, wrappers, launchers): (&[&str], &[&str], &[&str]) = match flavour {
        Flavour::OpenMpi => (&["ompi", "mpi"], &["mpicxx.openmpi", "mpicxx"], &["mpirun.openmpi", "mpirun"]),
        Flavour::Mpich => {
            (&["mpich", "mpi"], &["mpicxx.mpich", "mpicxx"], &["mpiexec.hydra", "mpirun.mpich", "mpirun"])
        }
    };
    let mut folders = vec![prefix.join("include")];
    // For lib/openmpi/lib/libmpi.so.40 this is lib/openmpi/include; links are resolved first.
    if let Some(lib) = fs::canonicalize(library).ok().as_deref().and_then(Path::parent) {
        folders.push(lib.with_file_name("include"));
    }
    for package in packages {
        folders.extend(included(Command::new("pkg-config").args(["--cflags-only-I", package])));
    }
    for wrapper in wrappers {
        for path in [bin.join(wrapper), PathBuf::from(wrapper)] {
            folders.extend(included(Command::new(&path).arg("--showme:compile")));
            folders.extend(included(Command::new(&path).arg("-show")));
        }
    }
    let include = folders.into_iter().find(|f| flavour.has_header(f)).ok_or(LammpsError::NoHeader {
        header: "mpi.h",
        include: prefix.join("include"),
        package: flavour.package(),
    })?;
    let on_path = std::env::var_os("PATH").unwrap_or_default();
    let places: Vec<PathBuf> = std::iter::once(bin).chain(std::env::split_paths(&on_path)).collect();
    let mpirun = launchers
        .iter()
        .flat_map(|name| places.iter().map(move |place| place.join(name)))
        .find(|path| path.is_file());
    Ok(Mpi { include, library: Some(library.to_owned()), mpirun })
}

/// The folders after `-I` in the output of a program.
fn included(command: &mut Command) -> Vec<PathBuf> {
    let Ok(out) = command.stdin(Stdio::null()).output() else { return vec![] };
    let text = String::from_utf8_lossy(&out.stdout);
    text.split_whitespace().filter_map(|word| word.strip_prefix("-I")).map(PathBuf::from).collect()
}

impl Mpi {
    /// LAMMPS's replacement for MPI, which only its source tree has.
    pub(super) fn stubs(include: &Path) -> Result<Mpi, LammpsError> {
        let folder = include.join("STUBS");
        if !folder.join("mpi.h").is_file() {
            return Err(LammpsError::NoHeader {
                header: "mpi.h",
                include: folder,
                package: "the source of this LAMMPS, which was built without MPI",
            });
        }
        Ok(Mpi { include: folder, library: None, mpirun: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_among_dependencies() {
        let text = "\tlinux-vdso.so.1 (0x00007ffd)\n\tlibmpi_cxx.so.40 => /lib/libmpi_cxx.so.40 (0x1)\n\
                    \tlibmpi.so.40 => /lib/x/libmpi.so.40 (0x00007fe1)\n";
        assert_eq!(mpi_among(text), Ok(Some("/lib/x/libmpi.so.40".into())));
        assert_eq!(mpi_among("\tlibmpi.so.12 => not found\n"), Err("libmpi.so.12".into()));
        assert_eq!(mpi_among("\tlibc.so.6 => /lib/libc.so.6 (0x1)\n"), Ok(None));
        assert_eq!(mpi_among("not a dynamic executable"), Ok(None));
    }

    #[test]
    fn flavours() {
        for (name, flavour) in [
            ("/a/libmpi.so.12", Flavour::Mpich),
            ("libmpich.so.12", Flavour::Mpich),
            ("libmpi.so.40", Flavour::OpenMpi),
            ("libmpi.so.20", Flavour::OpenMpi),
        ] {
            assert_eq!(Flavour::of(Path::new(name)), flavour, "{name}");
        }
        let dir = tempfile::tempdir().unwrap();
        assert!(!Flavour::Mpich.has_header(dir.path()));
        fs::write(dir.path().join("mpi.h"), "#define OPEN_MPI 1\n").unwrap();
        assert!(Flavour::OpenMpi.has_header(dir.path()) && !Flavour::Mpich.has_header(dir.path()));
        // No headers of this kind are beside the library, and perhaps none on this machine.
        if let Err(e) = installed(Path::new("/nowhere/libmpich.so.12"), dir.path()) {
            assert!(e.to_string().contains("libmpich-dev"), "{e}");
        }
        let e = Mpi::stubs(dir.path()).unwrap_err();
        assert!(e.to_string().contains("without MPI"), "{e}");
    }
}
