//! Where time goes: to the settings by which the recommendation is decided.
//!
//! Every look sorts the settings: within all tolerances, beyond one, or open. A setting beyond is dropped, and so is one that costs
//! more than the cheapest within. What remains is sampled on. The race is over when nothing cheaper than the cheapest setting
//! within is open.
//!
//! Many settings are looked at many times, and the best of them is chosen: where each error counted with two standard deviations,
//! some setting would be taken for good, or dropped, by chance. [`Rule`] widens them so that a race goes wrong in one of 20.

use super::quantity::Deviation;
use super::tolerance::Tolerance;
use psidpd_observe::threshold;

/// How often races go wrong.
pub const ALARM: f64 = 0.05;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// All errors are within their tolerances.
    Within,
    Open,
    /// An error is larger than its tolerance, or the run stopped.
    Beyond,
}

/// What is asked of errors, and by how many of their standard deviations they are widened.
#[derive(Debug, Clone)]
pub struct Rule<'a> {
    pub tolerances: &'a [Tolerance],
    margin: f64,
}

impl Rule<'_> {
    /// The rule for a number of settings, each judged by a number of quantities at each of a number of looks.
    pub fn new(tolerances: &[Tolerance], settings: usize, quantities: usize, looks: usize) -> Rule<'_> {
        Rule { tolerances, margin: threshold((settings * quantities * looks).max(1), ALARM) }
    }

    /// Standard deviations that errors are widened by.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    pub fn standing(&self, errors: &[Deviation]) -> Standing {
        let bound: Vec<(&Deviation, f64)> = self
            .tolerances
            .iter()
            .flat_map(|t| errors.iter().filter(|d| t.applies(d)).map(|d| (d, t.bound)))
            .collect();
        let is_measured = |t: &Tolerance| errors.iter().any(|d| t.applies(d));
        if bound.iter().any(|(d, most)| d.value.abs() - self.margin * d.error > *most) {
            return Standing::Beyond;
        }
        let all = !bound.is_empty() && self.tolerances.iter().all(is_measured);
        let within = bound.iter().all(|(d, most)| d.value.abs() + self.margin * d.error <= *most);
        if all && within { Standing::Within } else { Standing::Open }
    }
}

/// The open settings that are cheaper than the cheapest one within: those that may still be recommended. Nothing is cheaper than
/// itself, and what has no cost is never recommended.
pub fn contenders(costs: &[Option<f64>], standings: &[Standing]) -> Vec<usize> {
    let cost = |k: usize| costs[k].unwrap_or(f64::INFINITY);
    let of = |standing: Standing| (0..costs.len()).filter(move |k| standings[*k] == standing);
    let cheapest = of(Standing::Within).map(cost).fold(f64::INFINITY, f64::min);
    of(Standing::Open).filter(|k| cost(*k) < cheapest).collect()
}

/// Shares of a round's time for so many settings and for the reference, which is in the errors of all: the sum of the variances
/// s/t + s/t₀ of `open` settings is least for t₀ = t √open.
pub fn shares(open: usize) -> [f64; 2] {
    let all = open as f64 + (open as f64).sqrt();
    if open == 0 { [0.0, 0.0] } else { [1.0 / all, (open as f64).sqrt() / all] }
}

/// Samples on, round after round, until the recommendation is decided or the time is over. `look` gives the errors of every setting,
/// none where it stopped, `more` samples some of them on, in that round of so many, and says whether there is time for another.
///
/// # Errors
/// Fails if `more` fails.
pub fn race<S, E>(
    state: &mut S,
    rule: &Rule,
    costs: &[Option<f64>],
    rounds: usize,
    look: impl Fn(&S) -> Vec<Option<Vec<Deviation>>>,
    mut more: impl FnMut(&mut S, &[usize], usize) -> Result<bool, E>,
) -> Result<Vec<Standing>, E> {
    let sorted = |state: &S, before: &[Standing]| -> Vec<Standing> {
        let now = look(state);
        let sort = |k: usize| match (&now[k], before.get(k)) {
            (None, _) => Standing::Beyond,
            // A verdict stands: looks that may reverse it would need a wider margin.
            (Some(_), Some(Standing::Beyond)) => Standing::Beyond,
            (Some(errors), _) => rule.standing(errors),
        };
        (0..now.len()).map(sort).collect()
    };
    let mut standings = sorted(state, &[]);
    for round in 0..rounds {
        let open = contenders(costs, &standings);
        if open.is_empty() || !more(state, &open, round)? {
            break;
        }
        standings = sorted(state, &standings);
    }
    Ok(standings)
}

