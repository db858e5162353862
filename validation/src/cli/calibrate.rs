use super::run::{at_least, between, threads_at_once};
use super::*;
use psidpd_experiments::calibrate::{Options, calibrate, shown, spaced};
use psidpd_experiments::run::bulk::Sampling;

/// Find the corrected density with which a model has its target pressure.
///
/// Runs the fluid at several densities, fits a polynomial with <rho~(n)> = rho, and repeats until it holds and
/// the pressure is the required one: linear if that suffices, else fitted to the pressures, quadratic, or cubic.
/// Exits with 1 if none meets the tolerance; the file then has the best of them.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The model file.
    model: PathBuf,
    /// kT.
    #[arg(long = "kT", value_name = "T", default_value_t = 1.0, allow_negative_numbers = true, value_parser = temperature)]
    kt: f64,
    /// Total number densities at which the pressure must be right: LOW:HIGH, or one.
    #[arg(long, value_name = "LOW:HIGH", default_value = "3:10", value_parser = range)]
    density: [f64; 2],
    /// How many densities are run.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = between(1, 1000))]
    points: u32,
    /// Shares of the species; equal ones if left out.
    #[arg(long, value_name = "X", value_delimiter = ',')]
    composition: Vec<f64>,
    /// Which density of the model, if it has several.
    #[arg(long)]
    name: Option<String>,
    /// Largest difference of pressures, relative to the required one (or to a tenth of the bulk modulus, where the
    /// pressure is less), and of <rho~> from rho.
    #[arg(long, value_name = "SHARE", default_value_t = 0.02)]
    tolerance: f64,
    /// Particles in each run.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = at_least(100))]
    particles: u64,
    /// Steps of each run that are measured.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = at_least(100))]
    steps: u64,
    /// Steps before them.
    #[arg(long, value_name = "N", default_value_t = 500)]
    equilibrate: u64,
    #[command(flatten)]
    runs: Runs,
    /// Where the model file with its correction goes.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Debug, clap::Args)]
pub struct Runs {
    /// Time step.
    #[arg(long, default_value_t = 0.01)]
    pub dt: f64,
    /// Seed of the starts and of the noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Threads that share the work.
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads_at_once)]
    threads: NonZeroUsize,
}

impl Runs {
    pub fn sampling(&self, particles: usize, equilibrate: u64, steps: u64) -> Sampling {
        let Runs { dt, seed, threads } = *self;
        Sampling { particles, dt, equilibrate, steps, every: 20, seed, threads }
    }
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.model]).writes([self.out.clone()])
    }
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let mut ends = text.splitn(2, ':').map(|end| end.trim().parse::<f64>());
    let low = ends.next().and_then(Result::ok);
    let high = ends.next().map_or(low, Result::ok);
    match (low, high) {
        (Some(low), Some(high)) if 0.0 < low && low <= high && high.is_finite() => Ok([low, high]),
        _ => Err("expected LOW:HIGH with 0 < LOW <= HIGH, or one density".into()),
    }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let a = arguments;
    let bad = |message: String| Failure::from(ExperimentError::Conditions(message));
    if !(a.tolerance > 0.0 && a.runs.dt > 0.0 && a.tolerance.is_finite() && a.runs.dt.is_finite()) {
        return Err(bad("tolerance and time step must be positive numbers".into()));
    }
    let species = Model::open(&a.model)?.species().len();
    let shares = if a.composition.is_empty() { vec![1.0; species] } else { a.composition.clone() };
    let sum: f64 = shares.iter().sum();
    if shares.iter().any(|share| share.is_nan() || *share <= 0.0) || !sum.is_finite() {
        return Err(bad("shares of the composition must be positive numbers".into()));
    }
    let options = Options {
        kt: a.kt,
        densities: spaced(a.density[0], a.density[1], a.points as usize),
        composition: shares.iter().map(|share| share / sum).collect(),
        name: a.name.clone(),
        tolerance: a.tolerance,
        sampling: a.runs.sampling(a.particles as usize, a.equilibrate, a.steps),
    };
    let found = calibrate(&a.model, &options, &command(a), &mut |line| say!("{line}"))?;
    write_bytes(&a.out, told.existing, found.text.as_bytes())?;
    let mut table = Table::new(["density", "kT", "<n>", "<rho~>", "p target", "p measured", "off by"]);
    let pm = |v: &psidpd_observe::Measured| format!("{:.5} ± {:.5}", v.value, v.error);
    for r in &found.residuals {
        table.push([
            format!("{:.4}", r.density),
            format!("{:.4}", r.temperature.value),
            r.mean.iter().map(pm).collect::<Vec<_>>().join(", "),
            r.corrected.iter().map(|c| format!("{:.4}", c.value)).collect::<Vec<_>>().join(", "),
            format!("{:.4}", r.wanted),
            format!("{:.4} ± {:.4}", r.pressure.value, r.pressure.error),
            format!("{:.2} %", 100.0 * r.deviation),
        ]);
    }
    say!("");
    say::table(&table);
    for (pair, fit) in found.pairs.iter().zip(found.fits()) {
        say!("rho~ {pair}: {}", shown(fit));
    }
    let best = &found.rounds[found.chosen];
    if best.pressure_error > 0.5 * a.tolerance {
        say!(
            "error bars of the pressure reach {:.2} %, more than half of the tolerance: raise --steps or --particles",
            100.0 * best.pressure_error
        );
    }
    for r in &found.residuals {
        if (r.temperature.value / a.kt - 1.0).abs() > 0.02 {
            say!(
                "at density {} the temperature is {:.3}, not {}: use a shorter time step (--dt)",
                r.density,
                r.temperature.value,
                a.kt
            );
        }
    }
    for failed in &found.failed {
        say!(
            "warning: at density {} the run stopped: {}; it is left out of the fit. A smaller --dt or a narrower --density \
             range may help",
            failed.density,
            failed.why
        );
    }
    if !found.converged {
        say!(
            "no correction up to third order meets the tolerance of {:.2} %: narrow --density, or widen --tolerance",
            100.0 * a.tolerance
        );
    }
    say!("written to {}", a.out.display());
    conclude(told, &found, found.converged)
}

/// The command line that repeats the calibration.
fn command(a: &Arguments) -> String {
    let [low, high] = a.density;
    let mut text = format!("psidpd calibrate {} --kT {} --density {low}:{high}", file_name(&a.model), a.kt);
    let mut add = |option: String| {
        text.push(' ');
        text.push_str(&option);
    };
    add(format!("--points {} --tolerance {}", a.points, a.tolerance));
    if !a.composition.is_empty() {
        add(format!(
            "--composition {}",
            a.composition.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
        ));
    }
    if let Some(name) = &a.name {
        add(format!("--name {name}"));
    }
    add(format!(
        "--particles {} --equilibrate {} --steps {} --dt {} --seed {} --out {}",
        a.particles,
        a.equilibrate,
        a.steps,
        a.runs.dt,
        a.runs.seed,
        file_name(&a.out)
    ));
    text
}
