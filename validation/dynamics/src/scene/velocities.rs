//! `velocities` of what is filled.

use crate::particles::thermal_velocities;
use chacha20::ChaCha8Rng;
use psidpd_core::document::{FileError, Section};

/// How particles move at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Velocities {
    /// Maxwell's distribution at the temperature of the scene, with the momentum of the part taken out.
    #[default]
    Thermal,
    /// Not at all.
    Zero,
}

impl Velocities {
    pub(super) fn read(initial: &Section) -> Result<Velocities, FileError> {
        let names = [("thermal", Velocities::Thermal), ("zero", Velocities::Zero)];
        match initial.get("velocities") {
            Some(value) => Ok(value.one_of("velocities", &names)?.value),
            None => Ok(Velocities::default()),
        }
    }

    /// The same for a start from a file: `None` keeps its velocities, which is the default if `keep` is set.
    pub(super) fn read_or_keep(initial: &Section, keep: bool) -> Result<Option<Velocities>, FileError> {
        let names =
            [("thermal", Some(Velocities::Thermal)), ("zero", Some(Velocities::Zero)), ("keep", None)];
        match initial.get("velocities") {
            Some(value) => Ok(value.one_of("velocities", &names)?.value),
            None => Ok((!keep).then(Velocities::default)),
        }
    }

    /// Velocities of particles of the masses `mass`.
    pub(super) fn draw(
        self,
        mass: impl Iterator<Item = f64>,
        kt: f64,
        dimensions: usize,
        random: &mut ChaCha8Rng,
    ) -> Vec<[f64; 3]> {
        match self {
            Velocities::Thermal => thermal_velocities(mass, kt, dimensions, random),
            Velocities::Zero => mass.map(|_| [0.0; 3]).collect(),
        }
    }
}
