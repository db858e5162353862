//! Engines, which compute forces.

use crate::arguments::{Output, array, exclusive, free, optional, shared};
use crate::model::Model;
use crate::settings::{Path, Settings};
use crate::status::{Failure, Status, c_text, guard};
use psidpd_core::engine;
pub use psidpd_core::engine::{SpecialPair, Step, Tally};
use std::ffi::{CString, c_char};

/// The forces of one model at one temperature. One thread at a time may use an engine; different
/// threads may use different ones.
pub struct Engine {
    pub(super) engine: engine::Engine,
    /// Forces of psidpd_engine_first, which psidpd_engine_second adds to the host's.
    pub(super) first_forces: Vec<[f64; 3]>,
    plan_text: CString,
    path_text: CString,
    pub(super) state: State,
}

/// The results that an engine holds.
#[derive(Debug)]
pub(super) enum State {
    /// No results, or none since a call failed.
    Nothing,
    /// Results of psidpd_engine_first: psidpd_engine_second may follow.
    First(engine::Pending),
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

/// For `want`: compute the potential energy.
pub const PSIDPD_WANT_ENERGY: u32 = 1;
/// For `want`: compute the virials.
pub const PSIDPD_WANT_VIRIAL: u32 = 2;
/// For `want`: compute the energy of each particle.
pub const PSIDPD_WANT_PARTICLE_ENERGY: u32 = 4;
/// For `want`: compute the virial of each particle.
pub const PSIDPD_WANT_PARTICLE_VIRIAL: u32 = 8;
/// For `want`: sum every density of the model, also those that no force needs.
pub const PSIDPD_WANT_DENSITIES: u32 = 16;

/// Translates the bits of `want`; fails for other bits.
pub(super) fn want_of(bits: u32) -> Result<engine::Want, Failure> {
    let mut rest = bits;
    let mut has = |bit: u32| {
        rest &= !bit;
        bits & bit != 0
    };
    let want = engine::Want {
        energy: has(PSIDPD_WANT_ENERGY),
        virial: has(PSIDPD_WANT_VIRIAL),
        particle_energy: has(PSIDPD_WANT_PARTICLE_ENERGY),
        particle_virial: has(PSIDPD_WANT_PARTICLE_VIRIAL),
        densities: has(PSIDPD_WANT_DENSITIES),
    };
    match rest {
        0 => Ok(want),
        _ => Err(Failure::argument(format!("want has unknown bits: {bits:#x}"))),
    }
}

/// # Safety
/// The pointers in `particles` are null or at arrays as long as it says, which nobody writes to during
/// `'a`.
pub(super) unsafe fn particles_of<'a>(particles: &Particles) -> Result<engine::Particles<'a>, Failure> {
    let Particles { owned, all, .. } = *particles;
    if owned > all {
        return Err(Failure::argument(format!("particles: {owned} are owned, but there are only {all}")));
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

pub(super) fn checked_step(step: Step) -> Result<Step, Failure> {
    match step.dt > 0.0 && step.dt.is_finite() {
        true => Ok(step),
        false => Err(Failure::argument(format!("step.dt is {}, not a positive number", step.dt))),
    }
}

/// Makes an engine for `model` at temperature `kt`, in the energy unit of the model, and puts it in
/// `*engine`, to be freed with psidpd_engine_free. If it fails, `*engine` is left alone. The engine
/// does not need the model any more.
///
/// With `settings` NULL the engine computes in double precision on one thread, with the best instruction set of the
/// processor.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if `kt` is not a positive number, or the model is not finite at it.
/// PSIDPD_STATUS_INVALID_ARGUMENT for invalid settings. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `settings` is NULL or at settings; `engine` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_new(
    model: *const Model,
    kt: f64,
    settings: *const Settings,
    engine: *mut *mut Engine,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `model` is null or not freed and that `engine` can be written to.
        let (model, out) = unsafe { (shared(model, "model")?, Output::new(engine, "engine")?) };
        // SAFETY: the caller promises that `settings` is null or at settings.
        let settings = unsafe { optional(settings, "settings")? }.unwrap_or(Settings::DEFAULT);
        let engine = engine::Engine::new(&model.model.at(kt)?, settings.checked()?)?;
        let plan_text = c_text(&engine.plan().to_string());
        let path_text = CString::default();
        out.put(Box::into_raw(Box::new(Engine {
            engine,
            first_forces: Vec::new(),
            plan_text,
            path_text,
            state: State::Nothing,
        })));
        Ok(())
    })
}

/// The failure of a call that needs another one before.
pub(super) fn not_before(call: &str) -> Failure {
    Failure::new(Status::CallOrder, format!("{call} has not been called, or has failed"))
}

