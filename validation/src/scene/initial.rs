//! `[initial]`.

use super::composition::Composition;
use super::domain;
use super::positive;
use super::velocities::Velocities;
use crate::lammps::DataFile;
use crate::run::State;
use psidpd_core::document::{FileError, FileErrorKind, Section};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Model;
use std::path::{Path, PathBuf};

/// Most particles that a scene may ask for.
const MOST_PARTICLES: f64 = 1e8;

/// Where a scene starts from.
#[derive(Debug, Clone, PartialEq)]
pub enum Initial {
    /// A box filled by description.
    Filling(Filling),
    /// A data file: particles and box. Velocities are drawn anew unless they are kept.
    File {
        /// Where it is.
        path: PathBuf,
        /// What it holds.
        state: Box<State>,
        /// `None` keeps those of the file.
        velocities: Option<Velocities>,
    },
}

/// How a box is filled.
#[derive(Debug, Clone, PartialEq)]
pub struct Filling {
    /// Where particles are put.
    pub placement: Placement,
    /// How many.
    pub count: usize,
    /// Of which species.
    pub composition: Composition,
    /// How they move.
    pub velocities: Velocities,
}

impl Filling {
    /// The volume of the filled part.
    pub fn volume(&self, domain: &PeriodicBox, dimensions: usize) -> f64 {
        let part = match self.placement {
            Placement::Slab { axis, thickness } => thickness / domain.lengths()[axis],
            Placement::Random | Placement::Lattice => 1.0,
        };
        part * domain.volume(dimensions)
    }
}

/// Where particles are put.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// Anywhere, independently.
    Random,
    /// On a simple cubic (square) lattice that fits the box, with vacancies spread evenly if its sites
    /// are more than the particles.
    Lattice,
    /// Anywhere in a slab in the middle of the box.
    Slab {
        /// Direction of its normal.
        axis: usize,
        /// Its thickness.
        thickness: f64,
    },
}

/// Reads the initial state, and the box: from `[box]`, or from the data file.
pub fn read(root: &Section, model: &Model, base: &Path) -> Result<(Initial, PeriodicBox), FileError> {
    #[derive(Clone, Copy, PartialEq)]
    enum Kind {
        Random,
        Lattice,
        Slab,
        Data,
    }
    let section = root.require("initial")?.section()?;
    let kinds =
        [("random", Kind::Random), ("lattice", Kind::Lattice), ("slab", Kind::Slab), ("data", Kind::Data)];
    let kind = section.require("kind")?.one_of("kind", &kinds)?.value;
    if kind == Kind::Data {
        let initial = read_file(root, &section, model, base)?;
        section.finish()?;
        return Ok(initial);
    }
    let dimensions = model.dimensions();
    let domain = domain::read(root, dimensions)?;
    let mut volume = domain.volume(dimensions);
    let placement = match kind {
        Kind::Random | Kind::Data => Placement::Random,
        Kind::Lattice => Placement::Lattice,
        Kind::Slab => {
            let (axis, thickness) = read_slab(&section, dimensions, &domain)?;
            volume *= thickness / domain.lengths()[axis];
            Placement::Slab { axis, thickness }
        }
    };
    let filling = Filling {
        placement,
        count: read_count(&section, volume)?,
        composition: Composition::read(&section, model.species())?,
        velocities: Velocities::read(&section)?,
    };
    section.finish()?;
    Ok((Initial::Filling(filling), domain))
}

fn read_file(
    root: &Section,
    section: &Section,
    model: &Model,
    base: &Path,
) -> Result<(Initial, PeriodicBox), FileError> {
    if let Some(value) = root.get("box") {
        let message = "the box is that of the data file: leave [box] out".to_owned();
        return Err(value.error(FileErrorKind::Value(message)));
    }
    let value = section.require("file")?;
    let path = base.join(value.string()?.value);
    let state = DataFile::read(&path)
        .map_err(|e| e.to_string())
        .and_then(|data| State::from_data(&data, model).map_err(|e| e.to_string()))
        .map_err(|why| {
            value.error(FileErrorKind::Value(why)).with_help("the path is relative to the scene file")
        })?;
    let velocities = Velocities::read_or_keep(section)?;
    let domain = state.domain.clone();
    Ok((Initial::File { path, state: Box::new(state), velocities }, domain))
}

fn read_slab(section: &Section, dimensions: usize, domain: &PeriodicBox) -> Result<(usize, f64), FileError> {
    let names = [("x", 0), ("y", 1), ("z", 2)];
    let axis = match section.get("axis") {
        Some(value) => value.one_of("axis", &names[..dimensions])?.value,
        None => dimensions - 1,
    };
    let value = section.require("thickness")?;
    let thickness = positive(&value)?;
    let length = domain.lengths()[axis];
    if thickness > length {
        let message = format!("must not exceed the box, {length} long, is {thickness}");
        return Err(value.error(FileErrorKind::Value(message)));
    }
    Ok((axis, thickness))
}

fn read_count(section: &Section, volume: f64) -> Result<usize, FileError> {
    let (value, count) = match (section.get("density"), section.get("count")) {
        (Some(_), Some(count)) => {
            let message = "density is given too: give one of them".to_owned();
            return Err(count.error(FileErrorKind::Value(message)));
        }
        (Some(density), None) => {
            let count = (positive(&density)? * volume).round();
            (density, count)
        }
        (None, Some(count)) => {
            let number = count.count()?.value as f64;
            (count, number)
        }
        (None, None) => {
            return Err(section.error(FileErrorKind::Value("needs a density or a count".into())));
        }
    };
    if count < 1.0 {
        return Err(value.error(FileErrorKind::Value("leaves the box without a particle".into())));
    }
    if count > MOST_PARTICLES {
        let message = format!("{count:.3e} particles are too many: at most {MOST_PARTICLES:.0e}");
        return Err(value.error(FileErrorKind::Value(message)));
    }
    Ok(count as usize)
}
