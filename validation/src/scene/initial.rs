//! `[initial]`.

use super::composition::Composition;
use super::positive;
use super::velocities::Velocities;
use psidpd_core::document::{FileError, FileErrorKind, Section};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Model;

/// Most particles that a scene may ask for.
const MOST_PARTICLES: f64 = 1e8;

/// How the box is filled.
#[derive(Debug, Clone, PartialEq)]
pub struct Initial {
    /// Where particles are put.
    pub placement: Placement,
    /// How many.
    pub count: usize,
    /// Of which species.
    pub composition: Composition,
    /// How they move.
    pub velocities: Velocities,
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

/// Reads the initial state.
pub fn read(root: &Section, model: &Model, domain: &PeriodicBox) -> Result<Initial, FileError> {
    #[derive(Clone, Copy)]
    enum Kind {
        Random,
        Lattice,
        Slab,
    }
    let section = root.require("initial")?.section()?;
    let kinds = [("random", Kind::Random), ("lattice", Kind::Lattice), ("slab", Kind::Slab)];
    let dimensions = model.dimensions();
    let mut volume = domain.volume(dimensions);
    let placement = match section.require("kind")?.one_of("kind", &kinds)?.value {
        Kind::Random => Placement::Random,
        Kind::Lattice => Placement::Lattice,
        Kind::Slab => {
            let (axis, thickness) = read_slab(&section, dimensions, domain)?;
            volume *= thickness / domain.lengths()[axis];
            Placement::Slab { axis, thickness }
        }
    };
    let initial = Initial {
        placement,
        count: read_count(&section, volume)?,
        composition: Composition::read(&section, model.species())?,
        velocities: Velocities::read(&section)?,
    };
    section.finish()?;
    Ok(initial)
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
