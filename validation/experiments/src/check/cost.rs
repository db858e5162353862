//! What a scene will take on this machine, from a short trial of it.

use crate::run::bulk::{Bulk, Sampling};
use psidpd_dynamics::run::{Begin, RunError, Runner, bytes};
use psidpd_dynamics::scene::Scene;
use psidpd_formats::files::temporary_folder;
use serde::Serialize;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cost {
    pub particles: usize,
    pub steps: u64,
    /// Memory, roughly.
    pub bytes: f64,
    /// Seconds of all steps on one thread, with what the last stage measures and writes; roughly.
    pub seconds: f64,
}

/// Above so many particles a small box of the fluid is tried instead.
const LARGE: usize = 300_000;

const SAMPLE: usize = 20_000;

const TRIAL: Duration = Duration::from_millis(250);

pub fn cost(scene: &Scene) -> Result<Cost, RunError> {
    by_trial(scene, &trial)
}

/// The cost by the seconds of a step that a trial says.
pub(super) fn by_trial(
    scene: &Scene,
    trial: &dyn Fn(&Scene) -> Result<f64, RunError>,
) -> Result<Cost, RunError> {
    let particles = scene.initial.count();
    let steps = scene.steps();
    let each = if particles > LARGE {
        let sampling = Sampling {
            particles: SAMPLE,
            dt: scene.stages[0].dt,
            equilibrate: 1,
            steps: 1_000_000,
            every: 1000,
            seed: scene.seed,
            threads: NonZeroUsize::MIN,
        };
        let densities = scene.densities();
        let bulk = Bulk { model: &scene.model, kt: scene.kt, densities: &densities, edits: &[], sampling };
        let mut small = bulk.scene(&scene.model_path)?;
        small.precision = scene.precision;
        trial(&small)? / SAMPLE as f64 * particles as f64
    } else {
        trial(scene)?
    };
    Ok(Cost { particles, steps, bytes: bytes(scene), seconds: each * steps as f64 })
}

/// Seconds of a step of the last stage.
fn trial(scene: &Scene) -> Result<f64, RunError> {
    let mut scene = scene.clone();
    let last = scene.stages.len().saturating_sub(1);
    scene.stages.drain(..last);
    let folder = temporary_folder()?;
    let mut runner = Runner::begin(&scene, folder.path(), Begin::New)?;
    let stop = AtomicUsize::new(0);
    // The first step also computes the forces of the start.
    let (mut first, mut latest) = (None, None);
    runner.run(&stop, &mut |p| {
        let now = Instant::now();
        let (begin, _) = *first.get_or_insert((now, p.step));
        latest = Some((now, p.step));
        if now - begin > TRIAL {
            stop.store(1, Ordering::Relaxed);
        }
    })?;
    let seconds = first
        .zip(latest)
        .and_then(|((a, m), (b, n))| (n > m).then(|| (b - a).as_secs_f64() / (n - m) as f64));
    Ok(seconds.unwrap_or(0.0))
}
