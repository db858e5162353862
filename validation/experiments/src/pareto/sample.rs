//! Runs of one setting, for what they measure.

use super::origin::Origin;
use super::quantity::{Class, Quantities};
use super::setting::Physics;
use crate::ExperimentError;
use crate::code::Host;
use psidpd_core::document::Document;
use psidpd_core::engine::Want;
use psidpd_dynamics::run::{RunError, Simulation};
use psidpd_observe::meter::AnyMeter;
use psidpd_observe::{Observe, Observers, Place, Request, Series, read};
use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effort {
    /// Samples for so many seconds; a reference takes a multiple of them.
    Seconds(f64),
    Samples(u64),
}

impl Effort {
    pub fn times(self, factor: f64) -> Effort {
        match self {
            Effort::Seconds(s) => Effort::Seconds(factor * s),
            Effort::Samples(n) => Effort::Samples((factor * n as f64) as u64),
        }
    }

    /// Whether a part of it is used up.
    pub fn is_used(self, part: f64, begin: Instant, samples: u64) -> bool {
        match self {
            Effort::Seconds(s) => begin.elapsed() >= Duration::from_secs_f64(part * s),
            Effort::Samples(n) => samples as f64 >= part * n as f64,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Made {
    pub quantities: Quantities,
    /// Samples of the kinetic temperature.
    pub samples: u64,
    /// Simulated time that they are spread over.
    pub time: f64,
}

/// What a run made, or why it stopped or left its temperature far behind.
pub type Sampled = Result<Made, String>;

/// Part of a run that is left for it to settle.
pub const SETTLE: f64 = 0.2;
/// Fewest samples, whatever time they take.
const FEWEST: u64 = 16;
/// Samples of the cheap observables to one of the others.
const RARELY: u64 = 3;
/// A run is given up where it is hotter than this, in kT.
const FAR_OFF: f64 = 5.0;

/// What is wrong with a temperature, over kT, at which a run is given up. NaN is one.
pub fn far_off(ratio: f64) -> Option<String> {
    let is_calm = ratio <= FAR_OFF;
    (!is_calm).then(|| format!("the temperature is {ratio:.1} kT"))
}

/// What is observed: temperature of configurations, pressures, g(r) and diffusion, and what the scene itself asks of interfaces and
/// viscosities. Without time there is neither diffusion nor viscosity.
pub fn observe(origin: &Origin, every: u64, host: Host, has_time: bool) -> Result<Observe, ExperimentError> {
    let (scene, stage) = (origin.scene, origin.stage);
    // Pressure and forces of LAMMPS's own law are not those of the model.
    let with_forces = host == Host::Native;
    let forces = if with_forces { "temperature = true\npressure = true\n" } else { "" };
    let motion = if has_time { "msd = { length = 10, spacing = 2 }\n" } else { "" };
    let text = format!("[observe]\n{forces}rdf = {{ bins = 100 }}\n{motion}");
    let document = Document::parse("pareto", &text)?;
    let names = [stage.name.as_str()];
    let (fluid, slab) =
        (&scene.model.at(stage.kt)?, scene.initial.slab(&scene.domain, scene.model.dimensions()));
    let timeless = Vec::new();
    let place = Place { fluid, domain: &scene.domain, stages: &names, timeless, slab, drive: None };
    let mut found = read(&document.root(), &place)?;
    let own = scene.observe.requests.iter().filter(|request| match request.meter {
        AnyMeter::InterfaceWidth(_) => true,
        AnyMeter::Viscosity(_) | AnyMeter::Poiseuille(_) => with_forces && has_time,
        AnyMeter::SurfaceTension(_) | AnyMeter::Drop(_) => with_forces,
        _ => false,
    });
    found.requests.extend(own.cloned());
    found.requests = found
        .requests
        .into_iter()
        .map(|request| {
            let every = match request.meter {
                // Correlations in time are asked for at steps of the scene.
                AnyMeter::Viscosity(_) => request.every,
                AnyMeter::Pressure(_) | AnyMeter::Msd(_) | AnyMeter::InterfaceWidth(_) => every,
                _ if !with_forces => every,
                _ => RARELY * every,
            };
            Request { every, skip: 0, stages: vec![stage.name.clone()], ..request }
        })
        .collect();
    Ok(found)
}

/// A run of one setting that can be sampled on.
pub struct Sampler<'a> {
    origin: &'a Origin<'a>,
    physics: Physics,
    run: Simulation,
    observers: Observers,
    /// Kinetic temperature, and energy of a particle.
    sampled: Series,
    time: f64,
    /// Why it stopped, or that it left its temperature far behind.
    stopped: Option<String>,
}

impl<'a> Sampler<'a> {
    /// Settles for the usual part of an effort.
    ///
    /// # Errors
    /// The setting cannot run at all: no Monte Carlo of forces without potential.
    pub fn settled(
        origin: &'a Origin<'a>,
        physics: Physics,
        effort: Effort,
    ) -> Result<Sampler<'a>, ExperimentError> {
        let every = physics.interval();
        let run = origin.simulation(&physics, NonZeroUsize::MIN, true, Want::FORCES)?;
        let observe = observe(origin, every, Host::Native, physics.integrator.has_time())?;
        let observers = Observers::new(&observe, [origin.stage.name.as_str()]);
        let sampled = Series::new(2);
        let mut new = Sampler { origin, physics, run, observers, sampled, time: 0.0, stopped: None };
        let begin = Instant::now();
        let mut settling = 0;
        while new.stopped.is_none() && (settling < FEWEST / 4 || !effort.is_used(SETTLE, begin, settling)) {
            let made = new.run.advance(every, origin.dt(&physics), physics.integrator);
            new.note(made);
            settling += 1;
        }
        Ok(new)
    }

    fn note(&mut self, made: Result<(), RunError>) {
        let ratio = self.run.temperature() / self.origin.stage.kt;
        self.stopped = match made {
            Err(why) => Some(why.to_string()),
            Ok(()) => far_off(ratio).map(|why| format!("step {}: {why}", self.run.step_number())),
        };
    }

    /// This sampler after more samples.
    pub fn more(mut self, effort: Effort) -> Sampler<'a> {
        self.sample(effort);
        self
    }

