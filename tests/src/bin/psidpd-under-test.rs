//! The `psidpd` program, as a program of this package: cargo builds those with the tests of their own package only,
//! and a second build of `psidpd` would compile all it depends on once more, with other features.

use std::process::ExitCode;

fn main() -> ExitCode {
    psidpd::cli::main()
}
