//! The benchmark: LAMMPS, the plugin and the native runner side by side.
//!
//! Every code starts from one state of each fluid and size and is timed in interleaved rounds, so that what slows
//! the machine down for a while slows them all; ratios are taken within a round. [`contender`] says who is timed,
//! [`deck`] runs LAMMPS and [`native`] the runner.

pub mod advice;
mod clock;
pub mod contender;
pub mod deck;
#[cfg(feature = "gpu")]
pub mod device;
pub mod length;
pub mod memory;
pub mod native;
pub mod outcome;
pub mod page;
mod pairs;
pub mod scenes;
mod scenes_in_lammps;
mod spread;
mod turns;

pub use outcome::Benchmark;
pub use spread::Spread;

use crate::ExperimentError;
use crate::code::{Code, Suffix};
use crate::files::absolute_folder;
use crate::fluids::{MDPD, MIXTURES, SUBJECTS, Subject};
use crate::lammps::host::PluginHost;
use crate::lammps::log::Loop;
use crate::machine::machine;
use crate::start::{self, Start};
use contender::{Choice, Contender, Field};
use deck::Place;
use length::{FEWEST, Length};
pub use outcome::Asked;
use outcome::{FluidFacts, LammpsFacts, Machine, Scaling, Timed};
use psidpd_core::engine::{Instructions, Plan, Precision, Settings};
use psidpd_formats::files::{Existing, write_bytes, write_json};
use psidpd_report::Progress;
use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

#[derive(Debug, Clone)]
pub struct Options {
    pub asked: Asked,
    /// Particles of the systems whose memory is measured.
    pub memory: Vec<usize>,
    pub threads: Vec<NonZeroUsize>,
    /// More words behind the seed of `pair_style dpd/psi`, each a contender.
    pub words: Vec<String>,
    /// Another LAMMPS than the one that `psidpd lammps install` puts in place.
    pub lammps: Option<PathBuf>,
    pub out: PathBuf,
    pub existing: Existing,
}

/// Skin of LAMMPS where none is looked for.
const SKIN: f64 = 0.3;
const SKINS: [f64; 4] = [0.2, 0.3, 0.4, 0.55];

/// A contender with a fluid and a size, and what was measured so far.
struct Entry {
    subject: Subject,
    size: usize,
    contender: Contender,
    length: Length,
    skin: f64,
    /// Seconds that a step is expected to take; none where steps are given.
    step: Option<f64>,
    /// The timed loop of each round.
    made: Vec<Loop>,
}

impl Entry {
    /// Seconds that a run is expected to take; 1 where nothing is known. For the bar: LAMMPS starts in 0.2 s and
    /// reads and sets up a particle in 10 µs, roughly.
    fn weight(&self) -> f64 {
        let begin = if self.contender.in_lammps() { 0.2 + 1e-5 * self.particles() } else { 0.0 };
        self.step.map_or(1.0, |step| begin + step * self.length.all() as f64)
    }

    fn particles(&self) -> f64 {
        (self.subject.particles(self.size) * self.contender.copies()) as f64
    }
}

struct Case {
    start: Start,
    pairs: f64,
}

struct Bench<'a> {
    asked: &'a Asked,
    place: Place,
    /// The cases by fluid and size.
    cases: BTreeMap<(&'static str, usize), Case>,
    progress: &'a Progress,
}

/// Runs the benchmark and writes `bench.json` and `report.html`. `program` is psidpd itself, which is
/// started to measure memory.
pub fn run(options: &Options, program: &Path, progress: &Progress) -> Result<Benchmark, ExperimentError> {
    let load = load();
    let out = absolute_folder(&options.out)?;
    let prepared = || PluginHost::prepared(options.lammps.as_deref(), &|line| progress.note(line));
    let (lammps, version) = progress.spinner("LAMMPS and the plugin", prepared)?;
    let place = Place { lammps, work: out.join("runs") };
    let (choice, missing) = choice(options, &place)?;
    let mut bench = Bench { asked: &options.asked, place, cases: BTreeMap::new(), progress };
    let mut entries = bench.entries(&choice, &out)?;
    bench.calibrate(&mut entries)?;
    bench.time(&mut entries)?;

    let memory = progress.spinner("memory", || memory::measure(program, &options.memory))?;
    let equal_bits = progress.spinner("threads", || bench.equal_bits())?;

    let runs = bench.runs(&entries);
    let is_timed = |subject: &&Subject| entries.iter().any(|entry| entry.subject == **subject);
    let fluids = SUBJECTS.iter().chain(&MIXTURES).filter(is_timed).map(facts);
    let fluids = fluids.collect::<Result<Vec<_>, _>>()?;
    let scaling = scaling(&runs, &entries, facts(&MDPD)?.slope_width);
    let outcome = Benchmark {
        format: 3,
        version: env!("CARGO_PKG_VERSION"),
        machine: this_machine(load),
        lammps: LammpsFacts { version, missing },
        options: options.asked.clone(),
        fluids,
        runs,
        scaling,
        memory,
        equal_bits,
    };
    write_json(&out.join("bench.json"), options.existing, &outcome)?;
    write_bytes(&out.join("report.html"), options.existing, page::report(&outcome)?.as_bytes())?;
    Ok(outcome)
}

