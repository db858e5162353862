//! One configuration as the observables see it: what several of them need is computed once.

use crate::run::Simulation;
use psidpd_core::engine::reference::{Evaluation, Evaluator};
use std::cell::OnceCell;

/// A configuration of a simulation.
pub struct Frame<'a> {
    /// The simulation.
    pub simulation: &'a Simulation,
    /// Time since the start of the run.
    pub time: f64,
    evaluator: &'a Evaluator,
    evaluation: OnceCell<Evaluation>,
}

impl<'a> Frame<'a> {
    /// The present configuration of `simulation`, whose fluid is that of `evaluator`.
    pub fn new(simulation: &'a Simulation, evaluator: &'a Evaluator, time: f64) -> Frame<'a> {
        Frame { simulation, time, evaluator, evaluation: OnceCell::new() }
    }

    /// What evaluates its fluid.
    pub fn evaluator(&self) -> &'a Evaluator {
        self.evaluator
    }

    /// Energies and conservative forces.
    pub fn evaluation(&self) -> &Evaluation {
        let s = self.simulation;
        self.evaluation.get_or_init(|| self.evaluator.evaluate(s.positions(), s.species(), s.domain()))
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
