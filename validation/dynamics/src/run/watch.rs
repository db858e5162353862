//! Watches the temperature of a run: warns if it deviates from its target, and stops a run that stays far too hot.
//!
//! The kinetic temperature is that of relative velocities along pairs, which drag and noise act on, so the motion of a drop or a flow
//! does not count; of pairs in cells of space, so that no pairs are searched. Each stage has a number of samples, a long stage one every
//! [`INTERVAL`] steps; sampling changes no step. The configurational temperature, which is most sensitive to errors of the forces, is
//! sampled up to forty times in the last two thirds of a stage of a thousand steps or more; not where an observable measures it with
//! more configurations. Of many particles both are those of a piece.
//!
//! A stage in equilibrium raises a false alarm once in [`ALARM`]⁻¹ = 1000 stages for each thermometer, and
//! less often because its mean must also deviate by more than [`TOLERANCE`].

use super::looks::{
    Configurational, configurational, estimate_configurational, looks_at_forces, piece, place,
};
use super::{RunError, Simulation};
use crate::scene::Stage;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::{Estimate, Measured, difference};
use std::fmt;

/// Largest and smallest number of steps between samples.
const INTERVAL: u64 = 250;
pub(super) const LEAST: u64 = 10;

/// Target number of samples in a short stage.
const SAMPLES: u64 = 30;

/// A run stops if it is hotter than this, in kT, for [`PATIENCE`] relaxation times and [`IN_A_ROW`] samples, and
/// has not cooled to [`COOLER`] of its lowest temperature for as long. A start that cools, even slowly, continues.
const FAR_OFF: f64 = 2.0;
const PATIENCE: f64 = 10.0;
const IN_A_ROW: u64 = 4;
const COOLER: f64 = 0.9;

/// Relative deviation that causes no warning.
const TOLERANCE: f64 = 0.02;

/// Probability of a false alarm for each thermometer of a stage.
const ALARM: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thermometer {
    Kinetic,
    Configurational,
}

/// A temperature that deviates from that of its stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    pub stage: String,
    pub thermometer: Thermometer,
    /// Mean over the last two thirds of the stage, in units of kT.
    pub mean: f64,
    pub error: f64,
    /// Whether the temperature was still falling at the end of the stage.
    pub falls: bool,
    /// The time step; `None` for Monte Carlo.
    pub dt: Option<f64>,
}

impl fmt::Display for Deviation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Deviation { stage, thermometer, mean, error, falls, dt } = self;
        let Some(dt) = dt else {
            return write!(
                f,
                "stage \"{stage}\": the configurational temperature is {mean:.3} +- {error:.3} kT: trial moves are exact, so \
                 likely the fluid has not come to rest; make more steps"
            );
        };
        let (what, cause) = match thermometer {
            Thermometer::Kinetic => ("kinetic", "the thermostat's and the forces' error at this step"),
            Thermometer::Configurational => ("configurational", "the forces' error at this step"),
        };
        if *falls {
            return write!(
                f,
                "stage \"{stage}\": the {what} temperature is {mean:.3} +- {error:.3} kT and still falls: the start has not \
                 settled; give the stage more steps"
            );
        }
        write!(
            f,
            "stage \"{stage}\": the {what} temperature is {mean:.3} +- {error:.3} kT: likely {cause}, dt = {dt}; use a smaller \
             dt, or an integrator that allows it (docs/integrators.md)"
        )
    }
}

impl Deviation {
    /// A configurational temperature that an observable has found, if it is off beyond chance.
    pub(super) fn measured(stage: &Stage, found: Measured, samples: usize) -> Option<Deviation> {
        let Measured { value, error } = found.times(1.0 / stage.kt);
        let found = Estimate { mean: value, error, samples, tau: 0.5 };
        (error > 0.0 && is_off(&found)).then(|| Deviation {
            stage: stage.name.clone(),
            thermometer: Thermometer::Configurational,
            mean: value,
            error,
            falls: false,
            dt: stage.integrator.has_time().then_some(stage.dt),
        })
    }
}

