//! Second derivatives of the energy by the positions of particles.

use super::closed_forms::add_laplacians;
use super::evaluation::Evaluation;
use super::free_energy::{Psi, times};
use super::pairs::{BLOCK, in_turns};
use super::plane_list::{PlaneList, merge};
use crate::engine::sweep::Pool;
use crate::engine::vectors::{Loop, run_best};
use crate::model::Fluid;
use crate::model::kernel::{Kernel, Shape, ShapeVisitor};
use crate::model::pair::PairForm;
use std::ops::Range;

/// The largest derivatives of ψ here: it may be infinite if no particle is in range, and its product with the weight 0 of a pair should be 0.
const MOST: f64 = 1e300;

/// A vector and a part of `∇² U` of a particle: the force and `∇² φ`, or the gradient of a density and what comes with its weights.
type Row = [f64; 4];

impl Evaluation {
    /// The forces on all particles, and for each particle `k` minus the divergence of its force:
    ///
    /// ```text
    /// ∇_k² U = Σ_i [ψ_i,vu ∇_k n_iv·∇_k n_iu + ψ_i,v ∇_k² n_iv] + Σ_j ∇² φ(r_kj)
    /// ```
    ///
    /// The result is exact where each two particles form one pair, in boxes at least twice the range wide.
    pub fn forces_and_laplacians(&self, pool: &Pool, fluid: &Fluid) -> (Vec<[f64; 3]>, Vec<f64>) {
        let (variables, kinds, count) = (fluid.variables(), fluid.species.len(), self.psi.value.len());
        let mut work: Vec<(&PlaneList, Sums)> =
            self.planes.iter().map(|plane| (plane, Sums::default())).collect();
        pool.each(&mut work, |(plane, sums)| *sums = second_derivatives(plane, fluid, &self.psi));
        let rows = |of: &dyn Fn(&Sums) -> &[Row], width: usize| {
            let parts = work.iter().map(|(plane, sums)| (&plane.hosts[..], of(sums).as_flattened()));
            merge(parts, count, 4 * width)
        };
        let mut own = rows(&|sums| &sums.own, 1);
        let own = own.as_chunks_mut::<4>().0;
        let mut gradients: Vec<Vec<f64>> =
            (0..fluid.densities.len()).map(|d| rows(&|sums| &sums.gradients[d], kinds)).collect();
        self.add_walls(fluid, own, &mut gradients);
        let of_particle = |k: usize| {
            let second = &self.psi.second[k * variables * variables..][..variables * variables];
            let gradient = |v: usize| &gradients[v / kinds][4 * (k * kinds + v % kinds)..][..3];
            let product = |v: usize, u: usize| -> f64 {
                let along = gradient(v).iter().zip(gradient(u)).map(|(g, h)| g * h);
                times(second[v * variables + u], along.sum::<f64>())
            };
            let by_psi = (0..variables).map(|v| (0..variables).map(|u| product(v, u)).sum::<f64>());
            let by_weights = gradients.iter().flat_map(|of| &of.as_chunks::<4>().0[k * kinds..][..kinds]);
            let laplacian = own[k][3] + by_weights.map(|row| row[3]).sum::<f64>() + by_psi.sum::<f64>();
            ([own[k][0], own[k][1], own[k][2]], laplacian)
        };
        (0..count).map(of_particle).unzip()
    }

    /// The first of [`Evaluation::forces_and_laplacians`].
    pub fn forces(&self, pool: &Pool, fluid: &Fluid) -> Vec<[f64; 3]> {
        self.forces_and_laplacians(pool, fluid).0
    }

    /// The second of [`Evaluation::forces_and_laplacians`].
    pub fn laplacians(&self, pool: &Pool, fluid: &Fluid) -> Vec<f64> {
        self.forces_and_laplacians(pool, fluid).1
    }

