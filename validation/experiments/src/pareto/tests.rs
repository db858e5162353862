use super::*;
use crate::shipped::{SET6, STANDARD};
use std::path::Path;

/// A scene of a model from the seed 3.
fn scene(model: &str, text: &str) -> Scene {
    let text = format!("model = \"m.toml\"\nseed = 3\n{text}");
    crate::test_support::scene(model, &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

const TINY: &str = "kT = 1.0\nbox = 4.0\ndensity = 6.05\nequilibrate = 200\nsteps = 500\ndt = 0.01\n";

fn tiny() -> Scene {
    scene(SET6, TINY)
}

/// Where runs of a scene begin, after at most so many seconds.
fn origin(scene: &Scene, seconds: f64) -> Origin<'_> {
    Origin::of(scene, Duration::from_secs_f64(seconds), NonZeroUsize::MIN).unwrap()
}

fn options(folder: &Path, tolerances: &[&str]) -> Options {
    Options {
        minutes: 1.0,
        choice: Choice::Few,
        threads: vec![NonZeroUsize::MIN],
        tolerances: tolerances.iter().map(|t| t.parse().unwrap()).collect(),
        lammps: false,
        fixed: Some((Effort::Samples(60), Pace { rounds: 2, seconds: 0.01 })),
        out: folder.join("out"),
        existing: Default::default(),
    }
}

/// 387 particles: T is known to 4 % in a sample, to 0.6 % in 48 of them, u to 0.6 % of kT. Velocity Verlet is off by 0.5 % in T at 0.01
/// and far off or unstable at 0.04, two-stage by less than 1 % at 0.02. The seed is fixed.
#[test]
fn longer_steps_err_more_and_all_results_agree() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(&tiny(), &options(folder.path(), &["T=10%", "u=10%"]), &Progress::new()).unwrap();
    let of = |name: &str, dt: f64| {
        outcome.points.iter().find(|p| p.integrator.starts_with(name) && p.dt == dt).unwrap()
    };
    let error = |p: &Point, name: &str| match p.stable {
        false => f64::INFINITY,
        true => p.errors.iter().find(|d| d.name == name).unwrap().value.abs(),
    };
    let (short, long) = (of("velocity-verlet", 0.01), of("velocity-verlet", 0.04));
    for name in ["T_kin", "u", "p_carried"] {
        assert!(error(long, name) > error(short, name) + 0.05, "{name}: {short:?} {long:?}");
    }
    let tolerances = &outcome.tolerances[..];
    for good in [of("two-stage", 0.02), of("force-gradient", 0.04)] {
        assert!(good.is_within(tolerances) && !good.is_within(&[]), "{good:?}");
        assert!(good.worst.as_ref().unwrap().ratio < 1.0);
    }
    let names: Vec<&str> = short.errors.iter().map(|d| d.name.as_str()).collect();
    for wanted in ["u", "p_conservative", "p_carried", "T_kin", "T_conf", "D", "g"] {
        assert!(names.contains(&wanted), "{names:?}");
    }
    // The reference of configurations has no time step, and its two pressures are one.
    assert!(outcome.reference.what.starts_with("monte-carlo") && outcome.reference.dt.is_none());
    let value = |name: &str| outcome.reference.values.iter().find(|d| d.name == name).unwrap().measured.value;
    assert!((value("p_carried") - value("p_conservative")).abs() < 1e-6);
    assert_eq!(outcome.reference_of_dynamics.as_ref().unwrap().dt, Some(0.01));

    // The recommendation is the cheapest of the points that are within.
    let recommended = outcome.recommended.as_ref().unwrap();
    let best = &outcome.points[recommended.point];
    let cost = |p: &Point| p.cost.unwrap().value;
    for p in outcome.points.iter().filter(|p| p.stable) {
        assert!(!p.is_within(tolerances) || cost(p) >= cost(best));
    }
    let lines = &recommended.scene;
    let again = scene(SET6, &format!("kT = 1.0\nbox = 4.0\ndensity = 6.05\nsteps = 5\n{lines}"));
    assert_eq!(again.stages[0].integrator, best.setting.physics.integrator);
    assert_eq!((again.stages[0].dt, again.precision()), (best.dt, best.setting.physics.precision));
    assert!(page::recommendation(&outcome).contains(lines));

    // The table and the JSON tell the same.
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("out/pareto.json")).unwrap())
            .unwrap();
    let found = &json["points"][recommended.point];
    assert_eq!((&found["code"], &found["stable"]), (&"native".into(), &true.into()));
    assert_eq!(found["dt"], best.dt);
    assert_eq!(found["cost"]["value"], cost(best));
    assert!(found["cost"]["error"].is_f64() && found["front"].is_boolean());
    for d in &best.errors {
        let error = &found["errors"][&d.name];
        assert_eq!((error["value"].as_f64(), error["error"].as_f64()), (Some(d.value), Some(d.error)));
    }
    assert_eq!(json["tolerance"], serde_json::json!({"T": 0.1, "u": 0.1}));
    assert_eq!(json["recommended"]["scene"], lines.as_str());
    let table = page::table(&outcome);
    assert_eq!(table.rows.len(), outcome.points.len() + 2);
    let row = table.rows.iter().find(|row| row[0] == best.name() && row[1] == best.dt.to_string()).unwrap();
    assert!(row[4].starts_with(&format!("{:.4}", cost(best))), "{row:?}");

    // Figures name quantities and units, and have the time step beside the recommended setting or another of the front.
    let page = std::fs::read_to_string(folder.path().join("out/pareto.html")).unwrap();
    for label in [
        "wall time per unit of simulated time [s]",
        "worst error over its tolerance",
        "error of the energy per particle u [% of kT]",
        "largest error of the pressure p [% of ρkT]",
    ] {
        assert!(page.contains(label), "{label}");
    }
    let first = page.split("</svg>").next().unwrap();
    let noted = |p: &Point| first.lines().any(|line| line.trim() == p.dt.to_string());
    assert!(outcome.points.iter().any(|p| p.front && noted(p)), "{first}");
}

