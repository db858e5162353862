//! Accelerations that act on particles one by one.

use super::tags::Tags;
use psidpd_core::engine::PeriodicBox;

/// A constant acceleration of some of the particles, as gravity; or one that is reversed in the upper half of
/// the box along some direction, which drives two opposite Poiseuille flows (Backer et al., J. Chem. Phys.
/// 122, 154503 (2005)).
#[derive(Debug, Clone, PartialEq)]
pub struct BodyForce {
    /// The acceleration; the force is the mass times this.
    pub acceleration: [f64; 3],
    /// Direction along which the second half of the box has the opposite acceleration.
    pub reversed_along: Option<usize>,
    /// The species it acts on; empty for all.
    pub species: Vec<i32>,
    /// The particles it acts on, of these species.
    pub tags: Tags,
}

impl BodyForce {
    /// Whether it acts on a particle.
    pub fn acts_on(&self, species: i32, tag: i32) -> bool {
        (self.species.is_empty() || self.species.contains(&species)) && self.tags.contain(tag)
    }

    /// The acceleration at `x`, which lies in the box.
    pub fn at(&self, domain: &PeriodicBox, x: [f64; 3]) -> [f64; 3] {
        match self.reversed_along {
            Some(k) if domain.fraction(x)[k] >= 0.5 => self.acceleration.map(|a| -a),
            _ => self.acceleration,
        }
    }
}
