//! Energies and conservative pair forces of one configuration.
//!
//! Forces are those of `engine::reference`:
//! `F_ij = −[∂ψ_i/∂n_c(j) + ∂ψ_j/∂n_c(i)] w′ − φ′` along `ê_ij = (r_i − r_j)/r_ij`.

use super::interactions::{Interactions, Psi, kernel_second, pair_second};
use super::pairs::{Pair, for_each_pair};
use psidpd_core::engine::PeriodicBox;
use psidpd_core::model::pair::PairForm;

/// One configuration under the conservative interactions of a fluid.
#[derive(Debug, Clone)]
pub struct Landscape {
    /// Pairs in the range of the interactions.
    pub pairs: Vec<Pair>,
    /// The force of each pair along `ê_ij`: positive pushes the particles apart.
    pub pair_forces: Vec<f64>,
    /// Uncorrected densities of each particle, one for each density and species, density-major.
    pub densities: Vec<f64>,
    /// ψ of each particle with its derivatives.
    pub psi: Vec<Psi>,
    /// `Σ ψ` of the particles of each species.
    pub excess: Vec<f64>,
    /// `Σ φ` of each pair term of the model.
    pub pair_energies: Vec<f64>,
}

impl Landscape {
    /// Evaluates particles at `x`, in the box along its periodic directions.
    pub fn new(
        interactions: &Interactions,
        x: &[[f64; 3]],
        species: &[i32],
        domain: &PeriodicBox,
    ) -> Landscape {
        let fluid = interactions.fluid();
        let (count, variables) = (fluid.species.len(), fluid.variables());
        let of = |i: usize| species[i] as usize;
        let mut pairs = Vec::new();
        for_each_pair(x, domain, fluid.dimensions, interactions.range(), |p| pairs.push(p));
        let mut densities = vec![0.0; x.len() * variables];
        for (d, density) in fluid.densities.iter().enumerate() {
            for p in &pairs {
                let w = density.kernel.value(p.r);
                densities[p.i * variables + d * count + of(p.j)] += w;
                densities[p.j * variables + d * count + of(p.i)] += w;
            }
            if density.includes_self {
                let w = density.kernel.value(0.0);
                (0..x.len()).for_each(|i| densities[i * variables + d * count + of(i)] += w);
            }
        }
        let mut excess = vec![0.0; count];
        let mut psi = Vec::with_capacity(x.len());
        for i in 0..x.len() {
            let here = interactions.psi(of(i), &densities[i * variables..(i + 1) * variables]);
            excess[of(i)] += here.value;
            psi.push(here);
        }
        let mut pair_energies = vec![0.0; fluid.pairs.len()];
        let pair_forces = pairs
            .iter()
            .map(|p| {
                let (a, b) = (of(p.i), of(p.j));
                let mut force = 0.0;
                for (d, density) in fluid.densities.iter().enumerate() {
                    let slope = psi[p.i].slopes[d * count + b] + psi[p.j].slopes[d * count + a];
                    force -= slope * density.force_kernel.slope(p.r);
                }
                for (term, energy) in fluid.pairs.iter().zip(&mut pair_energies) {
                    if acts(term.between, a, b) && p.r < term.potential.range() {
                        let (phi, slope) = term.potential.at(p.r);
                        *energy += phi;
                        force -= slope;
                    }
                }
                force
            })
            .collect();
        Landscape { pairs, pair_forces, densities, psi, excess, pair_energies }
    }

    /// `U`.
    pub fn energy(&self) -> f64 {
        self.excess.iter().sum::<f64>() + self.pair_energies.iter().sum::<f64>()
    }

    /// The pairs with their force along `ê_ij`; pairs on one point have no direction and are left out.
    pub fn forces(&self) -> impl Iterator<Item = (&Pair, f64)> {
        self.pairs.iter().zip(self.pair_forces.iter().copied()).filter(|(p, _)| p.r > 0.0)
    }

    /// `Σ r_ij ⊗ F_ij`: xx, yy, zz, xy, xz, yz.
    pub fn virial(&self) -> [f64; 6] {
        let mut virial = [0.0; 6];
        for (p, force) in self.forces() {
            for (w, (a, b)) in virial.iter_mut().zip(COMPONENTS) {
                *w += force * p.d[a] * p.d[b] / p.r;
            }
        }
        virial
    }

    /// The force on each particle.
    pub fn particle_forces(&self) -> Vec<[f64; 3]> {
        let mut forces = vec![[0.0; 3]; self.psi.len()];
        for (p, force) in self.forces() {
            for c in 0..3 {
                let f = force * p.d[c] / p.r;
                forces[p.i][c] += f;
                forces[p.j][c] -= f;
            }
        }
        forces
    }