/// Without tolerances all is judged that these short runs resolve, each to 1, 2, 5 or 10 % or a doubling of these, and the rest is named:
/// a diffusion coefficient of sixty samples is not resolved so well. There is an answer.
#[test]
fn all_that_is_resolved_is_judged() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(&tiny(), &options(folder.path(), &[]), &Progress::new()).unwrap();
    assert!(outcome.unresolved.contains(&"D".to_owned()), "{:?}", outcome.unresolved);
    for t in &outcome.tolerances {
        assert!((0.01..=0.2).contains(&t.bound) && !outcome.unresolved.contains(&t.name), "{t:?}");
    }
    assert!(page::recommendation(&outcome).contains("Not judged") && outcome.recommended.is_some());
}

#[test]
fn what_is_not_measured_has_no_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let mut options = options(folder.path(), &["sigma=1%"]);
    options.fixed = Some((Effort::Samples(4), Pace { rounds: 1, seconds: 0.001 }));
    assert!(
        matches!(run(&tiny(), &options, &Progress::new()), Err(ExperimentError::Unmeasured(name)) if name == "sigma")
    );
}

/// Lines of a script are there for the steps that LAMMPS has, and for no others.
#[test]
fn lammps_lines_are_those_that_lammps_can_run() {
    let scene = tiny();
    let origin = origin(&scene, 1.0);
    for physics in setting::physics(Choice::Few) {
        let lines = recommend::lammps_lines(&origin, &physics);
        match physics.integrator {
            Integrator::VelocityVerlet => {
                let lines = lines.unwrap();
                for wanted in ["pair_style    dpd/psi", "timestep", "fix "] {
                    assert!(lines.contains(wanted), "{lines}");
                }
                assert!(lines.contains(&format!("timestep      {:?}", origin.dt(&physics))));
            }
            integrator => {
                assert_eq!(
                    lines.is_ok(),
                    integrator.properties().lammps != psidpd_dynamics::integrator::Counterpart::None
                )
            }
        }
    }
}

