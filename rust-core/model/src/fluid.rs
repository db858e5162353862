use super::continuation::Bounds;
use super::curve::Curve;
use super::expression::Formula;
use super::kernel::Kernel;
use super::pair::{PairForm, PairPotential};
use super::wall::WallField;

/// A model at one temperature: numbers and compiled formulas only.
#[derive(Debug, Clone)]
pub struct Fluid {
    /// The title in the model file.
    pub title: String,
    /// The publication that the model comes from.
    pub reference: Option<String>,
    /// Number of dimensions, 2 or 3.
    pub dimensions: usize,
    /// Temperature kT, in energy.
    pub kt: f64,
    /// The names of the species; their order is the order of every per-species index.
    pub species: Vec<String>,
    /// The weighted local densities.
    pub densities: Vec<WeightedDensity>,
    /// `ψ_α` of each species.
    pub excess: Vec<ExcessFreeEnergy>,
    /// The pair potentials.
    pub pairs: Vec<PairTerm>,
    /// The thermostat of each pair of species, row-major and symmetric.
    pub thermostats: Vec<Option<Thermostat>>,
    /// Walls behind faces of the box.
    pub walls: Vec<WallField>,
}

impl Fluid {
    /// The number of variables of ψ: one for each density and species, density-major.
    pub fn variables(&self) -> usize {
        self.densities.len() * self.species.len()
    }

    /// The longest range of all terms; 0 for an ideal gas without thermostat.
    pub fn cutoff(&self) -> f64 {
        let thermostats = self.thermostats.iter().flatten().map(|t| t.range);
        thermostats.fold(self.conservative_range(), f64::max)
    }

    /// The longest range of a conservative interaction.
    pub fn conservative_range(&self) -> f64 {
        self.pairs.iter().map(|p| p.potential.range()).fold(self.range_of_densities(), f64::max)
    }

    fn range_of_densities(&self) -> f64 {
        self.densities.iter().map(|d| d.kernel.range().max(d.force_kernel.range())).fold(0.0, f64::max)
    }

    /// The longest range of a conservative interaction of two species; 0 if there is none.
    pub fn conservative_range_between(&self, a: usize, b: usize) -> f64 {
        let pairs = self.pairs.iter().filter(|p| p.between == [a, b] || p.between == [b, a]);
        pairs.map(|p| p.potential.range()).fold(self.range_of_densities(), f64::max)
    }

    /// Whether some force jumps at its range, where `∇·F` has a delta function that samples of configurations miss.
    pub fn force_jumps(&self) -> bool {
        let jumps = |inner: f64, scale: f64| inner.abs() > 1e-6 * scale;
        let at_range = |range: f64| range * (1.0 - 1e-9);
        let kernel = |w: &Kernel| jumps(w.slope(at_range(w.range())), w.slope_factor());
        let pair = |phi: &PairPotential| {
            let slope = |r: f64| phi.at(r).1;
            let inside = (1..20).map(|k| slope(phi.range() * f64::from(k) / 20.0).abs());
            jumps(slope(at_range(phi.range())), inside.fold(0.0, f64::max))
        };
        self.densities.iter().any(|d| kernel(&d.kernel)) || self.pairs.iter().any(|p| pair(&p.potential))
    }

    /// Whether the force of every density is the gradient of its own kernel, and its strength the slope
    /// of a ψ, so that a potential exists (Warren eq. 10).
    pub fn is_conservative(&self) -> bool {
        self.densities.iter().all(|d| d.force_kernel == d.kernel) && self.stated_slopes().is_none()
    }

    /// The first species whose force is stated and not derived from a ψ, if there is one: mean
    /// field then has no free energy.
    pub fn stated_slopes(&self) -> Option<&str> {
        let stated = self.excess.iter().position(|e| matches!(e, ExcessFreeEnergy::Slopes(_)))?;
        Some(&self.species[stated])
    }
}

/// A weighted local density `n_β,i = Σ_{j≠i, c(j)=β} w(r_ij)`.
#[derive(Debug, Clone)]
pub struct WeightedDensity {
    /// Name of the density in the model file.
    pub name: String,
    /// Weight function `w`.
    pub kernel: Kernel,
    /// The kernel whose slope is the force law: `kernel` itself, unless the model file asks for a law
    /// without a potential, as LAMMPS's `mdpd` does.
    pub force_kernel: Kernel,
    /// Whether a particle's own `w(0)` contributes to its density of its own species.
    pub includes_self: bool,
    /// Correction `ρ̃(n)` of Trofimov et al. for (species that feels, species whose density it is), row-major.
    pub correction: Vec<Polynomial>,
    /// Bounds of the corrected density; ψ is continued outside.
    pub bounds: Option<Bounds>,
}

