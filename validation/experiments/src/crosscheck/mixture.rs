//! Two species in a tilted box, as tables of LAMMPS's `eam/alloy`, which finds pairs and images by itself.

use super::forces::{open_deck, point, point_of};
use super::{Context, Part};
use crate::ExperimentError;
use crate::lammps::deck::Deck;
use crate::lammps::style::PairStyle;
use chacha20::ChaCha8Rng;
use nalgebra::Matrix3;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Model;
use psidpd_dynamics::run::{RunError, State};
use psidpd_formats::files::{Existing, work_folder};
use psidpd_lammps_host::export::eam::{self, Grid};
use psidpd_report::{Item, Section, Table};
use rand::{RngExt, SeedableRng};
use serde_json::json;

pub const SEED: u64 = 20_011_022;

/// Every pair of species has a strength of its own, and each species its ψ of the density of both.
const MODEL: &str = "title = \"mixture\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.9\n\
    [excess_free_energy]\nA = \"0.3*n^2\"\nB = \"2*sqrt(1 + n^2)\"\n\
    [[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 10.0\nrange = 1.0\n\
    [[pair]]\nbetween = [\"A\", \"B\"]\nform = \"soft\"\nstrength = 15.0\nrange = 1.0\n\
    [[pair]]\nbetween = [\"B\", \"B\"]\nform = \"soft\"\nstrength = -5.0\nrange = 0.8\n";
const LENGTHS: [f64; 3] = [6.0, 5.0, 7.0];
/// xy, xz, yz.
const TILT: [f64; 3] = [2.1, -1.7, 1.3];
const COUNT: usize = 1000;
/// Largest relative difference: a spline's error is proportional to its spacing where w′ or φ′ has a kink.
const LARGEST: f64 = 1e-5;

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let model = Model::parse("mixture", MODEL)?;
    let state = random_state()?;
    let folder = context.work.join("mixture");
    work_folder(&folder)?;
    let [data, tables] = ["start.data", "fluid.eam.alloy"].map(|name| folder.join(name));
    state.to_data("psidpd").write(&data)?;
    let grid = Grid { spacing: 1e-5, largest_density: 60.0, densities: 20_001 };
    eam::write(&model.at(1.0)?, &state.mass, grid, &tables, Existing::Keep)?;
    let style =
        PairStyle::Eam { tables: tables.display().to_string(), species: "A B".to_owned(), thermostat: None };
    let deck = Deck::new(&style, SEED, data.display().to_string()).text();
    let theirs = point(&open_deck(context, &deck)?, state.domain.volume(3))?;
    let found = point_of(context.simulation(&model, 1.0, &state, SEED)?, None)?.against(&theirs);
    let mut part = Part::of("mixture");
    let mut table = Table::new(["", "relative difference"]);
    for ((what, _), value) in found.named().into_iter().zip(found.cells()) {
        table.push([what.to_owned(), value]);
    }
    let of = "two species in a tilted box, native";
    part.bound("mixture.eam", of, "LAMMPS eam/alloy", &found, [LARGEST; 3]);
    part.values.push(("mixture.eam".into(), json!(found)));
    let text = format!(
        "{COUNT} particles at random (seed {SEED}) in a box of {LENGTHS:?} with tilts {TILT:?}, half of each of two species: \
         ψ_A = 0.3 n², ψ_B = 2 √(1 + n²), soft pairs of strengths 10, 15 and −5. The native runner against tables for eam/alloy."
    );
    part.section = Section::new("Two species in a tilted box", vec![Item::Prose(text), Item::Table(table)]);
    Ok(part)
}

fn random_state() -> Result<State, ExperimentError> {
    let [lx, ly, lz] = LENGTHS;
    let [xy, xz, yz] = TILT;
    let edges = Matrix3::new(lx, xy, xz, 0.0, ly, yz, 0.0, 0.0, lz);
    let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, [true; 3])
        .map_err(|e| ExperimentError::Run(RunError::State(e.to_string())))?;
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let x = (0..COUNT).map(|_| domain.point(std::array::from_fn(|_| random.random::<f64>()))).collect();
    let species = (0..COUNT).map(|k| (k % 2) as i32).collect();
    Ok(State { species, ..State::at_rest(domain, vec![1.0; 2], x) })
}
