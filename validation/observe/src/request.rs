//! `[observe]` of a scene.

use super::keys::{COMMON, Table};
use super::meter::{AnyMeter, KINDS};
use psidpd_core::document::{FileError, FileErrorKind, Section, Value};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::{Fluid, Model};

/// What a scene asks to be observed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Observe {
    /// In the order of the reference.
    pub requests: Vec<Request>,
}

/// One observable.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Steps between samples.
    pub every: u64,
    /// Steps at the beginning of a stage without samples.
    pub skip: u64,
    /// The stages that are sampled.
    pub stages: Vec<String>,
    /// What is measured, with its settings and no samples yet.
    pub meter: AnyMeter,
}

/// What the settings of an observable depend on.
#[derive(Debug)]
pub struct Place<'a> {
    /// The model at the temperature of the scene.
    pub fluid: &'a Fluid,
    /// The box.
    pub domain: &'a PeriodicBox,
    /// Names of the stages.
    pub stages: StageNames<'a>,
    /// The normal of the slab that the scene starts from.
    pub slab: Option<usize>,
    /// What drives two opposite flows.
    pub drive: Option<Drive>,
}

/// What drives two opposite flows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// The direction in which it is reversed.
    pub across: usize,
    /// Its own direction.
    pub along: usize,
    /// The acceleration in the lower half of the box.
    pub acceleration: f64,
}

/// Names of the stages of a scene.
#[derive(Debug, Clone)]
pub struct StageNames<'a> {
    /// All of them.
    pub all: &'a [&'a str],
    /// Those whose steps take no time.
    pub timeless: Vec<&'a str>,
}

/// Reads `[observe]`; `slab` is the normal of the slab that the scene starts from, `drive` the body force that
/// drives two opposite flows, if there is one.
///
/// # Errors
/// Unknown keys, values out of their domain, observables that the model or the box cannot have.
pub fn read(
    root: &Section,
    model: &Model,
    kt: f64,
    domain: &PeriodicBox,
    stages: StageNames,
    slab: Option<usize>,
    drive: Option<Drive>,
) -> Result<Observe, FileError> {
    let Some(value) = root.get("observe") else { return Ok(Observe::default()) };
    let section = value.section()?;
    let fluid = model.at(kt)?;
    let last: Vec<String> = stages.all.last().map(|s| (*s).to_owned()).into_iter().collect();
    let place = Place { fluid: &fluid, domain, stages, slab, drive };
    let common = Common::read(&section, &place, Common { every: 10, skip: 0, stages: last })?;
    let mut observe = Observe::default();
    for kind in KINDS {
        let Some(value) = section.get(kind.table.path) else { continue };
        let mut options = Options { section: value.as_section(), value: value.clone(), place: &place };
        if options.section.is_none() && !value.boolean()?.value {
            continue;
        }
        let preset = Common { every: kind.every.unwrap_or(common.every), ..common.clone() };
        let settings = match &options.section {
            Some(section) => Common::read(section, &place, preset)?,
            None => preset,
        };
        if kind.every_step && settings.every != 1 {
            let message = "needs every step: every must be 1 or left out".to_owned();
            return Err(options.at("every").error(FileErrorKind::Value(message)));
        }
        let is_timeless = |stage: &String| place.stages.timeless.contains(&stage.as_str());
        if let Some(stage) = settings.stages.iter().find(|s| kind.of_motion && is_timeless(s)) {
            let message =
                format!("is of motion in time, which stage \"{stage}\", of monte-carlo, has none of");
            let error = options.at("stages").error(FileErrorKind::Value(message));
            return Err(error.with_help("observe a stage of an integrator with a time step"));
        }
        let meter = (kind.read)(&options)?;
        if let Some(section) = options.section.take() {
            section.finish()?;
        }
        let Common { every, skip, stages } = settings;
        observe.requests.push(Request { every, skip, stages, meter });
    }
    section.finish()?;
    Ok(observe)
}

/// The tables of all observables.
pub fn tables() -> Vec<&'static Table> {
    KINDS.iter().map(|kind| kind.table).collect()
}

/// The keys that every observable has.
#[derive(Debug, Clone)]
struct Common {
    every: u64,
    skip: u64,
    stages: Vec<String>,
}

impl Common {
    fn read(section: &Section, place: &Place, mut common: Common) -> Result<Common, FileError> {
        debug_assert_eq!(COMMON.len(), 3);
        if let Some(value) = section.get("every") {
            common.every = value.count()?.value;
            if common.every == 0 {
                return Err(value.error(FileErrorKind::Value("must be at least 1".into())));
            }
        }
        if let Some(value) = section.get("skip") {
            common.skip = value.count()?.value;
        }
        if let Some(value) = section.get("stages") {
            let known = place.stages.all;
            common.stages.clear();
            for item in value.array()? {
                let name = item.string()?.value;
                if !known.contains(&name.as_str()) {
                    let known = known.join(", ");
                    return Err(item.error(FileErrorKind::UnknownName { what: "stage", name, known }));
                }
                if !common.stages.contains(&name) {
                    common.stages.push(name);
                }
            }
            if common.stages.is_empty() {
                return Err(value.error(FileErrorKind::Value("names no stage".into())));
            }
        }
        Ok(common)
    }
}

