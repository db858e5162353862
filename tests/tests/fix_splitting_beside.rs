//! The fix that integrates beside other fixes, pair styles and commands: they work as with `fix nve`, or are refused
//! by name.

mod style_common;

use psidpd_core::model::Model;
use std::path::Path;
use style_common::*;

/// A liquid of two types with its integrator, from a data file, so that atoms have the same numbers on any ranks.
fn deck(folder: &Path, before_box: &str, style: &str, fix: &str) -> String {
    let data = folder.join("start.data");
    if !data.exists() {
        let psi = psi("dpd/psi");
        let settle =
            format!("{psi}fix 1 all dpd/splitting two-stage\ntimestep 0.005\nrun 100\nreset_timestep 0\n");
        let start = particles("", "block 0 6 0 5 0 5", 2, 600);
        run(&format!("{start}{settle}write_data {} nocoeff\n", data.display()), 1);
    }
    format!(
        "units lj\natom_style atomic\natom_modify map yes\n{before_box}\nread_data {}\n{}{style}{fix}\ntimestep 0.02\n",
        data.display(),
        load(),
    )
}

/// The pair style alone, `dpd/psi`, or as the only style of a hybrid, such as `hybrid dpd/psi`.
fn psi(style: &str) -> String {
    let inside = if style.contains("hybrid") { "dpd/psi " } else { "" };
    format!("pair_style {style} 1.0 {SEED}\npair_coeff * * {inside}\"{}\" F F\n", warren())
}

/// The output of a script on one rank, or its error.
fn outcome(folder: &Path, script: &str) -> Result<String, String> {
    let path = folder.join("in.outcome");
    std::fs::write(&path, script).unwrap();
    let run = psidpd_tests::lammps().0.run_script(1, folder, &path, &[], LIMIT);
    run.map(|run| run.stdout).map_err(|e| e.to_string())
}

const SCHEMES: [&str; 3] = ["two-stage", "force-gradient", "aboba every 2"];

/// Atoms whose force `fix setforce` sets move as if they had no drag and noise, and the others as beside atoms that no
/// fix moves.
#[test]
fn atoms_that_setforce_holds() {
    let folder = tempfile::tempdir().unwrap();
    let wall = "group wall id <= 150\ngroup free subtract all wall\nvelocity wall set 0 0 0\n";
    for scheme in SCHEMES {
        for ranks in [1, 2] {
            let with = |fixes: &str| {
                let start = deck(folder.path(), "", &psi("dpd/psi"), wall);
                run_in(folder.path(), &format!("{start}{fixes}run 20\n"), ranks)
            };
            let apart = with(&format!("fix 1 free dpd/splitting {scheme}\n"));
            let held = with(&format!("fix 1 all dpd/splitting {scheme}\nfix 2 wall setforce 0 0 0\n"));
            assert!(held.x == apart.x && held.v == apart.v, "{scheme}, {ranks} ranks");
        }
        // A force that is set accelerates: v = ft/m and x = ft²/2m.
        let start = deck(folder.path(), "", &psi("dpd/psi"), wall);
        let fixes = format!("fix 1 all dpd/splitting {scheme}\nfix 2 wall setforce 0.5 0 0\n");
        let [before, after] = [0, 20].map(|steps| run(&format!("{start}{fixes}run {steps}\n"), 1));
        let time = 20.0 * 0.02;
        for k in 0..150 {
            let moved = after.x[k][0] - before.x[k][0];
            let moved = moved - 6.0 * (moved / 6.0).round();
            assert!((moved - 0.25 * time * time).abs() < 1e-9, "{scheme}: {moved}");
            assert!(
                (after.v[k][0] - 0.5 * time).abs() < 1e-12 && after.v[k][1] == 0.0,
                "{scheme}: {:?}",
                after.v[k]
            );
        }
    }
}

