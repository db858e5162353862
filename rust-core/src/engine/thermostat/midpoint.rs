//! Updates all pairs at once, by conjugate gradients.
//!
//! With `(G v)_i = Σ_j D (ê·v_ij) ê` and `(B ξ)_i = Σ_j √(2kTγ) w_R ξ ê`, the implicit midpoint rule is
//!
//! ```text
//! (M + ½ΔtG) v′ = (M − ½ΔtG) v + √Δt B ξ.
//! ```
//!
//! As `⟨Bξ ξᵀBᵀ⟩ = 2kT G`, the rule maps the covariance `kT M⁻¹` to itself: with normal ξ it preserves
//! the Maxwell distribution exactly at any Δt, γ and mass, and with any other ξ of unit variance the
//! covariance. Momentum is conserved to rounding, and the result does not depend on an order of pairs.
//!
//! The equation to solve is `(M + K) δ = √kT Σ ξ g − K v` with `K = ½ΔtG`, and `v′ = v + 2δ`. The
//! matrix is symmetric and positive, with a condition number of at most `1 + 2ΔtΣD/m`: each iteration
//! is one pass over the pairs. Iterations end when the residual, in the norm of M⁻¹, is below
//! [`TOLERANCE`] times the first. Residuals of conjugate gradients are orthogonal to all earlier search
//! directions, so that the error of the temperature is of the order of the square of that.

use super::PairThermostat;
use super::part::Part;
use super::particle_loops::{Descend, Direct, Multiply};
use super::pass::{Terms, Wide, add_to_host, virial};
use super::planes::Plane;
use crate::engine::sweep::Pool;
use crate::engine::vectors;
use std::ops::Range;

/// Relative residual at which iterations end.
pub const TOLERANCE: f64 = 1e-4;

/// Most iterations: with more, drag is so strong that rounding errors stop the convergence.
const MOST: usize = 500;

/// The data of one plane during a step of the solver.
struct Share<'a> {
    number: usize,
    own: Range<usize>,
    p: &'a [Wide],
    part: &'a mut Part,
}

/// Does `work` for every plane; returns the sum of the scalar products, in the order of the planes.
fn each(
    pool: &Pool,
    planes: &[Plane],
    p: &[Wide],
    parts: &mut [Part],
    work: impl Fn(&mut Share) + Sync,
) -> f64 {
    let share = |((number, plane), part): ((usize, &Plane), _)| {
        let own = plane.found.own.clone();
        Share { number, p: &p[own.clone()], own, part }
    };
    let mut shares: Vec<Share> = planes.iter().enumerate().zip(parts).map(share).collect();
    pool.each(&mut shares, work);
    shares.iter().map(|share| share.part.sum).sum()
}

impl PairThermostat {
    /// Applies the midpoint rule with noise, or without noise the implicit Euler rule of drag alone.
    pub(super) fn implicit(&mut self, pool: &Pool, v: &mut [[f64; 3]], noise: bool) -> [f64; 6] {
        let first = self.begin(pool, v, noise);
        self.direct(pool, 0.0);
        let mut now = first;
        while self.goes_on(now, first) {
            let curvature = self.curvature(pool);
            let next = self.descend(pool, now / curvature);
            self.direct(pool, next / now);
            now = next;
        }
        self.add_solution(pool, v);
        let virial = if self.wants_virial { self.virial_at(pool, v, noise) } else { [0.0; 6] };
        // The midpoint is half of the change away.
        if noise {
            self.add_solution(pool, v);
        }
        virial
    }

