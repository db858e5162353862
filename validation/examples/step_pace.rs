//! Times steps of the native runner in the fluids of `psidpd bench`, in nanoseconds for each particle and step: the
//! fastest of several rounds, and what of it each part takes. What `pace` of psidpd-core says of evaluations alone.
//!
//! `cargo run --release -p psidpd --example step_pace mdpd mixed avx512 1 6050`

use psidpd::bench::length::Length;
use psidpd::bench::native;
use psidpd::experiments::fluids::SUBJECTS;
use psidpd::experiments::start;
use psidpd_core::engine::{Instructions, Precision, Settings};
use std::error::Error;
use std::path::Path;

const ROUNDS: u32 = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [fluid, precision, instructions, threads, size] = &arguments[..] else {
        return Err(
            "usage: step_pace mdpd|dpd|formula mixed|double portable|avx2|avx512|avx512-vbmi2 THREADS SIZE"
                .into(),
        );
    };
    let subject = SUBJECTS.into_iter().find(|s| s.name == fluid).ok_or("mdpd, dpd or formula")?;
    let precision = if precision == "double" { Precision::Double } else { Precision::Mixed };
    let (_, instructions) =
        Instructions::ALL.into_iter().find(|(name, _)| name == instructions).ok_or("no such instructions")?;
    let settings = Settings { precision, instructions, threads: threads.parse()? };
    let start = start::kept(&subject, size.parse()?, Path::new("target/bench/starts"))?;
    let particles = start.state.x.len() as f64;
    let length = Length { warm_up: 30, steps: (3e6 / particles).ceil() as u64 };
    let per_step = 1e9 / (particles * length.steps as f64);
    let mut best = native::run(&subject, &start.state, Some(settings), length)?;
    for _ in 1..ROUNDS {
        let next = native::run(&subject, &start.state, Some(settings), length)?;
        if next.seconds < best.seconds {
            best = next;
        }
    }
    print!("{:.1} ns:", best.seconds * per_step);
    for (name, seconds) in &best.parts {
        print!(" {name} {:.1}", seconds * per_step);
    }
    println!();
    Ok(())
}
