use crate::engine::exclusions::Exclusions;
use crate::engine::particles::Particles;
use psidpd_passes::noise::PairNoise;

/// Number of elements after the last particle that whole vectors may read.
pub const VECTOR_PADDING: usize = 16;

/// The input of an evaluation, from the host.
#[derive(Default)]
pub struct Input<'a> {
    pub particles: Particles<'a>,
    /// Whether each ghost is an image of another particle of this rank; empty if none is.
    pub images: &'a [bool],
    /// Velocities; empty without a thermostat.
    pub v: &'a [[f64; 3]],
    /// Species of each type of particle; negative for particles that are left out.
    pub species_of_type: &'a [i32],
    /// Additions to the densities of owned particles, a row for each; empty if there are none.
    pub added_densities: &'a [f64],
    /// Pairs that do not interact.
    pub exclusions: Option<&'a Exclusions>,
    pub thermostat: Option<(PairNoise, f64)>,
    pub totals: bool,
}

impl Input<'_> {
    /// Whether there are ghosts that are not images: only these are sorted.
    pub fn has_ghosts(&self) -> bool {
        let Particles { owned, x, .. } = self.particles;
        owned < x.len() && (self.images.is_empty() || self.images.contains(&false))
    }

    /// The species of a particle, or `None` if its type is unknown.
    #[inline(always)]
    pub fn species_of(&self, k: usize) -> Option<i32> {
        self.species_of_type.get(self.particles.kind[k] as usize).copied()
    }
}