/// A script for LAMMPS's own style is that of the plugin but for the style, and has more commands before its last run alone.
#[test]
fn a_script_can_have_another_style_and_more_output() {
    use psidpd_lammps_host::export::lammps::{Script, script_of};
    let scene = tiny();
    let usual = script_of(&scene, Script::default()).unwrap();
    let [own, more] = ["pair_style mdpd\n", "thermo 7\n"];
    let script =
        Script { plugin: false, style: Some(("mdpd", own)), before_last_run: more, final_data: false };
    let changed = script_of(&scene, script).unwrap();
    let gone: Vec<&str> = usual.lines().filter(|line| !changed.lines().any(|l| l == *line)).collect();
    let [atoms, newton, comments @ .., load, style, pairs, data] = &gone[..] else { panic!("{gone:?}") };
    assert!(comments.len() == 4 && comments.iter().all(|line| line.starts_with('#')), "{comments:?}");
    assert!(*newton == "newton        off" && changed.contains("\nnewton        on\n"));
    assert!(*atoms == "atom_style    atomic" && load.starts_with("plugin  "));
    assert!(style.starts_with("pair_style    dpd/psi") && pairs.starts_with("pair_coeff"));
    assert!(data.starts_with("write_data"));
    assert!(changed.contains("\natom_style    mdpd\n") && changed.matches(own).count() == 1);
    // The scene has two stages.
    assert_eq!(changed.matches("run           ").count(), 2);
    assert!(changed.ends_with("thermo 7\nrun           500\n") && changed.matches(more).count() == 1);
}

/// A code whose energy is off by so many kT, known to an error, and whose unit of time took these seconds in three rounds.
fn fake(host: Host, multiple: f64, off: [f64; 2], rounds: [f64; 3]) -> Point {
    let exact = |value| psidpd_observe::Measured { value, error: 0.0 };
    let of = |u: psidpd_observe::Measured| Quantities::of([(quantity::Class::Energy, "u", u)], &[], 3);
    // An energy of -20 at kT = 2.
    let run = of(psidpd_observe::Measured { value: -20.0 + 2.0 * off[0], error: 2.0 * off[1] });
    let known = Known { kt: 2.0, temperature: true, ideal_pressure: 12.0 };
    let physics = Physics { multiple, ..setting::physics(Choice::Few)[0] };
    let setting = Setting { host, physics, threads: NonZeroUsize::MIN };
    Point {
        code: host,
        integrator: format!("code {multiple}"),
        dt: 0.01 * multiple,
        precision: physics.precision.to_string(),
        threads: 1,
        cost: Cost::of(&rounds),
        samples: 100,
        time: 10.0,
        errors: deviations(&run, &of(exact(-20.0)), known),
        worst: None,
        stable: true,
        unstable: None,
        front: false,
        setting,
    }
}

/// Codes of known error and cost: what the instrument says of them follows by hand. Tolerance 1 % of kT.
///
/// | code | u off, kT | cost | |
/// |---|---|---|---|
/// | 1 | 3.0(1) % | 1 | on the front, beyond |
/// | 2 | 0.9(1) % | 2 | on the front; with two errors 1.1 %: not within |
/// | 3 | 0.5(1) % | 3 | on the front; the cheapest within |
/// | 4 | 0.6(1) % | 4 | beaten by 3 |
/// | 5 | 0.1(1) % | 5 | not resolved: shown at 0.3 %; on the front |
/// | 6 | 0.0 | 0.1 | LAMMPS's own law: another fluid |
/// | 7 | 0.0 | 0.1 | stopped |
#[test]
fn codes_of_known_error_and_cost_are_told_as_they_are() {
    let code = |k: f64, u: f64| fake(Host::Native, k, [u, 0.001], [k, k, 1.2 * k]);
    let mut points = vec![
        code(1.0, 0.03),
        code(2.0, -0.009),
        code(3.0, 0.005),
        code(4.0, -0.006),
        code(5.0, 0.001),
        fake(Host::Lammps, 6.0, [0.0, 1e-6], [0.1; 3]),
        Point { stable: false, ..fake(Host::Native, 7.0, [0.0, 1e-6], [0.1; 3]) },
    ];
    let tolerances: Vec<Tolerance> = vec!["u=1%".parse().unwrap()];
    front::mark(&mut points, &tolerances);
    let front: Vec<bool> = points.iter().map(|p| p.front).collect();
    assert_eq!(front, [true, true, true, false, true, false, false]);
    let within: Vec<bool> = points.iter().map(|p| p.is_within(&tolerances)).collect();
    assert_eq!(within, [false, false, true, true, true, true, true]);
    assert_eq!(front::cheapest(&points, &tolerances, &[Host::Native]), Some(2));
    let tight: Vec<Tolerance> = vec!["u=0.01%".parse().unwrap()];
    assert_eq!(front::cheapest(&points[..5], &tight, &[Host::Native]), None);

    let errors: Vec<[f64; 2]> = points[..5].iter().map(|p| [p.errors[0].value, p.errors[0].error]).collect();
    let expected = [[0.03, 0.001], [-0.009, 0.001], [0.005, 0.001], [-0.006, 0.001], [0.001, 0.001]];
    for (found, expected) in errors.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 1e-12, "{errors:?}");
    }
    let ratios: Vec<f64> = points[..5].iter().map(|p| p.worst.as_ref().unwrap().ratio).collect();
    for (found, expected) in ratios.iter().zip([3.0, 0.9, 0.5, 0.6, 0.3]) {
        assert!((found - expected).abs() < 1e-9, "{ratios:?}");
    }
    // Rounds of 3, 3 and 3.6 seconds.
    let cost = points[2].cost.unwrap();
    assert!((cost.value - 3.0).abs() < 1e-12 && (cost.error - 0.3).abs() < 1e-12, "{cost:?}");
}

