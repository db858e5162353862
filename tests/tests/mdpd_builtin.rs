//! `mdpd/psi … law lucy` agrees with LAMMPS's own `mdpd` and `mdpd/rhosum`: strengths and ranges by pair of
//! types, masses other than 1, two dimensions.

mod style_common;

use std::fmt::Write;
use style_common::*;

/// The values `I J A B rc rd`, without drag, because the two codes draw different noise.
type Pair = (usize, usize, f64, f64, f64, f64);

/// All values differ by pair, except that two of three ranges of densities agree.
const MIXED: [Pair; 3] =
    [(1, 1, -40.0, 25.0, 1.0, 0.75), (1, 2, -30.0, 20.0, 0.9, 0.6), (2, 2, -20.0, 12.5, 1.0, 0.75)];

const EQUAL: [Pair; 3] =
    [(1, 1, -40.0, 25.0, 1.0, 0.75), (1, 2, -40.0, 25.0, 1.0, 0.75), (2, 2, -40.0, 25.0, 1.0, 0.75)];

fn ours(pairs: &[Pair]) -> String {
    let mut text = format!("pair_style mdpd/psi 1.0 1.0 {SEED} law lucy\n");
    for (i, j, a, b, rc, rd) in pairs {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "pair_coeff {i} {j} {a} {b} 0 {rc} {rd}");
    }
    text
}

fn built_in(pairs: &[Pair]) -> String {
    let mut text = format!("pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 {SEED}\n");
    for (i, j, a, b, rc, rd) in pairs {
        let _ = writeln!(text, "pair_coeff {i} {j} mdpd/rhosum {rd}");
        let _ = writeln!(text, "pair_coeff {i} {j} mdpd {a} {b} 0 {rc} {rd}");
    }
    text
}

/// The deck without a run, with atoms for both codes.
fn deck(before: &str, region: &str, masses: [f64; 2]) -> String {
    format!(
        "{}mass 1 {}\nmass 2 {}\n",
        particles(before, region, 2, 500).replace("atom_style atomic", "atom_style mdpd"),
        masses[0],
        masses[1]
    )
}

/// Forces and pressure of one style before the first step.
fn at_rest(deck: &str, style: &str) -> (Frame, Vec<f64>) {
    let l = open(&format!(
        "{deck}{style}compute w all pressure NULL virial\nthermo_style custom step c_w[1]\nfix 1 all nve\nrun 0\n"
    ));
    (frame(&l), l.compute_vector("w").unwrap())
}

#[test]
fn forces_are_the_built_ins() {
    let boxes = [
        ("", "block 0 5 0 5 0 5"),
        ("newton off", "block 0 4 0 5 0 6"),
        ("", "prism 0 5 0 5 0 5 1 -1 1"),
        ("dimension 2", "block 0 9 0 9 -0.1 0.1"),
    ];
    for (before, region) in boxes {
        for (pairs, masses) in
            [(&MIXED, [1.0, 2.5]), (&MIXED, [1.0, 1.0]), (&EQUAL, [1.0, 2.5]), (&EQUAL, [1.0, 1.0])]
        {
            let deck = deck(before, region, masses);
            let (theirs, pressure) = at_rest(&deck, &built_in(pairs));
            let (here, found) = at_rest(&deck, &ours(pairs));
            assert_eq!(here.x, theirs.x);
            let apart = difference(&here.f, &theirs.f);
            assert!(apart < 1e-10, "{apart}\n{deck}");
            for (a, b) in found.iter().zip(&pressure) {
                assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{a} {b}\n{deck}");
            }
            // The masses enter the force law and the coefficients.
            let other = [masses[1], masses[0]];
            if masses[0] != masses[1] {
                let (other, _) = at_rest(&self::deck(before, region, other), &ours(pairs));
                assert!(difference(&other.f, &theirs.f) > 1e-2);
            }
        }
    }
}

