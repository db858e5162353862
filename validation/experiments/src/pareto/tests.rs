use super::*;
use std::path::Path;

fn tiny(folder: &Path) -> Scene {
    let model = crate::models::SET6;
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

/// 387 particles: T is known to 4 % in a sample, to 0.6 % in 48 of them, u to 0.6 % of kT. Velocity Verlet is off by 0.5 % in T at 0.01
/// and far off or unstable at 0.04, two-stage by less than 1 % at 0.02. The seed is fixed.
#[test]
fn longer_steps_err_more_and_all_results_agree() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
    let outcome = run(&scene, &options(folder.path(), &["T=10%", "u=10%"]), &Progress::new()).unwrap();
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
    let text = format!("model = \"m.toml\"\nkT = 1.0\nbox = 4.0\ndensity = 6.05\nsteps = 5\n{lines}");
    let again = Scene::parse("again", &text, folder.path()).unwrap();
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
    assert!(std::fs::read_to_string(folder.path().join("out/pareto.html")).unwrap().contains("<svg"));
}

/// Without tolerances all is judged that these short runs resolve to one percent, and the rest is named: a diffusion coefficient of
/// sixty samples is not resolved so well.
#[test]
fn all_that_is_resolved_is_judged() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
    let outcome = run(&scene, &options(folder.path(), &[]), &Progress::new()).unwrap();
    assert!(outcome.unresolved.contains(&"D".to_owned()), "{:?}", outcome.unresolved);
    for t in &outcome.tolerances {
        assert!(t.bound == 0.01 && !outcome.unresolved.contains(&t.name), "{t:?}");
    }
    assert!(page::recommendation(&outcome).contains("Not judged"));
}

#[test]
fn what_is_not_measured_has_no_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
    let mut options = options(folder.path(), &["sigma=1%"]);
    options.fixed = Some((Effort::Samples(4), Pace { rounds: 1, seconds: 0.001 }));
    assert!(
        matches!(run(&scene, &options, &Progress::new()), Err(ExperimentError::Unmeasured(name)) if name == "sigma")
    );
}

/// Lines of a script are there for the steps that LAMMPS has, and for no others.
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
    let folder = tempfile::tempdir().unwrap();
    let scene = tiny(folder.path());
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
