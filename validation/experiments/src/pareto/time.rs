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
    let bar = progress.bar("cost", ((pace.rounds + 1) * settings.len()) as u64);
    let clock = |setting: &Setting, steps: u64| {
        bar.advance(1);
        match (setting.host, lammps) {
            (Host::Native, _) => native(origin, setting, steps).map(Some),
            (_, Some(lammps)) => lammps.time(origin, setting, steps).map(Some),
            (_, None) => Ok(None),
        }
    };
    time_by(clock, settings, pace, |setting| origin.dt(&setting.physics))
}

/// Times settings by a clock, which gives the seconds of a step from so many steps if it has the setting.
fn time_by(
    mut clock: impl FnMut(&Setting, u64) -> Result<Option<f64>, ExperimentError>,
    settings: &[Setting],
    pace: Pace,
    dt: impl Fn(&Setting) -> f64,
) -> Result<Vec<Vec<f64>>, ExperimentError> {
    let mut steps = vec![CYCLE; settings.len()];
    let mut found = vec![Vec::new(); settings.len()];
    for round in 0..=pace.rounds {
        let order: Vec<usize> = match round % 2 {
            0 => (0..settings.len()).collect(),
            _ => (0..settings.len()).rev().collect(),
        };
        for k in order {
            let setting = &settings[k];
            let Some(per_step) = clock(setting, steps[k])? else { continue };
            // The first round finds how many steps there are in a slice.
            if round == 0 {
                let fit = (pace.seconds / per_step) as u64;
                steps[k] = (fit / CYCLE * CYCLE).clamp(CYCLE, MOST);
            } else {
                found[k].push(per_step / dt(setting));
            }
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

#[cfg(test)]
mod tests {
    use super::super::setting::{self, Choice, Physics};
    use super::*;
    use std::num::NonZeroUsize;

    /// Codes whose steps take what is known, in a machine that becomes slower by a tenth from one timing to the next: the cost of a
    /// unit of time is that of a step over Δt, all of them are timed in turn there and back, and slices last as long as they may.
    #[test]
    fn codes_of_known_pace_are_timed_as_they_are() {
        let of = |host, multiple| {
            let physics = Physics { multiple, ..setting::physics(Choice::Few)[0] };
            Setting { host, physics, threads: NonZeroUsize::MIN }
        };
        let settings = [of(Host::Native, 1.0), of(Host::Native, 4.0), of(Host::Lammps, 2.0)];
        let dt = |setting: &Setting| 0.01 * setting.physics.multiple;
        let mut asked: Vec<(f64, u64)> = Vec::new();
        let clock = |setting: &Setting, steps: u64| {
            let multiple = setting.physics.multiple;
            asked.push((multiple, steps));
            // Steps of 1 and 4 ms; nobody runs the third.
            Ok((multiple != 2.0).then(|| 1e-3 * multiple * 1.1f64.powi(asked.len() as i32 - 1)))
        };
        let found = time_by(clock, &settings, Pace { rounds: 2, seconds: 4.0 }, dt).unwrap();
        let order: Vec<f64> = asked.iter().map(|(multiple, _)| *multiple).collect();
        assert_eq!(order, [1.0, 4.0, 2.0, 2.0, 4.0, 1.0, 1.0, 4.0, 2.0]);
        assert!(asked[..3].iter().all(|(_, steps)| *steps == CYCLE), "{asked:?}");
        // 4 s are 4000 steps of 1 ms, and 909 of 4.4 ms, in whole cycles.
        for (k, fit) in [(5, 4000), (6, 4000), (4, 909), (7, 909)] {
            assert_eq!(asked[k].1, (fit / CYCLE * CYCLE).max(CYCLE), "{asked:?}");
        }
        for (found, powers) in found.iter().zip([&[5, 6][..], &[4, 7], &[]]) {
            assert_eq!(found.len(), powers.len());
            for (seconds, power) in found.iter().zip(powers) {
                assert!((seconds / (0.1 * 1.1f64.powi(*power)) - 1.0).abs() < 1e-12, "{found:?}");
            }
        }
    }
}
