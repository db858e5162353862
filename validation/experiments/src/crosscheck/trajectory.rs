//! The same trajectory in both hosts: noise on, same seed, same integrator, on one rank and on two.

use super::LOG;
use super::forces::by_tag;
use super::setup::Setup;
use super::{Context, Part};
use crate::ExperimentError;
use crate::code::Code;
use crate::fluids::{GAMMA, SET6};
use crate::start::{Filling, equilibrated};
use psidpd_core::engine::{Precision, Want};
use psidpd_core::maximum::largest;
use psidpd_core::model::ForceLaw;
use psidpd_dynamics::run::{Integrator, State};
use psidpd_formats::dump;
use psidpd_report::{Item, Section, Table};
use serde_json::json;
use std::time::Duration;

pub const SEED: u64 = 20_170_401;

const STEPS: u64 = 50;
const DT: f64 = 0.01;
/// Largest distance of a particle's places in two codes.
const LARGEST: f64 = 1e-10;

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let filling = Filling { lengths: [8.0, 8.0, 12.0], thickness: 6.0 };
    let state = equilibrated(Precision::Double, &SET6.fluid, filling, 500, SEED)?;
    let ours = native(context, &state)?;
    let mut part = Part::of("trajectory");
    let mut table = Table::new(["code", "ranks", "newton", "largest distance from native"]);
    for (code, ranks, newton) in [
        (Code::Psi, 1, true),
        (Code::Psi, 1, false),
        (Code::Psi, 2, true),
        (Code::Psi, 2, false),
        (Code::MdpdPsi, 2, true),
    ] {
        let theirs = lammps(context, &state, code, ranks, newton)?;
        let apart = |(a, b): (&[f64; 3], &[f64; 3])| {
            state.domain.minimum_image(*a, *b).iter().map(|c| c * c).sum::<f64>()
        };
        let distance = largest(ours.iter().zip(&theirs).map(apart)).sqrt();
        let newton = if newton { "on" } else { "off" };
        table.push([code.label(), ranks.to_string(), newton.to_owned(), format!("{distance:.1e}")]);
        let slug = Setup::new(code, &SET6, ForceLaw::Conservative).slug();
        let id = format!("trajectory.{slug}.{ranks}.newton-{newton}");
        part.values.push((id.clone(), json!(distance)));
        let label = code.label();
        let what =
            format!("{label}, {ranks} rank(s), newton {newton}: positions after {STEPS} steps with noise");
        part.at_most(id, what, distance, LARGEST);
    }
    let text = format!(
        "{} particles of set 6, {STEPS} steps of {DT} with drag and noise, seed {SEED}. The noise of a pair depends on seed, \
         step and the two tags only, so ranks, order and neighbour settings do not change it.",
        state.len()
    );
    part.section = Section::new("One trajectory in both hosts", vec![Item::Prose(text), Item::Table(table)]);
    Ok(part)
}

fn native(context: &Context, state: &State) -> Result<Vec<[f64; 3]>, ExperimentError> {
    let model = SET6.model(ForceLaw::Conservative, GAMMA)?;
    let mut simulation = context.simulation(&model, 1.0, state, SEED)?;
    simulation.prepare(DT, Want::FORCES)?;
    simulation.advance(STEPS, DT, Integrator::VelocityVerlet)?;
    Ok(by_tag(&simulation.state().tag, &simulation.state().x))
}

fn lammps(
    context: &Context,
    state: &State,
    code: Code,
    ranks: usize,
    newton: bool,
) -> Result<Vec<[f64; 3]>, ExperimentError> {
    let setup = Setup { gamma: GAMMA, seed: SEED, newton, ..Setup::new(code, &SET6, ForceLaw::Conservative) };
    let folder = context.work.join(format!("trajectory-{}-{ranks}-{newton}", setup.slug()));
    let mut deck = setup.prepare(context, state, &folder, false)?;
    deck.push_str(&format!(
        "fix move all nve\ntimestep {DT}\nthermo {STEPS}\nrun {STEPS}\n\
         write_dump all custom final.txt id x y z modify sort id format float %.17g\n"
    ));
    context.lammps.run(ranks, &folder, &deck, LOG, Duration::from_secs(300))?;
    let path = folder.join("final.txt");
    let frames = dump::read(&path)?;
    let problem = format!("expected one frame of {} particles", state.len());
    let x = frames.first().and_then(|f| f.vectors(["x", "y", "z"])).filter(|x| x.len() == state.len());
    x.ok_or(ExperimentError::Output { path, problem })
}
