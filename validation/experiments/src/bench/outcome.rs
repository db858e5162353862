//! What the benchmark found: the fields of `bench.json`, which `docs/bench.md` describes.

use super::memory::Memory;
use super::spread::Spread;
use serde::Serialize;
use std::collections::BTreeMap;

#[derive(Debug, Clone, Serialize)]
pub struct Benchmark {
    /// Changes when fields change their meaning.
    pub format: u32,
    pub version: &'static str,
    pub machine: Machine,
    pub lammps: LammpsFacts,
    pub options: Asked,
    pub fluids: Vec<FluidFacts>,
    /// Every contender with every fluid and size.
    pub runs: Vec<Timed>,
    pub scaling: Vec<Scaling>,
    pub memory: Vec<Memory>,
    /// Whether results are the same on 1, 2 and 3 threads, to the last bit: by fluid and precision.
    pub equal_bits: BTreeMap<String, bool>,
}

#[derive(Debug, Clone, Serialize)]
pub struct Machine {
    pub processor: String,
    /// How many cores this process may use.
    pub cores: usize,
    /// Instruction sets that the engine has kernels for and the processor has, the best last.
    pub instructions: Vec<String>,
    /// The other instruction sets, each with what the processor lacks for it.
    pub better: Vec<String>,
    /// Gigahertz of the processor's time stamp counter, which cycles are counted by.
    pub gigahertz: Option<f64>,
    /// Processes that were running or waiting when the benchmark began, by the system's mean over a minute; above
    /// a few tenths figures are not to be trusted.
    pub load: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
pub struct LammpsFacts {
    pub version: String,
    /// Styles that were wanted and that it does not have.
    pub missing: Vec<String>,
}

#[derive(Debug, Clone, Serialize)]
pub struct Asked {
    /// Particles of the many-body fluid in the boxes.
    pub sizes: Vec<usize>,
    pub rounds: usize,
    /// Seconds that a timed run may take, if that is enough for the fewest steps.
    pub seconds: f64,
    /// Steps of every run, and no skin is looked for; null if they follow from `seconds`.
    pub steps: Option<u64>,
    /// Size above which only the contenders of [`Field::Few`](super::contender::Field::Few) are timed.
    pub few_above: usize,
    /// Whether every code is timed in boxes up to that, not only those of a user.
    pub every_code: bool,
    pub seed: u64,
}

#[derive(Debug, Clone, Serialize)]
pub struct FluidFacts {
    pub name: &'static str,
    pub title: &'static str,
    pub density: f64,
    pub dt: f64,
    /// Many-body numbers that a host forwards from a particle to its ghosts.
    pub slope_width: usize,
}

#[derive(Debug, Clone, Serialize)]
pub struct Timed {
    pub fluid: &'static str,
    /// Particles of the many-body fluid in the box before it was repeated.
    pub size: usize,
    pub code: String,
    pub particles: usize,
    /// Pairs closer than the longest range, per particle.
    pub pairs_per_particle: f64,
    pub ranks: usize,
    pub threads: usize,
    /// The precision of the native runner, and of the plugin where it was told.
    pub precision: Option<String>,
    pub instructions: Option<String>,
    /// The skin of LAMMPS's lists: the fastest of those tried.
    pub skin: Option<f64>,
    /// Steps in each round.
    pub steps: u64,
    /// Wall seconds of each round.
    pub seconds: Vec<f64>,
    pub mega_particle_steps_per_second: Spread,
    /// Nanoseconds per particle and step: the median.
    pub nanoseconds_per_particle_step: f64,
    /// Nanoseconds per pair in range and step: the median.
    pub nanoseconds_per_pair: f64,
    /// Rate over that of the built-in of the fluid in the same round; null for fluids that LAMMPS does not have.
    pub ratio_to_built_in: Option<Spread>,
    /// Nanoseconds per particle and step of each part: the median.
    pub parts: BTreeMap<String, f64>,
    /// Ghosts of a rank; of LAMMPS.
    pub ghosts: Option<f64>,
    /// Steps between exchanges of particles, the mean; of LAMMPS.
    pub steps_between_builds: Option<f64>,
}

impl Timed {
    /// Millions of particle-steps per second in each round.
    pub fn rates(&self) -> Vec<f64> {
        self.seconds.iter().map(|s| 1e-6 * self.particles as f64 * self.steps as f64 / s).collect()
    }
}

#[derive(Debug, Clone, Serialize)]
pub struct Scaling {
    pub code: String,
    /// `strong`: the same box; `weak`: a box for each rank.
    pub kind: &'static str,
    /// Particles of the box of one rank.
    pub size: usize,
    pub ranks: usize,
    pub speed_up: Spread,
    pub efficiency: Spread,
    pub ghosts: f64,
    /// Bytes that a rank sends in a step for its ghosts, computed: positions, velocities, slopes, forces.
    pub bytes_per_step: Option<f64>,
    /// Microseconds of a step in LAMMPS's communication, the mean over ranks.
    pub communication_microseconds: f64,
}
