//! Evaluations whose request states at once what to compute.

use crate::arguments::{Output, array, array_mut, check_apart, copied, exclusive, flag, optional};
use crate::engine::{Engine, Particles, State, Step, Tally, checked_step, not_before, particles_of, want_of};
use crate::status::{Failure, Status, guard};
use nalgebra::Matrix3;
use psidpd_core::engine::{self, Around, Newton, PairsOfHost, PeriodicBox, Surroundings};

/// A box: a corner, the three edges from there, and which of them are periods.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Domain {
    /// Position of the box's corner.
    pub origin: [f64; 3],
    /// The edges: x, y, z of the first, of the second, of the third. The first should be along x and the second in the
    /// plane of x and y; others are slower. In two dimensions the third is (0, 0, 1).
    pub edges: [f64; 9],
    /// For each edge 1 if the box is periodic along it, and 0 if it is open.
    pub periodic: [i32; 3],
}

/// The input of an evaluation, and the results that it should compute.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Request {
    /// Owned particles and ghosts.
    pub particles: Particles,
    /// Velocities, `3 * particles.all`; may be NULL without a step, or if there is no thermostat (see
    /// psidpd_engine_facts).
    pub v: *const f64,
    /// Seed, number and length of the time step, for the thermostat; NULL for conservative forces only.
    pub step: *const Step,
    /// 0, or PSIDPD_WANT_... joined by `|`.
    pub want: u32,
}

/// Pairs that the host lists: at least all within the cut-off, those of two owned particles once, those of an owned
/// particle and a ghost on either side. Pairs that are not listed do not interact.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Pairs {
    /// Number of pairs.
    pub count: usize,
    /// Array index, from 0, of the first particle of each pair, which is owned.
    pub i: *const i32,
    /// Array index of the second particle of each pair.
    pub j: *const i32,
    /// Factor of each pair's conservative interaction; NULL if all factors are 1.
    pub factor: *const f64,
}

impl Domain {
    pub(super) fn domain(&self) -> Result<PeriodicBox, Failure> {
        let mut periodic = [false; 3];
        for (is, given) in periodic.iter_mut().zip(self.periodic) {
            *is = flag(given, "box.periodic")?;
        }
        let edges = Matrix3::from_column_slice(&self.edges);
        PeriodicBox::new(self.origin, edges, periodic).map_err(|error| Failure::argument(error.to_string()))
    }
}

impl Request {
    /// Checks the request, except for the arrays that forces are added to.
    ///
    /// # Safety
    /// The pointers are null or at arrays as long as they must be, which nobody writes to during `'a`.
    unsafe fn checked<'a>(&self, engine: &Engine) -> Result<engine::Request<'a>, Failure> {
        // SAFETY: the caller promises that `self.step` is null or at a step, and that the pointers in `self.particles` are null
        // or at arrays of these lengths.
        let (step, particles) =
            unsafe { (optional(self.step, "request.step")?, particles_of(&self.particles)?) };
        let step = step.map(checked_step).transpose()?;
        let thermal = step.is_some() && engine.engine.plan().needs_velocities();
        let v = if self.v.is_null() && !thermal {
            &[]
        } else {
            // SAFETY: the caller promises `3 * all` numbers at `v`; a vector is three consecutive numbers.
            unsafe { array(self.v.cast::<[f64; 3]>(), self.particles.all, "request.v")? }
        };
        Ok(engine::Request { particles, v, step, want: want_of(self.want)? })
    }
}

