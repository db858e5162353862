//! A homogeneous fluid in a periodic box: what an equation of state is measured with.

use crate::run::{self, HOMOGENEOUS, set};
use psidpd_core::model::Model;
use psidpd_dynamics::run::RunError;
use psidpd_dynamics::scene::{Edit, Scene};
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
    /// Other changes of the scene, which observes temperature and pressure.
    pub edits: &'a [Edit],
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
        let mut edits = vec![
            set("kT", self.kt),
            set("seed", seed),
            set("box", vec![edge; d]),
            set("dt", dt),
            set("equilibrate", equilibrate),
            set("steps", steps),
            set("initial.density", total),
            set("observe.every", every),
        ];
        if self.densities.len() > 1 {
            let shares = self.model.species().iter().zip(self.densities);
            let shares: Vec<String> =
                shares.map(|(name, rho)| format!("{name} = {:?}", rho / total)).collect();
            edits.push(Edit::new("initial.composition", format!("{{ {} }}", shares.join(", "))));
        }
        edits.extend_from_slice(self.edits);
        let mut scene = run::scene(HOMOGENEOUS, (self.model, model_file), &edits)?;
        scene.title = format!("{total} of {}", self.model.title);
        Ok(scene)
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
                let bulk = Bulk { model: &model, kt: 0.7, densities: &[1.0, 3.0], edits: &[], sampling };
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
