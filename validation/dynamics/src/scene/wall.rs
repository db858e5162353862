//! `[[wall]]`: matter behind reflecting faces of the box, and behind cylinders and spheres.

use super::number::vector;
use super::round::{read_round, rounds};
use super::shape::Shapes;
use super::{FileError, Initial, Model, PeriodicBox, Section, Value};
use psidpd_core::model::wall::{Round, Surface, Wall, WallField};
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
                check_room(&section, round, domain, dimensions, range(&tried.walls).max(tried.cutoff()))?;
            }
            for other in &walls {
                check_apart(&item, [&wall, other], domain, dimensions, tried.cutoff())?;
            }
            walls.push(wall);
        }
    }
    Ok(model.with_walls(walls))
}

/// The longest range of the fields of walls.
fn range(walls: &[WallField]) -> f64 {
    let fields = walls.iter().flat_map(|wall| &wall.fields);
    fields
        .map(|field| field.friction.as_ref().map_or(0.0, |f| f.range()).max(field.range))
        .fold(0.0, f64::max)
}

/// Refuses a round surface that does not fit into the box: it lies in the box, and images of it and of the fluid see nothing of each
/// other.
fn check_room(
    section: &Section,
    round: &Round,
    domain: &PeriodicBox,
    dimensions: usize,
    range: f64,
) -> Result<(), FileError> {
    let radius = section.require("radius")?;
    let tilted = (0..3).any(|k| (0..3).any(|c| c != k && domain.edge(k)[c] != 0.0));
    if tilted {
        return Err(section.require("shape")?.error("a round wall needs a box without tilt"));
    }
    for c in (0..dimensions).filter(|c| round.across[*c]) {
        let (low, length) = (domain.origin()[c], domain.lengths()[c]);
        let (periodic, name) = (domain.periodic()[c], ["x", "y", "z"][c]);
        // What is left of the box beside the surface, and how much is needed.
        let margin = if round.inside || periodic { 0.0 } else { range };
        let rest = if !periodic {
            0.0
        } else if round.inside {
            range
        } else {
            2.0 * range
        };
        let reach = round.radius + margin - 1e-9 * length;
        if round.center[c] - reach < low || round.center[c] + reach > low + length {
            let needs = if margin > 0.0 {
                format!(", and {margin} from the reflecting faces")
            } else {
                String::new()
            };
            return Err(radius.error(format!("the surface does not lie in the box along {name}{needs}")));
        }
        if length < 2.0 * round.radius + rest {
            let help = format!("a length of {:?} along {name}, or more", 2.0 * round.radius + rest);
            let message = "the box is so small that fluid beside the surface sees its own images, or those of the surface";
            return Err(radius.error(message).with_help(help));
        }
    }
    Ok(())
}

/// Refuses two walls that may have one particle between them in a step: round ones keep a range from others.
fn check_apart(
    item: &Value,
    walls: [&Wall; 2],
    domain: &PeriodicBox,
    dimensions: usize,
    range: f64,
) -> Result<(), FileError> {
    let rounds: Vec<&Round> = walls.iter().filter_map(|wall| wall.surface.round()).collect();
    let face = walls.iter().find_map(|wall| wall.surface.face());
    let error = match (&rounds[..], face) {
        ([round], Some((axis, _))) if round.inside && round.across[axis] => {
            Some("a wall with the fluid inside has no other across it".to_owned())
        }
        ([a, b], _) if a.inside || b.inside => {
            Some("a wall with the fluid inside has no other round one beside it".to_owned())
        }
        ([a, b], _) => {
            let along = |c: usize| {
                let (d, period) = (a.center[c] - b.center[c], domain.lengths()[c]);
                let nearest = if domain.periodic()[c] { d - period * (d / period).round() } else { d };
                if a.across[c] && b.across[c] { nearest } else { 0.0 }
            };
            let apart = (0..dimensions).map(along).map(|d| d * d).sum::<f64>().sqrt() - a.radius - b.radius;
            (apart < range)
                .then(|| format!("two round walls are {apart:.4} apart, less than the range {range}"))
        }
        _ => None,
    };
    error.map_or(Ok(()), |message| Err(item.error(message)))
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
    let species = match section.get("species") {
        Some(value) => value.string()?.among("species", model.species().iter().zip(0..))?,
        None if model.species().len() == 1 => 0,
        None => {
            return Err(
                section.error("the model has several species: name that of the wall's matter, `species`")
            );
        }
    };
    let number = |key: &str| section.get(key).map(|value| value.positive()).transpose();
    let matter = number("density")?.unwrap_or(density);
    if !(matter > 0.0 && matter.is_finite()) {
        return Err(section.error("the density of the wall's matter is missing, `density`"));
    }
    let drag = section.get("drag").map(|value| not_negative(&value)).transpose()?;
    let drag = [drag, number("drag_range")?];
    if let Some(value) = section.get("viscosity")
        && drag[0].is_some()
    {
        return Err(value.error("the drag is given too, and the viscosity determines it: give one of them"));
    }
    let local_densities = match number("local_density")? {
        Some(n) => vec![n; model.at(kt)?.densities.len()],
        None => {
            model.at(kt).ok().and_then(|fluid| local_densities_of_matter(&fluid, matter)).unwrap_or_default()
        }
    };
    let strength = section.get("strength").map(|value| not_negative(&value)).transpose()?.unwrap_or(1.0);
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
