//! Times the parts of evaluations of forces, in nanoseconds for each owned particle and step: the fastest of
//! several rounds, after the fluid has come to equilibrium; and the memory for each, in bytes.
//!
//! `cargo run --release -p psidpd-core --example pace mdpd mixed avx512 1 6050`
//!
//! A second line has the same of the thermostat apart from the forces, for the time of one step of two stages,
//! and the iterations of the midpoint rule.
//!
//! With a number of sides as last word the evaluations are those of a rank that has ghosts on 2 (along z), 4
//! or 6 sides, as each of 2, of 4, and of 8 or more ranks, without the noise of messages.

#[path = "../benches/setup/mod.rs"]
mod setup;

use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Bodies, PairThermostat, Stream, Update};
use psidpd_core::engine::{Pool, Settings, Sweep, Times};
use rustix::time::{ClockId, clock_gettime};
use setup::{Cloud, Rank, choose, faces};
use std::process::ExitCode;
use std::time::Instant;

/// Both hosts use this allocator.
#[global_allocator]
static ALLOCATOR: psidpd_core::memory::LargePages = psidpd_core::memory::LargePages;

/// Number of steps before the first round, of steps in a round, and of rounds.
const BEFORE: u32 = 150;
const STEPS: u32 = 50;
const ROUNDS: u32 = 12;

/// Seconds on the clock, and of processor time of this thread, which other load of the machine hardly disturbs.
#[derive(Clone, Copy)]
struct Seconds {
    wall: f64,
    processor: f64,
}

impl Seconds {
    fn since(start: Instant) -> Seconds {
        let used = clock_gettime(ClockId::ThreadCPUTime);
        Seconds {
            wall: start.elapsed().as_secs_f64(),
            processor: used.tv_sec as f64 + 1e-9 * used.tv_nsec as f64,
        }
    }

    fn plus(self, factor: f64, other: Seconds) -> Seconds {
        Seconds {
            wall: self.wall + factor * other.wall,
            processor: self.processor + factor * other.processor,
        }
    }
}

/// All of a box, or a rank's part of it.
enum Any {
    Cloud(Box<Cloud>),
    Rank(Box<Rank>),
}

impl Any {
    /// Does one step; returns the time spent outside the evaluation, by the clock that started at `start`.
    fn step(&mut self, sweep: &mut Sweep, start: Instant) -> Seconds {
        let now = || Seconds::since(start);
        match self {
            Any::Cloud(cloud) => {
                cloud.evaluate(sweep);
                let since = now();
                cloud.kick();
                cloud.drift();
                now().plus(-1.0, since)
            }
            Any::Rank(rank) => {
                let mut laps = vec![now()];
                rank.find_ghosts(sweep.plan().cutoff());
                laps.push(now());
                rank.evaluate(sweep, || laps.push(now()));
                laps.push(now());
                rank.cloud.kick();
                rank.cloud.drift();
                laps.push(now());
                let laps = laps.as_chunks::<2>().0.iter();
                laps.fold(Seconds { wall: 0.0, processor: 0.0 }, |sum, [from, to]| {
                    sum.plus(1.0, *to).plus(-1.0, *from)
                })
            }
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!(
                "{fault}\nusage: pace mdpd|dpd|formula mixed|double portable|avx2|avx512|avx512-vbmi2 THREADS PARTICLES [FACES]"
            );
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let [fluid, precision, instructions, threads, count, rest @ ..] = arguments else {
        return Err("five arguments are needed".into());
    };
    let faces = faces(rest.first())?;
    let (subject, precision, instructions) = choose(fluid, precision, instructions)?;
    let threads = threads.parse().map_err(|_| "THREADS is a number above 0")?;
    let count: usize = count.parse().map_err(|_| "PARTICLES is a number")?;
    let fluid = subject.fluid();
    let mut particles = match faces {
        0 => Any::Cloud(Box::new(Cloud::new(subject, &fluid, count))),
        _ => Any::Rank(Box::new(Rank::new(subject, &fluid, count, faces))),
    };
    let settings = Settings { precision, instructions, threads };
    let mut sweep = Sweep::new(&fluid, settings).map_err(|e| e.to_string())?;
    let start = Instant::now();
    for _ in 0..BEFORE {
        particles.step(&mut sweep, start);
    }
    let mut best = [f64::INFINITY; 8];
    for _ in 0..ROUNDS {
        let before = sweep.times();
        let began = Seconds::since(start);
        let around = (0..STEPS).fold(Seconds { wall: 0.0, processor: 0.0 }, |sum, _| {
            sum.plus(1.0, particles.step(&mut sweep, start))
        });
        let all = Seconds::since(start).plus(-1.0, began).plus(-1.0, around);
        let after = sweep.times();
        let part = |of: fn(&Times) -> f64| of(&after) - of(&before);
        let parts = [
            all.wall,
            all.processor,
            part(|t| t.sort),
            part(|t| t.first),
            part(|t| t.excess),
            part(|t| t.second),
            part(|t| t.forces),
            around.wall,
        ];
        for (best, seconds) in best.iter_mut().zip(parts) {
            *best = best.min(seconds * 1e9 / f64::from(STEPS) / count as f64);
        }
    }
    let [all, processor, sort, first, excess, second, forces, around] = best;
    println!(
        "evaluation {all:.1}, {processor:.1} of processor time of the first thread: sort {sort:.1}, first pass {first:.1}, ψ {excess:.1}, second pass {second:.1}, \
         forces out {forces:.1}; motion {around:.1}; {} B",
        sweep.memory() / count
    );
    if let (Any::Cloud(mut cloud), Some(thermostat)) =
        (particles, PairThermostat::new(sweep.plan(), &settings))
    {
        time_thermostat(&mut cloud, thermostat, &Pool::new(threads))?;
    }
    Ok(())
}

/// Drag and noise act for six steps of velocity Verlet, as one step of two stages has it.
const AT_ONCE: f64 = 6.0;

/// Times the parts of the thermostat.
fn time_thermostat(cloud: &mut Cloud, mut thermostat: PairThermostat, pool: &Pool) -> Result<(), String> {
    let count = cloud.x.len();
    let dt = AT_ONCE * cloud.dt();
    let mut best = [f64::INFINITY; 4];
    let (mut iterations, mut number) = (0, 0);
    for _ in 0..ROUNDS {
        let mut parts = [0.0; 4];
        for _ in 0..STEPS {
            number += 1;
            cloud.drift();
            let Cloud { domain, x, v, tag, kind, .. } = &mut *cloud;
            let bodies = Bodies { domain, x, tag, species: kind, mass: &[1.0; 2], frozen: &[] };
            let start = Instant::now();
            thermostat.find_pairs(pool, &bodies, dt, false).map_err(|e| e.to_string())?;
            let found = Instant::now();
            thermostat.draw(1, number, Stream(0), Law::Gaussian);
            let drawn = Instant::now();
            thermostat.act(pool, Update::Midpoint, v);
            let end = Instant::now();
            iterations += thermostat.iterations();
            let seconds = [end - start, found - start, drawn - found, end - drawn];
            (0..4).for_each(|k| parts[k] += seconds[k].as_secs_f64());
        }
        for (best, seconds) in best.iter_mut().zip(parts) {
            *best = best.min(seconds * 1e9 / f64::from(STEPS) / count as f64);
        }
    }
    let [all, find, draw, act] = best;
    println!(
        "thermostat for {dt} {all:.1}: pairs {find:.1}, noise {draw:.1}, midpoint {act:.1} with {:.2} iterations",
        iterations as f64 / f64::from(ROUNDS * STEPS)
    );
    Ok(())
}
