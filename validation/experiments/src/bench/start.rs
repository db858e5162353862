//! The state that every code starts from: made once, kept in the run folder.

use super::fluids::Subject;
use crate::ExperimentError;
use chacha20::ChaCha8Rng;
use psidpd_core::engine::{PeriodicBox, Settings, Want};
use psidpd_dynamics::particles::thermal_velocities;
use psidpd_dynamics::run::{Integrator, RunError, Simulation, State};
use rand::{RngExt, SeedableRng};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Seed of starts and noise.
pub const SEED: u64 = 20_030_606;

/// Steps of Δt after 100 short ones: several times the time in which a particle passes its neighbours.
const STEPS: u64 = 300;

/// A state with the data files that LAMMPS reads.
#[derive(Debug, Clone)]
pub struct Start {
    /// The particles.
    pub state: State,
    /// As `atom_style atomic`.
    pub data: PathBuf,
    /// As `atom_style mdpd`.
    pub data_mdpd: PathBuf,
}

/// Random particles at kT = 1.
pub fn random(subject: &Subject, size: usize) -> Result<State, ExperimentError> {
    let (count, edge) = (subject.particles(size), Subject::edge(size));
    if edge < 3.0 {
        return Err(ExperimentError::TooSmall(size));
    }
    let domain = PeriodicBox::orthogonal([0.0; 3], [edge; 3], [true; 3])
        .map_err(|e| RunError::State(e.to_string()))?;
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let x = (0..count).map(|_| std::array::from_fn(|_| edge * random.random::<f64>())).collect();
    let v = thermal_velocities(std::iter::repeat_n(1.0, count), 1.0, 3, &mut random);
    let kinds = subject.species.len();
    let species = (0..count).map(|k| (k % kinds) as i32).collect();
    Ok(State { species, v, ..State::at_rest(domain, vec![1.0; kinds], x) })
}

/// The fluid in equilibrium, from `folder` if it is there.
pub fn equilibrated(subject: &Subject, size: usize, folder: &Path) -> Result<Start, ExperimentError> {
    std::fs::create_dir_all(folder).map_err(ExperimentError::io(folder))?;
    // The state depends on model, seed and length of the run.
    let key = crc32fast::hash(format!("{} {SEED} {STEPS}", subject.text).as_bytes());
    let file = |end: &str| folder.join(format!("{}-{size}-{key:08x}.{end}", subject.name));
    let (kept, data, data_mdpd) = (file("state"), file("data"), file("mdpd.data"));
    let found = std::fs::read(&kept).ok().and_then(|bytes| postcard::from_bytes::<State>(&bytes).ok());
    if let Some(state) = found.filter(|_| data.is_file() && data_mdpd.is_file()) {
        return Ok(Start { state, data, data_mdpd });
    }
    let mut simulation = Simulation::new(&subject.model()?, 1.0, random(subject, size)?, SEED)?;
    let threads = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    simulation.set_settings(Settings { threads, ..Settings::default() })?;
    for (dt, steps) in [(0.1 * subject.dt, 100), (subject.dt, STEPS)] {
        simulation.prepare(dt, Want::FORCES)?;
        simulation.advance(steps, dt, Integrator::VelocityVerlet)?;
    }
    let state = simulation.state();
    let text = state.to_data("psidpd bench");
    text.write(&data)?;
    text.write_mdpd(&data_mdpd)?;
    // Written last: its presence shows that the others are complete.
    let bytes = postcard::to_stdvec(&state)
        .map_err(|e| ExperimentError::io(&kept)(std::io::Error::other(e.to_string())))?;
    psidpd_formats::files::write_atomically(&kept, &bytes)?;
    Ok(Start { state, data, data_mdpd })
}

/// Pairs closer than `range` per particle: what the cost of forces is proportional to.
pub fn pairs_per_particle(state: &State, range: f64) -> f64 {
    let lengths = state.domain.lengths();
    // At least three cells in each direction, or a neighbour would be met twice.
    let cells = lengths.map(|l| (l / range).floor().max(3.0) as usize);
    let cell_of = |x: &[f64; 3]| -> [usize; 3] {
        let s = state.domain.fraction(*x);
        std::array::from_fn(|k| ((s[k].rem_euclid(1.0) * cells[k] as f64) as usize).min(cells[k] - 1))
    };
    let index = |c: [usize; 3]| (c[2] * cells[1] + c[1]) * cells[0] + c[0];
    let mut members = vec![Vec::new(); cells.iter().product()];
    for (k, x) in state.x.iter().enumerate() {
        members[index(cell_of(x))].push(k);
    }
    let mut pairs = 0u64;
    for (i, x) in state.x.iter().enumerate() {
        let here = cell_of(x);
        for shift in 0..27 {
            let offset = [shift % 3, shift / 3 % 3, shift / 9];
            let there = std::array::from_fn(|k| (here[k] + offset[k] + cells[k] - 1) % cells[k]);
            for &j in &members[index(there)] {
                let square: f64 = (0..3)
                    .map(|k| {
                        let d = state.x[j][k] - x[k];
                        (d - lengths[k] * (d / lengths[k]).round()).powi(2)
                    })
                    .sum();
                pairs += u64::from(j > i && square < range * range);
            }
        }
    }
    pairs as f64 / state.len() as f64
}

#[cfg(test)]
mod tests {
    use super::super::fluids::{DPD, FORMULA, MDPD};
    use super::*;

    #[test]
    fn a_kept_state_is_the_one_that_was_made() {
        let folder = tempfile::tempdir().unwrap();
        let made = equilibrated(&DPD, 400, folder.path()).unwrap();
        let kept = equilibrated(&DPD, 400, folder.path()).unwrap();
        assert_eq!(made.state, kept.state);
        assert_eq!(made.state.len(), DPD.particles(400));
        assert!(matches!(random(&DPD, 20), Err(ExperimentError::TooSmall(20))));
    }

    /// A temperature of 1200 and more degrees of freedom varies by 0.04: five times that is met once in 10⁶
    /// runs. The number of pairs shows whether the liquid fell apart or collapsed.
    #[test]
    fn fluids_are_in_equilibrium() {
        let folder = tempfile::tempdir().unwrap();
        for subject in [MDPD, DPD, FORMULA] {
            let state = equilibrated(&subject, 900, folder.path()).unwrap().state;
            let temperature =
                state.v.iter().flatten().map(|v| v * v).sum::<f64>() / (3 * state.len() - 3) as f64;
            assert!((temperature - 1.0).abs() < 0.2, "{}: {temperature}", subject.name);
            let pairs = pairs_per_particle(&state, 1.0);
            let ideal = 2.0 / 3.0 * std::f64::consts::PI * subject.density;
            assert!((0.7..1.2).contains(&(pairs / ideal)), "{}: {pairs} of {ideal}", subject.name);
        }
    }

    /// By all pairs; species alternate, so that a fluid with two has as many of each.
    #[test]
    fn pairs_are_counted() {
        let state = random(&FORMULA, 400).unwrap();
        assert_eq!(state.species.iter().filter(|s| **s == 1).count(), 200);
        let edge = state.domain.lengths()[0];
        let near = |a: &[f64; 3], b: &[f64; 3]| {
            let nearest = |d: f64| (d - edge * (d / edge).round()).powi(2);
            (0..3).map(|k| nearest(a[k] - b[k])).sum::<f64>() < 1.0
        };
        let all = (0..400).map(|i| (0..i).filter(|j| near(&state.x[i], &state.x[*j])).count()).sum::<usize>();
        assert_eq!(pairs_per_particle(&state, 1.0), all as f64 / 400.0);
    }
}
