//! Pair force, drag and noise against LAMMPS's own `dpd`, which shares no code with psidpd.

use super::forces::{by_tag, open_deck, point, point_of};
use super::{Context, Part};
use crate::ExperimentError;
use crate::fluids::{SET6, dpd_model};
use crate::lammps::deck::Deck;
use crate::lammps::style::PairStyle;
use crate::start::{Filling, equilibrated, periodic};
use psidpd_core::engine::{Precision, Step, Want};
use psidpd_dynamics::run::State;
use psidpd_formats::files::work_folder;
use psidpd_observe::{Measured, threshold};
use psidpd_report::quantity::with_error;
use psidpd_report::{Check, Item, Section, Table};
use serde_json::json;

/// Seed of positions, velocities and noise.
pub const SEED: u64 = 19_970_915;

/// Largest relative difference of forces, energy and virial.
const ROUNDING: f64 = 1e-12;
/// kT of the drag alone: noise of σ² = 2γkT is far below its rounding.
const COLD: f64 = 1e-40;
const DT: f64 = 0.01;

/// Pairs along each edge of the lattice of pairs, which are out of each other's reach.
const PAIRS: usize = 12;
const APART: f64 = 2.5;
const DISTANCES: [f64; 3] = [0.2, 0.5, 0.8];
/// How often the noise of every pair is drawn.
const DRAWS: u64 = 60;
const SETTINGS: [[f64; 3]; 2] = [[4.5, 1.0, 0.01], [18.0, 0.5, 0.04]];
/// Chance that any comparison of variances fails although nothing is wrong.
const FALSE_ALARM: f64 = 1e-3;
/// Largest error of a ratio of variances: noise that is 5 % too strong makes it 1.1.
const VAGUE: f64 = 0.02;

/// The commands for a fluid of `dpd` with these particles.
fn deck(
    context: &Context,
    state: &State,
    [strength, gamma, kt]: [f64; 3],
    name: &str,
) -> Result<String, ExperimentError> {
    let folder = context.work.join(name);
    work_folder(&folder)?;
    let data = folder.join("start.data");
    state.to_data("psidpd").write(&data)?;
    let style = PairStyle::Dpd { a: strength, gamma, rc: 1.0 };
    Ok(Deck { kt, ..Deck::new(&style, SEED, data.display().to_string()) }.text())
}

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let mut part = Part::of("thermostat");
    let mut forces = Table::new(["", "force", "energy", "virial"]);
    let filling = Filling::cube(6.0);
    let state = equilibrated(Precision::Double, &SET6.fluid, filling, 100, SEED)?;
    let volume = state.domain.volume(3);
    for (id, strength, gamma) in [("pair force", 25.0, 0.0), ("drag", 0.0, 18.0), ("both", 25.0, 4.5)] {
        let kt = if gamma > 0.0 { COLD } else { 1.0 };
        let theirs = deck(context, &state, [strength, gamma, 0.0], "dpd-forces")?;
        let theirs = point(&open_deck(context, &theirs)?, volume)?;
        let step = (gamma > 0.0).then_some(Step { seed: SEED, number: 0, dt: DT });
        let ours = point_of(context.simulation(&dpd_model(strength, gamma, 1.0)?, kt, &state, SEED)?, step)?;
        let found = ours.against(&theirs);
        // Drag has no energy.
        let has_energy = strength != 0.0;
        let [force, energy, virial] = found.cells();
        forces.push([id.to_owned(), force, if has_energy { energy } else { "–".into() }, virial]);
        let (code, against) =
            (format!("dpd.{}", id.replace(' ', "-")), "LAMMPS dpd at the same positions and velocities");
        let limits = [ROUNDING, if has_energy { ROUNDING } else { f64::INFINITY }, ROUNDING];
        part.bound(&code, &format!("native, {id}"), against, &found, limits);
    }
    let noise = noise(context, &mut part)?;
    part.section = Section::new(
        "Pair force, drag and noise of LAMMPS's dpd",
        vec![
            Item::Prose(format!(
                "{} particles of a liquid with their velocities, as a fluid of LAMMPS's own dpd: a = 25 without drag, drag \
                 of γ = 18 at kT = 0, and both.",
                state.len()
            )),
            Item::Table(forces),
            Item::Prose(format!(
                "Noise: {} pairs at rest and out of each other's reach, drawn {DRAWS} times by each code. The variance of \
                 the force along a pair is 2γkT (1 − r/r_c)²/Δt; the table has it over that, so that each number should be 1. \
                 Over all comparisons the chance of a false alarm is {FALSE_ALARM}.",
                PAIRS.pow(3)
            )),
            Item::Table(noise),
        ],
    );
    Ok(part)
}

