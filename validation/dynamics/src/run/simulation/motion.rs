//! Drift and kick, the operators of which steps are composed.
//!
//! A kick that ends a step may be deferred: if the next step begins with the same kick and a drift, one loop
//! makes both, with the same bits.

use super::super::bounds::{Bounds, Surfaces};
use super::super::integrator::parts::{Faults, Kept, Moved, Moving, Part, Surroundings, drift, kick, share};
use super::super::integrator::reflection::{Beyond, Faces, Path};
use super::{RunError, Simulation};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::Fluid;

#[derive(Debug, Clone)]
pub(super) struct Motion {
    pub bounds: Bounds,
    /// Data that steps keep during the evaluation of the forces.
    pub kept: Kept,
    /// The duration of a deferred kick at the end of the present step.
    pub deferred: Option<f64>,
    /// The forces that the next step holds where it begins, if others have replaced them.
    pub held: Option<Vec<[f64; 3]>>,
    /// What the last drift has left beyond faces.
    beyond: Vec<Beyond>,
    /// Virial of the mean friction and noise of walls in the last step, if it was asked for.
    pub wall_virial: [f64; 6],
}

impl Motion {
    pub fn within(domain: &PeriodicBox, fluid: &Fluid) -> Motion {
        let mut bounds = Bounds::of(domain, fluid.dimensions);
        bounds.rounds = Surfaces::of(&fluid.walls, domain);
        Motion {
            bounds,
            kept: Kept::default(),
            deferred: None,
            held: None,
            beyond: Vec::new(),
            wall_virial: [0.0; 6],
        }
    }
}

impl Simulation {
    /// Kick and drift in one loop: `v += h f/m; x += dt v` for the time `dt` of the path; particles are then put back into the box.
    pub(in crate::run) fn kick_and_drift(&mut self, h: f64, path: Path) -> Result<(), RunError> {
        let dt = path.time;
        let deferred = self.motion.deferred.take_if(|deferred| *deferred == h).is_some();
        self.make_deferred_kick()?;
        let Moved { faults, legs, hits, .. } = self.moving(path, h, 0, |part, over_mass, around| {
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
        });
        self.record_ways(path, &legs, &hits);
        self.refuse(faults, Some(dt), deferred)
    }

    /// Drift: `x += dt v` for the time `dt` of the path.
    pub(in crate::run) fn drift(&mut self, path: Path) -> Result<(), RunError> {
        let dt = path.time;
        self.make_deferred_kick()?;
        let Moved { faults, legs, hits, .. } = self.moving(path, 0.0, 0, |part, over_mass, around| {
            drift(part, over_mass, around, |x, v, _, _| (x + dt * v, v));
        });
        self.record_ways(path, &legs, &hits);
        self.refuse(faults, Some(dt), false)
    }

    /// Kick: `v += h f/m`.
    pub(in crate::run) fn kick(&mut self, h: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let Moved { faults, .. } = self.moving(None, h, 0, |part, over_mass, _| {
            kick::<false, _>(part, over_mass, |v, f, _, over_mass| v + over_mass * f);
        });
        self.refuse(faults, None, false)
    }

    /// Defers a kick to the next step, or to the next use of velocities.
    pub(in crate::run) fn defer_kick(&mut self, h: f64) {
        debug_assert!(self.motion.deferred.is_none());
        self.motion.deferred = Some(h);
    }

    pub(super) fn make_deferred_kick(&mut self) -> Result<(), RunError> {
        match self.motion.deferred.take() {
            Some(h) => self.kick(h),
            None => Ok(()),
        }
    }

    /// Puts particles at `x + c f/m` for an evaluation of forces, mirrored at faces and round surfaces; [`Simulation::step_back`]
    /// follows.
    pub(super) fn displace(&mut self, c: f64) {
        self.moving(None, c, 1, |part, over_mass, around| {
            let bounds = around.faces.bounds;
            for (k, to) in part.kept[0].iter_mut().enumerate() {
                let m = over_mass[part.species[k] as usize];
                *to = std::array::from_fn(|c| part.x[k][c] + m * part.f[k][c]);
                let inside = |c: usize| (bounds.low[c]..=bounds.high[c]).contains(&to[c]);
                if !(inside(0) && inside(1) && inside(2)) {
                    bounds.walls().for_each(|c| to[c] = bounds.fold(c, to[c]));
                    around.domain.wrap(to, &mut [0; 3]);
                }
                bounds.rounds.mirror(to);
            }
        });
        self.step_back();
    }

