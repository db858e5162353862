//! How much of a step goes into evaluating ψ: times of `Reference::first` and `Reference::second`, and of
//! ψ and its slopes alone, for 6000 particles on one core.
//!
//! `cargo run --release -p psidpd-core --example excess_share`

use psidpd_core::engine::reference::Reference;
use psidpd_core::engine::{Particles, PeriodicBox, Surroundings, Want, noise};
use psidpd_core::model::expression::{Formula, Program};
use psidpd_core::model::{ExcessFreeEnergy, Fluid, Model};
use std::time::Instant;

const COUNT: usize = 6000;
const REPEATS: usize = 20;

fn warren(psi: &str, bounds: &str) -> String {
    format!(
        "title = \"Warren\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n{bounds}\n\
         [excess_free_energy]\nF = {psi}\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\n\
         strength = -40\nrange = 1.0\n[[thermostat]]\ngamma = 18.0\nrange = 1.0\n"
    )
}

fn huggins(bounds: &str) -> String {
    let psi = |a: &str, b: &str| {
        format!(
            "{a} = \"kT/(n0*n)*(1-n0*Nm*n)*ln(1-n0*Nm*n) + Nm*kT*ln(n0*Nm*n_{a}) \
             - Nm^2*n0*(eAA*n_{a} + eAB*n_{b}) - kT*ln(n_{a})\"\n"
        )
    };
    format!(
        "title = \"Huggins\"\nspecies = [\"A\", \"B\"]\n[parameters]\nn0 = 0.001\nNm = 50\neAA = 1.6\n\
         eAB = \"eAA/4\"\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\ncorrection = {{ \"A|A\" = [1.57, 1.0], \
         \"A|B\" = [0.13, 1.0], \"B|A\" = [0.13, 1.0], \"B|B\" = [1.57, 1.0] }}\n{bounds}\n\
         [excess_free_energy]\n{}{}[[thermostat]]\ngamma = 4.5\nrange = 1.0\n",
        psi("A", "B"),
        psi("B", "A")
    )
}

/// Seconds of the fastest of several goes.
fn fastest(mut work: impl FnMut()) -> f64 {
    (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

/// ψ and its slopes for as many particles as each species has, in blocks as the engine's.
fn excess_alone(fluid: &Fluid, densities: &[f64], species: &[i32]) -> f64 {
    const LANES: usize = 64;
    let variables = fluid.variables();
    let count = fluid.species.len();
    let mut total = 0.0;
    for (alpha, excess) in fluid.excess.iter().enumerate() {
        // The engine corrects before it evaluates.
        let rows: Vec<Vec<f64>> = densities
            .chunks_exact(variables)
            .zip(species)
            .filter(|(_, s)| **s == alpha as i32)
            .map(|(n, _)| {
                let corrected = |v: usize| {
                    let density = &fluid.densities[v / count];
                    let value = density.correction[alpha * count + v % count].at(n[v]).0;
                    density.bounds.map_or(value, |b| b.clamp(value))
                };
                (0..variables).map(corrected).collect()
            })
            .collect();
        let blocks: Vec<(usize, Vec<f64>)> = rows
            .chunks(LANES)
            .map(|rows| (rows.len(), (0..variables).flat_map(|v| rows.iter().map(move |r| r[v])).collect()))
            .collect();
        match excess {
            ExcessFreeEnergy::Formula(psi) => {
                let slopes: Vec<Formula> = (0..variables).map(|v| psi.derivative(v).unwrap()).collect();
                let outputs: Vec<&Formula> = std::iter::once(psi).chain(&slopes).collect();
                let program = Program::new(&outputs);
                let (mut out, mut work) = (vec![0.0; outputs.len() * LANES], Vec::new());
                total += fastest(|| {
                    for (lanes, at) in &blocks {
                        program.eval_block(*lanes, at, &mut out[..outputs.len() * lanes], &mut work);
                    }
                });
            }
            // None of the models measured here.
            ExcessFreeEnergy::Slopes(_) => {}
            ExcessFreeEnergy::Curve(curve) => {
                let mut block = Default::default();
                total += fastest(|| {
                    for (lanes, at) in &blocks {
                        curve.block(&at[..*lanes], &mut block);
                    }
                });
            }
        }
    }
    total
}

fn measure(name: &str, text: &str, rho: f64) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/models/good/share.toml");
    let fluid = Model::parse(file, text).unwrap().at(1.0).unwrap();
    let length = (COUNT as f64 / rho).cbrt();
    let domain = PeriodicBox::orthogonal([0.0; 3], [length; 3], [true; 3]).unwrap();
    let uniform = |k: usize| f64::from(noise::threefry2x32::<20>([k as u32, 0], [5, 9])[0]) / 4294967296.0;
    // A disturbed lattice: nearer to a fluid than points at random.
    let side = (COUNT as f64).cbrt().ceil() as usize;
    let x: Vec<[f64; 3]> = (0..COUNT)
        .map(|k| {
            let cell = [k % side, k / side % side, k / side / side];
            std::array::from_fn(|c| {
                (length / side as f64) * (cell[c] as f64 + 0.3 + 0.4 * uniform(3 * k + c))
            })
        })
        .collect();
    let tag: Vec<i32> = (1..=COUNT as i32).collect();
    let kind: Vec<i32> = (0..COUNT).map(|k| (k % fluid.species.len()) as i32).collect();
    let v = vec![[0.0; 3]; COUNT];
    let particles = Particles { owned: COUNT, x: &x, tag: &tag, kind: &kind };
    let mut reference = Reference::new(&fluid).unwrap();
    let densities = fastest(|| reference.first(Surroundings::Box(&domain), &particles, false).unwrap());
    let step = psidpd_core::engine::Step { seed: 1, number: 1, dt: 0.01 };
    let mut f = vec![[0.0; 3]; COUNT];
    let forces = fastest(|| {
        f.fill([0.0; 3]);
        reference.second(&particles, &v, Some(step), Want::FORCES, &mut f).unwrap();
    });
    let excess = excess_alone(&fluid, reference.local_densities(), &kind);
    let outside = reference.out_of_bounds().iter().sum::<u64>() as f64 / (COUNT * REPEATS) as f64;
    println!(
        "{name:<34} search+densities+psi {:7.3} ms  forces {:7.3} ms  psi alone {:7.3} ms = {:5.2} % of both, \
         {:5.1} ns per particle; out of bounds {:4.1} %",
        1e3 * densities,
        1e3 * forces,
        1e3 * excess,
        100.0 * excess / (densities + forces),
        1e9 * excess / COUNT as f64,
        100.0 * outside
    );
}

fn main() {
    let quadratic = "\"pi/30 * 0.75^4 * 25 * n^2\"";
    measure("Warren", &warren(quadratic, ""), 6.0);
    measure("Warren, bounds never met", &warren(quadratic, "bounds = [0, 1000]"), 6.0);
    measure("Warren, bounds met", &warren(quadratic, "bounds = [3, 6]"), 6.0);
    measure("Warren, psi from a table", &warren("{ table = \"psi.csv\" }", ""), 6.0);
    let pressure = "{ pressure = \"rho*kT + 1.656*rho^3\" }";
    measure("Warren, psi from a pressure", &warren(pressure, ""), 6.0);
    measure("Huggins", &huggins(""), 14.0);
    measure("Huggins, bounds met", &huggins("bounds = [6.5, 7.5]"), 14.0);
}
