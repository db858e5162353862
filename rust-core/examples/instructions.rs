//! Evaluates forces a given number of times, for counting instructions: the same fluid, particles and steps
//! in every run, one thread.
//!
//! ```text
//! valgrind --tool=callgrind --callgrind-out-file=/dev/null \
//!     target/release/examples/instructions mdpd mixed avx2 8
//! ```
//!
//! With `ghosts` as last word the particles are those of a rank that has ghosts along z.
//!
//! The difference between runs of different length is the cost of the additional evaluations. The
//! program prints the number of particles and a sum of forces, so that the compiler removes nothing.

#[path = "../benches/setup/mod.rs"]
mod setup;

use setup::{Cloud, Rank, choose, sweep};
use std::process::ExitCode;

const COUNT: usize = 2000;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!(
                "{fault}\nusage: instructions mdpd|dpd|formula mixed|double portable|avx2|avx512|avx512-vbmi2 EVALUATIONS [ghosts]"
            );
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let [fluid, precision, instructions, evaluations, ghosts @ ..] = arguments else {
        return Err("four arguments are needed".into());
    };
    let (subject, precision, set) = choose(fluid, precision, instructions)?;
    let evaluations: u32 = evaluations.parse().map_err(|_| "EVALUATIONS is a number")?;
    let fluid = subject.fluid();
    let mut sweep = sweep(&fluid, precision, set);
    let force = match ghosts {
        [] => {
            let mut cloud = Cloud::new(subject, &fluid, COUNT);
            for _ in 0..evaluations {
                cloud.drift();
                cloud.evaluate(&mut sweep);
            }
            cloud.force
        }
        [word] if word == "ghosts" => {
            let mut rank = Rank::new(subject, &fluid, COUNT);
            rank.find_ghosts(sweep.plan().cutoff());
            for _ in 0..evaluations {
                rank.drift();
                rank.evaluate(&mut sweep, || ());
            }
            rank.cloud.force
        }
        _ => return Err("the last word, if there is a fifth, is ghosts".into()),
    };
    println!("{COUNT} {}", force.iter().map(|f| f[0].abs()).sum::<f64>());
    Ok(())
}
