//! Cases in LAMMPS with the plugin: those of velocity Verlet, which a deck can have.

use super::case::{Case, Found, Must};
use super::native;
use crate::ExperimentError;
use crate::lammps::host::PluginHost;
use crate::lammps::log::rows;
use psidpd_core::engine::Precision;
use psidpd_dynamics::integrator::Integrator;
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
    let rows = rows(&text, 4);
    let of = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let mean = psidpd_observe::Measured::mean(&of(1));
    let counted = [2, 3].map(|k| of(k).last().copied().unwrap_or(0.0) as u64);
    let alone = scene.initial_state().len() < native::FEW;
    let temperatures = if alone { Vec::new() } else { vec![[mean.value / scene.kt, mean.error / scene.kt]] };
    Ok(Found::Ended { temperatures, momentum: 0.0, counted, warnings: Vec::new() })
}