/// Fixes that take components out of forces, that advance a state at each evaluation of forces, or that draw noise for
/// it, are refused by name; those that leave the atoms of the fix alone are not.
#[test]
fn fixes_that_are_refused_and_fixes_that_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let with = |fix: &str| {
        let groups = "group wall id <= 150\ngroup free subtract all wall\n";
        let fix = format!("{groups}fix 1 free dpd/splitting two-stage\nfix 2 {fix}");
        outcome(folder.path(), &format!("{}run 2\n", deck(folder.path(), "", &psi("dpd/psi"), &fix)))
    };
    for fix in [
        "setforce 0 NULL NULL",
        "lineforce 1 2 0",
        "planeforce 0 1 1",
        "aveforce 0 0 0",
        "flow/gauss 1 0 0",
        "smd cvel 20 1 tether 3 3 3 0",
        "smd cfor 1 tether 3 3 3 0",
        "ttm 1 1 1 1 1 1 1 1 1 1",
        "langevin 1 1 1 7",
        "press/langevin iso 1 1 1 temp 1 1 7",
        "nonaffine/displacement 1 integrated fixed 0",
    ] {
        let name = fix.split(' ').next().unwrap();
        let error = with(&format!("all {fix}")).expect_err(fix);
        assert!(
            error.contains(&format!("fix 2 ({name})")) && error.contains("use fix nve"),
            "{fix}: {error}"
        );
    }
    for fix in [
        "wall setforce 0 NULL NULL",
        "wall lineforce 1 2 0",
        "wall aveforce 0 0 0",
        "all setforce NULL NULL NULL",
        "free addforce 0.1 0 0",
        "free spring tether 1 3 3 3 0",
        "free momentum 1 linear 1 1 1",
        "all store/force",
    ] {
        with(fix).unwrap_or_else(|e| panic!("{fix}: {e}"));
    }
}

