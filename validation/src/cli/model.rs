use super::calibrate::Runs;
use super::run::at_least;
use super::*;
use psidpd_experiments::from_eos::{Options, Substance, from_eos};

/// Make a model file.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Make a model of a real liquid from its equation of state (PC-SAFT), with its units in SI.
    ///
    /// Density, compressibility and surface tension are those of the equation of state within the tolerance; exits
    /// with 1 if not. Needs a psidpd that was built with `--features eos`.
    FromEos(FromEos),
}

#[derive(Debug, clap::Args)]
pub struct FromEos {
    /// Which substance: water, decane.
    substance: String,
    /// Temperature in K.
    #[arg(long = "T", value_name = "KELVIN", default_value_t = 298.15)]
    temperature: f64,
    /// Molecules in a particle (N_m).
    #[arg(long, value_name = "N", default_value_t = 1.0)]
    molecules: f64,
    /// Particles of the liquid in the cube of the unit of length.
    #[arg(long, value_name = "RHO", default_value_t = 6.0)]
    density: f64,
    /// Range of the many-body repulsion, over that of the attraction.
    #[arg(long, default_value_t = 0.75)]
    range: f64,
    /// Largest relative difference of the tension, and of pressures as in `calibrate`.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    tolerance: f64,
    /// Steps of each run of the homogeneous liquid; the slab has eight times as many.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = at_least(100))]
    steps: u64,
    #[command(flatten)]
    runs: Runs,
    /// Where the model file goes.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Verb {
    pub fn files(&self) -> Files {
        let Verb::FromEos(a) = self;
        Files::default().writes([a.out.clone()])
    }
}

pub fn run(verb: &Verb, told: Told) -> Result<Verdict, Failure> {
    let Verb::FromEos(a) = verb;
    let numbers = [a.temperature, a.molecules, a.density, a.tolerance, a.runs.dt, a.range, 1.0 - a.range];
    if !numbers.into_iter().all(|x| x > 0.0 && x.is_finite()) {
        let message = "numbers must be positive, and the range below 1";
        return Err(ExperimentError::Conditions(message.into()).into());
    }
    let options = Options {
        temperature: a.temperature,
        molecules: a.molecules,
        density: a.density,
        range: a.range,
        tolerance: a.tolerance,
        sampling: a.runs.sampling(1000, 500, a.steps),
    };
    let command = format!(
        "psidpd model from-eos {} --T {} --molecules {} --density {} --range {} --tolerance {} --steps {} --dt {} --seed {} --out {}",
        a.substance,
        a.temperature,
        a.molecules,
        a.density,
        a.range,
        a.tolerance,
        a.steps,
        a.runs.dt,
        a.runs.seed,
        a.out.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned()),
    );
    let substance = Substance::find(&a.substance)?;
    let found = from_eos(&substance, &options, &command, &mut |line| say!("{line}"))?;
    write_bytes(&a.out, told.existing, found.text.as_bytes())?;
    let mut table = Table::new(["", "equation of state", "model"]);
    for c in &found.compared {
        table.push([
            c.name.to_owned(),
            format!("{:.4}", c.wanted),
            format!("{:.4} ± {:.4}", c.measured.value, c.measured.error),
        ]);
    }
    say!("");
    say::table(&table);
    if !found.converged {
        say!("the tolerance of {:.1} % is not met", 100.0 * a.tolerance);
    }
    say!("written to {}", a.out.display());
    conclude(told, &found, found.converged)
}
