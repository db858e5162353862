//! The project's goals for speed and memory, `goals.toml`, compared with the results of `psidpd bench`:
//!
//! ```sh
//! cargo test --release -p psidpd --test goals -- --ignored --nocapture
//! ```
//!
//! This command reads `target/bench/bench.json`, or the file that `PSIDPD_BENCH` names.

use psidpd::bench::Spread;
use psidpd::report::Table;
use psidpd_core::engine::Instructions;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

const SHIPPED: &str = include_str!("goals.toml");

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Goals {
    goal: Vec<Goal>,
}

/// A goal of `goals.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Goal {
    what: String,
    quantity: Quantity,
    #[serde(default)]
    fluid: String,
    #[serde(default)]
    sizes: Vec<usize>,
    #[serde(default)]
    code: String,
    #[serde(default)]
    against: Vec<String>,
    against_fluid: Option<String>,
    against_size: Option<usize>,
    at_least: Option<f64>,
    at_most: Option<f64>,
    stretch: Option<f64>,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
enum Quantity {
    #[serde(rename = "speed")]
    Speed,
    #[serde(rename = "speed per pair")]
    SpeedPerPair,
    #[serde(rename = "memory")]
    Memory,
    #[serde(rename = "equal bits")]
    EqualBits,
}

/// The part of `bench.json` that goals need.
#[derive(Default, Deserialize)]
struct Bench {
    runs: Vec<Run>,
    memory: Vec<Memory>,
    equal_bits: BTreeMap<String, bool>,
}

#[derive(Deserialize)]
struct Run {
    fluid: String,
    size: usize,
    code: String,
    particles: usize,
    pairs_per_particle: f64,
    steps: u64,
    seconds: Vec<f64>,
}

#[derive(Deserialize)]
struct Memory {
    particles: usize,
    bytes_per_particle: f64,
}

fn read(text: &str) -> Vec<Goal> {
    let goals = toml::from_str::<Goals>(text).unwrap().goal;
    for goal in &goals {
        assert!(goal.at_least.is_some() != goal.at_most.is_some(), "{}: at_least or at_most", goal.what);
    }
    goals
}

/// The name of a code, with `best` replaced by the best instruction set of this machine.
fn named(code: &str) -> String {
    code.replace(" best ", &format!(" {} ", Instructions::best()))
}

impl Goal {
    /// The measured values by size; 0 stands for goals without a size.
    fn by_size(&self, bench: &Bench) -> BTreeMap<usize, Spread> {
        match self.quantity {
            Quantity::Speed | Quantity::SpeedPerPair => {
                let of = |size: usize| Some((size, self.speed(&bench.runs, size)?));
                self.sizes.iter().filter_map(|s| of(*s)).collect()
            }
            Quantity::Memory => {
                let memory = bench.memory.iter().filter(|m| self.sizes.contains(&m.particles));
                memory.filter_map(|m| Some((m.particles, Spread::of(&[m.bytes_per_particle])?))).collect()
            }
            Quantity::EqualBits if bench.equal_bits.is_empty() => BTreeMap::new(),
            Quantity::EqualBits => {
                let all = bench.equal_bits.values().all(|equal| *equal);
                Spread::of(&[f64::from(u8::from(all))]).map(|n| (0, n)).into_iter().collect()
            }
        }
    }

    fn speed(&self, runs: &[Run], size: usize) -> Option<Spread> {
        let find = |fluid: &str, size: usize, code: &str| {
            runs.iter().find(|r| r.fluid == fluid && r.size == size && r.code == named(code))
        };
        let rates = |run: &Run| -> Vec<f64> {
            let weight = if self.quantity == Quantity::SpeedPerPair { run.pairs_per_particle } else { 1.0 };
            run.seconds.iter().map(|s| weight * run.particles as f64 * run.steps as f64 / s).collect()
        };
        let own = rates(find(&self.fluid, size, &self.code)?);
        let fluid = self.against_fluid.as_deref().unwrap_or(&self.fluid);
        let size = self.against_size.unwrap_or(size);
        let others: Vec<_> = self.against.iter().filter_map(|c| find(fluid, size, c)).map(rates).collect();
        let best: Vec<f64> = (0..own.len())
            .map(|round| others.iter().filter_map(|o| o.get(round)).copied().fold(f64::NAN, f64::max))
            .collect();
        Spread::of_ratios(&own, &best)
    }

