//! The temperatures that a piece of a fluid has in steps of one kind.

use crate::integrator::Integrator;
use crate::run::{RunError, Simulation};
use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::frame::Frame;
use psidpd_observe::series::Series;
use psidpd_observe::{Measured, configurational};

/// Steps from one sample to the next: odd, for both phases of a thermostat that acts at every second step.
const INTERVAL: u64 = 3;
/// Samples from one configurational temperature to the next.
const RARE: u64 = 4;
/// Samples between looks at what is known by then, and most of them.
const LOOK: u64 = 150;
const MOST: u64 = 900;
/// Steps that settle the heat that steps add, least and most, in times 1/κ.
const RELAXATIONS: f64 = 3.0;
const SETTLE: [f64; 2] = [100.0, 1500.0];
/// Standard errors that are small enough.
const RESOLVED: f64 = 0.003;
/// Hotter than this, in kT, no step is of use.
const HOT: f64 = 2.0;
/// Standard errors within which nothing is known.
const SURE: f64 = 2.0;
/// A configurational temperature with a larger error says nothing: where attraction and repulsion cancel, ∇²U almost vanishes.
const VAGUE: f64 = 0.03;

/// What steps of one kind have, less what a step without error has.
#[derive(Debug, Clone, Copy)]
pub struct StepErrors {
    /// The error of the kinetic temperature, in kT.
    pub kinetic: Measured,
    /// The error of the configurational temperature, in kT.
    pub configurational: Option<Measured>,
    /// The thermal pressure `∂p/∂kT / ρ` of the fluid.
    pub thermal_pressure: f64,
}

impl StepErrors {
    /// The configurational temperature, unless it is too vague to say anything.
    fn told(&self) -> Option<f64> {
        let told = |found: &Measured| found.error < VAGUE.max(0.25 * found.value.abs());
        self.configurational.filter(told).map(|found| found.value.abs())
    }

    /// The larger error of the two temperatures.
    pub fn temperatures(&self) -> f64 {
        self.kinetic.value.abs().max(self.told().unwrap_or(0.0))
    }

    /// The error of the pressure of the momentum flux, in ρkT. The heat that a step adds presses like heat; half of an error of
    /// the configurations alone does, over fluids and steps of `docs/force-gradient.md`.
    pub fn carried(&self) -> f64 {
        self.thermal_pressure * self.kinetic.value.abs().max(0.5 * self.told().unwrap_or(0.0))
    }

    pub fn worst(&self) -> f64 {
        self.temperatures().max(self.carried())
    }

    /// Errors smaller than this are not told from none.
    pub fn resolution(&self) -> f64 {
        let configurational = self.configurational.map_or(0.0, |found| found.error);
        if configurational.is_nan() {
            return f64::INFINITY;
        }
        SURE * (self.thermal_pressure * self.kinetic.error).max(configurational)
    }

    /// Whether errors of some percent would be seen.
    pub fn is_known(&self) -> bool {
        self.resolution() <= SURE * VAGUE
    }

    /// The errors of steps of `dt` from a state in equilibrium; `None` where the fluid does not last.
    pub(super) fn measured(
        mut run: Simulation,
        (integrator, dt): (Integrator, f64),
        drag: f64,
        thermal_pressure: f64,
    ) -> Result<Option<StepErrors>, RunError> {
        let fluid = run.model().at(run.kt())?;
        let conservative = configurational::missing(&fluid, &run.state().domain).is_none();
        let evaluator = Evaluator::new(fluid)?;
        let kt = run.kt();
        if run.prepare_for(integrator, dt, Want::FORCES).is_err() {
            return Ok(None);
        }
        let settle = (RELAXATIONS / (drag * dt).max(1e-9)).clamp(SETTLE[0], SETTLE[1]) as u64;
        if run.advance(settle, dt, integrator).is_err() {
            return Ok(None);
        }
        let (mut kinetic, mut forces) = (Series::new(1), Series::new(2));
        loop {
            for sample in 0..LOOK {
                if run.advance(INTERVAL, dt, integrator).is_err() {
                    return Ok(None);
                }
                kinetic.push(&[run.temperature() / kt]);
                if conservative && sample % RARE == 0 {
                    if run.find_conservative_forces().is_err() {
                        return Ok(None);
                    }
                    forces.push(&configurational::sums(&Frame::new(run.view(0.0), &evaluator)));
                }
            }
            let one = Measured::from(1.0);
            let ratio = conservative.then(|| forces.ratio(|s| s[0], |s| s[1]).times(1.0 / kt).minus(one));
            let found =
                StepErrors { kinetic: kinetic.mean(0).minus(one), configurational: ratio, thermal_pressure };
            if found.kinetic.value.is_nan() || found.kinetic.value > HOT - 1.0 {
                return Ok(None);
            }
            let enough = |value: Measured| value.error < RESOLVED.max(0.15 * value.value.abs());
            let known = enough(found.kinetic) && found.configurational.is_none_or(enough);
            if known || kinetic.samples() >= MOST {
                return Ok(Some(found));
            }
        }
    }
}
