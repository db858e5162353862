//! Engines, which compute forces.

use crate::arguments::{Output, array, array_mut, check_apart, copied, exclusive, flag, shared};
use crate::model::Model;
use crate::settings::{Path, Settings};
use crate::status::{Failure, Status, c_text, guard};
use psidpd_core::engine;
use std::ffi::{CString, c_char};

/// The forces of one model at one temperature. One thread at a time may use an engine; different
/// threads may use different ones.
pub struct Engine {
    pub(super) engine: engine::Engine,
    /// Forces of psidpd_engine_first, which psidpd_engine_second adds to the host's.
    pub(super) first_forces: Vec<[f64; 3]>,
    plan_text: CString,
    path_text: CString,
    /// The setting of psidpd_engine_sum_all_densities.
    all_densities: bool,
    pub(super) state: State,
}

/// The results that an engine holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    /// No results, or none since a call failed.
    Nothing,
    /// Results of psidpd_engine_densities: psidpd_engine_forces may follow.
    Densities,
    /// Results of psidpd_engine_first: psidpd_engine_second may follow.
    First,
    /// Results of a whole evaluation.
    Whole,
}

/// Particles of one host or rank: owned particles first, then ghosts.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Particles {
    /// Number of owned particles.
    pub owned: usize,
    /// Number of all particles, ghosts included.
    pub all: usize,
    /// Positions, `3 * all` numbers: x, y, z of the first, of the second, ... Ghosts are at the position of their image.
    pub x: *const f64,
    /// Particle numbers from 1 that never change, `all` of them; an image has its owner's.
    pub tag: *const i32,
    /// Types, `all` of them: species indices from 0, unless psidpd_engine_map_kinds says otherwise.
    pub kind: *const i32,
}

/// Seed, number and length of the time step, on which the thermostat depends.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Seed of the pair noise.
    pub seed: u64,
    /// Number of the step.
    pub number: u64,
    /// Time step, positive.
    pub dt: f64,
}

/// Sums over the particles and pairs of one host or rank; the sums of all ranks add up.
///
/// Virials are sums of r_ij (x) F_ij: xx, yy, zz, xy, xz, yz. Entries that were not asked for are unspecified.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Tally {
    /// Sum of psi over particles. The potential energy is `excess + pair`.
    pub excess: f64,
    /// Sum of phi over pairs.
    pub pair: f64,
    /// Virial of the conservative forces.
    pub virial: [f64; 6],
    /// Virial of the dissipative and random forces.
    pub thermostat_virial: [f64; 6],
}

/// For `want`: compute the potential energy.
pub const PSIDPD_WANT_ENERGY: u32 = 1;
/// For `want`: compute the virials.
pub const PSIDPD_WANT_VIRIAL: u32 = 2;
/// For `want`: compute the energy of each particle.
pub const PSIDPD_WANT_PARTICLE_ENERGY: u32 = 4;
/// For `want`: compute the virial of each particle.
pub const PSIDPD_WANT_PARTICLE_VIRIAL: u32 = 8;
/// For `want` of a psidpd_request: sum every density of the model, also those that no force needs.
pub const PSIDPD_WANT_DENSITIES: u32 = 16;

/// The bits of `want` that a whole evaluation accepts.
pub(super) const WANT_ALL: u32 = WANT_FORCES | PSIDPD_WANT_DENSITIES;
/// The bits of `want` that psidpd_engine_forces accepts.
const WANT_FORCES: u32 =
    PSIDPD_WANT_ENERGY | PSIDPD_WANT_VIRIAL | PSIDPD_WANT_PARTICLE_ENERGY | PSIDPD_WANT_PARTICLE_VIRIAL;

/// Translates the bits of `want`; fails for bits outside `known`.
pub(super) fn want_of(bits: u32, known: u32) -> Result<engine::Want, Failure> {
    if bits & !known != 0 {
        return Err(Failure::new(Status::InvalidArgument, format!("want has unknown bits: {bits:#x}")));
    }
    let has = |bit| bits & bit != 0;
    Ok(engine::Want {
        energy: has(PSIDPD_WANT_ENERGY),
        virial: has(PSIDPD_WANT_VIRIAL),
        particle_energy: has(PSIDPD_WANT_PARTICLE_ENERGY),
        particle_virial: has(PSIDPD_WANT_PARTICLE_VIRIAL),
        densities: has(PSIDPD_WANT_DENSITIES),
    })
}

