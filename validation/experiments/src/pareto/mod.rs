//! Speed against error: what a unit of simulated time costs with each setting, and how far off its results are.
//!
//! [`setting`] says what is tried, [`origin`] where all begin, [`sample`] runs a setting for its errors and [`time`] all of them
//! in turn for their cost; [`quantity`] holds results against the reference, `race` spends the time where it decides, [`front`]
//! and `recommend` choose.

mod drift;
mod front;
mod lammps;
mod origin;
mod outcome;
mod own_style;
pub mod page;
mod quantity;
mod race;
mod recommend;
mod sample;
mod setting;
mod time;
mod tolerance;

use drift::EnergyDrift;
use outcome::{Comparison, Cost, Point, Recommended, Reference};
use quantity::Deviation;
pub use sample::Effort;
pub use setting::Choice;
pub use time::Pace;
pub use tolerance::Tolerance;

use crate::ExperimentError;
use crate::code::Host;
use crate::files::absolute_folder;
use crate::jobs;
use crate::machine::machine;
use lammps::LammpsRuns;
use origin::Origin;
use own_style::is_another_law;
use psidpd_core::engine::Precision;
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::scene::Scene;
use psidpd_formats::files::{Existing, write_bytes, write_json};
use psidpd_report::Progress;
use quantity::{Known, Quantities, deviations};
use race::{Rule, Standing, contenders, race};
use sample::{Made, Sampled, Sampler};
use setting::{Physics, Setting};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[derive(Debug, Clone)]
pub struct Options {
    /// Minutes that all of it may take, roughly.
    pub minutes: f64,
    pub choice: Choice,
    pub threads: Vec<NonZeroUsize>,
    /// Tolerances; one percent of all that is resolved so well if there are none.
    pub tolerances: Vec<Tolerance>,
    /// Whether LAMMPS is asked too, if it is installed.
    pub lammps: bool,
    /// How much of each setting is sampled, and how it is timed; by the minutes if left out.
    pub fixed: Option<(Effort, Pace)>,
    pub out: PathBuf,
    pub existing: Existing,
}

/// Shares of the minutes. Sampling counts twice, as two runs go on at once.
const START: f64 = 0.08;
const SAMPLING: f64 = 0.42;
const LAMMPS: f64 = 0.2;
const DRIFTS: f64 = 0.08;
const TIMING: f64 = 0.3;
const WORKERS: f64 = 2.0;
/// How much more of the reference is sampled than of others.
const REFERENCE: f64 = 5.0;
const ROUNDS: usize = 5;
/// Shares of the sampling: settling and a first look at all settings, as if what follows were shared out evenly. The rest is a race.
const SETTLING: f64 = 0.5;
const FIRST: f64 = 0.3;
const LATER: f64 = 1.0 - sample::SETTLE * SETTLING - (1.0 - sample::SETTLE) * FIRST;
/// Rounds of the race.
const LOOKS: usize = 5;
/// Errors of contenders at the end of a race, in those of the first look: about eight of forty settings are left in it.
const FORECAST: f64 = 0.4;

/// The runs of LAMMPS's own style, in units of the scene's Δt; the first is its reference.
const OWN: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 3.0];

