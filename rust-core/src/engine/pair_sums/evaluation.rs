//! Evaluates one configuration in a box for measurements and tests: every density, every ψ with its
//! derivatives, every pair with its force.

use super::densities::sum_densities;
use super::forces::{ForceInput, ForceOutput, add_forces};
use super::free_energy::{Psi, psi};
use super::in_box::{BoxSearch, Pair};
use super::pairs::Pairs;
use super::sweep_pairs::SweepPairs;
use crate::engine::plan::Plan;
use crate::engine::surroundings::Newton;
use crate::free_energy::FreeEnergy;
use crate::model::expression::TooLarge;
use crate::model::pair::PairForm;
use crate::model::{Fluid, PairTerm};
use psidpd_passes::domain::PeriodicBox;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Evaluates configurations of one fluid at one temperature.
#[derive(Debug)]
pub struct Evaluator {
    /// The fluid that is evaluated.
    pub fluid: Fluid,
    /// A plan with a pass for every density.
    plan: Plan,
    free_energy: FreeEnergy,
    work: Mutex<Work>,
}

/// The search for pairs in wide boxes, and arrays of pairs for reuse.
#[derive(Debug)]
struct Work {
    search: SweepPairs,
    spare: Vec<(Pairs, Vec<f64>)>,
}

/// Energy, densities, forces and virial of one configuration.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// Potential energy `U`.
    pub energy: f64,
    /// Uncorrected local densities, one for each density and species, density-major, particle by particle.
    pub densities: Vec<f64>,
    /// Conservative forces on the particles.
    pub forces: Vec<[f64; 3]>,
    /// Virial `Σ r_ij ⊗ F_ij` of the conservative forces: xx, yy, zz, xy, xz, yz.
    pub virial: [f64; 6],
    /// ψ of the particles with its derivatives.
    pub psi: Psi,
    /// Sum `Σ ψ` over the particles of each species.
    pub excess: Vec<f64>,
    pairs: Pairs,
    pair_forces: Vec<f64>,
}

impl Evaluator {
    /// Computes the derivatives of the fluid's formulas.
    ///
    /// # Errors
    /// Fails if a derivative of ψ grows beyond the limits of the formula engine.
    pub fn new(fluid: Fluid) -> Result<Evaluator, TooLarge> {
        let free_energy = FreeEnergy::new(&fluid, usize::MAX).map_err(|_| TooLarge)?;
        let work = Mutex::new(Work { search: SweepPairs::new(&fluid), spare: Vec::new() });
        Ok(Evaluator { plan: Plan::whole(&fluid)?, free_energy, work, fluid })
    }