/// # Safety
/// The pointers in `particles` are null or at arrays as long as it says, which nobody writes to during
/// `'a`.
pub(super) unsafe fn particles_of<'a>(particles: &Particles) -> Result<engine::Particles<'a>, Failure> {
    let Particles { owned, all, .. } = *particles;
    if owned > all {
        let text = format!("particles: {owned} are owned, but there are only {all}");
        return Err(Failure::new(Status::InvalidArgument, text));
    }
    // SAFETY: the caller promises null or arrays of these lengths that nobody writes to; a
    // vector is three consecutive numbers.
    unsafe {
        Ok(engine::Particles {
            owned,
            x: array(particles.x.cast::<[f64; 3]>(), all, "particles.x")?,
            tag: array(particles.tag, all, "particles.tag")?,
            kind: array(particles.kind, all, "particles.kind")?,
        })
    }
}

pub(super) fn step_of(step: Step) -> Result<engine::Step, Failure> {
    if !(step.dt > 0.0 && step.dt.is_finite()) {
        let text = format!("step.dt is {}, not a positive number", step.dt);
        return Err(Failure::new(Status::InvalidArgument, text));
    }
    Ok(engine::Step { seed: step.seed, number: step.number, dt: step.dt })
}

/// Makes an engine for `model` at temperature `kt`, in the energy unit of the model, and puts it in
/// `*engine`, to be freed with psidpd_engine_free. If it fails, `*engine` is left alone. The engine
/// does not need the model any more.
///
/// The engine computes in double precision on one thread, with the best instruction set of the
/// processor; see psidpd_engine_new_with.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if `kt` is not a positive number, or the model is not finite at it.
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `engine` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_new(model: *const Model, kt: f64, engine: *mut *mut Engine) -> Status {
    // SAFETY: the caller promises that `model` is null or not freed and that `engine` can be written to.
    guard(|| unsafe { Engine::make(model, kt, Settings::DEFAULT, engine) })
}

/// As psidpd_engine_new, with the host's settings.
///
/// # Errors
/// As psidpd_engine_new; PSIDPD_STATUS_INVALID_ARGUMENT for invalid settings.
///
/// # Safety
/// As psidpd_engine_new; `settings` is NULL or at settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_new_with(
    model: *const Model,
    kt: f64,
    settings: *const Settings,
    engine: *mut *mut Engine,
) -> Status {
    // SAFETY: the caller promises that each pointer is null or valid: a model, settings, and a place for the engine.
    guard(|| unsafe { Engine::make(model, kt, copied(settings, "settings")?, engine) })
}

impl Engine {
    /// # Safety
    /// `model` is null or a model that has not been freed; `engine` is null or can be written to.
    unsafe fn make(
        model: *const Model,
        kt: f64,
        settings: Settings,
        engine: *mut *mut Engine,
    ) -> Result<(), Failure> {
        // SAFETY: the caller promises that `model` is null or not freed and that `engine` is null or can be written to.
        let (model, out) = unsafe { (shared(model, "model")?, Output::new(engine, "engine")?) };
        let engine = engine::Engine::new(&model.model.at(kt)?, settings.checked()?)?;
        let plan_text = c_text(&engine.plan().to_string());
        out.put(Box::into_raw(Box::new(Engine {
            engine,
            first_forces: Vec::new(),
            plan_text,
            path_text: CString::default(),
            all_densities: false,
            state: State::Nothing,
        })));
        Ok(())
    }

    /// Fails unless the engine is in one of these states.
    pub(super) fn require(&self, any_of: &[State], call: &str) -> Result<(), Failure> {
        if any_of.contains(&self.state) {
            return Ok(());
        }
        Err(Failure::new(Status::CallOrder, format!("{call} has not been called, or has failed")))
    }
}

/// Puts in `*settings` how the engine computes, with the instruction set in use.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `settings` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_settings(engine: *const Engine, settings: *mut Settings) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `settings` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(settings, "settings")?) };
        out.put(Settings::of(engine.engine.settings()));
        Ok(())
    })
}

/// Puts in `*path` the path that the last evaluation took, a psidpd_path, and in `*text` its description with
/// the reason; valid until the next psidpd_engine_path of this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER before the first evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `path` and `text` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_path(
    engine: *mut Engine,
    path: *mut Path,
    text: *mut *const c_char,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `path` and `text` can be written to.
        let (engine, out, out_text) =
            unsafe { (exclusive(engine, "engine")?, Output::new(path, "path")?, Output::new(text, "text")?) };
        let path = engine.engine.path();
        let path = path.ok_or_else(|| Failure::new(Status::CallOrder, "nothing has been evaluated yet"))?;
        engine.path_text = c_text(&path.to_string());
        out_text.put(engine.path_text.as_ptr());
        out.put(match path {
            engine::Path::Sweep => Path::Sweep,
            engine::Path::PairSums(_) => Path::Reference,
        });
        Ok(())
    })
}

