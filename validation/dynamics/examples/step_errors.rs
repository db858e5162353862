//! Errors of steps of random fluids: what a trial says beside what longer runs from other starts have.
//!
//! `cargo run --release -p psidpd-dynamics --example step_errors FIRST LAST`: the numbers of the fluids, from 1; the number is the seed.
//! Each line has the verdict first, so `sort -r` puts the worst first. `step_errors MODEL KT RHO...` tries a model, all masses 1, with
//! the number density of each of its species.

use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::model::Model;
use psidpd_dynamics::integrator::{Coupling, Integrator};
use psidpd_dynamics::run::{RunError, Simulation};
use psidpd_dynamics::trial::{Composition, Piece, StepErrors};
use psidpd_observe::frame::Frame;
use psidpd_observe::series::Series;
use psidpd_observe::{Measured, Recorded, configurational};

/// The step that is advised.
const STEP: Integrator = Integrator::ForceGradient {
    lambda: 0.17,
    gradient: 1.0 / 24.0,
    coupling: Coupling { every: 2, ..Coupling::DEFAULT },
};

/// ωΔt of the reference of the pressure.
const SHORT: f64 = 0.4;

/// Samples of a long run, and steps between them: odd, for steps with and without a thermostat.
const SAMPLES: u64 = 800;
const BETWEEN: u64 = 5;

struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
    fn log(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }
}

struct Fluid {
    model: Model,
    masses: Vec<f64>,
    densities: Vec<f64>,
    kt: f64,
}

fn fluid(number: u64) -> Result<Fluid, Box<dyn std::error::Error>> {
    let mut d = Draws(number);
    let species = 1 + (3.0 * d.uniform()) as usize;
    let names = &["A", "B", "C"][..species];
    let quoted: Vec<String> = names.iter().map(|n| format!("{n:?}")).collect();
    let masses: Vec<f64> = names.iter().map(|_| d.log(0.1, 10.0)).collect();
    let weights: Vec<f64> = names.iter().map(|_| d.between(0.1, 1.0)).collect();
    let gamma = d.log(1.0, 100.0);
    let kt = d.log(0.5, 2.0);
    let kind = (5.0 * d.uniform()) as usize;
    // Every fifth is a fluid of the plane.
    let dimensions = if number.is_multiple_of(5) { 2 } else { 3 };
    let mut text = format!("title = \"f\"\ndimensions = {dimensions}\nspecies = [{}]\n", quoted.join(", "));
    let rho = match kind {
        // Soft pairs.
        0 => d.between(3.0, 6.0),
        // A pole.
        1 => d.between(4.0, 14.0),
        _ => d.between(3.0, 8.0),
    };
    let mut pairs = |low: f64, high: f64, range: f64, text: &mut String| {
        for i in 0..species {
            for j in i..species {
                let a = d.between(low, high);
                *text += &format!(
                    "[[pair]]\nbetween = [{:?}, {:?}]\nform = \"soft\"\nstrength = {a:.3}\nrange = {range}\n",
                    names[i], names[j]
                );
            }
        }
    };
    let psi = |f: &dyn Fn(usize) -> String, text: &mut String| {
        *text += "[excess_free_energy]\n";
        names.iter().enumerate().for_each(|(k, name)| *text += &format!("{name} = \"{}\"\n", f(k)));
    };
    match kind {
        0 => pairs(10.0 * kt, 60.0 * kt, 1.0, &mut text),
        1 => {
            let b = 0.045;
            text += &format!(
                "[density.n]\nkernel = \"quadratic\"\nrange = 1.0\nbounds = [0.0, {:.3}]\n",
                // Bounds hold the part of each species, and the pole is one of their sum.
                0.95 / b / species as f64
            );
            psi(&|k| format!("-kT*ln(1 - {b}*n) - {:.2}*n", 0.1 * (1 + k) as f64), &mut text);
        }
        2 => {
            pairs(-40.0 * kt, -20.0 * kt, 1.0, &mut text);
            text += "[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n";
            psi(&|_| format!("pi/30*0.75^4*{:.2}*n^2", 25.0 * kt), &mut text);
        }
        3 => {
            let kernels = ["quadratic", "wendland-c2", "lucy", "cubic-spline"];
            text += &format!(
                "[density.n]\nkernel = {:?}\nrange = 1.0\n[density.m]\nkernel = \"quadratic\"\nrange = 0.8\n",
                kernels[(number % 4) as usize]
            );
            psi(&|k| format!("0.05*kT*n^2 + {:.2}*kT*m", 0.5 + k as f64), &mut text);
        }
        _ => {
            text += "[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n";
            psi(&|k| format!("{:.3}*kT*n^{}", 0.05 + 0.1 * (k as f64), 2 + (number % 2)), &mut text);
        }
    }
    text += &format!("[[thermostat]]\ngamma = {gamma:.3}\nrange = 1.0\n");
    let sum: f64 = weights.iter().sum();
    let model = Model::parse("f.toml", &text).map_err(|e| format!("{number}: {e}\n{text}"))?;
    Ok(Fluid { model, masses, densities: weights.iter().map(|w| rho * w / sum).collect(), kt })
}

