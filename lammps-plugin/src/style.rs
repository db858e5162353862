//! One pair style's engine, and the mapping from LAMMPS's types to species.

use crate::converted::{Converted, times};
use crate::units::Scale;
use psidpd_core::engine::thermostat::PairThermostat;
use psidpd_core::engine::{
    Around, Engine, EngineError, Newton, PairsOfHost, Particles, Path as EnginePath, PeriodicBox, Pool,
    Precision, Reason, Request, Settings, Step, Surroundings, Tally, Want,
};
use psidpd_core::model::{
    ForceLaw, Model, PresetError, SplinePair, WarrenPair, lucy_mdpd, spline_dpd, warren_ab,
};
use std::fmt::Write;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// What goes wrong, as the text that LAMMPS prints.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StyleError(String);

impl StyleError {
    pub(crate) fn new(text: String) -> StyleError {
        StyleError(text)
    }
}

impl From<EngineError> for StyleError {
    fn from(error: EngineError) -> StyleError {
        StyleError(error.to_string())
    }
}

/// A model at the style's temperature, ready to compute.
#[derive(Debug)]
pub struct Style {
    model: Model,
    engine: Engine,
    /// Drag and noise apart from the forces, for the fix that asks for them; `None` if the model has none.
    thermostat: Option<PairThermostat>,
    settings: Settings,
    pool: Arc<Pool>,
    kt: f64,
    /// Species of each type, from 0; LAMMPS counts types from 1.
    kinds: Vec<i32>,
    /// What the letters of pair_coeff mean.
    letters: Option<&'static str>,
    scale: Scale,
    converted: Converted,
}

/// Coefficients of the types that have any, as a model takes them.
struct Members<T> {
    /// The types, from 0: the others are another style's of a hybrid.
    types: Vec<usize>,
    /// Their species.
    species: Vec<String>,
    /// A row-major table over them, of which the upper triangle counts.
    pairs: Vec<Option<T>>,
}

impl<T: Copy> Members<T> {
    fn new(pairs: &[Option<T>], types: usize) -> Result<Members<T>, StyleError> {
        if types.checked_mul(types) != Some(pairs.len()) {
            return Err(StyleError(PresetError::Shape.to_string()));
        }
        let given = |a: usize, b: usize| pairs[a.min(b) * types + a.max(b)].is_some();
        let members: Vec<usize> = (0..types).filter(|a| (0..types).any(|b| given(*a, b))).collect();
        let row = |a: &usize| a * types;
        Ok(Members {
            species: members.iter().copied().map(name_of_type).collect(),
            pairs: members.iter().flat_map(|a| members.iter().map(|b| pairs[row(a) + b])).collect(),
            types: members,
        })
    }

    /// Types where a preset counts species.
    fn error(&self, error: PresetError) -> StyleError {
        let PresetError::Missing(i, j) = error else { return StyleError(error.to_string()) };
        StyleError(PresetError::Missing(self.types[i - 1] + 1, self.types[j - 1] + 1).to_string())
    }
}

fn name_of_type(index: usize) -> String {
    format!("T{}", index + 1)
}

/// Runs `work` and turns a panic into an error: nothing may unwind into LAMMPS.
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

/// Three numbers per particle, as LAMMPS stores them.
pub(crate) fn triples(flat: &[f64]) -> &[[f64; 3]] {
    flat.as_chunks::<3>().0
}