#[derive(Debug, Default)]
pub(super) struct Watch {
    /// The kinetic temperature of each sample, in units of kT.
    kinetic: Vec<f64>,
    configurational: Vec<Configurational>,
    /// Of the present stage, with arrays of pairs for the next look.
    evaluator: Option<Evaluator>,
    hot: Option<Hot>,
}

/// Consecutive samples that were too hot.
#[derive(Debug, Clone, Copy)]
struct Hot {
    since: u64,
    count: u64,
    /// The lowest temperature among the samples, and its step.
    lowest: f64,
    at: u64,
}

impl Hot {
    /// Adds a sample to the hot ones, or starts with it.
    fn with(before: Option<Hot>, ratio: f64, done: u64) -> Hot {
        let Some(hot) = before else { return Hot { since: done, count: 1, lowest: ratio, at: done } };
        let (lowest, at) = if ratio < COOLER * hot.lowest { (ratio, done) } else { (hot.lowest, hot.at) };
        Hot { count: hot.count + 1, lowest, at, ..hot }
    }

    /// Number of steps without a lower temperature. It is 0 for a fluid that still cools, even slowly, that
    /// is if the lowest temperature came in the later half of the time.
    fn steps(&self, done: u64) -> u64 {
        let without = done - self.at;
        if 2 * without < done - self.since { 0 } else { without }
    }

    /// Whether a run has stayed hot for too long; drag and noise take `relaxation` steps to cool it.
    fn lasts(&self, done: u64, relaxation: f64) -> bool {
        self.count >= IN_A_ROW && self.steps(done) as f64 > PATIENCE * relaxation
    }
}

impl Watch {
    /// Whether a sample is due. Without `looks` there are no configurational temperatures.
    pub fn is_due(stage: &Stage, done: u64, looks: bool) -> bool {
        let interval = (stage.steps / SAMPLES).clamp(LEAST, INTERVAL);
        stage.thermostat && (done.is_multiple_of(interval) || looks && looks_at_forces(stage, done))
    }

    /// Takes a sample; the step must be complete.
    pub fn sample(
        &mut self,
        simulation: &mut Simulation,
        stage: &Stage,
        done: u64,
        looks: bool,
    ) -> Result<(), RunError> {
        // Monte Carlo draws velocities at kT, so their temperature reveals no error.
        let has_time = stage.integrator.has_time();
        if has_time && !simulation.has_pair_thermostat() {
            return Ok(());
        }
        if looks && looks_at_forces(stage, done) {
            let piece = piece(simulation, done);
            if piece.is_none() {
                simulation.find_conservative_forces()?;
            }
            self.configurational.extend(configurational(simulation, piece.as_ref(), &mut self.evaluator));
            // Looks at a piece are rare among the steps of so many particles, so their memory is not kept.
            self.evaluator.take_if(|_| piece.is_some());
        }
        let middle = place(done, simulation.len());
        let found = if has_time { simulation.temperature_in_cells(middle) } else { None };
        let Some(kt) = found else { return Ok(()) };
        self.kinetic.push(kt / stage.kt);
        // A body force or a wall may drive a flow that is hot by itself.
        let driven = stage.body_forces && simulation.has_body_forces() || simulation.has_moving_walls();
        if kt <= FAR_OFF * stage.kt || driven {
            self.hot = None;
            return Ok(());
        }
        // Before a run is stopped, all pairs that drag and noise act on are asked.
        let piece = piece(simulation, done);
        let Some(warmth) = simulation.warmth(stage.dt, piece.as_ref())? else { return Ok(()) };
        let ratio = warmth.kt / stage.kt;
        if ratio <= FAR_OFF {
            self.hot = None;
            return Ok(());
        }
        let hot = Hot::with(self.hot, ratio, done);
        self.hot = Some(hot);
        if hot.lasts(done, 1.0 / (stage.dt * warmth.rate)) {
            return Err(RunError::TooHot {
                step: simulation.step_number(),
                since: simulation.step_number() - (done - hot.since),
                ratio,
                dt: stage.dt,
                integrator: stage.integrator.to_string(),
            });
        }
        Ok(())
    }

