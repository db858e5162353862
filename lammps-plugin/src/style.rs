//! The engine of one pair style, and the mapping from LAMMPS's types to species.

mod device;
mod model;

use crate::converted::{Converted, times};
use crate::error::StyleError;
use crate::units::Scale;
use psidpd_core::engine::thermostat::{Effort, PairThermostat};
use psidpd_core::engine::{Engine, Path as EnginePath, Pending, Pool, Precision, Reason, Settings, at_once};
use psidpd_core::model::Model;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A model at the style's temperature, ready to compute.
#[derive(Debug)]
pub struct Style {
    pub model: Model,
    /// Computes in units of the model.
    pub engine: Engine,
    /// The first half of an evaluation, until its second half.
    pub(crate) pending: Option<Pending>,
    /// Drag and noise apart from the forces, for the fix; `None` if the model has no thermostat.
    pub(crate) thermostat: Option<PairThermostat>,
    /// Iterations of the thermostat at earlier temperatures and settings.
    pub(crate) effort_before: Effort,
    /// Meaning of the letters of pair_coeff, for the log.
    letters: Option<&'static str>,
    /// One unit of the model in units of LAMMPS.
    pub(crate) scale: Scale,
    pub(crate) converted: Converted,
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
        // Entry 0 is unused, as LAMMPS counts types from 1.
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
        let mut engine = Engine::new(&model.at(kt)?, settings)?;
        engine.map_kinds(&kinds)?;
        let thermostat = PairThermostat::new(engine.plan(), &settings);
        Ok(Style {
            model,
            engine,
            pending: None,
            thermostat,
            effort_before: Effort::default(),
            letters: None,
            scale: Scale::ONE,
            converted: Converted::default(),
        })
    }

    /// Changes the temperature, on which the model's expressions and the noise depend.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), StyleError> {
        guard(|| self.rebuild(kt / self.scale.energy, self.engine.settings()))
    }

    pub(crate) fn rebuild(&mut self, kt: f64, settings: Settings) -> Result<(), StyleError> {
        self.effort_before = self.effort_so_far();
        let fluid = self.model.at(kt)?;
        let device = self.engine.use_device(None);
        self.engine.renew(&fluid, settings)?;
        if let Some(mut device) = device {
            device.set_fluid(&fluid)?;
            self.engine.use_device(Some(device));
        }
        self.thermostat = PairThermostat::new(self.engine.plan(), &settings);
        Ok(())
    }

    /// Sets the precision, mixed or double, and the number of threads, of which there are at most as many as processors.
    pub fn configure(&mut self, mixed: bool, threads: usize) -> Result<(), StyleError> {
        guard(|| {
            let precision = if mixed { Precision::Mixed } else { Precision::Double };
            let threads = at_once(Pool::count(threads)?);
            let settings = self.engine.settings();
            if (precision, threads) == (settings.precision, settings.threads) {
                return Ok(());
            }
            self.rebuild(self.engine.plan().kt(), Settings { precision, threads, ..settings })
        })
    }

    /// Describes the computation, and the letters of the coefficients, for the log.
    ///
    /// `search` says where pairs come from, and whether LAMMPS lists them; `apart`, whether a fix has the thermostat.
    pub fn description(&self, search: &str, listed: bool, apart: bool) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "psidpd: {} ({})", self.model.title, self.model.source().name());
        if let Some(reference) = &self.model.reference {
            let _ = writeln!(text, "  reference     {reference}");
        }
        if !self.scale.is_one() {
            let Scale { length, energy, time } = self.scale;
            let _ = writeln!(
                text,
                "  units         the model's, whose length is {length:.6e} here, energy {energy:.6e}, time {time:.6e}"
            );
        }
        for line in self.engine.plan().to_string().lines() {
            let _ = writeln!(text, "  {line}");
        }
        if !self.engine.plan().is_conservative() {
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

    /// `∂ψ/∂n` of owned particles, followed by room for those of ghosts.
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        match &mut self.pending {
            Some(pending) => pending.slopes_mut(),
            None => self.engine.slopes_mut(),
        }
    }

    /// Local densities of owned particles, per unit volume of LAMMPS.
    pub fn local_densities(&mut self) -> &[f64] {
        let volume = self.scale.length.powi(self.model.dimensions() as i32);
        times(self.engine.results().densities, 1.0 / volume, &mut self.converted.densities)
    }

    /// ψ of owned particles, in LAMMPS's units of energy.
    pub fn excess_of_owned(&mut self) -> Result<&[f64], StyleError> {
        guard(|| Ok(times(self.engine.excess(), self.scale.energy, &mut self.converted.excess)))
    }
}

#[cfg(test)]
mod tests;