/// Without tolerances each quantity has the smallest of 1, 2, 5 and 10 % of which errors use at most half: by two of them 0.2 % has 1 %,
/// 0.45 % has 2 %, 1.2 % has 5 %, 2 % has 10 % and 3 % none; by four 0.2 % has 2 %; and 0.6 % has 1 % if it will fall to 0.4 of that.
#[test]
fn usual_tolerances_are_such_as_can_be_kept() {
    let of = |error: f64, forecast: f64, margin: f64| {
        let points = [fake(Host::Native, 1.0, [0.0, error], [1.0; 3])];
        let (tolerances, vague) = front::usual(&points, forecast, margin);
        tolerances.first().map(|t| t.bound).ok_or(vague)
    };
    let found = [0.002, 0.0045, 0.012, 0.02].map(|error| of(error, 1.0, 2.0));
    assert_eq!(found, [Ok(0.01), Ok(0.02), Ok(0.05), Ok(0.1)]);
    assert_eq!(of(0.03, 1.0, 2.0), Err(vec!["u".to_owned()]));
    assert_eq!((of(0.002, 1.0, 4.0), of(0.006, 0.4, 2.0)), (Ok(0.02), Ok(0.01)));
}

/// With two errors of 0.1 % each, 1.5 % is within 2 % and 3.5 % within 4 %; what is 50 % off is never within.
#[test]
fn tolerances_that_nobody_keeps_are_doubled() {
    let of = |off: f64| {
        let points = [fake(Host::Native, 1.0, [off, 0.001], [1.0; 3])];
        front::widened(&points, &["u=1%".parse().unwrap()])[0].bound
    };
    assert_eq!([0.005, 0.015, 0.035, 0.5].map(of), [0.01, 0.02, 0.04, 0.2]);
}

/// What is known of a scene: ρkT of 192 particles in a box of 4³ at kT = 2; temperatures, unless it flows.
#[test]
fn what_is_known_follows_from_the_scene() {
    let of = |more: &str| scene(STANDARD, &format!("kT = 2.0\nbox = 4.0\ndensity = 3.0\n{more}"));
    let stages = "[[stage]]\nname = \"first\"\nsteps = 20\ndt = 0.01\n[[stage]]\nname = \"second\"\nsteps = 20\ndt = 0.005\n\
                  [[stage]]\nname = \"alone\"\nsteps = 20\ndt = 0.01\nthermostat = false\n";
    let rest = of(stages);
    let at_rest = origin(&rest, 60.0);
    // The last stage with a thermostat is measured.
    assert_eq!((at_rest.stage.name.as_str(), at_rest.stage.dt), ("second", 0.005));
    let found = known(&at_rest).unwrap();
    assert!(found.temperature && (found.ideal_pressure - 6.0).abs() < 1e-12, "{found:?}");
    let flow =
        of("steps = 20\ndt = 0.01\n[[body_force]]\nacceleration = [0.1, 0.0, 0.0]\nreversed_along = \"z\"\n");
    assert!(!known(&origin(&flow, 60.0)).unwrap().temperature);
}