    /// Evaluates particles at `x`, with one species each, in a box. Particles at positions that
    /// are not finite do not interact.
    pub fn evaluate(&self, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> Evaluation {
        let (pairs, pair_forces) = self.pairs(x, species, domain);
        self.of_pairs(pairs, pair_forces, species)
    }

    /// Computes the energy `U` only.
    pub fn energy(&self, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> f64 {
        let (pairs, pair_forces) = self.pairs(x, species, domain);
        let (_, psi) = self.excess(&pairs, species);
        let energy = psi.value.iter().sum::<f64>() + pair_energies(&pairs, &self.fluid).iter().sum::<f64>();
        self.work().spare.push((pairs, pair_forces));
        energy
    }

    /// Keeps the arrays of an evaluation for reuse: allocating new ones costs more than filling them.
    pub fn recycle(&self, evaluation: Evaluation) {
        self.work().spare.push((evaluation.pairs, evaluation.pair_forces));
    }

    fn work(&self) -> MutexGuard<'_, Work> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Finds the pairs; allocates their forces.
    fn pairs(&self, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> (Pairs, Vec<f64>) {
        let mut work = self.work();
        let (mut pairs, mut pair_forces) = work.spare.pop().unwrap_or_default();
        pairs.clear(x.len(), Newton::On);
        if !work.search.find(x, species, domain, &mut pairs) {
            let (dimensions, range) = (self.fluid.dimensions, self.fluid.conservative_range());
            let finite = |k: usize| x[k].iter().all(|c| c.is_finite());
            BoxSearch::default().find(x, x.len(), finite, domain, dimensions, range, |i, j, d| {
                pairs.force.push(i, j, d, species);
            });
        }
        pair_forces.resize(pairs.force.len(), 0.0);
        (pairs, pair_forces)
    }

    /// Computes densities and ψ of all particles.
    fn excess(&self, pairs: &Pairs, species: &[i32]) -> (Vec<f64>, Psi) {
        let Evaluator { fluid, plan, free_energy, .. } = self;
        let mut densities = vec![0.0; species.len() * fluid.variables()];
        sum_densities(pairs, plan, 0..fluid.densities.len(), species, &mut densities);
        let psi = psi(free_energy, fluid, species, &densities);
        (densities, psi)
    }

    fn of_pairs(&self, pairs: Pairs, mut pair_forces: Vec<f64>, species: &[i32]) -> Evaluation {
        let (owned, (densities, psi)) = (species.len(), self.excess(&pairs, species));
        let mut forces = vec![[0.0; 3]; owned];
        let mut output =
            ForceOutput { force: &mut forces, pair_force: &mut pair_forces, ..ForceOutput::default() };
        let input = ForceInput::conservative(&self.plan, &pairs.force, owned, &psi.slopes);
        add_forces(&input, &mut output);
        let tally = output.tally;
        let mut excess = vec![0.0; self.fluid.species.len()];
        psi.value.iter().zip(species).for_each(|(value, s)| excess[*s as usize] += value);
        let energy = excess.iter().sum::<f64>() + tally.pair;
        Evaluation { energy, densities, forces, virial: tally.virial, psi, excess, pairs, pair_forces }
    }
}

/// The sum `Σ φ` over each pair term of a fluid.
fn pair_energies(pairs: &Pairs, fluid: &Fluid) -> Vec<f64> {
    let list = &pairs.force;
    let energy_of = |term: &PairTerm| {
        let acting = (0..list.len())
            .filter(|k| term.acts(list.species_i[*k] as usize, list.species_j[*k] as usize, list.r[*k]));
        acting.map(|k| term.potential.at(list.r[k]).0).sum()
    };
    fluid.pairs.iter().map(energy_of).collect()
}

impl Evaluation {
    /// Uncorrected local densities of one particle.
    pub fn densities_of(&self, particle: usize) -> &[f64] {
        let variables = self.densities.len() / self.forces.len();
        &self.densities[particle * variables..(particle + 1) * variables]
    }

    /// The sum `Σ φ` over each pair term of the fluid.
    pub fn pair_energies(&self, fluid: &Fluid) -> Vec<f64> {
        pair_energies(&self.pairs, fluid)
    }

    /// Pairs in the range of the conservative interactions.
    pub fn pairs(&self) -> impl Iterator<Item = Pair> {
        let list = &self.pairs.force;
        (0..list.len()).map(|k| Pair {
            i: list.i[k] as usize,
            j: list.j[k] as usize,
            d: list.d.each_ref().map(|d| d[k]),
            r: list.r[k],
        })
    }

    /// The pairs with their force along `ê_ij = (r_i − r_j)/r_ij`, positive if repulsive; pairs at zero
    /// distance have no direction and are left out.
    pub fn pair_forces(&self) -> impl Iterator<Item = (Pair, f64)> {
        self.pairs().zip(self.pair_forces.iter().copied()).filter(|(p, _)| p.r > 0.0)
    }

    /// `∇_k² U` of each particle `k`, minus the divergence of its force:
    ///
    /// ```text
    /// Σ_i [ψ_i,vu ∇_k n_iv·∇_k n_iu + ψ_i,v ∇_k² n_iv] + Σ_j ∇² φ(r_kj)
    /// ```
    ///
    /// The result is exact where each two particles form one pair, in boxes at least twice the range wide.
    pub fn laplacians(&self, fluid: &Fluid, species: &[i32]) -> Vec<f64> {
        let (count, variables) = (fluid.species.len(), fluid.variables());
        let Psi { slopes, second, .. } = &self.psi;
        let rest = (fluid.dimensions - 1) as f64;
        let mut sum = vec![0.0; species.len()];
        // Gradients ∇_i n_iv of the densities.
        let mut gradients = vec![[0.0; 3]; species.len() * variables];
        let mut slope = vec![0.0; fluid.densities.len()];
        for p in self.pairs().filter(|p| p.r > 0.0 && p.i != p.j) {
            let (a, b) = (species[p.i] as usize, species[p.j] as usize);
            let mut both = 0.0;
            for (d, density) in fluid.densities.iter().enumerate() {
                slope[d] = density.kernel.slope(p.r);
                if p.r >= density.kernel.range() {
                    continue;
                }
                let (of_i, of_j) = (p.i * variables + d * count + b, p.j * variables + d * count + a);
                let per_length = slope[d] / p.r;
                for c in 0..3 {
                    gradients[of_i][c] += per_length * p.d[c];
                    gradients[of_j][c] -= per_length * p.d[c];
                }
                let laplacian = density.kernel.curvature(p.r) + rest * per_length;
                both += (slopes[of_i] + slopes[of_j]) * laplacian;
            }
            for term in fluid.pairs.iter().filter(|term| term.acts(a, b, p.r)) {
                both += term.potential.curvature(p.r) + rest * term.potential.at(p.r).1 / p.r;
            }
            sum[p.i] += both;
            sum[p.j] += both;
            // Second derivatives of ψ of each particle when the other moves.
            let [of_i, of_j] = [p.i, p.j].map(|k| &second[k * variables * variables..]);
            for (d, s) in slope.iter().enumerate() {
                for (e, t) in slope.iter().enumerate() {
                    sum[p.j] += of_i[(d * count + b) * variables + e * count + b] * s * t;
                    sum[p.i] += of_j[(d * count + a) * variables + e * count + a] * s * t;
                }
            }
        }
        for (i, sum) in sum.iter_mut().enumerate() {
            let gradients = &gradients[i * variables..(i + 1) * variables];
            let second = second[i * variables * variables..].chunks_exact(variables.max(1));
            for (g, row) in gradients.iter().zip(second) {
                for (h, second) in gradients.iter().zip(row) {
                    *sum += second * (g[0] * h[0] + g[1] * h[1] + g[2] * h[2]);
                }
            }
        }
        sum
    }
}

/// Indices of the components of a symmetric tensor, in the order of the virial.
pub const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use psidpd_passes::noise::threefry2x32;

    const BOUNDED: &str = r#"
title = "bounded"
species = ["A"]
[density.n]
kernel = "wendland-c2"
range = 1.0
bounds = [2.0, 3.5]
correction = [0.1, 1.1, 0.01]
[excess_free_energy]
A = { pressure = "rho*kT + rho^3" }
"#;

    const STATED: &str = r#"
title = "stated"
species = ["A"]
[density.n]
kernel = "quadratic"
range = 1.0
correction = [0.1, 1.1, 0.01]
[excess_free_energy]
A = { slopes = { n = "0.3*n" }, energy = "n^2" }
"#;

    const MODELS: [&str; 5] = [
        BOUNDED,
        include_str!("../../../../validation/models/warren2003-set6.toml"),
        include_str!("../../../../validation/models/huggins.toml"),
        include_str!("../../../../validation/models/binary-2d.toml"),
        include_str!("../../../../validation/models/spline-attractive.toml"),
    ];

    fn random(model: &str, seed: u32) -> (Evaluator, Vec<[f64; 3]>, Vec<i32>, PeriodicBox) {
        let fluid = Model::parse("m.toml", model).unwrap().at(1.0).unwrap();
        let flat = fluid.dimensions == 2;
        let domain = PeriodicBox::orthogonal(
            [0.0, 0.0, if flat { -0.5 } else { 0.0 }],
            [3.0, 3.2, if flat { 1.0 } else { 2.9 }],
            [true; 3],
        )
        .unwrap();
        let uniform = |k: u32| f64::from(threefry2x32::<20>([k, seed], [5, 9])[0]) / 4_294_967_296.0;
        let x = (0..90)
            .map(|k| {
                let mut p = domain.point([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2)]);
                if flat {
                    p[2] = 0.0;
                }
                p
            })
            .collect();
        let species = (0..90).map(|k| k % fluid.species.len() as i32).collect();
        (Evaluator::new(fluid).unwrap(), x, species, domain)
    }

    #[test]
    fn an_evaluation_is_the_truth() {
        for model in MODELS.into_iter().chain([STATED]) {
            let (evaluator, x, species, domain) = random(model, 11);
            let found = evaluator.evaluate(&x, &species, &domain);
            let indices: Vec<usize> = species.iter().map(|s| *s as usize).collect();
            let truth = crate::truth::conservative(&evaluator.fluid, &x, &indices, &domain).unwrap();
            let energies = found.excess.iter().chain(&found.pair_energies(&evaluator.fluid)).sum::<f64>();
            let alone = evaluator.energy(&x, &species, &domain);
            assert!((alone - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            assert!((energies - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            let scale = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
            assert!((found.energy - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            for (f, g) in found.forces.iter().flatten().zip(truth.forces.iter().flatten()) {
                assert!((f - g).abs() < 1e-11 * scale, "{f} {g}");
            }
            for (w, v) in found.virial.iter().zip(truth.virial) {
                assert!((w - v).abs() < 1e-10 * scale, "{w} {v}");
            }
        }
    }

    /// ψ has no finite slope for an isolated particle, which must not affect pairs out of the range of its density.
    #[test]
    fn pairs_out_of_range_of_a_density_feel_nothing_of_it() {
        let model = r#"
title = "m"
species = ["A"]
[density.n]
kernel = "lucy"
range = 0.5
[excess_free_energy]
A = "sqrt(n)"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 25.0
range = 1.0
"#;
        let (evaluator, ..) = random(model, 13);
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let found = evaluator.evaluate(&[[1.0; 3], [1.7, 1.0, 1.0]], &[0, 0], &domain);
        assert!((found.forces[0][0] + 7.5).abs() < 1e-12 && found.forces[1][0] == -found.forces[0][0]);
    }

    /// Compares the Laplacian of U with differences of forces.
    #[test]
    fn laplacians_are_divergences_of_forces() {
        for model in MODELS {
            let (evaluator, x, species, domain) = random(model, 12);
            let found = evaluator.evaluate(&x, &species, &domain).laplacians(&evaluator.fluid, &species);
            let dimensions = evaluator.fluid.dimensions;
            for k in [0, 17, 44] {
                let h = 1e-6;
                let mut divergence = 0.0;
                for c in 0..dimensions {
                    let force = |h: f64| {
                        let mut x = x.clone();
                        x[k][c] += h;
                        evaluator.evaluate(&x, &species, &domain).forces[k][c]
                    };
                    divergence += (force(h) - force(-h)) / (2.0 * h);
                }
                let scale = divergence.abs().max(1.0);
                assert!((found[k] + divergence).abs() < 2e-5 * scale, "{} {divergence}", found[k]);
            }
        }
    }
}
