//! What settings cost: all of them in turn, round after round, so that what slows the machine for a while slows all.

use super::lammps::LammpsRuns;
use super::origin::Origin;
use super::setting::Setting;
use crate::ExperimentError;
use crate::code::Host;
use psidpd_core::engine::Want;
use psidpd_report::Progress;
use std::time::Instant;

/// How long everything is timed for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    pub rounds: usize,
    /// Seconds of a setting in a round, if that is enough for the fewest steps.
    pub seconds: f64,
}

/// Whole cycles of what the native runner does at every so many steps.
const CYCLE: u64 = psidpd_dynamics::run::REORDERING;
const MOST: u64 = 1 << 16;

/// Wall seconds for a unit of simulated time: of every setting, in every round.
pub fn time(
    origin: &Origin,
    settings: &[Setting],
    lammps: Option<&LammpsRuns>,
    pace: Pace,
    progress: &Progress,
) -> Result<Vec<Vec<f64>>, ExperimentError> {
    let mut steps = vec![CYCLE; settings.len()];
    let mut found = vec![Vec::new(); settings.len()];
    let bar = progress.bar("cost", ((pace.rounds + 1) * settings.len()) as u64);
    for round in 0..=pace.rounds {
        let order: Vec<usize> = match round % 2 {
            0 => (0..settings.len()).collect(),
            _ => (0..settings.len()).rev().collect(),
        };
        for k in order {
            let setting = &settings[k];
            let per_step = match (setting.host, lammps) {
                (Host::Native, _) => native(origin, setting, steps[k])?,
                (_, Some(lammps)) => lammps.time(origin, setting, steps[k])?,
                (_, None) => continue,
            };
            // The first round finds how many steps there are in a slice.
            if round == 0 {
                let fit = (pace.seconds / per_step) as u64;
                steps[k] = (fit / CYCLE * CYCLE).clamp(CYCLE, MOST);
            } else {
                found[k].push(per_step / origin.dt(&setting.physics));
            }
            bar.advance(1);
        }
    }
    Ok(found)
}

fn native(origin: &Origin, setting: &Setting, steps: u64) -> Result<f64, ExperimentError> {
    let physics = &setting.physics;
    let dt = origin.dt(physics);
    let mut run = origin.simulation(physics, setting.threads, true, Want::FORCES)?;
    let what = || format!("timing {} at dt = {dt}", physics.integrator);
    let failed = |source| ExperimentError::Stopped { what: what(), source: Box::new(source) };
    run.advance(CYCLE, dt, physics.integrator).map_err(failed)?;
    let begin = Instant::now();
    run.advance(steps, dt, physics.integrator).map_err(failed)?;
    Ok(begin.elapsed().as_secs_f64() / steps as f64)
}
