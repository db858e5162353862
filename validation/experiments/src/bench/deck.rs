//! A timed run of LAMMPS.

use super::contender::{Code, Contender, Suffix};
use super::length::Length;
use super::log::{Loop, parse};
use crate::ExperimentError;
use crate::fluids::Subject;
use crate::start::{SEED, Start};
use psidpd_lammps_host::Host;
use psidpd_lammps_host::export::eam::{self, Grid};
use std::collections::HashSet;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

/// Longest time that one run may take.
const LIMIT: Duration = Duration::from_secs(3600);

/// LAMMPS, the plugin, and a folder for decks.
#[derive(Debug, Clone)]
pub struct Place {
    /// LAMMPS.
    pub host: Host,
    /// The plugin to load; `None` where the program has the styles in it.
    pub plugin: Option<PathBuf>,
    /// The folder.
    pub work: PathBuf,
}

/// The commands: everything as a user of LAMMPS would have it, with no output within the timed loop but the one
/// at its end.
pub fn deck(
    place: &Place,
    subject: &Subject,
    contender: &Contender,
    start: &Start,
    skin: f64,
    length: Length,
) -> String {
    let built_in = contender.code == Code::BuiltIn;
    let mut deck = String::from("units lj\n");
    let accelerate = match contender.code {
        Code::Dpd(Suffix::Omp) => "package omp 1\nsuffix omp\n",
        Code::Dpd(Suffix::Intel) => "package intel 0 omp 1 mode mixed\nsuffix intel\n",
        _ => "",
    };
    deck += accelerate;
    let data = if built_in { &start.data_mdpd } else { &start.data };
    let style = if built_in { "mdpd" } else { "atomic" };
    // On one rank the styles need no ghosts: none that forces are sent back from, and none that are found in time.
    let alone = contender.needs_no_ghosts();
    if alone {
        deck += "newton off\n";
    }
    // Writing to a String cannot fail.
    let _ = write!(deck, "atom_style {style}\ncomm_modify vel yes\nread_data \"{}\"\n", data.display());
    if contender.copies() > 1 {
        let _ = writeln!(deck, "replicate {} 1 1", contender.copies());
    }
    let when = if alone { "every 20 check no" } else { "every 1 check yes" };
    let _ = write!(deck, "neighbor {skin} bin\nneigh_modify delay 0 {when}\n");
    let species = subject.species.join(" ");
    let _ = match &contender.code {
        Code::BuiltIn => writeln!(
            deck,
            "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 {SEED}\npair_coeff 1 1 mdpd/rhosum 0.75\n\
             pair_coeff 1 1 mdpd -40 25 18 1.0 0.75"
        ),
        Code::Eam => writeln!(
            deck,
            "pair_style hybrid/overlay eam/alloy dpd/tstat 1.0 1.0 1.0 {SEED}\n\
             pair_coeff * * eam/alloy \"{}\" {species}\npair_coeff 1 1 dpd/tstat 18",
            tables(place, subject).display()
        ),
        Code::Dpd(_) => writeln!(deck, "pair_style dpd 1.0 1.0 {SEED}\npair_coeff 1 1 25 4.5"),
        Code::Plugin(words) => {
            if let Some(plugin) = &place.plugin {
                let _ = writeln!(deck, "plugin load \"{}\"", plugin.display());
            }
            let model = model(place, subject);
            writeln!(
                deck,
                "pair_style dpd/psi 1.0 {SEED} {words}\npair_coeff * * \"{}\" {species}",
                model.display()
            )
        }
        Code::Native(_) | Code::Plain => Ok(()),
    };
    let _ = write!(
        deck,
        "fix 1 all nve\ntimestep {}\nthermo 0\nrun {} post no\nrun {}\n",
        subject.dt, length.warm_up, length.steps
    );
    deck
}

fn tables(place: &Place, subject: &Subject) -> PathBuf {
    place.work.join(format!("{}.eam.alloy", subject.name))
}

fn model(place: &Place, subject: &Subject) -> PathBuf {
    place.work.join(format!("{}.toml", subject.name))
}

/// Writes what decks of a fluid refer to.
pub fn prepare(place: &Place, subject: &Subject, with_tables: bool) -> Result<(), ExperimentError> {
    std::fs::create_dir_all(&place.work).map_err(ExperimentError::io(&place.work))?;
    let path = model(place, subject);
    std::fs::write(&path, subject.text).map_err(ExperimentError::io(&path))?;
    if with_tables {
        let fluid = subject.model()?.at(1.0)?;
        // Small enough to stay in a cache, as in the validation.
        let grid = Grid { spacing: 5e-5, largest_density: 60.0, densities: 6001 };
        eam::write(&fluid, &[1.0], grid, &tables(place, subject))?;
    }
    Ok(())
}

/// Runs LAMMPS and returns what it says of the timed loop.
pub fn run(
    place: &Place,
    subject: &Subject,
    contender: &Contender,
    start: &Start,
    skin: f64,
    length: Length,
) -> Result<Loop, ExperimentError> {
    let script = place.work.join("in.bench");
    let text = deck(place, subject, contender, start, skin, length);
    std::fs::write(&script, text).map_err(ExperimentError::io(&script))?;
    let run = place.host.run_script(contender.ranks, &place.work, &script, &["-log", "none"], LIMIT)?;
    parse(&run.stdout).map_err(|problem| ExperimentError::Printed { what: contender.id(), problem })
}

/// The names of the pair styles that the host has, by its own list.
pub fn pair_styles(place: &Place) -> Result<HashSet<String>, ExperimentError> {
    std::fs::create_dir_all(&place.work).map_err(ExperimentError::io(&place.work))?;
    let script = place.work.join("in.styles");
    std::fs::write(&script, "info styles pair\n").map_err(ExperimentError::io(&script))?;
    let run = place.host.run_script(1, &place.work, &script, &["-log", "none"], LIMIT)?;
    Ok(run.stdout.split_whitespace().map(str::to_owned).collect())
}
