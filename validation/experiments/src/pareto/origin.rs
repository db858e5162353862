//! The state that every run starts from, and its conditions.

use super::setting::{self, INTERVAL, Physics};
use crate::ExperimentError;
use crate::check::estimates;
use psidpd_core::engine::{Settings, Want};
use psidpd_dynamics::particles::State;
use psidpd_dynamics::run::{RunError, Simulation};
use psidpd_dynamics::scene::{Scene, Stage};
use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

/// A scene at the stage that is measured.
#[derive(Debug)]
pub struct Origin<'a> {
    pub scene: &'a Scene,
    pub stage: &'a Stage,
    /// Particles that have been through the stages before, and a little of this.
    pub state: State,
    /// What steps are multiples of: the scene's Δt, or less where that is too long for this fluid.
    pub unit: f64,
}

/// The multiple at which the longest steps that are tried begin.
const LONGEST_BEGIN: f64 = 4.0;

/// The scene's Δt, but so short that the steps of `force-gradient`, the longest that are tried, begin no higher than where the estimate
/// gives them an error of 1 %.
fn unit(scene: &Scene, stage: &Stage) -> Result<f64, ExperimentError> {
    let mut asked = scene.clone();
    let stages = [stage.clone()].into_iter().map(|stage| Stage { integrator: setting::longest(), ..stage });
    asked.stages = stages.collect();
    let one_percent =
        estimates(&asked)?.known.first().and_then(|estimate| estimate.one_percent).unwrap_or(f64::INFINITY);
    Ok(stage.dt.min(one_percent / LONGEST_BEGIN))
}

/// Intervals between samples that the stage is settled for.
const SETTLE: u64 = 8;
/// Steps between looks at the clock.
const BATCH: u64 = 16;

impl<'a> Origin<'a> {
    /// Runs the stages before the last one that has a thermostat and is no ramp, for at most `limit`.
    pub fn of(
        scene: &'a Scene,
        limit: Duration,
        threads: NonZeroUsize,
    ) -> Result<Origin<'a>, ExperimentError> {
        let measured =
            scene.stages.iter().rposition(|s| s.thermostat && s.integrator.has_time() && s.level.is_none());
        let measured = measured.ok_or(ExperimentError::NoStage)?;
        let stage = &scene.stages[measured];
        let settings = Settings { threads, ..Settings::default() };
        let mut run = scene.simulation(scene.initial_state())?;
        run.set_settings(settings)?;
        run.set_reordering(true);
        let begin = Instant::now();
        let settle = (SETTLE * INTERVAL).min(stage.steps);
        let stages = scene.stages[..measured].iter().map(|s| (s, s.steps)).chain([(stage, settle)]);
        for (stage, mut steps) in stages {
            let failed = |source| ExperimentError::Stopped {
                what: format!("the start, stage \"{}\"", stage.name),
                source: Box::new(source),
            };
            scene.enter(stage, &mut run)?;
            run.prepare_for(stage.integrator, stage.dt, Want::FORCES).map_err(failed)?;
            while steps > 0 && begin.elapsed() < limit {
                let batch = steps.min(BATCH);
                run.advance(batch, stage.dt, stage.integrator).map_err(failed)?;
                steps -= batch;
            }
        }
        Ok(Origin { scene, stage, state: run.state().clone(), unit: unit(scene, stage)? })
    }

    /// Δt of a setting, without the digits that the rounding of the product leaves.
    pub fn dt(&self, physics: &Physics) -> f64 {
        let dt = self.unit * physics.multiple;
        format!("{dt:.12e}").parse().unwrap_or(dt)
    }

    /// A simulation that begins here.
    pub fn simulation(
        &self,
        physics: &Physics,
        threads: NonZeroUsize,
        thermostat: bool,
        want: Want,
    ) -> Result<Simulation, RunError> {
        let mut run = self.scene.simulation(self.state.clone())?;
        self.scene.enter(self.stage, &mut run)?;
        run.set_thermostat(thermostat);
        run.set_settings(Settings { precision: physics.precision, threads, ..Settings::default() })?;
        run.set_reordering(true);
        run.prepare_for(physics.integrator, self.dt(physics), want)?;
        Ok(run)
    }
}
