use super::run::thread_count;
use super::*;
use psidpd_experiments::pareto::{self, Choice, Effort, Options, Pace, Tolerance, page};

/// Measure what a unit of simulated time costs with each setting, and the errors of the results.
///
/// Errors are those of energy, pressures, temperatures, g(r), diffusion and what the scene measures of interfaces and viscosities, against a
/// Monte Carlo without a time step. docs/pareto.md says how to read the table. The machine should be idle.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The scene file.
    scene: PathBuf,
    /// Errors that you accept, such as u=0.2%,p=2%,rho_L=0.1%. If left out, each quantity has the smallest of 1, 2, 5 and 10% that
    /// can be resolved in the time, doubled until a setting keeps it. Errors of u and T are in units of kT, of p in ρkT, of densities in that of the liquid.
    #[arg(long, value_name = "NAME=BOUND,…", value_delimiter = ',')]
    tolerance: Vec<Tolerance>,
    /// Approximate duration in minutes; 20 with --full.
    #[arg(long, value_name = "N", value_parser = minutes)]
    minutes: Option<f64>,
    /// Samples of every setting, whatever time they take, instead of as many as the minutes allow.
    #[arg(long, value_name = "N", conflicts_with = "minutes")]
    samples: Option<u64>,
    /// All integrators, in both precisions.
    #[arg(long)]
    full: bool,
    /// Thread counts of the native runner; default: 1 and 2.
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = thread_count)]
    threads: Vec<NonZeroUsize>,
    /// Leave LAMMPS out, though it is installed.
    #[arg(long)]
    without_lammps: bool,
    /// Folder for pareto.json and pareto.html.
    #[arg(long, value_name = "DIR", default_value = "target/pareto")]
    out: PathBuf,
    #[command(flatten)]
    settings: Settings,
}

fn minutes(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if value > 0.0 && value <= 1e5 { Ok(value) } else { Err("a positive number of minutes".into()) }
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.scene])
            .edits(&self.settings.edits)
            .writes(["pareto.json", "pareto.html"].map(|name| self.out.join(name)))
    }
}

pub fn run(a: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let scene = a.settings.scene(&a.scene)?;
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let usual = [Some(NonZeroUsize::MIN), NonZeroUsize::new(2).filter(|_| cores > 1)];
    let mut threads = a.threads.clone();
    if threads.is_empty() {
        threads.extend(usual.into_iter().flatten());
    }
    threads.sort_unstable();
    threads.dedup();
    let options = Options {
        minutes: a.minutes.unwrap_or(if a.full { 20.0 } else { 3.0 }),
        choice: if a.full { Choice::Full } else { Choice::Quick },
        threads,
        tolerances: a.tolerance.clone(),
        lammps: !a.without_lammps,
        fixed: a.samples.map(|n| (Effort::Samples(n), Pace { rounds: 5, seconds: 0.2 })),
        out: a.out.clone(),
        existing: told.existing,
    };
    let outcome = pareto::run(&scene, &options, &Progress::new())?;
    say::table(&page::table(&outcome));
    say!("{}\n", page::explanation(&outcome));
    outcome.left_out.iter().for_each(|line| say!("{line}\n"));
    if !outcome.drifts.is_empty() {
        say!("energy without thermostat");
        say::table(&page::drifts(&outcome));
    }
    say!("{}", page::recommendation(&outcome));
    say!("report: {}", a.out.join("pareto.html").display());
    conclude(told, &outcome, true)
}