/// Ten steps without drag agree to rounding, under MPI too.
#[test]
fn short_trajectories_are_the_built_ins() {
    // The IDs of atoms depend on the ranks that create them.
    let folder = tempfile::tempdir().unwrap();
    let start = folder.path().join("start.data").display().to_string();
    open(&format!(
        "{}pair_style zero 1.0\npair_coeff * *\nwrite_data {start} nocoeff\n",
        deck("", "block 0 5 0 5 0 5", [1.0, 2.5])
    ));
    let deck = format!(
        "units lj\natom_style mdpd\natom_modify map yes\ncomm_modify vel yes\nread_data {start}\n{}",
        load()
    );
    let steps = format!("fix 1 all nve\ntimestep {DT}\nrun 10\n");
    let theirs = run(&format!("{deck}{}{steps}", built_in(&MIXED)), 1);
    for ranks in [1, 2] {
        let here = run(&format!("{deck}{}{steps}", ours(&MIXED)), ranks);
        let apart = difference(&here.f, &theirs.f);
        assert!(apart < 1e-7, "{ranks} ranks: {apart}");
    }
}

/// Masses and coefficients may change between runs and at a restart; the log names the law.
#[test]
fn changes_are_seen_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (log, restart) = (folder.path().join("log"), folder.path().join("r"));
    let (log, restart) = (log.display(), restart.display());
    let deck = deck("", "block 0 5 0 5 0 5", [1.0, 1.0]);
    let (direct, _) = at_rest(&self::deck("", "block 0 5 0 5 0 5", [1.0, 2.5]), &ours(&MIXED));
    let equal = ours(&MIXED).replace("1 2 -30 20 0 0.9 0.6", "1 2 -30 25 0 0.9 0.6");
    assert_ne!(equal, ours(&MIXED));
    let l = open(&format!("log {log}\n{deck}{equal}fix 1 all nve\nrun 0\n"));
    assert!(difference(&frame(&l).f, &direct.f) > 1e-2);
    l.commands("mass 2 2.5\nvariable b equal 20\nfix a all adapt 0 pair mdpd/psi B 1 2 v_b\nrun 0").unwrap();
    assert!(difference(&frame(&l).f, &direct.f) < 1e-12);
    l.commands(&format!("unfix a\nwrite_restart {restart}\nclear\n{}read_restart {restart}\nrun 0", load()))
        .unwrap();
    assert!(difference(&frame(&l).f, &direct.f) < 1e-12);
    drop(l);
    let said = std::fs::read_to_string(folder.path().join("log")).unwrap();
    for part in ["NOT CONSERVATIVE", "this force law has no potential", "times their masses"] {
        assert!(said.contains(part), "{part}\n{said}");
    }
}

/// The law has no potential; a request for one gets an error that names the alternative.
#[test]
fn the_conservative_law_refuses_with_the_reason() {
    let deck = deck("", "block 0 5 0 5 0 5", [1.0, 2.5]);
    let b_differs = ours(&MIXED).replace("0.6", "0.75");
    for (style, name) in [(b_differs.as_str(), "B"), (&ours(&MIXED).replace("20 0", "25 0"), "B rd^4")] {
        for law in ["", " law conservative"] {
            let l = open(&deck);
            let script = format!("{}run 0", style.replace(" law lucy", law).replace("-20 12.5", "-20 25"));
            let error = l.commands(&script).unwrap_err().to_string();
            assert!(error.contains(&format!("{name} differs between pairs of types")), "{error}");
            assert!(error.contains("'law lucy'") && error.contains("no potential"), "{error}");
        }
    }
    // Masses do not enter number densities.
    let l = open(&format!("{deck}{}fix 1 all nve\nrun 0\n", ours(&EQUAL).replace(" law lucy", "")));
    let light = frame(&l).f;
    l.commands("mass 2 1.0\nrun 0").unwrap();
    assert!(difference(&frame(&l).f, &light) < 1e-12);
}
