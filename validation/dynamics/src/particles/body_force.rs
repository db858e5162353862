//! Accelerations of single particles.

use super::tags::Tags;
use psidpd_core::engine::PeriodicBox;
use psidpd_observe::Drive;

/// A constant acceleration of some of the particles, as by gravity. Reversed in the upper half of the box along
/// one direction, it drives two opposite Poiseuille flows (Backer et al., J. Chem. Phys. 122, 154503 (2005)).
#[derive(Debug, Clone, PartialEq)]
pub struct BodyForce {
    /// The acceleration; the force is the mass times the acceleration.
    pub acceleration: [f64; 3],
    /// Direction along which the upper half of the box has the opposite acceleration.
    pub reversed_along: Option<usize>,
    /// The species it acts on; empty for all species.
    pub species: Vec<i32>,
    /// The particles of these species that it acts on.
    pub tags: Tags,
}

impl BodyForce {
    pub fn acts_on(&self, species: i32, tag: i32) -> bool {
        (self.species.is_empty() || self.species.contains(&species)) && self.tags.contain(tag)
    }

    /// The flow that the force drives, if it is reversed, along one direction and acts on every particle.
    pub fn drive(&self) -> Option<Drive> {
        let across = self.reversed_along?;
        let mut directions = (0..3).filter(|k| self.acceleration[*k] != 0.0);
        let (along, more) = (directions.next()?, directions.next());
        let all = self.species.is_empty() && self.tags == Tags::All && more.is_none();
        all.then_some(Drive { across, along, acceleration: self.acceleration[along] })
    }

    pub fn at(&self, domain: &PeriodicBox, x: [f64; 3]) -> [f64; 3] {
        match self.reversed_along {
            Some(k) if domain.fraction(x)[k] >= 0.5 => self.acceleration.map(|a| -a),
            _ => self.acceleration,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::run::{Integrator, Simulation, State};
    use crate::scene::Scene;
    use crate::tests::support::{self, IDEAL_MIXTURE};
    use psidpd_core::engine::Want;

    /// A scene of two species without pair forces, and its initial state.
    fn scene(rest: &str) -> (Scene, State) {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nbox = [6, 6, 8]\ndensity = 3\nsteps = 1\n{rest}\n[masses]\nB = 3.0\n"
        );
        let scene = support::scene(IDEAL_MIXTURE, &text).unwrap();
        let state = scene.initial_state();
        (scene, state)
    }

    fn run(scene: &Scene, state: &State, steps: usize, thermostat: bool) -> Simulation {
        let mut run = scene.simulation(state.clone()).unwrap();
        scene.enter(&scene.stages[0], &mut run).unwrap();
        run.set_thermostat(thermostat);
        run.prepare(0.01, Want::TOTALS).unwrap();
        for _ in 0..steps {
            run.step(0.01, Integrator::VelocityVerlet, Want::TOTALS).unwrap();
        }
        run
    }

    /// Species of any mass fall alike, and species without a body force do not fall.
    #[test]
    fn gravity_is_an_acceleration() {
        let both = "[[body_force]]\nacceleration = [0, 0, -2]\n[[body_force]]\nacceleration = [1, 0, 0]\nspecies = [\"B\"]\n";
        let (scene, state) = scene(both);
        let run = run(&scene, &state, 50, false);
        for k in 0..state.len() {
            let wind = if state.species[k] == 1 { 0.5 } else { 0.0 };
            let expected = [state.v[k][0] + wind, state.v[k][1], state.v[k][2] - 1.0];
            assert!((0..3).all(|c| (run.state().v[k][c] - expected[c]).abs() < 1e-12), "{k}");
        }
        assert!(run.tally().virial.iter().all(|w| *w == 0.0));
    }

    /// Opposite accelerations of the two halves drive them apart.
    #[test]
    fn halves_go_opposite_ways() {
        let (scene, state) = scene("[[body_force]]\nacceleration = [5, 0, 0]\nreversed_along = \"z\"\n");
        let run = run(&scene, &state, 40, true);
        let mean = |upper: bool| {
            let of = (0..run.len()).filter(|k| (run.state().x[*k][2] >= 4.0) == upper);
            let v: Vec<f64> = of.map(|k| run.state().v[k][0]).collect();
            v.iter().sum::<f64>() / v.len() as f64
        };
        // Without viscosity the means are 2 and -2; thermal velocities give the mean of 430 particles an error of 0.04.
        assert!(mean(false) > 0.5 && mean(true) < -0.5, "{} {}", mean(false), mean(true));
    }
}
