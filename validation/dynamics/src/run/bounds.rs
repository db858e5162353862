//! The region in which a particle needs neither wrapping nor reflection, and the faces around it.

use psidpd_core::engine::{PeriodicBox, Place, faces};
use psidpd_core::model::wall::WallField;

/// The inside of a box: the coordinates that [`PeriodicBox::wrap`] does not change along periodic directions,
/// and those between walls along the others.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bounds {
    /// The lowest and the highest coordinate inside. A tilted box has no such interval, so none of its
    /// coordinates count as inside.
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// The directions with reflecting faces, which are those that are not periodic. The box must have edges along the axes.
    walls: [bool; 3],
    /// Cylinders and spheres of matter.
    pub rounds: Surfaces,
}

/// The round surfaces of walls in a box, with the numbers of the walls.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces(Vec<(usize, Place)>);

/// Number of floating-point numbers below the upper face that are tried.
const TRIES: usize = 64;

impl Bounds {
    /// The bounds of a box; the third direction of two-dimensional models has no walls.
    pub fn of(domain: &PeriodicBox, dimensions: usize) -> Bounds {
        let mut bounds = Bounds {
            low: [f64::NEG_INFINITY; 3],
            high: [f64::INFINITY; 3],
            walls: [false; 3],
            rounds: Surfaces::default(),
        };
        let (origin, lengths) = (domain.origin(), domain.lengths());
        let edges = [0, 1, 2].map(|k| domain.edge(k));
        let leans = (0..3).any(|k| (0..3).any(|c| c != k && edges[k][c] != 0.0));
        for k in 0..3 {
            if domain.periodic()[k] {
                (bounds.low[k], bounds.high[k]) = match leans {
                    true => (f64::INFINITY, f64::NEG_INFINITY),
                    false => (origin[k], last_inside(domain, k, origin[k] + edges[k][k])),
                };
            } else if k < dimensions {
                bounds.walls[k] = true;
                (bounds.low[k], bounds.high[k]) = (origin[k], origin[k] + lengths[k]);
            }
        }
        bounds
    }

    pub fn has_walls(&self) -> bool {
        self.walls.contains(&true) || !self.rounds.is_empty()
    }

    /// The directions with reflecting faces.
    pub fn walls(&self) -> impl Iterator<Item = usize> {
        (0..3).filter(|k| self.walls[*k])
    }

    /// Whether a place is beyond a face.
    pub fn has_escaped(&self, x: &[f64; 3]) -> bool {
        self.walls().any(|k| !(self.low[k]..=self.high[k]).contains(&x[k])) || self.rounds.is_in_matter(x)
    }

    /// Mirrors a coordinate beyond a face to the inside, at the faces in turn.
    pub fn fold(&self, k: usize, x: f64) -> f64 {
        let (low, length) = (self.low[k], self.high[k] - self.low[k]);
        let s = (x - low).rem_euclid(2.0 * length);
        low + s.min(2.0 * length - s)
    }
}

