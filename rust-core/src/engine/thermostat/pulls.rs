//! The forces of drag on each pair, for profiles of stress.
//!
//! The random force is left out: it is independent of the positions that it acts at, so that it
//! contributes only scatter to a mean.

use super::PairThermostat;
use crate::engine::sweep::Pool;

/// A pair and the mean force of drag on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// Index of the first particle.
    pub i: usize,
    /// Separation `r_i − r_j`.
    pub d: [f64; 3],
    /// The force on the first particle, divided by `d`.
    pub strength: f64,
}

/// The forces of drag on all pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct Pulls<T> {
    /// The virial `Σ r_ij ⊗ F_ij`: xx, yy, zz, xy, xz, yz.
    pub virial: [f64; 6],
    /// What is made of each pair, plane by plane; nothing if nothing was asked for.
    pub of_planes: Vec<Vec<T>>,
}

impl<T> Default for Pulls<T> {
    fn default() -> Pulls<T> {
        Pulls { virial: [0.0; 6], of_planes: Vec::new() }
    }
}

impl PairThermostat {
    /// Drag at the velocities `v`, in the particle order of the last search for pairs. Zero if distances were not stored.
    /// `make` is applied to each pair, if it is there. Results do not depend on the number of threads.
    pub fn drags<T: Send>(
        &self,
        pool: &Pool,
        v: &[[f64; 3]],
        make: Option<&(dyn Fn(Pull) -> T + Sync)>,
    ) -> Pulls<T> {
        let order = self.lists.order();
        let strength = |i: usize, j: usize, _: usize, _: usize, g: [f64; 3]| {
            let (a, b) = (v[order[i] as usize], v[order[j] as usize]);
            let along: f64 = (0..3).map(|c| g[c] * (a[c] - b[c])).sum();
            -2.0 / self.dt * along
        };
        self.pulls_by(pool, strength, make)
    }

    /// The impulses of the last sequential update, without the noise of each pair itself, as forces
    /// over its time. Zero if distances were not stored. `make` is as in [`PairThermostat::drags`].
    pub fn pulls<T: Send>(&self, pool: &Pool, make: Option<&(dyn Fn(Pull) -> T + Sync)>) -> Pulls<T> {
        self.pulls_by(pool, |_, _, plane, k, _| self.impulses[plane][k] / self.dt, make)
    }

    /// Computes pulls from `strength`, the factor of `g`, which takes the two sorted particles, the
    /// plane, the pair in it, and `g`.
    fn pulls_by<T: Send>(
        &self,
        pool: &Pool,
        strength: impl Fn(usize, usize, usize, usize, [f64; 3]) -> f64 + Sync,
        make: Option<&(dyn Fn(Pull) -> T + Sync)>,
    ) -> Pulls<T> {
        self.assert_pairs();
        let order = self.lists.order();
        let mut work: Vec<_> =
            self.planes.iter().enumerate().map(|plane| (plane, [0.0; 6], Vec::new())).collect();
        pool.each(&mut work, |((number, plane), virial, made)| {
            let list = &plane.lists.own;
            if list.stretch.is_empty() {
                return;
            }
            made.reserve(if make.is_some() { list.count() } else { 0 });
            for [i, j, k] in plane.pairs() {
                let (stretch, g) = (list.stretch[k], list.g(k));
                let strength = strength(i, j, *number, k, g) / stretch;
                let d @ [x, y, z] = g.map(|g| stretch * g);
                let dyad = [x * x, y * y, z * z, x * y, x * z, y * z];
                virial.iter_mut().zip(dyad).for_each(|(sum, term)| *sum += strength * term);
                if let Some(make) = make {
                    made.push(make(Pull { i: order[i] as usize, d, strength }));
                }
            }
        });
        let mut pulls = Pulls::default();
        for (_, virial, made) in work {
            (0..6).for_each(|c| pulls.virial[c] += virial[c]);
            if make.is_some() {
                pulls.of_planes.push(made);
            }
        }
        pulls
    }
}