impl Style {
    /// Reads a model file, for a simulation in LAMMPS's `units` of that name; kT is in these. `names` has the species of each
    /// LAMMPS type, in order, or `NULL` for types that another style of a hybrid computes.
    ///
    /// # Errors
    /// Anything wrong in the file, its dimensions, or the names.
    pub fn from_file(
        path: &str,
        units: &str,
        kt: f64,
        names: &[String],
        dimensions: usize,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let model = Model::open(Path::new(path)).map_err(|e| StyleError(e.to_string()))?;
            Style::in_units(model, units, kt, names, dimensions)
        })
    }

    /// As [`Style::from_file`], with the text of a model file; `source` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Style::from_file`].
    pub fn from_text(
        source: &str,
        text: &str,
        units: &str,
        kt: f64,
        names: &[String],
        dimensions: usize,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let model = Model::parse(source, text).map_err(|e| StyleError(e.to_string()))?;
            Style::in_units(model, units, kt, names, dimensions)
        })
    }

    /// Warren's A/B model of the coefficients of LAMMPS's `mdpd`; `pairs` is a row-major table over
    /// types of which the upper triangle is read.
    ///
    /// With `masses`, one for each type, the force law is that of LAMMPS's `mdpd`, whose densities are weighed
    /// by them and which has no potential.
    ///
    /// # Errors
    /// Coefficients that make no model, or none that has a potential.
    pub fn from_coefficients(
        kt: f64,
        pairs: &[Option<WarrenPair>],
        types: usize,
        dimensions: usize,
        masses: Option<&[f64]>,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let members = Members::new(pairs, types)?;
            let Members { species, pairs, .. } = &members;
            let (model, letters) = match masses {
                None => (
                    warren_ab(species, pairs, dimensions, ForceLaw::Conservative),
                    "as in mdpd: the force is A (1 - r/rc) + B (n_i + n_j)(1 - r/rd), which is psi = c B n^2 with \
                     c = pi/30 rd^4 in 3-D (Warren eq. 13)",
                ),
                Some(masses) => {
                    let masses: Option<Vec<f64>> =
                        members.types.iter().map(|t| masses.get(*t).copied()).collect();
                    (
                        lucy_mdpd(species, pairs, &masses.unwrap_or_default(), dimensions),
                        "those of mdpd: the force is A (1 - r/rc) + B (rho_i + rho_j)(1 - r/rd), rho the sum of \
                         Lucy's kernel over neighbours times their masses",
                    )
                }
            };
            let model = model.map_err(|e| members.error(e))?;
            Style::of_members(model, kt, &members, types, dimensions, letters)
        })
    }

    /// Spline DPD; `pairs` as for [`Style::from_coefficients`], but pairs of types may be left out.
    ///
    /// # Errors
    /// Coefficients that make no model.
    pub fn from_spline_coefficients(
        kt: f64,
        pairs: &[Option<SplinePair>],
        types: usize,
        thermostat_range: f64,
        dimensions: usize,
    ) -> Result<Style, StyleError> {
        guard(|| {
            let members = Members::new(pairs, types)?;
            let model = spline_dpd(&members.species, &members.pairs, thermostat_range, dimensions)
                .map_err(|e| members.error(e))?;
            let letters =
                "phi = a [A W(r, rc1) - B W(r, rc2)], W the cubic spline with W(0) = 1, not normalised";
            Style::of_members(model, kt, &members, types, dimensions, letters)
        })
    }

    fn of_members<T>(
        model: Model,
        kt: f64,
        members: &Members<T>,
        types: usize,
        dimensions: usize,
        letters: &'static str,
    ) -> Result<Style, StyleError> {
        let name = |t| if members.types.contains(&t) { name_of_type(t) } else { "NULL".to_owned() };
        let names: Vec<String> = (0..types).map(name).collect();
        Ok(Style { letters: Some(letters), ..Style::new(model, kt, &names, dimensions)? })
    }

    fn in_units(
        model: Model,
        units: &str,
        kt: f64,
        names: &[String],
        dimensions: usize,
    ) -> Result<Style, StyleError> {
        let scale = Scale::new(units, model.units())
            .map_err(|text| StyleError(format!("{}: {text}", model.source().name())))?;
        Ok(Style { scale, ..Style::new(model, kt / scale.energy, names, dimensions)? })
    }

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
        let thermostat = PairThermostat::new(engine.plan(), kt, settings.instructions);
        Ok(Style {
            model,
            engine,
            thermostat,
            settings,
            pool,
            kt,
            kinds,
            letters: None,
            scale: Scale::ONE,
            converted: Converted::default(),
        })
    }

    /// Another temperature: the model's expressions see it, and the noise.
    ///
    /// # Errors
    /// A model that makes no fluid at this temperature.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), StyleError> {
        guard(|| {
            self.kt = kt / self.scale.energy;
            self.rebuild()
        })
    }

    fn rebuild(&mut self) -> Result<(), StyleError> {
        self.engine = engine_at(&self.model, self.kt, &self.kinds, self.settings, &self.pool)?;
        self.thermostat = PairThermostat::new(self.engine.plan(), self.kt, self.settings.instructions);
        Ok(())
    }

    /// How forces are computed from now on: in mixed precision or in double, by so many threads.
    ///
    /// # Errors
    /// None that [`Style::set_temperature`] did not have before.
    pub fn configure(&mut self, mixed: bool, threads: usize) -> Result<(), StyleError> {
        guard(|| {
            let precision = if mixed { Precision::Mixed } else { Precision::Double };
            let threads = NonZeroUsize::new(threads).unwrap_or(NonZeroUsize::MIN);
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

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// One unit of the model in units of LAMMPS.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// The engine, which computes in units of the model.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The engine.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The thermostat apart from the forces, with the threads and the species of the types.
    pub(crate) fn thermostat(&mut self) -> (Option<&mut PairThermostat>, &Pool, &[i32]) {
        (self.thermostat.as_mut(), &self.pool, &self.kinds)
    }

    /// For the log: what is computed, and what its letters mean.
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
            let path = EnginePath::Reference(Reason::ListedPairs);
            let _ = writeln!(text, "  evaluation    {path}");
            text.push_str("  arithmetic    double precision, 1 thread a rank\n");
        } else {
            let exception = EnginePath::Reference(Reason::ParticleValues);
            let _ = writeln!(text, "  evaluation    {}; on some steps {exception}", EnginePath::Sweep);
            let Settings { precision, instructions, threads } = self.engine.settings();
            let faster = match precision {
                Precision::Double => "; 'precision mixed' is faster",
                _ => "",
            };
            let _ = writeln!(
                text,
                "  arithmetic    {precision} precision, {instructions}, {threads} thread(s) a rank{faster}"
            );
        }
        text
    }

    /// All forces on particles in a box that this rank has all of, added to `f`.
    ///
    /// # Errors
    /// As [`Engine::forces`].
    #[allow(clippy::too_many_arguments)]
    pub fn evaluate(
        &mut self,
        domain: &PeriodicBox,
        x: &[f64],
        v: &[f64],
        tag: &[i32],
        kind: &[i32],
        step: Option<Step>,
        want: Want,
        f: &mut [f64],
    ) -> Result<Tally, StyleError> {
        guard(|| {
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, x, v, step);
            let particles = Particles { owned: tag.len(), x: triples(taken.x), tag, kind };
            let request = Request { particles, v: triples(taken.v), step: taken.step, want };
            taken.add_forces(scale, f, |f| engine.forces(domain, &request, f, true))
        })
    }

    /// The first half of an evaluation, over the `owned` first particles of arrays as LAMMPS has them: pairs,
    /// forces that need no density, densities, ψ and slopes.
    ///
    /// # Errors
    /// As [`Engine::first`].
    #[allow(clippy::too_many_arguments)]
    pub fn densities(
        &mut self,
        around: Around,
        owned: usize,
        x: &[f64],
        v: &[f64],
        tag: &[i32],
        kind: &[i32],
        newton: bool,
        step: Option<Step>,
        want: Want,
    ) -> Result<(), StyleError> {
        guard(|| {
            let newton = if newton { Newton::On } else { Newton::Off };
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, x, v, step);
            let particles = Particles { owned, x: triples(taken.x), tag, kind };
            let request = Request { particles, v: triples(taken.v), step: taken.step, want };
            Ok(engine.first(Surroundings::Ghosts(around, newton), &request)?)
        })
    }

    /// As [`Style::densities`], with pairs listed by LAMMPS.
    ///
    /// # Errors
    /// As [`Engine::first`].
    pub fn densities_of_pairs(
        &mut self,
        owned: usize,
        x: &[f64],
        tag: &[i32],
        kind: &[i32],
        newton: bool,
        listed: &PairsOfHost,
    ) -> Result<(), StyleError> {
        guard(|| {
            let newton = if newton { Newton::On } else { Newton::Off };
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, x, &[], None);
            let particles = Particles { owned, x: triples(taken.x), tag, kind };
            // What LAMMPS wants of listed pairs it says with the forces.
            let request = Request { particles, v: &[], step: None, want: Want::FORCES };
            Ok(engine.first(Surroundings::Listed(*listed, newton), &request)?)
        })
    }

    /// `∂ψ/∂n` of owned particles, then room for ghosts.
    pub fn slopes_mut(&mut self) -> &mut [f64] {
        self.engine.slopes_mut()
    }

    /// Sums every density of the model at the positions of the last evaluation, those that it did not need too.
    ///
    /// # Errors
    /// As [`Engine::sum_densities`].
    pub fn sum_densities(
        &mut self,
        owned: usize,
        x: &[f64],
        tag: &[i32],
        kind: &[i32],
    ) -> Result<(), StyleError> {
        guard(|| {
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, x, &[], None);
            let particles = Particles { owned, x: triples(taken.x), tag, kind };
            // LAMMPS has ghosts for all that is around its atoms, along periods too.
            engine.sum_densities(Surroundings::ghosts(Newton::On), &particles)?;
            Ok(())
        })
    }

    /// Local densities of owned particles, in numbers a volume of LAMMPS.
    pub fn local_densities(&mut self) -> &[f64] {
        if self.scale.is_one() {
            return self.engine.local_densities();
        }
        let volume = self.scale.length.powi(self.model.dimensions() as i32);
        times(self.engine.local_densities(), 1.0 / volume, &mut self.converted.densities)
    }

    /// ψ of owned particles, in LAMMPS's units of energy.
    pub fn excess(&mut self) -> &[f64] {
        if self.scale.is_one() {
            return self.engine.excess();
        }
        times(self.engine.excess(), self.scale.energy, &mut self.converted.excess)
    }

    /// Energy of a pair of kinds at a distance, and the force along it; where energies belong to particles, with what
    /// these two had in the last evaluation.
    ///
    /// # Errors
    /// A particle that was not there then.
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
                _ => Err(StyleError::new(format!(
                    "asked for the pair of particles {} and {}, of which the last evaluation knows nothing",
                    particles[0], particles[1]
                ))),
            }
        })
    }

    /// Adds forces to `f`.
    ///
    /// # Errors
    /// As [`Engine::second`].
    #[allow(clippy::too_many_arguments)]
    pub fn forces(
        &mut self,
        owned: usize,
        x: &[f64],
        v: &[f64],
        tag: &[i32],
        kind: &[i32],
        step: Option<Step>,
        want: Want,
        f: &mut [f64],
    ) -> Result<Tally, StyleError> {
        guard(|| {
            let Style { engine, scale, converted, .. } = self;
            let taken = converted.take(scale, x, v, step);
            let particles = Particles { owned, x: triples(taken.x), tag, kind };
            let request = Request { particles, v: triples(taken.v), step: taken.step, want };
            taken.add_forces(scale, f, |f| engine.second(&request, f, true))
        })
    }
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
mod tests {
    use super::*;