    /// Adds the forces of walls with their divergences, and the gradients of the densities of walls.
    fn add_walls(&self, fluid: &Fluid, own: &mut [Row], gradients: &mut [Vec<f64>]) {
        let (variables, kinds) = (fluid.variables(), fluid.species.len());
        for near in &self.near_walls {
            let wall = &fluid.walls[near.wall];
            let (field, z, force) = (&wall.fields[near.species], near.distance, near.force());
            let own = &mut own[near.particle];
            (0..3).for_each(|c| own[c] += force[c]);
            // ∇²H = H″ + H′ ∇·n.
            let divergence = wall.wall.surface.divergence(z);
            for (d, density) in &field.densities {
                let [_, slope, curvature] = density.at(z);
                let species = wall.wall.species;
                let laplacian = curvature + divergence * slope;
                own[3] += times(self.psi.slopes[near.particle * variables + d * kinds + species], laplacian);
                let gradient = &mut gradients[*d][4 * (near.particle * kinds + species)..][..3];
                (0..3).for_each(|c| gradient[c] += slope * near.normal[c]);
            }
            for [_, slope, curvature] in field.energies.iter().map(|energy| energy.at(z)) {
                own[3] += curvature + divergence * slope;
            }
        }
    }
}

/// What the pairs of a plane add to its particles.
#[derive(Default)]
struct Sums {
    /// The force, and `∇² φ`.
    own: Vec<Row>,
    /// For each density the gradients `∇_i n_iv`, one for each species, and the terms with `w″` and `w′ w′`.
    gradients: Vec<Vec<Row>>,
}

/// Sums over the pairs of a plane.
fn second_derivatives(plane: &PlaneList, fluid: &Fluid, psi: &Psi) -> Sums {
    let (kinds, variables, densities) = (fluid.species.len(), fluid.variables(), fluid.densities.len());
    // Of the particles of the plane, one for each species.
    let of_plane = |of: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        let finite = |k: u32, b| of(k as usize, b).clamp(-MOST, MOST);
        plane.hosts.iter().flat_map(|k| (0..kinds).map(move |b| finite(*k, b))).collect()
    };
    let slope = |d: usize| of_plane(&|k, b| psi.slopes[k * variables + d * kinds + b]);
    let second = |d: usize, e: usize| {
        of_plane(&|k, b| psi.second[(k * variables + d * kinds + b) * variables + e * kinds + b])
    };
    let first: Vec<Vec<f64>> = (0..densities).map(slope).collect();
    let second: Vec<Vec<Vec<f64>>> =
        (0..densities).map(|d| (0..densities).map(|e| second(d, e)).collect()).collect();
    let particles = plane.hosts.len();
    let mut sums = Sums {
        own: vec![[0.0; 4]; particles],
        gradients: vec![vec![[0.0; 4]; particles * kinds]; densities],
    };
    let mut weights = vec![Weights::default(); densities];
    let count = plane.list.len();
    for pairs in (0..count).step_by(BLOCK).map(|from| from..(from + BLOCK).min(count)) {
        for (density, weights) in fluid.densities.iter().zip(&mut weights) {
            let (r, rest) = (&plane.list.r[pairs.clone()], (fluid.dimensions - 1) as f64);
            density.kernel.kind().visit(Derivatives { kernel: &density.kernel, r, rest, weights });
        }
        let potential = potential_laplacians(plane, fluid, pairs.clone());
        let psi = (&first[..], &second[..]);
        run_best(OfBlock { plane, pairs, kinds, psi, weights: &weights, potential, sums: &mut sums });
    }
    sums
}

/// Adds the pairs of a block to the sums of both particles.
struct OfBlock<'a> {
    plane: &'a PlaneList,
    pairs: Range<usize>,
    kinds: usize,
    /// First derivatives of ψ by each density, and second ones by each two, for each particle of the plane and each species; finite.
    psi: (&'a [Vec<f64>], &'a [Vec<Vec<f64>>]),
    weights: &'a [Weights],
    /// `∇² φ`.
    potential: [f64; BLOCK],
    sums: &'a mut Sums,
}

