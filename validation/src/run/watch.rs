//! Watches the temperature of a run: warns if it deviates from the target, and stops a run that is far off.
//!
//! The temperature is that of the relative velocities which drag and noise act on: a drop that flies, or a flow, has
//! its thermal one. It is sampled a few times in a stage, and every [`INTERVAL`] steps in a long one, at less than a hundredth of the
//! cost of the steps; what is sampled changes no step. The temperature of configurations, which errors of the
//! forces change most, comes every [`RARE`] steps, and at the end of a stage of [`WORTH_A_LOOK`] or more.

use super::error::RunError;
use super::simulation::Simulation;
use crate::observe::configurational;
use crate::observe::frame::Frame;
use crate::scene::Stage;
use psidpd_core::engine::reference::Evaluator;
use std::fmt;

/// Most steps from sample to sample, and fewest.
const INTERVAL: u64 = 250;
const LEAST: u64 = 10;

/// Samples of a stage that is too short for more.
const SAMPLES: u64 = 8;

/// Steps between temperatures of configurations: one costs about as much as fifty steps.
const RARE: u64 = 5000;

/// A run stops where it is hotter than this, in kT, for [`PATIENCE`] relaxation times and [`IN_A_ROW`] samples.
const FAR_OFF: f64 = 2.0;
const PATIENCE: f64 = 10.0;
const IN_A_ROW: u64 = 4;

/// Relative deviation that is not worth a warning.
const TOLERANCE: f64 = 0.02;

/// A stage of so many steps has a temperature of configurations at its end, even if it is short: where the thermostat keeps
/// velocities right at any time step, nothing else shows that the step is too long.
const WORTH_A_LOOK: u64 = 1000;

/// How a temperature was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thermometer {
    /// From relative velocities of pairs.
    Kinetic,
    /// From forces.
    Configurational,
}

/// A temperature that is not that of its stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Name of the stage.
    pub stage: String,
    /// How it was measured.
    pub thermometer: Thermometer,
    /// Mean over the last two thirds of the stage, and its standard error, in units of kT.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
    /// Δt; `None` where steps take no time.
    pub dt: Option<f64>,
}

impl fmt::Display for Deviation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Deviation { stage, thermometer, mean, error, dt } = self;
        let Some(dt) = dt else {
            return write!(
                f,
                "stage \"{stage}\": the configurational temperature is {mean:.3} +- {error:.3} kT: trial moves are exact, so \
                 likely the fluid has not come to rest; make more steps"
            );
        };
        let (what, cause) = match thermometer {
            Thermometer::Kinetic => ("kinetic", "the thermostat's and the forces' error at this step"),
            Thermometer::Configurational => ("configurational", "the forces' error at this step"),
        };
        write!(
            f,
            "stage \"{stage}\": the {what} temperature is {mean:.3} +- {error:.3} kT: likely {cause}, dt = {dt}; use a smaller \
             dt, or an integrator that bears it (docs/integrators.md)"
        )
    }
}

/// The watch over one stage.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// Of each sample, in units of kT.
    kinetic: Vec<f64>,
    configurational: Vec<[f64; 2]>,
    /// Samples in a row that were too hot, and the step of the first.
    hot: Option<(u64, u64)>,
}

impl Watch {
    /// Whether a sample is due after step `done` of a stage.
    pub fn is_due(stage: &Stage, done: u64) -> bool {
        let interval = (stage.steps / SAMPLES).clamp(LEAST, INTERVAL);
        stage.thermostat && (done.is_multiple_of(interval) || looks_at_forces(stage, done))
    }

