//! Drag and noise of isolated pairs of particles, compared with the formula of each integrator.
//!
//! Every particle has one partner, at half the range, and no other particle within the range. Velocities are
//! so small that distances stay constant. The relative velocity `u` along a pair then follows a linear
//! recurrence with one parameter, x = DΔt/μ.

use super::*;
use crate::integrator::Coupling;
use psidpd_core::engine::thermostat::Update;
use psidpd_core::engine::{PeriodicBox, Precision, Settings};

const PAIRS: &str = "title = \"pairs\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 6\nrange = 1\n";
/// Masses of the species; the reduced mass is 3/4.
const MASS: [f64; 2] = [1.0, 3.0];
const REDUCED: f64 = 0.75;
const DT: f64 = 0.3;
/// The parameter x: at half the range the drag is D = 6 (1 − ½)² = 3/2.
const X: f64 = 1.5 * DT / REDUCED;
const ALONG: [f64; 3] = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

/// A simulation of `edge`³ pairs; the two particles of a pair are consecutive.
fn pairs(edge: usize, kt: f64) -> Simulation {
    let domain = PeriodicBox::orthogonal([0.0; 3], [2.0 * edge as f64; 3], [true; 3]).unwrap();
    let x: Vec<[f64; 3]> = (0..edge.pow(3))
        .flat_map(|k| {
            let first = [k % edge, k / edge % edge, k / edge / edge].map(|k| 2.0 * k as f64 + 1.0);
            [first, std::array::from_fn(|c| first[c] - 0.5 * ALONG[c])]
        })
        .collect();
    let species = (0..x.len()).map(|k| (k % 2) as i32).collect();
    let state = State { species, ..State::at_rest(domain, MASS.to_vec(), x) };
    Simulation::new(&Model::parse("m.toml", PAIRS).unwrap(), kt, state, 7).unwrap()
}

fn with(update: Update, every: u64) -> Integrator {
    Integrator::Aboba(Coupling { update, every, ..Coupling::DEFAULT })
}

/// The factor by which a step scales `u` where drag and noise act at fixed positions; `None` for other integrators.
fn factor(integrator: Integrator, x: f64) -> Option<f64> {
    let midpoint = |x: f64| (1.0 - 0.5 * x) / (1.0 + 0.5 * x);
    match integrator {
        Integrator::ShardlowS1 { .. } => Some(midpoint(x)),
        Integrator::ShardlowS2 { .. } => Some(midpoint(0.5 * x).powi(2)),
        Integrator::Peters { .. } => Some((-x).exp()),
        Integrator::Aboba(coupling)
        | Integrator::Baoab(coupling)
        | Integrator::TwoStage { coupling, .. }
        | Integrator::ForceGradient { coupling, .. } => {
            Some(if coupling.update == Update::Midpoint { midpoint(x) } else { (-x).exp() })
        }
        _ => None,
    }
}

/// Advances `u`, and the force along the pair times Δt/μ, by one step with a noise `xi` of variance 1; in units of √(kT/μ).
fn one_step(integrator: Integrator, x: f64, [u, f]: [f64; 2], xi: f64) -> [f64; 2] {
    let noise = (2.0 * x).sqrt() * xi;
    let half = u + 0.5 * f;
    match integrator {
        Integrator::VelocityVerlet => {
            let f = noise - x * half;
            [half + 0.5 * f, f]
        }
        Integrator::GrootWarren { lambda } => {
            let next = noise - x * (u + lambda * f);
            [u + 0.5 * (f + next), next]
        }
        Integrator::DpdVv { .. } => {
            let u = half + 0.5 * (noise - x * half);
            [u, noise - x * u]
        }
        Integrator::SelfConsistent { .. } => {
            let u = (half + 0.5 * noise) / (1.0 + 0.5 * x);
            [u, noise - x * u]
        }
        exact => {
            let c = factor(exact, x).unwrap();
            [c * u + (1.0 - c * c).sqrt() * xi, 0.0]
        }
    }
}

/// All integrators except Lowe and Andersen's, which has no formula for a single pair.
fn linear() -> impl Iterator<Item = Integrator> {
    Integrator::ALL.into_iter().map(|(_, it)| it).filter(|it| *it != Integrator::LoweAndersen)
}