    /// The deviations that a stage ends with. The watch goes with its memory.
    pub fn deviations(self, stage: &Stage) -> Vec<Deviation> {
        if stage.level.is_some() {
            // A level of a ramp is not in equilibrium.
            return Vec::new();
        }
        let kinetic = &self.kinetic[self.kinetic.len() / 3..];
        let cools = falls(kinetic);
        let dt = stage.integrator.has_time().then_some(stage.dt);
        let found = [
            (Thermometer::Kinetic, estimate(kinetic), cools),
            (Thermometer::Configurational, estimate_configurational(&self.configurational, stage.kt), false),
        ];
        let deviation = |(thermometer, found, falls): (Thermometer, Option<Estimate>, bool)| {
            // A falling temperature scatters by its trend; it counts as too high if every sample was too high.
            let Estimate { mean, error, .. } =
                found.filter(|found| is_off(found) || falls && is_above(kinetic))?;
            Some(Deviation { stage: stage.name.clone(), thermometer, mean, error, falls, dt })
        };
        found.into_iter().filter_map(deviation).collect()
    }
}

/// Whether a temperature in units of kT deviates by more than [`TOLERANCE`] and chance.
fn is_off(found: &Estimate) -> bool {
    let beyond = Estimate { mean: (found.mean - 1.0).abs() - TOLERANCE, ..*found };
    let nothing = Estimate { mean: 0.0, error: 0.0, ..*found };
    beyond.mean > 0.0 && difference(&beyond, &nothing).exceeds(1, ALARM)
}

/// Whether all samples are too high, and are too many for that to be chance.
fn is_above(samples: &[f64]) -> bool {
    0.5f64.powi(samples.len() as i32) < ALARM && samples.iter().all(|ratio| *ratio > 1.0 + TOLERANCE)
}

/// Whether the mean of the later half of the samples is below that of the earlier half by more than two standard errors.
fn falls(samples: &[f64]) -> bool {
    let half = |samples: &[f64]| {
        let n = samples.len() as f64;
        let logarithms = || samples.iter().map(|x| x.ln());
        let mean = logarithms().sum::<f64>() / n;
        [mean, logarithms().map(|x| (x - mean).powi(2)).sum::<f64>() / n / (n - 1.0)]
    };
    let (earlier, later) = samples.split_at(samples.len() / 2);
    let ([before, variance], [after, other]) = (half(earlier), half(later));
    earlier.len() > 1 && before - after > 2.0 * (variance + other).sqrt()
}

