//! Files are written through one door, `psidpd_formats::files`: other code has no way to replace or remove one, and does not
//! follow what the folder of a run holds.

use psidpd_tests::root;
use std::path::{Path, PathBuf};

/// Where the program's own sources are.
const SOURCES: &[&str] = &[
    "validation/src",
    "validation/formats/src",
    "validation/pictures/src",
    "validation/observe/src",
    "validation/report/src",
    "validation/dynamics/src",
    "validation/lammps-host/src",
    "validation/experiments/src",
    "python/src",
    "rust-core/model/src",
    "rust-core/src",
];

const DOOR: &str = "validation/formats/src/files/";

/// Functions that write, replace or remove.
const WRITES: &[&str] = &[
    "fs::write(",
    "File::create",
    "OpenOptions",
    "File::options",
    "fs::rename",
    "fs::copy",
    "remove_file",
    "remove_dir",
    "hard_link",
    "symlink(",
    "set_len(",
    "set_permissions",
    "generate_to",
    ".persist(",
    "NamedTempFile",
    "tempfile::tempdir(",
    "renameat",
    "unlinkat",
    "linkat",
];

/// Functions that follow links and open whatever is there.
const READS: &[&str] = &["fs::read(", "fs::read_to_string(", "File::open("];

/// Files that use some of them, and why.
const ALLOWED: &[(&str, &[&str], &str)] = &[
    ("validation/formats/src/gsd.rs", &["set_len("], "of a file that the door has opened"),
    ("validation/dynamics/src/run/growing.rs", &["set_len("], "of a file that the door has opened"),
    (
        "validation/dynamics/src/checkpoint/store.rs",
        &["fs::rename", "hard_link", "File::open("],
        "checkpoints take turns; a folder is synced",
    ),
    ("validation/dynamics/src/run/folder.rs", &["File::open("], "the lock of a folder"),
    ("validation/experiments/src/sweep/mod.rs", &["File::open("], "the lock of a folder"),
    ("validation/formats/src/memory.rs", &["fs::read_to_string("], "/proc and /sys"),
    ("validation/experiments/src/machine.rs", &["fs::read_to_string("], "/proc"),
    ("validation/experiments/src/bench/mod.rs", &["fs::read_to_string("], "/proc"),
    (
        "validation/experiments/src/crosscheck/trace.rs",
        &["File::open("],
        "a file of LAMMPS in a folder that ends with its use",
    ),
    ("validation/lammps-host/src/host.rs", &["fs::read_to_string("], "/proc"),
    ("validation/lammps-host/src/trust.rs", &["fs::read_to_string("], "/proc"),
    (
        "validation/lammps-host/src/mpi.rs",
        &["fs::read(", "File::open("],
        "headers and libraries of LAMMPS's MPI",
    ),
    ("validation/lammps-host/src/made_from.rs", &["fs::read("], "the sources of the plugin"),
    ("validation/lammps-host/src/record.rs", &["fs::read_to_string("], "pip's list of files"),
    ("validation/lammps-host/src/plugin.rs", &["tempdir_in("], "where the linker writes"),
    ("rust-core/model/src/document/columns.rs", &["File::open("], "what is known to be a regular file"),
];

fn files(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            files(&entry, all);
        } else if entry.extension().is_some_and(|end| end == "rs") {
            all.push(entry);
        }
    }
}

/// The code of a file without its tests, which stand at its end, and without comments.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Whether the text has the word, not as the end of a longer one.
fn uses(text: &str, word: &str) -> bool {
    let begins = |at: usize| !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    text.match_indices(word).any(|(at, _)| word.starts_with('.') || begins(at))
}

#[test]
fn nothing_is_written_or_read_beside_the_door() {
    let mut all = Vec::new();
    SOURCES.iter().for_each(|folder| files(&root().join(folder), &mut all));
    assert!(all.len() > 300, "{}", all.len());
    let mut found = Vec::new();
    for path in all {
        let name = path.strip_prefix(root()).unwrap().to_string_lossy().into_owned();
        let is_test = name.contains("/tests/") || name.ends_with("/tests.rs");
        if is_test || name.starts_with(DOOR) {
            continue;
        }
        let allowed = ALLOWED.iter().find(|(file, _, _)| *file == name).map_or(&[][..], |(_, uses, _)| uses);
        let text = code(&std::fs::read_to_string(&path).unwrap());
        for word in WRITES.iter().chain(READS).filter(|word| uses(&text, word) && !allowed.contains(word)) {
            found.push(format!("{name}: {word}"));
        }
    }
    assert!(found.is_empty(), "use psidpd_formats::files: {found:#?}");
}

/// `eprintln!` panics where standard error is closed or full, in the middle of the work.
#[test]
fn no_line_for_standard_error_can_panic() {
    let mut all = Vec::new();
    SOURCES.iter().for_each(|folder| files(&root().join(folder), &mut all));
    let is_test =
        |path: &Path| path.ends_with("tests.rs") || path.components().any(|part| part.as_os_str() == "tests");
    for path in all.iter().filter(|path| !is_test(path)) {
        let text = code(&std::fs::read_to_string(path).unwrap());
        for word in ["eprintln!(", "eprint!(", "dbg!("] {
            assert!(!uses(&text, word), "{}: use psidpd_report::to_stderr", path.display());
        }
    }
}

/// The Python part of the package writes nothing, and opens what a folder holds by one function.
#[test]
fn python_reads_by_one_function() {
    let words = [
        "fdopen",
        " open(",
        "=open(",
        "(open(",
        "os.open(",
        "read_text",
        "read_bytes",
        "read_csv(self",
        "read_csv(Path",
        "write_text",
        "write_bytes",
        "unlink",
        "rmtree",
        "rename",
    ];
    for entry in std::fs::read_dir(root().join("python/psidpd")).unwrap().map(|entry| entry.unwrap().path()) {
        let name = entry.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".py") || name == "files.py" || name == "lammps.py" {
            continue;
        }
        let text = std::fs::read_to_string(&entry).unwrap();
        for word in words {
            assert!(!text.contains(word), "{name}: {word}");
        }
    }
}