/// All forces on particles in a box of their own, without ghosts: adds them to `force`, `3 * particles.all` numbers, and
/// puts in `*tally` the requested sums. `tally` may be NULL.
///
/// Positions may be outside the box: along periodic edges they stand for an image.
///
/// # Errors
/// PSIDPD_STATUS_ENGINE for a position, psi or force that is not finite, a tag below 1, a type that is not mapped;
/// some forces may have been added then. PSIDPD_STATUS_INVALID_ARGUMENT for a box without volume, numbers of particles
/// that cannot be, ghosts, unknown bits in `want`, a `dt` that is not positive, or if `force` overlaps `x` or `v`.
/// PSIDPD_STATUS_NULL_POINTER; arrays may be NULL if there are no particles.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `box` and `request` are NULL or at such structures, whose arrays
/// are as long as they must be; `force` has `3 * particles.all` numbers and must overlap none of the others, nor what the
/// engine has given out; `tally` is NULL or can be written to. Nothing is kept of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_evaluate(
    engine: *mut Engine,
    r#box: *const Domain,
    request: *const Request,
    force: *mut f64,
    tally: *mut Tally,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that the other pointers are null or valid.
        unsafe {
            let engine = exclusive(engine, "engine")?;
            let domain = copied(r#box, "box")?.domain()?;
            complete(engine, request, force, tally, |engine, request, force| {
                engine.state = State::Nothing;
                Ok(engine.engine.forces(&domain, request, force, true)?)
            })
        }
    })
}

/// First half of an evaluation with ghosts: all that needs no slopes of ghosts. psidpd_engine_second follows, with the same
/// request, when psidpd_engine_slopes have been copied from owners to ghosts.
///
/// `box` may be NULL: then ghosts stand for everything beyond the owned particles. Along a periodic
/// edge of the box the host owns all of it, and the engine applies the period; `image` has 1 for each
/// ghost that is the image of another particle along such an edge, which the engine leaves out, and 0
/// for the others, `particles.all - particles.owned` of them. It may be NULL if there is no such image.
///
/// With `newton` 1 the host adds forces on ghosts back to their owners, and every pair is computed once over all ranks; with
/// 0 ghosts get no forces. Either way the sweep computes pairs with ghosts on both sides and leaves ghosts without forces.
///
/// # Errors
/// As psidpd_engine_evaluate; PSIDPD_STATUS_INVALID_ARGUMENT also for other values of `newton` and `image`. After an error
/// there are no slopes.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `box` and `request` are NULL or at such structures, whose arrays
/// are as long as they must be; `image` is NULL or as long as said above. Nothing is kept of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_first(
    engine: *mut Engine,
    r#box: *const Domain,
    image: *const i32,
    newton: i32,
    request: *const Request,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `request` is null or a request.
        let (engine, given) = unsafe { (exclusive(engine, "engine")?, copied(request, "request")?) };
        // SAFETY: the caller promises that `box` is null or a box.
        let domain =
            unsafe { optional(r#box, "box")? }.map_or(Ok(PeriodicBox::OPEN), |domain| domain.domain())?;
        // SAFETY: the caller promises that the arrays of the request are as long as it says.
        let request = unsafe { given.checked(engine)? };
        let ghosts = if image.is_null() { 0 } else { given.particles.all - given.particles.owned };
        // SAFETY: the caller promises that `image` is null or has an entry for each ghost.
        let told = unsafe { array(image, ghosts, "image")? };
        let images = told.iter().map(|i| flag(*i, "image")).collect::<Result<Vec<bool>, _>>()?;
        let around = Around { domain: &domain, images: &images };
        first(engine, Surroundings::Ghosts(around, newton_of(newton)?), &request)
    })
}

