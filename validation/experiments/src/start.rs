//! Configurations that codes start from: random, then brought to equilibrium by the native runner.

use crate::ExperimentError;
use crate::fluids::Subject;
use crate::machine::VERSION;
use chacha20::ChaCha8Rng;
use psidpd_core::engine::{PeriodicBox, Precision, Settings, Want};
use psidpd_core::model::Model;
use psidpd_dynamics::particles::maxwell;
use psidpd_dynamics::run::{Integrator, RunError, Simulation, State};
use psidpd_formats::files::{Existing, read_inside, work_folder, write_bytes};
use rand::{RngExt, SeedableRng};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// A box and how much of it is filled along z.
#[derive(Debug, Clone, Copy)]
pub struct Filling {
    pub lengths: [f64; 3],
    /// Height of the filled part, centred.
    pub thickness: f64,
}

impl Filling {
    pub fn cube(edge: f64) -> Filling {
        Filling { lengths: [edge; 3], thickness: edge }
    }

    /// The cube that fluids of a size are timed in.
    pub fn of_size(size: usize) -> Result<Filling, ExperimentError> {
        let edge = Subject::edge(size);
        if edge < 3.0 { Err(ExperimentError::TooSmall(size)) } else { Ok(Filling::cube(edge)) }
    }
}

pub fn periodic(lengths: [f64; 3]) -> Result<PeriodicBox, ExperimentError> {
    let domain = PeriodicBox::orthogonal([0.0; 3], lengths, [true; 3]);
    Ok(domain.map_err(|e| RunError::State(e.to_string()))?)
}

/// These particles in the native runner.
pub fn simulation(
    model: &Model,
    kt: f64,
    state: &State,
    seed: u64,
    precision: Precision,
) -> Result<Simulation, ExperimentError> {
    let mut simulation = Simulation::new(model, kt, state.clone(), seed)?;
    simulation.set_settings(Settings { precision, ..Settings::default() })?;
    Ok(simulation)
}

/// Random particles at kT = 1.
pub fn random(subject: &Subject, filling: Filling, seed: u64) -> Result<State, ExperimentError> {
    let [lx, ly, lz] = filling.lengths;
    let count = (lx * ly * filling.thickness * subject.density).round() as usize;
    let domain = periodic(filling.lengths)?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let low = 0.5 * (lz - filling.thickness);
    let x: Vec<[f64; 3]> = (0..count)
        .map(|_| {
            let mut u = || random.random::<f64>();
            [lx * u(), ly * u(), low + filling.thickness * u()]
        })
        .collect();
    let v = maxwell(std::iter::repeat_n(1.0, count), 1.0, 3, [true; 3], &mut random);
    let kinds = subject.species.len();
    let species = (0..count).map(|k| match subject.one_in {
        0 => (k % kinds) as i32,
        one_in => i32::from(k % one_in == 0),
    });
    let species = species.collect();
    Ok(State { species, v, ..State::at_rest(domain, vec![1.0; kinds], x) })
}

/// A fluid brought to equilibrium by `steps` steps with the thermostat on, after 100 short ones.
pub fn equilibrated(
    precision: Precision,
    subject: &Subject,
    filling: Filling,
    steps: u64,
    seed: u64,
) -> Result<State, ExperimentError> {
    let mut simulation = Simulation::new(&subject.model()?, 1.0, random(subject, filling, seed)?, seed)?;
    // Threads change no bit of it.
    let threads = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    simulation.set_settings(Settings { precision, threads, ..Settings::default() })?;
    for (dt, steps) in [(0.1 * subject.dt, 100), (subject.dt, steps)] {
        simulation.prepare(dt, Want::FORCES)?;
        simulation.advance(steps, dt, Integrator::VelocityVerlet)?;
    }
    Ok(simulation.state().clone())
}

/// A state with the data files that LAMMPS reads.
#[derive(Debug, Clone)]
pub struct Start {
    pub state: State,
    /// The data file for `atom_style atomic`.
    pub data: PathBuf,
    /// The data file for `atom_style mdpd`.
    pub data_mdpd: PathBuf,
}

/// Seed of the starts that are kept, and of the noise of the runs from them.
pub const SEED: u64 = 20_030_606;

/// Steps of Δt after 100 short ones: several times the time in which a particle passes its neighbours.
const STEPS: u64 = 300;

/// A full cube of the fluid in equilibrium: made once, then from `folder`.
pub fn kept(subject: &Subject, size: usize, folder: &Path) -> Result<Start, ExperimentError> {
    work_folder(folder)?;
    let key = crc32fast::hash(format!("{subject:?} {SEED} {STEPS} {VERSION}").as_bytes());
    let file = |end: &str| folder.join(format!("{}-{size}-{key:08x}.{end}", subject.name));
    let (kept, data, data_mdpd) = (file("state"), file("data"), file("mdpd.data"));
    let found = read_inside(&kept).ok().and_then(|bytes| postcard::from_bytes::<State>(&bytes).ok());
    if let Some(state) = found.filter(|_| data.is_file() && data_mdpd.is_file()) {
        return Ok(Start { state, data, data_mdpd });
    }
    let state = equilibrated(Precision::Mixed, subject, Filling::of_size(size)?, STEPS, SEED)?;
    let text = state.to_data("psidpd bench");
    text.write(&data)?;
    text.write_mdpd(&data_mdpd)?;
    // Written last: its presence shows that the others are complete.
    let bytes = postcard::to_stdvec(&state).map_err(ExperimentError::at(&kept))?;
    write_bytes(&kept, Existing::Keep, &bytes)?;
    Ok(Start { state, data, data_mdpd })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluids::DPD;

    #[test]
    fn a_kept_state_is_the_one_that_was_made() {
        let folder = tempfile::tempdir().unwrap();
        let made = kept(&DPD, 400, folder.path()).unwrap();
        let again = kept(&DPD, 400, folder.path()).unwrap();
        assert_eq!(made.state, again.state);
        assert_eq!(made.state.len(), DPD.particles(400));
        // Another fluid of this name has a state of its own, and half of one counts for nothing.
        let denser = Subject { density: 4.0, ..DPD };
        assert_eq!(kept(&denser, 400, folder.path()).unwrap().state.len(), denser.particles(400));
        let half = |path: &Path| {
            let bytes = std::fs::read(path).unwrap();
            std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
        };
        let states = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
        states.filter(|path| path.extension().is_some_and(|end| end == "state")).for_each(|path| half(&path));
        assert_eq!(kept(&DPD, 400, folder.path()).unwrap().state, made.state);
        assert!(matches!(kept(&DPD, 20, folder.path()), Err(ExperimentError::TooSmall(20))));
    }
}
