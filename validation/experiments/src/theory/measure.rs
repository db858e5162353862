//! A fluid measured in short runs, to be put beside its theory.

use crate::run::bulk::{Bulk, Sampling};
use crate::run::{self, SLAB, set};
use psidpd_core::model::Model;
use psidpd_dynamics::run::{RunError, run_scene};
use psidpd_dynamics::scene::Scene;
use psidpd_formats::files::temporary_folder;
use psidpd_report::{Headline, headline};
use std::num::NonZeroUsize;
use std::path::Path;

#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Steps that are measured, after a third of them that are not.
    pub steps: u64,
    pub dt: f64,
}

const PARTICLES: usize = 2000;

/// The homogeneous fluid at a density.
pub fn homogeneous(
    model: &Model,
    file: &Path,
    kt: f64,
    densities: &[f64],
    effort: Effort,
) -> Result<Headline, RunError> {
    let (Effort { steps, dt }, equilibrate, threads) = (effort, effort.steps / 3, NonZeroUsize::MIN);
    let sampling = Sampling { particles: PARTICLES, dt, equilibrate, steps, every: 10, seed: 1, threads };
    let bulk = Bulk { model, kt, densities, edits: &[], sampling };
    in_a_folder(&bulk.scene(file)?)
}

/// A slab of liquid in its vapour, from a guess of the density of the liquid.
pub fn slab(model: &Model, file: &Path, kt: f64, liquid: f64, effort: Effort) -> Result<Headline, RunError> {
    let range = model.at(kt)?.cutoff().max(1e-6);
    let d = model.dimensions();
    let mut edges = vec![7.0 * range; d];
    edges[d - 1] = 20.0 * range;
    let edits = [
        set("kT", kt),
        set("box", edges),
        set("dt", effort.dt),
        set("equilibrate", (effort.steps / 3).max(1)),
        set("steps", effort.steps),
        set("initial.thickness", 9.0 * range),
        set("initial.density", liquid),
        set("output.thermo", 10),
    ];
    in_a_folder(&run::scene(SLAB, (model, file), &edits)?)
}

fn in_a_folder(scene: &Scene) -> Result<Headline, RunError> {
    let folder = temporary_folder()?;
    run_scene(scene, folder.path(), &mut |_| ())?;
    Ok(headline(folder.path()))
}
