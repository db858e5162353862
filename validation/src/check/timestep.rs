//! How long a time step of a scene may be: an estimate from the stiffness of the forces and from the drag.
//!
//! A small piece of the fluid is sampled, at the densities of the scene, for
//!
//! ```text
//! ω² = ⟨Σ ∇²U/m⟩/(dN),    κ = 2 ⟨Σ D/μ⟩/(dN)
//! ```
//!
//! the mean square frequency of a particle in the force field of the others, and the rate at which drag takes
//! its kinetic energy. The relative error of the configurational temperature is then about
//!
//! ```text
//! a (ωΔt)⁴ + ¼ κΔt (drag inside the forces) or nothing of the latter (thermostat apart from them)
//! ```
//!
//! with `a` from runs of standard DPD and of Warren's liquid; `docs/integrators.md` has them.

use crate::integrator::{Accuracy, Integrator};
use crate::observe::configurational;
use crate::run::{RunError, Simulation, State};
use crate::scene::Scene;
use psidpd_core::engine::noise::{Law, PairNoise};
use psidpd_core::engine::reference::Evaluator;
use psidpd_core::engine::{PeriodicBox, Want};
use serde::Serialize;

/// Particles of the sample, if the range leaves room for so few, and most.
const PARTICLES: f64 = 400.0;
const MOST: f64 = 6000.0;

/// Steps that settle the sample; samples, and steps between them.
const SETTLE: u64 = 300;
const SAMPLES: usize = 6;
const BETWEEN: u64 = 20;

/// What is estimated of one stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepEstimate {
    /// Name of the stage.
    pub stage: String,
    /// How steps are made.
    pub integrator: String,
    /// Δt.
    pub dt: f64,
    /// ω.
    pub frequency: f64,
    /// κ.
    pub drag: f64,
    /// Relative error of the configurational temperature.
    pub error: f64,
    /// The Δt at which that is 0.01.
    pub one_percent: f64,
}

/// Of each stage with conditions of its own; empty if there is no temperature of configurations, or no density.
///
/// # Errors
/// The model does not hold at a temperature.
pub fn estimates(scene: &Scene) -> Result<Vec<StepEstimate>, RunError> {
    let mut found: Vec<StepEstimate> = Vec::new();
    let mut known: Vec<(f64, Option<[f64; 2]>)> = Vec::new();
    for stage in scene.stages.iter().filter(|stage| stage.integrator.has_time()) {
        let sample = match known.iter().find(|(kt, _)| *kt == stage.kt) {
            Some((_, sample)) => *sample,
            None => {
                let sample = sampled(scene, stage.kt)?;
                known.push((stage.kt, sample));
                sample
            }
        };
        let Some([frequency, drag]) = sample else { continue };
        let drag = if stage.thermostat { drag } else { 0.0 };
        let of = |dt: f64| error(stage.integrator, dt, frequency, drag);
        let estimate = StepEstimate {
            stage: stage.name.clone(),
            integrator: stage.integrator.to_string(),
            dt: stage.dt,
            frequency,
            drag,
            error: of(stage.dt),
            one_percent: longest(of),
        };
        let same = |other: &&StepEstimate| {
            other.integrator == estimate.integrator
                && (other.dt, other.error) == (estimate.dt, estimate.error)
        };
        if !found.iter().any(|other| same(&other)) {
            found.push(estimate);
        }
    }
    Ok(found)
}

/// Relative error of the temperature of configurations.
fn error(integrator: Integrator, dt: f64, frequency: f64, drag: f64) -> f64 {
    let Accuracy { stiffness, drag: of_drag } = integrator.accuracy();
    stiffness * (frequency * dt).powi(4) + of_drag * drag * dt
}

/// The Δt at which an error that grows is 0.01.
fn longest(error: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = [1e-9f64, 1e9];
    for _ in 0..80 {
        let middle = (low * high).sqrt();
        if error(middle) > 0.01 { high = middle } else { low = middle }
    }
    low
}

/// ω and κ of the fluid where it is densest.
fn sampled(scene: &Scene, kt: f64) -> Result<Option<[f64; 2]>, RunError> {
    let fluid = scene.model.at(kt)?;
    let densities = scene.densities();
    let total: f64 = densities.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return Ok(None);
    }
    let dimensions = fluid.dimensions;
    let volume = (PARTICLES / total).max((2.2 * fluid.cutoff()).powi(dimensions as i32));
    if volume * total > MOST {
        return Ok(None);
    }
    let length = volume.powf(1.0 / dimensions as f64);
    let lengths = [length, length, if dimensions == 2 { 1.0 } else { length }];
    let Ok(domain) = PeriodicBox::orthogonal([0.0; 3], lengths, [true, true, dimensions == 3]) else {
        return Ok(None);
    };
    if configurational::missing(&fluid, &domain).is_some() {
        return Ok(None);
    }
    let state = start(scene, domain, &densities, kt, dimensions);
    let masses = state.mass.clone();
    let mut run = Simulation::new(&scene.model, kt, state, scene.seed)?;
    // Short steps relax the random start.
    let dt = 0.25 * scene.stages.iter().map(|s| s.dt).fold(0.01, f64::min);
    let integrator = Integrator::VelocityVerlet;
    run.prepare(dt, Want::FORCES)?;
    if run.advance(SETTLE, dt, integrator).is_err() {
        return Ok(None);
    }
    let Ok(evaluator) = Evaluator::new(fluid) else { return Ok(None) };
    let (mut curvature, mut drag) = (0.0, 0.0);
    for _ in 0..SAMPLES {
        if run.advance(BETWEEN, dt, integrator).is_err() {
            return Ok(None);
        }
        drag += run.warmth(dt)?.map_or(0.0, |warmth| warmth.rate);
        let evaluation = evaluator.evaluate(run.positions(), run.species(), run.domain());
        let laplacians = evaluation.laplacians(evaluator.fluid(), run.species());
        let of = |(l, s): (f64, &i32)| l / masses[*s as usize];
        curvature += laplacians.into_iter().zip(run.species()).map(of).sum::<f64>();
    }
    let count = (SAMPLES * dimensions * run.len()) as f64;
    Ok(Some([(curvature / count).max(0.0).sqrt(), drag / SAMPLES as f64]))
}

/// Particles at random, with thermal velocities.
fn start(scene: &Scene, domain: PeriodicBox, densities: &[f64], kt: f64, dimensions: usize) -> State {
    let volume = domain.volume(dimensions);
    let species: Vec<i32> = (0..)
        .zip(densities)
        .flat_map(|(s, rho)| std::iter::repeat_n(s, (rho * volume).round() as usize))
        .collect();
    let n = species.len();
    let (lengths, draws) = (domain.lengths(), PairNoise::new(scene.seed, 0));
    let tags: Vec<u32> = (1..=n as u32).collect();
    let draw = |number: u32, law: Law| {
        let mut drawn = vec![0.0; n];
        draws.fill(law, &tags, &vec![u32::MAX - number; n], &mut drawn);
        drawn
    };
    let (mut x, mut v) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    for c in 0..dimensions {
        let (places, speeds) = (draw(c as u32, Law::Uniform), draw(3 + c as u32, Law::Gaussian));
        for k in 0..n {
            x[k][c] = lengths[c] * (0.5 + f64::from(places[k]) / 12f64.sqrt());
            v[k][c] = f64::from(speeds[k]) * (kt / scene.mass[species[k] as usize]).sqrt();
        }
    }
    State { v, species, ..State::at_rest(domain, scene.mass.clone(), x) }
}
