//! Records the transport of momentum in a step, for observables.

use super::{Simulation, State};
use crate::integrator::Integrator;
use crate::run::integrator::reflection::{Hit, Leg, Path};
use psidpd_core::engine::Pool;
use psidpd_core::engine::thermostat::{PairThermostat, Pulls};
use psidpd_observe::flux::{Acted, Drag, Dragged, Flux, Line, OnWall, Place, Recorded};
use std::sync::Arc;

/// The transport of momentum in the present step, whose length is `dt`.
#[derive(Debug, Clone, Default)]
pub struct Record {
    what: Recorded,
    /// What the steps up to the next action of the thermostat need of the drag.
    later: NeededDrag,
    dt: f64,
    flux: Flux,
    /// Whether operators may add to the record.
    open: bool,
    /// Of the positions at which the forces acted that were recorded last, [`Particles::moves`]; `None` if they were computed for others.
    acted_at: Option<u64>,
}

/// What steps need of the drag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NeededDrag {
    pub sum: bool,
    pub lines: bool,
}

impl NeededDrag {
    fn with(self, what: Recorded) -> NeededDrag {
        let NeededDrag { sum, lines } = self;
        NeededDrag { sum: sum || what == Recorded::Sum, lines: lines || what == Recorded::Lines }
    }

    /// What steps need that record these.
    pub fn by(all: impl IntoIterator<Item = Recorded>) -> NeededDrag {
        all.into_iter().fold(NeededDrag::default(), NeededDrag::with)
    }
}

/// Arrays of earlier records, for reuse: new ones cost more than what fills them.
#[derive(Debug, Default)]
pub(super) struct Spare {
    ways: Vec<Line>,
    drag: Vec<Drag>,
}

impl Spare {
    fn keep(&mut self, flux: Flux) {
        self.ways = flux.ways;
        self.keep_drag(flux.drag);
    }

    /// Keeps the pairs that nobody else has.
    pub fn keep_drag(&mut self, drag: Vec<Arc<Drag>>) {
        let drag = drag.into_iter().filter_map(Arc::into_inner);
        self.drag.extend(drag.filter(|drag| !drag.pairs.is_empty()));
    }
}

impl Simulation {
    /// Sets what later steps record of the transport of momentum. Trajectories do not depend on it.
    pub fn record_flux(&mut self, what: Recorded) {
        self.record_and_hold_flux(what, NeededDrag::by([what]));
    }

    /// As [`Simulation::record_flux`], where steps up to the next action of the thermostat need no more of the drag than `later`.
    pub(super) fn record_and_hold_flux(&mut self, what: Recorded, later: NeededDrag) {
        if later.with(what) == NeededDrag::default() {
            if let Some(record) = self.record.take() {
                self.spare.keep(record.flux);
            }
        } else {
            let record = self.record.get_or_insert_default();
            (record.what, record.later) = (what, later);
        }
    }

    /// The transport of momentum in the present step, if it was recorded.
    pub fn flux(&self) -> Option<&Flux> {
        let recorded = |record: &&Record| record.dt > 0.0 && record.flux.recorded != Recorded::Nothing;
        self.record.as_deref().filter(recorded).map(|record| &record.flux)
    }

    /// The record that operators add to.
    fn recording(&self) -> Option<&Record> {
        self.record.as_deref().filter(|record| record.open)
    }

    pub(super) fn is_recording(&self) -> bool {
        self.recording().is_some()
    }

    pub(super) fn records_sum(&self) -> bool {
        self.recording().is_some_and(|record| record.what == Recorded::Sum)
    }

    pub(super) fn records_lines(&self) -> bool {
        self.recording().is_some_and(|record| record.what == Recorded::Lines)
    }

    /// What the steps up to the next action of the thermostat need of the drag.
    pub(super) fn drag_needed_later(&self) -> NeededDrag {
        self.recording().map_or(NeededDrag::default(), |record| record.later)
    }

    /// What this step and those need of it.
    pub(super) fn drag_needed(&self) -> NeededDrag {
        self.recording().map_or(NeededDrag::default(), |record| record.later.with(record.what))
    }

