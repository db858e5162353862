use std::ops::RangeInclusive;

/// Indices of the particles in the order of their tags, which files use.
pub fn order_of_tags(tags: &[i32]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..tags.len()).collect();
    order.sort_unstable_by_key(|k| tags[*k]);
    order
}

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Tags {
    #[default]
    All,
    /// The particles whose tags lie in these ranges.
    Ranges(Vec<RangeInclusive<i32>>),
}

impl Tags {
    pub fn none() -> Tags {
        Tags::Ranges(Vec::new())
    }

    pub fn contain(&self, tag: i32) -> bool {
        match self {
            Tags::All => true,
            Tags::Ranges(ranges) => ranges.iter().any(|r| r.contains(&tag)),
        }
    }

    pub fn is_empty(&self) -> bool {
        matches!(self, Tags::Ranges(ranges) if ranges.iter().all(RangeInclusive::is_empty))
    }
}

#[cfg(test)]
mod tests {
    use super::Tags;
    use crate::run::{Integrator, Simulation};
    use crate::tests::support::{SOFT, scene};
    use psidpd_core::engine::Want;

    /// A frozen floor below a fluid, and a reflecting lid.
    const SCENE: &str = "model = \"m.toml\"\nkT = 1.0\ndensity = 3\nsteps = 1\n\
        [box]\nlengths = [5, 5, 7]\nboundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
        [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = 1\nlattice = \"fcc\"\nfrozen = true\n\
        [[part]]\nshape = \"rest\"\n";

    fn advance(run: &mut Simulation, steps: usize, integrator: Integrator) -> f64 {
        run.prepare_for(integrator, 0.01, Want::FORCES).unwrap();
        let mut sum = 0.0;
        for _ in 0..steps {
            run.step(0.01, integrator, Want::FORCES).unwrap();
            sum += run.temperature();
        }
        sum / steps as f64
    }

    #[test]
    fn frozen_particles_stay_and_act() {
        let scene = scene(SOFT, SCENE).unwrap();
        let state = scene.initial_state();
        for (_, integrator) in Integrator::ALL {
            let mut run = scene.simulation(state.clone()).unwrap();
            assert_eq!((run.mobile(), run.len()), (450, 525));
            advance(&mut run, 100, integrator);
            for k in 0..run.len() {
                let rests = run.state().x[k] == state.x[k] && run.state().v[k] == [0.0; 3];
                assert_eq!(rests, run.frozen()[k], "{k}");
            }
            assert_eq!(run.degrees_of_freedom(), 3 * 450);
            // The fluid presses the floor down; its pressure is about 23.7 and the area is 25.
            let force = run.support_force();
            assert!(force[2] < -300.0, "{force:?}");
        }
        // The forces on the fluid equal those without frozen particles.
        let mut free = scene.simulation(state.clone()).unwrap();
        free.set_frozen(&Tags::none());
        let mut run = scene.simulation(state).unwrap();
        for run in [&mut free, &mut run] {
            run.set_thermostat(false);
            run.prepare(0.01, Want::FORCES).unwrap();
        }
        assert_eq!(run.forces()[75..], free.forces()[75..]);
        assert!(run.forces()[..75].iter().all(|f| *f == [0.0; 3]));
    }

    /// The temperature is the mean of 1500 steps of 1350 degrees of freedom, correlated over less than 50
    /// steps: its standard error is below 0.008. Six standard errors, and as much for the bias of the time
    /// step, fail by chance less than once in 10^8; the seed is fixed. Counted over all particles the
    /// temperature would be 0.86.
    #[test]
    fn the_temperature_is_that_of_what_moves() {
        let scene = scene(SOFT, SCENE).unwrap();
        let mut run = scene.simulation(scene.initial_state()).unwrap();
        advance(&mut run, 200, Integrator::VelocityVerlet);
        let mean = advance(&mut run, 1500, Integrator::VelocityVerlet);
        assert!((mean - 1.0).abs() < 0.06, "{mean}");
    }
}
