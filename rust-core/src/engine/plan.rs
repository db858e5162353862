//! The passes that a fluid needs, derived once.

use super::error::EngineError;
use super::excess::ExcessPlan;
use super::step::Step;
use crate::model::expression::{Formula, TooLarge};
use crate::model::kernel::Kernel;
use crate::model::pair::PairForm;
use crate::model::wall::{Round, Wall, WallField};
use crate::model::{Continuation, ExcessFreeEnergy, Fluid, PairTerm, WeightedDensity};
use psidpd_passes::ground::cell_grid::SPARSE;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::Exponent;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::simd::Scalar;
use std::fmt;

/// The passes, kernels and ranges of one fluid.
///
/// A density in which every ψ is linear is no many-body term: its force is a pair force `−(c_αβ + c_βα)
/// w′(r)`, `c_αβ = ∂ψ_α/∂n_β`, and needs no density pass.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// The names of the species.
    pub(super) species: Vec<String>,
    /// Temperature of the thermostat and of every formula with kT.
    pub(super) kt: f64,
    /// Number of dimensions, 2 or 3.
    pub(super) dimensions: usize,
    /// Longest range of all forces; particles further apart do not interact.
    pub(super) cutoff: f64,
    pub(super) densities: Vec<WeightedDensity>,
    /// Indices of the densities in which some ψ is not linear; their order is that of the variables of `excess`.
    pub(super) passes: Vec<usize>,
    /// The densities that act as pair potentials.
    pub(super) linear: Vec<LinearTerm>,
    pub(super) excess: Vec<ExcessPlan>,
    pub(super) pairs: Vec<PairTerm>,
    pub(super) thermostat: Option<ThermostatPlan>,
    /// Walls; densities that act as pair potentials act as energies of the walls too.
    pub(super) walls: Vec<WallField>,
    title: String,
    /// The species of each of the host's types, negative for particles that do not interact; at first types are species
    /// indices.
    pub(super) species_of_type: Vec<i32>,
    /// Whether the forces have a potential.
    conservative: bool,
}

/// A density that acts as a pair potential.
#[derive(Debug, Clone)]
pub struct LinearTerm {
    /// Index of the density.
    pub density: usize,
    /// Weight function of the density.
    pub kernel: Kernel,
    /// The kernel whose slope is the force law.
    pub force_kernel: Kernel,
    /// Coefficients `c_αβ`, row-major.
    pub coefficients: Vec<f64>,
}

/// Coefficients of dissipative and random forces, row-major in species.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermostatPlan {
    pub gamma: Vec<f64>,
    /// Noise amplitude `√(2γkT)`.
    pub sigma: Vec<f64>,
    pub range: Vec<f64>,
    pub exponent: Vec<f64>,
    pub longest: f64,
    /// Whether conservative interactions reach as far for any two species.
    pub is_within_forces: bool,
}

/// The full pair cache is faster if a density's range exceeds this fraction of the cutoff; otherwise lists are short.
const FULL_CACHE_FROM: f64 = 0.7;

impl Plan {
    /// Derives the plan of a fluid.
    ///
    /// # Errors
    /// Fails if a derivative of ψ grows beyond the limits of the formula engine.
    pub fn new(fluid: &Fluid) -> Result<Plan, TooLarge> {
        let slopes = slopes(fluid)?;
        let mut passes = Vec::new();
        let mut linear = Vec::new();
        for d in 0..fluid.densities.len() {
            match linear_coefficients(fluid, &slopes, d) {
                None => passes.push(d),
                Some(coefficients) if coefficients.iter().all(|c| *c == 0.0) => {}
                Some(coefficients) => linear.push(LinearTerm {
                    density: d,
                    kernel: fluid.densities[d].kernel,
                    force_kernel: fluid.densities[d].force_kernel,
                    coefficients,
                }),
            }
        }
        Plan::of_passes(fluid, passes, linear)
    }

