//! What steps are composed of: drift, kick, forces, thermostat.
//!
//! A kick that ends a step may be deferred: the next step, if it begins with the same kick and a drift, makes both
//! in one loop, with the same bits.

use super::super::integrator::parts::{Faults, Motion, Surroundings, drift, kick, share};
use super::{Bounds, RunError, Simulation, check_width};
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Bodies, Stream, Update, Warmth};
use psidpd_core::engine::{PeriodicBox, Pool, Step, Want};

/// A thermostat apart from the forces.
#[derive(Debug, Clone, Copy)]
pub struct Heat {
    pub update: Update,
    /// The law of its noise.
    pub noise: Law,
    /// How long it acts.
    pub time: f64,
    pub stream: Stream,
}

impl Simulation {
    /// `v += h f/m; x += dt v`, in one loop; particles are put back into the box.
    pub(in crate::run) fn kick_and_drift(&mut self, h: f64, dt: f64) -> Result<(), RunError> {
        let deferred = self.deferred == Some(h);
        if deferred {
            self.deferred = None;
        }
        self.make_deferred_kick()?;
        let limit = self.longest_move / (dt * dt);
        self.moves += 1;
        let faults = self.with_motion(|mut motion, (domain, bounds), pool| {
            let around = Surroundings { domain, bounds, limit };
            motion.keep_nothing();
            motion.over_mass(|mass| h / mass);
            share(motion, pool, |part, over_mass| {
                if deferred {
                    drift(part, over_mass, around, |x, v, f, over_mass| {
                        let kick = over_mass * f;
                        let v = v + kick + kick;
                        (x + dt * v, v)
                    });
                } else {
                    drift(part, over_mass, around, |x, v, f, over_mass| {
                        let v = v + over_mass * f;
                        (x + dt * v, v)
                    });
                }
            })
        });
        self.record_ways(dt, |this, k| this.v[k]);
        self.refuse(faults, Some(dt), deferred)
    }

    /// `x += dt v`.
    pub(in crate::run) fn drift(&mut self, dt: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let limit = self.longest_move / (dt * dt);
        self.moves += 1;
        let faults = self.with_motion(|mut motion, (domain, bounds), pool| {
            let around = Surroundings { domain, bounds, limit };
            motion.keep_nothing();
            motion.over_mass(|_| 0.0);
            share(motion, pool, |part, over_mass| {
                drift(part, over_mass, around, |x, v, _, _| (x + dt * v, v));
            })
        });
        self.record_ways(dt, |this, k| this.v[k]);
        self.refuse(faults, Some(dt), false)
    }

    /// `v += h f/m`.
    pub(in crate::run) fn kick(&mut self, h: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let faults = self.with_motion(|mut motion, _, pool| {
            motion.keep_nothing();
            motion.over_mass(|mass| h / mass);
            share(motion, pool, |part, over_mass| {
                kick::<false, _>(part, over_mass, |v, f, _, over_mass| v + over_mass * f);
            })
        });
        self.refuse(faults, None, false)
    }

    /// The same, left to the next step, or to whoever asks for velocities before.
    pub(in crate::run) fn defer_kick(&mut self, h: f64) {
        debug_assert!(self.deferred.is_none());
        self.deferred = Some(h);
    }

    pub(super) fn make_deferred_kick(&mut self) -> Result<(), RunError> {
        match self.deferred.take() {
            Some(h) => self.kick(h),
            None => Ok(()),
        }
    }

    /// `x += dt (v + ½dt f/m); v += λ dt f/m`; velocities and forces of before are kept.
    pub(in crate::run) fn predict(&mut self, lambda: f64, dt: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let limit = self.longest_move / (dt * dt);
        self.moves += 1;
        let faults = self.with_motion(|mut motion, (domain, bounds), pool| {
            let around = Surroundings { domain, bounds, limit };
            motion.keep();
            motion.over_mass(|mass| dt / mass);
            share(motion, pool, |part, over_mass| {
                part.kept[0].copy_from_slice(part.v);
                part.kept[1].copy_from_slice(part.f);
                drift(part, over_mass, around, |x, v, f, over_mass| {
                    (x + dt * (v + 0.5 * over_mass * f), v + lambda * over_mass * f)
                });
            })
        });
        self.record_ways(dt, |this, k| {
            let back = (0.5 - lambda) * dt / this.mass[this.species[k] as usize];
            std::array::from_fn(|c| this.v[k][c] + back * this.force[k][c])
        });
        self.refuse(faults, Some(dt), false)
    }

