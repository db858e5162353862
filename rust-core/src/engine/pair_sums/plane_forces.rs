//! Pairs of particles in single precision with their conservative forces, which lines of stress follow from.

use super::free_energy::Psi;
use super::in_box::Pair;
use super::pair_block::PairBlock;
use super::pairs::BLOCK;
use crate::engine::sweep::PlaneTerms;
use crate::engine::vectors::{Loop, run_best};
use crate::model::Fluid;
use psidpd_passes::plane::laplacians::PairTerms;

/// The largest slope of ψ here: it may be infinite if no particle is in range, and its product with the weight 0 of a pair should be 0.
const MOST: f64 = 1e30;

/// The pairs of a plane of cells with their forces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlaneForces {
    pub(super) terms: PlaneTerms,
    /// The force on the first particle of each pair, divided by the separation.
    strengths: Vec<f32>,
}

impl PlaneForces {
    /// Computes the forces `−Σ_v (ψ_i,v + ψ_j,v) w′ − φ′` of the pairs.
    pub fn find(&mut self, fluid: &Fluid, species: &[i32], psi: &Psi) {
        let (kinds, variables) = (fluid.species.len(), fluid.variables());
        let PlaneForces { terms: PlaneTerms { hosts, pairs }, strengths } = self;
        let of_plane = |of: &dyn Fn(usize) -> f64| -> Vec<f32> {
            hosts.iter().map(|k| of(*k as usize).clamp(-MOST, MOST) as f32).collect()
        };
        strengths.clear();
        strengths.extend(pairs.potential.iter().map(|potential| -potential));
        for v in 0..variables {
            // What particles of a species feel of a neighbour of another.
            let (density, of) = (v / kinds, v % kinds);
            let slopes = of_plane(&|k| psi.slopes[k * variables + v]);
            let is_of = (kinds > 1).then(|| of_plane(&|k| f64::from(u8::from(species[k] as usize == of))));
            run_best(Subtract { pairs, density, slopes: &slopes, is_of: is_of.as_deref(), strengths });
        }
    }

    /// The number of pairs.
    pub fn len(&self) -> usize {
        self.strengths.len()
    }

    /// The pairs in blocks.
    pub fn blocks(&self) -> impl Iterator<Item = PairBlock<'_, f32>> {
        let PlaneForces { terms: PlaneTerms { hosts, pairs }, strengths } = self;
        let PairTerms { particles, d, .. } = pairs;
        PairBlock::all(hosts, particles.each_ref().map(|of| &of[..]), d.each_ref().map(|d| &d[..]), strengths)
    }

    /// Calls `visit` with the pairs within `range`. Particles have the indices of the host.
    pub fn for_each_pair(&self, range: f64, mut visit: impl FnMut(Pair)) {
        let mut squares = [0.0; BLOCK];
        for block in self.blocks() {
            run_best(Squares { d: block.d, squares: &mut squares });
            for ((k, [i, j]), square) in block.particles().enumerate().zip(&squares) {
                if f64::from(*square) < range * range {
                    let d = block.d.map(|d| f64::from(d[k]));
                    visit(Pair { i, j, d, r: f64::from(*square).sqrt() });
                }
            }
        }
    }
}

/// Squares of the distances of a block of pairs.
struct Squares<'a> {
    d: [&'a [f32]; 3],
    squares: &'a mut [f32; BLOCK],
}

impl Loop for Squares<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Squares { d: [x, y, z], squares } = self;
        for (((x, y), z), square) in x.iter().zip(y).zip(z).zip(squares) {
            *square = x * x + y * y + z * z;
        }
    }
}

/// Subtracts the part of one variable of ψ from the forces of pairs.
struct Subtract<'a> {
    pairs: &'a PairTerms,
    density: usize,
    /// The derivative of ψ of each particle of the plane by the variable.
    slopes: &'a [f32],
    /// Whether it is a density of the species of the particle; all are without it.
    is_of: Option<&'a [f32]>,
    strengths: &'a mut [f32],
}

impl Loop for Subtract<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Subtract { pairs, density, slopes, is_of, strengths } = self;
        let PairTerms { particles: [i, j], weights, .. } = pairs;
        let of_pairs = strengths.iter_mut().zip(&weights[density]).zip(i.iter().zip(j));
        for ((strength, weight), (i, j)) in of_pairs {
            let (i, j) = (*i as usize, *j as usize);
            let [of_i, of_j] = is_of.map_or([1.0; 2], |is_of| [is_of[j], is_of[i]]);
            *strength -= (slopes[i] * of_i + slopes[j] * of_j) * weight;
        }
    }
}
