//! Cases in the native runner.

use super::HardCasesError;
use super::case::{Case, Found, Must, Run};
use psidpd_core::document::FileError;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{Precision, Settings, Want};
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::particles::State;
use psidpd_dynamics::run::{Begin, Outcome, RunError, Runner, Simulation};
use psidpd_dynamics::scene::Scene;
use psidpd_formats::data::DataFile;
use psidpd_observe::Observation;
use std::path::Path;
use std::sync::atomic::AtomicUsize;

/// Fewer particles than these have no temperature.
pub const FEW: usize = 3;

/// Writes the files of a case into `folder` and reads its scene.
///
/// # Errors
/// Files that cannot be written; what is wrong with the scene is the inner error.
pub fn scene(
    run: &Run,
    integrator: Integrator,
    precision: Precision,
    folder: &Path,
) -> Result<Result<Scene, FileError>, HardCasesError> {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(HardCasesError::io(&path))
    };
    write("model.toml", &run.model)?;
    if let Some(data) = &run.data {
        write("start.data", data)?;
    }
    let [settle, measure] = run.steps;
    // Keys of the scene come before its tables.
    let text = format!(
        "title = \"hard case\"\nmodel = \"model.toml\"\nkT = {:?}\nseed = 7\ndt = {:?}\nintegrator = \"{}\"\nprecision = \"{precision}\"\n\
         equilibrate = {settle}\nsteps = {measure}\n{}\n[observe]\nevery = 4\ntemperature = true\n[output]\nthermo = 0\n\
         checkpoint = 0\n",
        run.kt,
        run.dt,
        integrator.name(),
        run.scene,
    );
    write("scene.toml", &text)?;
    Ok(Scene::open(&folder.join("scene.toml")))
}

/// Carries out a case in `folder`.
///
/// # Errors
/// Files cannot be written or read.
pub fn carry_out(
    case: &Case,
    integrator: Integrator,
    precision: Precision,
    folder: &Path,
) -> Result<Found, HardCasesError> {
    let scene = match scene(&case.run, integrator, precision, folder)? {
        Ok(scene) => scene,
        Err(refusal) => return Ok(Found::Refused(refusal.to_string())),
    };
    match case.must {
        Must::Agrees(_) => forces(&scene),
        Must::Conserves(_) => conserved(&scene, integrator),
        _ => go(&scene, &folder.join("out")),
    }
}

/// Runs a scene as `psidpd run` does.
fn go(scene: &Scene, out: &Path) -> Result<Found, HardCasesError> {
    let mut runner = match Runner::begin(scene, out, Begin::Overwrite) {
        Ok(runner) => runner,
        Err(refusal) => return Ok(Found::Refused(refusal.to_string())),
    };
    let mut warnings = Vec::new();
    let never = AtomicUsize::new(0);
    // An unusual start may be hot or cold until it has settled.
    let last = scene.stages.last().map_or("", |stage| stage.name.as_str());
    let mut note = |p: psidpd_dynamics::run::Progress| {
        let measured = p.deviations.iter().filter(|d| d.stage == last);
        warnings.extend(measured.map(ToString::to_string));
    };
    let summary = loop {
        match runner.run(&never, &mut note) {
            Ok(Outcome::Finished { summary, .. }) => break summary,
            Ok(Outcome::Interrupted { .. }) => {}
            Err(error) if error.is_stop() => return Ok(Found::Stopped(error.to_string())),
            Err(error) => return Err(error.into()),
        }
    };
    let path = out.join("observables.json");
    let text = std::fs::read_to_string(&path).map_err(HardCasesError::io(&path))?;
    let observed: Vec<Observation> =
        serde_json::from_str(&text).map_err(|e| HardCasesError::io(&path)(e.into()))?;
    let kt = scene.kt;
    let of = |column: &str| {
        let m = observed.iter().find(|o| o.name == "temperature").and_then(|o| o.scalar(column))?;
        // Without forces there is none of configurations.
        m.value.is_finite().then_some([m.value / kt, m.error / kt])
    };
    // Particles out of each other's reach have the velocities that they began with.
    let alone = summary.particles < FEW;
    let temperatures = ["kinetic", "configurational"].into_iter().filter_map(of).filter(|_| !alone);
    let end = DataFile::read(&out.join("final.data"))?;
    Ok(Found::Ended {
        temperatures: temperatures.collect(),
        momentum: momentum_of(&State::from_data(&end, &scene.model).map_err(RunError::from)?),
        counted: summary.out_of_bounds,
        warnings,
    })
}

/// |Σ m v| over Σ m |v|.
fn momentum_of(state: &State) -> f64 {
    let (mut sum, mut whole) = ([0.0; 3], 0.0);
    for (v, s) in state.v.iter().zip(&state.species) {
        let m = state.mass[*s as usize];
        (0..3).for_each(|c| sum[c] += m * v[c]);
        whole += m * v.iter().map(|c| c * c).sum::<f64>().sqrt();
    }
    let size = sum.iter().map(|c| c * c).sum::<f64>().sqrt();
    if whole > 0.0 { size / whole } else { 0.0 }
}

/// The forces at the start against those of the reference.
fn forces(scene: &Scene) -> Result<Found, HardCasesError> {
    let mut run = simulation(scene, scene.initial_state())?;
    run.set_thermostat(false);
    run.prepare(scene.stages[0].dt, Want::FORCES)?;
    let evaluator = Evaluator::new(scene.model.at(scene.kt)?).map_err(RunError::from)?;
    let expected = evaluator.evaluate(run.positions(), run.species(), run.domain()).forces;
    let largest = expected.iter().flatten().fold(f64::MIN_POSITIVE, |m, c| m.max(c.abs()));
    let pairs = expected.iter().flatten().zip(run.forces().iter().flatten());
    let differs = pairs.map(|(a, b)| (a - b).abs() / largest).fold(0.0, f64::max);
    Ok(Found::Differs(differs))
}

fn simulation(scene: &Scene, state: State) -> Result<Simulation, RunError> {
    let mut run = scene.simulation(state)?;
    run.set_settings(Settings { precision: scene.precision(), ..Settings::default() })?;
    run.set_reordering(true);
    Ok(run)
}

/// Energy and momentum after the first stage with thermostat and the second without.
fn conserved(scene: &Scene, integrator: Integrator) -> Result<Found, HardCasesError> {
    let stopped = |error: RunError| Ok(Found::Stopped(error.to_string()));
    let mut run = simulation(scene, scene.initial_state())?;
    let [settle, measure] = [0, 1].map(|k| &scene.stages[k]);
    run.prepare_for(integrator, settle.dt, Want::FORCES)?;
    if let Err(error) = run.advance(settle.steps, settle.dt, integrator) {
        return stopped(error);
    }
    run.set_thermostat(false);
    run.prepare_for(integrator, measure.dt, Want::TOTALS)?;
    let energy =
        |run: &Simulation| (run.kinetic_energy() + run.potential_energy()) / run.len() as f64 / scene.kt;
    let before = energy(&run);
    let made = run
        .advance(measure.steps - 1, measure.dt, integrator)
        .and_then(|()| run.step(measure.dt, integrator, Want::TOTALS));
    match made {
        Ok(()) => Ok(Found::Changed { energy: energy(&run) - before, momentum: momentum_of(&run.state()) }),
        Err(error) => stopped(error),
    }
}
