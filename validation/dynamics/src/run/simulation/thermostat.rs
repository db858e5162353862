//! The thermostat apart from the forces, and how it goes together with them.

use super::external::External;
use super::forces::Forces;
use super::particles::Particles;
use super::{RunError, Simulation};
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Bodies, Effort, Kept, PairThermostat, Pulls, Stream, Update, Warmth};
use psidpd_core::engine::{Pool, Step, Want};
use psidpd_observe::flux::Drag;
use psidpd_observe::piece::Piece;
use std::sync::Arc;

#[derive(Debug)]
pub(super) struct Thermostat {
    pub on: bool,
    pairs: Option<PairThermostat>,
    /// Iterations at earlier temperatures and settings.
    effort_before: Effort,
    /// The positions of which the pairs are known, by their number, and the time that drag and noise act for.
    found: Option<(u64, f64)>,
    /// Virial of the mean force of drag and noise since they last acted, where they are apart from the forces.
    pub impulse_virial: [f64; 6],
    /// The mean drag of the pairs when it last acted, for records of the steps up to the next time.
    pub held_drag: Vec<Arc<Drag>>,
    /// Whether this step, or one before it acts again, asks for that virial; `None` if it does where it asks for that of the forces.
    pub is_asked: Option<bool>,
    /// Whether drag and noise are among the present forces, where they act; `None` if nobody has asked for these forces.
    pub in_forces: Option<bool>,
    kept_forces: Vec<[f64; 3]>,
}

/// One action of a thermostat apart from the forces.
#[derive(Debug, Clone, Copy)]
pub struct Heat {
    pub update: Update,
    pub noise: Law,
    pub time: f64,
    pub stream: Stream,
}

impl Thermostat {
    pub fn new(forces: &Forces) -> Thermostat {
        let pairs = pairs_of(forces);
        Thermostat {
            on: true,
            pairs,
            effort_before: Effort::default(),
            found: None,
            impulse_virial: [0.0; 6],
            held_drag: Vec::new(),
            is_asked: None,
            in_forces: None,
            kept_forces: Vec::new(),
        }
    }

    /// Takes over the temperature and the settings of `forces`.
    pub fn follow(&mut self, forces: &Forces) {
        self.effort_before = self.effort();
        self.pairs = pairs_of(forces);
        self.found = None;
    }

    /// Whether the present forces are those that an integrator needs which has drag in them, or has not.
    pub fn fits(&self, drag_in_forces: bool) -> bool {
        !self.on || self.in_forces.is_none_or(|there| there == drag_in_forces)
    }

    pub fn pairs(&self) -> Option<&PairThermostat> {
        self.pairs.as_ref()
    }

    /// Iterations since the start.
    pub fn effort(&self) -> Effort {
        let mut effort = self.pairs.as_ref().map_or(Effort::default(), PairThermostat::effort);
        effort += self.effort_before;
        effort
    }

    /// Finds the pairs for a time `dt`, and returns them if the thermostat acts; its updates compute what is `kept`.
    fn find_pairs(
        &mut self,
        particles: &Particles,
        external: &External,
        forces: &mut Forces,
        (dt, kept, number): (f64, Kept, u64),
    ) -> Result<Option<&mut PairThermostat>, RunError> {
        let Some(pairs) = self.pairs.as_mut().filter(|_| self.on) else { return Ok(None) };
        let found = Some((particles.moves(), dt));
        if self.found != found {
            let state = particles.now();
            forces.check_width(&state.domain)?;
            let bodies = Bodies {
                domain: &state.domain,
                x: &state.x,
                tag: &state.tag,
                species: &state.species,
                mass: &state.mass,
                frozen: &external.frozen,
            };
            let failed = |source| RunError::Engine { step: number, source };
            pairs.find_pairs_with(&mut forces.engine, &bodies, dt, false).map_err(failed)?;
            self.found = found;
        }
        pairs.keep(kept);
        Ok(Some(pairs))
    }