    /// Computes the first residual from the velocities `v` of the host, and returns the square of its
    /// norm. On several ranks all sums here are those of one rank.
    pub(super) fn begin(&mut self, pool: &Pool, v: &[[f64; 3]], noise: bool) -> f64 {
        let PairThermostat { planes, lists, set, inverse_mass, sums, parts, kt, iterations, .. } = self;
        *iterations = 0;
        parts.resize_with(planes.len(), Part::default);
        let start = Terms { noise: if noise { kt.sqrt() } else { 0.0 }, drag: 1.0 };
        sums.gather(lists.order(), v);
        sums.compute(pool, *set, planes, start);
        each(pool, planes, &sums.p, parts, |Share { number, own, part, .. }| {
            part.residual.clear();
            part.residual.extend(sums.of(planes, *number));
            part.solution.clear();
            part.solution.resize(own.len(), [0.0; 4]);
            let inverse_mass = &inverse_mass[own.clone()];
            part.sum = part.residual.iter().zip(inverse_mass).map(|(r, inverse)| dot(r, r) * inverse).sum();
        })
    }

    /// Whether another iteration follows, given the squared norms of the residual, `now` and `first`.
    pub(super) fn goes_on(&self, now: f64, first: f64) -> bool {
        now > TOLERANCE * TOLERANCE * first && self.iterations < MOST
    }

    /// Multiplies the direction by the matrix, and returns the scalar product of the two.
    pub(super) fn curvature(&mut self, pool: &Pool) -> f64 {
        let PairThermostat { planes, set, mass, sums, parts, iterations, .. } = self;
        *iterations += 1;
        sums.compute(pool, *set, planes, Terms { noise: 0.0, drag: -1.0 });
        each(pool, planes, &sums.p, parts, |Share { number, own: range, p, part }| {
            let [own, below] = sums.halves(planes, *number);
            let mass = &mass[range.clone()];
            part.sum = vectors::run(*set, Multiply { p, mass, own, below, image: &mut part.image });
        })
    }

    /// Moves by `alpha` along the direction, and returns the squared norm of the new residual.
    pub(super) fn descend(&mut self, pool: &Pool, alpha: f64) -> f64 {
        let PairThermostat { planes, set, inverse_mass, sums, parts, .. } = self;
        each(pool, planes, &sums.p, parts, |Share { own, p, part, .. }| {
            let Part { image, residual, solution, sum } = &mut **part;
            let inverse_mass = &inverse_mass[own.clone()];
            *sum = vectors::run(*set, Descend { alpha, p, inverse_mass, image, solution, residual });
        })
    }

    /// Computes the next direction, `p ← M⁻¹ r + beta p`.
    pub(super) fn direct(&mut self, pool: &Pool, beta: f64) {
        let PairThermostat { planes, set, inverse_mass, sums, parts, .. } = self;
        let mut shares: Vec<_> = sums
            .of_planes(planes)
            .into_iter()
            .zip(planes.iter().zip(parts))
            .map(|(p, (plane, part))| (p, &inverse_mass[plane.found.own.clone()], &part.residual[..]))
            .collect();
        pool.each(&mut shares, |(p, inverse_mass, residual)| {
            vectors::run(*set, Direct { beta, inverse_mass, residual, p });
        });
    }

    /// Adds δ to the velocities `v`.
    pub(super) fn add_solution(&mut self, pool: &Pool, v: &mut [[f64; 3]]) {
        let PairThermostat { planes, lists, sums, parts, .. } = self;
        for (p, part) in sums.of_planes(planes).iter_mut().zip(parts) {
            p.copy_from_slice(&part.solution);
        }
        add_to_host(pool, lists.place(), &sums.p, 1.0, v);
    }

    /// The virial of drag at the velocities `v`, and of noise.
    pub(super) fn virial_at(&mut self, pool: &Pool, v: &[[f64; 3]], noise: bool) -> [f64; 6] {
        let PairThermostat { planes, lists, sums, kt, dt, .. } = self;
        let scale = 2.0 / *dt;
        let noise = if noise { scale * kt.sqrt() } else { 0.0 };
        sums.gather(lists.order(), v);
        sums.close(planes);
        virial(pool, planes, sums, lists.ghosts(), Terms { noise, drag: scale })
    }
}

fn dot(a: &Wide, b: &Wide) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
