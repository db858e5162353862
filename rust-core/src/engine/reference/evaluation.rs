//! One configuration in a box, evaluated for whoever measures or tests: every density, every ψ with its derivatives,
//! every pair with its force.

use super::densities::sum_densities;
use super::forces::{ForceInput, ForceOutput, add_forces};
use super::free_energy::{FreeEnergies, Psi};
use super::in_box::{BoxSearch, Pair, for_each_pair_by_brute_force};
use super::pairs::Pairs;
use crate::engine::particles::Step;
use crate::engine::plan::Plan;
use crate::engine::surroundings::Newton;
use crate::model::Fluid;
use crate::model::expression::TooLarge;
use crate::model::pair::PairForm;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::tally::{Tally, Want};

/// A fluid at one temperature, ready to be evaluated.
#[derive(Debug)]
pub struct Evaluator {
    fluid: Fluid,
    /// With a pass for every density.
    plan: Plan,
    free_energies: FreeEnergies,
}

/// Energy, densities, forces and virial of one configuration.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// `U`.
    pub energy: f64,
    /// Uncorrected local densities, one for each density and species, density-major, of each particle.
    pub densities: Vec<Vec<f64>>,
    /// Conservative forces on the particles.
    pub forces: Vec<[f64; 3]>,
    /// `Σ r_ij ⊗ F_ij` of the conservative forces: xx, yy, zz, xy, xz, yz.
    pub virial: [f64; 6],
    /// ψ of each particle with its derivatives.
    pub psi: Vec<Psi>,
    /// `Σ ψ` of the particles of each species.
    pub excess: Vec<f64>,
    /// `Σ φ` of each pair term of the model.
    pub pair_energies: Vec<f64>,
    pairs: Pairs,
    pair_forces: Vec<f64>,
}

impl Evaluator {
    /// Differentiates what there is to differentiate.
    ///
    /// # Errors
    /// A derivative of ψ grows beyond the limits of the formula engine.
    pub fn new(fluid: Fluid) -> Result<Evaluator, TooLarge> {
        let free_energies = FreeEnergies::new(&fluid)?;
        Ok(Evaluator { plan: Plan::whole(&fluid)?, free_energies, fluid })
    }

    /// The fluid.
    pub fn fluid(&self) -> &Fluid {
        &self.fluid
    }

    /// Evaluates particles at `x`, of a species each, in a box. What is not finite interacts with nothing.
    pub fn evaluate(&self, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> Evaluation {
        let mut pairs = Pairs::default();
        pairs.clear(x.len(), Newton::On);
        let (dimensions, range) = (self.fluid.dimensions, self.fluid.conservative_range());
        let finite = |k: usize| x[k].iter().all(|c| c.is_finite());
        BoxSearch::default().find(x, x.len(), finite, domain, dimensions, range, |i, j, d| {
            pairs.push_in_box(i, j, d, species);
        });
        self.of_pairs(pairs, species)
    }

    fn of_pairs(&self, pairs: Pairs, species: &[i32]) -> Evaluation {
        let Evaluator { fluid, plan, free_energies } = self;
        let (owned, variables) = (species.len(), fluid.variables());
        let mut densities = vec![0.0; owned * variables];
        sum_densities(&pairs, plan, 0..fluid.densities.len(), species, &mut densities);
        let of = |k: usize| &densities[k * variables..(k + 1) * variables];
        let psi: Vec<Psi> =
            species.iter().enumerate().map(|(k, s)| free_energies.psi(fluid, *s as usize, of(k))).collect();
        let slopes: Vec<f64> = psi.iter().flat_map(|psi| psi.slopes.iter().copied()).collect();
        let mut forces = vec![[0.0; 3]; owned];
        let mut pair_forces = vec![0.0; pairs.force().len()];
        let mut output = ForceOutput {
            force: &mut forces,
            particle_energy: &mut [],
            particle_virial: &mut [],
            pair_force: &mut pair_forces,
            tally: Tally::default(),
        };
        let input = ForceInput {
            plan,
            list: pairs.force(),
            newton: Newton::On,
            owned,
            slopes: &slopes,
            v: &[],
            tag: &[],
            thermostat: None,
            want: Want::TOTALS,
        };
        add_forces(&input, &mut output);
        let tally = output.tally;
        let mut excess = vec![0.0; fluid.species.len()];
        for (psi, s) in psi.iter().zip(species) {
            excess[*s as usize] += psi.value;
        }
        let mut evaluation = Evaluation {
            energy: excess.iter().sum::<f64>() + tally.pair,
            densities: (0..owned).map(|k| of(k).to_vec()).collect(),
            forces,
            virial: tally.virial,
            psi,
            excess,
            pair_energies: Vec::new(),
            pairs,
            pair_forces,
        };
        let energy_of = |term: &crate::model::PairTerm| {
            let acting = evaluation.pairs().filter(|p| {
                let [a, b] = [p.i, p.j].map(|k| species[k] as usize);
                term.acts(a, b, p.r)
            });
            acting.map(|p| term.potential.at(p.r).0).sum()
        };
        evaluation.pair_energies = fluid.pairs.iter().map(energy_of).collect();
        evaluation
    }
}

impl Evaluation {
    /// `U`.
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// Pairs in the range of the conservative interactions.
    pub fn pairs(&self) -> impl Iterator<Item = Pair> {
        let list = self.pairs.force();
        (0..list.len()).map(|k| Pair {
            i: list.i[k] as usize,
            j: list.j[k] as usize,
            d: list.d.each_ref().map(|d| d[k]),
            r: list.r[k],
        })
    }

