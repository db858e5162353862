//! Trial moves sample the canonical distribution, and resume where they stopped.

use super::*;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::model::pair::PairForm;
use psidpd_observe::Recorded;
use psidpd_observe::configurational;
use psidpd_observe::frame::Frame;
use std::f64::consts::PI;
use std::num::NonZeroUsize;

fn trials(sweeps: u64, max_move: Option<f64>) -> Integrator {
    Integrator::MonteCarlo { sweeps, max_move }
}

/// A model of two particles with ψ and φ.
const PAIR: &str = "title = \"two\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.9\n\
    [excess_free_energy]\nA = \"0.4*n^2\"\n\
    [[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = -8\nrange = 1\n";
/// Edge length of the box.
const EDGE: f64 = 2.4;

/// The energy of the two particles at distance `r`, from the model alone.
fn energy(r: f64) -> f64 {
    let fluid = Model::parse("m.toml", PAIR).unwrap().at(1.0).unwrap();
    let n = fluid.densities[0].kernel.value(r);
    let phi = if r < 1.0 { fluid.pairs[0].potential.at(r).0 } else { 0.0 };
    0.8 * n * n + phi
}

fn pair(periodic: [bool; 3], x: [[f64; 3]; 2]) -> State {
    let domain = PeriodicBox::orthogonal([0.0; 3], [EDGE; 3], periodic).unwrap();
    State::at_rest(domain, vec![1.0], x.to_vec())
}

/// χ² of counts for expected weights, whose common factor is fitted.
fn chi_square(counts: &[f64], weights: &[f64]) -> f64 {
    let factor = counts.iter().sum::<f64>() / weights.iter().sum::<f64>();
    counts.iter().zip(weights).map(|(n, w)| (n - factor * w).powi(2) / (factor * w)).sum()
}

/// The distance of two particles has the distribution r² exp(−U(r)/kT). With eleven bins χ² is above 35.6
/// once in 10⁴ seeds, if samples are independent: moves up to half the box lose their memory in 40 trials.
#[test]
fn two_particles_have_their_boltzmann_distribution() {
    let kt = 0.3;
    let start = pair([true; 3], [[0.3; 3], [1.0; 3]]);
    let mut run = Simulation::new(&Model::parse("m.toml", PAIR).unwrap(), kt, start, 3).unwrap();
    let (bins, half) = (10usize, 0.5 * EDGE);
    let mut counts = vec![0.0; bins + 1];
    for _ in 0..20_000 {
        run.step(1.0, trials(20, Some(half)), Want::FORCES).unwrap();
        let d = run.state().domain.minimum_image(run.state().x[0], run.state().x[1]);
        let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        counts[((r / half * bins as f64) as usize).min(bins)] += 1.0;
    }
    let mut weights = vec![0.0; bins + 1];
    let fine = 200 * bins;
    for k in 0..fine {
        let r = half * (k as f64 + 0.5) / fine as f64;
        weights[k / 200] += 4.0 * PI * r * r * (-energy(r) / kt).exp() * half / fine as f64;
    }
    weights[bins] = EDGE.powi(3) - 4.0 / 3.0 * PI * half.powi(3);
    let chi = chi_square(&counts, &weights);
    assert!(chi < 35.6, "{chi}: {counts:?} {weights:?}");
    // Without the energy the distribution differs widely.
    let free: Vec<f64> = (0..bins).map(|k| ((k + 1) as f64).powi(3) - (k as f64).powi(3)).collect();
    assert!(chi_square(&counts[..bins], &free) > 1000.0);
}

