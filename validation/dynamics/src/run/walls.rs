//! Reflecting faces of a box.

use psidpd_core::engine::PeriodicBox;

/// The faces of the directions that are not periodic. A particle beyond a face is mirrored to the inside, and
/// the component of its velocity across the face is reversed, as in LAMMPS's `fix wall/reflect`. The box must
/// have edges along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Walls {
    /// Lower and upper face of each reflecting direction.
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

    pub fn any(&self) -> bool {
        self.faces.iter().any(Option::is_some)
    }

    pub fn faces(&self) -> [Option<[f64; 2]>; 3] {
        self.faces
    }

    /// Reflects a particle that crossed a face, and calls `turn` with each reversed direction. Velocities and
    /// forces that an integrator has kept must be reversed too: its step began on the other side of the mirror.
    pub fn reflect(&self, x: &mut [f64; 3], mut turn: impl FnMut(usize)) {
        for (k, [low, high]) in self.faces.iter().enumerate().filter_map(|(k, f)| Some((k, (*f)?))) {
            if x[k] < low {
                x[k] = low + (low - x[k]);
            } else if x[k] > high {
                x[k] = high - (x[k] - high);
            } else {
                continue;
            }
            turn(k);
        }
    }

    /// Whether a particle is outside even after reflection, because it moved further than across the box.
    pub fn has_escaped(&self, x: &[f64; 3]) -> bool {
        (0..3).any(|k| self.faces[k].is_some_and(|[low, high]| !(low..=high).contains(&x[k])))
    }
}

#[cfg(test)]
mod tests {
    use crate::run::{Integrator, Simulation, State};
    use crate::test_support::{IDEAL, SOFT};
    use psidpd_core::engine::{PeriodicBox, Want};
    use psidpd_core::model::Model;

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
                    assert!((run.positions()[k][c] - x).abs() < 1e-9, "{k} {c}");
                    assert!((run.velocities()[k][c] - sign * start.v[k][c]).abs() < 1e-12);
                }
            }
            // Momentum is conserved along y alone, and each direction has its share of the degrees of freedom.
            assert_eq!(run.degrees_of_freedom(), 599);
        }
    }

    /// Walls do no work in the limit of short steps. Energy is conserved to first order only: the force
    /// across a face changes sign at the reflection, and a step does not resolve the time of the reflection.
    #[test]
    fn energy_is_kept_between_walls() {
        let model = Model::parse("m", SOFT).unwrap();
        let deviation = |dt: f64| {
            let mut run = Simulation::new(&model, 1.0, state([false; 3], 180), 1).unwrap();
            run.set_thermostat(false);
            run.prepare(dt, Want::TOTALS).unwrap();
            let energy = |run: &Simulation| run.potential_energy() + run.kinetic_energy();
            let first = energy(&run);
            let steps = (2.0 / dt).round() as usize;
            let squares: f64 = (0..steps)
                .map(|_| {
                    run.step(dt, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
                    (energy(&run) - first).powi(2)
                })
                .sum();
            (squares / steps as f64).sqrt() / 180.0
        };
        let [coarse, fine] = [0.01, 0.0025].map(deviation);
        assert!(coarse < 0.03 && fine < coarse / 2.5, "{coarse} {fine}");
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
