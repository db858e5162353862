//! One configuration as the observables see it: what several of them need is computed once.

use super::flux::{Carrier, Flux, Line, Place};
use psidpd_core::engine::pair_sums::{Evaluation, Evaluator};
use psidpd_core::engine::{PeriodicBox, Pool};
use psidpd_core::model::Model;
use std::cell::OnceCell;

/// A configuration of particles, as whoever has them lends it to the observables.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Threads that share what takes long; what comes out does not depend on their number.
    pub pool: &'a Pool,
    /// Number of the step.
    pub step: u64,
    /// Time since the start of the run.
    pub time: f64,
    /// kT.
    pub kt: f64,
    /// The model.
    pub model: &'a Model,
    /// 2 or 3.
    pub dimensions: usize,
    /// The box.
    pub domain: &'a PeriodicBox,
    /// Mass of each species.
    pub masses: &'a [f64],
    /// Positions, in the box.
    pub x: &'a [[f64; 3]],
    /// Velocities.
    pub v: &'a [[f64; 3]],
    /// Boxes travelled.
    pub images: &'a [[i32; 3]],
    /// Species, from 0.
    pub species: &'a [i32],
    /// Tags, from 1.
    pub tags: &'a [i32],
    /// Which particles never move; empty if all do.
    pub frozen: &'a [bool],
    /// kT from the kinetic energy.
    pub temperature: f64,
    /// `½ Σ m v²`.
    pub kinetic_energy: f64,
    /// `(Σ m v v + W)/V`, where a virial was wanted; xx, yy, zz, xy, xz, yz.
    pub pressure: [f64; 6],
    /// The same with conservative forces alone.
    pub conservative_pressure: [f64; 6],
    /// What carried momentum in the step, where that was asked for.
    pub flux: Option<&'a Flux>,
}

/// A configuration with what several observables compute from it.
pub struct Frame<'a> {
    /// The configuration.
    pub view: View<'a>,
    evaluator: &'a Evaluator,
    evaluation: OnceCell<Evaluation>,
    /// Where forces acted at other positions than the present ones.
    earlier: OnceCell<Vec<Option<Evaluation>>>,
}

impl<'a> Frame<'a> {
    /// A configuration of the fluid of `evaluator`.
    pub fn new(view: View<'a>, evaluator: &'a Evaluator) -> Frame<'a> {
        Frame { view, evaluator, evaluation: OnceCell::new(), earlier: OnceCell::new() }
    }

    /// What evaluates its fluid.
    pub fn evaluator(&self) -> &'a Evaluator {
        self.evaluator
    }

    /// Energies and conservative forces.
    pub fn evaluation(&self) -> &Evaluation {
        let View { x, species, domain, .. } = self.view;
        self.evaluation.get_or_init(|| self.evaluator.evaluate(x, species, domain))
    }

    /// Every line that momentum was carried along in the step; whether that is known.
    pub fn lines(&self, mut visit: impl FnMut(Carrier, &Line)) -> bool {
        let Some(flux) = self.view.flux else { return false };
        flux.ways.iter().for_each(|line| visit(Carrier::Particle, line));
        flux.drag.iter().for_each(|line| visit(Carrier::Pair, line));
        let View { x, domain, .. } = self.view;
        let earlier = self.earlier.get_or_init(|| {
            let at = flux.forces.iter().map(|acted| acted.at.as_ref());
            let evaluate = |place: &Place| match &place.displaced {
                Some(to) => self.evaluator.evaluate(&to.x, &place.species, &to.domain),
                None => self.evaluator.evaluate(&place.x, &place.species, domain),
            };
            at.map(|at| at.map(evaluate)).collect()
        });
        for (acted, earlier) in flux.forces.iter().zip(earlier) {
            let x = acted.at.as_ref().map_or(x, |at| &at.x);
            let displaced = acted.at.as_ref().and_then(|at| at.displaced.as_ref());
            for (pair, force) in earlier.as_ref().unwrap_or_else(|| self.evaluation()).pair_forces() {
                let f = pair.d.map(|d| acted.share * force / pair.r * d);
                let back = |k: usize, c: usize| displaced.map_or(0.0, |to| to.x[k][c] - x[k][c]);
                let d = std::array::from_fn(|c| pair.d[c] - (back(pair.i, c) - back(pair.j, c)));
                visit(Carrier::Pair, &Line { from: x[pair.i], d, f });
            }
        }
        true
    }

    /// The pressure tensor of the momentum that was carried, for the whole box; `None` if it is not known.
    pub fn carried_pressure(&self) -> Option<[f64; 6]> {
        Some(self.view.flux?.sum().map(|sum| sum / self.volume()))
    }

    /// The mass of a particle.
    pub fn mass(&self, particle: usize) -> f64 {
        self.view.masses[self.view.species[particle] as usize]
    }

    /// Whether a particle moves: frozen ones do not.
    pub fn moves(&self, particle: usize) -> bool {
        !self.view.frozen.get(particle).is_some_and(|frozen| *frozen)
    }

    /// The volume; in two dimensions the area.
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