/// One particle near a frozen one on a wall: the density across the box is ∫∫ exp(−U/kT), also next to the
/// walls, which short moves often hit. With eight bins χ² is above 29.9 once in 10⁴ seeds.
#[test]
fn walls_turn_nothing_away_that_belongs_there() {
    let kt = 0.3;
    let frozen = [1.1, 1.2, 0.2];
    let start = pair([true, true, false], [frozen, [0.5; 3]]);
    let mut run = Simulation::new(&Model::parse("m.toml", PAIR).unwrap(), kt, start, 5).unwrap();
    run.set_frozen(&crate::particles::Tags::Ranges(vec![1..=1]));
    let (mut counts, mut heat) = ([0.0; 8], 0.0);
    for _ in 0..10_000 {
        run.step(1.0, trials(20, Some(0.7)), Want::FORCES).unwrap();
        assert_eq!((run.state().x[0], run.state().v[0]), (frozen, [0.0; 3]));
        counts[(run.state().x[1][2] / EDGE * 8.0) as usize] += 1.0;
        heat += run.temperature() / 10_000.0;
    }
    // No momentum is conserved: the mean of 30 000 squared velocities deviates by 4 % once in 10⁶ seeds.
    assert!((heat / kt - 1.0).abs() < 0.04, "{heat}");
    let (mut weights, fine) = ([0.0; 8], 80);
    let at = |k: usize| EDGE * (k as f64 + 0.5) / fine as f64;
    for z in 0..fine {
        for y in 0..fine {
            for x in 0..fine {
                let d = run.state().domain.minimum_image([at(x), at(y), at(z)], frozen);
                weights[z / 10] += (-energy((d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()) / kt).exp();
            }
        }
    }
    let chi = chi_square(&counts, &weights);
    assert!(chi < 29.9, "{chi}: {counts:?} {weights:?}");
}

/// Means and standard errors of 20 blocks: configurational temperature, energy per particle, conservative
/// pressure, and kT from the velocities.
fn averages(run: &mut Simulation, integrator: Integrator, steps: usize) -> [[f64; 2]; 4] {
    let evaluator = Evaluator::new(run.model().at(run.kt()).unwrap()).unwrap();
    let blocks: Vec<[f64; 4]> = (0..20)
        .map(|_| {
            let mut sums = [0.0; 5];
            for _ in 0..steps {
                run.step(1.0, integrator, Want::TOTALS).unwrap();
                let [squares, laplacians] = configurational::sums(&Frame::new(run.view(0.0), &evaluator));
                sums[0] += squares;
                sums[1] += laplacians;
                sums[2] += run.potential_energy() / run.len() as f64;
                sums[3] += run.scalar_pressure(run.conservative_pressure_tensor());
                sums[4] += run.temperature();
            }
            [sums[0] / sums[1], sums[2] / steps as f64, sums[3] / steps as f64, sums[4] / steps as f64]
        })
        .collect();
    std::array::from_fn(|k| {
        let mean = blocks.iter().map(|b| b[k]).sum::<f64>() / 20.0;
        let variance = blocks.iter().map(|b| (b[k] - mean).powi(2)).sum::<f64>() / 19.0;
        [mean, (variance / 20.0).sqrt()]
    })
}

/// Equilibrates a state by trial moves, and tunes their length.
fn at_rest(model: &str, state: State, kt: f64, sweeps: u64) -> Simulation {
    let mut run = Simulation::new(&Model::parse("m.toml", model).unwrap(), kt, state, 11).unwrap();
    run.set_settling(true);
    run.advance(sweeps, 1.0, trials(1, None)).unwrap();
    run.set_settling(false);
    run
}

fn within(found: [f64; 2], expected: f64, error: f64) {
    let [value, own] = found;
    assert!((value - expected).abs() < 5.0 * own.hypot(error), "{value} +- {own}, not {expected}");
}

/// The reference is another program's Monte Carlo of the same liquid, ρ = 3098/8³: u = −13.0796(6),
/// conservative pressure −1.259(10). Student's t of 19 degrees of freedom exceeds 5 once in 10⁴ seeds, so
/// that the test fails by chance for one seed in 2500.
#[test]
fn warrens_liquid_has_its_energy_and_pressure() {
    let count = 400;
    let edge = 8.0 * (f64::from(count) / 3098.0).cbrt();
    let start = state_of(SET6, &format!("[{edge}, {edge}, {edge}]"), 3098.0 / 512.0);
    assert_eq!(start.len(), 400);
    let mut run = at_rest(SET6, start, 1.0, 500);
    assert!((run.acceptance() - 0.4).abs() < 0.1, "{}", run.acceptance());
    let [t_conf, u, p, t] = averages(&mut run, trials(5, None), 15);
    within(t_conf, 1.0, 0.0);
    within(t, 1.0, 0.0);
    within(u, -13.0796, 0.0006);
    within(p, -1.259, 0.01);
    assert!(t_conf[1] < 0.01 && u[1] < 0.02 && p[1] < 0.3, "{t_conf:?} {u:?} {p:?}");
}

/// The configurational temperature in two dimensions, of a mixture, and between walls. The rate of false
/// alarms per value is that of the previous test.
#[test]
fn configurations_have_the_temperature_of_other_fluids() {
    let flat = state_of(VAN_DER_WAALS, "[5.0, 5.0]", 12.0);
    let mixture = include_str!("../../../../models/binary-2d.toml");
    let mixed = state_of(mixture, "[8.0, 8.0]", 4.0);
    for (model, state, kt) in [(VAN_DER_WAALS, flat, 1.0), (mixture, mixed, 3.0)] {
        assert_eq!(state.domain.edge(2)[2], 1.0);
        let mut run = at_rest(model, state, kt, 200);
        let [t_conf, _, _, t] = averages(&mut run, trials(3, None), 20);
        within(t_conf, kt, 0.0);
        within(t, kt, 0.0);
        assert!(t_conf[1] < 0.05 * kt, "{t_conf:?}");
    }
}

/// Momentum is transported by conservative forces and by the velocities at the end of a step, in a slab too.
#[test]
fn the_carried_pressure_is_the_conservative_one() {
    let text = "title = \"s\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 3\nbox = [3.0, 3.0, 6.0]\nsteps = 3\n\
        integrator = \"monte-carlo\"\n[initial]\nkind = \"slab\"\nthickness = 3.0\ndensity = 6.0\n";
    let scene = support::scene(SET6, text).unwrap();
    let evaluator = Evaluator::new(scene.model.at(1.0).unwrap()).unwrap();
    let mut run = scene.simulation(scene.initial_state()).unwrap();
    run.record_flux(Recorded::Lines);
    for _ in 0..3 {
        run.step(1.0, trials(20, Some(0.1)), Want::TOTALS).unwrap();
        let frame = Frame::new(run.view(0.0), &evaluator);
        let (carried, conservative) = (frame.carried_pressure().unwrap(), frame.view.conservative_pressure);
        for (a, b) in carried.iter().zip(conservative) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{carried:?} {conservative:?}");
        }
    }
}

