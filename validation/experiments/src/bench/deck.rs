//! A timed run of LAMMPS.

use super::contender::Contender;
use super::length::Length;
use crate::ExperimentError;
use crate::code::{Code, Suffix, Told};
use crate::fluids::{GAMMA, SET6, Subject};
use crate::lammps::deck::Deck;
use crate::lammps::host::PluginHost;
use crate::lammps::log::{Loop, timed};
use crate::lammps::style::GRID;
use crate::start::{SEED, Start};
use psidpd_core::model::ForceLaw;
use psidpd_formats::files::{Existing, work_folder, write_bytes};
use psidpd_lammps_host::export::eam;
use std::collections::HashSet;
use std::path::PathBuf;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(3600);

#[derive(Debug, Clone)]
pub struct Place {
    pub lammps: PluginHost,
    pub work: PathBuf,
}

/// The commands: everything as a user of LAMMPS would have it, with no output within the timed loop but the one
/// at its end.
fn deck(
    place: &Place,
    subject: &Subject,
    contender: &Contender,
    start: &Start,
    skin: f64,
    length: Length,
) -> Option<String> {
    let [model, tables] = files(place, subject).map(|path| path.display().to_string());
    let told = Told {
        model,
        tables,
        species: subject.species.join(" "),
        pair: SET6.pair(GAMMA),
        law: ForceLaw::Conservative,
        words: contender.words.clone(),
    };
    let style = contender.code.style(told)?;
    let data = if contender.code == Code::Mdpd { &start.data_mdpd } else { &start.data };
    // On one rank the styles need no ghosts: none that forces are sent back from, and none that are found in time.
    let alone = contender.needs_no_ghosts();
    let deck = Deck {
        plugin: place.lammps.plugin.as_deref(),
        acceleration: match contender.code {
            Code::Dpd(Suffix::Omp) => "package omp 1\nsuffix omp\n",
            Code::Dpd(Suffix::Intel) => "package intel 0 omp 1 mode mixed\nsuffix intel\n",
            _ => "",
        },
        newton: !alone,
        map: false,
        copies: contender.copies(),
        skin,
        build: if alone { "every 20 check no" } else { "every 1 check yes" },
        ..Deck::new(&style, SEED, data.display().to_string())
    };
    Some(format!(
        "{}fix 1 all nve\ntimestep {}\nthermo 0\nrun {} post no\nrun {}\n",
        deck.text(),
        subject.dt,
        length.warm_up,
        length.steps
    ))
}

/// Model file and tables of a fluid.
fn files(place: &Place, subject: &Subject) -> [PathBuf; 2] {
    ["toml", "eam.alloy"].map(|end| place.work.join(format!("{}.{end}", subject.name)))
}

/// Writes what decks of a fluid refer to.
pub fn prepare(place: &Place, subject: &Subject, with_tables: bool) -> Result<(), ExperimentError> {
    work_folder(&place.work)?;
    let [model, tables] = files(place, subject);
    write_bytes(&model, Existing::Keep, subject.text.as_bytes())?;
    if with_tables {
        eam::write(&subject.model()?.at(1.0)?, &[1.0], GRID, &tables, Existing::Keep)?;
    }
    Ok(())
}

pub fn run(
    place: &Place,
    subject: &Subject,
    contender: &Contender,
    start: &Start,
    skin: f64,
    length: Length,
) -> Result<Loop, ExperimentError> {
    let script = deck(place, subject, contender, start, skin, length).unwrap_or_default();
    timed(&contender.id(), &place.lammps.run(contender.ranks, &place.work, &script, "none", LIMIT)?)
}

pub fn pair_styles(place: &Place) -> Result<HashSet<String>, ExperimentError> {
    let said = place.lammps.run(1, &place.work, "info styles pair\n", "none", LIMIT)?;
    Ok(said.split_whitespace().map(str::to_owned).collect())
}
