//! What drag and noise depend on besides positions: tags and species of the sorted particles.

use super::pass::{close, fill};
use crate::engine::particles::Particles;
use crate::engine::sweep::{PlanePairs, Pool};

/// Tags and species of the sorted particles, followed by those of the first plane's copies, for the pairs of the last plane.
#[derive(Debug, Default)]
pub struct Labels {
    pub tags: Vec<u32>,
    /// Empty with one species.
    pub species: Vec<u8>,
}

impl Labels {
    /// Sorts the labels of the host's particles, of which there are so many species.
    pub fn gather(
        &mut self,
        pool: &Pool,
        order: &[u32],
        planes: &[PlanePairs],
        particles: &Particles,
        species_of_kind: &[i32],
        species: usize,
    ) {
        fill(pool, &mut self.tags, order, |k| particles.tag[k] as u32);
        close(planes, &mut self.tags);
        match species {
            1 => self.species.clear(),
            _ => fill(pool, &mut self.species, order, |k| species_of_kind[particles.kind[k] as usize] as u8),
        }
        close(planes, &mut self.species);
    }
}
