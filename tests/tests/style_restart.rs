//! Restarts and data files: settings and coefficients survive, and trajectories continue.

mod style_common;

use style_common::*;

const MOVE: &str = "fix 1 all nve\ntimestep 0.005\n";

/// Each style with its coefficients, for two types.
fn styles(model: &str) -> [(String, String); 4] {
    [
        (format!("dpd/psi 1.0 {SEED}"), format!("pair_coeff * * {model} A B")),
        (
            format!("mdpd/psi 1.0 1.0 {SEED}"),
            "pair_coeff 1 1 -40 25 18 1 0.75\npair_coeff 1 2 -30.1 25 18 0.9 0.75\npair_coeff 2 2 -20 25 9 1 0.75".into(),
        ),
        (
            format!("mdpd/psi 1.0 1.0 {SEED} law lucy"),
            "pair_coeff * * -40 25 18 1 0.75".into(),
        ),
        (
            format!("dpd/spline 1.0 1.1 {SEED}"),
            "pair_coeff * * 18.75 2 1 0.8 1 4.5\npair_coeff 1 2 10.123456789012345 2 1 0.8 1 2".into(),
        ),
    ]
}

/// A divided run that continues from its restart file, without a pair_style, equals the unbroken one.
#[test]
fn a_restart_goes_on_as_the_split_run() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.toml");
    let restart = folder.path().join("middle.restart").display().to_string();
    for ranks in [1, 2] {
        for (style, coefficients) in styles(&model.display().to_string()) {
            std::fs::write(&model, WIDE).unwrap();
            let split = format!(
                "{}pair_style {style}\n{coefficients}\n{MOVE}run 10\nwrite_restart {restart}\nrun 10\n",
                particles("", "block 0 5 0 5 0 5", 2, 400)
            );
            let split = run(&split, ranks);
            // The restart file contains the model itself.
            std::fs::remove_file(&model).unwrap();
            for more in [
                "",
                "write_restart again.restart\nclear\nLOADcomm_modify vel yes\nread_restart again.restart\n",
            ] {
                let more = more.replace("LOAD", &load());
                let head = format!("{}comm_modify vel yes\nread_restart {restart}\n", load());
                let going_on = run(&format!("{head}{more}{MOVE}run 10\n"), ranks);
                let apart = [difference(&going_on.x, &split.x), difference(&going_on.f, &split.f)];
                assert!(apart.iter().all(|d| *d < 1e-9), "{style}, {ranks} ranks: {apart:?}");
            }
        }
    }
}

/// A hybrid's restart file has the settings; LAMMPS requires the coefficients anew.
#[test]
fn hybrids_restart_too() {
    let folder = tempfile::tempdir().unwrap();
    let restart = folder.path().join("middle.restart").display().to_string();
    let coefficients =
        format!("pair_coeff * * dpd/psi \"{}\" F F\npair_coeff * * lj/cut 0.1 0.3\n", warren());
    let l = open(&format!(
        "{}pair_style hybrid/overlay dpd/psi 1.0 {SEED} lj/cut 1.0\n{coefficients}{MOVE}run 10\nwrite_restart {restart}\nrun 10\n",
        particles("", "block 0 5 0 5 0 5", 2, 400)
    ));
    let split = frame(&l);
    drop(l);
    let l = open(&format!(
        "{}comm_modify vel yes\natom_modify map yes\nread_restart {restart}\n{coefficients}{MOVE}run 10\n",
        load()
    ));
    assert!(difference(&frame(&l).x, &split.x) < 1e-9);
}

/// A restart file has the temperature that a fix has set, and not that of `pair_style`: the energy of this model is in
/// proportion to it.
#[test]
fn a_restart_has_the_present_temperature() {
    let folder = tempfile::tempdir().unwrap();
    let restart = folder.path().join("hot.restart").display().to_string();
    let model = folder.path().join("model.toml");
    let text = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                [excess_free_energy]\nF = \"kT*0.1*n^2\"\n";
    std::fs::write(&model, text).unwrap();
    let hot = open(&format!(
        "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {} F\n{MOVE}variable t equal 2\n\
         fix a all adapt 1 pair dpd/psi temperature * * v_t\nrun 1\nwrite_restart {restart}\n",
        particles("", "block 0 5 0 5 0 5", 1, 400),
        model.display()
    ));
    let energy = hot.thermo("pe").unwrap();
    drop(hot);
    let again = open(&format!("{}comm_modify vel yes\nread_restart {restart}\n{MOVE}run 0\n", load()));
    assert!((again.thermo("pe").unwrap() / energy - 1.0).abs() < 1e-9, "{energy}");
}

/// `write_data` writes the coefficients, and `read_data` reads them.
#[test]
fn data_files_have_the_coefficients() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("all.data").display().to_string();
    for (style, coefficients) in styles("unused").iter().skip(1) {
        let l = open(&format!(
            "{}pair_style {style}\n{coefficients}\n{MOVE}run 5\nwrite_data {data} pair ij\nrun 0\n",
            particles("", "block 0 5 0 5 0 5", 2, 400)
        ));
        let before = frame(&l);
        drop(l);
        let text = std::fs::read_to_string(&data).unwrap();
        assert!(text.contains("PairIJ Coeffs"), "{text}");
        let l = open(&format!(
            "units lj\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\n{}pair_style {style}\n\
             read_data {data}\n{MOVE}reset_timestep 5\nrun 0\n",
            load()
        ));
        let apart = difference(&frame(&l).f, &before.f);
        assert!(apart < 1e-9, "{style}: {apart}");
        drop(l);

        let one = open(&format!(
            "{}pair_style {style}\n{}\nwrite_data {data}\n",
            particles("", "block 0 5 0 5 0 5", 1, 50),
            coefficients.lines().next().unwrap().replace("1 1", "* *")
        ));
        drop(one);
        let text = std::fs::read_to_string(&data).unwrap();
        assert!(text.contains("Pair Coeffs"), "{text}");
        open(&format!(
            "units lj\ncomm_modify vel yes\n{}pair_style {style}\nread_data {data}\nrun 0\n",
            load()
        ));
    }
}

/// The plugin must be loaded before a restart file is read, and LAMMPS's error says so.
#[test]
fn a_restart_without_the_plugin_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let restart = folder.path().join("r").display().to_string();
    open(&format!(
        "{}pair_style mdpd/psi 1.0 1.0 5\npair_coeff * * -40 25 18 1 0.75\nrun 0\nwrite_restart {restart}\n",
        particles("", "block 0 5 0 5 0 5", 1, 50)
    ));
    let script = folder.path().join("in.lammps");
    std::fs::write(&script, format!("read_restart {restart}\n")).unwrap();
    let host = &psidpd_tests::lammps().0;
    let error = host.run_script(1, folder.path(), &script, &[], LIMIT).unwrap_err().to_string();
    assert!(error.contains("mdpd/psi"), "{error}");
}