    /// `∇_k² U` of each particle `k`, minus the divergence of its force:
    ///
    /// ```text
    /// Σ_i [ψ_i,vu ∇_k n_iv·∇_k n_iu + ψ_i,v ∇_k² n_iv] + Σ_j ∇² φ(r_kj)
    /// ```
    ///
    /// exact where no two particles see each other twice, in boxes at least twice the range wide.
    pub fn laplacians(&self, interactions: &Interactions, species: &[i32]) -> Vec<f64> {
        let fluid = interactions.fluid();
        let (count, variables) = (fluid.species.len(), fluid.variables());
        let rest = (fluid.dimensions - 1) as f64;
        let mut sum = vec![0.0; self.psi.len()];
        // ∇_i n_iv
        let mut gradients = vec![[0.0; 3]; self.psi.len() * variables];
        let mut slope = vec![0.0; fluid.densities.len()];
        for p in self.pairs.iter().filter(|p| p.r > 0.0 && p.i != p.j) {
            let (a, b) = (species[p.i] as usize, species[p.j] as usize);
            let mut both = 0.0;
            for (d, density) in fluid.densities.iter().enumerate() {
                slope[d] = density.kernel.slope(p.r);
                for c in 0..3 {
                    gradients[p.i * variables + d * count + b][c] += slope[d] * p.d[c] / p.r;
                    gradients[p.j * variables + d * count + a][c] -= slope[d] * p.d[c] / p.r;
                }
                let laplacian = kernel_second(&density.kernel, p.r) + rest * slope[d] / p.r;
                both +=
                    (self.psi[p.i].slopes[d * count + b] + self.psi[p.j].slopes[d * count + a]) * laplacian;
            }
            for term in &fluid.pairs {
                if acts(term.between, a, b) && p.r < term.potential.range() {
                    both += pair_second(&term.potential, p.r) + rest * term.potential.at(p.r).1 / p.r;
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

fn acts(between: [usize; 2], a: usize, b: usize) -> bool {
    between == [a, b] || between == [b, a]
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::reference;
    use psidpd_core::model::Model;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

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
        include_str!("../../models/warren2003-set6.toml"),
        include_str!("../../models/huggins.toml"),
        include_str!("../../models/binary-2d.toml"),
        include_str!("../../models/spline-attractive.toml"),
    ];

    fn random(model: &str, seed: u64) -> (Interactions, Vec<[f64; 3]>, Vec<i32>, PeriodicBox) {
        let fluid = Model::parse("m.toml", model).unwrap().at(1.0).unwrap();
        let flat = fluid.dimensions == 2;
        let domain = PeriodicBox::orthogonal(
            [0.0, 0.0, if flat { -0.5 } else { 0.0 }],
            [3.0, 3.2, if flat { 1.0 } else { 2.9 }],
            [true; 3],
        )
        .unwrap();
        let mut rng = StdRng::seed_from_u64(seed);
        let x = (0..90)
            .map(|_| {
                let mut p = domain.point(std::array::from_fn(|_| rng.random::<f64>()));
                if flat {
                    p[2] = 0.0;
                }
                p
            })
            .collect();
        let species = (0..90).map(|k| k % fluid.species.len() as i32).collect();
        (Interactions::new(fluid).unwrap(), x, species, domain)
    }

    #[test]
    fn energies_forces_and_virials_are_those_of_the_reference() {
        for model in MODELS.into_iter().chain([STATED]) {
            let (interactions, x, species, domain) = random(model, 11);
            let found = Landscape::new(&interactions, &x, &species, &domain);
            let indices: Vec<usize> = species.iter().map(|s| *s as usize).collect();
            let truth = reference::evaluate(interactions.fluid(), &x, &indices, &domain).unwrap();
            let scale = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
            assert!((found.energy() - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            for (f, g) in found.particle_forces().iter().flatten().zip(truth.forces.iter().flatten()) {
                assert!((f - g).abs() < 1e-11 * scale, "{f} {g}");
            }
            for (w, v) in found.virial().iter().zip(truth.virial) {
                assert!((w - v).abs() < 1e-10 * scale, "{w} {v}");
            }
        }
    }

    /// The Laplacian of U by the differences of forces.
    #[test]
    fn laplacians_are_divergences_of_forces() {
        for model in MODELS {
            let (interactions, x, species, domain) = random(model, 12);
            let landscape = Landscape::new(&interactions, &x, &species, &domain);
            let found = landscape.laplacians(&interactions, &species);
            let dimensions = interactions.fluid().dimensions;
            for k in [0, 17, 44] {
                let h = 1e-6;
                let mut divergence = 0.0;
                for c in 0..dimensions {
                    let force = |h: f64| {
                        let mut x = x.clone();
                        x[k][c] += h;
                        let mut image = [0; 3];
                        domain.wrap(&mut x[k], &mut image);
                        Landscape::new(&interactions, &x, &species, &domain).particle_forces()[k][c]
                    };
                    divergence += (force(h) - force(-h)) / (2.0 * h);
                }
                let scale = divergence.abs().max(1.0);
                assert!((found[k] + divergence).abs() < 2e-5 * scale, "{} {divergence}", found[k]);
            }
        }
    }
}
