//! Sentences of the pages of the pair styles that no other test holds.

mod style_common;

use psidpd_tests::lammps;
use std::path::Path;
use style_common::{DT, LIMIT, SEED, difference, particles, run, run_in, warren};

/// LAMMPS's output, or its error.
fn outcome(folder: &Path, text: &str) -> Result<String, String> {
    let path = folder.join("in.lammps");
    std::fs::write(&path, text).unwrap();
    match lammps().0.run_script(1, folder, &path, &[], LIMIT) {
        Ok(run) => Ok(run.stdout),
        Err(error) => Err(error.to_string()),
    }
}

const BOX: &str = "block 0 5 0 5 0 5";
const MDPD: &str = "pair_style mdpd/psi 1.0 1.0 5\npair_coeff * * -40 25 4.5 1 0.75\n";

fn moves(before: &str, style: &str, more: &str) -> String {
    format!("{}{style}{more}fix 1 all nve\ntimestep {DT}\nrun 10\n", particles(before, BOX, 2, 600))
}

/// "in the folder of the environment variable LAMMPS_POTENTIALS", and with tables next to the model.
#[test]
fn models_are_found_where_potentials_are() {
    let [here, there] = [0; 2].map(|_| tempfile::tempdir().unwrap());
    let model = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"table\"\nfile = \"u.csv\"\n";
    let rows = (0..=20).map(|k| f64::from(k) / 20.0).map(|r| format!("{r}, {}\n", 5.0 * (1.0 - r).powi(2)));
    std::fs::write(there.path().join("u.csv"), format!("r, phi\n{}", rows.collect::<String>())).unwrap();
    std::fs::write(there.path().join("found.toml"), model).unwrap();
    let script = moves("", "pair_style dpd/psi 1.0 5\npair_coeff * * found.toml F F\n", "");
    let path = here.path().join("in.lammps");
    std::fs::write(&path, &script).unwrap();
    let start = |potentials: &Path| {
        let mut command = lammps().0.command(1);
        command.arg("-in").arg(&path).arg("-nocite").current_dir(here.path());
        let output = command.env("LAMMPS_POTENTIALS", potentials).output().unwrap();
        (output.status.success(), psidpd_tests::said(&output))
    };
    let (good, said) = start(there.path());
    assert!(good, "{said}");
    let (good, said) = start(here.path());
    assert!(!good && said.contains("found.toml: cannot be read"), "{said}");
}

/// "The options shift, table and tail have no effect", nor has mixing, which there is not.
#[test]
fn pair_modify_has_no_effect() {
    for (style, missing) in [
        (MDPD, "pair_coeff 1 1 -40 25 4.5 1 0.75\npair_coeff 2 2 -40 25 4.5 1 0.75\n"),
        (
            "pair_style dpd/spline 1.0 1.0 5\npair_coeff * * 18.75 2 0.8 0.8 1 4.5\n",
            "pair_coeff 1 1 18.75 2 0.8 0.8 1 4.5\npair_coeff 2 2 18.75 2 0.8 0.8 1 4.5\n",
        ),
    ] {
        let print = "thermo_style custom step pe press\nthermo_modify format float %.15g\nthermo 10\n";
        let rows = |more: &str| {
            let folder = tempfile::tempdir().unwrap();
            let said = outcome(folder.path(), &moves("", style, &format!("{more}{print}"))).unwrap();
            let table = said.split("Step").nth(1).unwrap().split("Loop").next().unwrap().to_owned();
            table.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
        };
        let plain = rows("");
        assert!(plain.len() > 6, "{plain:?}");
        for option in ["shift yes", "table 12", "tail yes", "mix arithmetic"] {
            assert_eq!(rows(&format!("pair_modify {option}\n")), plain, "{style}{option}");
        }
        let head = style.lines().next().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let error = outcome(folder.path(), &moves("", &format!("{head}\n{missing}"), "")).unwrap_err();
        assert!(error.contains("no coefficients for types 1 and 2"), "{error}");
    }
}

/// "by the pair keyword of run_style respa only"; there the steps are those of fix nve.
#[test]
fn respa_takes_the_whole_pair_force() {
    let respa = |levels: &str| format!("run_style respa 2 1 {levels}\n");
    let [a, b] = ["", &respa("pair 2")].map(|more| run(&moves("", MDPD, more), 1));
    // LAMMPS puts atoms back into the box at other steps.
    assert!(difference(&a.v, &b.v) < 1e-9);
    let folder = tempfile::tempdir().unwrap();
    for levels in ["inner 1 0.4 0.5 outer 2", "inner 1 0.3 0.4 middle 2 0.5 0.6 outer 2"] {
        let error = outcome(folder.path(), &moves("", MDPD, &respa(levels))).unwrap_err();
        assert!(error.contains("ERROR"), "{error}");
    }
}