/// Frees an engine and all arrays and texts that it has given out; NULL is ignored.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed, and no other thread is using it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_free(engine: *mut Engine) {
    let _ = guard(|| {
        if !engine.is_null() {
            // SAFETY: the pointer came from `Box::into_raw` and has not been freed.
            drop(unsafe { Box::from_raw(engine) });
        }
        Ok(())
    });
}

/// Puts in `*cutoff` the longest range of any force: ghosts are needed this far from owned particles.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `cutoff` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_cutoff(engine: *const Engine, cutoff: *mut f64) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `cutoff` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(cutoff, "cutoff")?) };
        out.put(engine.engine.plan().cutoff());
        Ok(())
    })
}

/// Puts in `*width` how many numbers per particle psidpd_engine_slopes has, to be forwarded to ghosts;
/// zero if there is nothing to forward.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `width` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_slope_width(engine: *const Engine, width: *mut usize) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `width` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(width, "width")?) };
        out.put(engine.engine.plan().slope_width());
        Ok(())
    })
}

/// Puts in `*needs` 1 if there is a thermostat, so that psidpd_engine_forces with a step needs
/// velocities, of ghosts too; 0 if not.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `needs` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_needs_velocities(engine: *const Engine, needs: *mut i32) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `needs` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(needs, "needs")?) };
        out.put(engine.engine.plan().needs_velocities().into());
        Ok(())
    })
}

/// Puts in `*range` the range of the random force, zero if there is none. Periodic boxes must be at
/// least twice as long, or two images of a pair would share their noise.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `range` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_noise_range(engine: *const Engine, range: *mut f64) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `range` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(range, "range")?) };
        out.put(engine.engine.plan().noise_range().unwrap_or(0.0));
        Ok(())
    })
}

/// Puts in `*text` a description of the computation, in lines; valid until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `text` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_plan_text(engine: *const Engine, text: *mut *const c_char) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `text` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(text, "text")?) };
        out.put(engine.plan_text.as_ptr());
        Ok(())
    })
}

/// Maps the host's types to species, from the next evaluation on: `species[kind]` is the
/// species index of type `kind`, negative for particles that take no part. `species` is copied.
///
/// # Errors
/// PSIDPD_STATUS_INVALID_ARGUMENT if the model has no such species. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `species` has `length` entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_map_kinds(
    engine: *mut Engine,
    species: *const i32,
    length: usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `species` has `length` entries.
        let (engine, species) = unsafe { (exclusive(engine, "engine")?, array(species, length, "species")?) };
        Ok(engine.engine.map_kinds(species)?)
    })
}

/// Sets whether psidpd_engine_densities sums every density of the model (1) or only those
/// that forces need (0, the default).
///
/// # Errors
/// PSIDPD_STATUS_INVALID_ARGUMENT if `all` is neither. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_sum_all_densities(engine: *mut Engine, all: i32) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed.
        let engine = unsafe { exclusive(engine, "engine")? };
        engine.all_densities = flag(all, "all")?;
        Ok(())
    })
}

/// First half of an evaluation: finds pairs, sums local densities, evaluates psi and its slopes for
/// owned particles.
///
/// The call does not say what psidpd_engine_forces will be asked for, so it uses the reference path, on
/// one thread. psidpd_engine_evaluate and psidpd_engine_first, which are told at once, can be faster.
///
/// With `newton` 1, each pair is computed once over all ranks and images, and the host adds forces on
/// ghosts back to their owners; with 0, pairs with ghosts are computed on both sides and ghosts get no
/// forces.
///
/// # Errors
/// PSIDPD_STATUS_ENGINE for a position or psi that is not finite, a tag below 1, a type that is not
/// mapped. PSIDPD_STATUS_INVALID_ARGUMENT for numbers of particles that cannot be or another `newton`.
/// PSIDPD_STATUS_NULL_POINTER; arrays may be NULL if there are no particles. After an error there are
/// no densities and slopes.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `particles` is NULL or at a structure whose
/// arrays are as long as it says. Nothing is kept of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_densities(
    engine: *mut Engine,
    particles: *const Particles,
    newton: i32,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `particles` is null or a structure.
        let (engine, particles) =
            unsafe { (exclusive(engine, "engine")?, particles_of(&copied(particles, "particles")?)?) };
        let newton = if flag(newton, "newton")? { engine::Newton::On } else { engine::Newton::Off };
        engine.state = State::Nothing;
        let want = engine::Want { densities: engine.all_densities, ..engine::Want::FORCES };
        let request = engine::Request { particles, v: &[], step: None, want };
        engine.engine.use_pair_sums_only(true);
        let found = engine.engine.first(engine::Surroundings::ghosts(newton), &request, &mut []);
        engine.engine.use_pair_sums_only(false);
        found?;
        engine.state = State::Densities;
        Ok(())
    })
}

