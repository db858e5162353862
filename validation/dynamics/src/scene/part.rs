//! `[[part]]`: regions filled with particles, such as drops, columns, supports and walls.

use super::number::vector;
use super::round::rounds;
use super::shape::Shapes;
use super::{Arrangement, Composition, FileError, Model, PeriodicBox, Section, Shape, Value, Velocities};

const MOST_PARTICLES: f64 = 1e8;

/// The name of the part that fills a box without parts.
pub const WHOLE: &str = "fluid";

#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub name: String,
    pub shape: Shape,
    /// The normal of a slab across the box; `None` for other shapes.
    pub normal: Option<usize>,
    pub count: usize,
    pub composition: Composition,
    pub arrangement: Arrangement,
    /// The velocities of particles relative to the part.
    pub velocities: Velocities,
    pub velocity: [f64; 3],
    pub frozen: bool,
}

/// Data that all parts of a scene share.
pub struct Common<'a> {
    pub model: &'a Model,
    /// The reader of regions in the box.
    pub shapes: Shapes<'a>,
    /// The density of the scene, for parts that give neither density nor count.
    pub density: Option<f64>,
}

impl<'a> Common<'a> {
    /// Collects the shared data of the scene `root`.
    pub fn of(root: &Section, model: &'a Model, domain: &'a PeriodicBox) -> Result<Common<'a>, FileError> {
        let density = root.read("density", Value::positive)?;
        let dimensions = model.dimensions();
        let rounds = rounds(root, dimensions, domain)?;
        Ok(Common { model, shapes: Shapes { dimensions, domain, rounds }, density })
    }

    /// Reads the particles of a region, except whether they are frozen; `name` is the name of the part.
    pub fn fill(&self, section: &Section, name: String, shape: Shape) -> Result<Part, FileError> {
        let dimensions = self.shapes.dimensions;
        Ok(Part {
            count: self.count(section, shape.volume(dimensions))?,
            composition: Composition::read(section, self.model.species())?,
            arrangement: Arrangement::read(section, dimensions)?,
            velocities: Velocities::read(section)?,
            velocity: section.read("velocity", |v| vector(v, dimensions))?.unwrap_or([0.0; 3]),
            frozen: false,
            normal: self.shapes.normal(&shape),
            name,
            shape,
        })
    }

    fn count(&self, section: &Section, volume: f64) -> Result<usize, FileError> {
        match (section.get("density"), section.get("count"), self.density) {
            (Some(_), Some(count), _) => Err(count.error("density is given too: give one of them")),
            (Some(density), None, _) => {
                let count = (density.positive()? * volume).round();
                check_count(count, |why| density.error(why))
            }
            (None, Some(count), _) => check_count(count.count()? as f64, |why| count.error(why)),
            (None, None, Some(density)) => check_count((density * volume).round(), |why| section.error(why)),
            (None, None, None) => Err(section.error("needs a density or a count")),
        }
    }

    pub fn parts(&self, value: &Value) -> Result<Vec<Part>, FileError> {
        let sections: Vec<Section> = value.array()?.iter().map(Value::section).collect::<Result<_, _>>()?;
        let keys: Vec<Value> = sections.iter().map(|s| s.require("shape")).collect::<Result<_, _>>()?;
        let mut shapes = Vec::with_capacity(sections.len());
        for (section, key) in sections.iter().zip(&keys) {
            shapes.push(self.shapes.read(&key.string()?.value, key, section)?);
        }
        self.check_overlaps(&keys, &shapes)?;
        self.leave_the_rest(&keys, &mut shapes)?;
        let mut parts: Vec<Part> = Vec::with_capacity(sections.len());
        for (k, (section, shape)) in sections.into_iter().zip(shapes).enumerate() {
            let part = self.part(&section, k, shape)?;
            if parts.iter().any(|p| p.name == part.name) {
                let message = format!("\"{}\" names two parts", part.name);
                return Err(match section.get("name") {
                    Some(name) => name.error(message),
                    None => section.error(message),
                });
            }
            parts.push(part);
        }
        check_count(parts.iter().map(|p| p.count as f64).sum(), |why| value.error(why))?;
        if parts.iter().all(|p| p.frozen) {
            return Err(value.error("every part is frozen: nothing would move"));
        }
        Ok(parts)
    }

    fn part(&self, section: &Section, index: usize, shape: Shape) -> Result<Part, FileError> {
        let name = section.read("name", Value::string)?;
        let name = name.map_or_else(|| format!("part {}", index + 1), |name| name.value);
        let frozen = section.read("frozen", Value::boolean)?.unwrap_or(false);
        let moves = ["velocity", "velocities"].iter().find_map(|key| section.get(key));
        if let Some(value) = moves.filter(|_| frozen) {
            return Err(value.error("the part is frozen, and does not move"));
        }
        Ok(Part { frozen, ..self.fill(section, name, shape)? })
    }

    fn check_overlaps(&self, keys: &[Value], shapes: &[Shape]) -> Result<(), FileError> {
        for (k, shape) in shapes.iter().enumerate() {
            if let Some(other) = (0..k).find(|o| shape.overlaps(&shapes[*o], self.shapes.dimensions)) {
                return Err(keys[k].error(format!("overlaps with part {}", other + 1)).with_help(
                    "move or shrink one of them; shape = \"rest\" is what the other parts leave of the box",
                ));
            }
        }
        Ok(())
    }

    /// Gives each part of kind `rest` the list of all other regions.
    fn leave_the_rest(&self, keys: &[Value], shapes: &mut [Shape]) -> Result<(), FileError> {
        let is_rest = |s: &Shape| matches!(s, Shape::Rest { .. });
        let mut rests = (0..shapes.len()).filter(|k| is_rest(&shapes[*k]));
        let Some(first) = rests.next() else { return Ok(()) };
        if let Some(second) = rests.next() {
            return Err(
                keys[second].error(format!("part {} is the rest already: a scene has one rest", first + 1))
            );
        }
        let all: Vec<Shape> = shapes.iter().filter(|s| !is_rest(s)).cloned().collect();
        if let Shape::Rest { others, .. } = &mut shapes[first] {
            others.extend(all);
        }
        let (rest, whole) =
            (shapes[first].volume(self.shapes.dimensions), self.shapes.domain.volume(self.shapes.dimensions));
        if rest <= 1e-9 * whole {
            return Err(keys[first].error("the other parts fill the box and leave no rest"));
        }
        Ok(())
    }
}

/// Checks that a number of particles is at least one and at most the limit.
fn check_count(count: f64, error: impl Fn(String) -> FileError) -> Result<usize, FileError> {
    if count < 1.0 {
        return Err(error("gives less than one particle".into()));
    }
    if count > MOST_PARTICLES {
        return Err(error(format!("{count:.3e} particles are too many: at most {MOST_PARTICLES:.0e}")));
    }
    Ok(count as usize)
}
