//! Drag and noise apart from the forces, as an operator on velocities.

use crate::arguments::{Output, array, array_mut, check_apart, copied, exclusive, flag, free, shared};
use crate::engine::{Engine, Step, checked_step};
use crate::evaluation::Domain;
use crate::status::{Failure, Status, guard};
use psidpd_core::engine;
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{self, PairThermostat, Stream, Update};
use std::sync::Arc;

/// The thermostat of an engine's model and temperature. One thread at a time may use it.
pub struct Thermostat {
    thermostat: PairThermostat,
    pool: Arc<engine::Pool>,
    species: usize,
}

/// The particles that a thermostat acts on.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Bodies {
    /// Number of particles.
    pub count: usize,
    /// Positions, `3 * count` numbers. Positions outside the box along periodic edges stand for an image.
    pub x: *const f64,
    /// Particle numbers from 1, each different, `count` of them.
    pub tag: *const i32,
    /// Species indices from 0, `count` of them.
    pub species: *const i32,
    /// Mass of each species of the model, positive.
    pub mass: *const f64,
    /// For each particle 1 if its velocity is fixed, and 0 if not; NULL if none is fixed.
    pub frozen: *const i32,
}

/// For psidpd_thermostat_act: the implicit midpoint rule over all pairs.
pub const PSIDPD_RULE_MIDPOINT: i32 = 0;
/// For psidpd_thermostat_act: the exact Ornstein-Uhlenbeck process of each pair in turn.
pub const PSIDPD_RULE_PAIRWISE: i32 = 1;

/// Makes the thermostat of an engine, with its temperature, settings and threads, and puts it in `*thermostat`, to be freed
/// with psidpd_thermostat_free. If it fails, `*thermostat` is left alone. The thermostat does not need the engine any more.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if no pair of species of the model has drag. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `thermostat` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_thermostat_new(
    engine: *const Engine,
    thermostat: *mut *mut Thermostat,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `thermostat` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(thermostat, "thermostat")?) };
        let (plan, settings) = (engine.engine.plan(), engine.engine.settings());
        let thermostat = PairThermostat::new(plan, &settings)
            .ok_or_else(|| Failure::new(Status::Model, "the model has no thermostat with drag"))?;
        let (pool, species) = (Arc::clone(engine.engine.pool()), plan.species().len());
        out.put(Box::into_raw(Box::new(Thermostat { thermostat, pool, species })));
        Ok(())
    })
}

/// Applies drag and noise to the velocities `v`, `3 * bodies.count` numbers, for the time `step.dt` at fixed positions.
/// `rule` is PSIDPD_RULE_...; the noise is Gaussian and depends on the seed and the number of the step. Forces are then
/// computed without a step. `virial` is NULL or gets the virial of the impulses over `dt`: xx, yy, zz, xy, xz, yz.
///
/// # Errors
/// PSIDPD_STATUS_ENGINE for a position that is not finite. PSIDPD_STATUS_INVALID_ARGUMENT for an unknown rule, a species
/// that the model does not have, a mass that is not positive, a box without volume or narrower than twice the range of the
/// drag, a `dt` that is not positive, or if `v` overlaps `bodies.x`; `v` is left alone then. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `thermostat` is NULL or a thermostat that has not been freed; `box`, `bodies` and `step` are NULL or at such structures,
/// whose arrays are as long as said above; `v` is NULL or as long as said above; `virial` is NULL or has six numbers.
/// Neither overlaps the others. Nothing is kept of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_thermostat_act(
    thermostat: *mut Thermostat,
    r#box: *const Domain,
    bodies: *const Bodies,
    rule: i32,
    step: *const Step,
    v: *mut f64,
    virial: *mut f64,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises null or valid pointers.
        let (this, domain, bodies, step) = unsafe {
            let step = checked_step(copied(step, "step")?)?;
            let (domain, bodies) = (copied(r#box, "box")?.domain()?, copied(bodies, "bodies")?);
            (exclusive(thermostat, "thermostat")?, domain, bodies, step)
        };
        let update = match rule {
            PSIDPD_RULE_MIDPOINT => Update::Midpoint,
            PSIDPD_RULE_PAIRWISE => Update::OrnsteinUhlenbeck,
            other => return Err(Failure::argument(format!("rule is {other}, which is not a valid value"))),
        };
        let Bodies { count, x, tag, species, mass, frozen } = bodies;
        check_apart(v, x, count, "v and bodies.x")?;
        let flags = if frozen.is_null() { 0 } else { count };
        // SAFETY: the caller promises arrays of these lengths, or null; a vector is three consecutive numbers.
        let (x, tag, species, mass, frozen) = unsafe {
            let x = array(x.cast::<[f64; 3]>(), count, "bodies.x")?;
            let (tag, species) = (array(tag, count, "bodies.tag")?, array(species, count, "bodies.species")?);
            let mass = array(mass, this.species, "bodies.mass")?;
            (x, tag, species, mass, array(frozen, flags, "bodies.frozen")?)
        };
        // SAFETY: the caller promises `3 * count` numbers at `v`; `check_apart` found them apart from the positions.
        let v = unsafe { array_mut(v.cast::<[f64; 3]>(), count, "v")? };
        if let Some(s) = species.iter().find(|s| !(0..this.species as i32).contains(s)) {
            return Err(Failure::argument(format!(
                "bodies.species has {s}: the model has {} species",
                this.species
            )));
        }
        if let Some(m) = mass.iter().find(|m| !(**m > 0.0 && m.is_finite())) {
            return Err(Failure::argument(format!("bodies.mass has {m}, not a positive number")));
        }
        let frozen = frozen.iter().map(|f| flag(*f, "bodies.frozen")).collect::<Result<Vec<bool>, _>>()?;
        let mut x = x.to_vec();
        x.iter_mut().filter(|x| x.iter().all(|c| c.is_finite())).for_each(|x| {
            domain.wrap(x, &mut [0; 3]);
        });
        let bodies = thermostat::Bodies { domain: &domain, x: &x, tag, species, mass, frozen: &frozen };
        this.thermostat.find_pairs(&this.pool, &bodies, step.dt, !virial.is_null())?;
        this.thermostat.draw(step.seed, step.number, Stream::default(), Law::Gaussian);
        let of_impulses = this.thermostat.act(&this.pool, update, v);
        if !virial.is_null() {
            // SAFETY: the caller promises six numbers at `virial`, which is not null here.
            unsafe { array_mut(virial, 6, "virial")? }.copy_from_slice(&of_impulses);
        }
        Ok(())
    })
}

/// Frees a thermostat; NULL is ignored.
///
/// # Safety
/// `thermostat` is NULL or a thermostat that has not been freed, and no other thread is using it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_thermostat_free(thermostat: *mut Thermostat) {
    // SAFETY: the caller promises null or a handle that has not been freed and is not in use.
    unsafe { free(thermostat) }
}