/// Puts in `*slopes` the place of the derivatives of psi, and in `*length` how many there are: of each
/// owned particle psidpd_engine_slope_width numbers, then as many of each ghost. Those of ghosts mean nothing; the host
/// must fill them in with their owners' before psidpd_engine_forces or psidpd_engine_second.
///
/// Valid until the next evaluation with this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without psidpd_engine_densities or psidpd_engine_first. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `slopes` and `length` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_slopes(
    engine: *mut Engine,
    slopes: *mut *mut f64,
    length: *mut usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `slopes` and `length` can be written to.
        let (engine, out, out_length) = unsafe {
            (exclusive(engine, "engine")?, Output::new(slopes, "slopes")?, Output::new(length, "length")?)
        };
        engine
            .require(&[State::Densities, State::First], "psidpd_engine_densities or psidpd_engine_first")?;
        let slopes = engine.engine.slopes_mut();
        out_length.put(slopes.len());
        out.put(slopes.as_mut_ptr());
        Ok(())
    })
}

/// Second half of an evaluation: adds to `force`, `3 * all` numbers, the forces on `particles`, the
/// same as in psidpd_engine_densities, and puts in `*tally` the sums that `want` asks for, which is 0
/// or PSIDPD_WANT_... joined by `|`.
///
/// `v` has the velocities, `3 * all`, and `step` what the thermostat needs. With `step` NULL only
/// conservative forces are computed, and `v` may be NULL; so it may if there is no thermostat (see
/// psidpd_engine_needs_velocities). `tally` may be NULL.
///
/// # Errors
/// PSIDPD_STATUS_ENGINE for a force that is not finite; `force` has been added to nevertheless.
/// PSIDPD_STATUS_CALL_ORDER without psidpd_engine_densities. PSIDPD_STATUS_INVALID_ARGUMENT for other
/// numbers of particles than there, unknown bits in `want`, a `dt` that is not positive, or if `force`
/// overlaps `x` or `v`. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `particles` is NULL or at a structure whose
/// arrays are as long as it says; `v` is NULL or has `3 * all` numbers, and so has `force`, which must
/// overlap none of the others, nor what the engine has given out; `step` is NULL or a step; `tally` is
/// NULL or can be written to. Nothing is kept of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_forces(
    engine: *mut Engine,
    particles: *const Particles,
    v: *const f64,
    step: *const Step,
    want: u32,
    force: *mut f64,
    tally: *mut Tally,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `particles` is null or a structure.
        let (engine, lists) = unsafe { (exclusive(engine, "engine")?, copied(particles, "particles")?) };
        engine.require(&[State::Densities], "psidpd_engine_densities")?;
        let want = want_of(want, WANT_FORCES)?;
        let want = engine::Want { densities: engine.all_densities, ..want };
        let step = if step.is_null() {
            None
        } else {
            // SAFETY: the caller promises that `step`, which is not null here, is a step.
            Some(step_of(unsafe { copied(step, "step")? })?)
        };
        let out = if tally.is_null() {
            None
        } else {
            // SAFETY: the caller promises that `tally`, which is not null here, can be written to.
            Some(unsafe { Output::new(tally, "tally")? })
        };
        // SAFETY: the caller promises arrays as long as `particles` says, and that `force` overlaps none of the others.
        let (particles, v, force) = unsafe { arrays_of(engine, &lists, v, step, force)? };
        let request = engine::Request { particles, v, step, want };
        // If the evaluation panics the engine has no results; after an error the state is set below.
        engine.state = State::Nothing;
        let sums = engine.engine.second(&request, force);
        engine.state = State::Densities;
        let sums = sums?;
        if let Some(out) = out {
            out.put(Tally::of(&sums));
        }
        Ok(())
    })
}

impl Tally {
    pub(super) fn of(sums: &engine::Tally) -> Tally {
        Tally {
            excess: sums.excess,
            pair: sums.pair,
            virial: sums.virial,
            thermostat_virial: sums.thermostat_virial,
        }
    }
}