/// `fix pair` has densities of the ends of steps, or is refused.
#[test]
fn densities_are_those_of_ends_of_steps() {
    let model = Model::open(warren().as_ref()).unwrap();
    for scheme in ["two-stage", "force-gradient every 2"] {
        let start = particles("", "block 0 5 0 5 0 5", 1, 500);
        let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n", warren());
        let l = open(&format!(
            "{start}{style}fix n all pair 3 dpd/psi density 0\nfix 1 all dpd/splitting {scheme}\ntimestep 0.02\n\
             thermo 100\nrun 9\n"
        ));
        let expected = truth(&l, &model, 1.0, None).densities;
        let found = l.gather("f_n", 1).unwrap();
        for (found, n) in found.iter().zip(&expected) {
            assert!((found - n).abs() < 1e-9 * (1.0 + n.abs()), "{scheme}: {found} {n}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let fixes = "fix n all pair 3 dpd/psi density 0\nfix 1 all dpd/splitting aboba";
    let script = deck(folder.path(), "", &psi("dpd/psi"), fixes);
    let error = outcome(folder.path(), &format!("{script}run 1\n")).expect_err("refused");
    assert!(error.contains("fix n (pair) reads the pair style"), "{error}");
}

/// In a hybrid the fix finds its style: a hybrid, an overlay and a scaled hybrid of that style alone take its steps, and
/// an overlay with another style takes the same steps on any ranks.
#[test]
fn hybrids_have_a_thermostat() {
    let folder = tempfile::tempdir().unwrap();
    for scheme in SCHEMES {
        let fix = format!("fix 1 all dpd/splitting {scheme}");
        let end = |style: &str, ranks: usize| {
            run(&format!("{}run 12\n", deck(folder.path(), "", style, &fix)), ranks)
        };
        let truth = end(&psi("dpd/psi"), 1);
        for style in ["hybrid dpd/psi", "hybrid/overlay dpd/psi", "hybrid/scaled 1.0 dpd/psi"] {
            for ranks in [1, 2] {
                let apart = difference(&end(&psi(style), ranks).v, &truth.v);
                assert!(apart < 1e-10, "{scheme}, {style}, {ranks} ranks: {apart:e}");
            }
        }
        let both = format!(
            "pair_style hybrid/overlay dpd/psi 1.0 {SEED} lj/cut 1.0\npair_coeff * * dpd/psi \"{}\" F F\n\
             pair_coeff * * lj/cut 0.1 0.3\n",
            warren()
        );
        let one = end(&both, 1);
        assert!(difference(&one.v, &truth.v) > 1e-3, "{scheme}: the other style has no effect");
        for ranks in [2, 4] {
            let apart = difference(&end(&both, ranks).v, &one.v);
            assert!(apart < 1e-10, "{scheme}, {ranks} ranks: {apart:e}");
        }
    }
}

/// Styles of a hybrid that draw noise for one evaluation in a step, several styles with a thermostat, and pairs of types
/// that belong to another style.
#[test]
fn hybrids_that_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mdpd = "pair_coeff * * mdpd/psi -40 25 18 1 0.75\n";
    for (style, message) in [
        (
            format!("hybrid/overlay mdpd/psi 1 1 5 dpd 1 1 5\n{mdpd}pair_coeff * * dpd 1 1\n"),
            "pair_style dpd beside it expects one evaluation of forces",
        ),
        (
            format!("hybrid/overlay dpd/tstat 1 1 1 5 mdpd/psi 1 1 5\n{mdpd}pair_coeff * * dpd/tstat 1\n"),
            "pair_style dpd/tstat beside it",
        ),
        (
            "hybrid/overlay mdpd/psi 1 1 5 mdpd/psi 1 1 6\npair_coeff * * mdpd/psi 1 -40 25 18 1 0.75\n\
             pair_coeff * * mdpd/psi 2 -40 25 18 1 0.75\n"
                .to_owned(),
            "the hybrid contains several",
        ),
        (
            format!(
                "hybrid/overlay mdpd/psi 1 1 5 dpd/psi 1 5\n{mdpd}pair_coeff * * dpd/psi \"{}\" F F\n",
                warren()
            ),
            "the hybrid contains several",
        ),
        (
            "hybrid mdpd/psi 1 1 5 lj/cut 1\npair_coeff 1 1 mdpd/psi -40 25 18 1 0.75\n\
             pair_coeff 2 2 mdpd/psi -40 25 18 1 0.75\npair_coeff 1 2 lj/cut 0.1 0.3\n"
                .to_owned(),
            "the hybrid gives pairs of types that this style knows to another style alone",
        ),
    ] {
        let style = format!("comm_modify vel yes\npair_style {style}");
        let script = deck(folder.path(), "", &style, "fix 1 all dpd/splitting two-stage");
        let error = outcome(folder.path(), &format!("{script}run 1\n")).expect_err(message);
        assert!(error.contains(message), "{message}\nfound: {error}");
    }
}

/// A fix that LAMMPS has not set up stops with an error, and so does a pair style whose fix has gone.
#[test]
fn runs_without_setup() {
    let folder = tempfile::tempdir().unwrap();
    let splitting = "dpd/splitting two-stage";
    for (first, second, message) in [
        ("nve", splitting, "'run N pre no' cannot follow a new fix"),
        (splitting, splitting, "'run N pre no' cannot follow a new fix"),
        (splitting, "nve", "made or removed after the last setup"),
    ] {
        let script =
            deck(folder.path(), "comm_modify vel yes", &psi("dpd/psi"), &format!("fix 1 all {first}"));
        let script = format!("{script}run 1\nunfix 1\nfix 1 all {second}\nrun 1 pre no\n");
        let error = outcome(folder.path(), &script).expect_err(message);
        assert!(error.contains(message), "{first}, {second}: {error}");
    }
}

/// With a skin that is used up in each step all builds of lists are dangerous by LAMMPS's count, and the atoms take the
/// steps that they take with a wide skin.
#[test]
fn dangerous_builds_that_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let fix = "fix 1 all dpd/splitting two-stage\nneigh_modify delay 0 every 1 check yes\nrun 20\n";
    let with = |skin: &str| {
        let script = deck(folder.path(), skin, &psi("dpd/psi"), fix);
        (run(&script, 2), outcome(folder.path(), &script).unwrap())
    };
    let [(narrow, said), (wide, calm)] = ["neighbor 0.02 bin", "neighbor 0.8 bin"].map(with);
    let count = |said: &str| -> usize {
        let line = said.lines().find(|line| line.contains("Dangerous builds")).expect(said);
        line.split_whitespace().last().unwrap().parse().unwrap()
    };
    assert!(count(&said) > 10 && count(&calm) == 0, "{} {}", count(&said), count(&calm));
    assert!(difference(&narrow.v, &wide.v) < 1e-9);
}

/// Without drag and noise the fix moves atoms beside other fixes as `fix nve` does where the timestep goes to 0. Fixes for some
/// atoms are tried together, each on a group of its own.
#[test]
fn other_fixes_act_as_beside_nve() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(warren()).unwrap();
    let (_folder, quiet) = file(text.split("[[thermostat]]").next().unwrap());
    let psi = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{quiet}\" F F\n");
    let of_groups = [
        "gravity 5 vector 0 0 -1",
        "addforce 5 0 0",
        "addtorque 0 0 50",
        "accelerate/cos 5",
        "propel/self velocity 5",
        "setforce 0 0 0",
        "spring tether 500 3 3 3 1",
        "spring couple g0 500 1 0 0 0",
        "spring/self 50",
        "spring/rg 500 1",
        "ti/spring 50 50 50",
        "indent 50 sphere 3 3 3 2",
        "drag 3 3 3 5 0.5",
        "viscous 2",
        "restrain bond 351 352 50 50 0.5",
        "momentum 10 linear 1 1 1 angular",
        "temp/berendsen 2 2 0.05",
        "temp/rescale 10 2 2 0.02 1",
        "temp/csvr 2 2 0.05 77",
        "heat 1 100",
        "ehex 1 100",
        "rhok 1 0 0 0.2 50",
        "recenter 3 3 3",
        "store/force",
    ];
    let mut grouped = String::new();
    for (k, fix) in of_groups.iter().enumerate() {
        let [from, to] = [25 * k + 1, 25 * k + 25];
        grouped += &format!("group g{k} id {from}:{to}\nfix f{k} g{k} {fix}\n");
    }
    let end = |move_by: &str, more: &str| {
        let fixes = format!("fix 1 all {move_by}\n{more}timestep 0.0005\nrun 100\n");
        run(&deck(folder.path(), "", &psi, &fixes).replace("\ntimestep 0.02\n", "\n"), 1).v
    };
    let alone = end("nve", "");
    for (more, groups) in [
        (grouped.as_str(), of_groups.as_slice()),
        ("fix 2 all viscosity 20 x z 6\n", &["viscosity"]),
        ("fix 2 all thermal/conductivity 20 z 6\n", &["thermal/conductivity"]),
        ("fix 2 all deform 1 x erate 0.5 remap x\n", &["deform"]),
        ("fix 2 all press/berendsen iso 0 0 0.5\n", &["press/berendsen"]),
    ] {
        let nve = end("nve", more);
        let size = 600 / groups.len();
        for scheme in ["two-stage", "force-gradient", "aboba"] {
            let found = end(&format!("dpd/splitting {scheme}"), more);
            for (k, fix) in groups.iter().enumerate() {
                let part = |v: &[[f64; 3]]| v[size * k..size * (k + 1)].to_vec();
                let effect = difference(&part(&nve), &part(&alone));
                let apart = difference(&part(&found), &part(&nve));
                assert!(
                    apart < 0.03 * effect || *fix == "store/force",
                    "{fix}, {scheme}: {apart:e} of {effect:e}"
                );
            }
        }
    }
}