    /// Exchanges the present positions for those that [`Simulation::displace`] has put aside, or the reverse.
    pub(super) fn step_back(&mut self) {
        let Simulation { particles, motion, .. } = self;
        std::mem::swap(&mut particles.motion(false).0.x, &mut motion.kept.v);
    }

    /// Predictor: `x += dt (v + ½dt f/m); v += λ dt f/m`; the previous velocities and forces are kept.
    pub(in crate::run) fn predict(&mut self, lambda: f64, dt: f64) -> Result<(), RunError> {
        self.make_deferred_kick()?;
        let path = Path::whole(dt, lambda * dt);
        let Moved { faults, legs, hits, .. } = self.moving(path, dt, 2, |part, over_mass, around| {
            part.kept[0].copy_from_slice(part.v);
            part.kept[1].copy_from_slice(part.f);
            drift(part, over_mass, around, |x, v, f, over_mass| {
                (x + dt * (v + 0.5 * over_mass * f), v + lambda * over_mass * f)
            });
        });
        self.record_ways(path, &legs, &hits);
        self.refuse(faults, Some(dt), false)
    }

    /// Corrector: `v = v₀ + ½dt (f₀ + f)/m` with the values that [`Simulation::predict`] has kept.
    pub(in crate::run) fn correct(&mut self, dt: f64) -> Result<(), RunError> {
        let Moved { faults, .. } = self.moving(None, 0.5 * dt, 2, |part, half, _| {
            kick::<true, _>(part, half, |_, f, [before_v, before_f], half| before_v + half * (before_f + f));
        });
        self.refuse(faults, None, false)
    }

    /// Does `work` with the particles of each thread, `factor` over the mass of each species, and the box with its limits;
    /// `path` is that of a drift. There is room for as many arrays of what was before as a step `keeps`, at most two.
    fn moving(
        &mut self,
        path: impl Into<Option<Path>>,
        factor: f64,
        keeps: usize,
        work: impl Fn(&mut Part, &[f64], Surroundings) + Sync,
    ) -> Moved {
        let (path, records) = (path.into(), self.is_recording());
        let Simulation { particles, motion, forces, .. } = self;
        let (state, f) = particles.motion(path.is_some());
        let longest: f64 = state.domain.lengths().iter().map(|l| l * l).sum();
        let limit = path.map_or(f64::INFINITY, |path| longest / (path.time * path.time));
        let drifts = path.is_some();
        let path = path.unwrap_or_default();
        let beyond = if drifts { std::mem::take(&mut motion.beyond) } else { Vec::new() };
        let faces = Faces { bounds: &motion.bounds, mass: &state.mass, path, records, beyond: &beyond };
        let around = Surroundings { domain: &state.domain, faces, limit };
        let moving = Moving {
            x: &mut state.x,
            v: &mut state.v,
            f,
            species: &state.species,
            image: &mut state.image,
            mass: &state.mass,
            kept: &mut motion.kept,
        };
        let mut moved = share(moving, factor, keeps, forces.engine.pool(), |part, over_mass| {
            work(part, over_mass, around)
        });
        if drifts {
            motion.beyond = std::mem::take(&mut moved.beyond);
        }
        moved
    }

    /// Refuses velocities that are not finite, or that lead beyond the box within `dt`. If the kick of the
    /// previous step was `deferred`, velocities that are not finite belong to that step.
    fn refuse(&self, faults: Faults, dt: Option<f64>, deferred: bool) -> Result<(), RunError> {
        let state = self.particles.now();
        let Some(found) = faults.fast.or(faults.escaped) else {
            return match faults.uncounted {
                Some(k) => Err(RunError::Uncounted { step: self.number, tag: state.tag[k] }),
                None => Ok(()),
            };
        };
        let speed = |k: usize| {
            let v = state.v[k];
            v[0].hypot(v[1]).hypot(v[2])
        };
        // The fastest particle is closest to the cause; a NaN may be the consequence of another particle.
        let rank = |k: usize| if speed(k).is_nan() { f64::MAX } else { speed(k) };
        let faster = |worst: usize, k: usize| if rank(k) > rank(worst) { k } else { worst };
        let k = if faults.fast.is_some() { (0..state.len()).fold(found, faster) } else { found };
        let (step, tag, speed) = (self.number, state.tag[k], speed(k));
        match dt {
            Some(dt) if speed.is_finite() => Err(RunError::Runaway { step, tag, distance: speed * dt }),
            _ => Err(RunError::Velocity { step: step - u64::from(deferred), tag }),
        }
    }
}
