use super::mean_field::add_symmetric;
use super::search::spaced;
use super::{MeanField, TheoryError};
use crate::model::Fluid;
use crate::model::pair::PairForm;
use nalgebra::{DMatrix, DVector};
use std::fmt;

/// An arrangement that puts more and more particles into the same volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Structure {
    /// The particles are spread evenly.
    Uniform,
    /// The particles are on the sites of a simple cubic (square in two dimensions) lattice, any number on each.
    Cubic {
        /// Distance of nearest neighbours.
        spacing: f64,
    },
    /// The particles are on the sites of a body-centred cubic lattice.
    BodyCentred {
        /// Distance of nearest neighbours.
        spacing: f64,
    },
    /// The particles are on the sites of a close-packed (face-centred cubic; triangular in two dimensions) lattice.
    ClosePacked {
        /// Distance of nearest neighbours.
        spacing: f64,
    },
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Structure::Uniform => write!(f, "spread evenly"),
            Structure::Cubic { spacing } => write!(f, "on a simple cubic lattice of spacing {spacing:.4}"),
            Structure::BodyCentred { spacing } => {
                write!(f, "on a body-centred cubic lattice of spacing {spacing:.4}")
            }
            Structure::ClosePacked { spacing } => {
                write!(f, "on a close-packed lattice of spacing {spacing:.4}")
            }
        }
    }
}

/// The error of a fluid without thermodynamic limit: its energy per particle falls without bound as
/// more particles are put into the same volume, at least in this arrangement.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "no thermodynamic limit: with its particles {structure}, and fractions {composition:?} of its species, the energy \
     per particle falls without bound as the density grows (it is {energy:.3e} at a density of {density:.3e}; that of \
     pairs is {pair:.4e} times the density)"
)]
pub struct NoLimit {
    /// Fractions of the species.
    pub composition: Vec<f64>,
    /// The arrangement of the particles.
    pub structure: Structure,
    /// `½ Σ_αβ x_α x_β [φ_αβ]` for the uniform structure; in general the pair energy per particle and
    /// unit of density (uniform) or particle on a site.
    pub pair: f64,
    /// The density (particles on a site) up to which the energy was followed.
    pub density: f64,
    /// Energy per particle at this density.
    pub energy: f64,
}

/// Searches for a collapse: arrangements in which the energy per particle `Σ_α x_α ψ_α + ½ n Σ_αβ x_α x_β
/// [φ_αβ]` goes to minus infinity with the density `n`, faster than a logarithm. Such a fluid has no
/// thermodynamic limit (D. Ruelle, *Statistical Mechanics*, sec. 3.2; for soft potentials A. A. Louis et al.,
/// Phys. Rev. E 62, 7961 (2000)), and its simulation eventually collapses. `∫φ < 0` is the plainest case; a ψ
/// that grows faster than `n`, or that becomes infinite at a finite density, prevents the collapse.
///
/// The search covers the uniform fluid and lattices whose sites take any number of particles, at 60
/// spacings up to the range of the potentials, each in many compositions, including all at which the
/// pair energy has a minimum: an exact test of copositivity of the pair energies. With more than eight
/// species it covers 12 spacings and mixtures of two or of all species. The growth of ψ is judged
/// numerically, from its values up to `1e8` particles in the volume of the interaction.
///
/// The test is necessary, not sufficient: `Ok` means that none of these arrangements collapses, not that none
/// exists, and says nothing about time scales. With lattices it does find potentials of positive integral
/// that still have an unbounded arrangement. Beyond the bounds of a density ψ is continued as in a run.
///
/// # Errors
/// Fails as [`MeanField::new`]; the inner result is the answer.
pub fn thermodynamic_limit(fluid: &Fluid) -> Result<Result<(), NoLimit>, TheoryError> {
    let theory = MeanField::new(fluid)?;
    let search = Search { fluid, theory: &theory };
    Ok(search.run().map_or(Ok(()), Err))
}

impl NoLimit {
    /// Whether the uniform fluid collapses, which happens at once. A collapse onto a lattice only may
    /// need nucleation at a density that no simulation of the fluid reaches.
    pub fn is_uniform(&self) -> bool {
        self.structure == Structure::Uniform
    }
}

/// Up to this number of species all mixtures are tried.
const FEW_SPECIES: usize = 8;

struct Search<'a> {
    fluid: &'a Fluid,
    theory: &'a MeanField,
}

