//! Speed against error: what a unit of simulated time costs with each setting, and how far off its results are.
//!
//! [`setting`] says what is tried, [`origin`] where all begin, [`sample`] runs a setting for its errors and [`time`] all of them
//! in turn for their cost; [`quantity`] holds results against the reference, [`front`] and [`recommend`] choose.

mod drift;
mod error;
mod front;
mod lammps;
mod origin;
mod outcome;
mod own_style;
pub mod page;
mod quantity;
mod recommend;
mod sample;
mod setting;
mod time;
mod tolerance;

use drift::EnergyDrift;
pub use error::ParetoError;
use outcome::{Outcome, Point, Reference};
use quantity::Deviation;
pub use sample::Effort;
pub use setting::Choice;
use setting::Host;
pub use time::Pace;
pub use tolerance::Tolerance;

use crate::bench::Spread;
use crate::crosscheck::jobs::{self, Job};
use crate::crosscheck::machine;
use crate::files::write_atomically;
use crate::integrator::Integrator;
use crate::report::Progress;
use crate::scene::Scene;
use lammps::Lammps;
use origin::Origin;
use psidpd_core::engine::Precision;
use quantity::{Known, Quantities, deviations};
use sample::Sampled;
use setting::{Physics, Setting};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

/// What `psidpd pareto` is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// Minutes that all of it may take, roughly.
    pub minutes: f64,
    /// Which settings.
    pub choice: Choice,
    /// Thread counts.
    pub threads: Vec<NonZeroUsize>,
    /// Tolerances.
    pub tolerances: Vec<Tolerance>,
    /// Whether LAMMPS is asked too, if it is installed.
    pub lammps: bool,
    /// How much of each setting is sampled, and how it is timed; by the minutes if left out.
    pub fixed: Option<(Effort, Pace)>,
    /// Folder for `pareto.json` and `pareto.html`.
    pub out: PathBuf,
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

/// The runs of LAMMPS's own style, in units of the scene's Δt; the first is its reference.
const OWN: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 3.0];