/// Holds the settings of a scene against each other, and writes `pareto.json` and `pareto.html`.
pub fn run(scene: &Scene, options: &Options, progress: &Progress) -> Result<Comparison, ExperimentError> {
    let out = absolute_folder(&options.out)?;
    let seconds = 60.0 * options.minutes;
    let all = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let limit = Duration::from_secs_f64(START * seconds);
    let origin = progress.spinner("start", || Origin::of(scene, limit, all))?;
    let known = known(&origin)?;
    let mut left_out = Vec::new();
    let open = || LammpsRuns::open(&origin, &out.join("runs"), &|line| progress.note(line));
    let without = |error| left_out.push(format!("LAMMPS is not among the points: {error}."));
    let lammps = options.lammps.then(open).and_then(|found| found.map_err(without).ok());

    let share = if lammps.is_some() { SAMPLING } else { SAMPLING + LAMMPS };
    let physics = setting::physics(options.choice);
    let budget = share * seconds;
    let even = WORKERS * budget / (physics.len() as f64 + REFERENCE);
    let efforts = options
        .fixed
        .map_or([SETTLING, FIRST].map(|part| Effort::Seconds(part * even)), |(effort, _)| [effort, effort]);
    let mut field = Field::begun(&origin, &physics, efforts, progress)?;
    let drifts = drifts(&origin, known, options, DRIFTS * WORKERS * seconds, progress)?;

    let looked = field.look(known)?;
    let mut points = native_points(&origin, options, &physics, &field.sampled(), &looked);
    let mut lammps_reference = None;
    if let Some(lammps) = &lammps {
        plugin_points(&origin, &mut points);
        let native = field.references.quantities(&origin)?;
        match own_points(&origin, lammps, LAMMPS * seconds, options, known, &native, progress) {
            Ok(Some((reference, own))) => {
                lammps_reference = reference;
                points.extend(own);
            }
            Ok(None) => left_out.push("psidpd knows no style of LAMMPS's own for this fluid.".into()),
            Err(error) => left_out.push(format!("LAMMPS's own style is not among the points: {error}.")),
        }
    }

    let stable: Vec<usize> = (0..points.len()).filter(|k| points[*k].stable).collect();
    let settings: Vec<Setting> = stable.iter().map(|k| points[*k].setting).collect();
    let slices = ((ROUNDS + 1) * settings.len().max(1)) as f64;
    let pace =
        options.fixed.map_or(Pace { rounds: ROUNDS, seconds: TIMING * seconds / slices }, |fixed| fixed.1);
    let costs = time::time(&origin, &settings, lammps.as_ref(), pace, progress)?;
    for (k, cost) in stable.into_iter().zip(costs) {
        points[k].cost = Cost::of(&cost);
    }
    let forecast = if options.fixed.is_some() { 1.0 } else { FORECAST };
    let measured = looked.iter().flatten().map(Vec::len).max().unwrap_or(0);
    let (mut tolerances, unresolved) = match &options.tolerances[..] {
        // As if all quantities were judged: hardly more than what the rule of the race will ask for.
        [] => front::usual(&points, forecast, Rule::new(&[], physics.len(), measured, LOOKS + 1).margin()),
        asked => (asked.to_vec(), Vec::new()),
    };
    if let Some(tolerance) = front::unmeasured(&points, &tolerances) {
        return Err(ExperimentError::Unmeasured(tolerance.name.clone()));
    }
    let costs: Vec<Option<f64>> = physics.iter().map(|physics| cheapest_of(&points, physics)).collect();
    let quantities = looked.iter().flatten().map(|errors| judged(errors, &tolerances)).max().unwrap_or(0);
    let rule = Rule::new(&tolerances, physics.len(), quantities, LOOKS + 1);
    let (begin, whole) = (Instant::now(), Duration::from_secs_f64(LATER * budget));
    let rounds = if options.fixed.is_some() { 0 } else { LOOKS };
    let mut standings = race(
        &mut field,
        &rule,
        &costs,
        rounds,
        // A reference that was good before its race is good after it.
        |field| field.look(known).unwrap_or_else(|_| vec![None; physics.len()]),
        |field, open, round| {
            let left = whole.saturating_sub(begin.elapsed()).as_secs_f64();
            let core_seconds = WORKERS * left / (rounds - round) as f64;
            field.sample_on(open, core_seconds, judges_dynamics(&tolerances), progress);
            Ok::<bool, ExperimentError>(left > 0.0)
        },
    )?;
    let (looked, sampled) = (field.look(known)?, field.sampled());
    renew(&mut points, &physics, &sampled, &looked);
    let margin = rule.margin();
    if options.tolerances.is_empty() {
        tolerances = front::widened(&points, &tolerances);
        let rule = Rule::new(&tolerances, physics.len(), quantities, LOOKS + 1);
        let again = |errors: &Option<Vec<Deviation>>| {
            errors.as_ref().map_or(Standing::Beyond, |errors| rule.standing(errors))
        };
        standings = looked.iter().map(again).collect();
    }
    front::mark(&mut points, &tolerances);
    let references = &field.references;
    let open = contenders(&costs, &standings);
    let undecided = (0..points.len())
        .filter(|k| points[*k].code == Host::Native && points[*k].stable)
        .filter(|k| open.iter().any(|of| physics[*of] == points[*k].setting.physics))
        .collect();
    let (reference, reference_of_dynamics) = references.tell(&origin, known);
    if let Err(why) = &references.configurations {
        left_out.push(format!("This scene cannot run Monte Carlo, so small steps are the reference: {why}."));
    }
    let mut outcome = Comparison {
        format: 2,
        version: env!("CARGO_PKG_VERSION"),
        machine: machine(),
        scene: scene.title.clone(),
        stage: origin.stage.name.clone(),
        particles: origin.state.len(),
        kt: origin.stage.kt,
        dt: origin.stage.dt,
        temperature_is_known: known.temperature,
        reference,
        reference_of_dynamics,
        lammps_reference,
        left_out,
        points,
        drifts,
        tolerances,
        unresolved,
        margin,
        undecided,
        recommended: None,
    };
    outcome.recommended = recommend(&origin, &outcome);
    write_json(&out.join("pareto.json"), options.existing, &outcome)?;
    write_bytes(&out.join("pareto.html"), options.existing, page::report(&outcome)?.as_bytes())?;
    Ok(outcome)
}

