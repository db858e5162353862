//! Particles in the order of files.

use super::Simulation;
use crate::particles::order_of_tags;
use psidpd_formats::Frame;

/// A copy of the particles of one step, sorted by their tags.
#[derive(Debug, Clone, Default)]
pub(super) struct ByTag {
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    species: Vec<i32>,
    tag: Vec<i32>,
}

impl ByTag {
    /// Copies and sorts the present particles; `None` if they are sorted already.
    pub fn of(simulation: &Simulation) -> Option<ByTag> {
        if simulation.tags().is_sorted() {
            return None;
        }
        let order = order_of_tags(simulation.tags());
        Some(ByTag {
            x: order.iter().map(|k| simulation.positions()[*k]).collect(),
            v: order.iter().map(|k| simulation.velocities()[*k]).collect(),
            species: order.iter().map(|k| simulation.species()[*k]).collect(),
            tag: order.iter().map(|k| simulation.tags()[*k]).collect(),
        })
    }

    pub fn frame<'a>(&'a self, simulation: &'a Simulation, time: f64) -> Frame<'a> {
        Frame {
            x: &self.x,
            v: Some(&self.v),
            species: &self.species,
            tag: &self.tag,
            ..simulation.frame(time)
        }
    }
}
