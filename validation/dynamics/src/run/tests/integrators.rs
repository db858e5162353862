//! Properties that the documentation claims for each integrator.

use super::*;
use crate::integrator::Coupling;
use psidpd_core::engine::thermostat::Update;
use psidpd_core::engine::{Precision, Settings};

/// The integrators that conserve the Maxwell distribution of an ideal gas exactly, at any time step.
fn exact() -> Vec<Integrator> {
    let pairwise = Coupling { update: Update::OrnsteinUhlenbeck, ..Coupling::DEFAULT };
    let rare = Coupling { every: 3, ..Coupling::DEFAULT };
    let inside = ["velocity-verlet", "groot-warren", "dpd-vv", "self-consistent"];
    let mut all: Vec<_> =
        Integrator::ALL.iter().filter(|(name, _)| !inside.contains(name)).map(|(_, it)| *it).collect();
    all.extend([Integrator::Aboba(pairwise), Integrator::Aboba(rare)]);
    all
}

/// Kinetic temperature, kurtosis of velocities and pairs in shells of an ideal gas of
/// two masses, with their standard errors.
struct Gas {
    temperature: [f64; 2],
    kurtosis: [f64; 2],
    /// Deviations of the numbers of pairs in shells, in standard deviations.
    shells: [f64; 3],
}

