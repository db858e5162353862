//! Regenerates `src/lammps/bindings.rs` from the `library.h` of an installed LAMMPS:
//!
//! `cargo run -p psidpd-lammps-host --example generate_bindings --features bindgen -- PATH/TO/lammps/library.h`
//!
//! and then `cargo fmt`. Needs libclang (Debian: `libclang1`; PyPI: `libclang`, with `LIBCLANG_PATH` set to its folder) and a C compiler's headers.
use std::path::Path;

/// What `Lammps` calls. A function that a LAMMPS version lacks does not prevent loading: it fails when called.
const USED: &str = "lammps_(open_no_mpi|close|mpi_finalize|command|version|get_natoms|get_thermo|eval|extract_box|extract_setting\
|extract_atom_datatype|extract_atom_size|extract_compute|extract_fix|gather_atoms|gather|scatter_atoms\
|has_error|get_last_error_message|has_style|free)";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let header = std::env::args().nth(1).ok_or("give the path of lammps/library.h")?;
    let bindings = bindgen::Builder::default()
        .header(header)
        .allowlist_function(USED)
        .allowlist_recursively(false)
        .dynamic_library_name("LammpsLibrary")
        .dynamic_link_require_all(false)
        .generate_comments(false)
        .layout_tests(false)
        .raw_line("//! LAMMPS's C library interface, loaded at run time. Written by `examples/generate_bindings.rs`: do not edit.")
        .generate()?;
    let out = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lammps/bindings.rs");
    bindings.write_to_file(&out)?;
    println!("wrote {}", out.display());
    Ok(())
}
