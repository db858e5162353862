//! The table `[observe]` of a scene.

use super::keys::{COMMON, Key, Table};
use super::meter::{AnyMeter, KINDS, Pairs};
use super::options::{Options, Place};
use psidpd_core::document::{FileError, Section, Value};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Observe {
    /// Requests are in the order of the reference.
    pub requests: Vec<Request>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    pub every: u64,
    /// The number of steps at the beginning of a stage without samples.
    pub skip: u64,
    pub stages: Vec<String>,
    /// The observable with its settings and no samples.
    pub meter: AnyMeter,
}

impl Observe {
    /// About how many bytes the samples of a run take. `steps` tells the steps of a stage.
    pub fn bytes(&self, particles: f64, steps: impl Fn(&str) -> u64) -> f64 {
        let of_request = |request: &Request| -> f64 {
            let mut meter = request.meter.clone();
            let samples = |stage: &String| (steps(stage) / request.every.max(1)) as f64;
            request.stages.iter().map(|stage| meter.bytes(particles, samples(stage))).sum()
        };
        self.requests.iter().map(of_request).sum()
    }

    /// Whether there is an observable that means nothing for a crystal.
    pub fn of_liquids(&self) -> bool {
        self.requests.iter().any(|request| request.meter.of_liquids())
    }

    /// What samples may need of the pairs of a configuration.
    pub fn pairs(&self) -> Pairs {
        self.requests.iter().map(|request| request.meter.pairs()).max().unwrap_or_default()
    }
}

/// Reads `[observe]`.
pub fn read(root: &Section, place: &Place) -> Result<Observe, FileError> {
    let Some(value) = root.get("observe") else { return Ok(Observe::default()) };
    let section = value.section()?;
    let names = |keys: &[Key]| -> Vec<&str> { keys.iter().map(|key| key.name).collect() };
    section.only([names(COMMON), KINDS.iter().map(|kind| kind.table.path).collect()].concat())?;
    let last: Vec<String> = place.stages.last().map(|s| (*s).to_owned()).into_iter().collect();
    let common = Common::read(&section, place, Common { every: 10, skip: 0, stages: last })?;
    let mut observe = Observe::default();
    for kind in KINDS {
        let Some(value) = section.get(kind.table.path) else { continue };
        let options =
            Options { section: value.as_section(), value: value.clone(), keys: kind.table.keys, place };
        if let Some(section) = &options.section {
            section.only([names(COMMON), names(kind.table.keys)].concat())?;
        }
        if options.section.is_none() && !value.boolean()? {
            continue;
        }
        let preset = Common { every: kind.every.unwrap_or(common.every), ..common.clone() };
        let settings = match &options.section {
            Some(section) => Common::read(section, place, preset)?,
            None => preset,
        };
        if kind.every_step && settings.every != 1 {
            return Err(options.at("every").error("needs every step: every must be 1 or left out"));
        }
        let is_timeless = |stage: &String| place.timeless.contains(&stage.as_str());
        if let Some(stage) = settings.stages.iter().find(|s| kind.of_motion && is_timeless(s)) {
            let message =
                format!("needs motion in time, but the integrator of stage \"{stage}\" is monte-carlo");
            let error = options.at("stages").error(message);
            return Err(error.with_help("observe a stage of an integrator with a time step"));
        }
        let meter = (kind.read)(&options)?;
        let Common { every, skip, stages } = settings;
        observe.requests.push(Request { every, skip, stages, meter });
    }
    Ok(observe)
}

pub fn tables() -> Vec<&'static Table> {
    KINDS.iter().map(|kind| kind.table).collect()
}

#[derive(Debug, Clone)]
struct Common {
    every: u64,
    skip: u64,
    stages: Vec<String>,
}

impl Common {
    fn read(section: &Section, place: &Place, mut common: Common) -> Result<Common, FileError> {
        debug_assert_eq!(COMMON.len(), 3);
        common.every = section.read("every", |value| value.whole(1, u64::MAX))?.unwrap_or(common.every);
        common.skip = section.read("skip", Value::count)?.unwrap_or(common.skip);
        if let Some(value) = section.get("stages") {
            common.stages.clear();
            for item in value.array()? {
                let name = item.string()?;
                name.among("stage", place.stages.iter().map(|name| (name, ())))?;
                if !common.stages.contains(&name.value) {
                    common.stages.push(name.value);
                }
            }
            if common.stages.is_empty() {
                return Err(value.error("must name at least one stage"));
            }
        }
        Ok(common)
    }
}
