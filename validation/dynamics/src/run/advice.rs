//! Advice about an integrator with larger steps than velocity Verlet.

use super::looks::piece;
use super::watch::LEAST;
use super::{Integrator, Simulation, State};
use crate::integrator::{Coupling, Rates, crossing};
use crate::scene::Stage;
use crate::trial::{Composition, Piece, percent, two_digits};
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::configurational;
use psidpd_observe::frame::Frame;
use psidpd_observe::piece::Piece as Part;
use serde::Serialize;
use std::fmt;

/// The recommended step: its λ is the best in liquids whose forces have kinks; the thermostat acts at every second step.
const ADVISED: Integrator = Integrator::ForceGradient {
    lambda: 0.17,
    gradient: 1.0 / 24.0,
    coupling: Coupling { every: 2, ..Coupling::DEFAULT },
};

/// Cost of a recommended step in steps of velocity Verlet: three evaluations of forces and half a thermostat.
const PRICE: f64 = 4.5;

/// Smallest relative error that deserves advice.
const WORTH: f64 = 0.01;

/// Steps of particles that a stage must have made for a trial, which takes one to three seconds, to be a small part of it.
const TRIAL: u64 = 50_000_000;

/// Estimated errors and cost of a better step for a stage of velocity Verlet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    pub stage: String,
    pub dt: f64,
    /// The errors of the stage: of the temperatures, and of the carried pressure in ρkT.
    pub errors: [f64; 2],
    pub better_dt: f64,
    /// The errors of the better step, measured on a piece of the fluid, in the order of `errors`: of the temperatures, and in ρkT.
    pub better_errors: [f64; 2],
    /// Errors of the better step below this are not told from none.
    pub resolution: f64,
    /// The wall time of the better step relative to that of the stage.
    pub time: f64,
}

impl Advice {
    /// Advice for a stage that has just ended: a step that a piece of its fluid has tried; `None` where the stage's own step is
    /// accurate enough, too short to be worth a trial, or where no better step is known.
    pub fn of(simulation: &mut Simulation, stage: &Stage) -> Option<Advice> {
        if stage.integrator != Integrator::VelocityVerlet || !stage.thermostat {
            return None;
        }
        if !is_worth_a_trial(stage, simulation.len()) {
            return None;
        }
        // The estimate does not hold beside frozen walls, and a driven flow is hot by itself.
        if simulation.has_body_forces() || !simulation.frozen().is_empty() {
            return None;
        }
        let piece = piece(simulation, 1);
        let drag = simulation.warmth(stage.dt, piece.as_ref()).ok()??.rate;
        let range = simulation.engine().plan().cutoff();
        let crossing = crossing(simulation.kt(), &simulation.state().mass, range);
        let rates = Rates { frequency: frequency(simulation, piece.as_ref())?, drag, crossing };
        let errors = stage.integrator.properties().accuracy.errors(stage.dt, rates);
        let worst = |errors: [f64; 2]| errors[0].max(errors[1]);
        if worst(errors) <= WORTH {
            return None;
        }
        let State { mass, .. } = simulation.state();
        let densities = densest(simulation);
        let of = Composition {
            model: simulation.model(),
            masses: mass,
            kt: simulation.kt(),
            densities: &densities,
            seed: 1,
        };
        let (better_dt, found) = Piece::settled(&of).ok()?.ok()?.longest(ADVISED).ok()??;
        let better_errors = [found.temperatures(), found.carried()];
        let time = PRICE * stage.dt / better_dt;
        gains(worst(errors), worst(better_errors), time).then(|| Advice {
            stage: stage.name.clone(),
            dt: stage.dt,
            errors,
            better_dt,
            better_errors,
            resolution: found.resolution(),
            time,
        })
    }
}

/// Whether a stage is so long that a trial is a small part of it.
pub(super) fn is_worth_a_trial(stage: &Stage, particles: usize) -> bool {
    stage.steps >= LEAST && stage.steps.saturating_mul(particles as u64) >= TRIAL
}

/// Whether a setting with a smaller error is worth what it takes, in times of the stage's.
fn gains(error: f64, better: f64, time: f64) -> bool {
    error > better && time < 3.0
}