/// The temperature is so low that noise is far below rounding. Drag does not change the mean velocity of a
/// pair or its transverse relative velocity.
#[test]
fn relative_velocities_decay_by_the_formula() {
    let more = [with(Update::OrnsteinUhlenbeck, 1), with(Update::Midpoint, 3)];
    for integrator in linear().chain(more) {
        let mut run = pairs(2, 1e-60);
        let (mean, relative) = ([1e-12, -2e-12, 5e-13], [7e-13, 1e-13, -4e-13]);
        let of_pair = |relative: [f64; 3]| -> [[f64; 3]; 2] {
            let shares = [MASS[1], -MASS[0]].map(|m| m / (MASS[0] + MASS[1]));
            shares.map(|share| std::array::from_fn(|c| mean[c] + share * relative[c]))
        };
        let state = run.state().clone();
        let v = (0..run.len()).map(|k| of_pair(relative)[k % 2]).collect();
        run.restore(0, &State { v, ..state }, &[], [0; 2]);
        run.prepare_for(integrator, DT, Want::FORCES).unwrap();
        let start = dot(relative, ALONG);
        let mut now = [start, if integrator.properties().drag_in_forces { -X * start } else { 0.0 }];
        let mut it = integrator;
        let every = it.settings().coupling.map_or(1, |coupling| coupling.every);
        for step in 1..=6 {
            run.step(DT, integrator, Want::FORCES).unwrap();
            if step % every == 0 {
                now = one_step(integrator, X * every as f64, now, 0.0);
            }
            let expected = of_pair(std::array::from_fn(|c| relative[c] + (now[0] - start) * ALONG[c]));
            for (k, v) in run.state().v.iter().enumerate() {
                let off = (0..3).map(|c| (v[c] - expected[k % 2][c]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-10 * 1e-12, "{integrator}, step {step}: {v:?}, not {:?}", expected[k % 2]);
            }
        }
    }
}

/// `u` and the force times Δt/μ of each pair, in units of √(kT/μ).
fn along(run: &Simulation) -> Vec<[f64; 2]> {
    let unit = (run.kt() / REDUCED).sqrt();
    let (v, f) = (&run.state().v, run.forces());
    (0..run.len())
        .step_by(2)
        .map(|k| {
            let u = dot(std::array::from_fn(|c| v[k][c] - v[k + 1][c]), ALONG);
            [u / unit, dot(f[k], ALONG) * DT / REDUCED / unit]
        })
        .collect()
}

const EDGE: usize = 16;
/// Steps that the test samples, after [`SETTLE`] others from rest.
const STEPS: usize = 48;
const SETTLE: u64 = 10;

/// A step adds noise to the damped `u`: its variance is 2kT D Δt/μ² times the response of the step. `u` has
/// the stationary variance of the recurrence, kT/μ where drag and noise act at fixed positions. The first
/// variance, of 196 608 independent numbers, has a standard error of at most 0.32 %. The second, of numbers
/// with a correlation of 0.55 from step to step, has one of 0.45 %. Six standard errors are exceeded by
/// chance less than once in 10^8. An amplitude wrong by 2 % changes both variances by 4 %.
#[test]
fn noise_has_the_variance_of_the_formula() {
    let double =
        linear().chain([with(Update::OrnsteinUhlenbeck, 1)]).map(|it| (it, Precision::Double, false));
    let others = [(Precision::Mixed, false), (Precision::Double, true)];
    let others = others.map(|(precision, plain)| (Integrator::VelocityVerlet, precision, plain));
    for (integrator, precision, plain) in double.chain(others) {
        let mut run = pairs(EDGE, 1e-20);
        run.set_settings(Settings { precision, ..run.settings() }).unwrap();
        run.use_pair_sums_only(plain);
        run.prepare_for(integrator, DT, Want::FORCES).unwrap();
        run.advance(SETTLE, DT, integrator).unwrap();
        let [mut noise, mut square] = [0.0; 2];
        let mut before = along(&run);
        for _ in 0..STEPS {
            run.step(DT, integrator, Want::FORCES).unwrap();
            let after = along(&run);
            for (before, [u, _]) in before.iter().zip(&after) {
                noise += (u - one_step(integrator, X, *before, 0.0)[0]).powi(2);
                square += u * u;
            }
            before = after;
        }
        let count = (EDGE.pow(3) * STEPS) as f64;
        // The response to a noise of 1, in its step and in later ones.
        let mut response = one_step(integrator, X, [0.0; 2], 1.0);
        let of_noise = response[0].powi(2);
        let mut of_all = 0.0;
        for _ in 0..100 {
            of_all += response[0].powi(2);
            response = one_step(integrator, X, response, 0.0);
        }
        let [noise, square] = [noise / count / of_noise, square / count / of_all];
        let name = format!("{integrator}, {precision:?}, reference {plain}");
        assert!((noise - 1.0).abs() < 6.0 * (2.0 / count).sqrt(), "{name}: {noise} times the noise");
        assert!((square - 1.0).abs() < 6.0 * (4.0 / count).sqrt(), "{name}: {square} times the variance");
        assert!(factor(integrator, X).is_none() || (of_all - 1.0).abs() < 1e-12, "{name}: {of_all}");
    }
}

/// Lowe and Andersen's integrator: with the probability 1 − exp(−x) a pair gets a new `u` of variance kT/μ;
/// otherwise its velocities keep their bits. The share of 196 608 pairs has a standard error of 0.0011, the
/// variance one of 0.43 %; six standard errors are exceeded by chance less than once in 10^8. A rate wrong by
/// 5 % changes the share by 0.016.
#[test]
fn relative_velocities_are_drawn_anew_at_the_rate_of_drag() {
    let mut run = pairs(EDGE, 1e-20);
    run.prepare_for(Integrator::LoweAndersen, DT, Want::FORCES).unwrap();
    run.advance(SETTLE, DT, Integrator::LoweAndersen).unwrap();
    let [mut drawn, mut square] = [0.0; 2];
    for _ in 0..STEPS {
        let before = run.state().v.to_vec();
        run.step(DT, Integrator::LoweAndersen, Want::FORCES).unwrap();
        for (k, [u, _]) in along(&run).into_iter().enumerate() {
            if run.state().v[2 * k] != before[2 * k] {
                drawn += 1.0;
                square += u * u;
            }
        }
    }
    let count = (EDGE.pow(3) * STEPS) as f64;
    let share = 1.0 - (-X).exp();
    let error = (share * (1.0 - share) / count).sqrt();
    assert!((drawn / count - share).abs() < 6.0 * error, "{} drawn, not {share}", drawn / count);
    assert!((square / drawn - 1.0).abs() < 6.0 * (2.0 / drawn).sqrt(), "variance {}", square / drawn);
}

/// The virial of drag and noise is that of the momentum that they exchange: of the forces at the end of a step where they are among
/// them, or else of what a step gave to velocities, over the time that the thermostat acted for. Other particles are out of reach, and
/// distances do not change.
#[test]
fn the_pressure_of_drag_and_noise_is_that_of_their_impulses() {
    let every_third = [Update::Midpoint, Update::OrnsteinUhlenbeck].map(|update| with(update, 3));
    let all = Integrator::ALL.into_iter().map(|(_, it)| it).filter(Integrator::has_time);
    for integrator in all.chain(every_third) {
        let mut run = pairs(3, 1e-20);
        run.prepare_for(integrator, DT, Want::TOTALS).unwrap();
        let mut it = integrator;
        let every = it.settings().coupling.map_or(1, |coupling| coupling.every);
        for step in 1..=12 {
            let before = run.state().v.clone();
            run.step(DT, integrator, Want::TOTALS).unwrap();
            if step % every != 0 {
                continue;
            }
            let (state, in_forces) = (run.state(), integrator.properties().drag_in_forces);
            let mut expected = [0.0; 6];
            for k in 0..run.len() {
                let (v, m) = (state.v[k], MASS[k % 2]);
                let given: [f64; 3] = match in_forces {
                    true => run.forces()[k],
                    false => std::array::from_fn(|c| m * (v[c] - before[k][c]) / (every as f64 * DT)),
                };
                // Half of the distance of the pair is each particle's.
                let d = ALONG.map(|c| if k % 2 == 0 { 0.25 * c } else { -0.25 * c });
                for (sum, (a, b)) in expected.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
                {
                    *sum += m * v[a] * v[b] + d[a] * given[b];
                }
            }
            let found = run.pressure_tensor().map(|p| p * 216.0);
            let size = expected.iter().fold(0.0, |most: f64, p| most.max(p.abs()));
            for (found, expected) in found.iter().zip(expected) {
                let off = (found - expected).abs() / size;
                assert!(off < 1e-6, "{integrator}, step {step}: {found} and not {expected}");
            }
        }
    }
}
