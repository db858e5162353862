//! `mdpd/psi` with ranges of the density by pair of types, and with a range and an exponent of drag and noise.

mod style_common;

use style_common::*;

const REGION: &str = "block 0 5 0 5 0 5";

/// `A`, `B` and `rd` by pair, with one `B rd^4`.
fn table() -> [(usize, usize, f64, f64, f64); 3] {
    let b = |rd: f64| 7.9 / rd.powi(4);
    [(1, 1, -50.0, b(0.75), 0.75), (1, 2, -45.0, b(0.7), 0.7), (2, 2, -37.5, b(0.65), 0.65)]
}

fn coefficients(gamma: f64, more: &str) -> String {
    let line = |(i, j, a, b, rd): &(usize, usize, f64, f64, f64)| {
        format!("pair_coeff {i} {j} {a} {b:?} {gamma} 1.0 {rd} {more}\n")
    };
    table().iter().map(line).collect()
}

/// The force of the page, summed over pairs here.
fn by_hand(frame: &Frame) -> Vec<[f64; 3]> {
    let count = frame.x.len();
    let of = |i: usize, j: usize| {
        let (low, high) = (frame.kind[i].min(frame.kind[j]), frame.kind[i].max(frame.kind[j]));
        let (_, _, a, b, rd) = table().into_iter().find(|p| (p.0 as i32, p.1 as i32) == (low, high)).unwrap();
        (a, b, rd)
    };
    let mut pairs = Vec::new();
    let mut n = vec![0.0; count];
    for i in 0..count {
        for j in 0..i {
            let mut d = [0.0; 3];
            for k in 0..3 {
                d[k] = frame.x[i][k] - frame.x[j][k];
                d[k] -= 5.0 * (d[k] / 5.0).round();
            }
            let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            if r < 1.0 {
                let (_, _, rd) = of(i, j);
                let w = 15.0 / (2.0 * std::f64::consts::PI * rd.powi(3)) * (1.0 - r / rd).max(0.0).powi(2);
                n[i] += w;
                n[j] += w;
                pairs.push((i, j, d, r));
            }
        }
    }
    let mut f = vec![[0.0; 3]; count];
    for (i, j, d, r) in pairs {
        let (a, b, rd) = of(i, j);
        let force = a * (1.0 - r) + b * (n[i] + n[j]) * (1.0 - r / rd).max(0.0);
        for k in 0..3 {
            f[i][k] += force * d[k] / r;
            f[j][k] -= force * d[k] / r;
        }
    }
    f
}

#[test]
fn ranges_by_pair_give_the_force_of_the_page() {
    for newton in ["on", "off"] {
        let head = particles(&format!("newton {newton}"), REGION, 2, 600);
        for precision in ["double", "mixed"] {
            let script = format!(
                "{head}pair_style mdpd/psi 1.0 1.0 {SEED} precision {precision}\n{}fix 1 all nve\nrun 0\n",
                coefficients(0.0, "")
            );
            for ranks in [1, 2] {
                let frame = run(&script, ranks);
                let apart = difference(&frame.f, &by_hand(&frame));
                assert!(
                    apart < if precision == "double" { 1e-10 } else { 1e-4 },
                    "{newton} {precision} {ranks}: {apart}"
                );
            }
        }
    }
}

/// Ranges by pair keep the energy without drag: the error of a step falls as its square.
#[test]
fn ranges_by_pair_have_an_energy() {
    let drift = |step: f64| {
        let l = open(&format!(
            "{}pair_style mdpd/psi 1.0 1.0 {SEED}\n{}minimize 0 0 30 300\nvelocity all create 1.0 87 mom yes loop geom\n\
             fix 1 all nve\ntimestep {step}\nthermo_style custom step etotal pe\nthermo_modify norm no\nrun 0\n",
            particles("", REGION, 2, 600),
            coefficients(0.0, "")
        ));
        let before = l.thermo("etotal").unwrap();
        l.commands(&format!("run {}", (0.2 / step).round())).unwrap();
        (l.thermo("etotal").unwrap() - before).abs()
    };
    let (coarse, fine) = (drift(0.002), drift(0.0005));
    assert!(fine < coarse / 6.0 && fine < 0.2, "{coarse} {fine}");
}

