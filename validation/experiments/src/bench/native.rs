//! Timed runs of the native runner, and the test that threads change no bit.

use super::length::Length;
use crate::ExperimentError;
use crate::fluids::Subject;
use crate::lammps::log::Loop;
use crate::start::SEED;
use psidpd_core::engine::{Settings, Want};
use psidpd_dynamics::run::{Integrator, Simulation, State};
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::time::Instant;

fn simulation(
    subject: &Subject,
    state: &State,
    settings: Option<Settings>,
) -> Result<Simulation, ExperimentError> {
    let mut simulation = Simulation::new(&subject.model()?, 1.0, state.clone(), SEED)?;
    match settings {
        Some(settings) => {
            simulation.set_settings(settings)?;
            simulation.set_reordering(true);
        }
        None => simulation.use_pair_sums_only(true),
    }
    simulation.prepare(subject.dt, Want::FORCES)?;
    Ok(simulation)
}

fn advance(simulation: &mut Simulation, subject: &Subject, steps: u64) -> Result<(), ExperimentError> {
    Ok(simulation.advance(steps, subject.dt, Integrator::VelocityVerlet)?)
}

/// Times steps with these settings, or of the reference if there are none, which tells no parts.
pub fn run(
    subject: &Subject,
    state: &State,
    settings: Option<Settings>,
    length: Length,
) -> Result<Loop, ExperimentError> {
    let mut simulation = simulation(subject, state, settings)?;
    advance(&mut simulation, subject, length.warm_up)?;
    let before = simulation.engine().statistics().times;
    let start = Instant::now();
    advance(&mut simulation, subject, length.steps)?;
    let seconds = start.elapsed().as_secs_f64();
    let after = simulation.engine().statistics().times;
    let mut parts = BTreeMap::new();
    if settings.is_some() {
        let named = [
            ("sort", after.sort - before.sort),
            ("pairs", after.first - before.first),
            ("psi", after.excess - before.excess),
            ("many-body", after.second - before.second),
            ("forces", after.forces - before.forces),
        ];
        let rest = seconds - named.iter().map(|(_, t)| t).sum::<f64>();
        parts.extend(named.map(|(name, t)| (name.to_owned(), t)));
        parts.insert("integrate".to_owned(), rest);
    }
    Ok(Loop { seconds, steps: length.steps, particles: state.len(), parts, ..Loop::default() })
}

/// Whether trajectories of some steps on each number of threads are the same, bit for bit.
pub fn equal_on_threads(
    subject: &Subject,
    state: &State,
    settings: Settings,
    threads: &[NonZeroUsize],
) -> Result<bool, ExperimentError> {
    let mut first: Option<State> = None;
    for &threads in threads {
        let mut simulation = simulation(subject, state, Some(Settings { threads, ..settings }))?;
        advance(&mut simulation, subject, 20)?;
        let end = simulation.state().clone();
        let bits = |s: &State| s.x.iter().chain(&s.v).flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
        if first.as_ref().is_some_and(|first| bits(first) != bits(&end)) {
            return Ok(false);
        }
        first.get_or_insert(end);
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluids::{FORMULA, SUBJECTS};
    use crate::start::kept;
    use psidpd_core::engine::Precision;

    #[test]
    fn parts_add_up_to_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let start = kept(&FORMULA, 400, folder.path()).unwrap();
        let length = Length { warm_up: 1, steps: 3 };
        let measured = run(&FORMULA, &start.state, Some(Settings::default()), length).unwrap();
        let sum: f64 = measured.parts.values().sum();
        assert!((sum - measured.seconds).abs() < 1e-9 * measured.seconds);
        assert!(measured.parts.values().all(|t| *t >= 0.0), "{:?}", measured.parts);
        let plain = run(&FORMULA, &start.state, None, length).unwrap();
        assert!(plain.seconds > 0.0 && plain.parts.is_empty());
    }

    #[test]
    fn threads_change_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let threads = [1, 2, 3].map(|n| NonZeroUsize::new(n).unwrap());
        for subject in &SUBJECTS {
            let start = kept(subject, 400, folder.path()).unwrap();
            for (_, precision) in Precision::ALL {
                let settings = Settings { precision, ..Settings::default() };
                assert!(equal_on_threads(subject, &start.state, settings, &threads).unwrap());
            }
        }
    }
}
