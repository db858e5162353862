//! How long a time step of a scene may be: an estimate from the stiffness of the forces and from the drag.
//!
//! A small piece of the fluid is sampled, at the densities of the scene, for
//!
//! ```text
//! ω² = ⟨Σ ∇²U/m⟩/(dN),    κ = 2 ⟨Σ D/μ⟩/(dN)
//! ```
//!
//! the mean square frequency of a particle in the force field of the others, and the rate at which drag takes
//! its kinetic energy. The relative error of the configurational temperature, and that of the pressure that steps carry in ρkT, are then
//! about
//!
//! ```text
//! a (ωΔt)⁴ + b κΔt,    a′ (ωΔt)² + b′ κΔt + c′ (ωΔt)⁴
//! ```
//!
//! with factors of each integrator from runs of standard DPD and of Warren's liquid; `docs/integrators.md` has them. A liquid
//! in equilibrium with its vapour has the carried pressure of the vapour: it is thinner by the error over ρ ∂p/∂ρ, which a second sample
//! gives, a little denser.

use psidpd_core::engine::noise::{Law, PairNoise};
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{PeriodicBox, Want};
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::run::{RunError, Simulation, State};
use psidpd_dynamics::scene::Scene;
use psidpd_observe::configurational;
use psidpd_observe::frame::Frame;
use serde::Serialize;

/// Particles of the sample, if the range leaves room for so few, and most.
const PARTICLES: f64 = 400.0;
const MOST: f64 = 6000.0;

/// Steps that settle the sample; samples, and steps between them.
const SETTLE: u64 = 300;
const SAMPLES: usize = 6;
const BETWEEN: u64 = 20;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepEstimate {
    pub stage: String,
    pub integrator: String,
    pub dt: f64,
    /// Frequency ω.
    pub frequency: f64,
    /// Drag κ.
    pub drag: f64,
    /// Relative error of the configurational temperature.
    pub error: f64,
    /// Error of the pressure that steps carry, in ρkT.
    pub carried: f64,
    /// By how much of its density a liquid in equilibrium with its vapour is too thin, if the fluid resists compression.
    pub thinner: Option<f64>,
    /// The Δt at which the larger of the first two is 0.01.
    pub one_percent: f64,
}

/// Of each stage with conditions of its own; empty if there is no temperature of configurations, or no density.
pub fn estimates(scene: &Scene) -> Result<Vec<StepEstimate>, RunError> {
    let mut found: Vec<StepEstimate> = Vec::new();
    let mut known: Vec<(f64, Option<Sample>)> = Vec::new();
    for stage in scene.stages.iter().filter(|stage| stage.integrator.has_time()) {
        let sample = match known.iter().find(|(kt, _)| *kt == stage.kt) {
            Some((_, sample)) => *sample,
            None => {
                let sample = sampled(scene, stage.kt)?;
                known.push((stage.kt, sample));
                sample
            }
        };
        let Some(Sample { frequency, drag, resistance }) = sample else { continue };
        let drag = if stage.thermostat { drag } else { 0.0 };
        let of = |dt: f64| stage.integrator.properties().accuracy.errors(dt, frequency, drag);
        let [error, carried] = of(stage.dt);
        let estimate = StepEstimate {
            stage: stage.name.clone(),
            integrator: stage.integrator.to_string(),
            dt: stage.dt,
            frequency,
            drag,
            error,
            carried,
            thinner: resistance.map(|resistance| carried * stage.kt / resistance),
            one_percent: longest(|dt| of(dt).into_iter().fold(0.0, f64::max)),
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

/// The Δt at which an error that grows is 0.01.
fn longest(error: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = [1e-9f64, 1e9];
    for _ in 0..80 {
        let middle = (low * high).sqrt();
        if error(middle) > 0.01 { high = middle } else { low = middle }
    }
    low
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    /// Frequency ω.
    frequency: f64,
    /// Drag κ.
    drag: f64,
    /// ∂p/∂ρ at constant composition, if positive.
    resistance: Option<f64>,
}

const DENSER: f64 = 1.04;

/// The fluid of a scene where it is densest.
fn sampled(scene: &Scene, kt: f64) -> Result<Option<Sample>, RunError> {
    let densities = scene.densities();
    let total: f64 = densities.iter().sum();
    let denser: Vec<f64> = densities.iter().map(|rho| DENSER * rho).collect();
    let Some([frequency, drag, pressure]) = at_densities(scene, kt, &densities)? else { return Ok(None) };
    let compressed = at_densities(scene, kt, &denser)?.map(|[.., pressure]| pressure);
    let resistance = compressed.map(|compressed| (compressed - pressure) / ((DENSER - 1.0) * total));
    Ok(Some(Sample { frequency, drag, resistance: resistance.filter(|resistance| *resistance > 0.0) }))
}

/// ω, κ and the conservative pressure of a piece of the fluid.
fn at_densities(scene: &Scene, kt: f64, densities: &[f64]) -> Result<Option<[f64; 3]>, RunError> {
    let fluid = scene.model.at(kt)?;
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
    let state = start(scene, domain, densities, kt, dimensions);
    let mut run = Simulation::new(&scene.model, kt, state, scene.seed)?;
    // Short steps relax the random start.
    let dt = 0.25 * scene.stages.iter().map(|s| s.dt).fold(0.01, f64::min);
    let integrator = Integrator::VelocityVerlet;
    run.prepare(dt, Want::FORCES)?;
    if run.advance(SETTLE, dt, integrator).is_err() {
        return Ok(None);
    }
    let Ok(evaluator) = Evaluator::new(fluid) else { return Ok(None) };
    let (mut square, mut drag, mut pressure) = (0.0, 0.0, 0.0);
    for _ in 0..SAMPLES {
        let made =
            run.advance(BETWEEN - 1, dt, integrator).and_then(|()| run.step(dt, integrator, Want::TOTALS));
        if made.is_err() {
            return Ok(None);
        }
        pressure += run.scalar_pressure(run.conservative_pressure_tensor());
        drag += run.warmth(dt)?.map_or(0.0, |warmth| warmth.rate);
        square += configurational::mean_square_frequency(&Frame::new(run.view(0.0), &evaluator));
    }
    let samples = SAMPLES as f64;
    Ok(Some([(square / samples).max(0.0).sqrt(), drag / samples, pressure / samples]))
}

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
