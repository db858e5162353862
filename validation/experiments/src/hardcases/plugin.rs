//! Cases in LAMMPS with the plugin: those of velocity Verlet, which a deck can have.

use super::case::{Case, Found, Must};
use super::native;
use crate::ExperimentError;
use crate::lammps::host::PluginHost;
use crate::lammps::log::rows;
use psidpd_core::engine::Precision;
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::particles::State;
use psidpd_dynamics::run::RunError;
use psidpd_dynamics::scene::Scene;
use psidpd_formats::data::DataFile;
use psidpd_formats::files::Existing;
use psidpd_lammps_host::LammpsError;
use psidpd_lammps_host::export::lammps::{self as deck, Script};
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(600);

/// What must happen there, if the case is one for LAMMPS: it does not look after temperatures, so that a run may end hot, and
/// its own tests are those of forces.
pub fn must(case: &Case) -> Option<Must> {
    match case.must {
        Must::Right(_) | Must::Stops | Must::Counted => Some(case.must),
        _ => None,
    }
}

pub fn carry_out(
    lammps: &PluginHost,
    case: &Case,
    precision: Precision,
    folder: &Path,
) -> Result<Found, ExperimentError> {
    let scene = match native::scene(&case.run, Integrator::VelocityVerlet, precision, folder)? {
        Ok(scene) => scene,
        Err(refusal) => return Ok(Found::Refused(refusal.to_string())),
    };
    let out = folder.join("deck");
    let before_last_run =
        "compute counts all pair dpd/psi\nthermo_style custom step temp c_counts[3] c_counts[4]\nthermo 4\n";
    let script = Script { plugin: lammps.plugin.is_some(), before_last_run, ..Script::default() };
    let written = deck::write_inputs(&scene, &scene.initial_state(), &out, Existing::Keep)
        .and_then(|_| deck::script_of(&scene, script));
    let script = match written {
        Ok(script) => script,
        Err(refusal) => return Ok(Found::Refused(refusal.to_string())),
    };
    let text = match lammps.run(1, &out, &script, "none", LIMIT) {
        Ok(text) => text,
        Err(ExperimentError::Lammps(LammpsError::Run { errors, .. })) => {
            return Ok(Found::Stopped(errors.to_string()));
        }
        Err(error) => return Err(error),
    };
    let end = DataFile::read(&out.join("final.data"))?;
    Ok(ended(&scene, &text, &State::from_data(&end, &scene.model).map_err(RunError::from)?))
}

/// What a run of a scene ended with: by the last table that LAMMPS printed, and with what velocities.
fn ended(scene: &Scene, text: &str, end: &State) -> Found {
    let rows = rows(text, 4);
    let of = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let mean = psidpd_observe::Measured::mean(&of(1));
    let counted = [2, 3].map(|k| of(k).last().copied().unwrap_or(0.0) as u64);
    let alone = end.x.len() < native::FEW;
    let temperatures = if alone { Vec::new() } else { vec![[mean.value / scene.kt, mean.error / scene.kt]] };
    Found::Ended { temperatures, momentum: native::momentum_of(end), counted, warnings: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardcases::case::judge;
    use crate::test_support::{IDEAL, scene};

    /// Three particles of mass 2 at kT = 2, whose velocities add up to a drift along x, and LAMMPS's table with temperatures
    /// of 2.1 and 1.9 in turns; the counts are those of the last row.
    fn run(drift: f64) -> (Scene, String, State) {
        let text = "title = \"t\"\nmodel = \"m.toml\"\nkT = 2.0\nseed = 7\nbox = 4.0\ndensity = 1.0\nsteps = 5\ndt = 0.01\n";
        let scene = scene(IDEAL, text).unwrap();
        let domain = scene.initial_state().domain;
        let mut end = State::at_rest(domain, vec![2.0], vec![[1.0; 3], [2.0; 3], [3.0; 3]]);
        end.v = vec![[2.0 + drift, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]];
        let row =
            |k: u32| format!("{} {} {} 3\n", 4 * k, if k.is_multiple_of(2) { 2.1 } else { 1.9 }, k / 20);
        let table: String = (0..50).map(row).collect();
        let printed = format!(
            "Step Temp c_counts[3] c_counts[4]\n0 9.0 0 0\nLoop time\n\nStep Temp c_counts[3] c_counts[4]\n{table}Loop time"
        );
        (scene, printed, end)
    }

    /// The temperature is in units of kT, the momentum that of the velocities at the end: 0.006 of 2 + 2√2, and a run that drifts is
    /// not right.
    #[test]
    fn what_lammps_ends_with_is_measured() {
        let (scene, text, end) = run(0.006);
        let found = ended(&scene, &text, &end);
        let Found::Ended { temperatures, momentum, counted, .. } = &found else { panic!("{found:?}") };
        let [[temperature, error]] = temperatures[..] else { panic!("{found:?}") };
        assert!((temperature - 1.0).abs() < 1e-12 && error > 0.0 && error < 0.02, "{found:?}");
        assert!((momentum - 0.006 / (2.006 + 8f64.sqrt())).abs() < 1e-12, "{found:?}");
        assert_eq!(*counted, [2, 3]);
        assert!(judge(Must::Right(0.03), &found, false).unwrap_err().starts_with("momentum"));
        let (scene, text, end) = run(0.0);
        assert_eq!(judge(Must::Right(0.03), &ended(&scene, &text, &end), false), Ok(()));
        // Twice the temperature is none that must be.
        let hot = text.replace(" 1.9 ", " 4.1 ");
        assert!(judge(Must::Right(0.03), &ended(&scene, &hot, &end), false).is_err());
    }

    /// A lone particle has no temperature.
    #[test]
    fn few_particles_have_no_temperature() {
        let (scene, text, mut end) = run(0.0);
        end.x.truncate(2);
        end.v.truncate(2);
        end.species.truncate(2);
        let Found::Ended { temperatures, .. } = ended(&scene, &text, &end) else { panic!("not ended") };
        assert!(temperatures.is_empty(), "{temperatures:?}");
    }
}
