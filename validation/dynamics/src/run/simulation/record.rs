//! Records the transport of momentum in a step, for observables.

use super::{Simulation, State};
use crate::integrator::Integrator;
use crate::run::integrator::reflection::{Hit, Leg, Path};
use psidpd_core::engine::thermostat::{Pull, Pulls};
use psidpd_observe::flux::{Acted, Drag, Flux, Line, OnWall, Place, Recorded};
use std::sync::Arc;

/// The transport of momentum in the present step, whose length is `dt`.
#[derive(Debug, Clone, Default)]
pub struct Record {
    what: Recorded,
    dt: f64,
    flux: Flux,
    /// Whether operators may add to the record.
    open: bool,
}

impl Simulation {
    /// Sets what later steps record of the transport of momentum. Trajectories do not depend on it.
    pub fn record_flux(&mut self, what: Recorded) {
        match what {
            Recorded::Nothing => self.record = None,
            _ => self.record.get_or_insert_default().what = what,
        }
    }

    /// The transport of momentum in the present step, if it was recorded.
    pub fn flux(&self) -> Option<&Flux> {
        self.record.as_deref().filter(|record| record.dt > 0.0).map(|record| &record.flux)
    }

    pub(super) fn is_recording(&self) -> bool {
        self.record.as_ref().is_some_and(|record| record.open)
    }

    pub(super) fn records_lines(&self) -> bool {
        self.record.as_ref().is_some_and(|record| record.what == Recorded::Lines)
    }

    pub(super) fn open_record(&mut self, dt: f64) {
        if let Some(record) = &mut self.record {
            // Between two actions the drag of the last goes on.
            let flux = Flux { drag: self.thermostat.held_drag.clone(), ..Flux::default() };
            **record = Record { what: record.what, dt, flux, open: true };
        }
    }

    /// Keeps the drag of this step for the records of the next ones.
    pub(super) fn hold_drag(&mut self) {
        if let Some(record) = &self.record {
            self.thermostat.held_drag.clone_from(&record.flux.drag);
        }
    }

    pub(super) fn close_record(&mut self, integrator: Integrator) {
        let Some(record) = self.record.as_mut().filter(|record| record.open) else { return };
        record.open = false;
        let forces = &mut record.flux.forces;
        for (acted, share) in forces.iter_mut().zip(integrator.properties().force_shares) {
            acted.share = share;
        }
        // The last forces belong to the present positions, so their copy is not needed.
        if let Some(last) = forces.last_mut().filter(|_| integrator.properties().forces_at_end) {
            last.at = None;
        }
    }

    /// Records the ways of all particles to their present positions on a `path`; those that met faces went along `legs`, in the
    /// order of particles.
    pub(super) fn record_ways(&mut self, path: Path, legs: &[Leg], hits: &[Hit]) {
        if !self.is_recording() {
            return;
        }
        self.record_hits(hits);
        let over_dt = self.record.as_deref().map_or(0.0, |record| 1.0 / record.dt);
        let mut ways = Vec::with_capacity(self.len() + legs.len());
        let mut legs = legs.iter().peekable();
        for k in 0..self.len() {
            let mass = self.particles.mass_of(k);
            let momentum = over_dt * mass;
            if legs.peek().is_some_and(|leg| leg.particle == k) {
                while let Some(Leg { to, d, u, .. }) = legs.next_if(|leg| leg.particle == k) {
                    ways.push(Line { from: *to, d: *d, f: u.map(|u| momentum * u) });
                }
                continue;
            }
            let ahead = path.ahead / mass;
            let (v, f) = (self.particles.now().v[k], self.forces()[k]);
            let u: [f64; 3] = std::array::from_fn(|c| v[c] + ahead * f[c]);
            let from = self.particles.now().x[k];
            ways.push(Line { from, d: u.map(|u| path.time * u), f: u.map(|u| momentum * u) });
        }
        if let Some(record) = self.record.as_deref_mut() {
            record.flux.ways.extend(ways);
        }
    }