/// "if atom_modify first is used": its ghosts are used as they are.
#[test]
fn atoms_that_come_first_change_nothing() {
    let first = "group one type 1\natom_modify first one\n";
    let [a, b] = ["", first].map(|more| run(&moves("", MDPD, more), 1));
    assert!(difference(&a.x, &b.x) < 1e-9 && difference(&a.f, &b.f) < 1e-9);
}

/// "law lucy needs masses per type", "at most 16 different values of rd".
#[test]
fn law_lucy_says_what_it_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let lucy = "pair_style mdpd/psi 1.0 1.0 5 law lucy\n";
    let sphere = moves("", &format!("{lucy}pair_coeff * * -40 25 4.5 1 0.75\n"), "")
        .replace("atom_style atomic", "atom_style sphere")
        .replace("mass * 1\n", "set group all diameter 1\nset group all mass 1\n");
    let error = outcome(folder.path(), &sphere).unwrap_err();
    assert!(error.contains("mass") && error.contains("ERROR: Pair style mdpd/psi"), "{error}");
    let ranges = |count: usize| {
        let pairs = (1..=6).flat_map(|i| (i..=6).map(move |j| (i, j)));
        let coefficients = pairs.enumerate().map(|(k, (i, j))| {
            format!("pair_coeff {i} {j} -40 25 4.5 1 {}\n", 0.5 + 0.01 * k.min(count - 1) as f64)
        });
        let coefficients = coefficients.collect::<String>();
        format!("{}{lucy}{coefficients}fix 1 all nve\ntimestep {DT}\nrun 1\n", particles("", BOX, 6, 300))
    };
    outcome(folder.path(), &ranges(16)).unwrap();
    let error = outcome(folder.path(), &ranges(17)).unwrap_err();
    assert!(error.contains("16"), "{error}");
}

/// "with fix nve it is too low by ¼ Δt² ⟨Σ f²/m⟩/(d V)": by what velocities of the half step have more.
#[test]
fn pressures_of_fix_nve_lack_a_quarter() {
    let squares =
        |what: &str| format!("({})^2+({})^2+({})^2", what, what.replace('x', "y"), what.replace('x', "z"));
    let variables = [("f", "fx"), ("e", "vx"), ("h", "vx+0.01*fx")].map(|(name, what)| {
        format!("variable {name} atom \"{}\"\ncompute {name} all reduce sum v_{name}\n", squares(what))
    });
    let script = format!(
        "{}{MDPD}fix 1 all nve\ntimestep 0.02\nrun 200\nreset_timestep 0\n{}compute p all pressure thermo_temp ke\n\
         fix a all ave/time 1 2000 2000 c_p c_f c_e c_h file mean.txt\nrun 2000\n",
        particles("", BOX, 1, 600),
        variables.concat()
    );
    let folder = tempfile::tempdir().unwrap();
    run_in(folder.path(), &script, 1);
    let text = std::fs::read_to_string(folder.path().join("mean.txt")).unwrap();
    let mean: Vec<f64> =
        text.lines().last().unwrap().split_whitespace().skip(1).map(|n| n.parse().unwrap()).collect();
    let [pressure, f, end, half] = mean[..] else { panic!("{text}") };
    assert!((pressure - end / 375.0).abs() < 1e-5 * pressure, "{mean:?}");
    let lacks = 0.25 * 0.02 * 0.02 * f / 375.0;
    assert!(
        lacks > 0.02 * pressure && ((half - end) / 375.0 - lacks).abs() < 0.01 * lacks,
        "{mean:?} {lacks}"
    );
}

/// "The style searches for the model file under its given name", and only then elsewhere.
#[test]
fn models_are_found_under_their_own_name_first() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(warren(), folder.path().join("mine.toml")).unwrap();
    std::fs::create_dir(folder.path().join("potentials")).unwrap();
    std::fs::write(folder.path().join("potentials/mine.toml"), "no model").unwrap();
    let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * mine.toml F F\n");
    std::fs::write(folder.path().join("in.lammps"), moves("", &style, "")).unwrap();
    let mut command = lammps().0.command(1);
    command.args(["-in", "in.lammps", "-nocite"]).current_dir(folder.path());
    let output = command.env("LAMMPS_POTENTIALS", "potentials").output().unwrap();
    assert!(output.status.success(), "{}", psidpd_tests::said(&output));
}