    /// Takes a sample; the step must be at its end.
    pub fn sample(&mut self, simulation: &mut Simulation, stage: &Stage, done: u64) -> Result<(), RunError> {
        if !stage.integrator.has_time() {
            // Velocities are drawn at kT.
            let due = looks_at_forces(stage, done);
            self.configurational.extend(due.then(|| configurational(simulation)).flatten());
            return Ok(());
        }
        let Some(warmth) = simulation.warmth(stage.dt)? else { return Ok(()) };
        let ratio = warmth.kt / stage.kt;
        self.kinetic.push(ratio);
        if looks_at_forces(stage, done)
            && let Some(sums) = configurational(simulation)
        {
            self.configurational.push(sums);
        }
        // A body force may drive a flow that is hot by itself.
        let driven = stage.body_forces && simulation.has_body_forces();
        if ratio <= FAR_OFF || driven {
            self.hot = None;
            return Ok(());
        }
        let (count, since) = self.hot.map_or((1, done), |(count, since)| (count + 1, since));
        self.hot = Some((count, since));
        let relaxations = (done - since) as f64 * stage.dt * warmth.rate;
        if count >= IN_A_ROW && relaxations > PATIENCE {
            return Err(RunError::TooHot {
                step: simulation.step_number(),
                since: simulation.step_number() - (done - since),
                ratio,
                dt: stage.dt,
                integrator: stage.integrator.to_string(),
            });
        }
        Ok(())
    }

    /// Deviations to report at the end of a stage.
    pub fn deviations(&self, simulation: &Simulation, stage: &Stage) -> Vec<Deviation> {
        let dt = stage.integrator.has_time().then_some(stage.dt);
        let deviation = |thermometer, [mean, error]: [f64; 2]| {
            let off = (mean - 1.0).abs() > TOLERANCE + 3.0 * error;
            off.then(|| Deviation { stage: stage.name.clone(), thermometer, mean, error, dt })
        };
        let mut found = Vec::new();
        if stage.level.is_some() {
            // A level of a ramp is not in equilibrium.
            return found;
        }
        let settled = &self.kinetic[self.kinetic.len() / 3..];
        if settled.len() >= 4 {
            found.extend(deviation(Thermometer::Kinetic, estimate(settled)));
        }
        let settled = &self.configurational[self.configurational.len() / 3..];
        if !settled.is_empty() {
            let [squares, laplacians] =
                [0, 1].map(|k| settled.iter().map(|s| s[k]).sum::<f64>() / settled.len() as f64);
            // The error of one sample is about that of as many free particles.
            let freedom = (simulation.dimensions() * simulation.mobile() * settled.len()) as f64;
            let mean = squares / laplacians / stage.kt;
            found
                .extend(deviation(Thermometer::Configurational, [mean, 2.0 * mean * (2.0 / freedom).sqrt()]));
        }
        found
    }
}

/// Whether a temperature of configurations is due.
fn looks_at_forces(stage: &Stage, done: u64) -> bool {
    let end = done == stage.steps && done >= WORTH_A_LOOK && stage.level.is_none();
    done.is_multiple_of(RARE) || end
}

/// Mean and standard error, the latter larger for few samples, whose scatter says little of itself: 1.6 times for six of them, 1.2
/// times for twenty. By Student's t three of these are then exceeded by chance once in two hundred stages.
fn estimate(samples: &[f64]) -> [f64; 2] {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (1.0 + 3.0 / (n - 1.0)) * (variance / n).sqrt()]
}

/// `Σ F·F` and `Σ ∇²U`, if there is a temperature of configurations.
fn configurational(simulation: &Simulation) -> Option<[f64; 2]> {
    let fluid = simulation.model().at(simulation.kt()).ok()?;
    if simulation.has_body_forces() || configurational::missing(&fluid, simulation.domain()).is_some() {
        return None;
    }
    let evaluator = Evaluator::new(fluid).ok()?;
    let [squares, laplacians] = configurational::sums(&Frame::new(simulation.view(0.0), &evaluator));
    (laplacians > 0.0).then_some([squares, laplacians])
}

#[cfg(test)]
mod tests {
    use super::estimate;

    #[test]
    fn few_samples_are_trusted_less() {
        let samples =
            |n: usize| (0..n).map(|k| if k.is_multiple_of(2) { 0.9 } else { 1.1 }).collect::<Vec<f64>>();
        for (n, factor) in [(6, 1.6), (16, 1.2)] {
            let [mean, error] = estimate(&samples(n));
            let plain = 0.1 / (n as f64 - 1.0).sqrt();
            assert!((mean - 1.0).abs() < 1e-12 && (error / plain - factor).abs() < 1e-12, "{n}: {error}");
        }
    }
}