    /// Adds drag or noise to the forces, between the pairs that were found last.
    fn add_pair_forces(
        &mut self,
        particles: &mut Particles,
        external: &External,
        forces: &Forces,
        drag: bool,
    ) {
        let Some(pairs) = self.pairs.as_mut().filter(|_| self.on) else { return };
        let (state, force) = particles.forces_mut();
        let virial = pairs.add_forces(forces.engine.pool(), &state.v, drag, !drag, force);
        external.clear_frozen(force);
        (0..6).for_each(|c| self.impulse_virial[c] += virial[c]);
    }
}

fn pairs_of(forces: &Forces) -> Option<PairThermostat> {
    PairThermostat::new(forces.engine.plan(), &forces.engine.settings())
}

impl Simulation {
    /// Switches dissipative and random forces off, or on again.
    pub fn set_thermostat(&mut self, on: bool) {
        self.thermostat.on = on;
    }

    /// All forces at the present positions, drag at the present velocities and noise for a step of `dt` among them.
    pub(in crate::run) fn forces_with_thermostat(&mut self, dt: f64, want: Want) -> Result<(), RunError> {
        let step = Step { seed: self.seed, number: self.number, dt };
        self.compute(self.wants(want), self.thermostat.on.then_some(step))?;
        self.add_external_forces();
        self.thermostat.in_forces = Some(true);
        self.record_forces(self.tally().virial, None);
        if !self.is_recording() || !self.has_pair_thermostat() {
            return Ok(());
        }
        let lines = self.records_lines();
        if lines && !self.has_forces_here() {
            let Simulation { particles, external, forces, thermostat, number, .. } = self;
            thermostat.find_pairs(particles, external, forces, (dt, Kept::default(), *number))?;
            self.record_drag_at(1.0, &self.particles.now().v.clone());
        } else {
            let v = lines.then(|| self.particles.now().v.clone());
            self.record_drag_in_forces(self.tally().drag_virial, 1.0, v);
        }
        Ok(())
    }

    /// All forces at the present positions but those of the thermostat.
    pub(in crate::run) fn conservative_forces(&mut self, want: Want) -> Result<(), RunError> {
        self.compute(self.wants(want), None)?;
        self.add_external_forces();
        self.thermostat.in_forces = Some(false);
        self.conservative.are_present(self.particles.moves());
        self.record_forces(self.tally().virial, None);
        Ok(())
    }

    /// Whether drag and noise act.
    pub fn has_pair_thermostat(&self) -> bool {
        self.thermostat.on && self.thermostat.pairs.is_some()
    }

    /// Sets whether the next step, or one before the thermostat acts again, asks for its virial, which is that of its mean force since it
    /// last acted; with `None` each step does that asks for the virial of forces. Trajectories do not depend on it.
    pub fn ask_for_impulses(&mut self, on: Option<bool>) {
        self.thermostat.is_asked = on;
    }

    /// What is asked of an action of the thermostat in a step that asks for `want`.
    pub(in crate::run) fn wants_of_heat(&self, want: Want) -> Want {
        Want { virial: self.thermostat.is_asked.unwrap_or(want.virial), ..want }
    }

    fn wants(&self, want: Want) -> Want {
        Want { virial: want.virial || self.records_sum(), ..want }
    }

    /// All forces at the present positions but drag, noise for a step of `dt` among them.
    pub(in crate::run) fn forces_then_noise(
        &mut self,
        dt: f64,
        want: Want,
        noise: Law,
    ) -> Result<(), RunError> {
        self.conservative_forces(want)?;
        let kept = Kept { virial: want.virial, middle: false };
        let Simulation { particles, external, forces, thermostat, seed, number, .. } = self;
        if let Some(pairs) = thermostat.find_pairs(particles, external, forces, (dt, kept, *number))? {
            pairs.draw(*seed, *number, Stream(0), noise);
            thermostat.add_pair_forces(particles, external, forces, false);
        }
        thermostat.in_forces = Some(true);
        Ok(())
    }

