//! The keys of one observable in a scene, and the facts on which their values depend.

use psidpd_core::document::keys::{Key, ValueKind};
use psidpd_core::document::{FileError, FileErrorKind, Section, Value};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Fluid;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// The names of the directions.
pub const AXES: [(&str, usize); 3] = [("x", 0), ("y", 1), ("z", 2)];

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
    /// The names of all stages.
    pub stages: &'a [&'a str],
    /// The names of the stages whose steps take no time.
    pub timeless: Vec<&'a str>,
    pub slab: Option<Slab>,
    /// The body force of two opposite flows, if the scene has one.
    pub drive: Option<Drive>,
}

/// The point that is moved to the middle of the profile in each sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Centre {
    /// No point is moved: positions are those of the box.
    Box,
    /// The centre of mass of all particles.
    All,
    /// The centre of mass of one species.
    Species(i32),
}

/// A slab in the initial state, or layers of several liquids.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slab {
    /// The normal of the slab.
    pub axis: usize,
    /// What has a centre along the normal: of all particles there is none where layers fill the box.
    pub centre: Centre,
}

/// The body force of two opposite flows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// The direction along which the force is reversed.
    pub across: usize,
    pub along: usize,
    /// The acceleration in the lower half of the box.
    pub acceleration: f64,
}

