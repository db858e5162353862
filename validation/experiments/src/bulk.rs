//! A homogeneous fluid in a periodic box, run natively: what an equation of state is measured with.

use crate::jobs;
use psidpd_core::model::Model;
use psidpd_dynamics::run::{Begin, RunError, Runner, run_scene};
use psidpd_dynamics::scene::Scene;
use psidpd_formats::PathError;
use psidpd_formats::files::read_json_if_there;
use psidpd_observe::{Measured, Observation};
use psidpd_report::Progress;
use std::fmt::Write;
use std::num::NonZeroUsize;
use std::path::Path;

/// How long a homogeneous fluid is run, and how large it is.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Sampling {
    /// About how many particles; more if the box would be narrower than three times the longest range.
    pub particles: usize,
    pub dt: f64,
    pub equilibrate: u64,
    pub steps: u64,
    pub every: u64,
    /// Seed of the start and of the noise.
    pub seed: u64,
    pub threads: NonZeroUsize,
}

#[cfg(test)]
impl Sampling {
    /// A short run, for tests.
    pub const SHORT: Sampling = Sampling {
        particles: 500,
        dt: 0.01,
        equilibrate: 100,
        steps: 100,
        every: 20,
        seed: 1,
        threads: NonZeroUsize::MIN,
    };
}

#[derive(Debug)]
pub struct Bulk<'a> {
    /// The fluid. Its file is there: a scene names it.
    pub model: &'a Model,
    pub kt: f64,
    pub densities: &'a [f64],
    /// Lines of `[observe]`, beside temperature and pressure.
    pub observe: &'a str,
    pub sampling: Sampling,
}

impl Bulk<'_> {
    /// The scene of the fluid: a lattice that melts, then the run.
    pub fn scene(&self, model_file: &Path) -> Result<Scene, RunError> {
        let Sampling { particles, dt, equilibrate, steps, every, seed, .. } = self.sampling;
        let d = self.model.dimensions();
        let total: f64 = self.densities.iter().sum();
        let narrowest = 3.0 * self.model.at(self.kt)?.cutoff();
        let edge = (particles as f64 / total).powf(1.0 / d as f64).max(narrowest);
        let file = std::path::absolute(model_file).unwrap_or_else(|_| model_file.to_owned());
        let mut text = format!(
            "title = \"{total} of {}\"\nmodel = {}\nkT = {:?}\nseed = {seed}\ndt = {dt:?}\nequilibrate = {equilibrate}\n\
             steps = {steps}\nbox = {:?}\n[initial]\nkind = \"lattice\"\ndensity = {total:?}\n",
            self.model.title.replace(['"', '\\'], "'"),
            toml::Value::String(file.display().to_string()),
            self.kt,
            vec![edge; d],
        );
        if self.densities.len() > 1 {
            let shares: Vec<String> = self
                .model
                .species()
                .iter()
                .zip(self.densities)
                .map(|(name, rho)| format!("{name} = {:?}", rho / total))
                .collect();
            let _ = writeln!(text, "composition = {{ {} }}", shares.join(", "));
        }
        let _ = write!(
            text,
            "[observe]\nevery = {every}\ntemperature = true\npressure = true\n{}\n[output]\nthermo = 0\n",
            self.observe
        );
        let mut scene = Scene::parse("bulk", &text, Path::new(""))?;
        // A trial differs from its file, beside which tables are found.
        scene.model = self.model.clone();
        Ok(scene)
    }

    pub fn run(&self, model_file: &Path, folder: &Path) -> Result<Observed, RunError> {
        run(&self.scene(model_file)?, folder, Begin::Overwrite, self.sampling.threads)
    }
}

/// Runs a scene in `folder` and reads what it observed.
pub fn run(scene: &Scene, folder: &Path, begin: Begin, threads: NonZeroUsize) -> Result<Observed, RunError> {
    let mut runner = Runner::begin(scene, folder, begin)?;
    runner.set_threads(threads)?;
    let steps = scene.steps();
    let bar = Progress::new().steps(&scene.title, steps, 0, runner.particles());
    runner.run_to_end(&mut |p| bar.set(p.step))?;
    Observed::read(folder)
}

/// Runs scenes side by side, each in a folder within `folder`, and reads what they observed; the last is the longest.
pub fn side_by_side(scenes: Vec<Scene>, folder: &Path) -> Result<Vec<Observed>, RunError> {
    let one = |(number, scene): (usize, Scene)| {
        let folder = folder.join(format!("run-{number}"));
        run_scene(&scene, &folder, &mut |_| ())?;
        Observed::read(&folder)
    };
    jobs::each(scenes.into_iter().enumerate().collect(), one).into_iter().collect()
}

#[derive(Debug, Clone)]
pub struct Observed(pub Vec<Observation>);

impl Observed {
    pub fn read(folder: &Path) -> Result<Observed, RunError> {
        let path = folder.join("observables.json");
        let missing = || PathError::at("read", &path)(std::io::ErrorKind::NotFound.into());
        Ok(Observed(read_json_if_there(&path)?.ok_or_else(missing)?))
    }

    pub fn get(&self, name: &str) -> Option<&Observation> {
        self.0.iter().find(|o| o.name == name)
    }

    /// A number by the names of its observation and column; nothing known where there is none.
    pub fn scalar(&self, name: &str, column: &str) -> Measured {
        self.get(name).and_then(|o| o.scalar(column)).unwrap_or(Measured::NONE)
    }

    /// A column of an observation against its abscissa; nothing where it was not observed.
    pub fn profile(&self, name: &str, column: &str) -> Vec<(f64, Measured)> {
        let Some(observation) = self.get(name) else { return Vec::new() };
        let (Some(x), Some(y)) = (&observation.x, observation.get(column)) else { return Vec::new() };
        let values = y.values.iter().zip(&y.errors).map(|(value, error)| [*value, *error].into());
        x.values.iter().copied().zip(values).collect()
    }

    pub fn temperature(&self) -> Measured {
        self.scalar("temperature", "kinetic")
    }

    pub fn pressure(&self) -> Measured {
        self.scalar("pressure", "conservative")
    }

    /// Pressure of the configurations, without the scatter of velocities.
    pub fn configurational_pressure(&self) -> Measured {
        self.scalar("pressure", "configurational")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As many particles as were asked for, at the density and in the shares that were, in two and three dimensions; a box that would
    /// be narrower than three ranges has more.
    #[test]
    fn boxes_have_the_particles_that_were_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("m.toml");
        for dimensions in [2, 3] {
            let text = format!(
                "title = \"two\"\nspecies = [\"A\", \"B\"]\ndimensions = {dimensions}\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n"
            );
            std::fs::write(&file, text).unwrap();
            let model = Model::open(&file).unwrap();
            let of = |particles: usize| {
                let sampling = Sampling { particles, ..Sampling::SHORT };
                let bulk = Bulk { model: &model, kt: 0.7, densities: &[1.0, 3.0], observe: "", sampling };
                bulk.scene(&file).unwrap()
            };
            let scene = of(4000);
            let (count, volume) = (scene.initial.count() as f64, scene.domain.volume(dimensions));
            assert!((count / 4000.0 - 1.0).abs() < 0.02, "{dimensions}-D: {count}");
            assert!((count / volume - 4.0).abs() < 0.05 && scene.kt == 0.7, "{dimensions}-D: {count}");
            let second = scene.initial_state().species.iter().filter(|s| **s == 1).count() as f64;
            assert!((second / count - 0.75).abs() < 0.01, "{dimensions}-D: {second}");
            assert!((of(5).domain.lengths()[0] - 3.0).abs() < 1e-12);
        }
    }
}