/// The machine, with the load before the benchmark.
fn this_machine(load: Option<f64>) -> Machine {
    Machine {
        processor: machine(),
        cores: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
        instructions: Instructions::ALL
            .into_iter()
            .filter(|(_, i)| i.available())
            .map(|(name, _)| name.to_owned())
            .collect(),
        better: better(),
        gigahertz: clock::gigahertz(),
        load,
    }
}

/// Times whole scenes; see [`scenes`].
pub fn whole_scenes(
    options: &scenes::Options,
    progress: &Progress,
) -> Result<scenes::Outcome, ExperimentError> {
    scenes::run(options, this_machine(load()), progress)
}

/// Who can be timed here, and the styles that LAMMPS lacks.
fn choice(options: &Options, place: &Place) -> Result<(Choice, Vec<String>), ExperimentError> {
    let styles = deck::pair_styles(place)?;
    let has = |name: &str| styles.contains(name);
    let suffixes: Vec<Suffix> = Suffix::ALL.into_iter().filter(|s| has(s.style())).collect();
    let wanted = ["mdpd", "eam/alloy", "dpd/tstat", "dpd", "dpd/omp", "dpd/intel"];
    let missing = wanted.iter().filter(|s| !has(s)).map(|s| (*s).to_owned()).collect();
    let choice = Choice {
        built_in: has("mdpd") && has("mdpd/rhosum"),
        eam: has("eam/alloy") && has("dpd/tstat"),
        suffixes,
        words: options.words.clone(),
        threads: options.threads.clone(),
        two_ranks: place.lammps.host.mpirun.is_some(),
    };
    Ok((choice, missing))
}

/// Speed and skin of a contender, measured at its smallest size and used for all.
#[derive(Clone, Copy)]
struct Pace {
    skin: f64,
    /// Seconds for a step of a particle.
    seconds: f64,
}

