//! Measures what an evaluation of forces saves when a scene does not need a part of it: nanoseconds for
//! each particle, with the part and without it, in alternation, the fastest of several rounds.
//!
//! `cargo run --release -p psidpd-core --example left_out`

use psidpd_core::engine::{Particles, PeriodicBox, Precision, Request, Settings, Step, Sweep, Want, noise};
use psidpd_core::model::Model;
use std::time::Instant;

const COUNT: usize = 6050;
const DENSITY: f64 = 6.05;
/// Number of evaluations in a round, and of rounds.
const EVALUATIONS: u32 = 40;
const ROUNDS: usize = 15;

/// A fluid like Warren's set 6, of any number of like species, with any ψ, thermostat and number of dimensions.
fn model(species: usize, psi: &str, gamma: f64, dimensions: usize) -> String {
    let names: Vec<String> = (0..species).map(|s| format!("S{s}")).collect();
    let mut text = format!(
        "title = \"parts\"\ndimensions = {dimensions}\nspecies = {names:?}\n[density.n]\nkernel = \"quadratic\"\n\
         range = 0.75\n"
    );
    for (k, a) in names.iter().enumerate() {
        for b in &names[k..] {
            text +=
                &format!("[[pair]]\nbetween = {:?}\nform = \"soft\"\nstrength = -40\nrange = 1\n", [a, b]);
        }
    }
    if gamma > 0.0 {
        text += &format!("[[thermostat]]\ngamma = {gamma}\nrange = 1\n");
    }
    text += "[excess_free_energy]\n";
    names.iter().for_each(|name| text += &format!("{name} = \"{psi}\"\n"));
    text
}

/// Particles in a box, or in the plane z = 0, and the requested results.
struct Case {
    sweep: Sweep,
    domain: PeriodicBox,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
    force: Vec<[f64; 3]>,
    step: Option<Step>,
    want: Want,
}

impl Case {
    fn new(text: &str, flat: bool, want: Want, noisy: bool) -> Case {
        let fluid = Model::parse("parts.toml", text).expect("a model").at(1.0).expect("a fluid");
        let settings = Settings { precision: Precision::Mixed, ..Settings::default() };
        let uniform =
            |k: usize| f64::from(noise::threefry2x32::<20>([k as u32, 0], [5, 9])[0]) / 4_294_967_296.0;
        let (power, side) = if flat { (0.5, 78) } else { (1.0 / 3.0, 19) };
        let edge = (COUNT as f64 / DENSITY).powf(power);
        let place = |k: usize| {
            let cell = [k % side, k / side % side, k / side / side];
            std::array::from_fn(|c| match flat && c == 2 {
                true => 0.0,
                false => edge / side as f64 * (cell[c] as f64 + 0.1 + 0.8 * uniform(6 * k + c)),
            })
        };
        let height = if flat { 4.0 } else { edge };
        Case {
            sweep: Sweep::new(&fluid, settings).expect("a plan"),
            domain: PeriodicBox::orthogonal([0.0; 3], [edge, edge, height], [true; 3]).expect("a box"),
            x: (0..COUNT).map(place).collect(),
            v: (0..COUNT)
                .map(|k| {
                    std::array::from_fn(|c| if flat && c == 2 { 0.0 } else { uniform(6 * k + 3 + c) - 0.5 })
                })
                .collect(),
            tag: (1..=COUNT as i32).collect(),
            kind: (0..COUNT).map(|k| (k % fluid.species.len()) as i32).collect(),
            force: vec![[0.0; 3]; COUNT],
            step: noisy.then_some(Step { seed: 1, number: 0, dt: 0.01 }),
            want,
        }
    }

    /// Nanoseconds for each particle and evaluation.
    fn round(&mut self) -> f64 {
        let start = Instant::now();
        for _ in 0..EVALUATIONS {
            if let Some(step) = &mut self.step {
                step.number += 1;
            }
            let particles = Particles { owned: COUNT, x: &self.x, tag: &self.tag, kind: &self.kind };
            self.sweep
                .evaluate(
                    &self.domain,
                    &Request { particles, v: &self.v, step: self.step, want: self.want },
                    &mut self.force,
                    false,
                )
                .expect("forces");
        }
        start.elapsed().as_secs_f64() * 1e9 / f64::from(EVALUATIONS) / COUNT as f64
    }
}

fn main() {
    let (square, linear) = ("0.83*n^2", "5*n");
    let solid = |species, psi, gamma| Case::new(&model(species, psi, gamma, 3), false, Want::FORCES, true);
    let tallied = Case::new(&model(1, square, 18.0, 3), false, Want::TOTALS, true);
    let conservative = Case::new(&model(1, square, 18.0, 3), false, Want::FORCES, false);
    let plane = |dimensions| Case::new(&model(1, square, 18.0, dimensions), true, Want::FORCES, true);
    let whole = || solid(1, square, 18.0);
    let pairs = [
        ("energy and virial, where no output is due", tallied, whole()),
        ("drag and noise, without a thermostat", whole(), solid(1, square, 0.0)),
        ("drag and noise, where another step makes them", whole(), conservative),
        ("a density's pass, with psi linear in it", whole(), solid(1, linear, 18.0)),
        ("a second species", solid(2, square, 18.0), whole()),
        ("the third dimension", plane(3), plane(2)),
    ];
    println!("{:<48}{:>10}{:>10}{:>10}", "what is left out", "with, ns", "without", "saved");
    for (what, mut with, mut without) in pairs {
        let mut best = [f64::INFINITY; 2];
        for _ in 0..ROUNDS {
            best[0] = best[0].min(with.round());
            best[1] = best[1].min(without.round());
        }
        let saved = 100.0 * (1.0 - best[1] / best[0]);
        println!("{what:<48}{:>10.1}{:>10.1}{saved:>8.0} %", best[0], best[1]);
    }
}