    const MODEL: &str = "title = \"t\"\nspecies = [\"A\", \"B\"]\n[[pair]]\nbetween = [\"A\", \"B\"]\n\
        form = \"soft\"\nstrength = 25\nrange = 1\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\n\
        strength = 25\nrange = 1\n[[pair]]\nbetween = [\"B\", \"B\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n";

    fn style(names: &[&str], dimensions: usize) -> Result<Style, StyleError> {
        let names: Vec<String> = names.iter().map(|s| (*s).to_owned()).collect();
        Style::new(Model::parse("m.toml", MODEL).unwrap(), 1.0, &names, dimensions)
    }

    #[test]
    fn types_map_to_species_by_name() {
        let mut s = style(&["B", "NULL", "A"], 3).unwrap();
        let x = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0];
        let mut f = [0.0; 6];
        let open = PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [false; 3]).unwrap();
        let around = Around { domain: &open, images: &[] };
        s.densities(around, 2, &x, &[], &[1, 2], &[1, 2], true, None, Want::FORCES).unwrap();
        s.forces(2, &x, &[], &[1, 2], &[1, 2], None, Want::FORCES, &mut f).unwrap();
        assert_eq!(f, [0.0; 6]);
        s.densities(around, 2, &x, &[], &[1, 2], &[1, 3], true, None, Want::FORCES).unwrap();
        s.forces(2, &x, &[], &[1, 2], &[1, 3], None, Want::FORCES, &mut f).unwrap();
        assert_eq!(f, [-12.5, 0.0, 0.0, 12.5, 0.0, 0.0]);
        // Without ghosts, added to what is there.
        s.evaluate(&open, &x, &[], &[1, 2], &[1, 3], None, Want::FORCES, &mut f).unwrap();
        assert_eq!(f, [-25.0, 0.0, 0.0, 25.0, 0.0, 0.0]);
    }

    /// Somebody who looks at densities that no force needs slows no later step down.
    #[test]
    fn densities_of_one_step_leave_later_steps_to_the_sweep() {
        let text = "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
            [density.m]\nkernel = \"linear\"\nrange = 1\n[excess_free_energy]\nA = \"n^2 + m\"\n";
        let mut s = Style::new(Model::parse("m.toml", text).unwrap(), 1.0, &["A".to_owned()], 3).unwrap();
        let (x, tag, kind) = ([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], [1, 2], [1, 1]);
        let w = 3.0 / std::f64::consts::PI * 0.5;
        s.sum_densities(2, &x, &tag, &kind).unwrap();
        assert_eq!(s.engine().local_densities(), [0.0; 4]);
        for _ in 0..2 {
            s.evaluate(&PeriodicBox::OPEN, &x, &[], &tag, &kind, None, Want::FORCES, &mut [0.0; 6]).unwrap();
            assert_eq!(s.engine().path(), Some(EnginePath::Sweep));
            s.sum_densities(2, &x, &tag, &kind).unwrap();
            let densities = s.engine().local_densities();
            assert_eq!(densities.len(), 4);
            assert!((densities[1] - w).abs() < 1e-14 && densities[0] > 0.0, "{densities:?}");
            assert_eq!(s.engine().path(), Some(EnginePath::Sweep));
        }
        let text = [false, true].map(|listed| s.description("", listed, listed));
        assert!(text[0].contains("evaluation    cell sweep;"), "{}", text[0]);
        assert!(text[0].contains("half-step") && text[1].contains("those of fix dpd/splitting"));
        assert!(
            text[1].contains("evaluation    reference evaluation, because the host lists"),
            "{}",
            text[1]
        );
    }

    #[test]
    fn mistakes_are_named() {
        assert!(style(&["C"], 3).unwrap_err().to_string().contains("no species \"C\"; the model has A, B"));
        assert!(style(&["A"], 2).unwrap_err().to_string().contains("dimensions = 3, the simulation has 2"));
        let missing = Style::from_file("nowhere.toml", "lj", 1.0, &[], 3).unwrap_err();
        assert!(missing.to_string().contains("nowhere.toml: cannot be read"), "{missing}");
    }

    #[test]
    fn types_without_coefficients_take_no_part() {
        let pair = WarrenPair { a: -40.0, b: 25.0, gamma: 1.0, rc: 1.0, rd: 0.75 };
        let mut table = vec![None; 9];
        table[4] = Some(pair);
        for masses in [None, Some(&[7.0, 1.0, 2.0][..])] {
            let mut table = table.clone();
            let style = Style::from_coefficients(1.0, &table, 3, 3, masses).unwrap();
            assert_eq!(style.kinds, [-1, -1, 0, -1]);
            table[8] = Some(pair);
            let error = Style::from_coefficients(1.0, &table, 3, 3, masses).unwrap_err();
            assert!(error.to_string().contains("types 2 and 3"), "{error}");
            assert!(Style::from_coefficients(1.0, &[None], 1, 3, masses).is_err());
            for other in [&table[..8], &[]] {
                let error = Style::from_coefficients(1.0, other, 3, 3, masses).unwrap_err().to_string();
                assert!(error.contains("expected coefficients for every pair"), "{error}");
            }
        }
        let short = Style::from_coefficients(1.0, &table, 3, 3, Some(&[1.0])).unwrap_err();
        assert!(short.to_string().contains("as many masses"), "{short}");
    }

    /// Whatever a host passes: an answer or an error.
    #[test]
    fn hostile_arguments_are_errors() {
        let many = "title = \"t\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
            [excess_free_energy]\nA = \"n^2\"\n[[thermostat]]\ngamma = 1\nrange = 1\n";
        let mut s = Style::new(Model::parse("m.toml", many).unwrap(), 1.0, &["A".to_owned()], 3).unwrap();
        let open = PeriodicBox::orthogonal([0.0; 3], [3.0; 3], [false; 3]).unwrap();
        let closed = PeriodicBox::orthogonal([0.0; 3], [3.0; 3], [true; 3]).unwrap();
        let extremes = [i32::MIN, -1, 0, 1, 2, 3, i32::MAX];
        // Before any evaluation nobody is known.
        assert!(extremes.iter().all(|i| s.single([1, 1], 0.5, [*i, 0]).is_err()));
        let (x, v) = ([0.0, 0.0, 0.0, 0.5, 0.0, 0.0], [0.0; 6]);
        let step = Some(Step { seed: 1, number: 1, dt: 0.01 });
        let mut f = [0.0; 6];
        s.evaluate(&closed, &x, &v, &[1, 2], &[1, 1], step, Want::FORCES, &mut f).unwrap();
        s.engine_mut().fetch_slopes(2);
        assert!(s.single([1, 1], 0.5, [0, 1]).unwrap().1 > 0.0);
        for i in extremes {
            for pair in [[i, 0], [0, i], [i, i]] {
                assert_eq!(s.single([1, 1], 0.5, pair).is_ok(), pair.iter().all(|k| (0..2).contains(k)));
            }
            for kind in extremes {
                let _ = s.single([kind, i], f64::NAN, [0, 1]);
                let kinds = [1, kind];
                let known = kind == 1;
                let around = Around { domain: &open, images: &[] };
                assert!(
                    s.densities(around, 2, &x, &v, &[1, 2], &kinds, true, step, Want::FORCES).is_ok()
                        == known
                        || kind == 0
                );
            }
        }
        let around = Around { domain: &open, images: &[true] };
        for owned in [0, 1, 2, 3, usize::MAX] {
            for (tags, kinds) in [(&[1, 2][..], &[1][..]), (&[1], &[1, 1]), (&[], &[])] {
                let short = s.densities(around, owned, &x, &v, tags, kinds, true, step, Want::FORCES);
                assert!(short.is_err());
                assert!(s.forces(owned, &x, &v, tags, kinds, step, Want::FORCES, &mut f).is_err());
            }
            for (i, j, factor) in [(-1, 0, 1.0), (0, i32::MAX, 1.0), (7, 7, f64::NAN)] {
                let listed = PairsOfHost { i: &[i], j: &[j], factor: &[factor] };
                assert!(s.densities_of_pairs(owned, &x, &[1, 2], &[1, 1], true, &listed).is_err());
            }
        }
        assert!(s.evaluate(&closed, &x, &v, &[1, 2], &[1, 1], step, Want::FORCES, &mut f[..3]).is_err());
        assert!(s.evaluate(&closed, &x, &v[..3], &[1, 2], &[1, 1], step, Want::FORCES, &mut f).is_err());
        assert!(s.evaluate(&closed, &x, &v, &[0, -2], &[1, 1], step, Want::FORCES, &mut f).is_err());
        let wild = [f64::NAN, 0.0, 0.0, f64::INFINITY, 0.0, 1e300];
        assert!(s.evaluate(&closed, &wild, &v, &[1, 2], &[1, 1], step, Want::FORCES, &mut f).is_err());
        // And it goes on.
        s.evaluate(&closed, &x, &v, &[1, 2], &[1, 1], step, Want::FORCES, &mut f).unwrap();
    }

    #[test]
    fn panics_become_errors() {
        let error = guard::<()>(|| panic!("lost {}", 7)).unwrap_err();
        assert!(error.to_string().contains("internal error, please report it: lost 7"));
    }
}