    /// `v = v₀ + ½dt (f₀ + f)/m` with what [`Simulation::predict`] has kept.
    pub(in crate::run) fn correct(&mut self, dt: f64) -> Result<(), RunError> {
        let faults = self.with_motion(|mut motion, _, pool| {
            motion.over_mass(|mass| 0.5 * dt / mass);
            share(motion, pool, |part, half| {
                kick::<true, _>(part, half, |_, f, [before_v, before_f], half| {
                    before_v + half * (before_f + f)
                });
            })
        });
        self.refuse(faults, None, false)
    }

    /// All forces at the present positions, drag at the present velocities and noise for a step of `dt` among them.
    pub(in crate::run) fn forces_with_thermostat(&mut self, dt: f64, want: Want) -> Result<(), RunError> {
        let step = Step { seed: self.seed, number: self.number, dt };
        self.compute(self.wants(want), self.thermostat.then_some(step))?;
        self.add_external_forces();
        self.drag_in_forces = Some(true);
        self.record_forces();
        if self.is_recording() && self.find_pairs(dt, true)? {
            let v = std::mem::take(&mut self.v);
            self.record_drag(1.0, &v);
            self.v = v;
        }
        Ok(())
    }

    /// All forces at the present positions but those of the thermostat.
    pub(in crate::run) fn conservative_forces(&mut self, want: Want) -> Result<(), RunError> {
        self.compute(self.wants(want), None)?;
        self.add_external_forces();
        self.drag_in_forces = Some(false);
        self.record_forces();
        Ok(())
    }

    /// With the virial, where it is recorded.
    fn wants(&self, want: Want) -> Want {
        Want { virial: want.virial || self.is_recording(), ..want }
    }

    /// Changes velocities by the thermostat, if it acts.
    pub(in crate::run) fn heat(&mut self, heat: Heat, want: Want, dt: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        if !self.find_pairs(heat.time, self.wants(want).virial)? {
            return Ok(());
        }
        self.flux.take();
        let before = self.is_recording().then(|| self.v.clone());
        let Simulation { coupling: Some(coupling), forces, v, owned, seed, number, .. } = self else {
            return Ok(());
        };
        let pool = forces.pool();
        coupling.draw(pool, *seed, *number, heat.stream, heat.noise);
        let virial = coupling.act(pool, heat.update, &mut v[..*owned]);
        // The drag that an implicit step ends with is a force, which `add_drag` counts.
        if heat.update != Update::ImplicitDrag {
            // That of a mean force over the step.
            for (sum, w) in self.impulse_virial.iter_mut().zip(virial) {
                *sum += w * heat.time / dt;
            }
        }
        if let Some(mut v) = before {
            let share = heat.time / dt;
            match heat.update {
                // Drag at the velocities in the middle.
                Update::Midpoint => {
                    v.iter_mut()
                        .zip(&self.v)
                        .for_each(|(v, w)| (0..3).for_each(|c| v[c] = 0.5 * (v[c] + w[c])));
                    self.record_drag(share, &v);
                }
                // The half of it that ends the step.
                Update::ImplicitDrag => {
                    v.clone_from(&self.v);
                    self.record_drag(0.5 * share, &v);
                }
                _ => self.record_last_update(share),
            }
        }
        match self.velocities_fault() {
            Some(k) => Err(RunError::Velocity { step: self.number, tag: self.tag[k] }),
            None => Ok(()),
        }
    }

    /// All forces at the present positions but drag, noise for a step of `dt` among them.
    pub(in crate::run) fn forces_then_noise(
        &mut self,
        dt: f64,
        want: Want,
        noise: Law,
    ) -> Result<(), RunError> {
        self.conservative_forces(want)?;
        if self.find_pairs(dt, self.wants(want).virial)? {
            let Simulation { coupling: Some(coupling), forces, seed, number, .. } = self else {
                return Ok(());
            };
            coupling.draw(forces.pool(), *seed, *number, Stream(0), noise);
            self.add_pair_forces(false);
        }
        self.drag_in_forces = Some(true);
        Ok(())
    }

    /// Adds the drag at the present velocities to the forces; after [`Simulation::forces_then_noise`], whose pairs it takes.
    pub(in crate::run) fn add_drag(&mut self) {
        if self.thermostat {
            self.add_pair_forces(true);
        }
    }

    fn add_pair_forces(&mut self, drag: bool) {
        let Simulation { coupling: Some(coupling), forces, v, force, owned, .. } = self else { return };
        let force = &mut force[..*owned];
        let virial = coupling.add_forces(forces.pool(), &v[..*owned], drag, !drag, force);
        for (force, _) in force.iter_mut().zip(&self.frozen).filter(|(_, frozen)| **frozen) {
            *force = [0.0; 3];
        }
        (0..6).for_each(|c| self.impulse_virial[c] += virial[c]);
        if drag {
            // At the end of a step and at the beginning of the next.
            let v = std::mem::take(&mut self.v);
            self.record_drag(0.5, &v);
            self.v = v;
        }
    }

