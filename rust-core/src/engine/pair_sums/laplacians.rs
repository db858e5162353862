//! Second derivatives of the energy by the positions of particles.

use super::closed_forms::add_laplacians;
use super::evaluation::Evaluation;
use super::free_energy::Psi;
use super::plane_list::{BLOCK, PlaneList, merge};
use crate::engine::sweep::Pool;
use crate::engine::vectors::{Loop, run_best};
use crate::model::Fluid;
use crate::model::kernel::{Kernel, Shape, ShapeVisitor};
use crate::model::pair::PairForm;
use std::ops::Range;

impl Evaluation {
    /// `∇_k² U` of each particle `k`, minus the divergence of its force:
    ///
    /// ```text
    /// Σ_i [ψ_i,vu ∇_k n_iv·∇_k n_iu + ψ_i,v ∇_k² n_iv] + Σ_j ∇² φ(r_kj)
    /// ```
    ///
    /// The result is exact where each two particles form one pair, in boxes at least twice the range wide.
    pub fn laplacians(&self, pool: &Pool, fluid: &Fluid) -> Vec<f64> {
        let (variables, count) = (fluid.variables(), self.psi.value.len());
        let width = 1 + 3 * variables;
        let mut work: Vec<(&PlaneList, Vec<f64>)> =
            self.planes.iter().map(|plane| (plane, Vec::new())).collect();
        pool.each(&mut work, |(plane, sums)| *sums = second_derivatives(plane, fluid, &self.psi));
        let parts = work.iter().map(|(plane, sums)| (&plane.hosts[..], &sums[..]));
        let mut sums = merge(parts, count, width);
        self.add_walls(fluid, &mut sums);
        let of_particle = |k: usize| {
            let (sum, gradients) =
                (sums[k * width], sums[k * width + 1..][..3 * variables].as_chunks::<3>().0);
            let second = &self.psi.second[k * variables * variables..][..variables * variables];
            let own = gradients.iter().zip(second.chunks_exact(variables.max(1))).map(|(g, row)| {
                let along = gradients.iter().zip(row);
                along.map(|(h, second)| second * (g[0] * h[0] + g[1] * h[1] + g[2] * h[2])).sum::<f64>()
            });
            sum + own.sum::<f64>()
        };
        (0..count).map(of_particle).collect()
    }
}

impl Evaluation {
    /// Adds the second derivatives by walls, and the gradients of their densities.
    fn add_walls(&self, fluid: &Fluid, sums: &mut [f64]) {
        let (variables, kinds) = (fluid.variables(), fluid.species.len());
        for near in &self.near_walls {
            let wall = &fluid.walls[near.wall];
            let (row, z) = (near.particle * (1 + 3 * variables), near.distance);
            let field = &wall.fields[near.species];
            // ∇²H = H″ + H′ ∇·n.
            let divergence = wall.wall.surface.divergence(z);
            for (d, density) in &field.densities {
                let [_, slope, curvature] = density.at(z);
                let v = d * kinds + wall.wall.species;
                let laplacian = curvature + divergence * slope;
                sums[row] += times(self.psi.slopes[near.particle * variables + v], laplacian);
                (0..3).for_each(|c| sums[row + 1 + 3 * v + c] += slope * near.normal[c]);
            }
            for [_, slope, curvature] in field.energies.iter().map(|energy| energy.at(z)) {
                sums[row] += curvature + divergence * slope;
            }
        }
    }
}