/// Number densities of the species where the fluid is densest: in the blocks of space that hold the densest quarter of the particles.
fn densest(simulation: &Simulation) -> Vec<f64> {
    /// Particles of a block, about.
    const BLOCK: f64 = 60.0;
    let State { domain, mass, x, species, .. } = simulation.state();
    let dimensions = simulation.dimensions();
    let volume = domain.volume(dimensions);
    let heights: Vec<f64> = (0..dimensions).map(|k| domain.height(k)).collect();
    // A slab or a drop leaves much of the box empty: blocks of the mean density's size hold several times as many there.
    let edge = (volume * BLOCK / x.len() as f64).powf(1.0 / dimensions as f64);
    let count: [usize; 3] =
        std::array::from_fn(|k| heights.get(k).map_or(1, |height| ((height / edge).round() as usize).max(1)));
    let mut blocks = vec![vec![0usize; mass.len()]; count.iter().product()];
    for (x, s) in x.iter().zip(species) {
        let f = domain.fraction(*x);
        let at: [usize; 3] =
            std::array::from_fn(|k| ((f[k].max(0.0) * count[k] as f64) as usize).min(count[k] - 1));
        blocks[(at[2] * count[1] + at[1]) * count[0] + at[0]][*s as usize] += 1;
    }
    let total = |block: &Vec<usize>| block.iter().sum::<usize>();
    blocks.sort_by_key(|block| std::cmp::Reverse(total(block)));
    let (mut sum, mut taken) = (vec![0usize; mass.len()], 0usize);
    for block in &blocks {
        sum.iter_mut().zip(block).for_each(|(sum, n)| *sum += n);
        taken += 1;
        if 4 * total(&sum) >= x.len() {
            break;
        }
    }
    let here = volume * taken as f64 / blocks.len() as f64;
    sum.into_iter().map(|n| n as f64 / here).collect()
}

