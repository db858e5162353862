//! The particles that a host passes.

use super::error::EngineError;

/// The host's particles: owned ones first, then ghosts. All slices have one length.
#[derive(Debug, Clone, Copy, Default)]
pub struct Particles<'a> {
    /// Number of owned particles.
    pub owned: usize,
    /// Positions; ghosts are at the position of their image.
    pub x: &'a [[f64; 3]],
    /// Particle numbers from 1 that never change; an image has its owner's.
    pub tag: &'a [i32],
    /// Types, mapped to species by [`Engine::map_kinds`](super::Engine::map_kinds).
    pub kind: &'a [i32],
}

impl Particles<'_> {
    /// Fails if the arrays differ in length, or have more than `2^most` entries.
    pub(super) fn check(&self, most: u32) -> Result<(), EngineError> {
        let all = self.x.len();
        if self.tag.len() != all || self.kind.len() != all || self.owned > all {
            return Err(EngineError::Host("particle arrays have different lengths"));
        }
        if all as u64 > 1 << most {
            return Err(EngineError::Host("too many particles and ghosts on one rank"));
        }
        Ok(())
    }

    /// Fails if there are ghosts, for an evaluation of a whole box.
    pub(super) fn check_no_ghosts(&self) -> Result<(), EngineError> {
        if self.owned == self.x.len() {
            return Ok(());
        }
        Err(EngineError::Host("ghosts are not allowed in an evaluation of the whole box"))
    }

    /// Fails if there are flags of images, but not one for each ghost.
    pub(super) fn check_images(&self, images: &[bool]) -> Result<(), EngineError> {
        if images.is_empty() || images.len() == self.x.len() - self.owned {
            return Ok(());
        }
        Err(EngineError::Host("`images` must have one entry per ghost"))
    }
}