    /// Samples on, for the part of an effort that settling left.
    pub fn sample(&mut self, effort: Effort) {
        let (dt, every) = (self.origin.dt(&self.physics), self.physics.interval());
        let (integrator, stage) = (self.physics.integrator, self.origin.stage.name.as_str());
        let per_particle = 1.0 / self.run.len() as f64;
        let (begin, mut samples) = (Instant::now(), 0);
        while self.stopped.is_none()
            && (self.sampled.samples() < FEWEST || !effort.is_used(1.0 - SETTLE, begin, samples))
        {
            let wants = self.observers.wants_flux(self.run.step_number() + every, stage);
            let made = self.run.advance_to_sample(every, dt, integrator, wants);
            self.note(made);
            if self.stopped.is_none() {
                self.time += dt * every as f64;
                self.sampled.push(&[self.run.temperature(), per_particle * self.run.potential_energy()]);
                if self.observers.wants_conservative_forces(self.run.step_number(), stage) {
                    let found = self.run.find_conservative_forces();
                    self.note(found);
                }
                self.observers.sample(self.run.view(self.time), stage);
                samples += 1;
            }
        }
    }

    pub fn sampled(&self) -> Sampled {
        if let Some(why) = &self.stopped {
            return Err(why.clone());
        }
        let means =
            [(Class::Temperature, "T_kin", self.sampled.mean(0)), (Class::Energy, "u", self.sampled.mean(1))];
        let dimensions = self.origin.scene.model.dimensions();
        let quantities = Quantities::of(means, &self.observers.finish(), dimensions);
        Ok(Made { quantities, samples: self.sampled.samples(), time: self.time })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five times the temperature is as far as a run may be, and NaN is too far.
    #[test]
    fn hot_runs_are_given_up() {
        assert!([0.0, 1.0, 4.99].into_iter().all(|ratio| far_off(ratio).is_none()));
        assert!([5.01, f64::INFINITY, f64::NAN].into_iter().all(|ratio| far_off(ratio).is_some()));
        assert_eq!(far_off(7.26).unwrap(), "the temperature is 7.3 kT");
    }
}
