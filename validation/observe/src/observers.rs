//! The observables of a run on its way.

use super::frame::{Frame, View};
use super::meter::AnyMeter;
use super::observation::Observation;
use super::request::Observe;
use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::Evaluator;
use serde::{Deserialize, Serialize};

/// The observables that a scene asks for, with what they have seen so far.
///
/// All of it can be written and read back: a run that goes on from there ends with the same bits.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Observers {
    observers: Vec<Observer>,
    /// The present stage.
    stage: String,
    /// The step before its first.
    start: u64,
    #[serde(skip)]
    fluid: Option<(f64, Evaluator)>,
}

/// Why [`Observers::restore`] cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RestoreError {
    /// Not what [`Observers::to_bytes`] writes.
    #[error(transparent)]
    Bytes(#[from] postcard::Error),
    /// Another list, or other settings.
    #[error("the observables are not those of the scene")]
    Others,
}

/// One observable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Observer {
    every: u64,
    skip: u64,
    /// The stages that are sampled, in their order in the run.
    stages: Vec<Sampled>,
}

/// One observable in one stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Sampled {
    stage: String,
    meter: AnyMeter,
    /// Samples left out, as something in them was not a finite number.
    left_out: u64,
}

impl Observers {
    /// What is asked for in a run with these stages, before its first step.
    pub fn new<'a>(observe: &Observe, stages: impl IntoIterator<Item = &'a str>) -> Observers {
        // Stages may share a name.
        let mut names: Vec<&str> = Vec::new();
        for stage in stages {
            if !names.contains(&stage) {
                names.push(stage);
            }
        }
        let observers = observe.requests.iter().map(|request| Observer {
            every: request.every.max(1),
            skip: request.skip,
            stages: names
                .iter()
                .filter(|name| request.stages.iter().any(|s| s == *name))
                .map(|name| Sampled { stage: (*name).to_owned(), meter: request.meter.clone(), left_out: 0 })
                .collect(),
        });
        Observers { observers: observers.collect(), ..Observers::default() }
    }

    /// What the forces of step `step` of stage `stage` must bring with them for [`Observers::sample`].
    pub fn wants_in(&self, step: u64, stage: &str) -> Want {
        let in_stage = |o: &&Observer| o.stages.iter().any(|s| s.stage == stage);
        Self::needs(self.observers.iter().filter(in_stage), step)
    }

    /// The same, whatever the stage.
    pub fn wants(&self, step: u64) -> Want {
        Self::needs(self.observers.iter(), step)
    }

    fn needs<'a>(observers: impl Iterator<Item = &'a Observer>, step: u64) -> Want {
        let mut want = Want::FORCES;
        for sampled in observers.filter(|o| step.is_multiple_of(o.every)).filter_map(|o| o.stages.first()) {
            let needs = sampled.meter.needs();
            want.energy |= needs.energy;
            want.virial |= needs.virial;
        }
        want
    }

    /// Whether step `step` of stage `stage` must record what carries momentum.
    pub fn wants_flux(&self, step: u64, stage: &str) -> bool {
        let due = |o: &&Observer| step.is_multiple_of(o.every) && o.stages.iter().any(|s| s.stage == stage);
        self.observers.iter().filter(due).flat_map(|o| &o.stages).any(|s| s.meter.needs_flux())
    }

    /// Whether [`Observers::sample`] may have something to do after step `step`.
    pub fn may_sample(&self, step: u64, stage: &str) -> bool {
        self.stage != stage || self.observers.iter().any(|o| step.is_multiple_of(o.every))
    }

    /// Samples what is due after a step.
    pub fn sample(&mut self, view: View, stage: &str) {
        let step = view.step;
        if self.stage != stage {
            stage.clone_into(&mut self.stage);
            self.start = step.saturating_sub(1);
        }
        let start = self.start;
        let due = |o: &Observer| {
            step.is_multiple_of(o.every)
                && step > start.saturating_add(o.skip)
                && o.stages.iter().any(|s| s.stage == stage)
        };
        if !self.observers.iter().any(due) {
            return;
        }
        if self.fluid.as_ref().is_none_or(|(kt, _)| *kt != view.kt) {
            // The scene has tried every temperature of its stages.
            let fluid = view.model.at(view.kt).ok();
            let fluid = fluid.and_then(|fluid| Evaluator::new(fluid).ok());
            self.fluid = fluid.map(|fluid| (view.kt, fluid));
        }
        let frame = self.fluid.as_ref().map(|(_, fluid)| Frame::new(view, fluid));
        for observer in self.observers.iter_mut().filter(|o| due(o)) {
            for sampled in observer.stages.iter_mut().filter(|s| s.stage == stage) {
                let taken = frame.as_ref().is_some_and(|frame| sampled.meter.sample(frame));
                sampled.left_out = sampled.left_out.saturating_add(u64::from(!taken));
            }
        }
    }

    /// All of it, for a checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        // Nothing in it that postcard has no bytes for: tests write and read every observable.
        postcard::to_allocvec(self).unwrap_or_default()
    }

    /// What [`Observers::to_bytes`] wrote, of a run in which these observables, that have seen nothing, are asked for.
    ///
    /// # Errors
    /// The bytes are something else, or belong to other observables.
    pub fn restore(&self, bytes: &[u8]) -> Result<Observers, RestoreError> {
        let restored: Observers = postcard::from_bytes(bytes)?;
        let mut forgetful = restored.observers.clone();
        for sampled in forgetful.iter_mut().flat_map(|o| &mut o.stages) {
            sampled.left_out = 0;
            sampled.meter.forget();
        }
        if forgetful == self.observers { Ok(restored) } else { Err(RestoreError::Others) }
    }

    /// What was measured.
    pub fn finish(&self) -> Vec<Observation> {
        let mut all = Vec::new();
        for sampled in self.observers.iter().flat_map(|o| &o.stages) {
            for mut observation in sampled.meter.finish() {
                observation.stage.clone_from(&sampled.stage);
                if sampled.left_out > 0 {
                    let text = format!("{} samples had no value and were left out.", sampled.left_out);
                    observation = observation.note(text);
                }
                all.push(observation);
            }
        }
        all
    }
}