    /// Records the momentum that particles carry with their present velocities, along paths so short that
    /// their place does not matter.
    pub(super) fn record_momenta(&mut self) {
        const TIME: f64 = 1e-9;
        let way = |k: usize| {
            let momentum = self.particles.mass_of(k) / TIME;
            let v = self.particles.now().v[k];
            Line { from: self.particles.now().x[k], d: v.map(|v| TIME * v), f: v.map(|v| momentum * v) }
        };
        let ways: Vec<Line> = (0..self.len()).map(way).collect();
        if let Some(record) = &mut self.record {
            record.flux.ways = ways;
        }
    }

    /// Records the conservative forces on particles at the present positions, with their virial; `displaced`
    /// holds the positions of the evaluation, if they differ.
    pub(super) fn record_forces(&mut self, virial: [f64; 6], displaced: Option<Vec<[f64; 3]>>) {
        if !self.is_recording() {
            return;
        }
        let State { x, species, .. } = self.particles.now();
        let place = || Place { x: x.clone(), species: species.clone(), displaced };
        let on_walls = self.forces_of_fluid_on_walls();
        let acted = Acted { share: 1.0, virial, on_walls, at: self.records_lines().then(place) };
        if let Some(record) = &mut self.record {
            record.flux.forces.push(acted);
        }
    }

    /// The conservative forces on the walls in the last evaluation.
    fn forces_of_fluid_on_walls(&self) -> Vec<OnWall> {
        let one = |taken: &psidpd_core::engine::OnWall| {
            let [x, y, z] = taken.vector;
            [x, y, z, taken.force]
        };
        self.engine().on_walls().iter().map(one).collect()
    }

    /// Records the friction of walls, and what they are `given` by it.
    pub(super) fn record_friction(&mut self, drag: Arc<Drag>, given: &[OnWall]) {
        if let Some(record) = &mut self.record {
            record.flux.drag.push(drag);
            add_to_walls(&mut record.flux.on_walls, given);
        }
    }

    /// Records the momentum that `hits` give to walls.
    pub(super) fn record_hits(&mut self, hits: &[Hit]) {
        let over_dt = self.record.as_deref().map_or(0.0, |record| 1.0 / record.dt);
        let mut given = vec![[0.0; 4]; self.engine().plan().walls().len()];
        for (index, (wall, given)) in self.engine().plan().walls().iter().zip(&mut given).enumerate() {
            let here = |hit: &&Hit| match (wall.wall.surface.face(), hit.wall) {
                (Some((axis, high)), None) => hit.direction == axis && (hit.momentum < 0.0) == high,
                (None, Some(wall)) => wall == index,
                _ => false,
            };
            let mut sums = [0.0; 4];
            for hit in hits.iter().filter(here) {
                sums[hit.direction] += hit.momentum;
                sums[3] -= hit.push;
            }
            *given = sums.map(|sum| -over_dt * sum);
        }
        if let Some(record) = &mut self.record {
            add_to_walls(&mut record.flux.on_walls, &given);
        }
    }

    /// Records the drag during a part `share` of the step, which `of` computes: it is called with the function that makes lines of
    /// pairs, if lines are recorded.
    pub(super) fn record_drag(
        &mut self,
        share: f64,
        of: impl FnOnce(&Simulation, Option<LineOf>) -> Pulls<Line>,
    ) {
        let x = &self.particles.now().x;
        let line =
            |pull: Pull| Line { from: x[pull.i], d: pull.d, f: pull.d.map(|d| share * pull.strength * d) };
        let line: LineOf = &line;
        let Pulls { virial, of_planes } = of(self, self.records_lines().then_some(line));
        if let Some(record) = &mut self.record {
            let drag = Drag { sum: virial.map(|w| share * w), lines: of_planes };
            record.flux.drag.push(Arc::new(drag));
        }
    }
}

fn add_to_walls(sums: &mut Vec<OnWall>, given: &[OnWall]) {
    sums.resize(given.len(), [0.0; 4]);
    for (sum, given) in sums.iter_mut().zip(given) {
        (0..4).for_each(|c| sum[c] += given[c]);
    }
}

/// Makes a line of the drag of a pair.
pub(super) type LineOf<'a> = &'a (dyn Fn(Pull) -> Line + Sync);