fn what(origin: &Origin, physics: &Physics) -> String {
    let integrator = recommend::short(&physics.integrator);
    if !physics.integrator.has_time() {
        return integrator;
    }
    format!("{integrator}, dt = {}, {} precision", origin.dt(physics), physics.precision)
}

/// Whether velocities have a distribution that is known, and what pressures are compared with.
fn known(origin: &Origin) -> Result<Known, ExperimentError> {
    let (scene, stage) = (origin.scene, origin.stage);
    let flows = stage.body_forces && !scene.body_forces.is_empty();
    let conservative = scene.model.at(stage.kt)?.is_conservative();
    let volume = origin.state.domain.volume(scene.model.dimensions());
    Ok(Known {
        kt: stage.kt,
        temperature: conservative && !flows,
        ideal_pressure: origin.state.len() as f64 * stage.kt / volume,
    })
}

struct References<'a> {
    /// Monte Carlo, or why there is none.
    configurations: Result<Sampler<'a>, String>,
    small_steps: Sampler<'a>,
}

impl References<'_> {
    /// The quantities of the references: those of configurations from Monte Carlo, if there is one.
    fn quantities(&self, origin: &Origin) -> Result<Quantities, ExperimentError> {
        let made = |sampled: Sampled, physics: &Physics| match sampled {
            Ok(made) => Ok(made.quantities),
            Err(why) => Err(ExperimentError::Reference { what: what(origin, physics), why }),
        };
        let small = made(self.small_steps.sampled(), &Physics::small_steps());
        match &self.configurations {
            Ok(run) => Ok(made(run.sampled(), &Physics::reference())?.with_dynamics_of(small.ok().as_ref())),
            Err(_) => small,
        }
    }

    /// The reference, and that of diffusion and viscosities if it is another.
    fn tell(&self, origin: &Origin, known: Known) -> (Reference, Option<Reference>) {
        let small = reference_of(origin, &Physics::small_steps(), &self.small_steps.sampled(), known);
        match &self.configurations {
            Ok(run) => (reference_of(origin, &Physics::reference(), &run.sampled(), known), Some(small)),
            Err(_) => (small, None),
        }
    }
}

