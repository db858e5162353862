//! One configuration for the observables. Quantities that several observables need are computed once.

use super::flux::{Carrier, Flux, Line, Place};
use psidpd_core::engine::pair_sums::{Evaluation, Evaluator};
use psidpd_core::engine::{PeriodicBox, Pool};
use psidpd_core::model::Model;
use std::cell::OnceCell;

/// A configuration of particles that its owner lends to the observables.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The threads that share long work; results do not depend on their number.
    pub pool: &'a Pool,
    pub step: u64,
    /// The time since the start of the run.
    pub time: f64,
    pub kt: f64,
    pub model: &'a Model,
    pub dimensions: usize,
    pub domain: &'a PeriodicBox,
    pub masses: &'a [f64],
    /// Positions are wrapped into the box.
    pub x: &'a [[f64; 3]],
    pub v: &'a [[f64; 3]],
    /// The numbers of periods that each particle has crossed.
    pub images: &'a [[i32; 3]],
    /// Species are counted from 0.
    pub species: &'a [i32],
    /// Tags are counted from 1.
    pub tags: &'a [i32],
    /// True for particles that never move; empty if all particles move.
    pub frozen: &'a [bool],
    pub temperature: f64,
    /// The kinetic energy `½ Σ m v²`.
    pub kinetic_energy: f64,
    /// The tensor `(Σ m v v + W)/V` in the order xx, yy, zz, xy, xz, yz, if the step requested a virial.
    pub pressure: [f64; 6],
    /// The tensor of pressure with conservative forces only.
    pub conservative_pressure: [f64; 6],
    /// The momentum transport in the step, if the step recorded it.
    pub flux: Option<&'a Flux>,
}

/// A configuration with cached results that several observables share.
pub struct Frame<'a> {
    pub view: View<'a>,
    /// It belongs to the fluid of the configuration.
    pub evaluator: &'a Evaluator,
    evaluation: OnceCell<Evaluation>,
    /// The evaluations of forces that acted at positions other than the present ones.
    earlier: OnceCell<Vec<Option<Evaluation>>>,
}

impl<'a> Frame<'a> {
    pub fn new(view: View<'a>, evaluator: &'a Evaluator) -> Frame<'a> {
        Frame { view, evaluator, evaluation: OnceCell::new(), earlier: OnceCell::new() }
    }

    /// Energies and conservative forces.
    pub fn evaluation(&self) -> &Evaluation {
        let View { x, species, domain, .. } = self.view;
        self.evaluation.get_or_init(|| self.evaluator.evaluate(x, species, domain))
    }

    /// Visits every line of momentum transport in the step; returns false if the step did not record them.
    pub fn lines(&self, mut visit: impl FnMut(Carrier, &Line)) -> bool {
        let Some(flux) = self.view.flux else { return false };
        flux.ways.iter().for_each(|line| visit(Carrier::Particle, line));
        flux.drag.iter().for_each(|line| visit(Carrier::Pair, line));
        let View { x, domain, .. } = self.view;
        let earlier = self.earlier.get_or_init(|| {
            let at = flux.forces.iter().map(|acted| acted.at.as_ref());
            let evaluate = |place: &Place| {
                let x = place.displaced.as_ref().unwrap_or(&place.x);
                self.evaluator.evaluate(x, &place.species, domain)
            };
            at.map(|at| at.map(evaluate)).collect()
        });
        for (acted, earlier) in flux.forces.iter().zip(earlier) {
            let x = acted.at.as_ref().map_or(x, |at| &at.x);
            let displaced = acted.at.as_ref().and_then(|at| at.displaced.as_ref());
            for (pair, force) in earlier.as_ref().unwrap_or_else(|| self.evaluation()).pair_forces() {
                let f = pair.d.map(|d| acted.share * force / pair.r * d);
                // A displaced particle may have crossed a face of the box.
                let back = |k: usize| displaced.map_or([0.0; 3], |to| domain.minimum_image(to[k], x[k]));
                let (back_i, back_j) = (back(pair.i), back(pair.j));
                let d = std::array::from_fn(|c| pair.d[c] - (back_i[c] - back_j[c]));
                visit(Carrier::Pair, &Line { from: x[pair.i], d, f });
            }
        }
        true
    }

    /// The pressure tensor of the momentum transport in the whole box; `None` if the step did not record it.
    pub fn carried_pressure(&self) -> Option<[f64; 6]> {
        Some(self.view.flux?.sum().map(|sum| sum / self.volume()))
    }

    pub fn mass(&self, particle: usize) -> f64 {
        self.view.masses[self.view.species[particle] as usize]
    }

    pub fn moves(&self, particle: usize) -> bool {
        !self.view.frozen.get(particle).is_some_and(|frozen| *frozen)
    }

    /// The volume of the box; in two dimensions the area.
    pub fn volume(&self) -> f64 {
        self.view.domain.volume(self.view.dimensions)
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        let earlier = self.earlier.take().unwrap_or_default().into_iter().flatten();
        self.evaluation.take().into_iter().chain(earlier).for_each(|done| self.evaluator.recycle(done));
    }
}
