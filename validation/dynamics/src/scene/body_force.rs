//! `[[body_force]]`: accelerations of some of the particles.

use super::composition::species_of;
use super::number::{axis, vector};
use super::{BodyForce, FileError, FileErrorKind, Initial, Model, Section, Tags};

pub fn read(root: &Section, model: &Model, initial: &Initial) -> Result<Vec<BodyForce>, FileError> {
    let Some(value) = root.get("body_force") else { return Ok(Vec::new()) };
    value.array()?.iter().map(|item| read_one(&item.section()?, model, initial)).collect()
}

fn read_one(section: &Section, model: &Model, initial: &Initial) -> Result<BodyForce, FileError> {
    let dimensions = model.dimensions();
    let value = section.require("acceleration")?;
    let acceleration = vector(&value, dimensions)?;
    let reversed_along = section.get("reversed_along").map(|v| axis(&v, dimensions)).transpose()?;
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
    let species = items.iter().map(|item| Ok(species_of(&item.string()?, model.species())? as i32));
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
        let name = item.string()?.value;
        let Some(part) = initial.parts().iter().find(|p| p.name == name) else {
            let known: Vec<&str> = initial.parts().iter().map(|p| p.name.as_str()).collect();
            let known = known.join(", ");
            return Err(item.error(FileErrorKind::UnknownName { what: "part", name, known }));
        };
        if part.frozen {
            return Err(item.error(format!("\"{name}\" is frozen: no force moves it")));
        }
        wanted.push(name);
    }
    if wanted.is_empty() {
        return Err(value.error("names no part"));
    }
    Ok(initial.tags_of(|part| wanted.contains(&part.name)))
}