    /// The worst value of the measured sizes.
    fn worst(&self, bench: &Bench) -> Option<f64> {
        let medians = self.by_size(bench).into_values().map(|s| s.median);
        medians.reduce(if self.at_least.is_some() { f64::min } else { f64::max })
    }

    /// Whether the worst size meets the goal; `None` without a measurement.
    fn met(&self, bench: &Bench) -> Option<bool> {
        let worst = self.worst(bench)?;
        Some(
            self.at_least.is_none_or(|bound| worst >= bound)
                && self.at_most.is_none_or(|bound| worst <= bound),
        )
    }
}

/// On an idle machine a goal that is missed at a measured size fails.
#[test]
#[ignore = "reads what `psidpd bench` measured"]
fn the_last_bench_meets_its_goals() {
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/bench/bench.json");
    let path = std::env::var_os("PSIDPD_BENCH").map_or_else(|| shipped.into(), PathBuf::from);
    let bench: Bench = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mut table = Table::new(["", "goal", "wanted", "stretch", "measured"]);
    for goal in read(SHIPPED) {
        let by_size = goal.by_size(&bench);
        let shown = |size: &usize| match by_size.get(size) {
            Some(s) => format!("{size}: {:.2} ({:.2}–{:.2})", s.median, s.min, s.max),
            None => format!("not at {size}"),
        };
        let met = goal.met(&bench).map_or("not measured", |met| if met { "pass" } else { "FAIL" });
        let bound = goal.at_least.or(goal.at_most).unwrap_or(f64::NAN);
        let wanted = format!("{} {bound}", if goal.at_least.is_some() { "≥" } else { "≤" });
        let stretch = goal.stretch.map_or_else(String::new, |s| s.to_string());
        let measured = goal.sizes.iter().map(shown).collect::<Vec<_>>().join("; ");
        table.push([met.to_owned(), goal.what, wanted, stretch, measured]);
    }
    println!("{}", table.to_text());
    assert!(table.rows.iter().all(|row| row[0] != "FAIL"), "goals are missed");
}

fn run(fluid: &str, size: usize, code: &str, seconds: &[f64], pairs: f64) -> Run {
    Run {
        fluid: fluid.into(),
        size,
        code: named(code),
        particles: size,
        pairs_per_particle: pairs,
        steps: 10,
        seconds: seconds.to_vec(),
    }
}

fn goal(quantity: &str, rest: &str) -> Goal {
    read(&format!("[[goal]]\nwhat = \"x\"\nquantity = \"{quantity}\"\n{rest}")).remove(0)
}

fn timed(runs: impl Into<Vec<Run>>) -> Bench {
    Bench { runs: runs.into(), ..Bench::default() }
}

#[test]
fn nothing_is_met_that_was_not_measured() {
    let goals = read(SHIPPED);
    assert_eq!(goals.len(), 11);
    assert!(goals.iter().all(|g| g.met(&Bench::default()).is_none()));
}

/// Every code that a goal names is timed at the sizes of `--full`.
#[test]
fn whom_goals_name_is_timed_at_their_sizes() {
    use psidpd::bench::contender::{Choice, FEW_ABOVE, Field, contenders};
    use psidpd::experiments::code::Suffix;
    use psidpd::experiments::fluids::{SIZES, SUBJECTS};
    let choice = Choice {
        built_in: true,
        eam: true,
        suffixes: Suffix::ALL.to_vec(),
        two_ranks: true,
        words: vec![],
        threads: [1, 2].map(|n| std::num::NonZeroUsize::new(n).unwrap()).to_vec(),
    };
    let timed = |fluid: &str, size: usize, code: &str| {
        let subject = SUBJECTS.iter().find(|s| s.name == fluid).unwrap();
        let field = Field::of(size, size == SIZES[0], true, FEW_ABOVE);
        let code = named(code);
        SIZES.contains(&size) && contenders(subject, &choice, field).iter().any(|c| c.id() == code)
    };
    // Some processors have no AVX2.
    let portable = |code: &str| code.replace(" avx2 ", " portable ");
    for goal in read(SHIPPED) {
        if !matches!(goal.quantity, Quantity::Speed | Quantity::SpeedPerPair) {
            continue;
        }
        for &size in &goal.sizes {
            assert!(timed(&goal.fluid, size, &portable(&goal.code)), "{}: {size}", goal.what);
            let fluid = goal.against_fluid.as_deref().unwrap_or(&goal.fluid);
            let size = goal.against_size.unwrap_or(size);
            for code in &goal.against {
                assert!(timed(fluid, size, code), "{}: {code} at {size}", goal.what);
            }
        }
    }
}