/// Holds the settings of a scene against each other, and writes `pareto.json` and `pareto.html`.
///
/// # Errors
/// The scene cannot be run with its own step, or something cannot be written.
pub fn run(scene: &Scene, options: &Options, progress: &Progress) -> Result<Outcome, ParetoError> {
    std::fs::create_dir_all(&options.out).map_err(ParetoError::io(&options.out))?;
    let out = options.out.canonicalize().map_err(ParetoError::io(&options.out))?;
    let seconds = 60.0 * options.minutes;
    let all = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let spinner = progress.spinner("start");
    let origin = Origin::of(scene, Duration::from_secs_f64(START * seconds), all)?;
    spinner.finish();
    let known = known(&origin)?;
    let mut left_out = Vec::new();
    let lammps = match options.lammps {
        true => match Lammps::open(&origin, &out.join("runs"), &|line| progress.note(line)) {
            Ok(lammps) => Some(lammps),
            Err(error) => {
                left_out.push(format!("LAMMPS is not among the points: {error}."));
                None
            }
        },
        false => None,
    };

    let share = if lammps.is_some() { SAMPLING } else { SAMPLING + LAMMPS };
    let physics = setting::physics(options.choice);
    let weights = physics.len() as f64 + REFERENCE;
    let effort = options.fixed.map_or(Effort::Seconds(WORKERS * share * seconds / weights), |fixed| fixed.0);
    let (reference, sampled) = sample_all(&origin, &physics, effort, progress)?;
    let reference_quantities = match &reference {
        Sampled::Made { quantities, .. } => quantities.clone(),
        Sampled::Unstable(why) => {
            return Err(ParetoError::Reference {
                what: what(&origin, &Physics::reference()),
                why: why.clone(),
            });
        }
    };
    let drifts = drifts(&origin, known, options, DRIFTS * WORKERS * seconds, progress)?;

    let mut points =
        native_points(&origin, options, &physics, &sampled, |q| deviations(q, &reference_quantities, known));
    let mut lammps_reference = None;
    if let Some(lammps) = &lammps {
        plugin_points(&origin, &mut points);
        match own_points(&origin, lammps, LAMMPS * seconds, options, known, &reference_quantities, progress) {
            Ok(Some((reference, own))) => {
                lammps_reference = reference;
                points.extend(own);
            }
            Ok(None) => {
                left_out.push("LAMMPS has no style of its own for this fluid that is known here.".into())
            }
            Err(error) => left_out.push(format!("LAMMPS's own style is not among the points: {error}.")),
        }
    }

    let stable: Vec<usize> = (0..points.len()).filter(|k| points[*k].unstable.is_none()).collect();
    let settings: Vec<Setting> = stable.iter().map(|k| points[*k].setting).collect();
    let slices = ((ROUNDS + 1) * settings.len().max(1)) as f64;
    let pace =
        options.fixed.map_or(Pace { rounds: ROUNDS, seconds: TIMING * seconds / slices }, |fixed| fixed.1);
    let costs = time::time(&origin, &settings, lammps.as_ref(), pace, progress)?;
    for (k, cost) in stable.into_iter().zip(costs) {
        points[k].cost = Spread::of(&cost);
    }
    front::mark(&mut points);

    if let Some(class) = front::unmeasured(&points, &options.tolerances) {
        return Err(ParetoError::Unmeasured(class));
    }
    let mut outcome = Outcome {
        format: 1,
        version: env!("CARGO_PKG_VERSION"),
        machine: machine(),
        scene: scene.title.clone(),
        stage: origin.stage.name.clone(),
        particles: origin.state.len(),
        kt: origin.stage.kt,
        dt: origin.stage.dt,
        temperature_is_known: known.kt.is_some(),
        reference: reference_of(&origin, &Physics::reference(), &reference, known),
        lammps_reference,
        left_out,
        points,
        drifts,
        tolerances: options.tolerances.clone(),
        cheapest: None,
        cheapest_in_lammps: None,
        scene_lines: None,
        lammps_lines: None,
        lammps_refusal: None,
    };
    recommend(&origin, &mut outcome);
    let json = serde_json::to_string_pretty(&outcome)
        .map_err(|e| ParetoError::io(out.join("pareto.json"))(e.into()))?;
    write_atomically(out.join("pareto.json"), (json + "\n").as_bytes())?;
    write_atomically(out.join("pareto.html"), page::report(&outcome)?.as_bytes())?;
    Ok(outcome)
}

/// A setting in words.
fn what(origin: &Origin, physics: &Physics) -> String {
    let integrator = recommend::short(&physics.integrator);
    format!("{integrator}, dt = {}, {} precision", origin.dt(physics), physics.precision)
}

/// Whether velocities have a distribution that is known, and what pressures are held against.
fn known(origin: &Origin) -> Result<Known, ParetoError> {
    let (scene, stage) = (origin.scene, origin.stage);
    let flows = stage.body_forces && !scene.body_forces.is_empty();
    let conservative = scene.model.at(stage.kt)?.is_conservative();
    let volume = origin.state.domain.volume(scene.model.dimensions());
    Ok(Known {
        kt: (conservative && !flows).then_some(stage.kt),
        ideal_pressure: origin.state.len() as f64 * stage.kt / volume,
    })
}

/// The reference, and every setting's run; two at once.
fn sample_all(
    origin: &Origin,
    physics: &[Physics],
    effort: Effort,
    progress: &Progress,
) -> Result<(Sampled, Vec<Sampled>), ParetoError> {
    let bar = progress.bar("errors", physics.len() as u64 + 1);
    let reference = Physics::reference();
    let mut jobs: Vec<Job<Result<Sampled, ParetoError>>> = Vec::new();
    for (k, physics) in std::iter::once(&reference).chain(physics).enumerate() {
        let effort = if k == 0 { effort.times(REFERENCE) } else { effort };
        let bar = bar.clone();
        jobs.push(Box::new(move || {
            let sampled = sample::sample(origin, physics, effort);
            bar.advance(1);
            sampled
        }));
    }
    let mut found: Vec<Sampled> = jobs::run(jobs).into_iter().collect::<Result<_, _>>()?;
    bar.finish();
    let sampled = found.split_off(1);
    Ok((found.swap_remove(0), sampled))
}

