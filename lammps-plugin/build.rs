//! Compiles the C++ pair styles against one LAMMPS.
//!
//! Without `PSIDPD_LAMMPS_INCLUDE` there are no LAMMPS headers: only the Rust side is built, so that
//! the workspace builds and tests anywhere, and the library has no `lammpsplugin_init`.

use std::env;
use std::path::PathBuf;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(lammps_host)");
    for name in
        ["PSIDPD_LAMMPS_INCLUDE", "PSIDPD_MPI_INCLUDE", "PSIDPD_LAMMPS_VERSION", "PSIDPD_LAMMPS_HEADERS"]
    {
        println!("cargo::rerun-if-env-changed={name}");
    }
    for folder in ["cpp", "compat"] {
        println!("cargo::rerun-if-changed={folder}");
    }
    let Some(lammps) = env::var_os("PSIDPD_LAMMPS_INCLUDE").map(PathBuf::from) else {
        return;
    };
    let version = env::var("PSIDPD_LAMMPS_VERSION")
        .ok()
        .filter(|v| v.parse::<u32>().is_ok())
        .expect("PSIDPD_LAMMPS_VERSION: the number that lammps_version() of the host returns, like 20250722");
    println!("cargo::rustc-cfg=lammps_host");
    println!("cargo::rustc-env=PSIDPD_LAMMPS_VERSION={version}");
    // Headers in one folder may change, and keep old dates: the variable tells cargo.
    let made_of = env::var("PSIDPD_LAMMPS_HEADERS").unwrap_or_default();
    println!("cargo::rustc-env=PSIDPD_LAMMPS_HEADERS={made_of}");
    // LAMMPS unloads plugins with dlclose, and a Rust library must stay loaded.
    println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");

    let mut build = cxx_build::bridge("src/bridge.rs");
    build
        .files([
            "cpp/pair_psi.cpp",
            "cpp/pair_psi_checks.cpp",
            "cpp/pair_psi_compute.cpp",
            "cpp/pair_psi_heat.cpp",
            "cpp/pair_psi_walls.cpp",
            "cpp/special_pairs.cpp",
            "cpp/exclusions.cpp",
            "cpp/listed_pairs.cpp",
            "cpp/ghost_exchange.cpp",
            "cpp/ghost_reach.cpp",
            "cpp/images.cpp",
            "cpp/lost_atoms.cpp",
            "cpp/pair_table.cpp",
            "cpp/restart.cpp",
            "cpp/pair_dpd_psi.cpp",
            "cpp/pair_mdpd_psi.cpp",
            "cpp/pair_dpd_spline.cpp",
            "cpp/fix_dpd_wall.cpp",
            "cpp/fix_dpd_wall_read.cpp",
            "cpp/fix_splitting.cpp",
            "cpp/fix_splitting_arrays.cpp",
            "cpp/fix_splitting_beside.cpp",
            "cpp/fix_splitting_displaced.cpp",
            "cpp/fix_splitting_held.cpp",
            "cpp/fix_splitting_walls.cpp",
            "cpp/register.cpp",
        ])
        .include("cpp")
        .std("c++17")
        .define("LAMMPS_SMALLBIG", None)
        .define("MPICH_SKIP_MPICXX", None)
        .define("OMPI_SKIP_MPICXX", None);
    // Warnings in the host's headers are not shown.
    build.flag("-isystem").flag(lammps.as_os_str());
    // Debian 12 packages LAMMPS's headers without the fmt headers that they include.
    if !lammps.join("fmt/format.h").is_file() {
        build.include("compat");
    }
    if let Some(mpi) = env::var_os("PSIDPD_MPI_INCLUDE") {
        build.flag("-isystem").flag(&mpi);
    }
    build.compile("psidpd_lammps_styles");
}