/// The table of one observable; without one (`name = true`) every key is left out.
#[derive(Debug)]
pub struct Options<'a> {
    section: Option<Section<'a>>,
    value: Value<'a>,
    /// Where it is measured.
    pub place: &'a Place<'a>,
}

impl<'a> Options<'a> {
    /// The value of a key, or of the observable if the key is left out: for errors.
    pub fn at(&self, key: &str) -> Value<'a> {
        let own = if key.is_empty() { None } else { self.get(key) };
        own.unwrap_or_else(|| self.value.clone())
    }

    fn get(&self, key: &str) -> Option<Value<'a>> {
        self.section.as_ref()?.get(key)
    }

    /// A number above zero.
    pub fn positive(&self, key: &str) -> Result<Option<f64>, FileError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let number = value.number()?.value;
        if number > 0.0 {
            Ok(Some(number))
        } else {
            Err(value.error(FileErrorKind::Value(format!("must be positive, is {number}"))))
        }
    }

    /// A number from `low` to `high`.
    pub fn number(&self, key: &str, low: f64, high: f64) -> Result<Option<f64>, FileError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let number = value.number()?.value;
        if (low..=high).contains(&number) {
            Ok(Some(number))
        } else {
            let message = format!("must be from {low} to {high}, is {number}");
            Err(value.error(FileErrorKind::Value(message)))
        }
    }

    /// A whole number from `low` to `high`.
    pub fn count(&self, key: &str, low: u64, high: u64) -> Result<Option<usize>, FileError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let number = value.count()?.value;
        if (low..=high).contains(&number) {
            Ok(Some(number as usize))
        } else {
            let message = format!("must be from {low} to {high}, is {number}");
            Err(value.error(FileErrorKind::Value(message)))
        }
    }

    /// Two whole numbers from `low` to `high`.
    pub fn counts(&self, key: &str, low: u64, high: u64) -> Result<Option<[usize; 2]>, FileError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let items = value.array()?;
        let [a, b] = items.as_slice() else {
            return Err(value.error(FileErrorKind::Value("expected two whole numbers".into())));
        };
        let read = |item: &Value| {
            let number = item.count()?.value;
            let message = format!("must be from {low} to {high}, is {number}");
            let inside = (low..=high).contains(&number);
            if inside { Ok(number as usize) } else { Err(item.error(FileErrorKind::Value(message))) }
        };
        Ok(Some([read(a)?, read(b)?]))
    }

    /// True or false.
    pub fn flag(&self, key: &str) -> Result<Option<bool>, FileError> {
        self.get(key).map(|value| Ok(value.boolean()?.value)).transpose()
    }

    /// A direction of space.
    pub fn axis(&self, key: &str) -> Result<Option<usize>, FileError> {
        let names = [("x", 0), ("y", 1), ("z", 2)];
        let names = &names[..self.place.fluid.dimensions];
        self.get(key).map(|value| Ok(value.one_of("axis", names)?.value)).transpose()
    }

    /// A species of the model.
    pub fn species(&self, key: &str) -> Result<Option<usize>, FileError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let names: Vec<(&str, usize)> =
            self.place.fluid.species.iter().enumerate().map(|(k, name)| (name.as_str(), k)).collect();
        Ok(Some(value.one_of("species", &names)?.value))
    }

    /// A species of the model, where other things than names may stand too.
    pub fn as_species(&self, key: &str) -> Result<Option<usize>, FileError> {
        if self.get(key).is_some_and(|value| value.as_str().is_some()) { self.species(key) } else { Ok(None) }
    }

    /// One of some names.
    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, FileError> {
        self.get(key).map(|value| Ok(value.one_of("choice", choices)?.value)).transpose()
    }

    /// An error about a key, or about the observable if it is left out.
    pub fn error(&self, key: &str, message: impl Into<String>) -> FileError {
        self.at(key).error(FileErrorKind::Value(message.into()))
    }

    /// Half the smallest distance of two periodic faces of the box; of its faces, if none is periodic.
    pub fn half_box(&self) -> f64 {
        let (domain, d) = (self.place.domain, self.place.fluid.dimensions);
        let periodic = domain.periodic();
        let any = periodic[..d].contains(&true);
        (0..d).filter(|k| periodic[*k] || !any).map(|k| 0.5 * domain.height(k)).fold(f64::INFINITY, f64::min)
    }
}
