//! Views of a simulation for observables and files.

use super::Simulation;
use crate::particles::order_of_tags;
use psidpd_formats::Frame;
use psidpd_observe::frame::View;

impl Simulation {
    /// The present step as observables see it; `time` is measured from the start of the run.
    pub fn view(&self, time: f64) -> View<'_> {
        View {
            pool: self.engine().pool(),
            step: self.step_number(),
            time,
            kt: self.kt(),
            model: self.model(),
            dimensions: self.dimensions(),
            domain: self.domain(),
            masses: self.masses(),
            x: self.positions(),
            v: self.velocities(),
            images: self.image_flags(),
            species: self.species(),
            tags: self.tags(),
            frozen: self.frozen(),
            temperature: self.temperature(),
            kinetic_energy: self.kinetic_energy(),
            pressure: self.pressure_tensor(),
            conservative_pressure: self.conservative_pressure_tensor(),
            flux: self.flux(),
        }
    }

    /// The present step for files and pictures; `time` is measured from the start of the run.
    pub fn frame(&self, time: f64) -> Frame<'_> {
        Frame {
            step: self.step_number(),
            time,
            dimensions: self.dimensions(),
            domain: self.domain(),
            names: self.model().species(),
            x: self.positions(),
            v: Some(self.velocities()),
            species: self.species(),
            tag: self.tags(),
        }
    }
}

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