/// Velocity Verlet at a quarter of the step for standard DPD: without thermostat the energy stays, with one it would scatter by
/// √(3/2N) = 0.09 kT of a particle. 32 energies, every 96 steps of 0.0025.
#[test]
fn energy_is_followed_without_thermostat_over_its_time() {
    let text = "kT = 1.0\nbox = 4.0\ndensity = 3.0\nequilibrate = 100\nsteps = 200\ndt = 0.01\n";
    let physics = Physics { multiple: 0.25, ..setting::physics(Choice::Few)[0] };
    let found = drift::drift(&origin(&scene(STANDARD, text), 60.0), &physics, Effort::Samples(32)).unwrap();
    assert!(found.largest.unwrap() < 0.01, "{found:?}");
    assert!((found.time - 31.0 * 96.0 * 0.0025).abs() < 1e-9, "{found:?}");
}

/// Where the scene's step is far too long for its lightest particles, the steps that are tried begin lower.
#[test]
fn steps_begin_where_the_fluid_allows_them() {
    let unit = |mass: f64| origin(&scene(SET6, &format!("{TINY}[masses]\nF = {mass:?}\n")), 60.0).unit;
    // The step of a mass goes with its root: 1 % at 0.06 and 0.03, a quarter of that or the scene's.
    let (heavy, light) = (unit(1.0), unit(0.25));
    assert!(heavy == 0.01 && (0.006..0.009).contains(&light), "{heavy} {light}");
}

/// Of two codes of equal cost and error neither beats the other; of two of equal cost the one with the larger error is beaten, of two
/// of equal error the dearer one.
#[test]
fn equal_codes_share_the_front() {
    let front = |codes: [(f64, f64); 3]| {
        let mut points = codes.map(|(u, cost)| fake(Host::Native, 1.0, [u, 1e-6], [cost; 3]));
        front::mark(&mut points, &["u=1%".parse().unwrap()]);
        points.map(|p| p.front)
    };
    assert_eq!(front([(0.005, 1.0), (0.005, 1.0), (0.02, 3.0)]), [true, true, false]);
    assert_eq!(front([(0.005, 1.0), (0.006, 1.0), (0.001, 2.0)]), [true, false, true]);
    assert_eq!(front([(0.005, 1.0), (0.005, 2.0), (0.005, 0.5)]), [false, false, true]);
}

/// The cheapest of each host, within all tolerances; what was not measured is within none, and is named.
#[test]
fn a_setting_is_within_all_tolerances_or_none() {
    let read = |texts: &[&str]| -> Vec<Tolerance> { texts.iter().map(|t| t.parse().unwrap()).collect() };
    let mut points = vec![
        fake(Host::Native, 1.0, [0.003, 0.001], [3.0; 3]),
        fake(Host::Plugin, 2.0, [0.003, 0.001], [2.0; 3]),
        fake(Host::Plugin, 3.0, [0.003, 0.001], [4.0; 3]),
        fake(Host::Lammps, 4.0, [0.003, 0.001], [1.0; 3]),
    ];
    let u = read(&["u=1%"]);
    let cheapest = |points: &[Point], hosts: &[Host]| front::cheapest(points, &u, hosts);
    assert_eq!(cheapest(&points, &[Host::Native]), Some(0));
    assert_eq!(cheapest(&points, &[Host::Plugin]), Some(1));
    assert_eq!(cheapest(&points, &[Host::Native, Host::Plugin]), Some(1));
    points[1].cost = None;
    assert_eq!(cheapest(&points, &[Host::Plugin]), Some(2));
    // 0.3 and two of 0.1 are 0.5 %.
    assert!(points[0].is_within(&read(&["u=0.51%"])) && !points[0].is_within(&read(&["u=0.49%"])));
    let both = read(&["u=1%", "T_kin=1%"]);
    assert!(!points[0].is_within(&both));
    assert_eq!(front::unmeasured(&points, &both).map(|t| t.name.as_str()), Some("T_kin"));
    assert_eq!(front::unmeasured(&points, &u), None);
    let temperature = |value: f64| {
        let measured = psidpd_observe::Measured { value, error: 0.0 };
        quantity::Deviation::new(quantity::Class::Temperature, "T_kin", measured, value, 0.001)
    };
    points[0].errors.push(temperature(0.02));
    assert!(!points[0].is_within(&both) && points[0].is_within(&u));
    front::mark(&mut points, &both);
    let worst = points[0].worst.as_ref().unwrap();
    assert!(worst.quantity == "T_kin" && (worst.ratio - 2.0).abs() < 1e-12, "{worst:?}");
    points[0].errors[1] = temperature(-0.005);
    assert!(points[0].is_within(&both));
    assert_eq!((judged(&points[0].errors, &both), judged(&points[0].errors, &u)), (2, 1));
    assert!(judges_dynamics(&read(&["u=1%", "D=5%"])) && judges_dynamics(&read(&["eta_flow=5%"])));
    assert!(!judges_dynamics(&both));
}

