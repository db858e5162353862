//! The goals, as data, and what was measured against them.

use super::BenchError;
use super::memory::Memory;
use super::outcome::{Run, Verdict};
use super::spread::Spread;
use psidpd_core::engine::Instructions;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The table that ships.
pub const SHIPPED: &str = include_str!("goals.toml");

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    goal: Vec<Goal>,
}

/// One goal; see `goals.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
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

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
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

/// Reads a table of goals.
///
/// # Errors
/// It is no table, or a goal has no bound, or two.
pub fn read(text: &str) -> Result<Vec<Goal>, BenchError> {
    let file: File = toml::from_str(text).map_err(|e| BenchError::Goals(e.to_string()))?;
    for goal in &file.goal {
        if goal.at_least.is_some() == goal.at_most.is_some() {
            return Err(BenchError::Goals(format!("{}: one of at_least and at_most", goal.what)));
        }
    }
    Ok(file.goal)
}

/// What goals are held against.
#[derive(Debug, Clone, Copy)]
pub struct Measurements<'a> {
    /// Runs.
    pub runs: &'a [Run],
    /// Memory.
    pub memory: &'a [Memory],
    /// Equality of results, by fluid and precision.
    pub equal_bits: &'a BTreeMap<String, bool>,
}

impl Goal {
    /// Holds what was measured against the goal.
    pub fn judge(&self, measured: Measurements) -> Verdict {
        let by_size = self.by_size(measured);
        let (relation, goal) = match (self.at_least, self.at_most) {
            (Some(goal), _) => ("at least", goal),
            (None, goal) => ("at most", goal.unwrap_or(f64::NAN)),
        };
        let least = self.at_least.is_some();
        let reaches = |median: f64, bound: f64| if least { median >= bound } else { median <= bound };
        let order = |a: &&Spread, b: &&Spread| a.median.total_cmp(&b.median);
        let worst = if least { by_size.values().min_by(order) } else { by_size.values().max_by(order) };
        let figure = worst.copied();
        Verdict {
            what: self.what.clone(),
            relation,
            goal,
            stretch: self.stretch,
            figure,
            met: figure.map(|f| reaches(f.median, goal)),
            stretch_met: figure.zip(self.stretch).map(|(f, stretch)| reaches(f.median, stretch)),
            not_measured: self.sizes.iter().copied().filter(|s| !by_size.contains_key(s)).collect(),
            by_size,
        }
    }

    fn by_size(&self, measured: Measurements) -> BTreeMap<usize, Spread> {
        match self.quantity {
            Quantity::Speed | Quantity::SpeedPerPair => {
                let of = |size: usize| Some((size, self.speed(measured.runs, size)?));
                self.sizes.iter().filter_map(|s| of(*s)).collect()
            }
            Quantity::Memory => {
                let memory = measured.memory.iter().filter(|m| self.sizes.contains(&m.particles));
                memory.filter_map(|m| Some((m.particles, Spread::of(&[m.bytes_per_particle])?))).collect()
            }
            Quantity::EqualBits => {
                let all = measured.equal_bits.values().all(|equal| *equal);
                let any = !measured.equal_bits.is_empty();
                let number = Spread::of(&[f64::from(u8::from(all))]);
                number.filter(|_| any).map(|n| (0, n)).into_iter().collect()
            }
        }
    }