    /// Derives a plan in which every density has a pass, and no ψ is treated as a pair potential.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn whole(fluid: &Fluid) -> Result<Plan, TooLarge> {
        Plan::of_passes(fluid, (0..fluid.densities.len()).collect(), Vec::new())
    }

    /// Removes the slopes from the plan, for energies alone.
    pub(super) fn without_slopes(mut self) -> Plan {
        self.excess.iter_mut().for_each(ExcessPlan::leave_out_slopes);
        self
    }

    /// # Panics
    /// Panics for a fluid whose lists have been made shorter or longer: the passes read tables by species without checks.
    fn of_passes(fluid: &Fluid, passes: Vec<usize>, linear: Vec<LinearTerm>) -> Result<Plan, TooLarge> {
        let count = fluid.species.len();
        assert!(matches!(fluid.dimensions, 2 | 3), "a fluid has two or three dimensions");
        assert!(count <= 1 << u8::BITS, "the passes store a species in a byte");
        assert!(fluid.thermostats.len() == count * count && fluid.excess.len() == count, "a list by species");
        assert!(fluid.pairs.iter().flat_map(|p| p.between).all(|s| s < count), "a pair of species");
        let psi = |alpha| plan_excess(fluid, alpha, &passes);
        let excess = (0..fluid.species.len()).map(psi).collect::<Result<Vec<_>, _>>()?;
        let walls = fluid.walls.iter().map(|wall| with_linear(wall, count, &linear)).collect();
        Ok(Plan {
            species: fluid.species.clone(),
            dimensions: fluid.dimensions,
            cutoff: fluid.cutoff(),
            densities: fluid.densities.clone(),
            passes,
            linear,
            excess,
            pairs: fluid.pairs.clone(),
            thermostat: ThermostatPlan::new(fluid),
            walls,
            title: fluid.title.clone(),
            kt: fluid.kt,
            species_of_type: (0..fluid.species.len() as i32).collect(),
            conservative: fluid.is_conservative(),
        })
    }

    /// The names of the species.
    pub fn species(&self) -> &[String] {
        &self.species
    }

    /// The temperature kT, in the energy unit of the model.
    pub fn kt(&self) -> f64 {
        self.kt
    }

    /// Number of dimensions, 2 or 3.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Longest range of all forces; particles further apart do not interact.
    pub fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// The longest range of densities, drag and noise.
    pub(super) fn range_without_pairs(&self) -> f64 {
        let densities = self.densities.iter().map(|d| d.kernel.range().max(d.force_kernel.range()));
        densities.fold(self.noise_range().unwrap_or(0.0), f64::max)
    }

    /// Whether a pair potential of the longest range is between species of which one may be rare, and all else is shorter.
    pub(super) fn has_long_pairs(&self) -> bool {
        self.species.len() > 1 && self.range_without_pairs() < self.cutoff
    }

    /// The plan without the pair potentials `out`, by their indices, and with the range of what is left.
    pub(super) fn without_pairs(&self, out: &[usize]) -> Plan {
        let left = self.pairs.iter().enumerate().filter(|(k, _)| !out.contains(k));
        let pairs: Vec<PairTerm> = left.map(|(_, term)| term.clone()).collect();
        let ranges = pairs.iter().map(|term| term.potential.range());
        Plan { cutoff: ranges.fold(self.range_without_pairs(), f64::max), pairs, ..self.clone() }
    }

    /// Indices of the densities in which some ψ is not linear; their order is that of the variables of ψ.
    pub fn passes(&self) -> &[usize] {
        &self.passes
    }

    /// The densities that act as pair potentials.
    pub fn linear(&self) -> &[LinearTerm] {
        &self.linear
    }

    /// The species of each of the host's types, negative for particles that do not interact.
    pub fn species_of_type(&self) -> &[i32] {
        &self.species_of_type
    }

    /// Whether the forces have a potential.
    pub fn is_conservative(&self) -> bool {
        self.conservative
    }

    /// The names of the local densities.
    pub fn densities(&self) -> impl Iterator<Item = &str> {
        self.densities.iter().map(|d| d.name.as_str())
    }

    /// The walls.
    pub fn walls(&self) -> &[WallField] {
        &self.walls
    }

    /// Number of slopes that a host copies from each owned particle to its ghosts.
    pub fn slope_width(&self) -> usize {
        self.passes.len() * self.species.len()
    }

    /// The formula `psi` of species `alpha` as a function of the densities with a pass alone.
    pub fn of_passes_only(&self, fluid: &Fluid, alpha: usize, psi: &Formula) -> Formula {
        without_linear(fluid, alpha, &self.passes, psi.clone())
    }

    /// Whether the first pass caches all pairs with their separations and forces, so that each force is added once, in the
    /// second pass; otherwise it lists the pairs within the range of each density.
    pub fn caches_all_pairs(&self) -> bool {
        let ranges = self.passes.iter().map(|d| self.densities[*d].force_kernel.range());
        // With one variable the density is added together with the force, and the cache saves nothing.
        self.slope_width() > 1 && ranges.fold(0.0, f64::max) > FULL_CACHE_FROM * self.cutoff
    }

    /// The potential energy of a pair of species `a` and `b` at `r` from densities that every ψ is linear in.
    pub fn linear_pair_energy(&self, a: usize, b: usize, r: f64) -> f64 {
        let count = self.species.len();
        self.linear
            .iter()
            .map(|t| (t.coefficients[a * count + b] + t.coefficients[b * count + a]) * t.kernel.value(r))
            .sum()
    }

    /// Range of the random force, if there is one: boxes must be at least twice as long, or two images
    /// of a pair would share their noise.
    pub fn noise_range(&self) -> Option<f64> {
        self.thermostat.as_ref().map(|t| t.longest)
    }

    /// Whether pairs with drag are among those with conservative interactions.
    pub fn drag_is_within_forces(&self) -> bool {
        self.thermostat.as_ref().is_none_or(|t| t.is_within_forces)
    }

    /// Whether ghosts need velocities.
    pub fn needs_velocities(&self) -> bool {
        self.thermostat.is_some()
    }

    /// Maps types to species, as [`Engine::map_kinds`](super::Engine::map_kinds).
    pub(super) fn map_kinds(&mut self, species_of_type: &[i32]) -> Result<(), EngineError> {
        if species_of_type.iter().any(|s| *s >= self.species.len() as i32) {
            return Err(EngineError::Host("a type is mapped to a species the model does not have"));
        }
        self.species_of_type = species_of_type.to_vec();
        Ok(())
    }

    /// The noise of a step and its `Δt^{−1/2}`, if drag and noise act in it.
    ///
    /// # Errors
    /// Fails if these act and there are fewer velocities than particles and ghosts.
    pub(super) fn noise_of(
        &self,
        step: Option<Step>,
        v: &[[f64; 3]],
        all: usize,
    ) -> Result<Option<(PairNoise, f64)>, EngineError> {
        let Some(step) = step.filter(|_| self.needs_velocities()) else { return Ok(None) };
        if v.len() < all {
            return Err(EngineError::Host("the velocity array is too short"));
        }
        Ok(Some((PairNoise::new(step.seed, step.number), 1.0 / step.dt.sqrt())))
    }

    /// Number of species with a ψ that depends on a density.
    pub(super) fn evaluated_species(&self) -> u64 {
        self.excess.iter().filter(|e| !matches!(e, ExcessPlan::Constant(_))).count() as u64
    }
}