/// All runs: of the references and of every setting.
struct Field<'a> {
    origin: &'a Origin<'a>,
    references: References<'a>,
    runs: Vec<Sampler<'a>>,
}

impl<'a> Field<'a> {
    /// Settles all of them and looks at them for the first time, the references for longer; two at once.
    fn begun(
        origin: &'a Origin<'a>,
        physics: &[Physics],
        [settle, first]: [Effort; 2],
        progress: &Progress,
    ) -> Result<Field<'a>, ExperimentError> {
        let references = [Physics::reference(), Physics::small_steps()];
        let longer = references.into_iter().map(|physics| (physics, REFERENCE));
        let runs = longer.chain(physics.iter().map(|physics| (*physics, 1.0))).collect();
        let begin = |(physics, factor)| {
            Ok(Sampler::settled(origin, physics, settle.times(factor))?.more(first.times(factor)))
        };
        let mut found = jobs::counted((progress, "errors"), runs, begin).into_iter();
        // A model without energy, or a flow, has no Monte Carlo.
        let none = || Err(String::new());
        let configurations = found
            .next()
            .map_or_else(none, |found: Result<_, ExperimentError>| found.map_err(|e| e.to_string()));
        let mut rest: Vec<Sampler> = found.collect::<Result<_, _>>()?;
        let runs = rest.split_off(1);
        Ok(Field {
            origin,
            references: References { configurations, small_steps: rest.swap_remove(0) },
            runs,
        })
    }

    fn sampled(&self) -> Vec<Sampled> {
        self.runs.iter().map(Sampler::sampled).collect()
    }

    /// The errors of every setting, none of those that stopped.
    fn look(&self, known: Known) -> Result<Vec<Option<Vec<Deviation>>>, ExperimentError> {
        let reference = self.references.quantities(self.origin)?;
        let errors = |run: &Sampler| Some(deviations(&run.sampled().ok()?.quantities, &reference, known));
        Ok(self.runs.iter().map(errors).collect())
    }

    /// Samples the open settings and the references on, for so many seconds of a core.
    fn sample_on(&mut self, open: &[usize], core_seconds: f64, dynamics: bool, progress: &Progress) {
        let [each, of_references] = race::shares(open.len()).map(|share| share * core_seconds);
        let [configurations, small] = match (&self.references.configurations, dynamics) {
            (Ok(_), false) => [of_references, 0.0],
            (Ok(_), true) => [0.5 * of_references; 2],
            (Err(_), _) => [0.0, of_references],
        };
        let References { configurations: timeless, small_steps } = &mut self.references;
        let mut chosen: Vec<(&mut Sampler, f64)> = vec![(small_steps, small)];
        chosen.extend(timeless.as_mut().ok().map(|run| (run, configurations)));
        let of_open = self.runs.iter_mut().enumerate().filter(|(k, _)| open.contains(k));
        chosen.extend(of_open.map(|(_, run)| (run, each)));
        chosen.retain(|(_, seconds)| *seconds > 0.0);
        jobs::counted((progress, "contenders"), chosen, |(run, seconds)| {
            run.sample(Effort::Seconds(seconds / (1.0 - sample::SETTLE)));
        });
    }
}

/// How many errors are bound by tolerances.
fn judged(errors: &[Deviation], tolerances: &[Tolerance]) -> usize {
    errors.iter().filter(|d| tolerances.iter().any(|t| t.applies(d))).count()
}

/// Whether a tolerance is for what a reference without time does not have.
fn judges_dynamics(tolerances: &[Tolerance]) -> bool {
    tolerances.iter().any(|t| ["D", "eta"].iter().any(|kind| t.name.starts_with(kind)))
}