impl Loop for OfBlock<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let OfBlock { plane, pairs, kinds, psi: (first, second), weights, potential, sums } = self;
        let list = &plane.list;
        let [i, j] = [&list.i, &list.j].map(|of| &of[pairs.clone()]);
        let [a, b] = [&list.species_i, &list.species_j].map(|of| &of[pairs.clone()]);
        let [x, y, z] = list.d.each_ref().map(|d| &d[pairs.clone()]);
        let strengths = &plane.strengths[pairs.clone()];
        let count = pairs.len().min(BLOCK);
        // What each particle has for the other's species.
        let (mut here, mut there) = ([0; BLOCK], [0; BLOCK]);
        for k in 0..count {
            here[k] = i[k] as usize * kinds + usize::from(b[k]);
            there[k] = j[k] as usize * kinds + usize::from(a[k]);
        }
        for k in in_turns(count).filter(|k| i[*k] != j[*k]) {
            let force = [strengths[k] * x[k], strengths[k] * y[k], strengths[k] * z[k]];
            add_to_both(&mut sums.own, [i[k] as usize, j[k] as usize], force, [potential[k]; 2]);
        }
        for (d, (weight, gradients)) in weights.iter().zip(&mut sums.gradients).enumerate() {
            let (mut of_i, mut of_j) = ([0.0; BLOCK], [0.0; BLOCK]);
            for k in 0..count {
                of_i[k] = (first[d][here[k]] + first[d][there[k]]) * weight.laplacian[k];
                of_j[k] = of_i[k];
            }
            // Second derivatives of ψ of each particle when the other moves.
            for (other, second) in weights.iter().zip(&second[d]) {
                for k in 0..count {
                    let product = weight.slope[k] * other.slope[k];
                    of_i[k] += second[there[k]] * product;
                    of_j[k] += second[here[k]] * product;
                }
            }
            for k in in_turns(count).filter(|k| i[*k] != j[*k]) {
                let of = weight.per_length[k];
                add_to_both(
                    gradients,
                    [here[k], there[k]],
                    [of * x[k], of * y[k], of * z[k]],
                    [of_i[k], of_j[k]],
                );
            }
        }
    }
}

/// Adds a vector to one row, subtracts it from another, and adds a scalar to each.
#[inline(always)]
fn add_to_both(rows: &mut [Row], [i, j]: [usize; 2], [x, y, z]: [f64; 3], [to_i, to_j]: [f64; 2]) {
    rows[i].iter_mut().zip([x, y, z, to_i]).for_each(|(to, add)| *to += add);
    rows[j].iter_mut().zip([x, y, z, -to_j]).for_each(|(to, add)| *to -= add);
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

/// Derivatives of the weights of the pairs of a block in a density; 0 beyond its range and at zero distance. Behind the last pair they are
/// unspecified.
#[derive(Clone)]
struct Weights {
    /// `w′`
    slope: [f64; BLOCK],
    /// `w′/r`
    per_length: [f64; BLOCK],
    /// `w″ + (d − 1) w′/r`
    laplacian: [f64; BLOCK],
}

impl Default for Weights {
    fn default() -> Weights {
        Weights { slope: [0.0; BLOCK], per_length: [0.0; BLOCK], laplacian: [0.0; BLOCK] }
    }
}

/// Computes [`Weights`] at distances `r`.
struct Derivatives<'a> {
    kernel: &'a Kernel,
    r: &'a [f64],
    /// The number of dimensions less one.
    rest: f64,
    weights: &'a mut Weights,
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
        let Derivatives { kernel, r, rest, weights: Weights { slope, per_length, laplacian } } = self.0;
        let inverse_range = 1.0 / kernel.range();
        let (first, second) = (kernel.slope_factor(), kernel.slope_factor() * inverse_range);
        for (((r, slope), per_length), laplacian) in r.iter().zip(slope).zip(per_length).zip(laplacian) {
            let s = r * inverse_range;
            let is_near = (s < 1.0) & (*r > 0.0);
            let (here, bend) = (first * S::slope(s), second * S::curvature(s));
            *slope = if is_near { here } else { 0.0 };
            *per_length = if is_near { here / r } else { 0.0 };
            *laplacian = if is_near { bend + rest * here / r } else { 0.0 };
        }
    }
}
