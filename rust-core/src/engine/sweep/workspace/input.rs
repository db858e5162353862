use crate::engine::exclusions::Exclusions;
use crate::engine::particles::Particles;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::tally::Want;

/// Room behind the last particle: what whole vectors may read.
pub const VECTOR_PADDING: usize = 16;

/// What the host hands over.
pub struct Input<'a> {
    pub particles: Particles<'a>,
    /// Whether each ghost is an image of a particle that is there too; empty if none is.
    pub images: &'a [bool],
    /// Empty if nothing drags.
    pub v: &'a [[f64; 3]],
    /// Species of each type of particle; negative for those that take no part.
    pub species_of_type: &'a [i32],
    /// What is added to the densities of owned particles beside pairs, a row for each; empty if nothing is.
    pub added_densities: &'a [f64],
    /// Pairs that do not interact.
    pub exclusions: Option<&'a Exclusions>,
    pub thermostat: Option<(PairNoise, f64)>,
    pub totals: bool,
}

impl<'a> Input<'a> {
    pub fn new(
        particles: &Particles<'a>,
        images: &'a [bool],
        v: &'a [[f64; 3]],
        species_of_type: &'a [i32],
        added_densities: &'a [f64],
        thermostat: Option<(PairNoise, f64)>,
        want: Want,
    ) -> Input<'a> {
        Input {
            particles: *particles,
            images,
            v,
            species_of_type,
            added_densities,
            exclusions: None,
            thermostat,
            totals: want.energy || want.virial,
        }
    }

    /// The same without some pairs.
    pub fn excluding(self, exclusions: &'a Exclusions) -> Input<'a> {
        Input { exclusions: Some(exclusions), ..self }
    }

    /// The species of a particle, unless its type is unknown.
    #[inline(always)]
    pub fn species_of(&self, k: usize) -> Option<i32> {
        self.species_of_type.get(self.particles.kind[k] as usize).copied()
    }
}