/// A fix that nobody tried beside the fix is named with when it acts; those that act at ends of timesteps, and those that were
/// tried, are not. A second thermostat is named beside drag and noise, whatever integrates.
#[test]
fn fixes_that_a_warning_names() {
    let folder = tempfile::tempdir().unwrap();
    let with = |first: &str, second: &str| {
        let fixes = format!("fix 1 all {first}\nfix 2 all {second}\n");
        let script = deck(folder.path(), "comm_modify vel yes", &psi("dpd/psi"), &fixes);
        outcome(folder.path(), &format!("{script}run 2\nrun 2\n")).unwrap_or_else(|e| panic!("{second}: {e}"))
    };
    let splitting = "dpd/splitting two-stage";
    for (fix, when) in [
        ("atom/swap 10 1 777 1.0 types 1 2", "before atoms change ranks"),
        ("spring/self 1", ""),
        ("momentum 1 linear 1 1 1", ""),
        ("ave/time 1 1 1 c_thermo_temp", ""),
        ("addforce 0 0 0", ""),
    ] {
        let said = with(splitting, fix);
        let name = fix.split(' ').next().unwrap();
        let warned =
            said.matches(&format!("fix 2 ({name}) was not tried beside it, and acts {when}")).count();
        assert_eq!(warned, usize::from(!when.is_empty()), "{fix}: {said}");
    }
    for (first, second, warned) in [
        ("nve", "temp/berendsen 1 1 1", true),
        ("nve", "langevin 1 1 1 7", true),
        ("nve", "momentum 10 linear 1 1 1", false),
        (splitting, "temp/csvr 1 1 1 7", true),
        ("nvt temp 1 1 1", "momentum 10 linear 1 1 1", true),
        ("nph iso 1 1 1", "momentum 10 linear 1 1 1", false),
    ] {
        let said = with(first, second);
        let count = said.matches("is a second thermostat beside drag and noise").count();
        assert_eq!(count, usize::from(warned), "{first}, {second}: {said}");
    }
}