/// Velocities of a species have the variance kT/m of its own mass: of 2 × 3 × 2000 squares the mean deviates by 6 % once in
/// 10⁶ seeds. Seeds differ in velocities and moves; the same seed repeats them.
#[test]
fn each_species_has_the_velocities_of_its_mass() {
    let kt = 0.7;
    let domain = PeriodicBox::orthogonal([0.0; 3], [9.0; 3], [true; 3]).unwrap();
    let x: Vec<[f64; 3]> = (0..200).map(|k| [0.04 * f64::from(k), 1.0, f64::from(k % 9)]).collect();
    let species: Vec<i32> = (0..200).map(|k| i32::from(k % 4 == 0)).collect();
    let begin = |seed| {
        let mut state = State::at_rest(domain.clone(), vec![1.0, 5.0], x.clone());
        state.species.clone_from(&species);
        Simulation::new(&Model::parse("m.toml", support::IDEAL_MIXTURE).unwrap(), kt, state, seed).unwrap()
    };
    let mut run = begin(1);
    let (mut heat, steps) = ([0.0; 2], 40);
    for _ in 0..steps {
        run.step(1.0, trials(1, Some(0.5)), Want::FORCES).unwrap();
        for (v, s) in run.state().v.iter().zip(&run.state().species) {
            heat[*s as usize] += v.iter().map(|v| v * v).sum::<f64>() / 3.0;
        }
    }
    for (heat, (count, mass)) in heat.iter().zip([(150.0, 1.0), (50.0, 5.0)]) {
        // One total momentum is taken away, in proportion to masses.
        let rest = 1.0 - mass / (150.0 + 50.0 * 5.0);
        let found = heat / (count * f64::from(steps)) * mass / (kt * rest);
        assert!((found - 1.0).abs() < 0.06, "{mass}: {found}");
    }
    let after = |seed| {
        let mut run = begin(seed);
        run.step(1.0, trials(1, Some(0.5)), Want::FORCES).unwrap();
        run.state().clone()
    };
    let [one, same, other] = [1, 1, 2].map(after);
    assert!(one.x == same.x && one.v == same.v);
    let differ = |a: &[[f64; 3]], b: &[[f64; 3]]| a.iter().zip(b).all(|(a, b)| a != b);
    assert!(differ(&one.x, &other.x) && differ(&one.v, &other.v));
}

/// Where the energy is in proportion to kT moves do not depend on the temperature, also after it has changed.
#[test]
fn a_new_temperature_is_that_of_the_energy_too() {
    let model = "title = \"athermal\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
        [excess_free_energy]\nA = \"0.5*kT*n^2\"\n";
    let x: Vec<[f64; 3]> = (0..20).map(|k| [k % 3, k / 3 % 3, k / 9].map(|c| 0.8 * f64::from(c))).collect();
    let [constant, changed] = [[2.0, 2.0], [0.02, 2.0]].map(|temperatures| {
        let domain = PeriodicBox::orthogonal([0.0; 3], [EDGE; 3], [true; 3]).unwrap();
        let state = State::at_rest(domain, vec![1.0], x.clone());
        let mut run =
            Simulation::new(&Model::parse("m.toml", model).unwrap(), temperatures[0], state, 8).unwrap();
        for kt in temperatures {
            run.set_temperature(kt).unwrap();
            run.step(1.0, trials(20, Some(0.4)), Want::FORCES).unwrap();
        }
        assert!((0.1..0.9).contains(&run.acceptance()), "{}", run.acceptance());
        run.state().x.clone()
    });
    for (a, b) in constant.iter().zip(&changed) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-9), "{constant:?} {changed:?}");
    }
}