/// A wall with the energies of densities that ψ is linear in.
fn with_linear(wall: &WallField, count: usize, linear: &[LinearTerm]) -> WallField {
    let mut wall = wall.clone();
    for (alpha, field) in wall.fields.iter_mut().enumerate() {
        for term in linear {
            let coefficient = term.coefficients[alpha * count + wall.wall.species];
            let densities = field.densities.iter().filter(|(d, _)| *d == term.density && coefficient != 0.0);
            field.energies.extend(densities.map(|(_, density)| density.times(coefficient)));
        }
    }
    wall
}

/// `∂ψ_α/∂ñ_v` for every species and variable; `None` for curves and for stated slopes, which
/// cannot be treated as pair potentials.
fn slopes(fluid: &Fluid) -> Result<Vec<Vec<Option<Formula>>>, TooLarge> {
    fluid
        .excess
        .iter()
        .map(|excess| match excess {
            ExcessFreeEnergy::Formula(psi) => {
                (0..fluid.variables()).map(|v| psi.derivative(v).map(Some)).collect()
            }
            ExcessFreeEnergy::Curve(curve) => {
                let zero = |v| (v / fluid.species.len() != curve.density).then(|| Formula::constant(0.0));
                Ok((0..fluid.variables()).map(zero).collect())
            }
            ExcessFreeEnergy::Slopes(law) => {
                let zero = |v| (!law.depends_on(v)).then(|| Formula::constant(0.0));
                Ok((0..fluid.variables()).map(zero).collect())
            }
        })
        .collect()
}

/// Coefficients `c_αβ` of density `d`, in uncorrected densities, if every ψ is linear in it.
fn linear_coefficients(fluid: &Fluid, slopes: &[Vec<Option<Formula>>], d: usize) -> Option<Vec<f64>> {
    let count = fluid.species.len();
    let mut coefficients = vec![0.0; count * count];
    for alpha in 0..count {
        for beta in 0..count {
            let slope = slopes[alpha][d * count + beta].as_ref()?.is_constant()?;
            if slope != 0.0 {
                let correction = &fluid.densities[d].correction[alpha * count + beta];
                coefficients[alpha * count + beta] = slope * correction.constant_slope()?;
            }
        }
    }
    Some(coefficients)
}

