//! The digest of a plugin's sources: equal digests mean equal plugins.

use super::error::{LammpsError, PathError};
use super::host::Host;
use std::collections::BTreeSet;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Folders and files of the checkout that a plugin is built from.
const SOURCES: [&str; 12] = [
    "Cargo.toml",
    "Cargo.lock",
    "rust-core/Cargo.toml",
    "rust-core/src",
    "rust-core/gpu",
    "rust-core/model",
    "rust-core/passes",
    "rust-core/threads",
    "lammps-plugin/Cargo.toml",
    "lammps-plugin/build.rs",
    "lammps-plugin/src",
    "lammps-plugin/entry",
];
const CPP: [&str; 3] = ["lammps-plugin/cpp", "lammps-plugin/compat", "lammps-plugin/launcher"];

/// Environment variables that compilers read.
const SETTINGS: [&str; 4] = ["RUSTFLAGS", "CXXFLAGS", "CARGO_ENCODED_RUSTFLAGS", "RUSTUP_TOOLCHAIN"];

/// The digest of a plugin for `host` from the checkout `root`.
pub(super) fn digest(
    host: &Host,
    root: &Path,
    compiler: &[String],
    features: &[&str],
) -> Result<String, LammpsError> {
    let mut hasher = DefaultHasher::new();
    compiler.hash(&mut hasher);
    for name in SETTINGS {
        std::env::var_os(name).hash(&mut hasher);
    }
    features.hash(&mut hasher);
    for part in SOURCES.iter().chain(&CPP) {
        add(&root.join(part), &root.join(part), &mut hasher)?;
    }
    headers(host)?.hash(&mut hasher);
    Ok(format!("{:016x}", hasher.finish()))
}

/// A digest of the headers of LAMMPS and of MPI.
pub(super) fn headers(host: &Host) -> Result<String, LammpsError> {
    let mut hasher = DefaultHasher::new();
    // Of a source tree only its own headers count, without those of packages in subfolders. Of MPI only
    // `mpi.h` counts, because its folder may hold headers of other software.
    let entries = fs::read_dir(&host.include).map_err(PathError::at("read", &host.include))?;
    let files = entries.filter_map(|e| Some(e.ok()?.path()));
    let headers: BTreeSet<PathBuf> = files.filter(|p| p.extension().is_some_and(|e| e == "h")).collect();
    for header in &headers {
        add(&host.include, header, &mut hasher)?;
    }
    add(&host.mpi_include, &host.mpi_include.join("mpi.h"), &mut hasher)?;
    Ok(format!("{:016x}", hasher.finish()))
}

/// Adds a file, or all files in a folder, by their contents and their names relative to `top`.
fn add(top: &Path, path: &Path, hasher: &mut DefaultHasher) -> Result<(), LammpsError> {
    if path.is_dir() {
        let entries = fs::read_dir(path).map_err(PathError::at("read", path))?;
        let inside: BTreeSet<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        return inside.iter().try_for_each(|path| add(top, path, hasher));
    }
    // The build works without a missing part, so the part counts as empty.
    let text = fs::read(path).unwrap_or_default();
    path.strip_prefix(top).unwrap_or(path).hash(hasher);
    text.hash(hasher);
    Ok(())
}