/// Between builds of lists in the middle of timesteps LAMMPS's count of dangerous builds stays as it was: atoms go more than half
/// the skin in a timestep and not in half of one, so that no build is late.
#[test]
fn checks_in_the_middle_are_not_counted() {
    let folder = tempfile::tempdir().unwrap();
    let fix = "fix 1 all dpd/splitting two-stage\nneigh_modify delay 0 every 1 check yes\nrun 20\n";
    let said =
        outcome(folder.path(), &deck(folder.path(), "neighbor 0.055 bin", &psi("dpd/psi"), fix)).unwrap();
    let count = |what: &str| -> usize {
        let line = said.lines().find(|line| line.contains(what)).unwrap_or_else(|| panic!("{said}"));
        line.split_whitespace().last().unwrap().parse().unwrap()
    };
    assert!(count("Neighbor list builds") > 8 && count("Dangerous builds") == 0, "{said}");
}

/// At timesteps without energies *aboba* still tells ghosts where the atoms are at the end.
#[test]
fn computes_see_ends_of_steps_without_energies() {
    let folder = tempfile::tempdir().unwrap();
    let fix = "fix 1 all dpd/splitting aboba\ncompute g all rdf 400\nthermo_style custom step temp\nthermo 100\n\
               fix g all ave/time 1 1 7 c_g[2] mode vector file g.txt\nrun 7\nunfix g\n\
               variable n equal c_g[1][2]\nthermo_style custom step c_g[1][2]\n\
               fix h all ave/time 1 1 7 c_g[2] mode vector file h.txt\nrun 0\n";
    run_in(folder.path(), &deck(folder.path(), "", &psi("dpd/psi"), fix), 1);
    let [found, expected] = ["g.txt", "h.txt"].map(|name| {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        let rows: Vec<String> = text.lines().rev().take(400).map(str::to_owned).collect();
        rows
    });
    assert!(found.len() == 400 && found == expected);
}

