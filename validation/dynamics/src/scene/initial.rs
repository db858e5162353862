//! The start of a scene: `[initial]`, `[[part]]`, or the density at the top level.

use super::part::{Common, WHOLE};
use super::{
    Arrangement, FileError, Lattice, Model, Part, Path, PathBuf, PeriodicBox, Section, State, Tags, Value,
    Velocities, domain, saved,
};

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

    /// The normal of the first slab that is not frozen, if there is one.
    pub fn slab_axis(&self) -> Option<usize> {
        self.parts().iter().filter(|part| !part.frozen).find_map(|part| part.normal)
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

pub const KINDS: &[&str] = &["random", "lattice", "slab", "sphere", "cylinder", "data", "checkpoint"];

/// Reads the initial state, and the box, which is given by `box` or by the initial file.
pub fn read(root: &Section, model: &Model, base: &Path) -> Result<(Initial, PeriodicBox), FileError> {
    let dimensions = model.dimensions();
    let section = root.get("initial").map(|value| value.section()).transpose()?;
    let Some(section) = section else { return read_without(root, model) };
    let key = section.require("kind")?;
    let kind = key.string()?.value;
    if let Some(other) = root.get("part") {
        return Err(other.error("there is an [initial] too: give one of them"));
    }
    let initial = if let Some(format) = saved::Format::of(&kind) {
        if let Some(value) = root.get("density") {
            return Err(value.error("the initial file gives the particles: remove the density"));
        }
        let periodic = domain::read_boundary_alone(root, dimensions)?;
        let saved::Saved { path, state, velocities, frozen } =
            saved::read(&section, format, model, base, periodic)?;
        let domain = state.domain.clone();
        (Initial::File { path, state: Box::new(state), velocities, frozen }, domain)
    } else {
        let domain = domain::read(root, dimensions)?;
        let common = Common::of(root, model, &domain)?;
        let part = read_one(&kind, &key, &section, &common)?;
        (Initial::Parts(vec![part]), domain)
    };
    Ok(initial)
}

/// Reads a scene without `[initial]`: from its parts, or as the whole box at the density of the scene.
fn read_without(root: &Section, model: &Model) -> Result<(Initial, PeriodicBox), FileError> {
    let parts = root.get("part");
    let density = root.get("density");
    if parts.is_none() && density.is_none() {
        let message = "the scene gives no particles".to_owned();
        let error = root.error(message);
        return Err(error.with_help("give a density, [initial] or [[part]]"));
    }
    let domain = domain::read(root, model.dimensions())?;
    let common = Common::of(root, model, &domain)?;
    let parts = match (parts, density) {
        (Some(parts), _) => common.parts(&parts)?,
        (None, Some(density)) => vec![common.everywhere(&density, density.positive()?)?],
        (None, None) => Vec::new(),
    };
    Ok((Initial::Parts(parts), domain))
}

fn read_one(kind: &str, key: &Value, section: &Section, common: &Common) -> Result<Part, FileError> {
    let shape = match kind {
        "random" | "lattice" => common.shapes.whole(),
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