/// Lattice sums, or integrals.
struct Sums {
    /// Sum `Σ_R φ_αβ(R)`, including `R = 0`.
    pairs: Vec<f64>,
    /// Sum `Σ_R |φ_αβ(R)|`, to distinguish zero from rounding.
    size: f64,
    /// Sum `Σ_R w_d(R)`.
    densities: Vec<f64>,
}

impl Search<'_> {
    fn run(&self) -> Option<NoLimit> {
        let theory = self.theory;
        // A φ that is infinite at r = 0 keeps particles apart: no site takes two.
        let soft = self.fluid.pairs.iter().all(|p| p.potential.at(0.0).0.is_finite());
        let uniform = Sums {
            pairs: theory.pair_integrals.to_vec(),
            size: theory.pair_integrals.iter().map(|x| x.abs()).sum::<f64>().max(self.absolute_integral()),
            densities: vec![1.0; self.fluid.densities.len()],
        };
        let unit = theory.ranges[0].powi(-(theory.dimensions as i32));
        if let Some(found) = self.collapse(Structure::Uniform, &uniform, unit) {
            return Some(found);
        }
        if !soft {
            return None;
        }
        let longest = theory.ranges[0];
        let spacings = if self.fluid.species.len() <= FEW_SPECIES { 60 } else { 12 };
        for spacing in spaced(0.2 * longest, longest, spacings) {
            let structures = match theory.dimensions {
                2 => vec![Structure::Cubic { spacing }, Structure::ClosePacked { spacing }],
                _ => vec![
                    Structure::Cubic { spacing },
                    Structure::BodyCentred { spacing },
                    Structure::ClosePacked { spacing },
                ],
            };
            for structure in structures {
                if let Some(found) = self.collapse(structure, &self.lattice_sums(structure), 1.0) {
                    return Some(found);
                }
            }
        }
        None
    }

    /// The sum `Σ ∫|φ|`, in comparison with which an integral of a potential may be small.
    fn absolute_integral(&self) -> f64 {
        let d = self.theory.dimensions as i32;
        let terms =
            self.fluid.pairs.iter().map(|p| p.potential.at(0.0).0.abs() * p.potential.range().powi(d));
        terms.filter(|x| x.is_finite()).sum()
    }

    fn lattice_sums(&self, structure: Structure) -> Sums {
        let count = self.fluid.species.len();
        let mut sums = Sums {
            pairs: vec![0.0; count * count],
            size: 0.0,
            densities: vec![0.0; self.fluid.densities.len()],
        };
        for r in distances(structure, self.theory.dimensions, self.theory.ranges[0]) {
            for pair in self.fluid.pairs.iter().filter(|p| r < p.potential.range()) {
                let phi = pair.potential.at(r).0;
                add_symmetric(&mut sums.pairs, count, pair.between, phi);
                sums.size += phi.abs();
            }
            for (sum, density) in sums.densities.iter_mut().zip(&self.fluid.densities) {
                *sum += density.kernel.value(r);
            }
        }
        sums
    }

    /// Whether the energy falls without bound in some composition.
    fn collapse(&self, structure: Structure, sums: &Sums, unit: f64) -> Option<NoLimit> {
        let count = self.fluid.species.len();
        compositions(&sums.pairs, count).into_iter().find_map(|x| {
            let mut pair = 0.0;
            for a in 0..count {
                (0..count).for_each(|b| pair += 0.5 * x[a] * x[b] * sums.pairs[a * count + b]);
            }
            if pair.abs() < 1e-12 * sums.size {
                pair = 0.0;
            }
            let energy = |n: f64| {
                let variables: Vec<f64> =
                    sums.densities.iter().flat_map(|w| x.iter().map(move |x| x * w * n)).collect();
                let many: f64 = (0..count)
                    .filter(|a| x[*a] > 0.0)
                    .map(|a| x[a] * self.theory.free_energy.value(a, &variables))
                    .sum();
                many + pair * n
            };
            falls_without_bound(&energy, unit).map(|(density, energy)| NoLimit {
                composition: x.clone(),
                structure,
                pair,
                density,
                energy,
            })
        })
    }
}