/// The least cost of a setting's steps natively, on any number of threads.
fn cheapest_of(points: &[Point], physics: &Physics) -> Option<f64> {
    let own = points.iter().filter(|p| p.code == Host::Native && p.setting.physics == *physics);
    own.filter_map(|p| Some(p.cost?.value)).min_by(f64::total_cmp)
}

/// Gives points of the native steps, those of the plugin among them, what the longer runs found.
fn renew(points: &mut [Point], physics: &[Physics], sampled: &[Sampled], looked: &[Option<Vec<Deviation>>]) {
    for p in points.iter_mut().filter(|p| p.code != Host::Lammps) {
        let Some(k) = physics.iter().position(|known| *known == p.setting.physics) else { continue };
        p.errors = looked[k].clone().unwrap_or_default();
        (p.samples, p.time) = sampled[k].as_ref().map_or((0, 0.0), |made| (made.samples, made.time));
        (p.stable, p.unstable) = (sampled[k].is_ok(), sampled[k].as_ref().err().cloned());
    }
}

/// Energy without thermostat, where there is one that is conserved.
fn drifts(
    origin: &Origin,
    known: Known,
    options: &Options,
    seconds: f64,
    progress: &Progress,
) -> Result<Vec<EnergyDrift>, ExperimentError> {
    if !known.temperature || options.choice == Choice::Few {
        return Ok(Vec::new());
    }
    let schemes = drift::schemes();
    let effort = Effort::Seconds(seconds / schemes.len() as f64);
    let drift = |scheme: Physics| drift::drift(origin, &scheme, effort);
    jobs::counted((progress, "energy"), schemes, drift).into_iter().collect()
}

fn point(origin: &Origin, setting: Setting, sampled: &Sampled, errors: Vec<Deviation>) -> Point {
    let (samples, time) = sampled.as_ref().map_or((0, 0.0), |made| (made.samples, made.time));
    Point {
        code: setting.host,
        integrator: recommend::short(&setting.physics.integrator),
        dt: origin.dt(&setting.physics),
        precision: setting.physics.precision.to_string(),
        threads: setting.threads.get(),
        cost: None,
        samples,
        time,
        errors,
        worst: None,
        stable: sampled.is_ok(),
        unstable: sampled.as_ref().err().cloned(),
        front: false,
        setting,
    }
}

/// A point of each run on one thread, and on more of those that matter most; errors do not depend on threads.
fn native_points(
    origin: &Origin,
    options: &Options,
    physics: &[Physics],
    sampled: &[Sampled],
    looked: &[Option<Vec<Deviation>>],
) -> Vec<Point> {
    let mut points = Vec::new();
    for ((physics, sampled), errors) in physics.iter().zip(sampled).zip(looked) {
        let errors = errors.clone().unwrap_or_default();
        let fewest = options.threads.iter().min().copied().unwrap_or(NonZeroUsize::MIN);
        let usual = match physics.integrator {
            Integrator::VelocityVerlet => physics.multiple == 1.0,
            Integrator::ForceGradient { .. } => physics.multiple >= 5.0,
            _ => false,
        };
        let matters = options.choice == Choice::Full || usual && physics.precision == Precision::Mixed;
        for &threads in &options.threads {
            if threads == fewest || (matters && sampled.is_ok()) {
                let setting = Setting { host: Host::Native, physics: *physics, threads };
                points.push(point(origin, setting, sampled, errors.clone()));
            }
        }
    }
    points
}

/// Points of the plugin with the steps of the native points, where a deck can have them.
fn plugin_points(origin: &Origin, points: &mut Vec<Point>) {
    let mut more: Vec<Point> = Vec::new();
    for p in points.iter().filter(|p| p.stable) {
        let setting = Setting { host: Host::Plugin, threads: NonZeroUsize::MIN, ..p.setting };
        let there = more.iter().any(|other| other.setting == setting);
        if !there && recommend::in_lammps(origin, &setting.physics) {
            more.push(Point { code: Host::Plugin, threads: 1, setting, ..p.clone() });
        }
    }
    points.extend(more);
}