/// Energy without thermostat, where there is one that is conserved.
fn drifts(
    origin: &Origin,
    known: Known,
    options: &Options,
    seconds: f64,
    progress: &Progress,
) -> Result<Vec<EnergyDrift>, ParetoError> {
    if known.kt.is_none() || options.choice == Choice::Few {
        return Ok(Vec::new());
    }
    let schemes = drift::schemes();
    let effort = Effort::Seconds(seconds / schemes.len() as f64);
    let bar = progress.bar("energy", schemes.len() as u64);
    let mut jobs: Vec<Job<Result<EnergyDrift, ParetoError>>> = Vec::new();
    for scheme in &schemes {
        let bar = bar.clone();
        jobs.push(Box::new(move || {
            let found = drift::drift(origin, scheme, effort);
            bar.advance(1);
            found
        }));
    }
    let found = jobs::run(jobs).into_iter().collect();
    bar.finish();
    found
}

fn point(origin: &Origin, setting: Setting, sampled: &Sampled, errors: Vec<Deviation>) -> Point {
    let (samples, time, unstable) = match sampled {
        Sampled::Made { samples, time, .. } => (*samples, *time, None),
        Sampled::Unstable(why) => (0, 0.0, Some(why.clone())),
    };
    Point {
        host: setting.host,
        integrator: recommend::short(&setting.physics.integrator),
        dt: origin.dt(&setting.physics),
        precision: setting.physics.precision.to_string(),
        threads: setting.threads.get(),
        cost: None,
        samples,
        time,
        errors,
        unstable,
        front: Vec::new(),
        setting,
    }
}

/// A point of each run on one thread, and on more of those that matter most; errors do not depend on threads.
fn native_points(
    origin: &Origin,
    options: &Options,
    physics: &[Physics],
    sampled: &[Sampled],
    errors: impl Fn(&Quantities) -> Vec<Deviation>,
) -> Vec<Point> {
    let mut points = Vec::new();
    for (physics, sampled) in physics.iter().zip(sampled) {
        let errors = match sampled {
            Sampled::Made { quantities, .. } => errors(quantities),
            Sampled::Unstable(_) => Vec::new(),
        };
        let fewest = options.threads.iter().min().copied().unwrap_or(NonZeroUsize::MIN);
        let usual = match physics.integrator {
            Integrator::VelocityVerlet => physics.multiple == 1.0,
            Integrator::TwoStage { .. } => physics.multiple >= 4.0,
            _ => false,
        };
        let matters = options.choice == Choice::Full || usual && physics.precision == Precision::Mixed;
        for &threads in &options.threads {
            if threads == fewest || (matters && matches!(sampled, Sampled::Made { .. })) {
                let setting = Setting { host: Host::Native, physics: *physics, threads };
                points.push(point(origin, setting, sampled, errors.clone()));
            }
        }
    }
    points
}

/// The same steps by the plugin, where a deck can have them.
fn plugin_points(origin: &Origin, points: &mut Vec<Point>) {
    let mut more: Vec<Point> = Vec::new();
    for p in points.iter().filter(|p| p.unstable.is_none()) {
        let setting = Setting { host: Host::Plugin, threads: NonZeroUsize::MIN, ..p.setting };
        let there = more.iter().any(|other| other.setting == setting);
        if !there && recommend::in_lammps(origin, &setting.physics) {
            more.push(Point { host: Host::Plugin, threads: 1, setting, ..p.clone() });
        }
    }
    points.extend(more);
}

type Own = (Option<Reference>, Vec<Point>);