/// Mean of the samples with its standard error; the error includes correlations if there are enough samples.
fn estimate(samples: &[f64]) -> Option<Estimate> {
    let Measured { value: mean, error } = Measured::of_independent(samples);
    let plain = Estimate { mean, error, samples: samples.len(), tau: 0.5 };
    psidpd_observe::estimate(samples).ok().or((samples.len() >= 4 && mean.is_finite()).then_some(plain))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::Integrator;
    use crate::run::{Begin, Outcome, Runner};
    use crate::tests::support::{SET6, SOFT, scene};
    use rand::{SeedableRng, rngs::StdRng};
    use rand_distr::{Distribution, StandardNormal};
    use std::sync::atomic::AtomicUsize;

    /// Runs a scene and returns the deviations that its watch found.
    fn watched(model: &str, text: &str) -> Result<Vec<Deviation>, RunError> {
        let text =
            format!("title = \"t\"\nmodel = \"m.toml\"\n{text}\n[output]\nthermo = 0\ncheckpoint = 0\n");
        let scene = scene(model, &text).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut found = Vec::new();
        let mut runner = Runner::begin(&scene, &folder.path().join("out"), Begin::Overwrite)?;
        let never = AtomicUsize::new(0);
        match runner.run(&never, &mut |p| found.extend_from_slice(p.deviations))? {
            Outcome::Finished { .. } => Ok(found),
            Outcome::Interrupted { .. } => panic!("nobody stopped it"),
        }
    }

    /// The number of temperatures, one every ten steps, until a run stops whose relaxation time is twenty steps: ten such
    /// times are 200 steps.
    fn stopped_after(temperatures: impl Iterator<Item = f64>) -> Option<usize> {
        let mut hot = None;
        temperatures.enumerate().find_map(|(k, ratio)| {
            let now = Hot::with(hot, ratio, 10 * k as u64);
            hot = Some(now);
            now.lasts(10 * k as u64, 20.0).then_some(k)
        })
    }

    /// A run with steady, growing, or cooling and then steady high temperatures stops. A run that cools
    /// exponentially, as a power of time or in bursts continues.
    #[test]
    fn only_what_stays_hot_is_stopped() {
        let mut rng = StdRng::seed_from_u64(5);
        let mut noise = || {
            let z: f64 = StandardNormal.sample(&mut rng);
            (0.05 * z).exp()
        };
        assert_eq!(stopped_after((0..100).map(|_| 5.0)), Some(21));
        assert_eq!(stopped_after((0..100).map(|k| 5.0 + f64::from(k))), Some(21));
        assert!(stopped_after((0..200).map(|_| 5.0 * noise())).is_some());
        assert!(
            stopped_after((0..400).map(|k| (5.0 + 1e4 * (-0.2 * f64::from(k)).exp()) * noise())).is_some()
        );
        assert_eq!(stopped_after((0..400).map(|k| 1e9 * (-0.05 * f64::from(k)).exp() * noise())), None);
        assert_eq!(stopped_after((0..400).map(|k| 1e5 / (1.0 + f64::from(k)) * noise())), None);
        let burst = |k: i32| if k % 7 == 0 { 2.0 } else { 1.0 };
        assert_eq!(
            stopped_after((0..400).map(|k| burst(k) * 1e6 * (-0.02 * f64::from(k)).exp() * noise())),
            None
        );
    }

    /// However far apart samples are, it takes four of them.
    #[test]
    fn few_hot_samples_stop_no_run() {
        let mut hot = None;
        for (k, lasts) in [false, false, false, true, true].into_iter().enumerate() {
            let done = 10_000 * (k as u64 + 1);
            let now = Hot::with(hot, 9.0, done);
            assert_eq!((now.since, now.at, now.count), (10_000, 10_000, k as u64 + 1));
            assert_eq!(now.lasts(done, 20.0), lasts, "{k}");
            hot = Some(now);
        }
    }

    #[test]
    fn a_trend_is_told_from_scatter() {
        let mut rng = StdRng::seed_from_u64(3);
        let scattered = |rng: &mut StdRng, n: usize, trend: f64| -> Vec<f64> {
            let noise = |k: usize, z: f64| (5.0 - trend * k as f64 + 0.1 * z).exp();
            (0..n).map(|k| noise(k, StandardNormal.sample(rng))).collect()
        };
        for n in [4, 5, 12, 40] {
            let falling = (0..1000).filter(|_| falls(&scattered(&mut rng, n, 0.0))).count();
            // Student's t of two degrees of freedom is above 2 in 9 % of the cases, the normal distribution in 2 %.
            assert!(falling < 150, "{n}: {falling}");
            assert!(falls(&scattered(&mut rng, n, 0.5)) && !falls(&scattered(&mut rng, n, -0.5)), "{n}");
        }
        assert!(!falls(&[3.0, 2.0, 1.0]) && !falls(&[]));
    }

    /// A fluid that cools towards its temperature is told of only if it never was near it.
    #[test]
    fn samples_that_fall_are_told_of_if_all_are_above() {
        let soft =
            scene(SOFT, "model = \"m.toml\"\nkT = 0.7\nbox = 4.0\ndensity = 3.0\nsteps = 10\ndt = 0.01\n")
                .unwrap();
        let told = |last: f64| {
            let kinetic = (0..60).map(|k| last + 8.0 * (-0.15 * f64::from(k)).exp()).collect();
            let watch = Watch { kinetic, ..Watch::default() };
            let found = watch.deviations(&soft.stages[0]);
            assert!(found.iter().all(|d| matches!(d.thermometer, Thermometer::Kinetic)));
            found.first().map(|d| d.falls)
        };
        assert_eq!((told(1.03), told(0.99)), (Some(true), None));
    }

    /// Of samples that are as often below as above, all are above once in two to the power of their number; 1.02 is tolerated.
    #[test]
    fn all_must_be_too_high_and_many() {
        let enough = (-ALARM.log2()).floor() as usize + 1;
        assert!(is_above(&vec![1.021; enough]) && !is_above(&vec![1.021; enough - 1]));
        assert!(!is_above(&vec![1.019; 50]));
        let mut one_lower = vec![1.5; 50];
        one_lower[31] = 1.01;
        assert!(!is_above(&one_lower));
    }

    /// Of 4000 correct means of independent numbers 4 raise a false alarm in the limit of a small tolerance.
    /// The tolerance of 2 % with errors of 1 % leaves fewer.
    #[test]
    fn chance_is_allowed_for() {
        let mut rng = StdRng::seed_from_u64(4);
        for n in [4, 6, 16, 60] {
            let warned = (0..1000).filter(|_| {
                let samples: Vec<f64> = (0..n)
                    .map(|_| {
                        let z: f64 = StandardNormal.sample(&mut rng);
                        1.0 + 0.3 * z
                    })
                    .collect();
                is_off(&estimate(&samples).unwrap())
            });
            let warned = warned.count();
            assert!(warned <= 6, "{n}: {warned}");
        }
        assert_eq!(estimate(&[1.0, 1.1, 0.9]), None);
        let far = estimate(&[1.30, 1.32, 1.29, 1.31, 1.30, 1.28]).unwrap();
        assert!(is_off(&far), "{far:?}");
    }

    /// Sums of forces of forty looks at a fluid of this temperature, in units of kT: twenty blocks, whose own values differ by half
    /// of kT as those of a surface and of the inside do, and next looks that are alike.
    fn looked_at(rng: &mut StdRng, ratio: f64) -> Vec<Configurational> {
        let mut normal = |size: f64| -> f64 {
            let z: f64 = StandardNormal.sample(rng);
            size * z
        };
        let mut drift = 0.0;
        let look = |_| {
            drift = 0.4 * drift + normal(0.02);
            let block = |k| {
                let b = 1.0 + normal(0.1);
                [(ratio + drift) * b + if k % 2 == 0 { 0.5 } else { -0.5 } + normal(0.1), b]
            };
            Configurational::of(&(0..20).map(block).collect::<Vec<_>>())
        };
        (0..40).map(look).collect()
    }

    /// A temperature that is off by as much as is tolerated raises an alarm in 1 of 1000 stages at most; this counts 1000 of them,
    /// among which 7 or more have a probability below 10⁻⁴. One that is off by 5 % is seen, although blocks scatter by half of kT.
    #[test]
    fn configurational_temperatures_that_are_off_are_seen() {
        let mut rng = StdRng::seed_from_u64(6);
        let mut alarms = |ratio: f64, of: usize| {
            let warned =
                |_: &usize| is_off(&estimate_configurational(&looked_at(&mut rng, ratio), 1.0).unwrap());
            (0..of).filter(warned).count()
        };
        let (right, high, low) = (alarms(1.02, 1000), alarms(1.06, 200), alarms(0.94, 200));
        assert!(right <= 6 && high >= 190 && low >= 190, "{right} {high} {low}");
    }

    /// Twenty seeds of a slab in the plane, where ∇²U nearly cancels and single configurations scatter by 15 %,
    /// and eight of a small slab of Warren's set 6. Each seed raises a false alarm once in 500 stages;
    /// among these one alarm has a probability of 5 %, two of 0.2 %.
    #[test]
    fn small_slabs_raise_no_false_alarm() {
        let plane = include_str!("../../../models/van-der-waals-2d-slab.toml");
        let slabs = [
            (plane, 20, "kT = 0.75", "[3.0, 8.0]", "2.0", "58.0"),
            (SET6, 8, "kT = 1.0", "[4.0, 4.0, 8.0]", "4.0", "6.05"),
        ];
        let mut warned = Vec::new();
        for (model, seeds, kt, lengths, thickness, density) in slabs {
            for seed in 1..=seeds {
                let text = format!(
                    "{kt}\nseed = {seed}\nbox = {lengths}\ndt = 0.005\nequilibrate = 200\nsteps = 1000\n[initial]\n\
                     kind = \"slab\"\nthickness = {thickness}\ndensity = {density}\n"
                );
                let found = watched(model, &text).unwrap();
                let measured = found.into_iter().filter(|d| d.stage == "produce");
                warned.extend(measured.map(|d| (seed, d.to_string())));
            }
        }
        assert!(warned.len() <= 1, "{warned:?}");
    }

    /// Velocity Verlet at Δt = 0.02 is 10 % too hot in Warren's set 6, which a stage of 1500 steps reveals.
    #[test]
    fn forces_that_heat_are_warned_of() {
        let text = "kT = 1.0\nseed = 1\nbox = [7.0, 7.0, 7.0]\ndensity = 6.05\ndt = 0.02\nequilibrate = 200\nsteps = 1500\n";
        let found = watched(SET6, text).unwrap();
        assert!(
            found
                .iter()
                .any(|d| d.thermometer == Thermometer::Configurational && (d.mean - 1.1).abs() < 0.05),
            "{found:?}"
        );
    }

    /// Monte Carlo draws its velocities, so that only the configurational temperature tells that short moves have not yet led a
    /// lattice, on which no force acts, to equilibrium.
    #[test]
    fn trial_moves_that_have_not_come_to_rest_are_warned_of() {
        let text =
            "kT = 1.0\nseed = 1\nbox = 4.16\ndensity = 3.0\nsteps = 1000\nintegrator = \"monte-carlo\"\n";
        let short = format!("{text}max_move = 1e-4\n[initial]\nkind = \"lattice\"\n");
        let found = watched(SOFT, &short).unwrap();
        let [one] = &found[..] else { panic!("{found:?}") };
        assert!(one.thermometer == Thermometer::Configurational && one.mean < 0.5, "{one:?}");
        assert!(one.to_string().contains("not come to rest"), "{one}");
        assert_eq!(watched(SOFT, &format!("{text}sweeps = 2\n")).unwrap(), []);
    }

    /// A random start at a tiny kT has 10^5 kT at first, and cools for longer than any number of relaxation
    /// times. However short its steps are, it does not stop, and the warning says that it still falls.
    #[test]
    fn a_start_that_cools_is_not_stopped() {
        for (dt, steps) in [(0.04, 800), (0.02, 1600), (0.01, 3200)] {
            let text = format!(
                "kT = 1e-6\nseed = 1\nbox = 5.0\ndensity = 3.0\ndt = {dt}\nsteps = {steps}\n[initial]\nkind = \"random\"\n"
            );
            let found = watched(SOFT, &text).unwrap();
            assert!(
                found.iter().any(|d| d.falls && d.to_string().contains("still falls")),
                "{dt}: {found:?}"
            );
        }
    }

    /// A time step far too long for the forces heats a liquid and keeps it hot: the run stops with an error
    /// that names step and cause.
    #[test]
    fn a_step_that_is_too_long_is_stopped() {
        let text = "kT = 1.0\nseed = 1\nbox = 4.0\ndensity = 6.05\ndt = 0.04\nsteps = 4000\n";
        let error = watched(SET6, text).unwrap_err();
        let RunError::Stopped { cause, .. } = &error else { panic!("{error}") };
        assert!(matches!(**cause, RunError::TooHot { dt: 0.04, .. }), "{error}");
    }

    fn stage(steps: u64, integrator: Integrator) -> Stage {
        let name = "run".to_owned();
        Stage { name, level: None, steps, dt: 0.01, integrator, kt: 2.0, thermostat: true, body_forces: true }
    }

    fn kinetic(samples: impl IntoIterator<Item = f64>) -> Watch {
        Watch { kinetic: samples.into_iter().collect(), ..Watch::default() }
    }

    /// Sixty temperatures that scatter by a hundredth: off by a tenth, high or low, they are told, with what they are; off by 1 % they
    /// are not, nor are those of the first third, of a level of a ramp, or of too few samples.
    #[test]
    fn kinetic_temperatures_that_are_off_are_told() {
        let scattered = |mean: f64| (0..60).map(move |k| mean + if k % 2 == 0 { 0.01 } else { -0.01 });
        let usual = stage(600, Integrator::VelocityVerlet);
        for mean in [1.1, 0.9] {
            let found = kinetic(scattered(mean)).deviations(&usual);
            let [one] = &found[..] else { panic!("{found:?}") };
            assert!((one.mean - mean).abs() < 1e-12 && one.error < 0.002 && !one.falls, "{one:?}");
            assert_eq!(
                (one.thermometer, one.dt, one.stage.as_str()),
                (Thermometer::Kinetic, Some(0.01), "run")
            );
            let level = Stage { level: Some([2, 5]), ..usual.clone() };
            assert_eq!(kinetic(scattered(mean)).deviations(&level), []);
        }
        assert_eq!(kinetic(scattered(1.01)).deviations(&usual), []);
        assert_eq!(kinetic((0..30).map(|_| 3.0).chain(scattered(1.0))).deviations(&usual), []);
        assert_eq!(kinetic([9.0, 1.5]).deviations(&usual), []);
    }

    /// A tenth of kT = 2 is off, 1 % is not, and a temperature without error says nothing.
    #[test]
    fn measured_temperatures_are_judged_in_units_of_kt() {
        let usual = stage(600, Integrator::VelocityVerlet);
        let of = |value: f64, error: f64| Deviation::measured(&usual, Measured { value, error }, 50);
        for value in [2.2, 1.8] {
            let found = of(value, 0.01).unwrap();
            assert!(
                (found.mean - 0.5 * value).abs() < 1e-12 && (found.error - 0.005).abs() < 1e-12,
                "{found:?}"
            );
            assert_eq!((found.thermometer, found.dt), (Thermometer::Configurational, Some(0.01)));
        }
        assert!(of(2.02, 1e-6).is_none() && of(1.98, 1e-6).is_none());
        assert!(of(2.2, 0.0).is_none() && of(2.2, f64::NAN).is_none() && of(2.2, 0.2).is_none());
    }

    /// 30 samples of a short stage, ten steps apart at least and 250 at most; none without thermostat.
    #[test]
    fn samples_are_taken_when_the_page_says() {
        let every = |stage: &Stage| (1..=stage.steps).find(|done| Watch::is_due(stage, *done, true));
        for (steps, expected) in [(48, 10), (300, 10), (720, 24), (960, 32)] {
            let mut usual = stage(steps, Integrator::VelocityVerlet);
            assert_eq!(every(&usual), Some(expected));
            usual.thermostat = false;
            assert_eq!(every(&usual), None);
        }
        let looks = |steps: u64, name: &str| {
            let integrator = Integrator::ALL.iter().find(|(known, _)| *known == name).unwrap().1;
            let of = stage(steps, integrator);
            (1..=steps).find(|done| looks_at_forces(&of, *done))
        };
        // Every 250 evaluations of forces, or sixty times, or every 1000 steps; odd; from a third of the stage on.
        for (steps, expected) in
            [(999, None), (1000, Some(502)), (30_000, Some(10_020)), (300_000, Some(100_100))]
        {
            assert_eq!(looks(steps, "velocity-verlet"), expected);
        }
        assert_eq!((looks(1000, "two-stage"), looks(30_000, "two-stage")), (Some(375), Some(10_020)));
        let level = Stage { level: Some([1, 3]), ..stage(30_000, Integrator::VelocityVerlet) };
        assert!(!(1..=30_000).any(|done| looks_at_forces(&level, done)));
    }

    /// A liquid that a long step keeps hot is not stopped where a body force acts, which may drive a flow that is hot by itself; it is
    /// where the stage has none of it.
    #[test]
    fn a_driven_flow_is_not_stopped() {
        let run = |body_forces: bool| {
            let text = format!(
                "kT = 1.0\nseed = 1\nbox = 4.0\ndensity = 6.05\n[[body_force]]\nacceleration = [1e-6, 0.0, 0.0]\n\
                 reversed_along = \"z\"\n[[stage]]\nname = \"hot\"\nsteps = 400\ndt = 0.037\nbody_forces = {body_forces}\n"
            );
            watched(SET6, &text)
        };
        let found = run(true).unwrap();
        assert!(found.iter().any(|d| d.thermometer == Thermometer::Kinetic && d.mean > FAR_OFF), "{found:?}");
        let RunError::Stopped { cause, .. } = run(false).unwrap_err() else { panic!("another error") };
        assert!(matches!(*cause, RunError::TooHot { .. }), "{cause}");
    }
}
