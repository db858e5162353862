//! Shell completions and manual pages.

use super::*;
use clap_complete::Shell;

/// Print a script that completes verbs and options in a shell.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Write manual pages: psidpd.1, and one for each verb.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// Folder for the pages; it is made if necessary.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn completions(a: &Completions) -> Result<Verdict, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(a.shell, &mut super::command(), "psidpd", &mut script);
    say::bytes(&script);
    Ok(Verdict::Good)
}

pub fn man(a: &Man, json: Option<&Path>) -> Result<Verdict, Failure> {
    std::fs::create_dir_all(&a.out)
        .and_then(|()| clap_mangen::generate_to(super::command(), &a.out))
        .map_err(PathError::at("write", &a.out))?;
    say!("{}", a.out.join("psidpd.1").display());
    conclude(json, &json!({"folder": a.out}), true)
}