/// Particles, velocities and forces of an evaluation.
type Arrays<'a> = (engine::Particles<'a>, &'a [[f64; 3]], &'a mut [[f64; 3]]);

/// Checks, as far as possible, the arrays that forces are computed from and the array of forces.
///
/// # Safety
/// The pointers in `lists` are null or at arrays as long as it says; `v` is null or at `3 * lists.all` numbers, and so is
/// `force`, which overlaps none but perhaps `lists.x` and `v`.
pub(super) unsafe fn arrays_of<'a>(
    engine: &Engine,
    lists: &Particles,
    v: *const f64,
    step: Option<engine::Step>,
    force: *mut f64,
) -> Result<Arrays<'a>, Failure> {
    check_apart(force, lists.x, lists.all, "force and particles.x")?;
    // SAFETY: the caller promises that the pointers in `lists` are null or arrays of these lengths.
    let particles = unsafe { particles_of(lists)? };
    let thermal = step.is_some() && engine.engine.plan().needs_velocities();
    let v = if v.is_null() && !thermal {
        &[]
    } else {
        check_apart(force, v, lists.all, "force and v")?;
        // SAFETY: the caller promises `3 * lists.all` numbers at `v`; a vector is three consecutive numbers.
        unsafe { array(v.cast::<[f64; 3]>(), lists.all, "v")? }
    };
    // SAFETY: the caller promises `3 * lists.all` numbers at `force`; `check_apart` found that
    // it overlaps neither `x` nor `v`.
    let force = unsafe { array_mut(force.cast::<[f64; 3]>(), lists.all, "force")? };
    Ok((particles, v, force))
}

/// Puts in `*densities` the place of the local densities of owned particles, and in `*length` how many
/// numbers that is: of each particle those of the first density, one for each species, then those of
/// the second ... Not corrected. After psidpd_engine_densities those that forces do not need are zero unless
/// psidpd_engine_sum_all_densities; otherwise there are none unless PSIDPD_WANT_DENSITIES.
///
/// Valid until the next evaluation with this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without an evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `densities` and `length` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_local_densities(
    engine: *const Engine,
    densities: *mut *const f64,
    length: *mut usize,
) -> Status {
    // SAFETY: the caller promises that `engine` is null or not freed and that `densities` and `length` can be written to.
    unsafe { give(engine, |engine| engine.local_densities(), densities, length) }
}

/// Puts in `*energies` the place of the energies of particles and ghosts, and in `*length` how many
/// there are: none unless the last evaluation was asked for PSIDPD_WANT_PARTICLE_ENERGY.
/// With `newton` 1 those of ghosts belong to their owners.
///
/// Valid until the next evaluation with this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without an evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `energies` and `length` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_particle_energy(
    engine: *const Engine,
    energies: *mut *const f64,
    length: *mut usize,
) -> Status {
    // SAFETY: the caller promises that `engine` is null or not freed and that `energies` and `length` can be written to.
    unsafe { give(engine, |engine| engine.particle_energy(), energies, length) }
}

/// Puts in `*virials` the place of the virials of particles and ghosts, and in `*length` how many
/// numbers that is, six each: none unless the last evaluation was asked for PSIDPD_WANT_PARTICLE_VIRIAL. With `newton` 1 those of ghosts belong to their owners.
///
/// Valid until the next evaluation with this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without an evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `virials` and `length` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_particle_virial(
    engine: *const Engine,
    virials: *mut *const f64,
    length: *mut usize,
) -> Status {
    // SAFETY: the caller promises that `engine` is null or not freed and that `virials` and `length` can be written to.
    unsafe { give(engine, |engine| engine.particle_virial().as_flattened(), virials, length) }
}

/// Gives out one of the engine's arrays.
///
/// # Safety
/// `engine` is null or an engine that has not been freed; `values` and `length` can be written to.
unsafe fn give(
    engine: *const Engine,
    array: fn(&engine::Engine) -> &[f64],
    values: *mut *const f64,
    length: *mut usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `values` and `length` can be written to.
        let (engine, out, out_length) = unsafe {
            (
                shared(engine, "engine")?,
                Output::new(values, "the place for a pointer")?,
                Output::new(length, "length")?,
            )
        };
        engine.require(
            &[State::Densities, State::First, State::Whole],
            "psidpd_engine_densities, psidpd_engine_first or psidpd_engine_evaluate",
        )?;
        let values = array(&engine.engine);
        out_length.put(values.len());
        out.put(values.as_ptr());
        Ok(())
    })
}
