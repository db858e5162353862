//! `lattice` and `min_distance`: how particles are arranged where they are put.

use super::number::positive;
use psidpd_core::document::{FileError, FileErrorKind, Section};

/// How particles are arranged in a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Arrangement {
    /// Uniformly and independently, or at least so far from each other and from what is there already.
    Random {
        /// The distance; 0 for independent particles.
        min_distance: f64,
    },
    /// On a lattice that fits the region; see [`Lattice`].
    Lattice(Lattice),
}

/// A lattice. In a block it is stretched to fit with whole cells; elsewhere its sites inside are taken. Sites
/// left over are vacancies, spread evenly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lattice {
    /// Simple cubic; square in two dimensions.
    Simple,
    /// Body-centred cubic.
    Bcc,
    /// Face-centred cubic.
    Fcc,
    /// Hexagonal, in two dimensions.
    Hexagonal,
}

/// Names in three dimensions.
pub const LATTICES: [(&str, Lattice); 3] =
    [("sc", Lattice::Simple), ("bcc", Lattice::Bcc), ("fcc", Lattice::Fcc)];
/// Names in two dimensions.
pub const FLAT_LATTICES: [(&str, Lattice); 2] =
    [("square", Lattice::Simple), ("hexagonal", Lattice::Hexagonal)];

impl Arrangement {
    /// Reads the arrangement; random if the file says nothing.
    pub(super) fn read(section: &Section, dimensions: usize) -> Result<Arrangement, FileError> {
        let names: &[(&str, Lattice)] = if dimensions == 2 { &FLAT_LATTICES } else { &LATTICES };
        let lattice = section.get("lattice").map(|v| v.one_of("lattice", names)).transpose()?;
        match (lattice, section.get("min_distance")) {
            (None, None) => Ok(Arrangement::Random { min_distance: 0.0 }),
            (None, Some(value)) => Ok(Arrangement::Random { min_distance: positive(&value)? }),
            (Some(lattice), None) => Ok(Arrangement::Lattice(lattice.value)),
            (Some(_), Some(value)) => {
                let message = "a lattice is given too: its sites are apart as they are".to_owned();
                Err(value.error(FileErrorKind::Value(message)))
            }
        }
    }
}