#[test]
fn drag_and_noise_may_have_a_weight_of_their_own() {
    let (rt, exponent) = (1.3, 0.5);
    let model = format!(
        "title = \"own weight\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n\
         [excess_free_energy]\nA = \"pi/30*0.75^4*25*n^2\"\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = -40\n\
         range = 1.0\n[[thermostat]]\ngamma = 4.5\nrange = {rt}\nexponent = {exponent}\n"
    );
    let (_folder, path) = file(&model);
    let head = particles("", REGION, 1, 600);
    let end = format!("fix 1 all nve\ntimestep {DT}\nrun 5\n");
    let theirs =
        frame(&open(&format!("{head}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{path}\" A\n{end}")));
    let style = format!("pair_style mdpd/psi 1.0 1.3 {SEED}\n");
    let ours =
        frame(&open(&format!("{head}{style}pair_coeff * * -40 25 4.5 1.0 0.75 {rt} {exponent}\n{end}")));
    assert!(difference(&ours.f, &theirs.f) < 1e-8);
    // Without them the range is rc and the exponent 1; restarts keep both.
    let plain = frame(&open(&format!("{head}{style}pair_coeff * * -40 25 4.5 1.0 0.75\n{end}")));
    let same = frame(&open(&format!("{head}{style}pair_coeff * * -40 25 4.5 1.0 0.75 1.0 1\n{end}")));
    assert!(difference(&plain.f, &same.f) < 1e-12 && difference(&plain.f, &ours.f) > 1e-2);
    let folder = tempfile::tempdir().unwrap();
    let restart = folder.path().join("r").display().to_string();
    open(&format!(
        "{head}{style}pair_coeff * * -40 25 4.5 1.0 0.75 {rt} {exponent}\nfix 1 all nve\ntimestep {DT}\nrun 3\nwrite_restart {restart}\n"
    ));
    let split = frame(&open(&format!(
        "{head}{style}pair_coeff * * -40 25 4.5 1.0 0.75 {rt} {exponent}\nfix 1 all nve\ntimestep {DT}\nrun 3\nrun 2\n"
    )));
    let again = frame(&open(&format!(
        "{}comm_modify vel yes\nread_restart {restart}\nfix 1 all nve\ntimestep {DT}\nrun 2\n",
        load()
    )));
    assert!(difference(&again.f, &split.f) < 1e-8);
    for (words, said) in [
        ("1.4 1", "must not exceed the cut-off"),
        ("-1 1", "must not be negative"),
        ("1 -1", "the exponent of w_R must be positive"),
        ("1 1 1", "expected 'pair_coeff I J A B gamma rc rd [rt exponent]'"),
    ] {
        let (folder, path) =
            file(&format!("{head}{style}pair_coeff * * -40 25 4.5 1.0 0.75 {words}\nrun 0\n"));
        let error =
            psidpd_tests::lammps().0.run_script(1, folder.path(), path.as_ref(), &[], LIMIT).unwrap_err();
        assert!(error.to_string().contains(said), "{said}: {error}");
    }
}

/// The message for coefficients without a potential ends with a model that has one; dpd/psi takes it.
#[test]
fn the_nearest_model_is_in_the_message() {
    let head = particles("", REGION, 2, 100);
    let script = format!(
        "{head}pair_style mdpd/psi 1.0 1.0 5\n{}run 0\n",
        coefficients(0.0, "").replace("pair_coeff 1 2 -45 ", "pair_coeff 1 2 -45 2")
    );
    let (folder, path) = file(&script);
    let error = psidpd_tests::lammps()
        .0
        .run_script(1, folder.path(), path.as_ref(), &[], LIMIT)
        .unwrap_err()
        .to_string();
    assert!(error.contains("B rd^4 differs between pairs of types"), "{error}");
}

/// Chains with segmental repulsion, whose fix excludes pairs when LAMMPS sets it up: without a strength they move as without it,
/// also after more runs than the style keeps exclusions.
#[test]
fn chains_with_segmental_repulsion() {
    let (_folder, model) =
        file(&std::fs::read_to_string(warren()).unwrap().replace("gamma = 18.0", "gamma = 0.0"));
    let head = "units lj\natom_style bond\ncomm_modify vel yes cutoff 2.0\nspecial_bonds lj 1 1 1\nlattice sc 5\n\
        region box block 0 5 0 5 0 5 units box\ncreate_box 3 box bond/types 1 extra/bond/per/atom 4 extra/special/per/atom 10\n\
        create_atoms 1 box\ndisplace_atoms all random 0.1 0.1 0.1 7\nmass 1 1.0\nmass 2 1.0\nmass 3 1.0\ngroup poly id <= 40\n\
        set group poly type 2\nvariable i loop 39\nlabel again\n\
        if \"$(v_i%10) != 0\" then \"create_bonds single/bond 1 $(v_i) $(v_i+1) special no\"\nnext i\njump SELF again\n\
        create_bonds single/bond 1 39 40 special yes\nvelocity all create 1.0 4711 loop geom\n";
    let rest = |mobile: &str| {
        format!(
            "bond_style harmonic\nbond_coeff * 50 0.6\ngroup mob type 1 2\n{mobile}\ntimestep 0.005\n\
             dump d mob custom 100 f.dump id type x y z fx fy fz\ndump_modify d sort id format float %.17g\n"
        )
    };
    let runs = "run 2\n".repeat(12) + "run 76\n";
    let frames = |script: &str| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("in.lmp"), script).unwrap();
        let done = psidpd_tests::lammps().0.run_script(1, folder.path(), "in.lmp".as_ref(), &[], LIMIT);
        done.unwrap_or_else(|e| panic!("{e}\n{script}"));
        let frames = psidpd::formats::dump::read(&folder.path().join("f.dump")).unwrap();
        frames.last().unwrap().vectors(["x", "y", "z"]).unwrap()
    };
    let mdpd = "pair_coeff 1*2 1*2 mdpd/psi -40 25 0 1 0.75\n";
    let none = "pair_coeff 1 3 none\npair_coeff 2 3 none\n";
    for integrator in ["fix 1 mob nve", "fix 1 mob dpd/splitting two-stage"] {
        let plain = frames(&format!(
            "{head}{}pair_style hybrid mdpd/psi 1 1 5 zero 1.0\n{mdpd}pair_coeff * 3 zero\n{}{runs}",
            load(),
            rest(integrator)
        ));
        for style in [
            format!("pair_style hybrid mdpd/psi 1 1 5 srp 0.8 1 mid\n{mdpd}{none}pair_coeff 3 3 srp 0.0\n"),
            format!(
                "pair_style hybrid/overlay mdpd/psi 1 1 5 srp 0.8 * min exclude yes\n{mdpd}{none}pair_coeff 3 3 srp 0.0\n"
            ),
            format!(
                "pair_style hybrid dpd/psi 1 5 srp 0.8 1 mid\npair_coeff * * dpd/psi \"{model}\" F F NULL\n{none}pair_coeff 3 3 srp 0.0\n"
            ),
            // Bonds that break where they are longer than any is.
            format!(
                "fix b poly bond/break 5 1 99\npair_style hybrid/overlay dpd/psi 1 5 srp/react 0.8 1 mid b\n\
                 pair_coeff * * dpd/psi \"{model}\" F F NULL\n{none}pair_coeff 3 3 srp/react 0.0\n"
            ),
        ] {
            let with = frames(&format!("{head}{}{style}{}{runs}", load(), rest(integrator)));
            let apart = difference(&with, &plain);
            assert!(apart < 1e-7, "{apart} {integrator}\n{style}");
        }
    }
}

