use std::process::ExitCode;

fn main() -> ExitCode {
    psidpd::cli::main()
}
