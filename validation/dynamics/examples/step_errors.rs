//! Errors of steps of random fluids: what a trial says beside what longer runs of larger boxes have.
//!
//! `cargo run --release -p psidpd-dynamics --example step_errors FIRST LAST`: the numbers of the fluids.

use psidpd_core::model::Model;
use psidpd_dynamics::integrator::{Coupling, Integrator};
use psidpd_dynamics::trial::{Composition, Piece};

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
    text: String,
    masses: Vec<f64>,
    densities: Vec<f64>,
    kt: f64,
}

fn fluid(number: u64) -> Fluid {
    let mut d = Draws(number);
    let species = 1 + (3.0 * d.uniform()) as usize;
    let names = &["A", "B", "C"][..species];
    let quoted: Vec<String> = names.iter().map(|n| format!("{n:?}")).collect();
    let masses: Vec<f64> = names.iter().map(|_| d.log(0.1, 10.0)).collect();
    let weights: Vec<f64> = names.iter().map(|_| d.between(0.1, 1.0)).collect();
    let gamma = d.log(1.0, 100.0);
    let kt = d.log(0.5, 2.0);
    let kind = (5.0 * d.uniform()) as usize;
    let mut text = format!("title = \"f\"\nspecies = [{}]\n", quoted.join(", "));
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
                0.95 / b
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
    Fluid { text, masses, densities: weights.iter().map(|w| rho * w / sum).collect(), kt }
}

/// `step_errors MODEL KT RHO DT...` tries steps of a model of one species.
fn of_model(arguments: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let model = Model::open(std::path::Path::new(&arguments[0]))?;
    let numbers: Vec<f64> = arguments[1..].iter().map(|a| a.parse()).collect::<Result<_, _>>()?;
    let n = model.species().len();
    let (masses, densities) = (vec![1.0; n], vec![numbers[1] / n as f64; n]);
    let of = Composition { model: &model, masses: &masses, kt: numbers[0], densities: &densities, seed: 3 };
    let Some(piece) = Piece::settled(&of)? else { return Err("no piece".into()) };
    println!(
        "{} w {:.2} mean {:?} drag {:.2} cap {:.4} beta {:.2}",
        arguments[0],
        piece.frequency,
        piece.mean_frequency,
        piece.drag,
        piece.cap(),
        piece.thermal_pressure
    );
    for dt in &numbers[2..] {
        let integrator = Integrator::ForceGradient {
            lambda: 0.17,
            gradient: 1.0 / 24.0,
            coupling: Coupling { every: 2, ..Coupling::DEFAULT },
        };
        println!("  dt {dt} z {:.2} {:?}", dt * piece.frequency, piece.errors(integrator, *dt)?);
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let texts: Vec<String> = std::env::args().skip(1).collect();
    if texts.first().is_some_and(|first| first.ends_with(".toml")) {
        return of_model(&texts);
    }
    let arguments: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let multiples: Vec<f64> = std::env::args().skip(3).filter_map(|a| a.parse().ok()).collect();
    let [first, last, ..] = arguments[..] else { return Err("FIRST LAST MULTIPLES...".into()) };
    let offset = std::env::var("SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    for number in first..=last {
        let f = fluid(number);
        let model = Model::parse("f.toml", &f.text).map_err(|e| format!("{number}: {e}\n{}", f.text))?;
        let of =
            |seed| Composition { model: &model, masses: &f.masses, kt: f.kt, densities: &f.densities, seed };
        let begun = std::time::Instant::now();
        let Some(piece) = Piece::settled(&of(number + offset))? else {
            println!("{number} no piece");
            continue;
        };
        let settled = begun.elapsed().as_secs_f64();
        for z in &multiples {
            let lambda = 0.17;
            let integrator = Integrator::ForceGradient {
                lambda,
                gradient: 1.0 / 24.0,
                coupling: Coupling { every: 2, ..Coupling::DEFAULT },
            };
            let dt = z / piece.frequency;
            let begun = std::time::Instant::now();
            let errors = piece.errors(integrator, dt)?;
            let took = begun.elapsed().as_secs_f64();
            let head = format!(
                "{number} z {z} w {:.2} mean {:.2} k/w {:.3} masses {:.2?} settled {settled:.2} took {took:.2}",
                piece.frequency,
                piece.mean_frequency.unwrap_or(f64::NAN),
                piece.drag / piece.frequency,
                f.masses
            );
            match errors {
                None => println!("{head} DIES"),
                Some(e) => {
                    let s = |v: psidpd_observe::Measured| format!("{:+.4}({:.4})", v.value, v.error);
                    println!(
                        "{head} beta {:.2} Tk {} Tc {} p {:.4} worst {:.4} res {:.4}",
                        e.thermal_pressure,
                        s(e.kinetic),
                        e.configurational.map_or("-".into(), s),
                        e.carried(),
                        e.worst(),
                        e.resolution()
                    )
                }
            }
        }
    }
    Ok(())
}