/// For each particle of a plane the part of its pairs in `∇² U`, followed by the gradients `∇_i n_iv` of its densities.
fn second_derivatives(plane: &PlaneList, fluid: &Fluid, psi: &Psi) -> Vec<f64> {
    let (count, variables, densities) = (fluid.species.len(), fluid.variables(), fluid.densities.len());
    let (list, width) = (&plane.list, 1 + 3 * variables);
    let mut sums = vec![0.0; plane.hosts.len() * width];
    let mut slopes = vec![[0.0; BLOCK]; densities];
    let mut laplacians = vec![[0.0; BLOCK]; densities];
    for from in (0..list.len()).step_by(BLOCK) {
        let pairs = from..(from + BLOCK).min(list.len());
        let r = &list.r[pairs.clone()];
        for (d, density) in fluid.densities.iter().enumerate() {
            let (slope, laplacian) = (&mut slopes[d][..r.len()], &mut laplacians[d][..r.len()]);
            let rest = (fluid.dimensions - 1) as f64;
            density.kernel.kind().visit(Derivatives { kernel: &density.kernel, r, rest, slope, laplacian });
        }
        let of_pairs = potential_laplacians(plane, fluid, pairs.clone());
        for (k, of_pair) in pairs.clone().zip(of_pairs) {
            let (i, j, r) = (list.i[k] as usize, list.j[k] as usize, list.r[k]);
            if r == 0.0 || i == j {
                continue;
            }
            let [here, there] = [i, j].map(|k| plane.hosts[k] as usize * variables);
            let (a, b) = (list.species_i[k] as usize, list.species_j[k] as usize);
            let (mut of_i, mut of_j) = (of_pair, of_pair);
            for d in 0..densities {
                let slope = slopes[d][k - from];
                let (at_i, at_j) = (d * count + b, d * count + a);
                let per_length = slope / r;
                for c in 0..3 {
                    let gradient = per_length * list.d[c][k];
                    sums[i * width + 1 + 3 * at_i + c] += gradient;
                    sums[j * width + 1 + 3 * at_j + c] -= gradient;
                }
                let laplacian = laplacians[d][k - from];
                let both = times(psi.slopes[here + at_i] + psi.slopes[there + at_j], laplacian);
                of_i += both;
                of_j += both;
                // Second derivatives of ψ of each particle when the other moves.
                for e in 0..densities {
                    let product = slope * slopes[e][k - from];
                    of_j += times(psi.second[(here + at_i) * variables + e * count + b], product);
                    of_i += times(psi.second[(there + at_j) * variables + e * count + a], product);
                }
            }
            sums[i * width] += of_i;
            sums[j * width] += of_j;
        }
    }
    sums
}

/// The product of a derivative of ψ, which may be infinite if no particle is in range, with a derivative of the weight of a pair.
#[inline(always)]
fn times(of_psi: f64, of_weight: f64) -> f64 {
    let product = of_psi * of_weight;
    if of_weight == 0.0 { 0.0 } else { product }
}

/// `∇² φ` of the pairs of a block, summed over the pair terms of a fluid.
fn potential_laplacians(plane: &PlaneList, fluid: &Fluid, pairs: Range<usize>) -> [f64; BLOCK] {
    let (list, rest) = (&plane.list, (fluid.dimensions - 1) as f64);
    let mut sums = [0.0; BLOCK];
    let (mut r, mut phi, mut slope, mut place) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK], [0; BLOCK]);
    for term in &fluid.pairs {
        if add_laplacians(term, list, &pairs, rest, &mut sums[..pairs.len()]) {
            continue;
        }
        let mut count = 0;
        for k in pairs.clone() {
            let acts = term.acts(list.species_i[k] as usize, list.species_j[k] as usize, list.r[k]);
            (r[count], place[count]) = (list.r[k], k - pairs.start);
            count += usize::from(acts && list.r[k] > 0.0);
        }
        let r = &r[..count];
        term.potential.block(r, &mut phi[..count], &mut slope[..count]);
        for ((r, slope), place) in r.iter().zip(&slope).zip(&place) {
            sums[*place] += term.potential.curvature(*r) + rest * slope / r;
        }
    }
    sums
}

/// The slopes `w′` and the Laplacians `w″ + (d − 1) w′/r` of a kernel in a block of pairs; 0 beyond its range.
struct Derivatives<'a> {
    kernel: &'a Kernel,
    r: &'a [f64],
    /// The number of dimensions less one.
    rest: f64,
    slope: &'a mut [f64],
    laplacian: &'a mut [f64],
}

impl ShapeVisitor for Derivatives<'_> {
    type Output = ();

    fn visit<S: Shape>(self) {
        run_best(OfShape(self, S::default()));
    }
}

struct OfShape<'a, S>(Derivatives<'a>, S);

impl<S: Shape> Loop for OfShape<'_, S> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Derivatives { kernel, r, rest, slope, laplacian } = self.0;
        let inverse_range = 1.0 / kernel.range();
        let (first, second) = (kernel.slope_factor(), kernel.slope_factor() * inverse_range);
        for ((r, slope), laplacian) in r.iter().zip(slope).zip(laplacian) {
            let s = r * inverse_range;
            let here = if s < 1.0 { first * S::slope(s) } else { 0.0 };
            let curvature = if s < 1.0 { second * S::curvature(s) } else { 0.0 };
            *slope = here;
            *laplacian = if s < 1.0 { curvature + rest * here / r } else { 0.0 };
        }
    }
}
