//! The engine of one pair style, and the mapping from LAMMPS's types to species.

mod device;
mod model;

use crate::converted::{Converted, times};
use crate::error::StyleError;
use crate::units::Scale;
use psidpd_core::engine::thermostat::{Effort, PairThermostat};
use psidpd_core::engine::{
    Engine, Newton, Particles, Path as EnginePath, Pending, PeriodicBox, Pool, Precision, Reason, Request,
    Settings, Surroundings, Tally, Want, at_once,
};
use psidpd_core::model::Model;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// A model at the style's temperature, ready to compute.
#[derive(Debug)]
pub struct Style {
    pub model: Model,
    engine: Engine,
    /// The first half of an evaluation, until its second half.
    pending: Option<Pending>,
    /// Drag and noise apart from the forces, for the fix; `None` if the model has no thermostat.
    thermostat: Option<PairThermostat>,
    /// Iterations of the thermostat at earlier temperatures and settings.
    effort_before: Effort,
    settings: Settings,
    pool: Arc<Pool>,
    kt: f64,
    /// Species of each type, from 0; entry 0 is unused, as LAMMPS counts types from 1.
    kinds: Vec<i32>,
    /// Meaning of the letters of pair_coeff, for the log.
    letters: Option<&'static str>,
    scale: Scale,
    converted: Converted,
}

/// Runs `work` and turns a panic into an error: a panic must not unwind into LAMMPS.
pub(crate) fn guard<T>(work: impl FnOnce() -> Result<T, StyleError>) -> Result<T, StyleError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic
            .downcast_ref::<String>()
            .cloned()
            .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
            .unwrap_or_else(|| "unknown cause".to_owned());
        Err(StyleError(format!("internal error, please report it: {text}")))
    })
}

impl Style {
    fn new(model: Model, kt: f64, names: &[String], dimensions: usize) -> Result<Style, StyleError> {
        if model.dimensions() != dimensions {
            return Err(StyleError(format!(
                "{}: the model has dimensions = {}, the simulation has {dimensions}",
                model.source().name(),
                model.dimensions()
            )));
        }
        // LAMMPS counts types from 1.
        let mut kinds = vec![-1];
        for name in names {
            let species = model.species().iter().position(|s| s == name);
            match species {
                Some(index) => kinds.push(index as i32),
                None if name == "NULL" => kinds.push(-1),
                None => {
                    return Err(StyleError(format!(
                        "{}: no species \"{name}\"; the model has {}",
                        model.source().name(),
                        model.species().join(", ")
                    )));
                }
            }
        }
        let settings = Settings { precision: Precision::Double, ..Settings::default() };
        let pool = Arc::new(Pool::new(settings.threads));
        let engine = engine_at(&model, kt, &kinds, settings, &pool)?;
        let thermostat = PairThermostat::new(engine.plan(), kt, &settings);
        Ok(Style {
            model,
            engine,
            pending: None,
            thermostat,
            effort_before: Effort::default(),
            settings,
            pool,
            kt,
            kinds,
            letters: None,
            scale: Scale::ONE,
            converted: Converted::default(),
        })
    }

