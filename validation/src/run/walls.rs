//! Reflecting faces of a box.

use super::integrator::Motion;
use psidpd_core::engine::PeriodicBox;

/// The faces of the directions that are not periodic: a particle beyond one is put as far inside as it was
/// outside, and the component of its velocity across the face is reversed, as `fix wall/reflect` of LAMMPS
/// does. The box must be along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Walls {
    /// Lower and upper face of each direction that reflects.
    faces: [Option<[f64; 2]>; 3],
}

impl Walls {
    /// The walls of a box; the third direction of two-dimensional models has none.
    pub fn of(domain: &PeriodicBox, dimensions: usize) -> Walls {
        let (origin, lengths) = (domain.origin(), domain.lengths());
        let face =
            |k: usize| (k < dimensions && !domain.periodic()[k]).then(|| [origin[k], origin[k] + lengths[k]]);
        Walls { faces: [face(0), face(1), face(2)] }
    }

    /// Whether there is one.
    pub fn any(&self) -> bool {
        self.faces.iter().any(Option::is_some)
    }

    /// Reflects every particle that went through a face. What an integrator has kept of a particle's
    /// velocity and force turns round with it: its step began on the other side of the mirror.
    pub fn reflect(&self, motion: &mut Motion) {
        for (k, [low, high]) in self.faces.iter().enumerate().filter_map(|(k, f)| Some((k, (*f)?))) {
            for i in 0..motion.x.len() {
                let x = &mut motion.x[i][k];
                if *x < low {
                    *x = low + (low - *x);
                } else if *x > high {
                    *x = high - (*x - high);
                } else {
                    continue;
                }
                motion.v[i][k] = -motion.v[i][k];
                motion.before.turn(i, k);
            }
        }
    }

    /// The first particle that is outside all the same: it went further than across the box.
    pub fn escaped(&self, x: &[[f64; 3]]) -> Option<usize> {
        let outside = |x: &[f64; 3]| {
            (0..3).any(|k| self.faces[k].is_some_and(|[low, high]| !(low..=high).contains(&x[k])))
        };
        x.iter().position(outside)
    }
}
