//! The forces of drag on each pair, for profiles of stress.
//!
//! The random force is left out: it is independent of the positions that it acts at, so that it
//! contributes only scatter to a mean.

use super::PairThermostat;

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

impl PairThermostat {
    /// Drag at the velocities `v`, in the particle order of the last search for pairs. Empty if distances were not stored.
    pub fn drags(&self, v: &[[f64; 3]]) -> Vec<Pull> {
        let order = self.lists.order();
        self.pulls_by(|i, j, _, _, g| {
            let (a, b) = (v[order[i] as usize], v[order[j] as usize]);
            let along: f64 = (0..3).map(|c| g[c] * (a[c] - b[c])).sum();
            -2.0 / self.dt * along
        })
    }

    /// The impulses of the last sequential update, without the noise of each pair itself, as forces
    /// over its time. Empty if distances were not stored.
    pub fn pulls(&self) -> Vec<Pull> {
        self.pulls_by(|_, _, plane, k, _| self.impulses[plane][k] / self.dt)
    }

    /// Computes pulls from `strength`, the factor of `g`, which takes the two sorted particles, the
    /// plane, the pair in it, and `g`.
    fn pulls_by(&self, strength: impl Fn(usize, usize, usize, usize, [f64; 3]) -> f64) -> Vec<Pull> {
        self.assert_pairs();
        let mut pulls = Vec::new();
        let order = self.lists.order();
        for (number, plane) in self.planes.iter().enumerate() {
            let list = &plane.lists.own;
            if list.stretch.is_empty() {
                continue;
            }
            for [i, j, k] in plane.pairs() {
                let (stretch, g) = (list.stretch[k], list.g(k));
                let strength = strength(i, j, number, k, g) / stretch;
                pulls.push(Pull { i: order[i] as usize, d: g.map(|g| stretch * g), strength });
            }
        }
        pulls
    }
}