/// What computes say at the last step of a run is what they say of its last positions and velocities.
#[test]
fn computes_are_those_of_ends_of_steps() {
    let folder = tempfile::tempdir().unwrap();
    let mut columns = String::new();
    let mut computes = String::from("group some id <= 200\ngroup rest subtract all some\n");
    for (k, (compute, outputs)) in [
        ("temp", &[""][..]),
        ("temp/com", &[""]),
        ("temp/partial 1 1 0", &[""]),
        ("temp/profile 1 1 1 z 4", &[""]),
        ("ke", &[""]),
        ("pe", &[""]),
        ("pair dpd/psi", &["", "[1]", "[2]"]),
        ("group/group rest pair yes", &["", "[1]", "[3]"]),
        ("rdf 20", &["[18][2]", "[20][3]"]),
        ("adf 20 * * * 0.1 0.9 0.1 0.9", &["[18][2]"]),
        ("com", &["[1]"]),
        ("gyration", &["", "[4]"]),
        ("momentum", &["[1]", "[2]"]),
        ("msd", &["[4]"]),
        ("msd/nongauss", &["[3]"]),
        ("vacf", &["[4]"]),
        ("pressure NULL pair", &["", "[5]"]),
    ]
    .into_iter()
    .enumerate()
    {
        computes +=
            &format!("compute c{k} {} {compute}\n", if compute.contains("rest") { "some" } else { "all" });
        columns += &outputs.iter().map(|part| format!(" c_c{k}{part}")).collect::<String>();
    }
    for (k, compute) in [
        "ke/atom",
        "pe/atom",
        "stress/atom NULL",
        "centroid/stress/atom NULL",
        "coord/atom cutoff 0.8",
        "cluster/atom 0.5",
        "orientorder/atom nnn NULL degrees 1 6 cutoff 0.9",
        "centro/atom 8",
        "displace/atom",
        "property/atom vx fx",
    ]
    .into_iter()
    .enumerate()
    {
        let part = match compute.split('/').next() {
            Some("stress" | "centroid" | "property") => "[2]",
            Some("displace") => "[4]",
            Some("orientorder") => "[1]",
            _ => "",
        };
        computes += &format!("compute p{k} all {compute}\ncompute r{k} all reduce sumsq c_p{k}{part}\n");
        columns += &format!(" c_r{k}");
    }
    computes += "compute flux all heat/flux p0 p1 p2\n";
    columns += " c_flux[1] c_flux[3]";
    for scheme in ["two-stage", "aboba"] {
        let fix = format!(
            "fix 1 all dpd/splitting {scheme}\n{computes}thermo_style custom step{columns}\n\
            thermo_modify format float %.15g line one\nthermo 1000\nrun 13\nfix_modify 1 virial no\nrun 0\n"
        );
        let said = outcome(folder.path(), &deck(folder.path(), "", &psi("dpd/psi"), &fix)).unwrap();
        let rows: Vec<Vec<f64>> = said
            .lines()
            .filter_map(|line| line.split_whitespace().map(|w| w.parse().ok()).collect::<Option<Vec<f64>>>())
            .filter(|row| row.len() > 20 && row[0] == 13.0)
            .collect();
        let [during, after] = &rows[..] else { panic!("{scheme}: {said}") };
        let off: Vec<_> = during
            .iter()
            .zip(after)
            .enumerate()
            .filter(|(_, (a, b))| (*a - *b).abs() > 1e-8 * (1.0 + b.abs()))
            .collect();
        assert!(off.is_empty(), "{scheme}: {off:?} of{columns}");
    }
}

/// The same steps in runs of several kinds, and beside fixes that insert and remove atoms once a timestep.
#[test]
fn commands_for_runs_and_atoms() {
    let folder = tempfile::tempdir().unwrap();
    for scheme in ["two-stage every 2", "force-gradient every 2", "aboba every 2"] {
        let start = deck(folder.path(), "", &psi("dpd/psi"), &format!("fix 1 all dpd/splitting {scheme}"));
        let whole = run(&format!("{start}run 14\n"), 1);
        let parts = "run 3\nrun 2 pre no post no\nrun 8 upto\nrun 4 every 2 \"variable a equal 1\"\nrun 2 start 0 stop 14\n";
        let apart = difference(&run(&format!("{start}{parts}"), 1).v, &whole.v);
        assert!(apart < 1e-8, "{scheme}: {apart:e}");
        let count = "region all block 0.5 5.5 0.5 4.5 0.5 4.5\nfix 2 all deposit 5 1 2 777 region all near 0.01\n\
                     fix 3 all evaporate 5 10 all 778\nrun 11\nprint \"there are $(atoms) atoms\"\n";
        let said = outcome(folder.path(), &format!("{start}{count}")).unwrap();
        assert!(said.contains("there are 585 atoms"), "{scheme}: {said}");
    }
}
