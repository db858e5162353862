//! `lattice` and `min_distance`: the arrangement of particles in a region.

use super::{FileError, Section};

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Arrangement {
    /// At random: uniformly and independently, or at least `min_distance` from each other and from earlier particles.
    Random {
        /// The minimum distance; 0 for independent particles.
        min_distance: f64,
    },
    /// On a lattice that fits the region.
    Lattice(Lattice),
}

/// A lattice. In a block it is stretched to fit with whole cells; in other regions the sites inside are used.
/// Surplus sites are vacancies, spread evenly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lattice {
    Simple,
    Bcc,
    Fcc,
    Hexagonal,
}

pub const LATTICES: [(&str, Lattice); 3] =
    [("sc", Lattice::Simple), ("bcc", Lattice::Bcc), ("fcc", Lattice::Fcc)];
pub const FLAT_LATTICES: [(&str, Lattice); 2] =
    [("square", Lattice::Simple), ("hexagonal", Lattice::Hexagonal)];

impl Arrangement {
    /// Reads the arrangement; random by default.
    pub(super) fn read(section: &Section, dimensions: usize) -> Result<Arrangement, FileError> {
        let names: &[(&str, Lattice)] = if dimensions == 2 { &FLAT_LATTICES } else { &LATTICES };
        let lattice = section.read("lattice", |value| value.one_of("lattice", names))?;
        match (lattice, section.get("min_distance")) {
            (None, None) => Ok(Arrangement::Random { min_distance: 0.0 }),
            (None, Some(value)) => Ok(Arrangement::Random { min_distance: value.positive()? }),
            (Some(lattice), None) => Ok(Arrangement::Lattice(lattice)),
            (Some(_), Some(value)) => Err(value
                .error("a lattice is given too, which sets the distances of its sites: give one of them")),
        }
    }
}