type Own = (Option<Reference>, Vec<Point>);

fn own_points(
    origin: &Origin,
    lammps: &LammpsRuns,
    seconds: f64,
    options: &Options,
    known: Known,
    native: &Quantities,
    progress: &Progress,
) -> Result<Option<Own>, ExperimentError> {
    let Some(own) = &lammps.own else { return Ok(None) };
    let physics = OWN.map(|multiple| Physics {
        integrator: Integrator::VelocityVerlet,
        multiple,
        precision: Precision::Double,
    });
    let setting = |physics: Physics| Setting { host: Host::Lammps, physics, threads: NonZeroUsize::MIN };
    let step = lammps.time(origin, &setting(physics[2]), 40)?;
    let effort = match options.fixed {
        Some((Effort::Samples(n), _)) => Effort::Samples(n),
        _ => Effort::Seconds(WORKERS * seconds / OWN.len() as f64),
    };
    let bar = (progress, "LAMMPS's own style");
    let sample = |k: usize| lammps.sample(origin, &physics[k], effort, step, &format!("own-{k}"));
    let sampled = jobs::counted(bar, (0..OWN.len()).collect(), sample);
    let sampled: Vec<Sampled> = sampled.into_iter().collect::<Result<_, _>>()?;
    let known = if is_another_law(own) { known.of_another_law() } else { known };
    let (reference, first) = match (&sampled[0], is_another_law(own)) {
        (Ok(made), true) => (made.quantities.clone(), 1),
        (Err(_), true) => return Ok(Some((None, Vec::new()))),
        (_, false) => (native.clone(), 0),
    };
    let errors = |made: &Made| deviations(&made.quantities, &reference, known);
    let runs = physics.iter().zip(&sampled).skip(first).map(|(physics, sampled)| {
        let errors = sampled.as_ref().map_or_else(|_| Vec::new(), errors);
        point(origin, setting(*physics), sampled, errors)
    });
    let itself = is_another_law(own).then(|| reference_of(origin, &physics[0], &sampled[0], known));
    Ok(Some((itself, runs.collect())))
}

/// A reference with its own errors: of temperatures from kT where that is known, statistical ones of all else.
fn reference_of(origin: &Origin, physics: &Physics, sampled: &Sampled, known: Known) -> Reference {
    let Made { quantities, samples, time } = sampled.clone().unwrap_or_default();
    let values = deviations(&quantities, &quantities.as_if_exact(), known);
    let dt = physics.integrator.has_time().then(|| origin.dt(physics));
    Reference { what: what(origin, physics), dt, samples, time, values }
}

fn recommend(origin: &Origin, outcome: &Comparison) -> Option<Recommended> {
    let Comparison { points, tolerances, .. } = outcome;
    let best = front::cheapest(points, tolerances, &[Host::Native])?;
    let timed = front::cheapest(points, tolerances, &[Host::Plugin]);
    let setting = points[best].setting;
    let same = recommend::lammps_lines(origin, &setting.physics);
    let other = timed.or_else(|| {
        // Without LAMMPS here its cost is not known: the cheapest natively of what it can run.
        let runs: Vec<Point> =
            points.iter().filter(|p| recommend::in_lammps(origin, &p.setting.physics)).cloned().collect();
        let found = front::cheapest(&runs, tolerances, &[Host::Native])?;
        points.iter().position(|p| *p == runs[found])
    });
    let lammps_refusal = same.as_ref().err().map(ToString::to_string);
    let lammps = match other {
        None => same.ok(),
        Some(k) => recommend::lammps_lines(origin, &points[k].setting.physics).ok(),
    };
    let scene = recommend::scene_lines(origin.dt(&setting.physics), &setting);
    Some(Recommended { point: best, scene, lammps, point_in_lammps: timed, lammps_refusal })
}

#[cfg(test)]
mod tests;
