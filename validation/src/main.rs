//! The `psidpd` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    psidpd::cli::main()
}
