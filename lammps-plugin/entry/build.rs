//! Passes to the entry the LAMMPS and the MPI that the styles are compiled for; the environment
//! variables are those of the styles' build.

use std::env;
use std::path::PathBuf;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(lammps_host)");
    for name in ["PSIDPD_LAMMPS_INCLUDE", "PSIDPD_MPI_INCLUDE", "PSIDPD_LAMMPS_VERSION"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    let (Ok(version), Some(_)) = (env::var("PSIDPD_LAMMPS_VERSION"), env::var_os("PSIDPD_LAMMPS_INCLUDE"))
    else {
        return;
    };
    let mpi = env::var_os("PSIDPD_MPI_INCLUDE").map(|folder| PathBuf::from(folder).join("mpi.h"));
    // An mpi.h may contain bytes that are not UTF-8.
    let mpi = mpi.and_then(|header| std::fs::read(header).ok()).unwrap_or_default();
    let kind = if String::from_utf8_lossy(&mpi).contains("OPEN_MPI") { "openmpi" } else { "other" };
    println!("cargo::rustc-cfg=lammps_host");
    println!("cargo::rustc-env=PSIDPD_LAMMPS_VERSION={version}");
    println!("cargo::rustc-env=PSIDPD_MPI={kind}");
    // LAMMPS unloads plugins with dlclose, and a Rust library must stay loaded.
    println!("cargo::rustc-link-arg-cdylib=-Wl,-z,nodelete");
}