/// Tuned moves lead from whatever length to the stated acceptance, and then stay as long as they are: moves whose length depends
/// on what was accepted would not keep the distribution.
#[test]
fn the_length_of_moves_is_tuned_while_settling_alone() {
    let start = state_of(SET6, "[2.5, 2.5, 2.5]", 6.05);
    let mut run = at_rest(SET6, start, 1.0, 60);
    let tuned = run.max_move();
    assert!((0.25..0.55).contains(&run.acceptance()), "{}", run.acceptance());
    // Half as long as tuned, so that tuning would lengthen them.
    for length in [tuned, tuned.map(|length| 0.5 * length)] {
        run.set_max_move(length);
        for _ in 0..10 {
            run.step(1.0, trials(2, None), Want::FORCES).unwrap();
            assert_eq!(run.max_move(), length);
        }
    }
    run.set_settling(true);
    run.step(1.0, trials(2, None), Want::FORCES).unwrap();
    assert!(run.max_move() > tuned.map(|length| 0.5 * length));
}

/// Fractional powers need densities that are zero, not nearly: in a gas pairs part in every sweep.
#[test]
fn a_gas_with_fractional_powers_runs() {
    let gas = |psi: &str| {
        format!(
            "title = \"gas\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
             [excess_free_energy]\nA = \"{psi}\"\n"
        )
    };
    for psi in ["0.5*n^2.5", "sqrt(n)", "n^1.5 - 0.1*n^0.3"] {
        let state = state_of(&gas(psi), "[8.0, 8.0, 8.0]", 0.2);
        let mut run = simulation(&gas(psi), state);
        run.step(1.0, trials(300, Some(0.5)), Want::FORCES).unwrap_or_else(|e| panic!("{psi}: {e}"));
    }
}

const SCENE: &str = "[[stage]]\nname = \"rest\"\nsteps = 6\nintegrator = \"monte-carlo\"\n\
    [[stage]]\nname = \"run\"\nsteps = 4\nintegrator = \"monte-carlo\"\nsweeps = 3\n[output]\nthermo = 2\ndump = 2\n";

/// Results do not depend on threads; the length of moves is tuned in the first stage and constant in the second.
#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let scene = scene_of(SET6, "[8.0, 8.0, 8.0]", 6.05, SCENE).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let files = [1, 3].map(|threads| {
        let out = folder.path().join(threads.to_string());
        let mut runner = Runner::begin(&scene, &out, Begin::New).unwrap();
        runner.set_threads(NonZeroUsize::new(threads).unwrap()).unwrap();
        runner.run(&std::sync::atomic::AtomicUsize::new(0), &mut |_| ()).unwrap();
        ["thermo.csv", "dump.lammpstrj", "final.data"].map(|name| std::fs::read(out.join(name)).unwrap())
    });
    assert!(files[0] == files[1]);
    let found: Vec<bool> = (0..2).flat_map(|stage| [0, 3].map(|done| scene.settles(stage, done))).collect();
    assert_eq!(found, [true, true, false, false]);
    let only =
        scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, &SCENE.replacen("\"monte-carlo\"", "\"aboba\"", 1)).unwrap();
    assert_eq!([0, 1].map(|done| only.settles(1, done)), [true, false]);
}

