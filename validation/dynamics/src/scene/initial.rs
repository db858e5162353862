//! The start of a scene: `[initial]`, `[[part]]`, or the density at the top level.

use super::part::{Common, WHOLE};
use super::{
    Arrangement, FileError, Lattice, Model, Part, Path, PathBuf, PeriodicBox, Section, State, Tags, Value,
    Velocities, domain,
};
use crate::checkpoint;
use nalgebra::{Matrix3, Vector3};
use psidpd_formats::data::DataFile;
use psidpd_observe::{Centre, Slab};

#[derive(Debug, Clone, PartialEq)]
pub enum Initial {
    /// Regions filled with particles. Their tags are consecutive, from 1.
    Parts(Vec<Part>),
    /// A data file or a checkpoint with particles and box. Velocities are drawn anew unless they are kept.
    File {
        path: PathBuf,
        state: Box<State>,
        /// The distribution of new velocities; `None` keeps the velocities of the file.
        velocities: Option<Velocities>,
        frozen: Tags,
    },
}

impl Initial {
    /// The parts; empty for a start from a file.
    pub fn parts(&self) -> &[Part] {
        match self {
            Initial::Parts(parts) => parts,
            Initial::File { .. } => &[],
        }
    }

    /// The number of particles.
    pub fn count(&self) -> usize {
        match self {
            Initial::Parts(parts) => parts.iter().map(|part| part.count).sum(),
            Initial::File { state, .. } => state.len(),
        }
    }

    /// The first slab that is not frozen, if there is one, with what has a centre along its normal.
    pub fn slab(&self, domain: &PeriodicBox, dimensions: usize) -> Option<Slab> {
        /// Parts that fill more of the box leave all particles without a centre.
        const FILLED: f64 = 0.9;
        let mobile = || self.parts().iter().filter(|part| !part.frozen);
        let axis = mobile().find_map(|part| part.normal)?;
        let filled: f64 = self.parts().iter().map(|part| part.shape.volume(dimensions)).sum();
        let mut species = mobile().map(|part| part.composition.main());
        let first = species.next()?;
        let centre = match filled > FILLED * domain.volume(dimensions) {
            false => Centre::All,
            true if species.any(|other| other != first) => Centre::Species(first as i32),
            true => Centre::Box,
        };
        Some(Slab { axis, centre })
    }

    /// The tags of the particles in the parts for which `wanted` holds.
    pub fn tags_of(&self, wanted: impl Fn(&Part) -> bool) -> Tags {
        let mut first = 1;
        let mut ranges = Vec::new();
        for part in self.parts() {
            let next = first + part.count as i32;
            if wanted(part) {
                ranges.push(first..=next - 1);
            }
            first = next;
        }
        Tags::Ranges(ranges)
    }

    pub fn frozen(&self) -> Tags {
        match self {
            Initial::Parts(_) => self.tags_of(|part| part.frozen),
            Initial::File { frozen, .. } => frozen.clone(),
        }
    }
}

/// Kinds that fill a region, kinds that read a file, and all.
pub const FILLED: &[&str] = KINDS.split_at(5).0;
pub const SAVED: &[&str] = KINDS.split_at(5).1;
pub const KINDS: &[&str] = &["random", "lattice", "slab", "sphere", "cylinder", "data", "checkpoint"];

/// Reads the initial state, and the box, which is given by `box` or by the initial file.
pub fn read(root: &Section, model: &Model, base: &Path) -> Result<(Initial, PeriodicBox), FileError> {
    let dimensions = model.dimensions();
    let section = root.read("initial", Value::section)?;
    let Some(section) = section else { return read_without(root, model) };
    let key = section.require("kind")?;
    let kind = key.string()?.value;
    if let Some(other) = root.get("part") {
        return Err(other.error("there is an [initial] too: give one of them"));
    }
    if SAVED.contains(&kind.as_str()) {
        if let Some(value) = root.get("density") {
            return Err(value.error("the initial file gives the particles: remove the density"));
        }
        let periodic = domain::read_boundary_alone(root, dimensions)?;
        return read_saved(&section, kind == "checkpoint", model, base, periodic);
    }
    let domain = domain::read(root, dimensions)?;
    let part = read_one(&kind, &key, &section, &Common::of(root, model, &domain)?)?;
    Ok((Initial::Parts(vec![part]), domain))
}

