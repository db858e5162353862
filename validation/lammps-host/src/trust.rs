//! Who may supply what is executed: only the user and the system.

use super::error::{LammpsError, PathError};
use super::host::Host;
use rustix::process::geteuid;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The checkout that this program was built in, if it is still there, belongs to the user, and holds the program: an installed
/// copy has none. A program that psidpd is a part of, such as Python, may lie anywhere.
pub(super) fn checkout() -> Result<PathBuf, LammpsError> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("/"));
    let parts = ["Cargo.toml", "lammps-plugin/Cargo.toml", "rust-core/Cargo.toml"];
    if !parts.iter().all(|part| root.join(part).is_file()) || !is_built_in(root) {
        return Err(LammpsError::NoSources);
    }
    check(root, root).map(|()| root.to_owned())
}

fn is_built_in(root: &Path) -> bool {
    let Ok(program) = std::env::current_exe().and_then(fs::canonicalize) else { return false };
    let installed = program.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"psidpd"));
    // Cargo locks the folders that it builds in, which need not be in the checkout.
    let built = program.ancestors().any(|folder| folder.join(".cargo-lock").is_file());
    !installed || built || root.canonicalize().is_ok_and(|root| program.starts_with(root))
}

/// Checks the programs and libraries of a LAMMPS below `base`.
pub(super) fn check_host(host: &Host, base: &Path) -> Result<(), LammpsError> {
    let files = [&host.library, &host.lmp].into_iter().chain(&host.mpi_library).chain(&host.mpirun);
    files.chain(&host.library_path).try_for_each(|file| check(file, base))
}

/// Checks that nobody but the user and the system can change a file, nor the folders from it up to `base`.
pub(super) fn check(path: &Path, base: &Path) -> Result<(), LammpsError> {
    let me = geteuid().as_raw();
    let real = |path: &Path| path.canonicalize().map_err(PathError::at("find", path));
    let (path, base) = (real(path)?, real(base)?);
    for place in path.ancestors() {
        let about = fs::metadata(place).map_err(PathError::at("find", place))?;
        // Where every user has a group of its own, it has the user's number.
        let open_to_group = about.mode() & 0o020 != 0 && about.gid() != about.uid();
        let why = if place.starts_with(&base) || place == path {
            match about.uid() {
                0 => None,
                uid if uid == me => None,
                uid => Some(format!("belongs to the user {uid}")),
            }
            .or_else(|| {
                (about.mode() & 0o002 != 0 || open_to_group).then(|| "can be changed by others".into())
            })
        } else {
            // In a folder above, others could put another in the place of this one.
            (about.mode() & 0o1002 == 0o002).then(|| "can be changed by others".into())
        };
        if let Some(why) = why {
            return Err(LammpsError::Untrusted { path: place.to_owned(), why });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn what_others_can_change_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let base = folder.path().join("base");
        let file = base.join("inner/lmp");
        fs::create_dir_all(base.join("inner")).unwrap();
        fs::write(&file, "").unwrap();
        let mode = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
        let names = |error: LammpsError| matches!(error, LammpsError::Untrusted { path, .. } if path.starts_with(folder.path()));
        for place in [&file, &base.join("inner"), &base] {
            check(&file, &base).unwrap();
            mode(place, 0o777);
            assert!(names(check(&file, &base).unwrap_err()), "{}", place.display());
            mode(place, 0o755);
        }
        // A folder that all may write into is harmless above if it keeps what belongs to others.
        for (bits, harmless) in [(0o1777, true), (0o777, false)] {
            mode(folder.path(), bits);
            assert_eq!(check(&file, &base).is_ok(), harmless, "{bits:o}");
        }
        mode(folder.path(), 0o700);
        let link = base.join("link");
        std::os::unix::fs::symlink("inner/lmp", &link).unwrap();
        check(&link, &base).unwrap();
        mode(&file, 0o666);
        assert!(names(check(&link, &base).unwrap_err()));
    }
}