fn noise(context: &Context, part: &mut Part) -> Result<Table, ExperimentError> {
    let state = pairs()?;
    let mut table = Table::new(["γ", "kT", "Δt", "r", "native", "LAMMPS dpd"]);
    let comparisons = 2 * SETTINGS.len() * DISTANCES.len();
    for [gamma, kt, dt] in SETTINGS {
        let mut simulation = context.simulation(&dpd_model(0.0, gamma, 1.0)?, kt, &state, SEED)?;
        let lammps = open_deck(context, &deck(context, &state, [0.0, gamma, kt], "dpd-noise")?)?;
        lammps.command(&format!("timestep {dt:?}"))?;
        let mut drawn: [[Vec<f64>; DISTANCES.len()]; 2] = Default::default();
        for number in 0..DRAWS {
            simulation.compute(Want::FORCES, Some(Step { seed: SEED, number, dt }))?;
            let ours =
                by_tag(&simulation.state().tag, simulation.forces()).into_iter().map(|f| f[0]).collect();
            lammps.command("run 0 post no")?;
            let theirs: Vec<f64> = lammps.gather("f", 3)?.into_iter().step_by(3).collect();
            for (drawn, forces) in drawn.iter_mut().zip::<[Vec<f64>; 2]>([ours, theirs]) {
                for (pair, f) in forces.iter().step_by(2).enumerate() {
                    let k = pair % DISTANCES.len();
                    drawn[k].push(f * f * dt / (2.0 * gamma * kt * (1.0 - DISTANCES[k]).powi(2)));
                }
            }
        }
        for (k, r) in DISTANCES.into_iter().enumerate() {
            let [ours, theirs] = [0, 1].map(|code: usize| Measured::of_independent(&drawn[code][k]));
            let error = ours.error.hypot(theirs.error);
            let place = format!("γ = {gamma}, kT = {kt}, Δt = {dt}, r = {r}");
            for (code, what, delta, error) in [
                ("lammps", "that of LAMMPS dpd", ours.value - theirs.value, error),
                ("formula", "2γkT (1 − r/r_c)²/Δt", ours.value - 1.0, ours.error),
            ] {
                let mut check = Check::agreement(
                    format!("dpd.noise.{code}.{gamma}.{r}"),
                    "thermostat",
                    format!("native: variance of the noise against {what}, relative, at {place}"),
                    delta,
                    error,
                    threshold(comparisons, FALSE_ALARM),
                    "",
                );
                check.passed &= error < VAGUE;
                part.checks.push(check);
            }
            let values = json!({"native": ours.value, "lammps": theirs.value, "error": error});
            part.values.push((format!("dpd.noise.{gamma}.{r}"), values));
            let codes = [ours, theirs].map(|m| with_error(m.value, Some(m.error)));
            table.push([gamma, kt, dt, r].map(|x| x.to_string()).into_iter().chain(codes));
        }
    }
    Ok(table)
}

/// Pairs along x at rest, with tags in turn.
fn pairs() -> Result<State, ExperimentError> {
    let edge = PAIRS as f64 * APART;
    let x = (0..PAIRS.pow(3)).flat_map(|k| {
        let [x, y, z] = [k % PAIRS, k / PAIRS % PAIRS, k / PAIRS / PAIRS].map(|i| (i as f64 + 0.5) * APART);
        [[x, y, z], [x + DISTANCES[k % DISTANCES.len()], y, z]]
    });
    Ok(State::at_rest(periodic([edge; 3])?, vec![1.0], x.collect()))
}