    /// Calls `work` and takes back what it does to the forces, and to their virial.
    pub(in crate::run) fn with_forces_kept(
        &mut self,
        work: impl FnOnce(&mut Simulation) -> Result<(), RunError>,
    ) -> Result<(), RunError> {
        let virial = self.impulse_virial;
        let mut kept = std::mem::take(&mut self.kept_forces);
        kept.clear();
        kept.extend_from_slice(&self.force[..self.owned]);
        let done = work(self);
        self.force[..self.owned].copy_from_slice(&kept);
        self.kept_forces = kept;
        self.impulse_virial = virial;
        done
    }

    /// Finds the pairs of the thermostat for a time `dt`; whether it acts.
    ///
    /// Where the forces were computed at these positions, their pairs could serve: the search is about half of what the
    /// thermostat costs.
    fn find_pairs(&mut self, dt: f64, virial: bool) -> Result<bool, RunError> {
        if !self.thermostat || self.coupling.is_none() {
            return Ok(false);
        }
        let found = (self.moves, dt, virial);
        if self.found_pairs == Some(found) {
            return Ok(true);
        }
        check_width(&self.domain, self.forces.plan())?;
        let number = self.number;
        let Simulation {
            coupling: Some(coupling), forces, domain, x, tag, species, mass, frozen, owned, ..
        } = self
        else {
            return Ok(false);
        };
        let n = *owned;
        let bodies = Bodies { domain, x: &x[..n], tag: &tag[..n], species: &species[..n], mass, frozen };
        let failed = |source| RunError::Engine { step: number, source };
        coupling.find_pairs(forces.pool(), &bodies, dt, virial).map_err(failed)?;
        self.found_pairs = Some(found);
        Ok(true)
    }

    /// What the thermostat sees of the particles; `None` where it does not act, or sees none.
    ///
    /// # Errors
    /// A position that is not finite.
    pub fn warmth(&mut self, dt: f64) -> Result<Option<Warmth>, RunError> {
        if !self.find_pairs(dt, false)? {
            return Ok(None);
        }
        Ok(self.coupling.as_ref().and_then(|coupling| coupling.warmth(self.velocities())))
    }

    fn velocities_fault(&self) -> Option<usize> {
        // One sum tells whether there is any.
        let sum: f64 = self.v[..self.owned].iter().flatten().map(|v| v * v).sum();
        if sum.is_finite() {
            return None;
        }
        self.v[..self.owned].iter().position(|v| !v.iter().all(|c| (c * c).is_finite()))
    }

    /// Calls `work` with what moves, what it moves in, and the threads.
    fn with_motion(&mut self, work: impl FnOnce(Motion, (&PeriodicBox, &Bounds), &Pool) -> Faults) -> Faults {
        self.flux.take();
        let n = self.owned;
        let motion = Motion {
            x: &mut self.x[..n],
            v: &mut self.v[..n],
            f: &self.force[..n],
            species: &self.species[..n],
            image: &mut self.image[..n],
            mass: &self.mass,
            kept: &mut self.kept,
        };
        work(motion, (&self.domain, &self.bounds), self.forces.pool())
    }

    /// Velocities must be finite, which the step before has left to this one if its kick was deferred, and within `dt` lead
    /// nowhere beyond the box.
    fn refuse(&self, faults: Faults, dt: Option<f64>, deferred: bool) -> Result<(), RunError> {
        let Some(found) = faults.fast.or(faults.escaped) else { return Ok(()) };
        // The one that is worst off is nearest to the cause; what is no number may have been made so by another.
        let speed = |k: usize| {
            let v = self.v[k];
            let speed = v[0].hypot(v[1]).hypot(v[2]);
            if speed.is_nan() { f64::MAX } else { speed }
        };
        let faster = |worst: usize, k: usize| if speed(k) > speed(worst) { k } else { worst };
        let k = if faults.fast.is_some() { (0..self.owned).fold(found, faster) } else { found };
        let (step, tag, v) = (self.number, self.tag[k], self.v[k]);
        let speed = v[0].hypot(v[1]).hypot(v[2]);
        match dt {
            Some(dt) if speed.is_finite() => Err(RunError::Runaway { step, tag, distance: speed * dt }),
            _ => Err(RunError::Velocity { step: step - u64::from(deferred), tag }),
        }
    }
}
