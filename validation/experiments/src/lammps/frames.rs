//! Configurations of LAMMPS, shown to observers.

use crate::ExperimentError;
use psidpd_core::engine::{Pool, Precision};
use psidpd_dynamics::run::State;
use psidpd_dynamics::scene::Scene;
use psidpd_formats::dump;
use psidpd_observe::Observers;
use psidpd_observe::frame::View;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

/// Shows the frames of the dump at `path` to observers, which look at positions alone, of particles of one species in the box of
/// `state`; frames are `every` steps of `dt` apart.
pub fn show(
    path: &Path,
    (scene, stage, kt): (&Scene, &str, f64),
    state: &State,
    (every, dt): (u64, f64),
    observers: &mut Observers,
) -> Result<(), ExperimentError> {
    let missing = || ExperimentError::at(path)("it has no columns of positions");
    let pool = Arc::new(Pool::new(NonZeroUsize::MIN));
    for (k, frame) in dump::read(path)?.iter().enumerate() {
        let x = frame.vectors(["x", "y", "z"]).ok_or_else(missing)?;
        let images = frame.vectors(["ix", "iy", "iz"]).ok_or_else(missing)?;
        let images: Vec<[i32; 3]> = images.iter().map(|i| i.map(|c| c as i32)).collect();
        let tags: Vec<i32> = frame.get("id").ok_or_else(missing)?.iter().map(|id| *id as i32).collect();
        let (v, species) = (vec![[0.0; 3]; x.len()], vec![0; x.len()]);
        let view = View {
            pool: &pool,
            precision: Precision::Double,
            step: (k as u64 + 1) * every,
            time: k as f64 * every as f64 * dt,
            kt,
            model: &scene.model,
            dimensions: scene.model.dimensions(),
            domain: &state.domain,
            masses: &state.mass,
            x: &x,
            v: &v,
            images: &images,
            species: &species,
            forces: None,
            tags: &tags,
            frozen: &[],
            temperature: 0.0,
            kinetic_energy: 0.0,
            potential: [0.0; 2],
            pressure: [0.0; 6],
            conservative_pressure: [0.0; 6],
            flux: None,
        };
        observers.sample(view, stage);
    }
    Ok(())
}
