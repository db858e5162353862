//! The keys of a region.

use super::Shape;
use crate::scene::number::{axis, vector};
use psidpd_core::document::{FileError, FileErrorKind, Section, Value};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::wall::Round;
pub use psidpd_observe::options::FACES;

/// Share of the box by which a region may reach beyond it, because of rounding.
const ROUNDING: f64 = 1e-9;

pub const SHAPES: &[&str] = &["box", "slab", "layer", "sphere", "cylinder", "rest"];

pub struct Shapes<'a> {
    pub dimensions: usize,
    pub domain: &'a PeriodicBox,
    /// The round surfaces of walls.
    pub rounds: Vec<Round>,
}

impl Shapes<'_> {
    pub fn whole(&self) -> Shape {
        let (low, lengths) = (self.domain.origin(), self.domain.lengths());
        Shape::Block { low, high: std::array::from_fn(|k| low[k] + lengths[k]) }
    }

    /// The box without the matter of round walls.
    pub fn free(&self) -> Shape {
        let [low, high] = self.whole().bounds(self.dimensions);
        let region = |round: &Round| {
            let Round { center, radius, .. } = *round;
            match round.axis(self.dimensions) {
                None => Shape::Sphere { center, radius },
                Some(axis) => {
                    let middle = 0.5 * (low[axis] + high[axis]);
                    let center = std::array::from_fn(|c| if c == axis { middle } else { center[c] });
                    Shape::Cylinder { axis, center, radius, length: high[axis] - low[axis] }
                }
            }
        };
        match (self.rounds.iter().find(|round| round.inside), &self.rounds[..]) {
            (Some(around), _) => region(around),
            (None, []) => self.whole(),
            (None, all) => {
                Shape::Rest { whole: Box::new(self.whole()), others: all.iter().map(region).collect() }
            }
        }
    }

    /// Reads the region named `kind`, whose keys are in `section`; errors point at `key`. A region of kind
    /// `rest` is all that walls leave of the box until the other regions are known: see [`Shape::Rest`].
    pub fn read(&self, kind: &str, key: &Value, section: &Section) -> Result<Shape, FileError> {
        let shape = match kind {
            "box" => self.read_block(section)?,
            "slab" => self.read_slab(section)?,
            "layer" => self.read_layer(section)?,
            "sphere" => Shape::Sphere {
                center: self.read_center(section)?,
                radius: section.require("radius")?.positive()?,
            },
            "cylinder" if self.dimensions == 3 => self.read_cylinder(section)?,
            "rest" => {
                return Ok(match self.free() {
                    rest @ Shape::Rest { .. } => rest,
                    whole => Shape::Rest { whole: Box::new(whole), others: Vec::new() },
                });
            }
            _ => return Err(key.error(self.unknown("shape", kind, SHAPES))),
        };
        self.check_inside(&shape, key)?;
        Ok(shape)
    }

    /// The error for a name that is none of `known`; in two dimensions there are no cylinders.
    pub fn unknown(&self, what: &'static str, name: &str, known: &[&str]) -> FileErrorKind {
        let known: Vec<&str> =
            known.iter().copied().filter(|name| self.dimensions == 3 || *name != "cylinder").collect();
        FileErrorKind::UnknownName { what, name: name.to_owned(), known: known.join(", ") }
    }

    /// The normal of a region that spans the box in all directions but one.
    pub fn normal(&self, shape: &Shape) -> Option<usize> {
        let Shape::Block { low, high } = shape else { return None };
        let lengths = self.domain.lengths();
        let short = |k: &usize| high[*k] - low[*k] < lengths[*k] * (1.0 - ROUNDING);
        let mut short = (0..self.dimensions).filter(short);
        let first = short.next()?;
        short.next().is_none().then_some(first)
    }

    fn check_inside(&self, shape: &Shape, key: &Value) -> Result<(), FileError> {
        let [low, high] = self.whole().bounds(self.dimensions);
        let [from, to] = shape.bounds(self.dimensions);
        for k in 0..self.dimensions {
            let slack = ROUNDING * (high[k] - low[k]);
            if from[k] < low[k] - slack || to[k] > high[k] + slack {
                return Err(key.error(format!(
                    "reaches from {} to {} along {}, out of the box from {} to {}",
                    from[k],
                    to[k],
                    ["x", "y", "z"][k],
                    low[k],
                    high[k]
                )));
            }
        }
        Ok(())
    }

    fn read_block(&self, section: &Section) -> Result<Shape, FileError> {
        let [mut low, mut high] = self.whole().bounds(self.dimensions);
        for (name, corner) in [("low", &mut low), ("high", &mut high)] {
            if let Some(given) = section.read(name, |value| vector(value, self.dimensions))? {
                corner[..self.dimensions].copy_from_slice(&given[..self.dimensions]);
            }
        }
        if (0..self.dimensions).any(|k| low[k] >= high[k]) {
            return Err(section.error("the corner high must be above low in every direction"));
        }
        Ok(Shape::Block { low, high })
    }

    fn read_slab(&self, section: &Section) -> Result<Shape, FileError> {
        let axis = self.read_axis(section)?;
        let thickness = self.read_thickness(section, axis)?;
        let [mut low, mut high] = self.whole().bounds(self.dimensions);
        let middle = section.read("at", Value::number)?.unwrap_or(0.5 * (low[axis] + high[axis]));
        (low[axis], high[axis]) = (middle - 0.5 * thickness, middle + 0.5 * thickness);
        Ok(Shape::Block { low, high })
    }

    fn read_layer(&self, section: &Section) -> Result<Shape, FileError> {
        let (axis, upper) = section.require("face")?.one_of("face", &FACES[..2 * self.dimensions])?;
        let thickness = self.read_thickness(section, axis)?;
        let [mut low, mut high] = self.whole().bounds(self.dimensions);
        match upper {
            true => low[axis] = high[axis] - thickness,
            false => high[axis] = low[axis] + thickness,
        }
        Ok(Shape::Block { low, high })
    }

    fn read_cylinder(&self, section: &Section) -> Result<Shape, FileError> {
        let axis = self.read_axis(section)?;
        let length = section.read("length", Value::positive)?.unwrap_or(self.domain.lengths()[axis]);
        let radius = section.require("radius")?.positive()?;
        Ok(Shape::Cylinder { axis, center: self.read_center(section)?, radius, length })
    }

    fn read_axis(&self, section: &Section) -> Result<usize, FileError> {
        let axis = section.read("axis", |value| axis(value, self.dimensions))?;
        Ok(axis.unwrap_or(self.dimensions - 1))
    }

    fn read_thickness(&self, section: &Section, axis: usize) -> Result<f64, FileError> {
        let value = section.require("thickness")?;
        let thickness = value.positive()?;
        let length = self.domain.lengths()[axis];
        if thickness > length {
            return Err(value.error(format!("must not exceed the box, {length} long, is {thickness}")));
        }
        Ok(thickness)
    }

    fn read_center(&self, section: &Section) -> Result<[f64; 3], FileError> {
        let [low, high] = self.whole().bounds(self.dimensions);
        let center = section.read("center", |value| vector(value, self.dimensions))?;
        Ok(center.unwrap_or_else(|| std::array::from_fn(|k| 0.5 * (low[k] + high[k]))))
    }
}