/// ψ_α as a function of the densities with a pass: the others are set to n = 0, where their linear
/// terms, which have become pair terms, vanish.
fn plan_excess(fluid: &Fluid, alpha: usize, passes: &[usize]) -> Result<ExcessPlan, TooLarge> {
    let count = fluid.species.len();
    match &fluid.excess[alpha] {
        ExcessFreeEnergy::Formula(psi) => {
            let psi = without_linear(fluid, alpha, passes, psi.clone());
            ExcessPlan::of_formula(fluid, psi, &variables(count, passes))
        }
        // The curve's density has a pass, and the curve depends on no other.
        ExcessFreeEnergy::Curve(curve) => Ok(ExcessPlan::of_curve(fluid, curve.clone(), passes)),
        // Every density that the slopes depend on has a pass.
        ExcessFreeEnergy::Slopes(law) => Ok(ExcessPlan::of_slopes(law, &variables(count, passes))),
    }
}

/// A formula of species `alpha` at n = 0 of the densities without a pass.
fn without_linear(fluid: &Fluid, alpha: usize, passes: &[usize], mut psi: Formula) -> Formula {
    let count = fluid.species.len();
    for (d, density) in fluid.densities.iter().enumerate().filter(|(d, _)| !passes.contains(d)) {
        for beta in 0..count {
            let own = if density.includes_self && alpha == beta { density.kernel.value(0.0) } else { 0.0 };
            let at_zero = density.correction[alpha * count + beta].at(own).0;
            psi = psi.substitute(d * count + beta, at_zero);
        }
    }
    psi
}

/// The variables of the densities with a pass.
fn variables(count: usize, passes: &[usize]) -> Vec<usize> {
    passes.iter().flat_map(|d| (0..count).map(move |s| d * count + s)).collect()
}

impl ThermostatPlan {
    /// `None` if all γ are 0: then no noise is drawn.
    fn new(fluid: &Fluid) -> Option<ThermostatPlan> {
        let entry = |f: fn(&crate::model::Thermostat) -> f64, default: f64| -> Vec<f64> {
            fluid.thermostats.iter().map(|t| t.as_ref().map_or(default, f)).collect()
        };
        let gamma = entry(|t| t.gamma, 0.0);
        if gamma.iter().all(|g| *g == 0.0) {
            return None;
        }
        let range = entry(|t| if t.gamma > 0.0 { t.range } else { 0.0 }, 0.0);
        let count = fluid.species.len();
        let reach = |k: usize| fluid.conservative_range_between(k / count, k % count);
        Some(ThermostatPlan {
            is_within_forces: range.iter().enumerate().all(|(k, range)| *range <= reach(k)),
            sigma: gamma.iter().map(|g| (2.0 * g * fluid.kt).sqrt()).collect(),
            longest: range.iter().copied().fold(0.0, f64::max),
            exponent: entry(|t| t.exponent, 1.0),
            gamma,
            range,
        })
    }

    /// The exponent of `w_R`, by pairs of species; pairs without drag may have any.
    pub fn exponent_of_weights<T: Scalar>(&self) -> Exponent<T> {
        let all = |e: f64| self.exponent.iter().zip(&self.gamma).all(|(x, gamma)| *gamma == 0.0 || *x == e);
        if all(1.0) {
            Exponent::One
        } else if all(2.0) {
            Exponent::Two
        } else if let Some(quarters) = (1..=16).find(|n| all(0.25 * f64::from(*n))) {
            Exponent::Quarters(quarters)
        } else {
            Exponent::Any(SpeciesPairTable::new(self.exponent.iter().map(|x| T::of(*x))))
        }
    }
}

/// Prints what a wall adds at its surface.
fn write_wall(
    f: &mut fmt::Formatter<'_>,
    wall: &WallField,
    species: &[String],
    dimensions: usize,
) -> fmt::Result {
    let Wall { surface, density, species: matter, .. } = &wall.wall;
    write!(f, "wall          {}", surface.name(dimensions))?;
    let place = match surface.round() {
        None => "face",
        Some(Round { radius, inside, .. }) => {
            write!(f, " of radius {radius} with the fluid {}", if *inside { "inside" } else { "outside" })?;
            "surface"
        }
    };
    writeln!(f, ": {} at a density of {density:.6}", species[*matter])?;
    for (name, field) in species.iter().zip(&wall.fields) {
        let energy: f64 = field.energies.iter().map(|energy| energy.at(0.0)[0]).sum();
        write!(f, "              {name} at the {place}: ")?;
        match surface.round() {
            _ if field.densities.is_empty() => {}
            None => write!(f, "local density + {:.4}, ", 0.5 * density)?,
            Some(_) => {
                let all = field.densities.iter().map(|(_, density)| format!("{:.4}", density.at(0.0)[0]));
                write!(f, "local density + {}, ", all.collect::<Vec<_>>().join(" and "))?;
            }
        }
        write!(f, "energy {energy:+.4} besides psi, range {}; ", field.range)?;
        match &field.friction {
            None => writeln!(f, "no friction")?,
            Some(friction) => {
                let [along, across, around] = friction.at(0.0);
                write!(f, "friction {along:.4} along it, {across:.4} across, ")?;
                if surface.round().is_some_and(|round| round.axis(dimensions).is_some()) {
                    write!(f, "{around:.4} around, ")?;
                }
                writeln!(f, "range {}", friction.range())?;
            }
        }
    }
    Ok(())
}

