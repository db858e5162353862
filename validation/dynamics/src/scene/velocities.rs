//! `velocities` of a filled region or of a start from a file.

use super::{FileError, Section};
use crate::particles::maxwell;
use chacha20::ChaCha8Rng;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Velocities {
    /// Maxwell's distribution at the temperature of the scene, with zero total momentum of the part.
    #[default]
    Thermal,
    Zero,
}

impl Velocities {
    pub(super) const OF_PARTS: [(&str, Velocities); 2] =
        [("thermal", Velocities::Thermal), ("zero", Velocities::Zero)];
    pub(super) const OF_FILES: [(&str, Option<Velocities>); 3] =
        [("thermal", Some(Velocities::Thermal)), ("zero", Some(Velocities::Zero)), ("keep", None)];

    /// Reads the velocities of a filled region.
    pub(super) fn read(section: &Section) -> Result<Velocities, FileError> {
        let named = section.read("velocities", |value| value.one_of("velocities", &Self::OF_PARTS))?;
        Ok(named.unwrap_or_default())
    }

    /// Reads the velocities of a start from a file: `None` keeps those of the file, which is the default if `keep` is set.
    pub(super) fn read_or_keep(initial: &Section, keep: bool) -> Result<Option<Velocities>, FileError> {
        let named = initial.read("velocities", |value| value.one_of("velocities", &Self::OF_FILES))?;
        Ok(named.unwrap_or_else(|| (!keep).then(Velocities::default)))
    }

    /// Draws velocities of particles of the masses `mass`.
    pub(super) fn draw(
        self,
        mass: impl Iterator<Item = f64>,
        kt: f64,
        dimensions: usize,
        random: &mut ChaCha8Rng,
    ) -> Vec<[f64; 3]> {
        match self {
            Velocities::Thermal => maxwell(mass, kt, dimensions, [true; 3], random),
            Velocities::Zero => mass.map(|_| [0.0; 3]).collect(),
        }
    }
}