    pub(super) fn open_record(&mut self, dt: f64) {
        let Some(record) = self.record.as_deref_mut() else { return };
        if record.dt > 0.0 {
            self.spare.keep(std::mem::take(&mut record.flux));
        }
        let mut ways = std::mem::take(&mut self.spare.ways);
        ways.clear();
        // Between two actions the drag of the last goes on.
        let (recorded, drag) = (record.what, self.thermostat.held_drag.clone());
        record.flux = Flux { recorded, ways, drag, ..Flux::default() };
        (record.dt, record.open, record.acted_at) = (dt, true, None);
    }

    /// Keeps the drag of this step for the records of the next ones: `drag` with lines of its own, if this step has none.
    pub(super) fn hold_drag(&mut self, drag: Option<Drag>) {
        let Some(record) = &self.record else { return };
        let drag = drag.map_or_else(|| record.flux.drag.clone(), |drag| vec![Arc::new(drag)]);
        let before = std::mem::replace(&mut self.thermostat.held_drag, drag);
        self.spare.keep_drag(before);
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
        let mut ways =
            self.record.as_deref_mut().map_or_else(Vec::new, |record| std::mem::take(&mut record.flux.ways));
        ways.reserve(self.len() + legs.len());
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
            record.flux.ways = ways;
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
        let acted_at = displaced.is_none().then(|| self.particles.moves());
        let State { x, species, .. } = self.particles.now();
        let place = || Place { x: x.clone(), species: species.clone(), displaced };
        let on_walls = self.forces_of_fluid_on_walls();
        let at = self.records_lines().then(place);
        let acted = Acted { share: 1.0, virial, on_walls, at, dragged: None };
        if let Some(record) = &mut self.record {
            record.flux.forces.push(acted);
            record.acted_at = acted_at;
        }
    }

    /// Records the drag at velocities `v` during a part `share` of the step, whose lines are those of the forces that were recorded last;
    /// `sum` is its virial, averaged over the step. Without lines nobody needs the velocities.
    pub(super) fn record_drag_in_forces(&mut self, sum: [f64; 6], share: f64, v: Option<Vec<[f64; 3]>>) {
        let dragged = v.map(|v| Dragged { share, v });
        if let Some(flux) = self.record.as_deref_mut().map(|record| &mut record.flux) {
            flux.drag.push(Arc::new(Drag { sum, ..Drag::default() }));
            if let Some(acted) = flux.forces.last_mut() {
                acted.dragged = dragged;
            }
        }
    }

    /// Whether the lines of drag at the present positions are those of the forces that were recorded last.
    pub(super) fn has_forces_here(&self) -> bool {
        let acted_at = self.record.as_ref().and_then(|record| record.acted_at);
        acted_at == Some(self.particles.moves()) && self.engine().plan().drag_is_within_forces()
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

    /// Records the drag during a part `share` of the step, as [`Simulation::find_drag`] finds it, with lines of its own.
    pub(super) fn record_drag(
        &mut self,
        share: f64,
        find: impl FnOnce(&PairThermostat, &Pool, Option<&mut Vec<Pulls>>) -> [f64; 6],
    ) {
        let drag = self.find_drag(share, self.drag_needed().lines, find);
        if let Some(record) = &mut self.record {
            record.flux.drag.push(Arc::new(drag));
        }
    }

    /// The drag during a part `share` of the step. `find` computes its virial, and its pairs for `lines`.
    pub(super) fn find_drag(
        &mut self,
        share: f64,
        lines: bool,
        find: impl FnOnce(&PairThermostat, &Pool, Option<&mut Vec<Pulls>>) -> [f64; 6],
    ) -> Drag {
        let spare = if lines { self.spare.drag.pop() } else { None };
        let mut drag = spare.unwrap_or_default();
        drag.sum = match self.thermostat.pairs() {
            Some(pairs) => find(pairs, self.engine().pool(), lines.then_some(&mut drag.pairs)),
            None => {
                drag.pairs.clear();
                [0.0; 6]
            }
        };
        drag.sum.iter_mut().for_each(|w| *w *= share);
        if lines {
            drag.x.clone_from(&self.particles.now().x);
            drag.pairs
                .iter_mut()
                .flat_map(|pairs| &mut pairs.strengths)
                .for_each(|strength| *strength *= share);
        }
        drag
    }
}

fn add_to_walls(sums: &mut Vec<OnWall>, given: &[OnWall]) {
    sums.resize(given.len(), [0.0; 4]);
    for (sum, given) in sums.iter_mut().zip(given) {
        (0..4).for_each(|c| sum[c] += given[c]);
    }
}