#[cfg(test)]
mod tests {
    use super::super::quantity::Class;
    use super::*;
    use chacha20::ChaCha8Rng;
    use psidpd_observe::Measured;
    use rand::{RngExt, SeedableRng};

    /// An energy that is off.
    fn off(value: f64, error: f64) -> Vec<Deviation> {
        vec![Deviation::new(Class::Energy, "u", Measured { value, error }, value, error)]
    }

    /// A code whose energy is off by what is known, and whose unit of time costs what is known. One sample scatters by one; errors
    /// are those of the mean.
    struct Fake {
        off: f64,
        cost: f64,
        samples: f64,
        sum: f64,
    }

    impl Fake {
        fn new(&(off, cost): &(f64, f64)) -> Fake {
            Fake { off, cost, samples: 0.0, sum: 0.0 }
        }

        /// `n` samples at once: their sum is as normal as twelve uniform numbers.
        fn sample(&mut self, n: f64, random: &mut ChaCha8Rng) {
            let noise: f64 = (0..12).map(|_| random.random::<f64>() - 0.5).sum();
            self.sum += n * self.off + n.sqrt() * noise;
            self.samples += n;
        }

        fn errors(&self) -> Vec<Deviation> {
            off(self.sum / self.samples, self.samples.powf(-0.5))
        }
    }

