//! The keys of one observable in a scene, and the facts on which their values depend.

use psidpd_core::document::{FileError, FileErrorKind, Section, Value};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Fluid;

/// The names of the faces of a box: axis, and whether the face is the upper one.
pub const FACES: [(&str, (usize, bool)); 6] = [
    ("xlo", (0, false)),
    ("xhi", (0, true)),
    ("ylo", (1, false)),
    ("yhi", (1, true)),
    ("zlo", (2, false)),
    ("zhi", (2, true)),
];

/// The facts on which the settings of an observable depend.
#[derive(Debug)]
pub struct Place<'a> {
    /// The fluid is the model at the temperature of the scene.
    pub fluid: &'a Fluid,
    pub domain: &'a PeriodicBox,
    pub stages: StageNames<'a>,
    /// The normal of the slab in the initial state.
    pub slab: Option<usize>,
    /// The body force of two opposite flows.
    pub drive: Option<Drive>,
}

/// The body force of two opposite flows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// The direction along which the force is reversed.
    pub across: usize,
    /// The direction of the force.
    pub along: usize,
    /// The acceleration in the lower half of the box.
    pub acceleration: f64,
}

#[derive(Debug, Clone)]
pub struct StageNames<'a> {
    pub all: &'a [&'a str],
    /// The stages whose steps take no time.
    pub timeless: Vec<&'a str>,
}

/// The table of one observable. The short form `name = true` sets no key.
#[derive(Debug)]
pub struct Options<'a> {
    pub section: Option<Section<'a>>,
    pub value: Value<'a>,
    pub place: &'a Place<'a>,
}

impl<'a> Options<'a> {
    /// The location for error messages: the value of a key, or the observable if the key is not set.
    pub fn at(&self, key: &str) -> Value<'a> {
        let own = if key.is_empty() { None } else { self.get(key) };
        own.unwrap_or_else(|| self.value.clone())
    }

    fn get(&self, key: &str) -> Option<Value<'a>> {
        self.section.as_ref()?.get(key)
    }

    /// A number above zero.
    pub fn positive(&self, key: &str) -> Result<Option<f64>, FileError> {
        self.get(key).map(|value| value.positive()).transpose()
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

    pub fn flag(&self, key: &str) -> Result<Option<bool>, FileError> {
        self.get(key).map(|value| Ok(value.boolean()?.value)).transpose()
    }

    pub fn axis(&self, key: &str) -> Result<Option<usize>, FileError> {
        let names = [("x", 0), ("y", 1), ("z", 2)];
        let names = &names[..self.place.fluid.dimensions];
        self.get(key).map(|value| Ok(value.one_of("axis", names)?.value)).transpose()
    }

    /// The index of a species of the model.
    pub fn species(&self, key: &str) -> Result<Option<usize>, FileError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let names: Vec<(&str, usize)> =
            self.place.fluid.species.iter().enumerate().map(|(k, name)| (name.as_str(), k)).collect();
        Ok(Some(value.one_of("species", &names)?.value))
    }

    /// The index of a species of the model, for keys whose value may be something other than a name.
    pub fn as_species(&self, key: &str) -> Result<Option<usize>, FileError> {
        if self.get(key).is_some_and(|value| value.as_str().is_some()) { self.species(key) } else { Ok(None) }
    }

    /// One of the given names.
    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, FileError> {
        self.get(key).map(|value| Ok(value.one_of("choice", choices)?.value)).transpose()
    }

    /// An error about a key, or about the observable if the key is not set.
    pub fn error(&self, key: &str, message: impl Into<String>) -> FileError {
        self.at(key).error(FileErrorKind::Value(message.into()))
    }

    /// Half the smallest distance of two periodic faces of the box; of all faces if none is periodic.
    pub fn half_box(&self) -> f64 {
        let (domain, d) = (self.place.domain, self.place.fluid.dimensions);
        let periodic = domain.periodic();
        let any = periodic[..d].contains(&true);
        (0..d).filter(|k| periodic[*k] || !any).map(|k| 0.5 * domain.height(k)).fold(f64::INFINITY, f64::min)
    }
}
