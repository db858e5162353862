//! Cases in the native runner.

use super::case::{Case, Found, Inputs, Must};
use crate::ExperimentError;
use crate::run::Observed;
use psidpd_core::document::FileError;
use psidpd_core::engine::{Precision, Settings, Want};
use psidpd_core::truth;
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::particles::State;
use psidpd_dynamics::run::{Begin, RunError, Runner, Simulation};
use psidpd_dynamics::scene::Scene;
use psidpd_formats::data::DataFile;
use psidpd_formats::files::{Existing, write_bytes};
use std::path::Path;

/// Fewer particles than these have no temperature.
pub const FEW: usize = 3;

/// Writes the files of a case into `folder` and reads its scene.
///
/// # Errors
/// Files that cannot be written; what is wrong with the scene is the inner error.
pub fn scene(
    run: &Inputs,
    integrator: Integrator,
    precision: Precision,
    folder: &Path,
) -> Result<Result<Scene, FileError>, ExperimentError> {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        write_bytes(&path, Existing::Keep, text.as_bytes())
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
pub fn carry_out(
    case: &Case,
    integrator: Integrator,
    precision: Precision,
    folder: &Path,
) -> Result<Found, ExperimentError> {
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
fn go(scene: &Scene, out: &Path) -> Result<Found, ExperimentError> {
    let mut runner = match Runner::begin(scene, out, Begin::Overwrite) {
        Ok(runner) => runner,
        Err(refusal) => return Ok(Found::Refused(refusal.to_string())),
    };
    let mut warnings = Vec::new();
    // An unusual start may be hot or cold until it has settled.
    let last = scene.stages.last().map_or("", |stage| stage.name.as_str());
    let mut note = |p: psidpd_dynamics::run::Progress| {
        let measured = p.deviations.iter().filter(|d| d.stage == last);
        warnings.extend(measured.map(ToString::to_string));
    };
    let summary = match runner.run_to_end(&mut note) {
        Ok(summary) => summary,
        Err(error) if error.is_stop() => return Ok(Found::Stopped(error.to_string())),
        Err(error) => return Err(error.into()),
    };
    let observed = Observed::read(out)?;
    let kt = scene.kt;
    let of = |column: &str| {
        let m = observed.scalar("temperature", column);
        // Without forces there is none of configurations.
        m.value.is_finite().then_some([m.value / kt, m.error / kt])
    };
    // Particles out of each other's reach have the velocities that they began with.
    let alone = summary.particles < FEW;
    let kinetic = of("kinetic").unwrap_or([f64::NAN; 2]);
    let temperatures = std::iter::once(kinetic).chain(of("configurational")).filter(|_| !alone);
    let end = DataFile::read(&out.join("final.data"))?;
    Ok(Found::Ended {
        temperatures: temperatures.collect(),
        momentum: momentum_of(&State::from_data(&end, &scene.model).map_err(RunError::from)?),
        counted: summary.out_of_bounds,
        warnings,
    })
}

/// |Σ m v| over Σ m |v|.
pub fn momentum_of(state: &State) -> f64 {
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
fn forces(scene: &Scene) -> Result<Found, ExperimentError> {
    let mut run = simulation(scene, scene.initial_state())?;
    run.set_thermostat(false);
    run.prepare(scene.stages[0].dt, Want::FORCES)?;
    let species: Vec<usize> = run.state().species.iter().map(|s| *s as usize).collect();
    let fluid = scene.model.at(scene.kt)?;
    let truth = truth::conservative(&fluid, &run.state().x, &species, &run.state().domain);
    let expected = truth.map_err(RunError::from)?.forces;
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
fn conserved(scene: &Scene, integrator: Integrator) -> Result<Found, ExperimentError> {
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
        Ok(()) => Ok(Found::Changed { energy: energy(&run) - before, momentum: momentum_of(run.state()) }),
        Err(error) => stopped(error),
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::judge;
    use super::super::{Extent, cases};
    use super::*;
    use crate::test_support::IDEAL;
    use psidpd_core::engine::Fault;

    fn carried_out(case: &Case) -> Found {
        let folder = tempfile::tempdir().unwrap();
        carry_out(case, Integrator::VelocityVerlet, Precision::Double, folder.path()).unwrap()
    }

    /// Masses of 1 and 3: 3 and −3 cancel, and both along x are the whole of Σ m |v|; at a right angle they are 1/√2 of it.
    #[test]
    fn momentum_is_a_share_of_what_it_could_be() {
        let domain = psidpd_core::engine::PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [true; 3]).unwrap();
        let state = State::at_rest(domain, vec![1.0, 3.0], vec![[1.0; 3], [2.0; 3]]);
        let of = |light: [f64; 3], heavy: [f64; 3]| {
            momentum_of(&State { v: vec![light, heavy], species: vec![0, 1], ..state.clone() })
        };
        assert_eq!(of([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 0.0);
        assert_eq!(of([3.0, 0.0, 0.0], [1.0, 0.0, 0.0]), 1.0);
        assert!((of([3.0, 0.0, 0.0], [0.0, 1.0, 0.0]) - 0.5f64.sqrt()).abs() < 1e-15);
        assert_eq!(of([0.0; 3], [0.0; 3]), 0.0);
    }

    /// A gas at kT = 4 that drifts at a velocity of 0.1 has its temperature, which that raises by 0.1²/3; what gives it away is the
    /// momentum alone: of ⟨|v|⟩ = √(8 kT/π) and the drift it is 0.031, in any frame of 192 particles within a tenth.
    #[test]
    fn a_gas_that_drifts_is_not_right() {
        let part =
            "[[part]]\nshape = \"box\"\nlow = [0.0, 0.0, 0.0]\nhigh = [4.0, 4.0, 4.0]\ndensity = 3.0\n";
        let must = Must::Right(0.04);
        let judged = |drift: &str| {
            let run = Inputs::new(IDEAL, 4.0, format!("box = 4.0\n{part}{drift}"), 0.02, [200, 2000]);
            let case = Case::new("drift", run, must);
            let found = carried_out(&case);
            (judge(must, &found, false), found)
        };
        let (right, found) = judged("");
        assert_eq!(right, Ok(()), "{found:?}");
        // Not for want of a temperature: of a gas there is the kinetic one.
        let Found::Ended { temperatures, .. } = &found else { panic!("{found:?}") };
        assert!(temperatures.len() == 1 && (temperatures[0][0] - 1.0).abs() < 0.1, "{found:?}");
        let (wrong, found) = judged("velocity = [0.1, 0.0, 0.0]\n");
        assert!(wrong.unwrap_err().starts_with("momentum"), "{found:?}");
        let Found::Ended { momentum, .. } = found else { panic!("{found:?}") };
        assert!((momentum / 0.0313 - 1.0).abs() < 0.1, "{momentum}");
    }

    /// An engine with a fault of 5 % does not do what it must, and one without does.
    #[test]
    fn faults_of_the_engine_show() {
        let named = |words: &str| {
            let found = cases(Extent::Quick).into_iter().find(|case| case.name.contains(words));
            found.unwrap_or_else(|| panic!("{words}"))
        };
        for (words, fault) in [
            ("close pairs, pair force", Fault::PairForce),
            ("close pairs, many-body force", Fault::ManyBodyForce),
            ("faces, edges and corners", Fault::Noise),
        ] {
            let case = named(words);
            for fault in [None, Some(fault)] {
                let found = Fault::during(fault, || carried_out(&case));
                let judged = judge(case.must, &found, false);
                assert_eq!(judged.is_err(), fault.is_some(), "{words}: {fault:?}: {found:?}");
                // As a part of the largest force, which is not 1 here.
                if let (Some(_), Found::Differs(part)) = (fault, &found) {
                    assert!((0.04..0.06).contains(part), "{words}: {part}");
                }
            }
        }
    }

    /// A force that is not a gradient heats a liquid without thermostat, and the case of long runs says so.
    #[test]
    fn energy_that_is_made_shows() {
        let case = cases(Extent::Quick).into_iter().find(|case| case.group == "long runs").unwrap();
        let judged = |model: String| {
            let case = Case { run: Inputs { model, ..case.run.clone() }, ..case.clone() };
            let found = carried_out(&case);
            let Found::Changed { energy, .. } = found else { panic!("{found:?}") };
            (judge(case.must, &found, false).is_ok(), energy)
        };
        let model = case.run.model.clone();
        let lucy = model.replace("kernel = \"quadratic\"", "kernel = \"lucy\"\nforce_kernel = \"quadratic\"");
        assert_ne!(model, lucy);
        let ((kept, small), (made, large)) = (judged(model), judged(lucy));
        assert!(kept && small.abs() < 0.02, "{small}");
        assert!(!made && large > 0.02, "{large}");
    }
}
