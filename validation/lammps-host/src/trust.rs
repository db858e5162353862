//! Who may supply what is executed: only the user and the system.

use super::error::{LammpsError, PathError};
use super::host::Host;
use rustix::process::geteuid;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Linux's number for owners that a container does not know.
const NOBODY: u32 = 65534;

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

/// Checks that nobody but the user and the system can change a file or the folders from it up to `base`, and that no other user can
/// put another folder in the place of one above.
pub(super) fn check(path: &Path, base: &Path) -> Result<(), LammpsError> {
    let me = geteuid().as_raw();
    let real = |path: &Path| path.canonicalize().map_err(PathError::at("find", path));
    let (path, base) = (real(path)?, real(base)?);
    for place in path.ancestors() {
        let about = fs::metadata(place).map_err(PathError::at("find", place))?;
        let within = place.starts_with(&base) || place == path;
        let why = if !is_the_users_or_the_systems(about.uid(), me, within) {
            Some(format!("belongs to the user {}", about.uid()))
        } else {
            is_open_to_others(&about, within).then(|| "can be changed by others".into())
        };
        if let Some(why) = why {
            return Err(LammpsError::Untrusted { path: place.to_owned(), why });
        }
    }
    Ok(())
}

fn is_the_users_or_the_systems(owner: u32, me: u32, within: bool) -> bool {
    // In a container of the user's own, the system's folders belong to nobody's number, as the system's user has none there.
    owner == 0 || owner == me || (!within && owner == NOBODY && !has_all_users())
}

fn is_open_to_others(about: &fs::Metadata, within: bool) -> bool {
    let (mode, foreign_group) = (about.mode(), about.gid() != about.uid());
    if within {
        // Where every user has a group of its own, it has the user's number.
        return mode & 0o002 != 0 || (mode & 0o020 != 0 && foreign_group);
    }
    // A folder above may be open if it keeps what belongs to others; the system knows whom it gives its own folders to.
    let keeps = mode & 0o1000 != 0;
    !keeps && (mode & 0o002 != 0 || (mode & 0o020 != 0 && foreign_group && about.uid() != 0))
}

/// Whether this process's user namespace has all users: false in a container that a user started.
fn has_all_users() -> bool {
    let map = fs::read_to_string("/proc/self/uid_map").unwrap_or_default();
    map.split_whitespace().eq(["0", "0", "4294967295"])
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
        // Only the system's user can give folders away.
        if geteuid().is_root() {
            for (owner, group, bits, harmless) in [
                (4321, 0, 0o755, false),
                (0, 4321, 0o755, true),
                // The system knows whom it gives its own folders to; a user's folder is open to his group.
                (0, 4321, 0o775, true),
                (NOBODY, NOBODY, 0o755, !has_all_users()),
            ] {
                std::os::unix::fs::chown(folder.path(), Some(owner), Some(group)).unwrap();
                mode(folder.path(), bits);
                assert_eq!(check(&file, &base).is_ok(), harmless, "{owner}:{group} {bits:o}");
            }
            for (owner, group, bits, open) in
                [(1, 1, 0o775, false), (1, 2, 0o775, true), (1, 2, 0o1775, false)]
            {
                std::os::unix::fs::chown(folder.path(), Some(owner), Some(group)).unwrap();
                mode(folder.path(), bits);
                let about = fs::metadata(folder.path()).unwrap();
                assert_eq!(is_open_to_others(&about, false), open, "{owner}:{group} {bits:o}");
            }
            std::os::unix::fs::chown(folder.path(), Some(0), Some(0)).unwrap();
        }
        mode(folder.path(), 0o700);
        let link = base.join("link");
        std::os::unix::fs::symlink("inner/lmp", &link).unwrap();
        check(&link, &base).unwrap();
        mode(&file, 0o666);
        assert!(names(check(&link, &base).unwrap_err()));
    }
}