impl Bench<'_> {
    fn entries(&mut self, choice: &Choice, out: &Path) -> Result<Vec<Entry>, ExperimentError> {
        let smallest = self.asked.sizes.iter().min().copied();
        let mut entries = Vec::new();
        for &size in &self.asked.sizes {
            for subject in subjects(size, Some(size) == smallest)? {
                let name = format!("equilibrium: {}, {size}", subject.name);
                let start =
                    self.progress.spinner(&name, || start::kept(&subject, size, &out.join("starts")))?;
                let fluid = subject.model()?.at(1.0).map_err(ExperimentError::File)?;
                let pairs = pairs::pairs_per_particle(&start.state, &fluid);
                self.cases.insert((subject.name, size), Case { start, pairs });
                deck::prepare(&self.place, &subject, subject == MDPD && choice.eam)?;
                let field =
                    Field::of(size, Some(size) == smallest, self.asked.every_code, self.asked.few_above);
                for contender in contender::contenders(&subject, choice, field) {
                    entries.push(Entry {
                        subject,
                        size,
                        contender,
                        length: Length { warm_up: 5, steps: self.asked.steps.unwrap_or(FEWEST) },
                        skin: SKIN,
                        step: None,
                        made: Vec::new(),
                    });
                }
            }
        }
        Ok(entries)
    }

    /// Finds the pace of each contender and the fastest skin of those in LAMMPS, at the smallest size that has them, and
    /// steps that fill the time of a run: at all sizes, since neither depends much on the size.
    fn calibrate(&self, entries: &mut [Entry]) -> Result<(), ExperimentError> {
        if self.asked.steps.is_some() {
            return Ok(());
        }
        let mut order: Vec<usize> = (0..entries.len()).collect();
        order.sort_by_key(|k| entries[*k].size);
        let key = |entry: &Entry| (entry.subject.name, entry.contender.id());
        let all: BTreeSet<_> = entries.iter().map(key).collect();
        let bar = self.progress.bar("calibration", all.len() as u64);
        let mut paces = BTreeMap::new();
        for k in order {
            let entry = &mut entries[k];
            let pace: Pace = match paces.get(&key(entry)) {
                Some(pace) => *pace,
                None => {
                    let pace = self.pace(entry)?;
                    paces.insert(key(entry), pace);
                    bar.advance(1);
                    pace
                }
            };
            let step = pace.seconds * entry.particles();
            (entry.skin, entry.step) = (pace.skin, Some(step));
            entry.length = Length::within(self.asked.seconds, &entry.contender, step);
        }
        Ok(())
    }

    fn pace(&self, entry: &mut Entry) -> Result<Pace, ExperimentError> {
        // Short runs scatter more than skins differ, but in a large box long runs would take minutes.
        let large = entry.size > self.asked.few_above;
        entry.length = if large { Length::of(FEWEST) } else { Length { warm_up: 20, steps: 60 } };
        let mut pace = Pace { skin: SKIN, seconds: f64::INFINITY };
        // The native runner has no skin but is tried as often, so that one disturbed run does not decide.
        let skins = if entry.contender.needs_no_ghosts() { [0.0; SKINS.len()] } else { SKINS };
        for skin in skins {
            let seconds = self.once(entry, skin)?.seconds / (entry.length.steps as f64 * entry.particles());
            if seconds < pace.seconds {
                pace = Pace { skin, seconds };
            }
        }
        Ok(pace)
    }

    fn time(&self, entries: &mut [Entry]) -> Result<(), ExperimentError> {
        let rounds = self.asked.rounds;
        let runs: Vec<_> = entries.iter().map(|e| (e.subject.name, e.size)).collect();
        let mut order = turns::turns(&runs);
        // By the time that runs are expected to take: one in a large box takes as long as many in a small one.
        let all = rounds as f64 * entries.iter().map(Entry::weight).sum::<f64>();
        let bar = self.progress.bar("rounds", all.ceil() as u64);
        let mut done = 0.0;
        for _ in 0..rounds {
            for &k in &order {
                let entry = &mut entries[k];
                let made = self.once(entry, entry.skin)?;
                entry.made.push(made);
                done += entry.weight();
                bar.set(done as u64);
            }
            // Alternate the order, so that neighbours in time do not matter.
            order.reverse();
        }
        Ok(())
    }

    fn once(&self, entry: &Entry, skin: f64) -> Result<Loop, ExperimentError> {
        let start = &self.cases[&(entry.subject.name, entry.size)].start;
        match entry.contender.in_lammps() {
            true => deck::run(&self.place, &entry.subject, &entry.contender, start, skin, entry.length),
            false => native::run(&entry.subject, &start.state, entry.contender.settings(), entry.length),
        }
    }

    fn runs(&self, entries: &[Entry]) -> Vec<Timed> {
        let median = |values: &[f64]| Spread::of(values).map_or(0.0, |s| s.median);
        let mut runs: Vec<Timed> = entries
            .iter()
            .map(|entry| {
                let case = &self.cases[&(entry.subject.name, entry.size)];
                let particles = case.start.state.len() * entry.contender.copies();
                let all = particles as f64 * entry.length.steps as f64;
                let names = entry.made.first().into_iter().flat_map(|made| made.parts.keys());
                let part = |name: &String| {
                    let of = |made: &Loop| 1e9 * made.parts.get(name).copied().unwrap_or(0.0) / all;
                    (name.clone(), median(&entry.made.iter().map(of).collect::<Vec<_>>()))
                };
                let seconds: Vec<f64> = entry.made.iter().map(|made| made.seconds).collect();
                let per_particle = 1e9 * median(&seconds) / all;
                let settings = entry.contender.settings();
                let in_lammps = entry.made.last().filter(|_| entry.contender.in_lammps());
                let builds: u64 = entry.made.iter().map(|made| made.builds).sum();
                let steps = entry.length.steps * seconds.len() as u64;
                let mut run = Timed {
                    fluid: entry.subject.name,
                    size: entry.size,
                    code: entry.contender.id(),
                    particles,
                    pairs_per_particle: case.pairs,
                    ranks: entry.contender.ranks,
                    threads: entry.contender.threads(),
                    precision: entry.contender.precision(),
                    instructions: settings.map(|s| s.instructions.to_string()),
                    skin: entry.contender.in_lammps().then_some(entry.skin),
                    steps: entry.length.steps,
                    seconds,
                    mega_particle_steps_per_second: Spread::default(),
                    nanoseconds_per_particle_step: per_particle,
                    nanoseconds_per_pair: per_particle / case.pairs,
                    ratio_to_built_in: None,
                    parts: names.map(part).collect(),
                    ghosts: in_lammps.map(|made| made.ghosts),
                    steps_between_builds: in_lammps.map(|_| steps as f64 / builds.max(1) as f64),
                };
                run.mega_particle_steps_per_second = Spread::of(&run.rates()).unwrap_or_default();
                run
            })
            .collect();
        let ratios: Vec<Option<Spread>> = runs
            .iter()
            .zip(entries)
            .map(|(run, entry)| {
                let reference = contender::reference(&entry.subject)?.id();
                let same = |r: &&Timed| r.fluid == run.fluid && r.size == run.size && r.code == reference;
                Spread::of_ratios(&run.rates(), &runs.iter().find(same)?.rates())
            })
            .collect();
        for (run, ratio) in runs.iter_mut().zip(ratios) {
            run.ratio_to_built_in = ratio;
        }
        runs
    }

    fn equal_bits(&self) -> Result<BTreeMap<String, bool>, ExperimentError> {
        let smallest = self.asked.sizes.iter().min().copied().unwrap_or_default();
        let threads = [1, 2, 3].map(|n| NonZeroUsize::new(n).unwrap_or(NonZeroUsize::MIN));
        let mut equal = BTreeMap::new();
        for subject in SUBJECTS.iter().chain(&MIXTURES) {
            let Some(case) = self.cases.get(&(subject.name, smallest)) else { continue };
            for (name, precision) in Precision::ALL {
                let settings = Settings { precision, ..Settings::default() };
                let same = native::equal_on_threads(subject, &case.start.state, settings, &threads)?;
                equal.insert(format!("{} {name}", subject.name), same);
            }
        }
        Ok(equal)
    }
}