/// Whether `energy(n)` goes to −∞; returns the last density tried, and the energy there.
fn falls_without_bound(energy: &dyn Fn(f64) -> f64, unit: f64) -> Option<(f64, f64)> {
    let mut last = (0.0, 0.0);
    for step in 0..=32 {
        let n = unit * 10f64.powf(0.25 * f64::from(step));
        let e = energy(n);
        if e == f64::NEG_INFINITY {
            return Some((n, e));
        }
        if !e.is_finite() {
            // ψ limits the density. The result depends on the energy on the way to this limit.
            let edge = super::search::turning_point(last.0, n, |n| energy(n).is_finite());
            let [far, near] = [1e-6, 1e-12].map(|h| energy(edge * (1.0 - h)));
            let falls = near < far && near - far < -1e3 * (1.0 + far.abs());
            return falls.then_some((edge, near));
        }
        last = (n, e);
    }
    let (n, e) = last;
    // The energy is a power of n: a logarithm would grow by a twentieth here.
    let before = energy(n / 10.0);
    (e < 0.0 && e < 1.5 * before && e < before).then_some((n, e))
}

/// Compositions to try: those where `Σ x_a x_b φ_ab` is stationary on the simplex or on one of its
/// faces, so that its minimum over all compositions is among them, and a grid for the many-body part.
fn compositions(pairs: &[f64], count: usize) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = Vec::new();
    let few = count <= FEW_SPECIES;
    // Each face is the list of its species.
    let faces: Vec<Vec<usize>> = if few {
        (1usize..1 << count).map(|mask| (0..count).filter(|s| mask >> s & 1 == 1).collect()).collect()
    } else {
        let mut faces: Vec<Vec<usize>> = (0..count).map(|a| vec![a]).collect();
        faces.extend((0..count).flat_map(|a| (0..a).map(move |b| vec![b, a])));
        faces.push((0..count).collect());
        faces
    };
    for face in &faces {
        let size = face.len();
        all.push((0..count).map(|s| if face.contains(&s) { 1.0 / size as f64 } else { 0.0 }).collect());
        if size == 2 && few {
            for part in 1..20 {
                let mut x = vec![0.0; count];
                x[face[0]] = f64::from(part) / 20.0;
                x[face[1]] = 1.0 - x[face[0]];
                all.push(x);
            }
        }
        let matrix = DMatrix::from_fn(size, size, |i, j| pairs[face[i] * count + face[j]]);
        let Some(y) = matrix.lu().solve(&DVector::from_element(size, 1.0)) else { continue };
        let total = y.sum();
        if total.is_finite() && total != 0.0 && y.iter().all(|y| y / total > 0.0) {
            let mut x = vec![0.0; count];
            face.iter().zip(y.iter()).for_each(|(s, y)| x[*s] = y / total);
            all.push(x);
        }
    }
    all
}

/// Distances from one site to all sites closer than `range`, including itself.
fn distances(structure: Structure, dimensions: usize, range: f64) -> Vec<f64> {
    let (basis, edge): (&[[f64; 3]], [f64; 3]) = match structure {
        Structure::Uniform => return Vec::new(),
        Structure::Cubic { spacing } => (&[[0.0; 3]], [spacing; 3]),
        Structure::BodyCentred { spacing } => {
            (&[[0.0; 3], [0.5, 0.5, 0.5]], [spacing * 2.0 / 3f64.sqrt(); 3])
        }
        Structure::ClosePacked { spacing } if dimensions == 2 => {
            (&[[0.0; 3], [0.5, 0.5, 0.0]], [spacing, spacing * 3f64.sqrt(), 0.0])
        }
        Structure::ClosePacked { spacing } => {
            (&[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]], [spacing * 2f64.sqrt(); 3])
        }
    };
    let reach = |axis: usize| {
        if axis >= dimensions { 0 } else { (range / edge[axis]).ceil() as i32 + 1 }
    };
    let mut all = Vec::new();
    for i in -reach(0)..=reach(0) {
        for j in -reach(1)..=reach(1) {
            for k in -reach(2)..=reach(2) {
                for shift in basis {
                    let cell = [i, j, k];
                    let square: f64 =
                        (0..dimensions).map(|a| ((f64::from(cell[a]) + shift[a]) * edge[a]).powi(2)).sum();
                    if square < range * range {
                        all.push(square.sqrt());
                    }
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers have as many digits as a reader needs.
    #[test]
    fn the_message_has_short_numbers() {
        let limit = NoLimit {
            composition: vec![1.0],
            structure: Structure::Cubic { spacing: 1.0 / 3.0 },
            pair: -261799387.79914954,
            density: 1e8,
            energy: -2.618e16,
        };
        assert_eq!(
            limit.to_string(),
            "no thermodynamic limit: with its particles on a simple cubic lattice of spacing 0.3333, and fractions [1.0] of \
             its species, the energy per particle falls without bound as the density grows (it is -2.618e16 at a density of \
             1.000e8; that of pairs is -2.6180e8 times the density)"
        );
    }
}