/// The table of one observable. The short form `name = true` sets no key.
#[derive(Debug)]
pub struct Options<'a> {
    pub section: Option<Section<'a>>,
    pub value: Value<'a>,
    /// The keys of the observable.
    pub keys: &'static [Key],
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

    /// Reads an optional key; `None` if the observable lacks it.
    fn read<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Value<'a>) -> Result<T, FileError>,
    ) -> Result<Option<T>, FileError> {
        self.get(key).map(|value| read(&value)).transpose()
    }

    pub fn positive(&self, key: &str) -> Result<Option<f64>, FileError> {
        self.read(key, Value::positive)
    }

    /// A key in the table of the observable.
    fn key(&self, key: &str) -> &'static Key {
        let known = self.keys.iter().find(|known| known.name == key);
        known.unwrap_or_else(|| unreachable!("the table has no {key}"))
    }

    /// The value of a key that is left out, which the table states as a number.
    fn default<T: FromStr>(&self, key: &str) -> T {
        let text = self.key(key).default();
        text.parse().unwrap_or_else(|_| unreachable!("{key} is {text} if left out, no number"))
    }

    /// The range of a key that is one or two whole numbers.
    fn range(&self, key: &str) -> [u64; 2] {
        match self.key(key).value {
            ValueKind::Whole(low, high) | ValueKind::Wholes(low, high) => [low, high],
            other => unreachable!("{key} is no whole number but {other:?}"),
        }
    }

    /// Reads a number up to `most`, in the range that the table gives.
    pub fn number_up_to(&self, key: &str, most: f64) -> Result<Option<f64>, FileError> {
        let ValueKind::Within(low, high) = self.key(key).value else { unreachable!("{key} has no range") };
        self.read(key, |value| value.within(value.number()?, low, high.min(most)))
    }

    /// Reads a number, with the range and the default that the table gives.
    pub fn number(&self, key: &str) -> Result<f64, FileError> {
        Ok(self.number_up_to(key, f64::INFINITY)?.unwrap_or_else(|| self.default(key)))
    }

    /// Reads a whole number in the range that the table gives.
    pub fn given_count(&self, key: &str) -> Result<Option<usize>, FileError> {
        let [low, high] = self.range(key);
        self.read(key, |value| Ok(value.whole(low, high)? as usize))
    }

    /// Reads a whole number, with the range and the default that the table gives.
    pub fn count(&self, key: &str) -> Result<usize, FileError> {
        Ok(self.given_count(key)?.unwrap_or_else(|| self.default(key)))
    }

    /// Reads two whole numbers in the range that the table gives.
    pub fn counts(&self, key: &str) -> Result<Option<[usize; 2]>, FileError> {
        let [low, high] = self.range(key);
        let count = |item: &Value| Ok(item.whole(low, high)? as usize);
        self.read(key, |value| match &value.array()?[..] {
            [a, b] => Ok([count(a)?, count(b)?]),
            _ => Err(value.error("expected two whole numbers")),
        })
    }

    pub fn flag(&self, key: &str) -> Result<Option<bool>, FileError> {
        self.read(key, Value::boolean)
    }

    pub fn axis(&self, key: &str) -> Result<Option<usize>, FileError> {
        self.read(key, |value| value.one_of("axis", &AXES[..self.place.fluid.dimensions]))
    }

    pub fn species(&self, key: &str) -> Result<Option<usize>, FileError> {
        self.read(key, |value| value.string()?.among("species", self.place.fluid.species.iter().zip(0..)))
    }

    /// The index of a species of the model, for keys whose value may be something other than a name.
    pub fn as_species(&self, key: &str) -> Result<Option<usize>, FileError> {
        if self.get(key).is_some_and(|value| value.as_str().is_some()) { self.species(key) } else { Ok(None) }
    }

    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, FileError> {
        self.read(key, |value| value.one_of("choice", choices))
    }

    /// An error about a key, or about the observable if the key is not set.
    pub fn error(&self, key: &str, kind: impl Into<FileErrorKind>) -> FileError {
        self.at(key).error(kind)
    }

    /// A length up to half the box.
    pub fn within_half_box(&self, key: &str) -> Result<Option<f64>, FileError> {
        let (length, half) = (self.positive(key)?, self.half_box());
        match length.filter(|length| *length > half * (1.0 + 1e-12)) {
            Some(length) => {
                Err(self.error(key, format!("must not exceed half the box, {half}, is {length}")))
            }
            None => Ok(length),
        }
    }

    /// The key `bins`; if left out, as many bins as make them `width` wide, or a little less.
    pub fn bins(&self, length: f64, width: f64) -> Result<usize, FileError> {
        Ok(self.given_count("bins")?.unwrap_or_else(|| self.bins_as_wide(length, width)))
    }

    fn bins_as_wide(&self, length: f64, width: f64) -> usize {
        let [fewest, most] = self.range("bins");
        ((length / width).ceil() as usize).clamp(fewest as usize, most as usize)
    }

    /// The key `bins` of a plane; if left out, as many bins as make them 0.25 wide, or a little less.
    pub fn bins_of_plane(&self, lengths: [f64; 2]) -> Result<[usize; 2], FileError> {
        Ok(self.counts("bins")?.unwrap_or_else(|| lengths.map(|length| self.bins_as_wide(length, 0.25))))
    }

    /// Refuses a tilted box, with an error about a key.
    pub fn require_right_angles(&self, key: &str) -> Result<(), FileError> {
        let (domain, lengths) = (self.place.domain, self.place.domain.lengths());
        let tilted = |k| (domain.height(k) - lengths[k]).abs() > 1e-9 * lengths[k];
        match (0..self.place.fluid.dimensions).any(tilted) {
            true => Err(self.error(key, "the box must have right angles")),
            false => Ok(()),
        }
    }

    pub fn require_periodic(&self) -> Result<(), FileError> {
        match self.place.domain.periodic()[..self.place.fluid.dimensions].contains(&false) {
            true => Err(self.error("", "the box must be periodic in every direction")),
            false => Ok(()),
        }
    }

    /// Half the smallest distance of two periodic faces of the box; of all faces if none is periodic.
    pub fn half_box(&self) -> f64 {
        let (domain, d) = (self.place.domain, self.place.fluid.dimensions);
        let periodic = domain.periodic();
        let any = periodic[..d].contains(&true);
        (0..d).filter(|k| periodic[*k] || !any).map(|k| 0.5 * domain.height(k)).fold(f64::INFINITY, f64::min)
    }
}