/// Longer runs renew the points of the native steps by the setting, those of the plugin too; those of LAMMPS's own are left.
#[test]
fn longer_runs_renew_points_of_their_setting() {
    let code = |host, multiple| fake(host, multiple, [0.5, 0.1], [multiple; 3]);
    let mut points = vec![
        code(Host::Native, 1.0),
        code(Host::Native, 2.0),
        code(Host::Plugin, 2.0),
        code(Host::Lammps, 2.0),
    ];
    points[1].cost = Cost::of(&[7.0]);
    points[2].cost = Cost::of(&[5.0]);
    let physics: Vec<Physics> =
        [2.0, 1.0].map(|multiple| code(Host::Native, multiple).setting.physics).to_vec();
    assert_eq!([0, 1].map(|k| cheapest_of(&points, &physics[k])), [Some(7.0), Some(1.0)]);
    let on_threads = [9.0, 3.0].map(|cost| Point { cost: Cost::of(&[cost]), ..points[1].clone() });
    assert_eq!(cheapest_of(&[&points[..], &on_threads].concat(), &physics[0]), Some(3.0));
    let found = |u: f64| fake(Host::Native, 1.0, [u, 0.001], [1.0; 3]).errors;
    let made = Made { quantities: Quantities::default(), samples: 640, time: 32.0 };
    renew(&mut points, &physics, &[Ok(made), Err("too hot".into())], &[Some(found(0.02)), None]);
    let values = |p: &Point| p.errors.first().map(|d| (100.0 * d.value).round());
    assert_eq!(points.iter().map(values).collect::<Vec<_>>(), [None, Some(2.0), Some(2.0), Some(50.0)]);
    let runs: Vec<(bool, u64, f64)> = points.iter().map(|p| (p.stable, p.samples, p.time)).collect();
    assert_eq!(runs, [(false, 0, 0.0), (true, 640, 32.0), (true, 640, 32.0), (true, 100, 10.0)]);
    assert_eq!(points[0].unstable.as_deref(), Some("too hot"));
}

/// Most points decide the tolerance that is usual: of three, two.
#[test]
fn usual_tolerances_are_those_of_most_native_points() {
    let of = |errors: [f64; 3]| {
        let mut points: Vec<Point> = errors.map(|e| fake(Host::Native, 1.0, [0.0, e], [1.0; 3])).to_vec();
        // Neither what stopped nor what LAMMPS ran counts.
        points.push(Point { stable: false, ..fake(Host::Native, 1.0, [0.0, 0.5], [1.0; 3]) });
        points.extend((0..3).map(|_| fake(Host::Plugin, 1.0, [0.0, 0.5], [1.0; 3])));
        front::usual(&points, 1.0, 2.0).0.first().map(|t| t.bound)
    };
    assert_eq!(of([0.002, 0.002, 0.012]), Some(0.01));
    assert_eq!(of([0.002, 0.012, 0.012]), Some(0.05));
}

/// More time goes to what is open and to the references, to that of dynamics where it is asked for, and to nobody else.
#[test]
fn more_time_is_for_what_is_open() {
    let scene = scene(SET6, &TINY.replace("box = 4.0", "box = 3.0"));
    let origin = origin(&scene, 0.1);
    let physics = [0.5, 1.0, 0.75].map(|multiple| Physics {
        integrator: Integrator::VelocityVerlet,
        multiple,
        precision: Precision::Double,
    });
    let progress = Progress::new();
    let mut field = Field::begun(&origin, &physics, [Effort::Samples(1); 2], &progress).unwrap();
    let samples = |field: &Field| -> Vec<u64> {
        let References { configurations, small_steps } = &field.references;
        let references = [configurations.as_ref().unwrap().sampled(), small_steps.sampled()];
        references.into_iter().chain(field.sampled()).map(|made| made.unwrap().samples).collect()
    };
    for dynamics in [false, true] {
        let before = samples(&field);
        field.sample_on(&[1], 0.05, dynamics, &progress);
        let grew: Vec<bool> = samples(&field).iter().zip(&before).map(|(a, b)| a > b).collect();
        assert_eq!(grew, [true, dynamics, false, true, false]);
    }
}