/// Reads a scene without `[initial]`: from its parts, or as the whole box at the density of the scene.
fn read_without(root: &Section, model: &Model) -> Result<(Initial, PeriodicBox), FileError> {
    let parts = root.get("part");
    if parts.is_none() && root.get("density").is_none() {
        let error = root.error("the scene gives no particles");
        return Err(error.with_help("give a density, [initial] or [[part]]"));
    }
    let domain = domain::read(root, model.dimensions())?;
    let common = Common::of(root, model, &domain)?;
    let parts = match parts {
        Some(parts) => common.parts(&parts)?,
        None => vec![common.fill(root, WHOLE.to_owned(), common.shapes.free())?],
    };
    Ok((Initial::Parts(parts), domain))
}

fn read_one(kind: &str, key: &Value, section: &Section, common: &Common) -> Result<Part, FileError> {
    let shape = match kind {
        "random" | "lattice" => common.shapes.free(),
        "slab" | "sphere" => common.shapes.read(kind, key, section)?,
        "cylinder" if common.shapes.dimensions == 3 => common.shapes.read(kind, key, section)?,
        _ => return Err(key.error(common.shapes.unknown("kind", kind, KINDS))),
    };
    let mut part = common.fill(section, WHOLE.to_owned(), shape)?;
    if kind == "lattice" && section.get("lattice").is_none() {
        if let Some(value) = section.get("min_distance") {
            return Err(value.error("a lattice sets the distances of its sites: remove min_distance"));
        }
        part.arrangement = Arrangement::Lattice(Lattice::Simple);
    }
    Ok(part)
}

/// Reads a start from a file of another run: a checkpoint, which may be the folder of a run with one, or a data file.
fn read_saved(
    section: &Section,
    is_checkpoint: bool,
    model: &Model,
    base: &Path,
    periodic: Option<[bool; 3]>,
) -> Result<(Initial, PeriodicBox), FileError> {
    let value = section.require("file")?;
    let path = base.join(value.string()?.value);
    let read = if is_checkpoint { read_checkpoint } else { read_data };
    let state = read(&path, model, periodic)
        .map_err(|why| value.error(why).with_help("the path is relative to the scene file"))?;
    let velocities = Velocities::read_or_keep(section, is_checkpoint)?;
    let frozen = read_frozen(section, &state)?;
    let domain = state.domain.clone();
    Ok((Initial::File { path, state: Box::new(state), velocities, frozen }, domain))
}

/// Reads a checkpoint, with its own boundaries without `periodic`.
fn read_checkpoint(path: &Path, model: &Model, periodic: Option<[bool; 3]>) -> Result<State, String> {
    let state = checkpoint::read_state(path).map_err(|e| e.to_string())?;
    let periodic = periodic.unwrap_or_else(|| state.domain.periodic());
    let edges = Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::from(state.domain.edge(k))));
    let domain = PeriodicBox::new(state.domain.origin(), edges, periodic).map_err(|e| e.to_string())?;
    let state = State { domain, ..state };
    match state.fault(model.species().len(), model.dimensions()) {
        Some(fault) => Err(format!("is not a state of this model: {fault}")),
        None => Ok(state),
    }
}

/// Reads a data file, without `periodic` with the walls that it names, or as a periodic box.
fn read_data(path: &Path, model: &Model, periodic: Option<[bool; 3]>) -> Result<State, String> {
    let data = DataFile::read(path).map_err(|e| e.to_string())?;
    let periodic = periodic.or(data.boundary()).unwrap_or([true; 3]);
    State::from_data_in(&data, model, periodic).map_err(|e| e.to_string())
}

fn read_frozen(section: &Section, state: &State) -> Result<Tags, FileError> {
    let Some(value) = section.get("frozen_ids") else { return Ok(Tags::none()) };
    let wrong = |message: String| value.error(message);
    let ids: Vec<u64> = value.array()?.iter().map(|v| v.count()).collect::<Result<_, _>>()?;
    let [first, last] = ids[..] else {
        return Err(wrong(format!(
            "expected the first and the last id, found an array of length {}",
            ids.len()
        )));
    };
    let (Ok(first), Ok(last)) = (i32::try_from(first), i32::try_from(last)) else {
        return Err(wrong(format!("{last} exceeds the largest id, 2147483647")));
    };
    let tags = Tags::Ranges(vec![first..=last]);
    match state.tag.iter().filter(|t| tags.contain(**t)).count() {
        0 => Err(wrong(format!("no particle of the file has an id from {first} to {last}"))),
        all if all == state.len() => Err(wrong("every particle is frozen: nothing would move".into())),
        _ => Ok(tags),
    }
}
