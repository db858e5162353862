use super::*;
use std::path::Path;

fn tiny(folder: &Path) -> Scene {
    let model = include_str!("../../models/warren2003-set6.toml");
    std::fs::write(folder.join("m.toml"), model).unwrap();
    let text = "model = \"m.toml\"\nkT = 1.0\nseed = 3\nbox = 4.0\ndensity = 6.05\nequilibrate = 200\nsteps = 500\ndt = 0.01\n";
    Scene::parse("tiny", text, folder).unwrap()
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
    }
}

/// 387 particles: T is known to 4 % in a sample, to 0.6 % in 48 of them. Velocity Verlet is off by 0.5 % at 0.01 and far off or
/// unstable at 0.04, two-stage by less than 1 % at 0.02. The seed is fixed.
#[test]
fn longer_steps_err_more_and_all_results_agree() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
    let outcome = run(&scene, &options(folder.path(), &["T=10%"]), &Progress::new()).unwrap();
    let of = |name: &str, dt: f64| {
        outcome.points.iter().find(|p| p.integrator.starts_with(name) && p.dt == dt).unwrap()
    };
    let error = |p: &Point| match p.unstable {
        Some(_) => f64::INFINITY,
        None => p.errors.iter().find(|d| d.name == "T_kin").unwrap().relative.abs(),
    };
    let (short, long) = (of("velocity-verlet", 0.01), of("velocity-verlet", 0.04));
    assert!(error(long) > error(short) + 0.05, "{} {}", error(short), error(long));
    let two_stage = of("two-stage", 0.02);
    assert!(two_stage.is_within(&"T=10%".parse().unwrap()).unwrap(), "{two_stage:?}");
    assert!(short.errors.iter().any(|d| d.name == "T_conf") && short.errors.iter().any(|d| d.name == "p"));

    // The recommendation is the cheapest of the points that are within.
    let best = &outcome.points[outcome.cheapest.unwrap()];
    let cost = |p: &Point| p.cost.unwrap().median;
    for p in outcome.points.iter().filter(|p| p.unstable.is_none()) {
        assert!(p.is_within(&outcome.tolerances[0]) != Some(true) || cost(p) >= cost(best));
    }
    let lines = outcome.scene_lines.clone().unwrap();
    let text = format!("model = \"m.toml\"\nkT = 1.0\nbox = 4.0\ndensity = 6.05\nsteps = 5\n{lines}");
    let again = Scene::parse("again", &text, folder.path()).unwrap();
    assert_eq!(again.stages[0].integrator, best.setting.physics.integrator);
    assert_eq!((again.stages[0].dt, again.precision()), (best.dt, best.setting.physics.precision));
    assert!(page::recommendation(&outcome).contains(&lines));

    // The table and the JSON tell the same.
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("out/pareto.json")).unwrap())
            .unwrap();
    let found = &json["points"][outcome.cheapest.unwrap()];
    assert_eq!(found["dt"], best.dt);
    assert_eq!(found["cost"]["median"], cost(best));
    let table = page::table(&outcome);
    assert_eq!(table.rows.len(), outcome.points.len() + 1);
    let row = table.rows.iter().find(|row| row[0] == best.name() && row[1] == best.dt.to_string()).unwrap();
    assert!(row[4].starts_with(&format!("{:.4}", cost(best))), "{row:?}");
    assert!(std::fs::read_to_string(folder.path().join("out/pareto.html")).unwrap().contains("<svg"));
}

#[test]
fn what_is_not_measured_has_no_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
    let mut options = options(folder.path(), &["sigma=1%"]);
    options.fixed = Some((Effort::Samples(4), Pace { rounds: 1, seconds: 0.001 }));
    assert!(matches!(run(&scene, &options, &Progress::new()), Err(ParetoError::Unmeasured("sigma"))));
}

/// LAMMPS has nothing for the two-stage step, and says so; it has velocity Verlet.
#[test]
fn lammps_lines_are_those_that_lammps_can_run() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
    let origin = Origin::of(&scene, Duration::from_secs(1), NonZeroUsize::MIN).unwrap();
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
                assert_eq!(lines.is_ok(), integrator.in_lammps() != crate::integrator::Counterpart::None)
            }
        }
    }
}