    /// What a race of fakes ends with, and how many samples each had.
    fn end(fakes: &[(f64, f64)], rounds: usize, seed: u64) -> (Vec<Standing>, Vec<f64>, Vec<usize>) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut state: Vec<Fake> = fakes.iter().map(Fake::new).collect();
        state.iter_mut().for_each(|fake| fake.sample(10_000.0, &mut random));
        let tolerances = ["u=1%".parse().unwrap()];
        let rule = Rule::new(&tolerances, fakes.len(), 1, rounds + 1);
        let costs: Vec<Option<f64>> = state.iter().map(|fake| Some(fake.cost)).collect();
        let look = |state: &Vec<Fake>| state.iter().map(|fake| Some(fake.errors())).collect();
        let standings = race(&mut state, &rule, &costs, rounds, look, |state, open, _| {
            open.iter().for_each(|k| state[*k].sample(400_000.0 / open.len() as f64, &mut random));
            Ok::<bool, ()>(true)
        });
        let standings = standings.unwrap();
        let open = contenders(&costs, &standings);
        (standings, state.iter().map(|fake| fake.samples).collect(), open)
    }

    /// Codes that are 8, 3, 0.2 and 0.1 % off, each dearer than the one before: the third is the cheapest within 1 %. It is found, the
    /// hopeless one and the dear one are not sampled on, and in 400 races the bad one is never taken and the good one never
    /// dropped more often than one race in 20 goes wrong: 33 or more of 400 would have a chance of 0.3 %.
    #[test]
    fn the_cheapest_good_code_wins_and_time_goes_to_it() {
        let fakes = [(0.08, 1.0), (0.03, 2.0), (0.002, 3.0), (0.001, 4.0)];
        let (mut wrong, mut of_hopeless, mut of_winner) = (0, 0.0, 0.0);
        for seed in 0..400 {
            let (standings, samples, open) = end(&fakes, 6, seed);
            let good =
                open.is_empty() && standings[..3] == [Standing::Beyond, Standing::Beyond, Standing::Within];
            wrong += usize::from(!good);
            of_hopeless += samples[0] / 400.0;
            of_winner += samples[2] / 400.0;
        }
        assert!(wrong < 33, "{wrong} of 400 races");
        assert!(of_winner > 4.0 * of_hopeless, "{of_winner} {of_hopeless}");
    }

    /// Codes at 1.05 % of many that pretend to be within 1 %: a race rarely falls for one, where two standard deviations and as many
    /// looks would.
    #[test]
    fn many_looks_at_many_settings_do_not_find_a_good_one_by_chance() {
        let fakes: Vec<(f64, f64)> = (0..20).map(|k| (0.0105, 1.0 + f64::from(k))).collect();
        let falls = (0..200).filter(|seed| end(&fakes, 5, *seed).0.contains(&Standing::Within)).count();
        // One in 20 would be 10; 20 or more then have a chance of 0.2 %.
        assert!(falls < 20, "{falls} of 200 races");
    }

    #[test]
    fn time_that_is_over_leaves_the_open_ones_open() {
        let (standings, samples, open) = end(&[(0.01, 1.0), (0.0, 2.0)], 0, 1);
        assert_eq!((standings, open), (vec![Standing::Open; 2], vec![0, 1]));
        assert_eq!(samples, [10_000.0; 2]);
    }

    /// By hand: 0.5 ± 0.1 % is within 1 % by up to five standard deviations, and beyond 0.1 % by up to four. For one look at one
    /// quantity of one setting the margin of one race in 20 is 1.96, for a thousand 4.06.
    #[test]
    fn margins_are_those_of_all_looks() {
        margins_hold(&off(0.005, 0.001));
        margins_hold(&off(-0.005, 0.001));
        // Energies that are too low are as wrong as those that are too high.
        let tolerances = ["u=1%".parse().unwrap()];
        let rule = Rule::new(&tolerances, 1, 1, 1);
        let of = |value: f64| rule.standing(&off(value, 0.001));
        assert_eq!(
            [of(-0.02), of(-0.0101), of(-0.002)],
            [Standing::Beyond, Standing::Open, Standing::Within]
        );
    }

    fn margins_hold(errors: &[Deviation]) {
        let of = |bound: &str, looks: usize| {
            let tolerances = [bound.parse().unwrap()];
            let rule = Rule::new(&tolerances, 1, 1, looks);
            (rule.standing(errors), rule.margin())
        };
        let (standing, one) = of("u=0.71%", 1);
        assert!(standing == Standing::Within && (one - 1.96).abs() < 0.001, "{one}");
        let (standing, thousand) = of("u=0.71%", 1000);
        assert!(standing == Standing::Open && (thousand - 4.0556).abs() < 0.001, "{thousand}");
        assert_eq!((of("u=0.1%", 1000).0, of("u=0.09%", 1000).0), (Standing::Open, Standing::Beyond));
        // What is asked for and not measured is not within.
        assert_eq!(of("sigma=1%", 1).0, Standing::Open);
        let both = ["u=1%".parse().unwrap(), "sigma=1%".parse().unwrap()];
        assert_eq!(Rule::new(&both, 1, 1, 1).standing(errors), Standing::Open);
        // More settings and more quantities are as many chances as more looks.
        let margin = |settings, quantities, looks| Rule::new(&[], settings, quantities, looks).margin();
        assert!(
            margin(10, 20, 5) == thousand && margin(1000, 1, 1) == thousand && margin(1, 1000, 1) == thousand
        );
    }

    /// A setting that a first look finds beyond its tolerance, and later ones within, stays beyond; one that stops is beyond.
    #[test]
    fn a_verdict_stands() {
        let tolerances = ["u=1%".parse().unwrap()];
        let rule = Rule::new(&tolerances, 3, 1, 3);
        let look = |round: &usize| match round {
            0 => vec![Some(off(0.05, 0.001)), Some(off(0.005, 0.01)), Some(off(0.0, 0.001))],
            _ => vec![Some(off(0.0, 0.001)), Some(off(0.005, 0.01)), None],
        };
        let costs = [Some(1.0), Some(2.0), Some(3.0)];
        let (mut round, mut asked) = (0, Vec::new());
        let found = race(&mut round, &rule, &costs, 2, look, |round, open, _| {
            *round += 1;
            asked.push(open.to_vec());
            Ok::<bool, ()>(true)
        });
        assert_eq!(found, Ok(vec![Standing::Beyond, Standing::Open, Standing::Beyond]));
        assert_eq!(asked, [[1], [1]]);
    }

    #[test]
    fn contenders_are_cheaper_than_the_cheapest_within() {
        use Standing::{Beyond, Open, Within};
        let costs = [Some(1.0), Some(2.0), None, Some(4.0), Some(3.0)];
        assert_eq!(contenders(&costs, &[Beyond, Open, Open, Within, Open]), [1, 4]);
        assert_eq!(contenders(&costs, &[Within, Open, Open, Open, Open]), Vec::<usize>::new());
        assert_eq!(contenders(&costs, &[Open, Beyond, Open, Beyond, Beyond]), [0]);
    }

    /// Four settings and a reference that counts in all: a third of the time for the reference.
    #[test]
    fn the_reference_has_the_share_that_helps_most() {
        let [each, reference] = shares(4);
        assert!((each - 1.0 / 6.0).abs() < 1e-15 && (reference - 1.0 / 3.0).abs() < 1e-15);
        let variance = |reference: f64| 4.0 / (1.0 - reference) + 1.0 / reference;
        assert!(
            variance(reference) < variance(0.9 * reference)
                && variance(reference) < variance(1.1 * reference)
        );
        assert_eq!(shares(0), [0.0, 0.0]);
    }
}
