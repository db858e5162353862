//! Passes to the entry the LAMMPS and the MPI that the styles are compiled for; the environment
//! variables are those of the styles' build.

use std::env;
use std::path::{Path, PathBuf};

#[allow(dead_code)] // The plugin compares digests, this script writes them.
#[path = "src/headers.rs"]
mod headers;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(lammps_host)");
    for name in [
        "PSIDPD_LAMMPS_INCLUDE",
        "PSIDPD_MPI_INCLUDE",
        "PSIDPD_LAMMPS_VERSION",
        "PSIDPD_LAMMPS_RELEASE",
        "PSIDPD_LAMMPS_HEADERS",
    ] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    for path in ["build.rs", "src", "../cpp"] {
        println!("cargo::rerun-if-changed={path}");
    }
    let (Ok(version), Some(include)) =
        (env::var("PSIDPD_LAMMPS_VERSION"), env::var_os("PSIDPD_LAMMPS_INCLUDE"))
    else {
        return;
    };
    let mpi = env::var_os("PSIDPD_MPI_INCLUDE").map(|folder| PathBuf::from(folder).join("mpi.h"));
    // An mpi.h may contain bytes that are not UTF-8.
    let mpi = mpi.and_then(|header| std::fs::read(header).ok()).unwrap_or_default();
    let kind = if String::from_utf8_lossy(&mpi).contains("OPEN_MPI") { "openmpi" } else { "other" };
    println!("cargo::rustc-cfg=lammps_host");
    println!("cargo::rustc-env=PSIDPD_LAMMPS_VERSION={version}");
    let release = env::var("PSIDPD_LAMMPS_RELEASE").unwrap_or_default();
    println!("cargo::rustc-env=PSIDPD_LAMMPS_RELEASE={release}");
    let made_of = env::var("PSIDPD_LAMMPS_HEADERS").unwrap_or_default();
    println!("cargo::rustc-env=PSIDPD_LAMMPS_HEADERS={made_of}");
    let digests = headers::digests(Path::new("../cpp"), Path::new(&include));
    println!("cargo::rustc-env=PSIDPD_LAMMPS_LAYOUT={}", headers::written(&digests));
    println!("cargo::rustc-env=PSIDPD_MPI={kind}");
    // LAMMPS unloads plugins with dlclose, and a Rust library must stay loaded.
    println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");
}