/// Prints the plan for `psidpd check` and the LAMMPS log.
impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Plan { title, dimensions, cutoff, .. } = self;
        let (count, species) = (self.species.len(), self.species.join(", "));
        writeln!(f, "fluid         {title} ({dimensions}-D; species {species})")?;
        writeln!(f, "cut-off       {cutoff}")?;
        let kernel_of = |density: &WeightedDensity| {
            let WeightedDensity { name, kernel, .. } = density;
            format!("{name}: {} kernel, range {}", kernel.kind().name(), kernel.range())
        };
        for &d in &self.passes {
            let density = &self.densities[d];
            write!(f, "density pass  {}", kernel_of(density))?;
            if density.force_kernel != density.kernel {
                write!(f, "; force by the {} kernel: NOT CONSERVATIVE", density.force_kernel.kind().name())?;
            }
            if let Some(bounds) = density.bounds {
                // Twelve digits leave out the rounding of a formula.
                let [low, high] = [bounds.low, bounds.high].map(|x| format!("{x:.11e}").parse().unwrap_or(x));
                write!(f, "; psi continued outside [{low}, {high}]")?;
                if bounds.below == Continuation::Constant {
                    write!(f, ", psi' constant below")?;
                }
            }
            writeln!(f)?;
        }
        if self.caches_all_pairs() {
            write!(f, "second pass   over all pairs, kept in full: a density reaches further than ")?;
            writeln!(f, "{FULL_CACHE_FROM} of the cut-off")?;
        } else if !self.passes.is_empty() {
            writeln!(f, "second pass   over compact lists of the pairs in range of each density")?;
        }
        writeln!(
            f,
            "pair search   i-clusters of 4 particles; of 8 in columns with fewer than {SPARSE} particles \
             per cut-off"
        )?;
        for term in &self.linear {
            let density = kernel_of(&self.densities[term.density]);
            writeln!(f, "pair term     psi is linear in {density}, no density pass")?;
        }
        for term in &self.pairs {
            use crate::model::pair::PairForm;
            let [a, b] = term.between.map(|s| &self.species[s]);
            let (form, range) = (term.potential.name(), term.potential.range());
            writeln!(f, "pair term     {a}-{b}: {form}, range {range}")?;
        }
        // With one species n is its density; with several there are n_A, n_B …
        let names: Vec<String> = self
            .densities
            .iter()
            .flat_map(|d| {
                self.species
                    .iter()
                    .map(|s| if count == 1 { d.name.clone() } else { format!("{}_{s}", d.name) })
            })
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        for (name, excess) in self.species.iter().zip(&self.excess) {
            match excess {
                ExcessPlan::Constant(0.0) => {}
                ExcessPlan::Constant(value) => writeln!(f, "psi of {name:<6} constant {value}")?,
                ExcessPlan::Formula(plan) => {
                    let stated = plan.stated_slopes();
                    let what = if stated.is_some() { "energy" } else { "psi" };
                    writeln!(f, "{:<13} {}", format!("{what} of {name}"), plan.formula.with_names(&names))?;
                    for (variable, slope) in stated.into_iter().flatten() {
                        let (of, slope) = (format!("slope of {name}"), slope.with_names(&names));
                        writeln!(f, "{of:<13} {}: {slope}; NOT CONSERVATIVE", names[variable])?;
                    }
                }
                ExcessPlan::Curve(plan) => writeln!(f, "psi of {name:<6} {}", plan.curve.describe())?,
            }
        }
        for wall in &self.walls {
            write_wall(f, wall, &self.species, *dimensions)?;
        }
        match &self.thermostat {
            None => write!(f, "thermostat    none: no noise is drawn"),
            Some(t) => {
                write!(f, "thermostat    gamma")?;
                for a in 0..count {
                    for b in a..count {
                        write!(f, " {}-{} {}", self.species[a], self.species[b], t.gamma[a * count + b])?;
                    }
                }
                write!(f, ", range {}", t.longest)
            }
        }
    }
}