impl Surfaces {
    /// Those of `walls`.
    pub fn of(walls: &[WallField], domain: &PeriodicBox) -> Surfaces {
        let all = faces(walls, domain, 3).into_iter().map(|face| (face.index, face.place));
        Surfaces(all.filter(|(_, place)| matches!(place, Place::Round { .. })).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn iter(&self) -> impl Iterator<Item = (usize, &Place)> {
        self.0.iter().map(|(wall, place)| (*wall, place))
    }

    /// Whether a place is in the matter of a round wall.
    pub fn is_in_matter(&self, x: &[f64; 3]) -> bool {
        self.0.iter().any(|(_, place)| place.is_in_matter(x))
    }

    /// Mirrors a place in the matter of a round wall at its surface.
    pub fn mirror(&self, x: &mut [f64; 3]) {
        self.0.iter().for_each(|(_, place)| place.mirror(x));
    }
}

/// The highest coordinate, not above `end`, whose fraction of an edge is below 1; the box has edges along the axes.
/// Rounding decides which coordinate that is. Rounding preserves order, so all lower coordinates are inside too.
fn last_inside(domain: &PeriodicBox, k: usize, mut end: f64) -> f64 {
    let mut point = domain.origin();
    for _ in 0..TRIES {
        point[k] = end;
        if domain.fraction(point)[k] < 1.0 {
            return end;
        }
        end = end.next_down();
    }
    f64::NEG_INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{Integrator, Simulation, State};
    use crate::tests::support::IDEAL;
    use nalgebra::Matrix3;
    use psidpd_core::engine::Want;
    use psidpd_core::model::Model;

    #[test]
    fn inside_is_where_nothing_is_wrapped() {
        for (origin, length) in
            [(0.0, 10.0), (-3.7, 7.3), (1e6, 0.3), (-1e-9, 1.0 / 3.0), (0.0, 6050.0f64.cbrt())]
        {
            let domain = PeriodicBox::orthogonal([origin; 3], [length; 3], [true; 3]).unwrap();
            let bounds = Bounds::of(&domain, 3);
            for k in 0..3 {
                let wraps = |c: f64| {
                    let (mut x, mut image) = ([origin; 3], [0; 3]);
                    x[k] = c;
                    domain.wrap(&mut x, &mut image);
                    image != [0; 3]
                };
                assert!((bounds.high[k] - origin - length).abs() < 1e-9 * length.max(origin.abs()));
                assert!(!wraps(bounds.low[k]) && !wraps(bounds.high[k]), "{origin} {length}");
                assert!(wraps(bounds.high[k].next_up()) && wraps(bounds.low[k] - 1e-3 * length));
            }
        }
    }

    #[test]
    fn open_directions_have_no_end_and_boxes_that_lean_no_inside() {
        let domain = PeriodicBox::orthogonal([1.0; 3], [2.0; 3], [true, false, false]).unwrap();
        let bounds = Bounds::of(&domain, 2);
        assert_eq!(
            (bounds.low, bounds.high[1..].to_vec()),
            ([1.0, 1.0, f64::NEG_INFINITY], vec![3.0, f64::INFINITY])
        );
        let edges = Matrix3::new(4.0, 1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 6.0);
        let bounds = Bounds::of(&PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap(), 3);
        assert!((0..3).all(|k| bounds.low[k] > bounds.high[k]));
    }

    fn state(periodic: [bool; 3], count: usize) -> State {
        // Fractional parts of multiples of irrational numbers give points and velocities without a pattern.
        let irrational = [2f64.sqrt(), 3f64.sqrt(), 5f64.sqrt(), 7f64.sqrt(), 11f64.sqrt(), 13f64.sqrt()];
        let part = |k: usize, c: usize| (k as f64 * irrational[c]).fract();
        let domain = PeriodicBox::orthogonal([-1.0, 0.0, 2.0], [3.0, 4.0, 5.0], periodic).unwrap();
        let point = |k| [3.0 * part(k, 0) - 1.0, 4.0 * part(k, 1), 2.0 + 5.0 * part(k, 2)];
        let v = (0..count).map(|k| std::array::from_fn(|c| 4.0 * part(k, 3 + c) - 2.0)).collect();
        State { v, ..State::at_rest(domain, vec![1.0], (0..count).map(point).collect()) }
    }

    /// A free particle between two walls follows the triangle wave, the folded path of a particle without walls.
    #[test]
    fn free_particles_bounce_to_and_fro() {
        let start = state([false, true, false], 200);
        let model = Model::parse("m", IDEAL).unwrap();
        for (_, integrator) in Integrator::ALL {
            let mut run = Simulation::new(&model, 1.0, start.clone(), 1).unwrap();
            run.set_thermostat(false);
            run.prepare(0.01, Want::FORCES).unwrap();
            run.advance(700, 0.01, integrator).unwrap();
            let fold = |x: f64, low: f64, length: f64| {
                let s = ((x - low) / length).rem_euclid(2.0);
                (low + length * if s > 1.0 { 2.0 - s } else { s }, if s > 1.0 { -1.0 } else { 1.0 })
            };
            for k in 0..200 {
                for (c, low, length) in [(0, -1.0, 3.0), (2, 2.0, 5.0)] {
                    let (x, sign) = fold(start.x[k][c] + 7.0 * start.v[k][c], low, length);
                    assert!((run.state().x[k][c] - x).abs() < 1e-9, "{k} {c}");
                    assert!((run.state().v[k][c] - sign * start.v[k][c]).abs() < 1e-12);
                }
            }
            // Momentum is conserved along y alone, and each direction has its share of the degrees of freedom.
            assert_eq!(run.degrees_of_freedom(), 599);
        }
    }

    #[test]
    fn what_starts_beyond_a_wall_or_crosses_the_box_is_an_error() {
        let model = Model::parse("m", IDEAL).unwrap();
        let mut beyond = state([true, false, true], 5);
        beyond.x[3][1] = 4.1;
        let error = Simulation::new(&model, 1.0, beyond, 1).unwrap_err().to_string();
        assert!(error.contains("particle 4 is beyond a wall"), "{error}");
        let mut fast = state([false, true, true], 5);
        fast.v[2] = [650.0, 0.0, 0.0];
        let mut run = Simulation::new(&model, 1.0, fast, 1).unwrap();
        run.set_thermostat(false);
        run.prepare(0.01, Want::FORCES).unwrap();
        let error = run.step(0.01, Integrator::VelocityVerlet, Want::FORCES).unwrap_err().to_string();
        assert!(error.contains("particle 3 moved 6.5"), "{error}");
    }
}
