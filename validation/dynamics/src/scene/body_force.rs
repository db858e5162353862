//! `[[body_force]]`: accelerations of some of the particles.

use super::number::{axis, vector};
use super::{BodyForce, FileError, Initial, Model, Section, Tags};

pub fn read(root: &Section, model: &Model, initial: &Initial) -> Result<Vec<BodyForce>, FileError> {
    let Some(value) = root.get("body_force") else { return Ok(Vec::new()) };
    value.array()?.iter().map(|item| read_one(&item.section()?, model, initial)).collect()
}

fn read_one(section: &Section, model: &Model, initial: &Initial) -> Result<BodyForce, FileError> {
    let dimensions = model.dimensions();
    let value = section.require("acceleration")?;
    let acceleration = vector(&value, dimensions)?;
    let reversed_along = section.read("reversed_along", |value| axis(value, dimensions))?;
    if reversed_along.is_some_and(|k| acceleration[k] != 0.0) {
        return Err(value.error("must not be along the direction in which it is reversed"));
    }
    Ok(BodyForce {
        acceleration,
        reversed_along,
        species: read_species(section, model)?,
        tags: read_parts(section, initial)?,
    })
}

fn read_species(section: &Section, model: &Model) -> Result<Vec<i32>, FileError> {
    let Some(value) = section.get("species") else { return Ok(Vec::new()) };
    let items = value.array()?;
    let species = items.iter().map(|item| item.string()?.among("species", model.species().iter().zip(0..)));
    let species: Vec<i32> = species.collect::<Result<_, FileError>>()?;
    if species.is_empty() {
        return Err(value.error("names no species"));
    }
    Ok(species)
}

fn read_parts(section: &Section, initial: &Initial) -> Result<Tags, FileError> {
    let Some(value) = section.get("parts") else { return Ok(Tags::All) };
    let mut wanted = Vec::new();
    for item in value.array()? {
        let part = item.string()?.among("part", initial.parts().iter().map(|p| (&p.name, p)))?;
        if part.frozen {
            return Err(item.error(format!("\"{}\" is frozen: no force moves it", part.name)));
        }
        wanted.push(part.name.clone());
    }
    if wanted.is_empty() {
        return Err(value.error("names no part"));
    }
    Ok(initial.tags_of(|part| wanted.contains(&part.name)))
}