/// A polynomial by its coefficients in ascending powers.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial(pub Vec<f64>);

impl Polynomial {
    /// The polynomial `x`.
    pub fn identity() -> Polynomial {
        Polynomial(vec![0.0, 1.0])
    }

    /// Whether the polynomial is `x`.
    pub fn is_identity(&self) -> bool {
        self.0 == [0.0, 1.0]
    }

    /// The value and the slope at `x`.
    pub fn at(&self, x: f64) -> (f64, f64) {
        self.0.iter().rev().fold((0.0, 0.0), |(value, slope), c| (value * x + c, slope * x + value))
    }

    /// Replaces every `x` by the value there, and writes the slopes to `slope`.
    pub fn block(&self, x: &mut [f64], slope: &mut [f64]) {
        for (x, slope) in x.iter_mut().zip(slope) {
            (*x, *slope) = self.at(*x);
        }
    }

    /// The slope, if the polynomial is linear.
    pub fn constant_slope(&self) -> Option<f64> {
        match self.0.get(2..) {
            Some(rest) if rest.iter().any(|c| *c != 0.0) => None,
            _ => Some(self.0.get(1).copied().unwrap_or(0.0)),
        }
    }
}

/// The excess free energy per particle of one species.
#[derive(Debug, Clone)]
pub enum ExcessFreeEnergy {
    /// A formula of the corrected densities, one for each of the [`Fluid::variables`].
    Formula(Formula),
    /// A function of the total corrected density `Σ_β ñ_β` of one of the densities.
    Curve(Curve),
    /// No ψ: the model states slopes, which may be those of no function.
    Slopes(StatedSlopes),
}

/// A stated many-body force, which may have no potential: on the pair `i`, `j` it is `−[s_i,c(j) +
/// s_j,c(i)] w′(r) ê`, with `s` in place of `∂ψ/∂ñ`.
#[derive(Debug, Clone)]
pub struct StatedSlopes {
    /// Formula for the reported energy of a particle, of the corrected densities.
    pub energy: Formula,
    /// The slopes `s`, one for each of the [`Fluid::variables`], as formulas of the corrected densities.
    pub slopes: Vec<Formula>,
}

impl StatedSlopes {
    /// Whether the energy or a slope depends on variable `v`, or the force of that variable is not zero.
    pub fn depends_on(&self, v: usize) -> bool {
        let acts = self.slopes[v].is_constant() != Some(0.0);
        acts || self.energy.depends_on(v) || self.slopes.iter().any(|s| s.depends_on(v))
    }
}

/// A pair potential and the species it acts between.
#[derive(Debug, Clone)]
pub struct PairTerm {
    /// Indices of the two species.
    pub between: [usize; 2],
    /// The potential `φ`.
    pub potential: PairPotential,
}

impl PairTerm {
    /// Whether the potential acts on a pair of species `a` and `b` at the distance `r`.
    pub fn acts(&self, a: usize, b: usize, r: f64) -> bool {
        (self.between == [a, b] || self.between == [b, a]) && r < self.potential.range()
    }
}

/// The dissipative and random force of a pair of species: `F^D = −γ w_R² (ê·v_ij) ê`, `F^R = σ w_R ξ
/// dt^{-1/2} ê`, `σ² = 2γkT`, `w_R = (1 − r/range)^exponent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thermostat {
    /// Drag coefficient γ, in mass over time.
    pub gamma: f64,
    /// Range of `w_R`.
    pub range: f64,
    /// Exponent of `w_R`.
    pub exponent: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomial_value_and_slope() {
        let p = Polynomial(vec![1.54, 1.047, 0.5]);
        let (value, slope) = p.at(2.0);
        assert!((value - (1.54 + 2.094 + 2.0)).abs() < 1e-14);
        assert!((slope - (1.047 + 2.0)).abs() < 1e-14);
        assert_eq!(p.constant_slope(), None);
        assert_eq!(Polynomial::identity().constant_slope(), Some(1.0));
        assert_eq!(Polynomial(vec![3.0]).constant_slope(), Some(0.0));
        assert_eq!(Polynomial(vec![1.0, 2.0, 0.0]).constant_slope(), Some(2.0));
    }

    #[test]
    fn jumps_are_seen() {
        let at = |kernel: &str| {
            let text = format!(
                "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"{kernel}\"\nrange = 1.0\n\
                 [excess_free_energy]\nA = \"n^2\"\n"
            );
            crate::Model::parse("m.toml", &text).unwrap().at(1.0).unwrap().force_jumps()
        };
        assert!(at("linear") && !at("quadratic") && !at("lucy"));
    }
}