/// The facts of an engine that a host needs.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct EngineFacts {
    /// The longest range of any force: ghosts are needed this far from owned particles.
    pub cutoff: f64,
    /// The range of the random force, zero if there is none. Periodic boxes must be at least twice as long, or two images
    /// of a pair would share their noise.
    pub noise_range: f64,
    /// How many numbers per particle psidpd_engine_slopes has, to be forwarded to ghosts; zero if there are none.
    pub slope_width: usize,
    /// 1 if there is a thermostat, so that a request with a step needs velocities, of ghosts too; 0 if not.
    pub needs_velocities: i32,
    /// How the engine computes, with the instruction set in use.
    pub settings: Settings,
    /// A description of the computation, in lines; valid until the engine is freed.
    pub plan: *const c_char,
}

/// Puts in `*facts` the facts of the engine that a host needs.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `facts` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_describe(engine: *const Engine, facts: *mut EngineFacts) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `facts` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(facts, "facts")?) };
        let plan = engine.engine.plan();
        out.put(EngineFacts {
            cutoff: plan.cutoff(),
            noise_range: plan.noise_range().unwrap_or(0.0),
            slope_width: plan.slope_width(),
            needs_velocities: plan.needs_velocities().into(),
            settings: Settings::of(engine.engine.settings()),
            plan: engine.plan_text.as_ptr(),
        });
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
            // This interface has no GPU.
            engine::Path::Sweep | engine::Path::Device => Path::Sweep,
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
    // SAFETY: the caller promises null or a handle that has not been freed and is not in use.
    unsafe { free(engine) }
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

/// Sets the pairs with reduced strength, from the next evaluation on: `length` of them, which are copied; 0 for none.
/// Two particles must meet in one image only within the cut-off. They do not apply to pairs that the host lists.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER. Pairs of particles that are not there fail in the next evaluation.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `pairs` has `length` entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_set_special_pairs(
    engine: *mut Engine,
    pairs: *const SpecialPair,
    length: usize,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `pairs` has `length` entries.
        let (engine, pairs) = unsafe { (exclusive(engine, "engine")?, array(pairs, length, "pairs")?) };
        engine.engine.set_special_pairs(pairs.iter().copied());
        Ok(())
    })
}

/// Puts in `*slopes` the place of the derivatives of psi, and in `*length` how many there are: of each
/// owned particle `slope_width` numbers, then as many of each ghost. Those of ghosts mean nothing; the host
/// must fill them in with their owners' before psidpd_engine_second.
///
/// Valid until the next evaluation with this engine, and until the engine is freed.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without psidpd_engine_first. PSIDPD_STATUS_NULL_POINTER.
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
        let State::First(pending) = &mut engine.state else { return Err(not_before("psidpd_engine_first")) };
        let slopes = pending.slopes_mut();
        out_length.put(slopes.len());
        out.put(slopes.as_mut_ptr());
        Ok(())
    })
}

/// Arrays of the last evaluation, of which an engine keeps those that were asked for; valid until the next evaluation
/// with the engine, and until it is freed.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Results {
    /// Local densities of owned particles: of each particle those of the first density, one for each species, then those
    /// of the second ... Not corrected. None unless the evaluation was asked for PSIDPD_WANT_DENSITIES.
    pub density: *const f64,
    /// How many numbers `density` has.
    pub densities: usize,
    /// Energies of particles and ghosts: none unless the evaluation was asked for PSIDPD_WANT_PARTICLE_ENERGY. With
    /// `newton` 1 those of ghosts belong to their owners.
    pub energy: *const f64,
    /// How many numbers `energy` has.
    pub energies: usize,
    /// Virials of particles and ghosts, six numbers each: none unless the evaluation was asked for
    /// PSIDPD_WANT_PARTICLE_VIRIAL. With `newton` 1 those of ghosts belong to their owners.
    pub virial: *const f64,
    /// How many numbers `virial` has.
    pub virials: usize,
}

/// Puts in `*results` the places of the arrays of the last evaluation.
///
/// # Errors
/// PSIDPD_STATUS_CALL_ORDER without an evaluation. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `engine` is NULL or an engine that has not been freed; `results` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_engine_results(engine: *const Engine, results: *mut Results) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `engine` is null or not freed and that `results` can be written to.
        let (engine, out) = unsafe { (shared(engine, "engine")?, Output::new(results, "results")?) };
        if let State::Nothing = engine.state {
            return Err(not_before("psidpd_engine_first or psidpd_engine_evaluate"));
        }
        let results = engine.engine.results();
        let (density, energy) = (results.densities, results.particle_energy);
        let virial = results.particle_virial.as_flattened();
        out.put(Results {
            density: density.as_ptr(),
            densities: density.len(),
            energy: energy.as_ptr(),
            energies: energy.len(),
            virial: virial.as_ptr(),
            virials: virial.len(),
        });
        Ok(())
    })
}