    fn speed(&self, runs: &[Run], size: usize) -> Option<Spread> {
        let find = |fluid: &str, size: usize, code: &str| {
            let code = code.replace(" best ", &format!(" {} ", Instructions::best()));
            runs.iter().find(|r| r.fluid == fluid && r.size == size && r.code == code)
        };
        let rates = |run: &Run| -> Vec<f64> {
            let weight = if self.quantity == Quantity::SpeedPerPair { run.pairs_per_particle } else { 1.0 };
            run.rates().iter().map(|r| r * weight).collect()
        };
        let own = rates(find(&self.fluid, size, &self.code)?);
        let fluid = self.against_fluid.as_deref().unwrap_or(&self.fluid);
        let others: Vec<Vec<f64>> = self
            .against
            .iter()
            .filter_map(|code| find(fluid, self.against_size.unwrap_or(size), code))
            .map(rates)
            .collect();
        let best: Vec<f64> = (0..own.len())
            .map(|round| others.iter().filter_map(|o| o.get(round)).copied().fold(f64::NAN, f64::max))
            .collect();
        Spread::of_ratios(&own, &best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(fluid: &'static str, size: usize, code: &str, seconds: &[f64], pairs: f64) -> Run {
        Run {
            fluid,
            size,
            code: code.replace(" best ", &format!(" {} ", Instructions::best())),
            particles: size,
            pairs_per_particle: pairs,
            ranks: 1,
            threads: 1,
            precision: None,
            instructions: None,
            skin: None,
            steps: 10,
            seconds: seconds.to_vec(),
            mega_particle_steps_per_second: Spread { min: 0.0, median: 0.0, max: 0.0 },
            nanoseconds_per_particle_step: 0.0,
            nanoseconds_per_pair: 0.0,
            ratio_to_built_in: None,
            parts: BTreeMap::new(),
            ghosts: None,
            steps_between_builds: None,
        }
    }

    fn goal(quantity: &str, rest: &str) -> Goal {
        let text = format!("[[goal]]\nwhat = \"x\"\nquantity = \"{quantity}\"\n{rest}");
        read(&text).unwrap().remove(0)
    }

    fn judge(goal: &Goal, runs: &[Run]) -> Verdict {
        goal.judge(Measurements { runs, memory: &[], equal_bits: &BTreeMap::new() })
    }

    #[test]
    fn the_shipped_table_is_read() {
        let goals = read(SHIPPED).unwrap();
        assert_eq!(goals.len(), 11);
        assert!(goals.iter().all(|g| judge(g, &[]).met.is_none()), "nothing was measured");
    }

    /// Goals and the choice of contenders fit together at the sizes of `--full`: everyone a goal names is timed.
    #[test]
    fn whom_goals_name_is_timed_at_their_sizes() {
        use crate::bench::contender::{Choice, FEW_ABOVE, Field, Suffix, contenders};
        use crate::bench::fluids::{SIZES, SUBJECTS};
        let choice = Choice {
            built_in: true,
            eam: true,
            suffixes: vec![Suffix::None, Suffix::Omp, Suffix::Intel],
            two_ranks: true,
            words: vec![],
            threads: [1, 2].map(|n| std::num::NonZeroUsize::new(n).unwrap()).to_vec(),
        };
        let timed = |fluid: &str, size: usize, code: &str| {
            let subject = SUBJECTS.iter().find(|s| s.name == fluid).unwrap();
            let field = Field::of(size, size == SIZES[0], FEW_ABOVE);
            let code = code.replace(" best ", &format!(" {} ", Instructions::best()));
            SIZES.contains(&size) && contenders(subject, &choice, field).iter().any(|c| c.id() == code)
        };
        // Not every processor has AVX2.
        let portable = |code: &str| code.replace(" avx2 ", " portable ");
        for goal in read(SHIPPED).unwrap() {
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

    /// The worst size counts, and of the others the fastest in each round.
    #[test]
    fn speed_is_held_against_the_fastest_at_the_worst_size() {
        let goal = goal(
            "speed",
            "fluid = \"dpd\"\nsizes = [10, 20]\ncode = \"native mixed best 1\"\n\
             against = [\"a\", \"b\", \"absent\"]\nat_least = 2\nstretch = 4",
        );
        let mut runs = vec![
            run("dpd", 10, "native mixed best 1", &[1.0, 1.0, 1.0], 1.0),
            run("dpd", 10, "a", &[6.0, 3.0, 6.0], 1.0),
            run("dpd", 10, "b", &[3.0, 6.0, 4.0], 1.0),
        ];
        let verdict = judge(&goal, &runs);
        assert_eq!((verdict.met, verdict.not_measured), (Some(true), vec![20]), "one size is missing");
        assert_eq!(verdict.by_size[&10], Spread { min: 3.0, median: 3.0, max: 4.0 });
        runs.push(run("dpd", 20, "native mixed best 1", &[1.0; 3], 1.0));
        runs.push(run("dpd", 20, "b", &[5.0; 3], 1.0));
        let verdict = judge(&goal, &runs);
        assert_eq!((verdict.met, verdict.stretch_met), (Some(true), Some(false)));
        assert!(verdict.not_measured.is_empty());
        assert_eq!(verdict.figure.unwrap().median, 3.0);
        runs[1].seconds = vec![1.5; 3];
        assert_eq!(judge(&goal, &runs).met, Some(false));
    }

    #[test]
    fn per_pair_and_across_sizes() {
        let pairs = goal(
            "speed per pair",
            "fluid = \"formula\"\nsizes = [10]\ncode = \"c\"\nagainst = [\"c\"]\nagainst_fluid = \"mdpd\"\nat_least = 0.6",
        );
        // Twice the time for twice the pairs is as fast.
        let runs = [run("formula", 10, "c", &[2.0], 20.0), run("mdpd", 10, "c", &[1.0], 10.0)];
        assert_eq!(judge(&pairs, &runs).figure.unwrap().median, 1.0);
        let sizes = goal(
            "speed",
            "fluid = \"mdpd\"\nsizes = [40]\ncode = \"c\"\nagainst = [\"c\"]\nagainst_size = 10\nat_least = 0.8",
        );
        let runs = [run("mdpd", 40, "c", &[5.0], 1.0), run("mdpd", 10, "c", &[1.0], 1.0)];
        assert_eq!(judge(&sizes, &runs).met, Some(true), "0.8 of the speed");
        assert_eq!(judge(&sizes, &runs[..1]).met, None, "nothing to hold it against");
        // A round in which all is half as fast changes nothing; rounds are not mixed.
        let runs = [run("mdpd", 40, "c", &[5.0, 10.0], 1.0), run("mdpd", 10, "c", &[1.0, 2.0], 1.0)];
        assert_eq!(judge(&sizes, &runs).figure, Some(Spread { min: 0.8, median: 0.8, max: 0.8 }));
    }

    #[test]
    fn memory_and_equality() {
        let memory = |bytes| {
            [Memory {
                particles: 100,
                peak_bytes: 0,
                bytes_per_particle: bytes,
                engine_bytes_per_particle: 0.0,
            }]
        };
        let most = goal("memory", "sizes = [100]\nat_most = 300");
        let bits = goal("equal bits", "at_least = 1");
        for (bytes, equal) in [(299.0, true), (301.0, false)] {
            let equal_bits =
                BTreeMap::from([("mdpd mixed".to_owned(), true), ("dpd mixed".to_owned(), equal)]);
            let memory = memory(bytes);
            let measured = Measurements { runs: &[], memory: &memory, equal_bits: &equal_bits };
            assert_eq!(most.judge(measured).met, Some(equal));
            assert_eq!(bits.judge(measured).met, Some(equal));
        }
    }

    #[test]
    fn what_is_no_goal_is_refused() {
        for text in ["goal = 1", "[[goal]]\nwhat = \"x\"\nquantity = \"beauty\"\nat_least = 1"] {
            assert!(matches!(read(text), Err(BenchError::Goals(_))));
        }
        for bounds in ["", "at_least = 1\nat_most = 2", "at_least = 1\nhope = 2"] {
            let text = format!("[[goal]]\nwhat = \"x\"\nquantity = \"memory\"\n{bounds}");
            assert!(matches!(read(&text), Err(BenchError::Goals(_))));
        }
    }
}