#[test]
fn keys_without_meaning_are_refused_where_they_stand() {
    let refused = |rest: &str, what: &str| {
        let error = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, rest).unwrap_err().to_string();
        assert!(error.contains(what) && error.contains("s.toml:"), "{error}");
    };
    let stage =
        |keys: &str| format!("[[stage]]\nname = \"a\"\nsteps = 5\nintegrator = \"monte-carlo\"\n{keys}\n");
    refused(&stage("dt = 0.01"), "monte-carlo has no dt");
    refused(&stage("thermostat = false"), "no thermostat to switch off");
    refused(&stage("lambda = 0.2"), "monte-carlo has no lambda");
    refused(&stage("thermostat_step = \"midpoint\""), "has no thermostat_step");
    refused(&stage("thermostat_every = 2"), "has no thermostat_every");
    refused(&stage("noise = \"uniform\""), "has no noise");
    refused(&stage("sweeps = 0"), "at least 1");
    refused(&stage("max_move = 0.0"), "positive");
    refused(
        &stage("").replace("monte-carlo", "aboba\"\nsweeps = \"2").replace("\"2\"", "2"),
        "aboba has no sweeps",
    );
    refused(
        &stage("").replace("monte-carlo", "aboba\"\nmax_move = \"2").replace("\"2\"", "2"),
        "aboba has no max_move",
    );
    refused(&(stage("") + "[[body_force]]\nacceleration = [0.0, 0.0, 0.1]\n"), "body forces");
    for meter in ["msd", "viscosity", "velocity_profile"] {
        refused(&(stage("") + &format!("[observe]\n{meter} = true\n")), "motion in time");
    }
    let top = |keys: &str| {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nbox = 3.0\ndensity = 6.0\nsteps = 5\nintegrator = \"monte-carlo\"\n{keys}"
        );
        support::scene(SET6, &text)
    };
    assert!(top("dt = 0.01\n").unwrap_err().to_string().contains("monte-carlo has no dt"));
    assert_eq!(top("sweeps = 7\n").unwrap().stages[0].integrator, trials(7, None));
    let stated = "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
        [excess_free_energy]\nA = { energy = \"n\", slopes = { n = \"n\" } }\n";
    let error = scene_of(stated, "[3.0, 3.0, 3.0]", 3.0, &stage("")).unwrap_err().to_string();
    assert!(error.contains("needs an energy") && error.contains("s.toml:"), "{error}");
}

/// Trial moves accept any finite energy after an infinite one; a NaN stops the run.
#[test]
fn starts_without_energy() {
    let overlap = "title = \"m\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\n\
        phi = \"(1 - r)^2/r^30\"\nrange = 1.0\n";
    let mut run = simulation(overlap, pair([true; 3], [[0.5; 3]; 2]));
    let integrator = trials(10, Some(0.2));
    run.prepare_for(integrator, 1.0, Want::TOTALS).unwrap();
    assert_eq!(run.potential_energy(), f64::INFINITY);
    run.step(1.0, integrator, Want::TOTALS).unwrap();
    assert!(run.potential_energy().is_finite() && run.state().x[0] != run.state().x[1]);
    let pole = "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
        [excess_free_energy]\nA = \"-ln(1 - n)\"\n";
    let mut run = simulation(pole, pair([true; 3], [[0.5; 3]; 2]));
    let error = run.step(1.0, trials(1, None), Want::FORCES).unwrap_err().to_string();
    assert!(error.contains("step 1") && error.contains("particle 1"), "{error}");
}

/// Without forces a particle goes where it likes, by at most the furthest move in a sweep, with the boxes that it crosses counted; what
/// is frozen stays; and before faces a quarter of moves up to half of the box is turned away, and counts as a trial.
#[test]
fn moves_are_counted_across_faces_and_before_walls() {
    let model = Model::parse("m.toml", IDEAL).unwrap();
    let most = 0.5 * EDGE;
    let mut run = Simulation::new(&model, 0.7, pair([true; 3], [[0.3; 3], [1.0; 3]]), 3).unwrap();
    run.set_frozen(&Tags::Ranges(vec![2..=2]));
    let unwrapped = |run: &Simulation, k: usize| -> [f64; 3] {
        let state = run.state();
        std::array::from_fn(|c| state.x[k][c] + EDGE * f64::from(state.image[k][c]))
    };
    let (mut before, mut farthest) = (unwrapped(&run, 0), 0.0f64);
    for _ in 0..500 {
        run.step(1.0, trials(1, Some(most)), Want::FORCES).unwrap();
        let now = unwrapped(&run, 0);
        for c in 0..3 {
            assert!((now[c] - before[c]).abs() <= most * (1.0 + 1e-9), "{before:?} {now:?}");
            farthest = farthest.max(now[c].abs());
        }
        before = now;
        assert_eq!((run.state().x[1], run.state().image[1]), ([1.0; 3], [0; 3]));
        assert_eq!(run.acceptance(), 1.0);
    }
    assert!(farthest > 2.0 * EDGE, "{farthest}");
    let mut run = Simulation::new(&model, 0.7, pair([true, true, false], [[0.3; 3], [1.0; 3]]), 3).unwrap();
    let mut accepted = 0.0;
    for _ in 0..400 {
        run.step(1.0, trials(50, Some(most)), Want::FORCES).unwrap();
        accepted += run.acceptance() / 400.0;
    }
    // 40 000 trials, with a standard error below 0.005.
    assert!((accepted - 0.75).abs() < 0.02, "{accepted}");
}