/// Interfaces and viscosities that the scene itself asks for are observed beside what all scenes are compared by, each as often as it pays; codes
/// that are not ours have no forces, and Monte Carlo has no time.
#[test]
fn what_the_scene_asks_of_interfaces_is_observed() {
    let text = "kT = 1.0\nbox = [4.0, 4.0, 12.0]\nsteps = 50\ndt = 0.01\n[initial]\nkind = \"slab\"\n\
                thickness = 5.0\ndensity = 6.0\n[observe]\nevery = 5\ninterface_width = true\nsurface_tension = true\n\
                density_profile = true\nviscosity = true\n";
    let scene = scene(SET6, text);
    let origin = origin(&scene, 0.05);
    let name = |request: &psidpd_observe::Request| {
        let whole = format!("{:?}", request.meter);
        whole.split('(').next().unwrap_or_default().to_owned()
    };
    let observed = |host: Host, has_time: bool| {
        let found = sample::observe(&origin, 7, host, has_time).unwrap().requests;
        let mut found: Vec<(String, u64)> = found.iter().map(|r| (name(r), r.every)).collect();
        found.sort();
        found
    };
    let expected = |all: &[(&str, u64)]| -> Vec<(String, u64)> {
        all.iter().map(|(name, every)| ((*name).to_owned(), *every)).collect()
    };
    let forces = [("InterfaceWidth", 7), ("Msd", 7), ("Pressure", 7), ("Rdf", 21), ("SurfaceTension", 21)];
    let rest = [("Temperature", 21), ("Viscosity", 1)];
    assert_eq!(observed(Host::Native, true), expected(&[&forces[..], &rest].concat()));
    let timeless =
        [("InterfaceWidth", 7), ("Pressure", 7), ("Rdf", 21), ("SurfaceTension", 21), ("Temperature", 21)];
    assert_eq!(observed(Host::Native, false), expected(&timeless));
    assert_eq!(observed(Host::Lammps, true), expected(&[("InterfaceWidth", 7), ("Msd", 7), ("Rdf", 7)]));
}

/// Particles with an energy of 3 each, wherever they are: so much is u, and the time is that of all steps between samples, of which
/// there are 24 of the shortest.
#[test]
fn samples_have_their_energy_and_their_time() {
    let model = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n[excess_free_energy]\n\
                 F = \"3.0 + 0*n\"\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";
    let scene = scene(model, "kT = 2.0\nbox = 4.0\ndensity = 3.0\nsteps = 50\ndt = 0.01\n");
    let origin = origin(&scene, 0.05);
    for (physics, steps) in [(setting::physics(Choice::Few)[1], 6.0), (Physics::reference(), 1.0)] {
        let run = Sampler::settled(&origin, physics, Effort::Samples(1)).unwrap().more(Effort::Samples(30));
        let made = run.sampled().unwrap();
        let u = made.quantities.get("u").unwrap();
        assert!((u.value - 3.0).abs() < 1e-9, "{u:?}");
        assert!(made.samples >= 16, "{}", made.samples);
        let expected = steps * origin.dt(&physics) * made.samples as f64;
        assert!(
            (made.time / expected - 1.0).abs() < 1e-9,
            "{}: {} and not {expected}",
            physics.multiple,
            made.time
        );
        let kinetic = made.quantities.get("T_kin").unwrap();
        assert!((kinetic.value / 2.0 - 1.0).abs() < 0.3, "{kinetic:?}");
    }
}

/// What is recommended is read back as it was: every setting, with noise of either law and thermostats that wait.
#[test]
fn lines_of_a_scene_are_read_back() {
    let mut all = setting::physics(Choice::Full);
    for physics in all.clone() {
        let mut integrator = physics.integrator;
        if let Some(coupling) = integrator.settings().coupling {
            (coupling.every, coupling.noise) = (3, psidpd_core::engine::noise::Law::Uniform);
            all.push(Physics { integrator, ..physics });
        }
    }
    assert!(all.len() > 100);
    for mut physics in all.into_iter().filter(|physics| physics.integrator.has_time()) {
        let setting = Setting { host: Host::Native, physics, threads: NonZeroUsize::MIN };
        let lines = recommend::scene_lines(0.0375, &setting);
        let scene = scene(STANDARD, &format!("kT = 1.0\nbox = 4.0\ndensity = 3.0\nsteps = 5\n{lines}"));
        assert_eq!((scene.stages[0].integrator, scene.stages[0].dt), (physics.integrator, 0.0375), "{lines}");
        assert_eq!(scene.precision(), physics.precision, "{lines}");
        // What is left out is what a scene without the line does, and one thread is not asked for.
        let every = physics.integrator.settings().coupling.map_or(1, |coupling| coupling.every);
        assert_eq!(lines.contains("thermostat_every"), every > 1, "{lines}");
        assert!(!lines.contains("--threads"), "{lines}");
        let more =
            recommend::scene_lines(0.0375, &Setting { threads: NonZeroUsize::new(3).unwrap(), ..setting });
        assert_eq!(more, format!("{lines}# run with --threads 3\n"));
    }
}

