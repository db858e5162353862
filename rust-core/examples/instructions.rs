//! Evaluates forces a given number of times, for counting instructions: the same fluid, particles and steps
//! in every run.
//!
//! ```text
//! valgrind --tool=callgrind --callgrind-out-file=/dev/null \
//!     target/release/examples/instructions mdpd mixed avx2 8
//! ```
//!
//! With a number of sides as fifth word the particles are those of a rank that has ghosts on 2 (along z), 4
//! or 6 sides; the sixth word is the number of particles, 2000 unless given; the seventh that of threads. With the
//! fifth word `thermostat` drag and noise act apart from the forces instead, for the time of six steps, by the
//! midpoint rule; with `listed` they act after an evaluation of forces at the same positions, which lists their pairs, and with
//! `ranked` after the first half of an evaluation on a rank that has ghosts on two sides.
//!
//! The difference between runs of different length is the cost of the additional evaluations. The
//! program prints the number of particles and a sum of forces, so that the compiler removes nothing.

#[path = "../benches/setup/mod.rs"]
mod setup;

use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{self, Bodies, Need, PairThermostat, Stream, Update};
use psidpd_core::engine::{
    Around, Engine, Newton, Particles, Pool, Request, Settings, Surroundings, Sweep, Want,
};
use psidpd_core::model::Fluid;
use setup::{Cloud, Rank, choose, faces};
use std::num::NonZeroUsize;
use std::process::ExitCode;

const COUNT: usize = 2000;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!(
                "{fault}\nusage: instructions mdpd|dpd|formula|colloid|two-sizes mixed|double portable|avx2|avx512|avx512-vbmi2 EVALUATIONS [FACES|thermostat|listed|ranked [PARTICLES [THREADS]]]"
            );
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let [fluid, precision, instructions, evaluations, rest @ ..] = arguments else {
        return Err("four arguments are needed".into());
    };
    let (subject, precision, instructions) = choose(fluid, precision, instructions)?;
    let evaluations: u32 = evaluations.parse().map_err(|_| "EVALUATIONS is a number")?;
    let fluid = subject.fluid();
    let count = rest.get(1).map_or(Ok(COUNT), |n| n.parse()).map_err(|_| "PARTICLES is a number")?;
    let threads = rest.get(2).map_or(Ok(NonZeroUsize::MIN), |n| n.parse());
    let threads = threads.map_err(|_| "THREADS is a number above 0")?;
    let settings = Settings { precision, instructions, threads };
    let mut sweep = Sweep::new(&fluid, settings).map_err(|e| e.to_string())?;
    if rest.first().is_some_and(|word| word == "ranked") {
        return on_rank(Rank::new(subject, &fluid, count, 2), &fluid, settings, evaluations);
    }
    let apart = rest.first().filter(|word| ["thermostat", "listed"].contains(&word.as_str()));
    if let Some(word) = apart {
        let mut engine = Engine::new(&fluid, settings).map_err(|e| e.to_string())?;
        let mut cloud = Cloud::new(subject, &fluid, count);
        let mut thermostat =
            PairThermostat::new(sweep.plan(), &settings).ok_or("the fluid has no thermostat")?;
        let (pool, dt) = (Pool::new(settings.threads), 6.0 * cloud.dt());
        for number in 0..evaluations {
            cloud.drift();
            let Cloud { domain, x, v, tag, kind, force, .. } = &mut cloud;
            if word == "listed" {
                thermostat.ask(&mut engine, dt);
                let particles = Particles { owned: count, x, tag, kind };
                let request = Request { particles, v: &[], step: None, want: Want::FORCES };
                engine.forces(domain, &request, force, false).map_err(|e| e.to_string())?;
            }
            let bodies = Bodies { domain, x, tag, species: kind, mass: &[1.0; 2], frozen: &[] };
            thermostat.find_pairs_with(&mut engine, &bodies, dt, false).map_err(|e| e.to_string())?;
            thermostat.draw(1, number.into(), Stream(0), Law::Gaussian);
            thermostat.act(&pool, Update::Midpoint, v);
        }
        println!("{count} {}", cloud.v.iter().map(|v| v[0].abs()).sum::<f64>());
        return Ok(());
    }
    let force = match faces(rest.first())? {
        0 if subject.one_in > 0 => {
            let mut engine = Engine::new(&fluid, settings).map_err(|e| e.to_string())?;
            let mut cloud = Cloud::new(subject, &fluid, count);
            for _ in 0..evaluations {
                cloud.drift();
                cloud.evaluate_by(&mut engine);
            }
            cloud.force
        }
        0 => {
            let mut cloud = Cloud::new(subject, &fluid, count);
            for _ in 0..evaluations {
                cloud.drift();
                cloud.evaluate(&mut sweep);
            }
            cloud.force
        }
        faces => {
            let mut rank = Rank::new(subject, &fluid, count, faces);
            rank.find_ghosts(sweep.plan().cutoff());
            for _ in 0..evaluations {
                rank.drift();
                rank.evaluate(&mut sweep, || ());
            }
            rank.cloud.force
        }
    };
    println!("{count} {}", force.iter().map(|f| f[0].abs()).sum::<f64>());
    Ok(())
}

/// Lets drag and noise act on a rank whose ghosts are images of its own particles.
fn on_rank(mut rank: Rank, fluid: &Fluid, settings: Settings, evaluations: u32) -> Result<(), String> {
    let mut engine = Engine::new(fluid, settings).map_err(|e| e.to_string())?;
    let mut thermostat =
        PairThermostat::new(engine.plan(), &settings).ok_or("the fluid has no thermostat")?;
    rank.find_ghosts(engine.plan().cutoff());
    let (pool, dt, owned) = (engine.pool().clone(), 6.0 * rank.cloud.dt(), rank.cloud.x.len());
    let (mass, kinds): (_, Vec<i32>) = (vec![1.0; owned], (0..fluid.species.len() as i32).collect());
    for number in 0..evaluations {
        rank.drift();
        thermostat.ask(&mut engine, dt);
        let particles = Particles { owned, x: &rank.x, tag: &rank.tag, kind: &rank.kind };
        let around = Around { domain: &rank.around, images: &[] };
        let request = Request { particles, v: &[], step: None, want: Want::FORCES };
        let surroundings = Surroundings::Ghosts(around, Newton::Off);
        drop(engine.first(surroundings, &request, &mut rank.cloud.force).map_err(|e| e.to_string())?);
        let of_rank = thermostat::Rank { around, particles, species_of_kind: &kinds, mass: &mass };
        thermostat.find_pairs_of_rank_with(&mut engine, &of_rank, dt, false).map_err(|e| e.to_string())?;
        thermostat.draw(1, number.into(), Stream(0), Law::Gaussian);
        let mut vectors = rank.v.clone();
        let mut need = thermostat.begin_midpoint(&pool, &mut vectors).map_err(|e| e.to_string())?;
        while need != Need::Nothing([0.0; 6]) {
            let totals = match need {
                Need::Totals(of_this_rank) => of_this_rank,
                _ => {
                    vectors.truncate(owned);
                    rank.images.forward(1, &mut vectors);
                    [0.0; 3]
                }
            };
            need = thermostat
                .go_on(&pool, totals, &mut vectors, &mut rank.v[..owned])
                .map_err(|e| e.to_string())?;
        }
        rank.v.truncate(owned);
        rank.images.forward(1, &mut rank.v);
    }
    println!("{owned} {}", rank.v.iter().map(|v| v[0].abs()).sum::<f64>());
    Ok(())
}
