//! Distances and displacements: LAMMPS's `compute rdf` and `compute msd` beside `rdf` and `msd` of the same configurations.

use super::LOG;
use super::{Context, Part};
use crate::ExperimentError;
use crate::files;
use crate::fluids::DPD_PAIR;
use crate::lammps::deck::Deck;
use crate::lammps::frames;
use crate::shipped;
use psidpd_dynamics::run::State;
use psidpd_dynamics::scene::Scene;
use psidpd_formats::files::{Existing, work_folder, write_bytes};
use psidpd_observe::{Observation, Observers};
use psidpd_report::{Item, Section, Table};
use serde_json::json;
use std::path::Path;
use std::time::Duration;

/// Seed of velocities and noise.
pub const SEED: u64 = 19_640_612;

const EVERY: u64 = 10;
/// Configurations after the first.
const FRAMES: u64 = 40;
const DT: f64 = 0.02;
const RANGE: f64 = 2.0;
const BINS: usize = 40;
/// Largest relative difference. A pair that is counted in another shell makes 10⁻⁵.
const LARGEST: f64 = 1e-9;

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let folder = context.work.join("observables");
    work_folder(&folder)?;
    let scene = scene(&folder)?;
    let state = scene.initial_state();
    let [g, msd] = by_lammps(context, &state, &folder)?;
    let observed = by_us(&scene, &state, &folder.join("frames.txt"))?;
    let ours = |name: &str, column: &str| -> Vec<f64> {
        let found = observed.iter().find(|o| o.name == name).and_then(|o| o.get(column));
        found.map_or_else(Vec::new, |column| column.values.clone())
    };
    let mut part = Part::of("observables");
    let mut table = Table::new(["", "numbers", "largest of LAMMPS", "largest difference, relative"]);
    for (name, label, ours, theirs) in
        [("rdf", "compute rdf", ours("rdf", "g"), g), ("msd", "compute msd", ours("msd", "msd"), msd)]
    {
        let scale = theirs.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let apart = psidpd_core::maximum::largest(ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()));
        let apart = if ours.len() == theirs.len() && scale > 0.0 { apart / scale } else { f64::NAN };
        let (count, scale_shown) = (theirs.len().to_string(), format!("{scale:.4}"));
        table.push([format!("{name}, {label}"), count, scale_shown, format!("{apart:.1e}")]);
        let what = format!("{name} against LAMMPS's {label} of the same configurations, relative");
        part.at_most(format!("observables.{name}"), what, apart, LARGEST);
        part.values.push((format!("observables.{name}"), json!({"largest": scale, "difference": apart})));
    }
    let text = format!(
        "LAMMPS runs {} particles of its own dpd, and dumps a configuration every {EVERY} steps: g(r) is the mean over {} of \
         them, in {BINS} shells up to {RANGE}, the displacements are those from the first.",
        state.len(),
        FRAMES + 1
    );
    let heading = "Distances and displacements of the same configurations";
    part.section = Section::new(heading, vec![Item::Prose(text), Item::Table(table)]);
    Ok(part)
}

fn scene(folder: &Path) -> Result<Scene, ExperimentError> {
    let model = folder.join("model.toml");
    write_bytes(&model, Existing::Keep, shipped::STANDARD.as_bytes())?;
    let text = format!(
        "title = \"distances and displacements\"\nmodel = \"model.toml\"\nkT = 1.0\nseed = {SEED}\nbox = [5.0, 6.0, 7.0]\n\
         density = 3.0\ndt = {DT}\nsteps = {steps}\n[observe]\nevery = {EVERY}\n\
         rdf = {{ range = {RANGE:?}, bins = {BINS} }}\nmsd = {{ length = {FRAMES}, spacing = 100 }}\n",
        steps = EVERY * (FRAMES + 1),
    );
    Ok(Scene::parse("scene.toml", &text, folder)?)
}

/// g of every shell, and the mean-square displacement of every configuration after the first.
fn by_lammps(context: &Context, state: &State, folder: &Path) -> Result<[Vec<f64>; 2], ExperimentError> {
    state.to_data_by_tag("psidpd").write(&folder.join("start.data"))?;
    let last = EVERY * (FRAMES + 1);
    let deck = format!(
        "{}comm_modify cutoff {:?}\nfix move all nve\n\
         timestep {DT}\nthermo 1000\nrun 200\nreset_timestep {EVERY}\ncompute g all rdf {BINS} cutoff {RANGE}\n\
         fix g all ave/time {EVERY} {} {last} c_g[2] mode vector file rdf.txt format \" %.16g\"\ncompute m all msd\n\
         fix m all ave/time {EVERY} 1 {EVERY} c_m[4] file msd.txt format \" %.16g\"\n\
         dump frames all custom {EVERY} frames.txt id x y z ix iy iz\n\
         dump_modify frames sort id format float %.17g\nrun {}\n",
        Deck::new(&DPD_PAIR, SEED, "start.data".into()).text(),
        RANGE + 0.5,
        FRAMES + 1,
        EVERY * FRAMES,
    );
    context.lammps.run(1, folder, &deck, LOG, Duration::from_secs(300))?;
    let [g, msd] = ["rdf.txt", "msd.txt"].map(|name| folder.join(name));
    // A line with the step and the number of shells, and for each shell its number and g.
    let shells = files::rows(&g)?.iter().skip(1).filter_map(|row| row.get(1).copied()).collect();
    // Displacements of the first configuration from itself are none.
    let squares = files::rows(&msd)?.iter().skip(1).filter_map(|row| row.get(1).copied()).collect();
    Ok([shells, squares])
}

/// What the observables make of the configurations of a dump.
fn by_us(scene: &Scene, state: &State, path: &Path) -> Result<Vec<Observation>, ExperimentError> {
    let stage = scene.stages.last().map_or("", |stage| stage.name.as_str());
    let mut observers = Observers::new(&scene.observe, [stage]);
    frames::show(path, (scene, stage, scene.kt), state, (EVERY, DT), &mut observers)?;
    Ok(observers.finish())
}