    /// Adds the drag at the present velocities to the forces; after [`Simulation::forces_then_noise`], whose pairs it takes.
    pub(in crate::run) fn add_drag(&mut self) {
        let Simulation { particles, external, forces, thermostat, .. } = self;
        thermostat.add_pair_forces(particles, external, forces, true);
        if self.is_recording() && self.thermostat.on {
            // At the end of a step and at the beginning of the next.
            self.record_drag_at(0.5, &self.particles.now().v.clone());
        }
    }

    /// Records the drag at velocities `v` during a part `share` of the step.
    fn record_drag_at(&mut self, share: f64, v: &[[f64; 3]]) {
        self.record_drag(share, |pairs, pool, pulls| pairs.drags(pool, v, pulls));
    }

    /// Announces that the thermostat will act where the next forces are computed.
    pub(in crate::run) fn expect_heat(&mut self, heat: Heat) {
        let Simulation { forces, thermostat, .. } = self;
        // Updates pair by pair need the order of tags.
        if heat.update == Update::Midpoint
            && let Some(pairs) = thermostat.pairs.as_mut().filter(|_| thermostat.on)
        {
            pairs.ask(&mut forces.engine, heat.time);
            thermostat.found = None;
        }
    }

    /// Changes velocities by the thermostat, if it acts.
    pub(in crate::run) fn heat(&mut self, heat: Heat, want: Want, dt: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let (needed, recording) = (self.drag_needed(), self.is_recording());
        let is_of_pairs = !matches!(heat.update, Update::Midpoint | Update::ImplicitDrag);
        let virial = want.virial || needed.sum || needed.lines && is_of_pairs;
        let kept = Kept { virial, middle: needed.lines };
        let Simulation { particles, external, forces, thermostat, seed, number, .. } = self;
        let what = (heat.time, kept, *number);
        let Some(pairs) = thermostat.find_pairs(particles, external, forces, what)? else { return Ok(()) };
        pairs.draw(*seed, *number, heat.stream, heat.noise);
        let v = particles.velocities_mut();
        let virial = pairs.act_with(&mut forces.engine, heat.update, v);
        if !virial.iter().all(|w| w.is_finite()) {
            return Err(RunError::Impulses { step: *number });
        }
        // The drag that an implicit step ends with is a force, which `add_drag` counts.
        if heat.update != Update::ImplicitDrag {
            // That of a mean force over the step, or over the steps that it acts for.
            for (sum, w) in thermostat.impulse_virial.iter_mut().zip(virial) {
                *sum += w * (heat.time / dt).min(1.0);
            }
        }
        if let Some(k) = not_finite(v) {
            return Err(RunError::Velocity { step: *number, tag: particles.now().tag[k] });
        }
        if recording {
            self.record_heat(heat, dt);
        }
        Ok(())
    }

    /// Records the drag of an action of the thermostat in a step of `dt`.
    fn record_heat(&mut self, heat: Heat, dt: f64) {
        let (share, is_held) = ((heat.time / dt).min(1.0), heat.time > dt);
        let mut held = None;
        match heat.update {
            Update::Midpoint => held = self.record_midpoint(share, is_held),
            // It ends a step: that is half of it.
            Update::ImplicitDrag => self.record_drag_at(0.5 * share, &self.particles.now().v.clone()),
            Update::OrnsteinUhlenbeck | Update::Shardlow { .. } | Update::LoweAndersen => {
                self.record_drag(share, |pairs, pool, pulls| pairs.pulls(pool, pulls));
            }
        }
        if is_held {
            self.hold_drag(held);
        }
    }

    /// Records the drag of a midpoint update during a part `share` of the step, at the velocities at which it acted. Returns that with lines
    /// of its own for the steps that hold it, if this step has none.
    fn record_midpoint(&mut self, share: f64, is_held: bool) -> Option<Drag> {
        let (lines, needed, pairs) = (self.records_lines(), self.drag_needed(), self.thermostat.pairs()?);
        let (sum, mut v) = (pairs.drag_of_midpoint(), Vec::new());
        if needed.lines {
            v.extend_from_slice(&self.particles.now().v);
            pairs.velocities_of_midpoint(self.engine().pool(), &mut v);
        }
        let find = |pairs: &PairThermostat, pool: &Pool, pulls: Option<&mut Vec<Pulls>>| {
            pairs.drags(pool, &v, pulls);
            sum
        };
        if lines && !self.has_forces_here() {
            self.record_drag(share, find);
            return None;
        }
        let held = (is_held && self.drag_needed_later().lines).then(|| self.find_drag(share, true, find));
        self.record_drag_in_forces(sum.map(|w| share * w), share, lines.then_some(v));
        held
    }