/// Atoms that may have bonds, and have none, are not concerned by `special_bonds`.
#[test]
fn without_bonds_special_bonds_do_not_matter() {
    let head = particles("", "block 0 2.5 0 5 0 5", 1, 250);
    let rest = format!(
        "pair_style mdpd/psi 1.0 1.0 {SEED}\npair_coeff * * -40 25 4.5 1 0.75\nfix 1 all dpd/splitting two-stage\ntimestep {DT}\nrun 3\n"
    );
    let theirs = frame(&open(&format!("{head}{rest}")));
    for style in ["bond", "full", "molecular"] {
        let ours = frame(&open(&format!(
            "{}{rest}",
            head.replace("atom_style atomic", &format!("atom_style {style}"))
        )));
        assert!(difference(&ours.f, &theirs.f) < 1e-12, "{style}");
    }
}

/// Words that are no UTF-8: a model may have such a path, and whatever else they are meant as stops with an error of LAMMPS.
#[test]
fn words_that_are_no_text_are_errors_of_lammps() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join(std::ffi::OsStr::from_bytes(b"m\xff.toml"));
    std::fs::copy(warren(), &model).unwrap();
    let head = format!(
        "{}units lj\ncomm_modify vel yes\nregion r {REGION}\ncreate_box 1 r\ncreate_atoms 1 random 100 5 r\nmass 1 1\n",
        load()
    );
    let run = |lines: &str| {
        let path = folder.path().join("in.lammps");
        let text = format!("{head}{lines}\nrun 0\n");
        let bytes: Vec<u8> = text.bytes().map(|b| if b == b'?' { 0xff } else { b }).collect();
        std::fs::write(&path, bytes).unwrap();
        psidpd_tests::lammps().0.run_script(1, folder.path(), &path, &[], LIMIT).map_err(|e| e.to_string())
    };
    let psi = "pair_style dpd/psi 1.0 5\npair_coeff * * m?.toml F";
    run(psi).unwrap();
    for (lines, says) in [
        ("pair_style dpd/psi 1.0 5\npair_coeff * * m?.toml ?", "no species"),
        ("pair_style dpd/psi 1.0 5\npair_coeff * * ?.toml F", "cannot be read"),
        ("pair_style dpd/psi ? 5", "floating point"),
        ("pair_style dpd/psi 1.0 5 ? 2", "unknown keyword"),
        ("pair_style dpd/psi 1.0 5 precision ?", "unknown precision"),
        (
            &format!("{psi}\npair_style dpd/psi 1.0 5 device ?\npair_coeff * * m?.toml F"),
            "Pair style dpd/psi",
        ),
        ("pair_style mdpd/psi 1.0 1.0 5 law ?", "unknown law"),
        ("pair_style mdpd/psi 1.0 1.0 5\npair_coeff * * -40 25 4.5 1.0 ?", "floating point"),
        (&format!("{psi}\nfix 1 all dpd/splitting ?"), "unknown splitting"),
        (&format!("{psi}\nfix 1 all dpd/splitting aboba ? 1"), "unknown keyword"),
    ] {
        let said = run(lines).unwrap_err();
        assert!(
            said.contains("ERROR") && said.contains(says) && !said.contains("terminate"),
            "{lines}: {said}"
        );
    }
}