/// The root mean square frequency of the particles of a piece, or of all; `None` if the forces have no Laplacian.
fn frequency(simulation: &Simulation, piece: Option<&Part>) -> Option<f64> {
    let fluid = simulation.model().at(simulation.kt()).ok()?;
    if configurational::missing(&fluid, &simulation.state().domain).is_some() {
        return None;
    }
    let evaluator = Evaluator::new(fluid).ok()?;
    let frame = Frame::of_piece(simulation.view(0.0), piece, &evaluator);
    let square = configurational::mean_square_frequency(&frame);
    Some(square.max(0.0).sqrt())
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Advice { stage, dt, errors, better_dt, better_errors, resolution, time } = self;
        let better = better_errors[0].max(better_errors[1]);
        let better = match better < *resolution {
            true => format!("less than {}", percent(*resolution)),
            false => format!("at most {} in temperatures and pressure", percent(better)),
        };
        let mut advised = ADVISED;
        let lambda = advised.settings().lambda.map_or(0.0, |(lambda, _)| *lambda);
        write!(
            f,
            "stage \"{stage}\", velocity-verlet at dt = {dt}: by estimate a temperature is off by {}, and \
             the pressure of the momentum flux, which sets the density of a liquid in equilibrium with its vapour, by {} of rho kT. \
             integrator = \"{}\", lambda = {lambda}, thermostat_every = 2, dt = {better_dt} was off by {better} in a trial with a \
             piece of the fluid, in {} of the time; psidpd pareto measures it",
            percent(errors[0]),
            percent(errors[1]),
            advised.name(),
            two_digits(*time)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{self, SET6, SOFT};
    use psidpd_core::engine::{PeriodicBox, Want};
    use psidpd_core::model::Model;

    #[test]
    fn advice_has_a_smaller_error_for_up_to_three_times_the_time() {
        assert!(gains(0.02, 0.019, 2.99) && !gains(0.02, 0.019, 3.01));
        assert!(!gains(0.02, 0.021, 0.5) && !gains(0.02, 0.021, 4.0) && !gains(0.02, f64::NAN, 1.0));
    }

    /// Advice for Warren's liquid in units of energy and mass that are 0.7 and 3 of the usual ones, for a step in the usual units of time.
    fn advice(dt: f64, rest: &str) -> Option<Advice> {
        let (kt, mass): (f64, f64) = (0.7, 3.0);
        let mut model = SET6.to_owned();
        for (usual, here) in [
            ("A  = -40.0", format!("A  = {:?}", -40.0 * kt)),
            ("B  = 25.0", format!("B  = {:?}", 25.0 * kt)),
            ("gamma = 18.0", format!("gamma = {:?}", 18.0 * (mass * kt).sqrt())),
        ] {
            assert!(model.contains(usual));
            model = model.replace(usual, &here);
        }
        let dt = dt * time();
        let text = format!(
            "model = \"m.toml\"\nkT = {kt:?}\nseed = 7\nbox = 4.0\ndensity = 6.05\n[masses]\nF = {mass:?}\n\
             [[stage]]\nname = \"run\"\nsteps = 200000\ndt = {dt:?}\n{rest}"
        );
        let scene = support::scene(&model, &text).unwrap();
        let mut run = scene.simulation(scene.initial_state()).unwrap();
        scene.enter(&scene.stages[0], &mut run).unwrap();
        run.prepare(0.005 * time(), Want::FORCES).unwrap();
        run.advance(400, 0.005 * time(), Integrator::VelocityVerlet).unwrap();
        Advice::of(&mut run, &scene.stages[0])
    }

    /// The usual unit of time.
    fn time() -> f64 {
        (3.0f64 / 0.7).sqrt()
    }

    /// Warren's liquid has ω = 18.3 and κ = 22.5. Measurements at Δt = 0.01 gave an error of the carried pressure of 16.6(3) % of ρkT,
    /// the rule ½(ωΔt)² + ¾κΔt gives 18.5 %, and measurements gave good results of the better step at 0.05 to 0.07, where ωΔt is 0.9 to 1.3. It costs three
    /// evaluations of forces and half of a thermostat, together 4.5 steps of velocity Verlet.
    #[test]
    fn a_better_step_is_named_where_there_is_one() {
        let found = advice(0.01, "").unwrap();
        assert!((0.16..0.21).contains(&found.errors[1]), "{found:?}");
        let better = found.better_dt / time();
        assert!((0.04..0.061).contains(&better) && (0.4..1.0).contains(&found.time), "{found:?}");
        assert!((found.time - 4.5 * 0.01 / better).abs() < 1e-12, "{found:?}");
        assert!(found.better_errors.iter().all(|e| *e < 0.03), "{found:?}");
        assert!(found.to_string().contains("integrator = \"force-gradient\", lambda = 0.17"), "{found}");
        for (dt, good) in [
            (0.0002, ""),
            (0.06, "integrator = \"force-gradient\"\n"),
            (0.01, "thermostat = false\n"),
            (0.01, "[[body_force]]\nacceleration = [0.1, 0.0, 0.0]\n"),
        ] {
            assert_eq!(advice(dt, good), None, "{good}");
        }
    }

    /// Two particles 0.8 apart by hand: ∇²φ = φ″ + 2φ′/r of φ = ½·25 (1 − r)² is 25 (1 − 2·0.2/0.8) = 12.5, a third of it for each direction.
    #[test]
    fn the_frequency_of_two_particles_by_hand() {
        let model = Model::parse("m", SOFT).unwrap();
        let domain = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [true; 3]).unwrap();
        let state = State::at_rest(domain, vec![3.0], vec![[0.1, 1.0, 2.0], [4.3, 1.0, 2.0]]);
        let run = Simulation::new(&model, 0.7, state, 1).unwrap();
        let found = frequency(&run, None).unwrap();
        assert!((found - (12.5f64 / 3.0 / 3.0).sqrt()).abs() < 1e-9, "{found}");
    }

    /// A particle on the upper face of an open box is in the last block.
    #[test]
    fn the_corner_of_the_box_is_in_a_block() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [false; 3]).unwrap();
        let state = State::at_rest(domain, vec![1.0], vec![[5.0; 3], [4.3, 1.0, 2.0]]);
        let run = Simulation::new(&Model::parse("m", SOFT).unwrap(), 0.7, state, 1).unwrap();
        assert_eq!(densest(&run), [2.0 / 125.0]);
    }

    /// A slab that fills a third of the box is as dense as its middle, with its own composition.
    #[test]
    fn the_densest_part_of_a_slab_counts() {
        let text = "model = \"m.toml\"\nkT = 1.0\nbox = [5.0, 5.0, 15.0]\nsteps = 1\ndt = 0.01\n[initial]\nkind = \"slab\"\n\
                    thickness = 5.0\ndensity = 6.0\n";
        let scene = support::scene(SET6, text).unwrap();
        let run = scene.simulation(scene.initial_state()).unwrap();
        let found = densest(&run);
        assert!((5.0..7.5).contains(&found[0]), "{found:?}");
    }
}