    /// Finds the virial of an action of the thermostat, and leaves the velocities as they are.
    pub(in crate::run) fn rehearse(&mut self, heat: Heat, dt: f64) -> Result<(), RunError> {
        let present = self.particles.now().v.clone();
        self.heat(heat, Want::TOTALS, dt)?;
        self.particles.velocities_mut().copy_from_slice(&present);
        self.forces.add_thermostat_virial(self.thermostat.impulse_virial);
        Ok(())
    }

    /// Calls `work` and takes back what it does to the forces, and to their virial.
    pub(in crate::run) fn with_forces_kept(
        &mut self,
        work: impl FnOnce(&mut Simulation) -> Result<(), RunError>,
    ) -> Result<(), RunError> {
        let virial = self.thermostat.impulse_virial;
        let mut kept = std::mem::take(&mut self.thermostat.kept_forces);
        kept.clear();
        kept.extend_from_slice(self.particles.forces());
        let done = work(self);
        self.particles.forces_mut().1.copy_from_slice(&kept);
        self.thermostat.kept_forces = kept;
        self.thermostat.impulse_virial = virial;
        done
    }

    /// Gives back the memory of the thermostat's pairs, which the next step would find anew.
    pub(in crate::run) fn release_pairs(&mut self) {
        self.thermostat.follow(&self.forces);
    }

    /// Iterations of the thermostat since the start of this session.
    pub fn effort(&self) -> Effort {
        #[cfg(feature = "gpu")]
        if let Some(effort) = self.effort_on_gpu() {
            return effort;
        }
        self.thermostat.effort()
    }

    /// What the thermostat sees of the particles, or of a piece of them; `None` where it does not act, or sees none.
    pub fn warmth(&mut self, dt: f64, piece: Option<&Piece>) -> Result<Option<Warmth>, RunError> {
        let Simulation { particles, external, forces, thermostat, number, .. } = self;
        let Some(piece) = piece else {
            let pairs = thermostat.find_pairs(particles, external, forces, (dt, Kept::default(), *number))?;
            return Ok(pairs.and_then(|pairs| pairs.warmth(&particles.now().v, |_| 1.0)));
        };
        let Some(mut pairs) = pairs_of(forces).filter(|_| thermostat.on) else { return Ok(None) };
        let state = particles.now();
        let of = |all: &[bool]| piece.of.iter().filter_map(|k| all.get(*k).copied()).collect::<Vec<_>>();
        let bodies = Bodies {
            domain: &state.domain,
            x: &piece.x,
            tag: &(1..=piece.x.len() as i32).collect::<Vec<_>>(),
            species: &piece.species,
            mass: &state.mass,
            frozen: &of(&external.frozen),
        };
        forces.check_width(&state.domain)?;
        let failed = |source| RunError::Engine { step: *number, source };
        pairs.find_pairs(forces.engine.pool(), &bodies, dt, false).map_err(failed)?;
        let v: Vec<[f64; 3]> = piece.of.iter().map(|k| state.v[*k]).collect();
        Ok(pairs.warmth(&v, |k| piece.weight(piece.x[k]).0))
    }
}

/// The first velocity whose square is not finite.
fn not_finite(v: &[[f64; 3]]) -> Option<usize> {
    // One sum tells whether there is any.
    let sum: f64 = v.iter().flatten().map(|v| v * v).sum();
    if sum.is_finite() { None } else { v.iter().position(|v| !v.iter().all(|c| (c * c).is_finite())) }
}
