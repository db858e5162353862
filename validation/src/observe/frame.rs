//! One configuration as the observables see it: what several of them need is computed once.

use super::interactions::Interactions;
use super::landscape::Landscape;
use crate::run::Simulation;
use std::cell::OnceCell;

/// A configuration of a simulation.
pub struct Frame<'a> {
    /// The simulation.
    pub simulation: &'a Simulation,
    /// Time since the start of the run.
    pub time: f64,
    interactions: &'a Interactions,
    landscape: OnceCell<Landscape>,
}

impl<'a> Frame<'a> {
    /// The present configuration of `simulation`, whose fluid is that of `interactions`.
    pub fn new(simulation: &'a Simulation, interactions: &'a Interactions, time: f64) -> Frame<'a> {
        Frame { simulation, time, interactions, landscape: OnceCell::new() }
    }

    /// The fluid.
    pub fn interactions(&self) -> &'a Interactions {
        self.interactions
    }

    /// Energies and conservative forces.
    pub fn landscape(&self) -> &Landscape {
        let s = self.simulation;
        self.landscape
            .get_or_init(|| Landscape::new(self.interactions, s.positions(), s.species(), s.domain()))
    }

    /// The mass of a particle.
    pub fn mass(&self, particle: usize) -> f64 {
        self.simulation.masses()[self.simulation.species()[particle] as usize]
    }

    /// Whether a particle moves: frozen ones do not.
    pub fn moves(&self, particle: usize) -> bool {
        !self.simulation.frozen().get(particle).is_some_and(|frozen| *frozen)
    }

    /// The volume; in two dimensions the area.
    pub fn volume(&self) -> f64 {
        self.simulation.domain().volume(self.simulation.dimensions())
    }
}