/// Units do not matter: energies four times as large at half the step are the same run, to the last bits, and what it gains is a part
/// of kT, in half the time.
#[test]
fn drifts_are_parts_of_kt() {
    let of = |energy: f64, time: f64| {
        let model = STANDARD
            .replace("a  = 25.0", &format!("a  = {:?}", 25.0 * energy))
            .replace("gamma = 4.5", &format!("gamma = {:?}", 4.5 * energy * time));
        let dt = 0.015625 * time;
        let text = format!(
            "kT = {energy:?}\nbox = 4.0\ndensity = 3.0\nequilibrate = 100\nsteps = 200\ndt = {dt:?}\n"
        );
        let scene = scene(&model, &text);
        let origin = origin(&scene, 60.0);
        assert!(origin.unit > 0.0);
        let origin = Origin { unit: dt, ..origin };
        drift::drift(&origin, &setting::physics(Choice::Few)[0], Effort::Samples(40)).unwrap()
    };
    let (one, four) = (of(1.0, 1.0), of(4.0, 0.5));
    let [a, b] = [&one, &four].map(|d| d.largest.unwrap());
    assert!(a > 1e-4 && (b / a - 1.0).abs() < 1e-3, "{one:?} {four:?}");
    let slopes = [&one, &four].map(|d| d.slope.unwrap());
    assert!((0.5 * slopes[1] / slopes[0] - 1.0).abs() < 1e-3, "{one:?} {four:?}");
}

/// A model with Warren's parameters and another energy is not LAMMPS's style, though it differs by a hundredth alone.
#[test]
fn only_the_same_forces_are_a_style_of_lammps() {
    let of = |model: &str| own_style::own_style(&origin(&scene(model, TINY), 0.05)).unwrap().is_some();
    let other = SET6.replace("pi/30 *", "1.01*pi/30 *");
    assert!(other != SET6 && of(SET6) && !of(&other));
}

/// Plots are in percent: an error of 3 % of kT, its bar of 0.1, and a tolerance of 2 % as a line; of an error that is not resolved its
/// upper limit, 0.3 %.
#[test]
fn plots_are_in_percent() {
    let points = vec![
        fake(Host::Native, 1.0, [0.03, 0.001], [1.0; 3]),
        fake(Host::Native, 2.0, [0.001, 0.001], [2.0; 3]),
    ];
    let reference =
        Reference { what: "small steps".into(), dt: None, samples: 1, time: 1.0, values: Vec::new() };
    let outcome = Comparison {
        format: 2,
        version: "",
        machine: String::new(),
        scene: String::new(),
        stage: String::new(),
        particles: 1,
        kt: 2.0,
        dt: 0.01,
        temperature_is_known: true,
        reference,
        reference_of_dynamics: None,
        lammps_reference: None,
        left_out: Vec::new(),
        points,
        drifts: Vec::new(),
        tolerances: vec!["u=2%".parse().unwrap()],
        unresolved: Vec::new(),
        margin: 2.0,
        undecided: Vec::new(),
        recommended: None,
    };
    let plot = page::plot_of(&outcome, quantity::Class::Energy).unwrap();
    assert_eq!(plot.levels, [(2.0, "tolerance".to_owned())]);
    let drawn: Vec<f64> = plot.series.iter().flat_map(|s| &s.points).flat_map(|(x, y)| [*x, *y]).collect();
    for (found, expected) in drawn.iter().zip([1.0, 3.0, 2.0, 0.3]) {
        assert!((found - expected).abs() < 1e-9, "{drawn:?}");
    }
    assert_eq!(drawn.len(), 4);
}