/// The temperatures less 1, and the carried pressure in ρkT, of a long run after a time `settle`; `None` where it stops.
fn long_run(
    piece: &Piece,
    model: &Model,
    kt: f64,
    (dt, settle, seed): (f64, f64, u64),
) -> Result<Option<[Measured; 3]>, RunError> {
    let mut run = Simulation::new(model, kt, piece.state().clone(), seed)?;
    let evaluator = Evaluator::new(model.at(kt)?)?;
    let ideal = run.len() as f64 * kt / run.state().domain.volume(run.dimensions());
    let (mut ends, mut forces) = (Series::new(2), Series::new(2));
    if run.prepare_for(STEP, dt, Want::TOTALS).is_err()
        || run.advance((settle / dt) as u64, dt, STEP).is_err()
    {
        return Ok(None);
    }
    for sample in 0..SAMPLES {
        run.record_flux(Recorded::Nothing);
        if run.advance(BETWEEN - 1, dt, STEP).is_err() {
            return Ok(None);
        }
        run.record_flux(Recorded::Lines);
        if run.step(dt, STEP, Want::TOTALS).is_err() {
            return Ok(None);
        }
        let frame = Frame::new(run.view(0.0), &evaluator);
        let carried = frame.carried_pressure().unwrap_or([f64::NAN; 6]);
        ends.push(&[run.temperature() / kt, run.scalar_pressure(carried) / ideal]);
        if sample.is_multiple_of(2) {
            forces.push(&configurational::sums(&frame));
        }
    }
    let one = Measured::from(1.0);
    let ratio = forces.ratio(|s| s[0], |s| s[1]).times(1.0 / kt).minus(one);
    Ok(Some([ends.mean(0).minus(one), ratio, ends.mean(1)]))
}

/// Whether an estimate is right within a factor of two, but for what neither it nor the run resolves.
fn verdict(
    said: Option<StepErrors>,
    found: Option<[Measured; 3]>,
    reference: Measured,
) -> (&'static str, String) {
    let Some([kinetic, configurational, pressure]) = found else {
        return match said {
            None => ("dies as said", String::new()),
            Some(_) => ("wrong: dies", String::new()),
        };
    };
    let pressure = pressure.minus(reference);
    let told = [kinetic, configurational, pressure];
    let text = told.map(|m| format!("{:+.4}({:.4})", m.value, m.error)).join(" ");
    let Some(said) = said else { return ("said dies, lives", text) };
    // A configurational temperature that scatters as much tells nothing.
    let known = told.into_iter().filter(|m| m.error < 0.03);
    let worst = known.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
    let Some(Measured { value, error }) = worst else { return ("unknown", text) };
    let (low, high) = (value.abs() - 3.0 * error, value.abs() + 3.0 * error);
    let most = said.worst().max(said.resolution());
    let verdict = match () {
        () if most > 0.1 => "no claim",
        () if low > 2.0 * most => "wrong: too small",
        () if high < 0.5 * (said.worst() - said.resolution()) => "wrong: too large",
        () => "right",
    };
    (verdict, text)
}

/// Prints what is estimated for two steps of a fluid, and what long runs have. `number` is the seed.
fn compare(name: &str, fluid: &Fluid, number: u64) -> Result<(), Box<dyn std::error::Error>> {
    let Fluid { model, masses, densities, kt } = fluid;
    let kt = *kt;
    let of = |seed| Composition { model, masses, kt, densities, seed };
    let head = format!("{name} {}D masses {masses:.2?}", model.dimensions());
    let (piece, other) = match (Piece::settled(&of(number))?, Piece::settled(&of(number + 1000))?) {
        (Ok(piece), Ok(other)) => (piece, other),
        (Err(why), _) | (_, Err(why)) => {
            println!("no estimate | {head} {why}");
            return Ok(());
        }
    };
    let w = piece.frequency;
    let head = format!("{head} w {w:.2} ({:.2}) k/w {:.2}", other.frequency, piece.drag / w);
    let advised = piece.longest(STEP)?;
    if advised.is_none() {
        println!("no estimate | {head} no step is advised");
    }
    // Beyond what is advised errors are large enough to be compared.
    let longer = 1.3 * advised.map_or(0.6 / w, |(dt, _)| dt);
    // As long for all: fluids that demix change their pressure on the way.
    let settle = 600.0 * longer;
    let reference = long_run(&other, model, kt, (SHORT / w, settle, number + 2000))?;
    let Some([.., reference]) = reference else {
        println!("no reference | {head}");
        return Ok(());
    };
    let tried = [advised.map(|(dt, said)| (dt, Some(said))), Some((longer, piece.errors(STEP, longer)?))];
    for (dt, said) in tried.into_iter().flatten() {
        let found = long_run(&other, model, kt, (dt, settle, number + 3000))?;
        let (verdict, text) = verdict(said, found, reference);
        let estimate = said.map_or("dies".to_owned(), |said| {
            format!("{:.4} resolves {:.4}", said.worst(), said.resolution())
        });
        println!("{verdict} | {head} dt {dt:.4} wdt {:.2} said {estimate} has {text}", w * dt);
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let texts: Vec<String> = std::env::args().skip(1).collect();
    if let [path, kt, densities @ ..] = &texts[..]
        && path.ends_with(".toml")
    {
        let model = Model::open(std::path::Path::new(path))?;
        let densities = densities.iter().map(|a| a.parse()).collect::<Result<Vec<f64>, _>>()?;
        let masses = vec![1.0; densities.len()];
        return compare(path, &Fluid { model, masses, densities, kt: kt.parse()? }, 1);
    }
    let arguments: Vec<u64> = texts.iter().map(|a| a.parse()).collect::<Result<_, _>>()?;
    let [first, last] = arguments[..] else { return Err("FIRST LAST".into()) };
    (first..=last).try_for_each(|number| compare(&format!("fluid {number}"), &fluid(number)?, number))
}
