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
//! is one pass over the pairs.
//!
//! The residual `r` of an approximate solution is a polynomial `R` of the matrix times the right side. It changes the
//! temperature of a mode of drag `k`, in units of its mass, by the factor `(1 − R)/(1 + kR)`. Conjugate gradients make
//! residuals orthogonal, so that the mean over modes with the weight `k` is right to second order, but `R` is largest for
//! small `k`: slow flow would be too cold. The solution therefore ends with `δ + M⁻¹ r`, which costs no pass, and
//! whose residual is `−K M⁻¹ r`: the temperature of slow modes is then exact. The impulses are those of drag and noise at
//! `v + δ`, which the virial uses.
//!
//! Where drag is stronger than twice the inertia, `−K M⁻¹ r` would be larger than `r` and is not added. `R` at `k = 0` is
//! known from the coefficients of the iterations; they then go on until it is below 1 %.

use super::PairThermostat;
use super::noise_of;
use super::particle_loops::{Advance, Finish, Multiply, Share, Start};
use super::pass::{Sums, Wide, add_to_host, close, each_of_host};
use super::solution::{End, Move, Progress, Solution, TOLERANCE, TOLERANCE_OF_DRAG};
use crate::engine::sweep::Pool;
use crate::engine::vectors;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_threads::take;

impl PairThermostat {
    /// Does `work` for every plane; returns the sums of the scalar products, in the order of the planes.
    fn on_planes(
        &mut self,
        pool: &Pool,
        work: impl Fn(&mut Share, InstructionSet) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        let PairThermostat { planes, set, masses, sums, solution, .. } = self;
        let (Sums { p, all, .. }, Solution { change, residual, .. }) = (sums, solution);
        let mut rest = [&mut p[..], all, residual, change];
        let mut shares: Vec<(Share, [f64; 2])> = planes
            .iter()
            .map(|plane| {
                let own = plane.own.clone();
                let [p, image, residual, solution] = rest.each_mut().map(|rest| take(rest, own.len()));
                (Share { p, image, masses: &masses[own], residual, solution }, [0.0; 2])
            })
            .collect();
        pool.each(&mut shares, |(share, sums)| *sums = work(share, *set));
        shares.iter().fold([0.0; 2], |all, (_, sums)| [0, 1].map(|k| all[k] + sums[k]))
    }

    /// Applies the midpoint rule with noise, or without noise the implicit Euler rule of drag alone.
    pub(super) fn implicit(&mut self, pool: &Pool, v: &mut [[f64; 3]], noise: bool) -> [f64; 6] {
        let mut part = self.begin(pool, v, noise);
        loop {
            let sums = self.curvature(pool);
            if !self.advance(pool, [part, sums[0], sums[1]]) {
                break;
            }
            part = 0.0;
        }
        // The midpoint is half of the change away.
        let factor = if noise { 2.0 } else { 1.0 };
        let mut virial = [0.0; 6];
        if self.wants_middle() {
            // After the last iteration, `p` is δ without its residual.
            self.sums.add_of_host(pool, self.lists.order(), v);
            virial = self.virial_of_vectors(pool, v.len(), noise);
        }
        add_to_host(pool, &self.lists.place, &self.solution.change, factor, v);
        virial
    }

    /// Computes the first residual and direction from the velocities `v` of the host, and returns the
    /// square of the residual's norm. On several ranks all sums here are those of one rank.
    pub(super) fn begin(&mut self, pool: &Pool, v: &[[f64; 3]], noise: bool) -> f64 {
        let PairThermostat { planes, lists, labels, set, sums, solution, kt, .. } = self;
        let tolerance = if noise { TOLERANCE } else { TOLERANCE_OF_DRAG };
        solution.progress = Progress::new(tolerance);
        for vectors in [&mut solution.residual, &mut solution.change] {
            // Memory of others may be longer.
            vectors.resize(vectors.len().max(lists.order().len()), Wide::ZERO);
        }
        sums.gather(pool, lists.order(), v);
        let noise = if noise { noise_of(self.noise, labels, *kt) } else { None };
        sums.compute(pool, *set, planes, noise);
        let [first, _] = self.on_planes(pool, |share, set| [vectors::run(set, Start(share)), 0.0]);
        first
    }

    /// Computes the image of the direction, `A p` with `A = M + K`, and returns `p · A p` and
    /// `A p · M⁻¹ A p`.
    pub(super) fn curvature(&mut self, pool: &Pool) -> [f64; 2] {
        self.sums.compute(pool, self.set, &self.planes, None);
        self.on_planes(pool, |share, set| vectors::run(set, Multiply(share)))
    }

    /// Moves along the direction, and computes the next one; returns false after the last iteration. The totals are the
    /// squared norm of the first residual, which is read in the first iteration only, and the sums of
    /// [`PairThermostat::curvature`].
    pub(super) fn advance(&mut self, pool: &Pool, totals: [f64; 3]) -> bool {
        let progress = &mut self.solution.progress;
        let Move { alpha, beta, outcome } = progress.advance(totals);
        let is_first = progress.iterations == 1;
        let rest = if progress.adds_residual() { 1.0 } else { 0.0 };
        if let Some(end) = outcome {
            self.effort.add(self.iterations(), self.are_of_forces, end == End::Inaccurate);
        }
        self.on_planes(pool, |share, set| {
            match outcome {
                None => vectors::run(set, Advance { share, is_first, alpha, beta }),
                Some(_) => vectors::run(set, Finish { share, is_first, alpha, rest }),
            }
            [0.0; 2]
        });
        outcome.is_none()
    }

    /// Whether anything is computed from the velocities in the middle of the update.
    pub(super) fn wants_middle(&self) -> bool {
        self.kept.virial || self.kept.middle || self.on_fixed.is_asked
    }

    /// The virial of drag at the velocities that `p` has, and of noise, if it is requested; finds the forces on those of the first `owned`
    /// particles that have infinite mass too, if these are asked for.
    pub(super) fn virial_of_vectors(&mut self, pool: &Pool, owned: usize, noise: bool) -> [f64; 6] {
        close(&self.planes, &mut self.sums.p);
        let [drag, random] = if self.kept.virial { self.virials(pool, noise) } else { [[0.0; 6]; 2] };
        self.drag = drag;
        if noise {
            self.sum_forces_on_fixed(pool, owned);
        }
        std::array::from_fn(|c| drag[c] + random[c])
    }

    /// The virial of drag alone in the last midpoint update, if its virial was requested.
    pub fn drag_of_midpoint(&self) -> [f64; 6] {
        self.drag
    }

    /// Sets `v`, in the order of the host, to the velocities at which drag acted in the last midpoint update, which has kept them, or has
    /// computed its virial; those of particles that it left out stay.
    pub fn velocities_of_midpoint(&self, pool: &Pool, v: &mut [[f64; 3]]) {
        each_of_host(pool, &self.lists.place, &self.sums.p, v, |v, p| *v = [p[0], p[1], p[2]]);
    }
}