    /// Changes the temperature, on which the model's expressions and the noise depend.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), StyleError> {
        guard(|| {
            self.kt = kt / self.scale.energy;
            self.rebuild()
        })
    }

    fn rebuild(&mut self) -> Result<(), StyleError> {
        self.effort_before = self.effort();
        let mut engine = engine_at(&self.model, self.kt, &self.kinds, self.settings, &self.pool)?;
        if let Some(mut device) = self.engine.use_device(None) {
            device.set_fluid(&self.model.at(self.kt).map_err(|e| StyleError(e.to_string()))?)?;
            engine.use_device(Some(device));
        }
        self.engine = engine;
        self.thermostat = PairThermostat::new(self.engine.plan(), self.kt, &self.settings);
        Ok(())
    }

    /// Sets the precision, mixed or double, and the number of threads, of which there are at most as many as processors.
    pub fn configure(&mut self, mixed: bool, threads: usize) -> Result<(), StyleError> {
        guard(|| {
            let precision = if mixed { Precision::Mixed } else { Precision::Double };
            let threads = at_once(Pool::count(threads)?);
            if (precision, threads) == (self.settings.precision, self.settings.threads) {
                return Ok(());
            }
            if threads != self.settings.threads {
                self.pool = Arc::new(Pool::new(threads));
            }
            self.settings = Settings { precision, threads, ..self.settings };
            self.rebuild()
        })
    }

    /// The number of threads that run.
    pub fn threads(&self) -> usize {
        self.settings.threads.get()
    }

    /// One unit of the model in units of LAMMPS.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// The engine; it computes in units of the model.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The thermostat apart from the forces, with the threads, the species of the types, and room for positions.
    pub(crate) fn thermostat(&mut self) -> (Option<&mut PairThermostat>, &Pool, &[i32], &mut Converted) {
        (self.thermostat.as_mut(), &self.pool, &self.kinds, &mut self.converted)
    }

    /// The thermostat apart from the forces, and the engine, whose forces list its pairs.
    pub(crate) fn thermostat_beside_engine(&mut self) -> Option<(&mut PairThermostat, &mut Engine)> {
        Some((self.thermostat.as_mut()?, &mut self.engine))
    }

    pub(crate) fn effort_before(&self) -> Effort {
        self.effort_before
    }

    /// Describes the computation, and the letters of the coefficients, for the log.
    ///
    /// `search` says where pairs come from, and whether LAMMPS lists them; `apart`, whether a fix has the thermostat.
    pub fn description(&self, search: &str, listed: bool, apart: bool) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "psidpd: {} ({})", self.model.title(), self.model.source().name());
        if let Some(reference) = self.model.reference() {
            let _ = writeln!(text, "  reference     {reference}");
        }
        if !self.scale.is_one() {
            let Scale { length, energy, time } = self.scale;
            let _ = writeln!(
                text,
                "  units         the model's, whose length is {length:.6e} here, energy {energy:.6e}, time {time:.6e}"
            );
        }
        for line in self.engine().plan().to_string().lines() {
            let _ = writeln!(text, "  {line}");
        }
        if !self.engine().plan().is_conservative() {
            text.push_str(
                "  WARNING       this force law has no potential: it does work around closed loops and heats \
                 the fluid; the energy printed is not that of the forces\n",
            );
        }
        let drag = match apart {
            true => "drag and noise are those of fix dpd/splitting",
            false => "drag sees the half-step velocity",
        };
        let _ = writeln!(
            text,
            "  conventions   number densities, [w] = 1, no self term unless the model says so; \
             F = -dU/dr with U = sum psi + sum phi; {drag}"
        );
        if let Some(letters) = self.letters {
            let _ = writeln!(text, "  coefficients  {letters}");
        }
        let _ = writeln!(text, "  search        {search}");
        if listed {
            let path = EnginePath::PairSums(Reason::ListedPairs);
            let _ = writeln!(text, "  evaluation    {path}");
            text.push_str("  arithmetic    double precision, 1 thread a rank\n");
        } else {
            let exception = EnginePath::PairSums(Reason::ParticleValues);
            let (path, arithmetic) = match self.engine.device_name() {
                Some(name) => (name, "single precision".to_owned()),
                None => {
                    let Settings { precision, instructions, threads } = self.engine.settings();
                    let text = format!("{precision} precision, {instructions}, {threads} thread(s) a rank");
                    (EnginePath::Sweep.to_string(), text)
                }
            };
            let _ = writeln!(text, "  evaluation    {path}; on some steps {exception}");
            let _ = writeln!(text, "  arithmetic    {arithmetic}");
        }
        text
    }

    /// Adds to `f` all forces on particles in a box that this rank has all of; the box is in units of the model.
    pub fn evaluate(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        f: &mut [f64],
    ) -> Result<Tally, StyleError> {
        guard(|| {
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, request);
            Ok(scale.tally(taken.add_forces(scale, f, |request, f| engine.forces(domain, request, f, true))?))
        })
    }

    /// First half of an evaluation: adds to `f` all forces but those of the slopes of ghosts. With pairs that LAMMPS lists
    /// all forces are added in the second half. Boxes are in units of the model.
    pub fn densities(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        f: &mut [f64],
    ) -> Result<(), StyleError> {
        guard(|| {
            let Style { engine, pending, scale, converted, .. } = self;
            *pending = None;
            let taken = converted.take(scale, request);
            *pending = Some(taken.add_forces(scale, f, |request, f| engine.first(surroundings, request, f))?);
            Ok(())
        })
    }

    /// `∂ψ/∂n` of owned particles, followed by room for those of ghosts.
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        match &mut self.pending {
            Some(pending) => pending.slopes_mut(),
            None => self.engine.slopes_mut(),
        }
    }

    /// Sums every density of the model at the positions of the last evaluation, also those that it did not need.
    pub fn sum_densities(&mut self, particles: &Particles) -> Result<(), StyleError> {
        guard(|| {
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, &at_rest(particles));
            // LAMMPS has ghosts on all sides of its atoms, also across periods.
            engine.sum_densities(Surroundings::ghosts(Newton::On), &taken.particles())?;
            Ok(())
        })
    }

    /// Local densities of owned particles, per unit volume of LAMMPS.
    pub fn local_densities(&mut self) -> &[f64] {
        if self.scale.is_one() {
            return self.engine.results().densities;
        }
        let volume = self.scale.length.powi(self.model.dimensions() as i32);
        times(self.engine.results().densities, 1.0 / volume, &mut self.converted.densities)
    }

    /// ψ of owned particles, in LAMMPS's units of energy.
    pub fn excess(&mut self) -> &[f64] {
        if self.scale.is_one() {
            return self.engine.excess();
        }
        times(self.engine.excess(), self.scale.energy, &mut self.converted.excess)
    }

    /// Energy of a pair of the given types at a distance, and the force along it. A many-body force
    /// uses the slopes that the two particles had in the last evaluation.
    pub fn single(&mut self, kinds: [i32; 2], r: f64, particles: [i32; 2]) -> Result<(f64, f64), StyleError> {
        guard(|| {
            let r = r / self.scale.length;
            let Scale { energy, .. } = self.scale;
            let force = self.scale.force();
            let here = |(e, f): (f64, f64)| (energy * e, force * f);
            let width = self.engine().plan().slope_width();
            if width == 0 {
                return Ok(here(self.engine.single(kinds, r, [0, 0])));
            }
            let known = self.engine.slopes_mut().len() / width;
            let known = |i: i32| usize::try_from(i).ok().filter(|i| *i < known);
            match particles.map(known) {
                [Some(i), Some(j)] => Ok(here(self.engine.single(kinds, r, [i, j]))),
                _ => Err(StyleError(format!(
                    "asked for the pair of particles {} and {}, which the last evaluation did not both contain",
                    particles[0], particles[1]
                ))),
            }
        })
    }

    /// Second half of an evaluation: adds the rest of the forces to `f`.
    pub fn forces(&mut self, request: &Request, f: &mut [f64]) -> Result<Tally, StyleError> {
        guard(|| {
            let Style { engine, pending, scale, converted, .. } = self;
            let pending = pending.take().ok_or_else(|| {
                StyleError("the second half of an evaluation needs the first half before it".to_owned())
            })?;
            let taken = converted.take(scale, request);
            Ok(scale.tally(taken.add_forces(scale, f, |request, f| pending.finish(engine, request, f))?))
        })
    }
}

/// A request for forces of these particles without drag and noise.
pub(crate) fn at_rest<'a>(particles: &Particles<'a>) -> Request<'a> {
    Request { particles: *particles, v: &[], step: None, want: Want::FORCES }
}

fn engine_at(
    model: &Model,
    kt: f64,
    kinds: &[i32],
    settings: Settings,
    pool: &Arc<Pool>,
) -> Result<Engine, StyleError> {
    let error = |e: &dyn std::error::Error| StyleError(e.to_string());
    let fluid = model.at(kt).map_err(|e| error(&e))?;
    let mut engine = Engine::with_pool(&fluid, settings, pool.clone()).map_err(|e| error(&e))?;
    engine.map_kinds(kinds)?;
    Ok(engine)
}

#[cfg(test)]
mod tests;
