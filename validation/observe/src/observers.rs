//! The observables of a run while it is going.

use super::error::ObserveError;
use super::flux::Recorded;
use super::frame::{Frame, View};
use super::meter::{AnyMeter, Pairs};
use super::observation::Observation;
use super::order::{Order, Sight};
use super::request::Observe;
use psidpd_core::engine::Want;
use psidpd_core::engine::pair_sums::Evaluator;
use serde::{Deserialize, Serialize};

/// The requested observables of a scene with their samples so far.
///
/// The whole state can be written and read back; a run that continues from it ends with the same bits.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Observers {
    observers: Vec<Observer>,
    stage: String,
    /// The step before the first step of the stage.
    start: u64,
    /// The order of the particles in each stage whose observables assume a liquid.
    order: Vec<(String, Order)>,
    #[serde(skip)]
    fluid: Option<(f64, Evaluator)>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Observer {
    every: u64,
    skip: u64,
    /// The sampled stages, in their order in the run.
    stages: Vec<Sampled>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Sampled {
    stage: String,
    meter: AnyMeter,
    /// The number of samples that were left out because they contained NaN or infinity.
    left_out: u64,
}

impl Observers {
    /// The observables of a run with these stages, before its first step.
    pub fn new<'a>(observe: &Observe, stages: impl IntoIterator<Item = &'a str>) -> Observers {
        // Several stages may share a name.
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

    /// The quantities that the forces of step `step` of stage `stage` must provide for [`Observers::sample`].
    pub fn wants(&self, step: u64, stage: &str) -> Want {
        let mut want = Want::FORCES;
        for sampled in self.due(step, stage) {
            let needs = sampled.meter.needs();
            want.energy |= needs.energy;
            want.virial |= needs.virial;
        }
        want
    }

    /// Whether samples of step `step` of stage `stage` read the pressure with drag and noise.
    pub fn wants_pressure(&self, step: u64, stage: &str) -> bool {
        self.due(step, stage).any(|sampled| sampled.meter.reads_pressure())
    }

    /// What step `step` of stage `stage` must record of the momentum transport.
    pub fn wants_flux(&self, step: u64, stage: &str) -> Recorded {
        self.due(step, stage).map(|sampled| sampled.meter.flux()).max().unwrap_or_default()
    }

    /// Whether samples of step `step` of stage `stage` read the conservative forces of the run.
    pub fn wants_conservative_forces(&self, step: u64, stage: &str) -> bool {
        self.due(step, stage).any(|sampled| sampled.meter.pairs() == Pairs::SumsAndForces)
    }

    fn due(&self, step: u64, stage: &str) -> impl Iterator<Item = &Sampled> {
        let due = self.observers.iter().filter(move |o| step.is_multiple_of(o.every));
        due.flat_map(|o| &o.stages).filter(move |sampled| sampled.stage == stage)
    }

    /// Returns true if [`Observers::sample`] may have work after step `step`.
    pub fn may_sample(&self, step: u64, stage: &str) -> bool {
        self.stage != stage || self.observers.iter().any(|o| step.is_multiple_of(o.every))
    }

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
            // The scene has already evaluated the model at all temperatures of its stages.
            let fluid = view.model.at(view.kt).ok();
            let fluid = fluid.and_then(|fluid| Evaluator::new(fluid).ok());
            self.fluid = fluid.map(|fluid| (view.kt, fluid));
        }
        let frame = self.fluid.as_ref().map(|(_, fluid)| Frame::new(view, fluid));
        let (mut lines, mut shares) = (false, false);
        let of_stage = self.observers.iter().filter(|o| due(o)).flat_map(|o| &o.stages);
        for Sampled { meter, .. } in of_stage.filter(|sampled| sampled.stage == stage) {
            lines |= meter.flux() == Recorded::Lines;
            shares |= meter.pairs() == Pairs::SumsAndForces;
        }
        if let Some(frame) = frame.as_ref().filter(|_| lines) {
            frame.expect_lines(shares);
        }
        // Those that walk along lines come first, and find the sum that others read.
        for walks in [true, false] {
            let observers = self.observers.iter_mut().filter(|o| due(o)).flat_map(|o| &mut o.stages);
            let is_next = |s: &&mut Sampled| s.stage == stage && (s.meter.flux() == Recorded::Lines) == walks;
            for sampled in observers.filter(is_next) {
                let taken = frame.as_ref().is_some_and(|frame| sampled.meter.sample(frame));
                sampled.left_out = sampled.left_out.saturating_add(u64::from(!taken));
            }
        }
        let of_liquids = |o: &Observer| o.stages.iter().any(|s| s.stage == stage && s.meter.of_liquids());
        if let Some(frame) = &frame
            && self.observers.iter().any(|o| due(o) && of_liquids(o))
        {
            let known = self.order.iter().position(|(name, _)| name == stage);
            let at = known.unwrap_or_else(|| {
                self.order.push((stage.to_owned(), Order::default()));
                self.order.len() - 1
            });
            self.order[at].1.sample(&sight(frame), |k| frame.moves(k));
        }
    }

    /// The whole state as bytes, for a checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.write_to(&mut bytes);
        bytes
    }

    /// Replaces bytes by those of [`Observers::to_bytes`], in their memory.
    pub fn write_to(&self, bytes: &mut Vec<u8>) {
        bytes.clear();
        // Postcard can write every part of the state; tests write and read every observable.
        *bytes = postcard::to_extend(self, std::mem::take(bytes)).unwrap_or_default();
    }

    /// Reads the output of [`Observers::to_bytes`]. `self` must request the same observables and have no samples.
    pub fn restore(&self, bytes: &[u8]) -> Result<Observers, ObserveError> {
        let restored: Observers = postcard::from_bytes(bytes)?;
        let mut forgetful = restored.observers.clone();
        for sampled in forgetful.iter_mut().flat_map(|o| &mut o.stages) {
            sampled.left_out = 0;
            sampled.meter.forget();
        }
        if forgetful == self.observers { Ok(restored) } else { Err(ObserveError::OtherObservables) }
    }

    /// The number of steps between measurements of the temperatures of a stage, from its start on, if it measures them.
    pub fn interval_of_temperature(&self, stage: &str) -> Option<u64> {
        let is_of_stage = |s: &Sampled| s.stage == stage && matches!(s.meter, AnyMeter::Temperature(_));
        self.observers.iter().find(|o| o.skip == 0 && o.stages.iter().any(is_of_stage)).map(|o| o.every)
    }

    /// The temperatures of a stage, if it measures them.
    pub fn temperature(&self, stage: &str) -> Option<Observation> {
        let mut all = self.observers.iter().flat_map(|o| &o.stages);
        let temperature = |s: &&Sampled| s.stage == stage && matches!(s.meter, AnyMeter::Temperature(_));
        all.find(temperature)?.meter.finish().pop()
    }

    pub fn finish(&self) -> Vec<Observation> {
        let mut all = Vec::new();
        for sampled in self.observers.iter().flat_map(|o| &o.stages) {
            let order =
                self.order.iter().find(|(name, _)| sampled.meter.of_liquids() && *name == sampled.stage);
            let crystal = order.and_then(|(_, order)| order.crystal());
            for mut observation in sampled.meter.finish() {
                observation.stage.clone_from(&sampled.stage);
                if let Some(crystal) = crystal {
                    observation = observation.note(crystal.note());
                }
                if sampled.left_out > 0 {
                    let text = format!("Samples without a value, left out: {}.", sampled.left_out);
                    observation = observation.note(text);
                }
                all.push(observation);
            }
        }
        all
    }
}

/// What tells a crystal from a liquid in a configuration.
fn sight<'a>(frame: &'a Frame<'a>) -> Sight<'a> {
    let view = frame.view;
    let mass = (0..view.x.len()).map(|k| frame.mass(k)).sum::<f64>() / view.x.len() as f64;
    Sight {
        time: view.time,
        domain: view.domain,
        dimensions: view.dimensions,
        x: view.x,
        images: view.images,
        tags: view.tags,
        range: frame.evaluator.fluid.conservative_range(),
        speed: (view.kt / mass).sqrt(),
    }
}
