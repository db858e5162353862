//! `[[wall]]`: matter behind reflecting faces of the box, and behind cylinders and spheres.

use super::number::vector;
use super::round::{read_round, rounds};
use super::shape::Shapes;
use super::{FileError, Initial, Model, PeriodicBox, Section, Value};
use psidpd_core::engine::{Cramped, check_apart, check_room};
use psidpd_core::model::wall::{Surface, Wall};
use psidpd_core::theory::{self, local_densities_of_matter};
use psidpd_observe::options::FACES;

pub const KINDS: &[(&str, ())] = &[("continuum", ())];

/// Reads the walls of a scene, and returns the model between them.
pub fn read(
    root: &Section,
    model: Model,
    (initial, domain): (&Initial, &PeriodicBox),
    (kt, masses): (f64, &[f64]),
) -> Result<Model, FileError> {
    let Some(value) = root.get("wall") else { return Ok(model) };
    let dimensions = model.dimensions();
    let density =
        density_of_fluid(initial, &Shapes { dimensions, domain, rounds: rounds(root, dimensions, domain)? });
    let mass = masses.iter().sum::<f64>() / masses.len() as f64;
    let mut walls: Vec<Wall> = Vec::new();
    for item in value.array()? {
        let section = item.section()?;
        for mut wall in read_one(&section, &model, domain, (kt, density))? {
            if let Some(value) = section.get("viscosity") {
                wall.drag[0] = Some(drag_without_slip(&value, &wall, &model, density, [kt, mass])?);
            }
            if wall.surface.face().is_some() && walls.iter().any(|other| other.surface == wall.surface) {
                return Err(section.require("faces")?.error("a face has two walls"));
            }
            let tried = model.clone().with_walls(vec![wall.clone()]);
            let tried = tried.at(kt).map_err(|error| item.error(error.kind.to_string()))?;
            if let Some(round) = wall.surface.round() {
                let room = check_room(round, &tried.walls[0], domain, dimensions, tried.cutoff());
                room.map_err(|cramped| not_placed(&section, cramped))?;
            }
            for other in &walls {
                let apart = check_apart([&wall, other], domain, dimensions, tried.cutoff());
                apart.map_err(|cramped| item.error(cramped.message))?;
            }
            walls.push(wall);
        }
    }
    Ok(model.with_walls(walls))
}

fn not_placed(section: &Section, cramped: Cramped) -> FileError {
    let Cramped { message, help } = cramped;
    match section.require("radius").map(|radius| radius.error(message)) {
        Ok(error) => help.into_iter().fold(error, |error, help| error.with_help(help)),
        Err(error) => error,
    }
}

/// The number density of the largest part that moves, or of all particles of a file.
fn density_of_fluid(initial: &Initial, shapes: &Shapes) -> f64 {
    let dimensions = shapes.dimensions;
    let largest = initial.parts().iter().filter(|part| !part.frozen).max_by_key(|part| part.count);
    let (count, volume) = match largest {
        Some(part) => (part.count, part.shape.volume(dimensions)),
        None => (initial.count(), shapes.free().volume(dimensions)),
    };
    count as f64 / volume
}

fn read_one(
    section: &Section,
    model: &Model,
    domain: &PeriodicBox,
    (kt, density): (f64, f64),
) -> Result<Vec<Wall>, FileError> {
    section.require("kind")?.one_of("kind", KINDS)?;
    let dimensions = model.dimensions();
    let species = match section.read("species", Value::string)? {
        Some(name) => name.among("species", model.species().iter().zip(0..))?,
        None if model.species().len() == 1 => 0,
        None => {
            return Err(
                section.error("the model has several species: name that of the wall's matter, `species`")
            );
        }
    };
    let matter = section.read("density", Value::positive)?.unwrap_or(density);
    if !(matter > 0.0 && matter.is_finite()) {
        return Err(section.error("the density of the wall's matter is missing, `density`"));
    }
    let drag = [section.read("drag", not_negative)?, section.read("drag_range", Value::positive)?];
    if let Some(value) = section.get("viscosity")
        && drag[0].is_some()
    {
        return Err(value.error("the drag is given too, and the viscosity determines it: give one of them"));
    }
    let local_densities = match section.read("local_density", Value::positive)? {
        Some(n) => vec![n; model.at(kt)?.densities.len()],
        None => {
            model.at(kt).ok().and_then(|fluid| local_densities_of_matter(&fluid, matter)).unwrap_or_default()
        }
    };
    let strength = section.read("strength", not_negative)?.unwrap_or(1.0);
    let velocity = section.get("velocity");
    let moves = velocity.as_ref().map(|value| vector(value, dimensions)).transpose()?;
    let of = |surface: Surface, velocity: [f64; 3]| Wall {
        surface,
        species,
        density: matter,
        local_densities: local_densities.clone(),
        strength,
        velocity,
        drag,
    };
    let velocity_of = moves.unwrap_or([0.0; 3]);
    if let Some(round) = read_round(section, dimensions, domain)? {
        if let Some(value) = velocity.filter(|_| (0..3).any(|c| round.across[c] && velocity_of[c] != 0.0)) {
            return Err(value.error("a cylinder moves along its axis only, and a sphere not at all"));
        }
        return Ok(vec![of(Surface::Round(round), velocity_of)]);
    }
    let faces = section.require("faces").map_err(|error| {
        error.with_help("faces = [\"zlo\", \"zhi\"], or shape = \"cylinder\" or \"sphere\" for a round wall")
    })?;
    let names = faces.array()?;
    if names.is_empty() {
        return Err(faces.error("names no face"));
    }
    let wall = |name: &Value| {
        let (axis, high) =
            name.string()?.among("face", FACES.iter().copied().filter(|(_, face)| face.0 < dimensions))?;
        if domain.periodic()[axis] {
            let message = "the box is periodic across this face: a wall needs a reflecting one";
            return Err(name
                .error(message)
                .with_help("boundary = [\"periodic\", \"periodic\", \"reflecting\"] in [box]"));
        }
        if let Some(value) = velocity.as_ref().filter(|_| velocity_of[axis] != 0.0) {
            return Err(value.error("a wall moves along its face only"));
        }
        Ok(of(Surface::Face { axis, high }, velocity_of))
    };
    names.iter().map(wall).collect()
}

fn not_negative(value: &Value) -> Result<f64, FileError> {
    match value.number()? {
        number if number >= 0.0 => Ok(number),
        number => Err(value.error(format!("must not be negative, is {number}"))),
    }
}

/// The drag coefficient at which a fluid of the stated viscosity does not slip at the wall.
fn drag_without_slip(
    viscosity: &Value,
    wall: &Wall,
    model: &Model,
    density: f64,
    [kt, mass]: [f64; 2],
) -> Result<f64, FileError> {
    let found = theory::drag_without_slip(model, wall, kt, viscosity.positive()?, [density, mass]);
    found.map_err(|e| viscosity.error(e.kind.to_string()))?.ok_or_else(|| {
        viscosity.error("the range of the drag is missing: the model has no forces, `drag_range`")
    })
}