/// As psidpd_engine_first, with pairs that the host lists. `U` has the factor of a pair in its density and in its pair
/// energy; drag and noise act at full strength.
///
/// # Errors
/// As psidpd_engine_first; PSIDPD_STATUS_INVALID_ARGUMENT also for pairs of particles that are not there.
///
/// # Safety
/// As psidpd_engine_first; `pairs` is NULL or at such a structure, whose arrays are as long as it says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_first_of_pairs(
    engine: *mut Engine,
    pairs: *const Pairs,
    newton: i32,
    request: *const Request,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `pairs` and `request` are null or valid.
        let (engine, pairs, given) =
            unsafe { (exclusive(engine, "engine")?, copied(pairs, "pairs")?, copied(request, "request")?) };
        let Pairs { count, i, j, factor } = pairs;
        let factors = if factor.is_null() { 0 } else { count };
        // SAFETY: the caller promises that the arrays of the request and of `pairs` are as long as these say.
        let (request, listed) = unsafe {
            let i = array(i, count, "pairs.i")?;
            let j = array(j, count, "pairs.j")?;
            (given.checked(engine)?, PairsOfHost { i, j, factor: array(factor, factors, "pairs.factor")? })
        };
        first(engine, Surroundings::Listed(listed, newton_of(newton)?), &request)
    })
}

/// Second half of an evaluation: adds to `force`, `3 * particles.all` numbers, the forces on the particles, and puts in
/// `*tally` the requested sums. The request is that of the first half. `tally` may be NULL.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without psidpd_engine_first or psidpd_engine_first_of_pairs right before; otherwise as
/// psidpd_engine_evaluate.
///
/// # Safety
/// As psidpd_engine_evaluate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_second(
    engine: *mut Engine,
    request: *const Request,
    force: *mut f64,
    tally: *mut Tally,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that the other pointers are null or valid.
        unsafe {
            let engine = exclusive(engine, "engine")?;
            if !matches!(engine.state, State::First(_)) {
                return Err(not_before("psidpd_engine_first"));
            }
            complete(engine, request, force, tally, |engine, request, force| {
                let State::First(pending) = std::mem::replace(&mut engine.state, State::Nothing) else {
                    return Err(not_before("psidpd_engine_first"));
                };
                let sums = pending.finish(&mut engine.engine, request, force)?;
                for (force, first) in force.iter_mut().zip(&engine.first_forces) {
                    (0..3).for_each(|c| force[c] += first[c]);
                }
                Ok(sums)
            })
        }
    })
}

/// Adds to `force` the forces that `work` computes, and puts their sums in `*tally`. `work` discards the state of before.
///
/// # Safety
/// `request` is null or at a request, whose arrays are as long as it says; `force` is null or has three numbers for each
/// particle and overlaps none of them; `tally` is null or can be written to.
unsafe fn complete(
    engine: &mut Engine,
    request: *const Request,
    force: *mut f64,
    tally: *mut Tally,
    work: impl FnOnce(&mut Engine, &engine::Request, &mut [[f64; 3]]) -> Result<Tally, Failure>,
) -> Result<(), Failure> {
    // SAFETY: the caller promises that `request` is null or at a request.
    let given = unsafe { copied(request, "request")? };
    // SAFETY: the caller promises that `tally` can be written to if it is not null.
    let out = (!tally.is_null()).then(|| unsafe { Output::new(tally, "tally") }).transpose()?;
    let all = given.particles.all;
    check_apart(force, given.particles.x, all, "force and particles.x")?;
    check_apart(force, given.v, all, "force and v")?;
    // SAFETY: the caller promises arrays as long as `request` says; `check_apart` found that `force`, `3 * all` numbers,
    // overlaps none of those that have as many.
    let (request, force) =
        unsafe { (given.checked(engine)?, array_mut(force.cast::<[f64; 3]>(), all, "force")?) };
    let sums = work(engine, &request, force)?;
    engine.state = State::Whole;
    if let Some(out) = out {
        out.put(sums);
    }
    Ok(())
}

fn first(engine: &mut Engine, surroundings: Surroundings, request: &engine::Request) -> Result<(), Failure> {
    engine.state = State::Nothing;
    engine.first_forces.clear();
    engine.first_forces.resize(request.particles.owned, [0.0; 3]);
    engine.state = State::First(engine.engine.first(surroundings, request, &mut engine.first_forces)?);
    Ok(())
}

fn newton_of(newton: i32) -> Result<Newton, Failure> {
    Ok(if flag(newton, "newton")? { Newton::On } else { Newton::Off })
}