/// LAMMPS's own style.
fn own_points(
    origin: &Origin,
    lammps: &Lammps,
    seconds: f64,
    options: &Options,
    known: Known,
    native: &Quantities,
    progress: &Progress,
) -> Result<Option<Own>, ParetoError> {
    let Some(own) = lammps.own else { return Ok(None) };
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
    let bar = progress.bar("LAMMPS's own style", OWN.len() as u64);
    let mut jobs: Vec<Job<Result<Sampled, ParetoError>>> = Vec::new();
    for (k, physics) in physics.iter().enumerate() {
        let bar = bar.clone();
        jobs.push(Box::new(move || {
            let found = lammps.sample(origin, physics, effort, step, &format!("own-{k}"));
            bar.advance(1);
            found
        }));
    }
    let sampled: Vec<Sampled> = jobs::run(jobs).into_iter().collect::<Result<_, _>>()?;
    bar.finish();
    let mut known = known;
    let (reference, first) = match (&sampled[0], own.is_another_law()) {
        (Sampled::Made { quantities, .. }, true) => {
            known.kt = None;
            (quantities.as_ref().clone(), 1)
        }
        (Sampled::Unstable(_), true) => return Ok(Some((None, Vec::new()))),
        (_, false) => (native.clone(), 0),
    };
    let mut points = Vec::new();
    for (physics, sampled) in physics.iter().zip(&sampled).skip(first) {
        let errors = match sampled {
            Sampled::Made { quantities, .. } => deviations(quantities, &reference, known),
            Sampled::Unstable(_) => Vec::new(),
        };
        points.push(point(origin, setting(*physics), sampled, errors));
    }
    let itself = own.is_another_law().then(|| reference_of(origin, &physics[0], &sampled[0], known));
    Ok(Some((itself, points)))
}

/// A reference with its own errors: of temperatures from kT where that is known, statistical ones of all else.
fn reference_of(origin: &Origin, physics: &Physics, sampled: &Sampled, known: Known) -> Reference {
    let (values, samples, time) = match sampled {
        Sampled::Made { quantities, samples, time } => {
            (deviations(quantities, &quantities.as_if_exact(), known), *samples, *time)
        }
        Sampled::Unstable(_) => (Vec::new(), 0, 0.0),
    };
    Reference { what: what(origin, physics), dt: origin.dt(physics), samples, time, values }
}

fn recommend(origin: &Origin, outcome: &mut Outcome) {
    let best = |hosts: &[Host]| front::cheapest(&outcome.points, &outcome.tolerances, hosts);
    let (cheapest, in_lammps) = (best(&[Host::Native]), best(&[Host::Plugin]));
    outcome.cheapest = cheapest;
    outcome.cheapest_in_lammps = in_lammps;
    let Some(point) = cheapest.and_then(|k| outcome.points.get(k)) else { return };
    let setting = point.setting;
    let lines = recommend::lammps_lines(origin, &setting.physics);
    let other = in_lammps.and_then(|k| outcome.points.get(k)).map(|p| p.setting.physics);
    outcome.scene_lines = Some(recommend::scene_lines(origin.dt(&setting.physics), &setting));
    match (lines, other) {
        (Ok(lines), None) => outcome.lammps_lines = Some(lines),
        (result, Some(other)) => {
            outcome.lammps_refusal = result.err().map(|e| e.to_string());
            outcome.lammps_lines = recommend::lammps_lines(origin, &other).ok();
        }
        (Err(refusal), None) => {
            outcome.lammps_refusal = Some(refusal.to_string());
            // Without LAMMPS here its cost is not known: the cheapest natively of what it can run.
            let runs = |p: &&Point| recommend::in_lammps(origin, &p.setting.physics);
            let within = |p: &&Point| outcome.tolerances.iter().all(|t| p.is_within(t) == Some(true));
            let cost = |p: &&Point| p.cost.as_ref().map_or(f64::INFINITY, |c| c.median);
            let native = outcome.points.iter().filter(|p| p.host == Host::Native && p.unstable.is_none());
            let found = native.filter(runs).filter(within).min_by(|a, b| cost(a).total_cmp(&cost(b)));
            outcome.lammps_lines =
                found.and_then(|p| recommend::lammps_lines(origin, &p.setting.physics).ok());
        }
    }
}

#[cfg(test)]
mod tests;
