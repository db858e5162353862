//! `validation/lammps-host/src/bindings.rs` has bindgen's declarations of LAMMPS's C library interface. The command
//!
//! `PSIDPD_UPDATE_BINDINGS=1 cargo test --release -p psidpd-tests --test bindings -- --ignored`
//!
//! writes it anew; it needs libclang (Debian: `libclang1-14`; PyPI: `libclang`, with `LIBCLANG_PATH` set to
//! its folder) and the headers of a C compiler.

use psidpd_tests::{lammps, root};
use std::process::Command;

/// The functions that `Lammps` calls. A function that a LAMMPS version lacks does not prevent loading: it
/// fails when called.
const USED: &str = "lammps_(open_no_mpi|close|mpi_finalize|command|version|get_natoms|get_thermo|eval|extract_box|extract_setting\
|extract_atom_datatype|extract_atom_size|extract_compute|extract_fix|gather_atoms|gather|scatter_atoms\
|has_error|get_last_error_message|has_style)";

#[test]
#[ignore = "needs libclang; .ci/run runs it"]
fn the_bindings_are_those_of_the_header() {
    let header = lammps().0.include.join("library.h");
    // libclang has no compiler headers; those of the C compiler serve.
    let headers = Command::new("cc").arg("-print-file-name=include").output().expect("there is a C compiler");
    let headers = String::from_utf8(headers.stdout).unwrap();
    let bindings = bindgen::Builder::default()
        .header(header.to_str().expect("the path of the checkout is text"))
        .clang_args(["-isystem", headers.trim()])
        .allowlist_function(USED)
        .allowlist_recursively(false)
        .merge_extern_blocks(true)
        .generate_comments(false)
        .layout_tests(false)
        .raw_line("//! LAMMPS's C library interface, loaded at run time. Written by `tests/tests/bindings.rs`: do not edit.\n")
        .raw_line("use std::ffi::{c_char, c_int, c_void};")
        .generate()
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("bindings.rs");
    std::fs::write(&made, bindings.to_string().replace("::std::os::raw::", "")).unwrap();
    let options = ["--edition", "2024", "--config-path"];
    let formatted = Command::new("rustfmt").args(options).arg(root()).arg(&made).status();
    assert!(formatted.expect("rustfmt starts").success());
    let kept = root().join("validation/lammps-host/src/bindings.rs");
    // The macro `library!` takes the place of the block: the functions are looked up at run time, not linked.
    let made = std::fs::read_to_string(made).unwrap().replace("unsafe extern \"C\" {", "library! {");
    if std::env::var_os("PSIDPD_UPDATE_BINDINGS").is_some() {
        std::fs::write(kept, made).unwrap();
    } else {
        assert_eq!(std::fs::read_to_string(kept).unwrap(), made, "PSIDPD_UPDATE_BINDINGS=1 writes them anew");
    }
}
