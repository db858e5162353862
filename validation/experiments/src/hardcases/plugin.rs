//! Cases in LAMMPS with the plugin: those of velocity Verlet, which a deck can have.

use super::case::{Case, Found, Must};
use super::native;
use crate::ExperimentError;
use psidpd_core::engine::Precision;
use psidpd_dynamics::integrator::Integrator;
use psidpd_lammps_host::export::lammps as deck;
use psidpd_lammps_host::{Host, LammpsError};
use std::path::{Path, PathBuf};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(600);

/// LAMMPS with the plugin.
#[derive(Debug)]
pub struct Plugin {
    host: Host,
    /// `None` where the program has the styles in it.
    plugin: Option<PathBuf>,
}

impl Plugin {
    /// The LAMMPS that is installed; builds the plugin if need be.
    ///
    /// # Errors
    /// There is none, or the plugin cannot be built.
    pub fn open(note: &dyn Fn(&str)) -> Result<Plugin, LammpsError> {
        let host = Host::find()?;
        let plugin = psidpd_lammps_host::plugin::build(&host, note)?;
        psidpd_lammps_host::plugin::check(&host, &plugin)?;
        Ok(match psidpd_lammps_host::plugin::launcher(&plugin) {
            Some(launcher) => Plugin { host: host.with_program(&launcher), plugin: None },
            None => Plugin { host, plugin: Some(plugin) },
        })
    }

    /// What must happen there, if the case is one for LAMMPS: it does not look after temperatures, so that a run may end hot,
    /// and its own tests are those of forces.
    pub fn must(case: &Case) -> Option<Must> {
        match case.must {
            Must::Right(_) | Must::Stops | Must::Counted => Some(case.must),
            _ => None,
        }
    }

    /// Carries out a case in `folder`.
    ///
    /// # Errors
    /// Files cannot be written or read, or LAMMPS takes too long.
    pub fn carry_out(
        &self,
        case: &Case,
        precision: Precision,
        folder: &Path,
    ) -> Result<Found, ExperimentError> {
        let scene = match native::scene(&case.run, Integrator::VelocityVerlet, precision, folder)? {
            Ok(scene) => scene,
            Err(refusal) => return Ok(Found::Refused(refusal.to_string())),
        };
        let out = folder.join("deck");
        if let Err(refusal) = deck::write(&scene, &out) {
            return Ok(Found::Refused(refusal.to_string()));
        }
        let path = out.join(deck::SCRIPT);
        let script = std::fs::read_to_string(&path).map_err(ExperimentError::io(&path))?;
        let counts = "compute counts all pair dpd/psi\nthermo_style custom step temp c_counts[3] c_counts[4]\nthermo 4\n";
        let (before, last) = script.rsplit_once("timestep").unwrap_or((&script, ""));
        let mut script = format!("{before}{counts}timestep{last}");
        if self.plugin.is_none() {
            script = script
                .lines()
                .filter(|l| !l.starts_with("plugin  "))
                .fold(String::new(), |a, l| a + l + "\n");
        }
        std::fs::write(&path, script).map_err(ExperimentError::io(&path))?;
        let plugin = self.plugin.as_ref().map(|p| p.display().to_string()).unwrap_or_default();
        let arguments = ["-log", "none", "-var", "plugin", plugin.as_str()];
        let text = match self.host.run_script(1, &out, &path, &arguments, LIMIT) {
            Ok(run) => run.stdout,
            Err(LammpsError::Run { errors, .. }) => return Ok(Found::Stopped(errors.to_string())),
            Err(error) => return Err(error.into()),
        };
        let rows = rows(&text);
        let of = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let mean = psidpd_observe::Measured::mean(&of(1));
        let counted = [2, 3].map(|k| of(k).last().copied().unwrap_or(0.0) as u64);
        let alone = scene.initial_state().len() < native::FEW;
        let temperatures =
            if alone { Vec::new() } else { vec![[mean.value / scene.kt, mean.error / scene.kt]] };
        Ok(Found::Ended { temperatures, momentum: 0.0, counted, warnings: Vec::new() })
    }
}

/// The rows of numbers of the last table that LAMMPS printed.
fn rows(text: &str) -> Vec<Vec<f64>> {
    let lines: Vec<&str> = text.lines().collect();
    let header = lines.iter().rposition(|line| line.split_whitespace().next() == Some("Step"));
    let table = header.map_or(&[][..], |k| &lines[k + 1..]);
    let read = |line: &&str| line.split_whitespace().map(|w| w.parse().ok()).collect::<Option<Vec<f64>>>();
    table.iter().map_while(read).filter(|row| row.len() == 4).collect()
}