/// The worst size counts, and of the other codes the fastest in each round.
#[test]
fn speed_is_held_against_the_fastest_at_the_worst_size() {
    let goal = goal(
        "speed",
        "fluid = \"dpd\"\nsizes = [10, 20]\ncode = \"native mixed best 1\"\n\
         against = [\"a\", \"b\", \"absent\"]\nat_least = 2\nstretch = 4",
    );
    let mut bench = timed([
        run("dpd", 10, "native mixed best 1", &[1.0, 1.0, 1.0], 1.0),
        run("dpd", 10, "a", &[6.0, 3.0, 6.0], 1.0),
        run("dpd", 10, "b", &[3.0, 6.0, 4.0], 1.0),
    ]);
    assert_eq!(goal.met(&bench), Some(true), "one size is missing");
    assert_eq!(goal.by_size(&bench)[&10], Spread { min: 3.0, median: 3.0, max: 4.0 });
    bench.runs.push(run("dpd", 20, "native mixed best 1", &[1.0; 3], 1.0));
    bench.runs.push(run("dpd", 20, "b", &[5.0; 3], 1.0));
    assert_eq!((goal.worst(&bench), goal.met(&bench)), (Some(3.0), Some(true)));
    bench.runs[1].seconds = vec![1.5; 3];
    assert_eq!(goal.met(&bench), Some(false));
}

#[test]
fn per_pair_and_across_sizes() {
    let pairs = goal(
        "speed per pair",
        "fluid = \"formula\"\nsizes = [10]\ncode = \"c\"\nagainst = [\"c\"]\nagainst_fluid = \"mdpd\"\nat_least = 0.6",
    );
    // Twice the time for twice the pairs is equal speed per pair.
    let bench = timed([run("formula", 10, "c", &[2.0], 20.0), run("mdpd", 10, "c", &[1.0], 10.0)]);
    assert_eq!(pairs.worst(&bench), Some(1.0));
    let sizes = goal(
        "speed",
        "fluid = \"mdpd\"\nsizes = [40]\ncode = \"c\"\nagainst = [\"c\"]\nagainst_size = 10\nat_least = 0.8",
    );
    let mut bench = timed([run("mdpd", 40, "c", &[5.0], 1.0), run("mdpd", 10, "c", &[1.0], 1.0)]);
    assert_eq!(sizes.met(&bench), Some(true), "0.8 of the speed");
    bench.runs.pop();
    assert_eq!(sizes.met(&bench), None, "nothing to hold it against");
    // A round at half the speed for all codes changes nothing; rounds are not mixed.
    let bench = timed([run("mdpd", 40, "c", &[5.0, 10.0], 1.0), run("mdpd", 10, "c", &[1.0, 2.0], 1.0)]);
    assert_eq!(sizes.by_size(&bench)[&40], Spread { min: 0.8, median: 0.8, max: 0.8 });
}

#[test]
fn memory_and_equality() {
    let most = goal("memory", "sizes = [100]\nat_most = 300");
    let bits = goal("equal bits", "at_least = 1");
    for (bytes, equal) in [(299.0, true), (301.0, false)] {
        let bench = Bench {
            runs: vec![],
            memory: vec![Memory { particles: 100, bytes_per_particle: bytes }],
            equal_bits: BTreeMap::from([("mdpd mixed".into(), true), ("dpd mixed".into(), equal)]),
        };
        assert_eq!((most.met(&bench), bits.met(&bench)), (Some(equal), Some(equal)));
    }
}
