//! `velocities` of what is filled.

use chacha20::ChaCha8Rng;
use psidpd_core::document::{FileError, Section};
use rand_distr::{Distribution, StandardNormal};

/// How particles move at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Velocities {
    /// Maxwell's distribution at the temperature of the scene, with the momentum of the part taken out. The
    /// velocities are not scaled: their temperature fluctuates as that of a canonical ensemble.
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

    /// The same for a file, whose velocities may be kept: `None`, and what is meant by saying nothing if `keep`.
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
        mass: impl Iterator<Item = f64> + Clone,
        kt: f64,
        dimensions: usize,
        random: &mut ChaCha8Rng,
    ) -> Vec<[f64; 3]> {
        let mut v: Vec<[f64; 3]> = mass.clone().map(|_| [0.0; 3]).collect();
        if self == Velocities::Zero {
            return v;
        }
        let (mut momentum, mut total) = ([0.0; 3], 0.0);
        for (v, m) in v.iter_mut().zip(mass) {
            let width = (kt / m).sqrt();
            for c in 0..dimensions {
                let normal: f64 = StandardNormal.sample(random);
                v[c] = width * normal;
                momentum[c] += m * v[c];
            }
            total += m;
        }
        for v in &mut v {
            for c in 0..dimensions {
                v[c] -= momentum[c] / total;
            }
        }
        v
    }
}
