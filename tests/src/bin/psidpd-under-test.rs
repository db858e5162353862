//! The `psidpd` program as a program of this package. Cargo builds programs only for the tests of their own
//! package, and a second build of `psidpd` would compile all its dependencies again with other features.

use std::process::ExitCode;

fn main() -> ExitCode {
    psidpd::cli::main()
}