/// The fluids that are timed at a size: mixtures of particle sizes at the smallest alone, if the box is twice as wide as their ranges.
fn subjects(size: usize, smallest: bool) -> Result<Vec<Subject>, ExperimentError> {
    let mut subjects = SUBJECTS.to_vec();
    for mixture in MIXTURES.into_iter().filter(|_| smallest) {
        let range = mixture.model()?.at(1.0).map_err(ExperimentError::File)?.cutoff();
        subjects.extend((Subject::edge(size) >= 2.0 * range).then_some(mixture));
    }
    Ok(subjects)
}

fn scaling(runs: &[Timed], entries: &[Entry], slope_width: usize) -> Vec<Scaling> {
    let of = |(run, entry): (&Timed, &Entry)| {
        let alone = Contender { ranks: 1, weak: false, ..entry.contender.clone() };
        let same = |r: &&Timed| r.fluid == run.fluid && r.size == run.size && r.code == alone.id();
        let speed_up = Spread::of_ratios(&run.rates(), &runs.iter().find(same)?.rates())?;
        let ranks = run.ranks as f64;
        let plugin = entry.contender.code == Code::Psi;
        let Spread { min, median, max } = speed_up;
        Some(Scaling {
            code: alone.id(),
            kind: if entry.contender.weak { "weak" } else { "strong" },
            size: run.size,
            ranks: run.ranks,
            speed_up,
            efficiency: Spread { min: min / ranks, median: median / ranks, max: max / ranks },
            ghosts: run.ghosts?,
            bytes_per_step: plugin.then_some(run.ghosts? * bytes_per_ghost(slope_width)),
            communication_microseconds: 1e-3 * run.parts.get("comm")? * run.particles as f64,
        })
    };
    runs.iter().zip(entries).filter(|(run, _)| run.ranks > 1).filter_map(of).collect()
}

/// Bytes that LAMMPS sends for a ghost in a step: positions and velocities forward, slopes of ψ forward,
/// forces back.
fn bytes_per_ghost(slope_width: usize) -> f64 {
    (6 + slope_width + 3) as f64 * 8.0
}

fn facts(subject: &Subject) -> Result<FluidFacts, ExperimentError> {
    let Subject { name, title, density, dt, .. } = *subject;
    let plan = Plan::new(&subject.model()?.at(1.0)?).map_err(|e| ExperimentError::Run(e.into()))?;
    Ok(FluidFacts { name, title, density, dt, slope_width: plan.slope_width() })
}

/// Instruction sets better than the one that the engine takes, each with what the processor lacks for it.
fn better() -> Vec<String> {
    Instructions::ALL
        .into_iter()
        .filter(|(_, i)| !i.available())
        .map(|(name, i)| format!("{name} needs {}, which this processor lacks", i.missing().join(", ")))
        .collect()
}

/// The system's mean number of busy processes over a minute.
fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}
