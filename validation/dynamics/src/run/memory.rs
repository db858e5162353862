//! The memory that a run of a scene takes.

use super::advice::is_worth_a_trial;
use super::looks::{FEW, WORTH_A_LOOK};
use crate::scene::Scene;
use psidpd_core::engine::Precision;
use psidpd_core::engine::pair_sums::has_particle_sums;
use psidpd_formats::memory::{self, MemoryError, PARTICLE};
use psidpd_observe::Pairs;

/// Bytes per particle of evaluations for configurational temperatures, whose arrays the watch keeps between looks at all particles: 18 444
/// took 1100 and 1500, with velocity Verlet and force-gradient, where pairs are listed, and 200 and 830 where they are summed; pieces of
/// 20 000, whose arrays are not kept, 900 and 1000.
const EVALUATION: f64 = 1200.0;

/// Bytes per particle where observables list all pairs: `temperature` of 6 050 to 282 000 particles took 1250 to 1330. `stress_profile` of
/// 60 500, with pairs in single precision, took 720 with velocity Verlet and 1280 with force-gradient.
const LISTED: f64 = 1300.0;

/// Bytes per particle where they sum them: `temperature` of 60 500, 106 000 and 282 000 particles took 140 to 270.
const SUMMED: f64 = 240.0;

/// Bytes per particle of the cells for the test whether a liquid is a crystal: 10⁶ particles took 37 and 42.
const OF_LIQUIDS: f64 = 45.0;

/// Bytes per particle of a thermostat apart from the forces: the pairs, and vectors of the particles beside those in memory of the forces.
/// 163 350 and 10⁶ particles took 221 to 245.
const APART: f64 = 250.0;

/// A checkpoint is made in memory, and a vector that grows has up to twice the length that it needs: runs at their peak had 2.8 times
/// the samples of a map, and 3.8 times those of displacements.
const COPIES: f64 = 4.0;

/// Bytes at the peak of a run, about.
pub fn bytes(scene: &Scene) -> f64 {
    parts(scene).iter().sum()
}

/// Checks that a run fits into the memory.
pub fn check_memory(scene: &Scene) -> Result<(), MemoryError> {
    let (particles, [of_particles, samples]) = (scene.initial.count(), parts(scene));
    memory::fits(of_particles + samples, || match samples > of_particles {
        true => {
            format!("the samples of [observe] ({}) and {particles} particles need", memory::shown(samples))
        }
        false => format!("{particles} particles need"),
    })
}

/// Bytes of particles, and of samples of observables.
fn parts(scene: &Scene) -> [f64; 2] {
    [memory::need(scene.initial.count(), bytes_per_particle(scene)), COPIES * bytes_of_samples(scene)]
}

fn bytes_of_samples(scene: &Scene) -> f64 {
    let steps =
        |name: &str| scene.stages.iter().filter(|stage| stage.name == name).map(|stage| stage.steps).sum();
    scene.observe.bytes(scene.initial.count() as f64, steps)
}

/// Bytes per particle, about those of Warren's liquid (docs/bench.md). In long stages the watch and advice evaluate forces with all their
/// pairs, of a piece if there are many particles.
fn bytes_per_particle(scene: &Scene) -> f64 {
    let particles = scene.initial.count();
    // Of a piece, where there are many particles.
    let part = particles.min(FEW) as f64 / particles as f64;
    let heated = || scene.stages.iter().filter(|stage| stage.thermostat && stage.integrator.has_time());
    let pairs = if heated().any(|stage| !stage.integrator.properties().drag_in_forces) { APART } else { 0.0 };
    let evaluates = heated().any(|stage| stage.steps >= WORTH_A_LOOK || is_worth_a_trial(stage, particles));
    let is_periodic = scene.domain.periodic()[..scene.model.dimensions()].iter().all(|periodic| *periodic);
    let has_sums = || scene.model.at(scene.kt).is_ok_and(|fluid| has_particle_sums(&fluid));
    let sums = || is_periodic && scene.precision() == Precision::Mixed && has_sums();
    let observed = match scene.observe.pairs() {
        Pairs::Nothing => 0.0,
        Pairs::Sums | Pairs::SumsAndForces if sums() => SUMMED,
        Pairs::Sums | Pairs::SumsAndForces | Pairs::List => LISTED,
    };
    let evaluated = observed.max(if evaluates { EVALUATION * part } else { 0.0 });
    let cells = if scene.observe.of_liquids() { OF_LIQUIDS } else { 0.0 };
    PARTICLE + pairs + evaluated + cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{SET6, scene};

    fn of(edge: f64, observe: &str) -> Scene {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nbox = {edge:?}\ndensity = 6.05\ndt = 0.005\nsteps = 1000\n{observe}"
        );
        scene(SET6, &text).unwrap()
    }

    /// The pairs of all forces are stored for as many particles as watch and advice evaluate, and for no more: for all of 387, and for
    /// 20 000 of 756 250.
    #[test]
    fn evaluations_of_the_watch_are_counted() {
        let bytes = |edge: f64| bytes_per_particle(&of(edge, ""));
        let share = 20_000.0 / 756_250.0;
        let of = |observe: &str| bytes_per_particle(&of(50.0, &format!("[observe]\n{observe} = true\n")));
        assert_eq!(of("density_profile"), bytes(50.0));
        assert_eq!(of("msd"), bytes(50.0) + OF_LIQUIDS);
        for (observe, pairs, cells) in [
            ("temperature", SUMMED, 0.0),
            ("clusters", LISTED, 0.0),
            ("stress_profile", LISTED, OF_LIQUIDS),
            ("temperature = true\nclusters", LISTED, 0.0),
        ] {
            let more = pairs - share * EVALUATION + cells;
            assert!((of(observe) - bytes(50.0) - more).abs() < 1e-9, "{observe}");
        }
        let once = (1.0 - share) * EVALUATION;
        assert!((bytes(4.0) - bytes(50.0) - once).abs() < 1e-9);
    }

    /// Rows of 8 bytes for each cell: 64 of a map, or as many as there are samples; 500 origins of 387 particles.
    #[test]
    fn samples_of_observables_are_counted() {
        let samples = |observe: &str| bytes_of_samples(&of(4.0, &format!("[observe]\n{observe}\n")));
        assert_eq!(samples("density_field = { bins = [500, 1000], every = 1 }"), 65.0 * 8.0 * 500_000.0);
        assert_eq!(samples("density_field = { bins = [500, 1000], every = 100 }"), 11.0 * 8.0 * 500_000.0);
        let long = samples("msd = { length = 500, spacing = 1, every = 2 }");
        assert!(long > 500.0 * 387.0 * 24.0 && long < 510.0 * 387.0 * 24.0 + 500.0 * 9000.0, "{long}");
    }
}
