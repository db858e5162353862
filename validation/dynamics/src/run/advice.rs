//! Advice about an integrator with larger steps than velocity Verlet.

use super::{Integrator, Simulation};
use crate::integrator::Coupling;
use crate::scene::Stage;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_observe::configurational;
use psidpd_observe::frame::Frame;
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

/// Largest number of particles for which drag and stiffness are computed, because both computations store all pairs.
pub(super) const MOST: usize = 500_000;

/// Smallest relative error that deserves advice.
const WORTH: f64 = 0.01;

/// Estimated errors and cost of a better step for a stage of velocity Verlet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    pub stage: String,
    pub dt: f64,
    /// The errors of the stage: of the configurational temperature, and of the carried pressure in ρkT.
    pub errors: [f64; 2],
    pub better_dt: f64,
    /// The errors of the better step, in the order of `errors`.
    pub better_errors: [f64; 2],
    /// The wall time of the better step relative to that of the stage.
    pub time: f64,
}

impl Advice {
    /// Advice for a stage that has just ended, from the stiffness of the forces and the drag at its end;
    /// `None` where the step is accurate enough or no estimate exists.
    pub fn of(simulation: &mut Simulation, stage: &Stage) -> Option<Advice> {
        if stage.integrator != Integrator::VelocityVerlet || !stage.thermostat {
            return None;
        }
        // The estimate does not hold beside frozen walls, and a driven flow is hot by itself.
        if simulation.has_body_forces() || !simulation.frozen().is_empty() || simulation.len() > MOST {
            return None;
        }
        let drag = simulation.warmth(stage.dt).ok()??.rate;
        let frequency = frequency(simulation)?;
        // Weak drag needs shorter steps, because it removes little of the energy that the step does not conserve.
        let reach = (0.75 + 0.4 * drag / frequency).min(1.25);
        let better_dt = two_digits(reach / frequency);
        let errors = stage.integrator.properties().accuracy.errors(stage.dt, frequency, drag);
        let better_errors = ADVISED.properties().accuracy.errors(better_dt, frequency, drag);
        let time = PRICE * stage.dt / better_dt;
        let worst = |errors: [f64; 2]| errors[0].max(errors[1]);
        let gains = worst(errors) > WORTH.max(worst(better_errors)) && time < 3.0;
        gains.then(|| Advice {
            stage: stage.name.clone(),
            dt: stage.dt,
            errors,
            better_dt,
            better_errors,
            time,
        })
    }
}

/// The root mean square frequency of the particles; `None` if the forces have no Laplacian.
fn frequency(simulation: &Simulation) -> Option<f64> {
    let fluid = simulation.model().at(simulation.kt()).ok()?;
    if configurational::missing(&fluid, &simulation.state().domain).is_some() {
        return None;
    }
    let evaluator = Evaluator::new(fluid).ok()?;
    let square = configurational::mean_square_frequency(&Frame::new(simulation.view(0.0), &evaluator));
    (square > 0.0).then(|| square.sqrt())
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Advice { stage, dt, errors, better_dt, better_errors, time } = self;
        let percent = |x: f64| two_digits(100.0 * x);
        let mut advised = ADVISED;
        let lambda = advised.settings().lambda.map_or(0.0, |(lambda, _)| *lambda);
        write!(
            f,
            "stage \"{stage}\", velocity-verlet at dt = {dt}: by estimate the configurational temperature is off by {} %, and \
             the pressure that steps carry, which sets the density of a liquid in equilibrium with its vapour, by {} % of rho kT. \
             integrator = \"{}\", lambda = {lambda}, thermostat_every = 2, dt = {better_dt} has {} and {} % in {} of the time; \
             psidpd pareto measures it",
            percent(errors[0]),
            percent(errors[1]),
            advised.name(),
            percent(better_errors[0]),
            percent(better_errors[1]),
            two_digits(*time)
        )
    }
}

fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{self, SET6};
    use psidpd_core::engine::Want;

    fn advice(stage: &str) -> Option<Advice> {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nseed = 7\nbox = 4.0\ndensity = 6.05\n[[stage]]\nname = \"run\"\nsteps = 1\n{stage}"
        );
        let scene = support::scene(SET6, &text).unwrap();
        let mut run = scene.simulation(scene.initial_state()).unwrap();
        run.prepare(0.005, Want::FORCES).unwrap();
        run.advance(400, 0.005, Integrator::VelocityVerlet).unwrap();
        Advice::of(&mut run, &scene.stages[0])
    }

    /// Warren's liquid has ω about 18 and κ about 22. Measurements at Δt = 0.01 gave an error of the carried
    /// pressure of 17 % of ρkT, and good results of the better step at 0.07.
    #[test]
    fn a_better_step_is_named_where_there_is_one() {
        let found = advice("dt = 0.01\n").unwrap();
        assert!((0.1..0.3).contains(&found.errors[1]), "{found:?}");
        assert!((0.055..0.085).contains(&found.better_dt) && (0.4..1.0).contains(&found.time), "{found:?}");
        assert!(found.better_errors.iter().all(|e| *e < 0.03), "{found:?}");
        assert!(found.to_string().contains("integrator = \"force-gradient\", lambda = 0.17"), "{found}");
        for good in ["dt = 0.0002\n", "dt = 0.06\nintegrator = \"force-gradient\"\n", "thermostat = false\n"]
        {
            assert_eq!(advice(good), None, "{good}");
        }
    }
}