fn ideal_gas(integrator: Integrator, dt: f64) -> Gas {
    let model = IDEAL_MIXTURE;
    let rest = ONE_STAGE.to_owned() + "[masses]\nB = 3.0\n";
    let state = scene_of(model, "[4.0, 5.0, 4.0]", 4.0, &rest).unwrap().initial_state();
    let mut run = simulation(model, state);
    run.prepare_for(integrator, dt, Want::FORCES).unwrap();
    run.advance(30, dt, integrator).unwrap();
    let edges = [0.0, 0.4, 0.7, 1.0f64];
    let (mut found, mut frames) = ([0.0; 3], 0.0);
    let blocks: Vec<[f64; 2]> = (0..20)
        .map(|block| {
            let mut sums = [0.0; 2];
            for _ in 0..24 {
                run.step(dt, integrator, Want::FORCES).unwrap();
                let masses: Vec<f64> =
                    run.state().species.iter().map(|s| run.state().mass[*s as usize]).collect();
                let fourth: f64 = run
                    .state()
                    .v
                    .iter()
                    .zip(masses)
                    .map(|(v, m)| v.iter().map(|c| (m * c * c).powi(2)).sum::<f64>())
                    .sum();
                sums[0] += run.temperature() / 24.0;
                sums[1] += fourth / (3 * run.len()) as f64 / 24.0;
            }
            if block % 2 == 0 {
                frames += 1.0;
                count_pairs(&run, &edges, &mut found);
            }
            sums
        })
        .collect();
    assert!(momentum(&run).iter().all(|p| p.abs() < 1e-9), "{integrator}: {:?}", momentum(&run));
    let of = |k: usize| {
        let n = blocks.len() as f64;
        let mean = blocks.iter().map(|b| b[k]).sum::<f64>() / n;
        let variance = blocks.iter().map(|b| (b[k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, (variance / n).sqrt()]
    };
    let pairs = 0.5 * (run.len() * (run.len() - 1)) as f64 * frames / run.state().domain.volume(3);
    let shells = std::array::from_fn(|s| {
        let expected = pairs * 4.0 / 3.0 * std::f64::consts::PI * (edges[s + 1].powi(3) - edges[s].powi(3));
        (found[s] - expected) / expected.sqrt()
    });
    Gas { temperature: of(0), kurtosis: of(1), shells }
}

fn count_pairs(run: &Simulation, edges: &[f64; 4], found: &mut [f64; 3]) {
    let x = &run.state().x;
    for i in 0..x.len() {
        for j in 0..i {
            let d = run.state().domain.minimum_image(x[i], x[j]);
            let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            if let Some(shell) = (0..3).find(|s| (edges[*s]..edges[s + 1]).contains(&r)) {
                found[shell] += 1.0;
            }
        }
    }
}

/// The test uses Δt = 0.2, ten times the limit of velocity Verlet. Student's t of 19 degrees of freedom
/// exceeds 6 less than once in 10^5 seeds, and so does a shell exceed five standard deviations: 45 numbers
/// fail by chance less than once in 2000 seeds, and the seed is fixed. ⟨v⁴⟩ of N particles with zero total
/// momentum is below 3 kT²/m² by the fraction 2/N, 0.02 here.
#[test]
fn the_maxwell_distribution_is_exact_at_long_steps() {
    for integrator in exact() {
        let Gas { temperature: [t, t_error], kurtosis: [k, k_error], shells } = ideal_gas(integrator, 0.2);
        assert!((t - 1.0).abs() < 6.0 * t_error, "{integrator}: T = {t} +- {t_error}");
        assert!(t_error < 0.01, "{integrator}: {t_error}");
        assert!((k - 3.0).abs() < 6.0 * k_error + 0.02, "{integrator}: <v^4> = {k} +- {k_error}");
        assert!(k_error < 0.1, "{integrator}: {k_error}");
        assert!(shells.iter().all(|z| z.abs() < 5.0), "{integrator}: {shells:?}");
    }
}

/// The other integrators have known errors at Δt = 0.05 and γρ∫w²/(3m) = 2.51 for mass 1. A temperature
/// exceeds these bands by six standard errors less than once in 10^5 seeds.
#[test]
fn the_errors_of_the_others_show() {
    for (name, integrator) in Integrator::ALL {
        let [low, high] = match name {
            "velocity-verlet" => [0.02, 0.09],
            "groot-warren" => [0.005, 0.06],
            "dpd-vv" | "self-consistent" => [-0.02, 0.02],
            _ => continue,
        };
        let [t, error] = ideal_gas(integrator, 0.05).temperature;
        let off = t - 1.0;
        assert!(off > low - 6.0 * error && off < high + 6.0 * error, "{integrator}: {t} +- {error}");
        assert!(error < 0.01, "{integrator}: {error}");
    }
    // At twice the step the error exceeds six standard errors, and agrees with that of 2048 particles of both
    // masses in 4000 steps: 1.0701(12). (With mass 1 alone the temperature was 1.1086(9).)
    let [t, error] = ideal_gas(Integrator::VelocityVerlet, 0.1).temperature;
    assert!(t - 1.0 > 6.0 * error, "{t} +- {error}");
    assert!((t - 1.0701).abs() < 6.0 * error.hypot(0.0012), "{t} +- {error}");
}

/// Deviations of the energy without a thermostat, over several starts, at steps of 0.01 and an eighth of it.
/// The force-gradient step has a higher order, which depends on the kinks of this fluid's forces.
#[test]
fn without_thermostat_all_are_of_second_order() {
    let mut run = simulation(SET6, settled());
    let starts: Vec<State> = (0..4)
        .map(|_| {
            advance(&mut run, 50, 0.01, Integrator::VelocityVerlet);
            run.state().clone()
        })
        .collect();
    let energy = |run: &Simulation| run.potential_energy() + run.kinetic_energy();
    for (name, integrator) in Integrator::ALL {
        let deviation = |dt: f64| {
            let (mut squares, mut count) = (0.0, 0.0);
            for start in &starts {
                let mut run = simulation(SET6, start.clone());
                run.set_thermostat(false);
                run.prepare_for(integrator, dt, Want::TOTALS).unwrap();
                let first = energy(&run);
                for _ in 0..(0.4 / dt).round() as usize {
                    run.step(dt, integrator, Want::TOTALS).unwrap();
                    squares += (energy(&run) - first).powi(2);
                    count += 1.0;
                }
            }
            (squares / count).sqrt() / starts[0].len() as f64
        };
        let [coarse, fine] = [0.01, 0.00125].map(deviation);
        let order = (coarse / fine).log2() / 3.0;
        let orders = if name == "force-gradient" { 1.7..4.4 } else { 1.7..2.4 };
        assert!(orders.contains(&order), "{name}: order {order}: {coarse} and {fine}");
        // The two-stage integrator evaluates forces twice; its error of the energy is
        // less than half of that at the same cost.
        assert!(name != "two-stage" || coarse < 0.5 * 2e-3, "{coarse}");
    }
}

/// Mean pressure and temperature of standard DPD, a = 25, ρ = 3, kT = 1. The example programs of Allen and
/// Tildesley give 23.637(2) by Lowe–Andersen and 23.635(2) by Shardlow's method at Δt = 0.02. Blocks give
/// standard errors of at most 0.05. Six standard errors, plus 0.03 for the differences of finite steps, are
/// exceeded by chance once in 10^5 per case.
#[test]
fn pressures_are_those_of_other_codes() {
    const DPD: &str = "title = \"dpd\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\n\
        strength = 25\nrange = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
    let start = state_of(DPD, "[4.0, 4.0, 4.0]", 3.0);
    for (name, integrator) in Integrator::ALL {
        let dt = match name {
            "two-stage" | "force-gradient" => 0.04,
            "velocity-verlet" | "groot-warren" => 0.01,
            _ => 0.02,
        };
        let mut run = simulation(DPD, start.clone());
        run.prepare_for(integrator, dt, Want::FORCES).unwrap();
        run.advance((4.0 / dt) as u64, dt, integrator).unwrap();
        let samples = (25.0 / dt / 16.0) as usize;
        let blocks: Vec<[f64; 2]> = (0..16)
            .map(|_| {
                let mut sums = [0.0; 2];
                for _ in 0..samples {
                    run.advance(3, dt, integrator).unwrap();
                    run.step(dt, integrator, Want::TOTALS).unwrap();
                    sums[0] += run.scalar_pressure(run.conservative_pressure_tensor());
                    sums[1] += run.temperature();
                }
                sums.map(|sum| sum / samples as f64)
            })
            .collect();
        let of = |k: usize| {
            let mean = blocks.iter().map(|b| b[k]).sum::<f64>() / 16.0;
            let variance = blocks.iter().map(|b| (b[k] - mean).powi(2)).sum::<f64>() / 15.0;
            [mean, (variance / 16.0).sqrt()]
        };
        let [[p, p_error], [t, t_error]] = [of(0), of(1)];
        assert!((p - 23.636).abs() < 6.0 * p_error + 0.03, "{name}: p = {p} +- {p_error}");
        assert!(p_error < 0.05, "{name}: {p_error}");
        assert!((t - 1.0).abs() < 6.0 * t_error + 0.02, "{name}: T = {t} +- {t_error}");
        assert!(t_error < 0.01, "{name}: {t_error}");
    }
}

/// Consecutive steps with a deferred kick between them equal single steps. So do steps with energies at their ends.
#[test]
fn what_is_asked_for_changes_no_step() {
    let start = settled();
    for (name, integrator) in Integrator::ALL {
        let [mut single, mut row, mut asked] = [(); 3].map(|()| {
            let mut run = simulation(SET6, start.clone());
            run.set_reordering(true);
            run.prepare_for(integrator, 0.01, Want::FORCES).unwrap();
            run
        });
        for (dt, steps) in [(0.01, 5), (0.02, 3), (0.005, 34)] {
            for _ in 0..steps {
                single.step(dt, integrator, Want::FORCES).unwrap();
                asked.step(dt, integrator, Want::TOTALS).unwrap();
            }
            row.advance(steps, dt, integrator).unwrap();
            assert!(single.state() == row.state(), "{name}");
            assert!(single.state() == asked.state(), "{name}");
        }
        // Energies belong to the positions at the end of the step.
        let energy = asked.potential_energy();
        asked.compute(Want::TOTALS, None).unwrap();
        assert!((energy - asked.potential_energy()).abs() < 1e-9 * energy.abs(), "{name}");
    }
}

/// Forces prepared for another integrator are computed again.
#[test]
fn integrators_may_follow_each_other() {
    let start = settled();
    for (name, integrator) in Integrator::ALL {
        let [mut prepared, mut switched] = [(); 2].map(|()| simulation(SET6, start.clone()));
        let dragging = !["velocity-verlet", "groot-warren", "dpd-vv", "self-consistent"].contains(&name);
        let other = if dragging { Integrator::VelocityVerlet } else { Integrator::ALL[6].1 };
        prepared.prepare_for(integrator, 0.01, Want::FORCES).unwrap();
        switched.prepare_for(other, 0.01, Want::FORCES).unwrap();
        for run in [&mut prepared, &mut switched] {
            run.step(0.01, integrator, Want::FORCES).unwrap();
        }
        assert!(prepared.state() == switched.state(), "{name}");
    }
}

/// Steps of a tenth of the box give the same bits in a tilted box, and between walls, with frozen particles
/// and unequal masses: the thermostat finds all its pairs.
#[test]
fn noise_of_pairs_acts_at_every_kth_step() {
    let mut run = simulation(IDEAL, state_of(IDEAL, "[4.0, 4.0, 4.0]", 3.0));
    let coupling = Coupling { every: 4, ..Coupling::DEFAULT };
    let integrator = Integrator::TwoStage { lambda: 0.21, coupling };
    run.prepare_for(integrator, 0.01, Want::FORCES).unwrap();
    for step in 1..=12 {
        let before = run.state().v.to_vec();
        run.step(0.01, integrator, Want::FORCES).unwrap();
        assert_eq!(run.state().v != before, step % 4 == 0, "{step}");
    }
}

/// Where the thermostat over all pairs acts at the positions of the last forces, these list its pairs in mixed precision. Steps
/// whose virial is asked for have the same bits.
#[test]
fn forces_list_the_pairs_of_the_thermostat() {
    let start = settled();
    for precision in [Precision::Mixed, Precision::Double] {
        for (name, integrator) in Integrator::ALL {
            let [plain, asked] = [Want::FORCES, Want::TOTALS].map(|want| {
                let mut run = simulation(SET6, start.clone());
                run.set_settings(Settings { precision, ..run.settings() }).unwrap();
                run.prepare_for(integrator, 0.01, want).unwrap();
                (0..4).for_each(|_| run.step(0.01, integrator, want).unwrap());
                run
            });
            assert!(plain.state() == asked.state(), "{name}");
            let at_forces = ["aboba", "two-stage", "force-gradient"].contains(&name);
            assert!(!at_forces || plain.effort().updates > 0, "{name}");
            for effort in [plain.effort(), asked.effort()] {
                let expected = if at_forces { effort.updates } else { 0 };
                assert_eq!(effort.listed, expected, "{name}");
            }
        }
    }
}