    /// The pairs with their force along `ê_ij = (r_i − r_j)/r_ij`, positive if it pushes them apart; pairs on one point
    /// have no direction and are left out.
    pub fn pair_forces(&self) -> impl Iterator<Item = (Pair, f64)> {
        self.pairs().zip(self.pair_forces.iter().copied()).filter(|(p, _)| p.r > 0.0)
    }

    /// `∇_k² U` of each particle `k`, minus the divergence of its force:
    ///
    /// ```text
    /// Σ_i [ψ_i,vu ∇_k n_iv·∇_k n_iu + ψ_i,v ∇_k² n_iv] + Σ_j ∇² φ(r_kj)
    /// ```
    ///
    /// exact where no two particles see each other twice, in boxes at least twice the range wide.
    pub fn laplacians(&self, fluid: &Fluid, species: &[i32]) -> Vec<f64> {
        let (count, variables) = (fluid.species.len(), fluid.variables());
        let rest = (fluid.dimensions - 1) as f64;
        let mut sum = vec![0.0; self.psi.len()];
        // ∇_i n_iv
        let mut gradients = vec![[0.0; 3]; self.psi.len() * variables];
        let mut slope = vec![0.0; fluid.densities.len()];
        for p in self.pairs().filter(|p| p.r > 0.0 && p.i != p.j) {
            let (a, b) = (species[p.i] as usize, species[p.j] as usize);
            let mut both = 0.0;
            for (d, density) in fluid.densities.iter().enumerate() {
                slope[d] = density.kernel.slope(p.r);
                for c in 0..3 {
                    gradients[p.i * variables + d * count + b][c] += slope[d] * p.d[c] / p.r;
                    gradients[p.j * variables + d * count + a][c] -= slope[d] * p.d[c] / p.r;
                }
                let laplacian = density.kernel.curvature(p.r) + rest * slope[d] / p.r;
                both +=
                    (self.psi[p.i].slopes[d * count + b] + self.psi[p.j].slopes[d * count + a]) * laplacian;
            }
            for term in &fluid.pairs {
                if term.acts(a, b, p.r) {
                    both += term.potential.curvature(p.r) + rest * term.potential.at(p.r).1 / p.r;
                }
            }
            sum[p.i] += both;
            sum[p.j] += both;
            // ψ of one as the other moves.
            for (d, s) in slope.iter().enumerate() {
                for (e, t) in slope.iter().enumerate() {
                    let (v, u) = (d * count + b, e * count + b);
                    sum[p.j] += self.psi[p.i].second[v * variables + u] * s * t;
                    let (v, u) = (d * count + a, e * count + a);
                    sum[p.i] += self.psi[p.j].second[v * variables + u] * s * t;
                }
            }
        }
        for (i, sum) in sum.iter_mut().enumerate() {
            for v in 0..variables {
                for u in 0..variables {
                    let (g, h) = (gradients[i * variables + v], gradients[i * variables + u]);
                    *sum += self.psi[i].second[v * variables + u] * (g[0] * h[0] + g[1] * h[1] + g[2] * h[2]);
                }
            }
        }
        sum
    }
}

/// Components of a symmetric tensor in their order.
pub const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Every pair of particles and images by brute force: both must be inside `domain` along its periodic directions.
fn brute_force_pairs(fluid: &Fluid, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> Pairs {
    let mut pairs = Pairs::default();
    pairs.clear(x.len(), Newton::On);
    for_each_pair_by_brute_force(x, domain, fluid.dimensions, fluid.cutoff(), |p| {
        pairs.push_in_box(p.i, p.j, p.d, species);
    });
    pairs
}

/// Evaluates `U` and its gradient for particles at `x`, inside `domain` along its periodic directions: the truth for
/// tests. It takes time as the square of the number of particles.
///
/// # Errors
/// A derivative of ψ grows beyond the limits of the formula engine.
pub fn evaluate(
    fluid: &Fluid,
    x: &[[f64; 3]],
    species: &[usize],
    domain: &PeriodicBox,
) -> Result<Evaluation, TooLarge> {
    let species: Vec<i32> = species.iter().map(|s| *s as i32).collect();
    let pairs = brute_force_pairs(fluid, x, &species, domain);
    Ok(Evaluator::new(fluid.clone())?.of_pairs(pairs, &species))
}

/// Dissipative and random forces, and their virial, over the same pairs.
///
/// # Errors
/// As [`evaluate`].
pub fn thermostat(
    fluid: &Fluid,
    x: &[[f64; 3]],
    v: &[[f64; 3]],
    tag: &[i32],
    species: &[usize],
    domain: &PeriodicBox,
    step: Step,
) -> Result<(Vec<[f64; 3]>, [f64; 6]), TooLarge> {
    let species: Vec<i32> = species.iter().map(|s| *s as i32).collect();
    let pairs = brute_force_pairs(fluid, x, &species, domain);
    let mut forces = vec![[0.0; 3]; x.len()];
    let mut output = ForceOutput {
        force: &mut forces,
        particle_energy: &mut [],
        particle_virial: &mut [],
        pair_force: &mut [],
        tally: Tally::default(),
    };
    let input = ForceInput {
        plan: &Plan::new(fluid)?.without_conservative_forces(),
        list: pairs.force(),
        newton: Newton::On,
        owned: x.len(),
        slopes: &[],
        v,
        tag,
        thermostat: Some((PairNoise::new(step.seed, step.number), 1.0 / step.dt.sqrt())),
        want: Want::TOTALS,
    };
    add_forces(&input, &mut output);
    let virial = output.tally.thermostat_virial;
    Ok((forces, virial))
}

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
    fn a_search_finds_what_brute_force_does() {
        for model in MODELS.into_iter().chain([STATED]) {
            let (evaluator, x, species, domain) = random(model, 11);
            let found = evaluator.evaluate(&x, &species, &domain);
            let indices: Vec<usize> = species.iter().map(|s| *s as usize).collect();
            let truth = evaluate(evaluator.fluid(), &x, &indices, &domain).unwrap();
            let energies = found.excess.iter().chain(&found.pair_energies).sum::<f64>();
            assert!((energies - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            let scale = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
            assert!((found.energy() - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            for (f, g) in found.forces.iter().flatten().zip(truth.forces.iter().flatten()) {
                assert!((f - g).abs() < 1e-11 * scale, "{f} {g}");
            }
            for (w, v) in found.virial.iter().zip(truth.virial) {
                assert!((w - v).abs() < 1e-10 * scale, "{w} {v}");
            }
        }
    }

    /// The Laplacian of U by the differences of forces.
    #[test]
    fn laplacians_are_divergences_of_forces() {
        for model in MODELS {
            let (evaluator, x, species, domain) = random(model, 12);
            let found = evaluator.evaluate(&x, &species, &domain).laplacians(evaluator.fluid(), &species);
            let dimensions = evaluator.fluid().dimensions;
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
