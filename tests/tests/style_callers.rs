//! Commands that use internals of a pair style: Monte Carlo fixes, and those that request energies of single
//! pairs or strain atoms and their images in a constant box.

mod style_common;

use style_common::*;

/// Warren's fluid without drag.
fn quiet() -> String {
    let text = std::fs::read_to_string(warren()).unwrap();
    text.split("[[thermostat]]").next().unwrap().to_owned()
}

/// The conservative force of LAMMPS's `dpd`.
const SOFT: &str = "title = \"soft\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\n\
    strength = 25\nrange = 1\n";

/// The last row of the last thermo output of a script on `ranks` ranks.
fn last_row(script: &str, ranks: usize) -> Vec<f64> {
    last_rows(script, ranks).pop().unwrap()
}

/// The last row of the thermo output of each run of a script.
fn last_rows(script: &str, ranks: usize) -> Vec<Vec<f64>> {
    let said = outcome(script, ranks).unwrap_or_else(|e| panic!("{ranks} ranks: {e}\n{script}"));
    let mut tables: Vec<&str> = said.split("Loop time").collect();
    tables.pop();
    let row = |table: &&str| {
        let row = table.lines().rev().find(|line| !line.trim().is_empty()).unwrap();
        row.split_whitespace().map(|word| word.parse().unwrap_or_else(|_| panic!("{said}"))).collect()
    };
    tables.iter().map(row).collect()
}

/// The output of a script on `ranks` ranks, or its error.
fn outcome(script: &str, ranks: usize) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    std::fs::write(&path, script).unwrap();
    let run = psidpd_tests::lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT);
    run.map(|run| run.stdout).map_err(|e| e.to_string())
}

fn deck(more: &str) -> String {
    format!("{}{more}", particles("", "block 0 5 0 5 0 5", 1, 500))
}

/// Strains that keep the box unchanged have an effect: virials by differences equal those of the forces, and
/// elastic constants equal those of LAMMPS's `dpd`, on any number of ranks.
#[test]
fn strained_ghosts_are_seen() {
    let (_soft, soft) = file(SOFT);
    let (_quiet, quiet) = file(&quiet());
    let measure = "compute p all pressure NULL virial\ncompute b all born/matrix numdiff 1e-4 p\n\
        fix v all numdiff/virial 1 1e-5\nfix 1 all nve\ntimestep 0.001\nthermo_modify norm no format float %.15g\n";
    let components: String =
        (1..=6).map(|k| format!(" c_p[{k}] f_v[{}]", [1, 2, 3, 6, 5, 4][k - 1])).collect();
    let constants: String = (1..=21).map(|k| format!(" c_b[{k}]")).collect();
    let columns = format!("{measure}thermo_style custom step pe{components}{constants}\nthermo 1\nrun 1\n");
    let close = |a: f64, b: f64, tolerance: f64, what: &str| {
        assert!((a - b).abs() < tolerance * (1.0 + a.abs().max(b.abs())), "{what}: {a} {b}");
    };
    for (before, region) in [
        ("", "block 0 5 0 5 0 5"),
        ("boundary p f p", "block 0 5 0 5 0 5"),
        ("", "prism 0 5 0 5 0 5 1 -1 0.5"),
    ] {
        let start = particles(before, region, 1, 500);
        let of = |style: &str| format!("{start}{style}{columns}");
        let reference = of("pair_style dpd 1.0 1.0 5\npair_coeff 1 1 25 0\n");
        let reference = last_row(&reference, 1);
        // Eight ranks on two cores mostly wait for each other, so one case has them.
        let ranks: &[usize] =
            if (before, region) == ("", "block 0 5 0 5 0 5") { &[1, 2, 8] } else { &[1, 2] };
        for &ranks in ranks {
            let soft = of(&format!("pair_style dpd/psi 1.0 5\npair_coeff * * {soft} F\n"));
            let row = last_row(&soft, ranks);
            assert_eq!(row.len(), reference.len());
            for (k, (a, b)) in row.iter().zip(&reference).enumerate() {
                // Random atoms are the same on any number of ranks, and so are all sums over them.
                close(*a, *b, 1e-5, &format!("{region}, {before}, {ranks} ranks, column {k}"));
            }
            let row = last_row(&of(&format!("pair_style dpd/psi 1.0 5\npair_coeff * * {quiet} F\n")), ranks);
            for k in 0..6 {
                let what = format!("{region}, {before}, {ranks} ranks, virial {k}");
                close(row[2 + 2 * k], row[3 + 2 * k], 1e-4, &what);
            }
        }
    }
}

/// If energies belong to particles, a fix that requests the energy of a single pair stops with an error that
/// names full_energy; with that keyword it runs. Without densities no keyword is needed.
#[test]
fn monte_carlo_needs_full_energies_of_many_bodies() {
    let many = format!("pair_style dpd/psi 1.0 5\npair_coeff * * \"{}\" F\n", warren());
    let mdpd = "pair_style mdpd/psi 1.0 1.0 5\npair_coeff 1 1 -40 25 4.5 1 0.75\n".to_owned();
    let pairs = "pair_style dpd/spline 1.0 1.0 5\npair_coeff 1 1 9.5 2 1 0.8 1 4.5\n";
    for fix in ["fix mc all gcmc 1 10 10 1 777 1.0 -2.0 0.1", "fix mc all widom 1 20 1 777 1.0"] {
        let rest = |full: &str| {
            format!(
                "fix 1 all nve\ntimestep 0.001\n{fix}{full}\nthermo_style custom step pe atoms f_mc[1] f_mc[2]\n\
                 thermo_modify norm no format float %.15g\nthermo 1\nrun 3\n"
            )
        };
        for style in [&many, &mdpd] {
            for ranks in [1, 2] {
                let script = deck(&format!("{style}{}", rest("")));
                let error = psidpd_tests::last_words(ranks, || outcome(&script, ranks));
                assert!(error.contains("need full_energy with a many-body style"), "{ranks}: {error}");
                let row = last_row(&deck(&format!("{style}{}", rest(" full_energy"))), ranks);
                assert!(row.iter().all(|x| x.is_finite()), "{row:?}");
            }
        }
        // A new run with the remaining atoms must give the same energy: none of them may still be excluded.
        let both = ["", " full_energy"].map(|full| {
            let afresh = format!(
                "write_data left.data nocoeff\nclear\nunits lj\natom_style atomic\ncomm_modify vel yes\n\
                 read_data left.data\n{pairs}fix 1 all nve\nthermo_style custom step pe atoms\n\
                 thermo_modify norm no format float %.15g\nrun 0\n"
            );
            let rows = last_rows(&deck(&format!("{pairs}{}{afresh}", rest(full))), 1);
            let [run, fresh] = &rows[..] else { panic!("{rows:?}") };
            assert!(run.iter().all(|x| x.is_finite()) && run[3] != 0.0, "{fix}{full}: {run:?}");
            assert!(
                (run[1] - fresh[1]).abs() < 1e-9 * (1.0 + run[1].abs()),
                "{fix}{full}: {run:?} {fresh:?}"
            );
            assert_eq!(run[2], fresh[2], "{fix}{full}");
            run.clone()
        });
        // Test insertions are the same in both runs; gcmc draws different moves in each, with LAMMPS's own styles too.
        if fix.contains("widom") {
            for (a, b) in both[0].iter().zip(&both[1]) {
                assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{fix}: {both:?}");
            }
        }
    }
}

/// With densities, commands that replace pair forces, or use pair energies alone, are refused by name.
#[test]
fn what_works_with_single_pairs_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("chains.data");
    std::fs::write(&data, chains(100)).unwrap();
    let script = |special: &str, style: &str, more: &str| {
        format!(
            "units lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\nspecial_bonds lj {special}\nread_data {}\n\
             {}{style}bond_style {more}fix 1 all nve\ntimestep 0.0001\nrun 1\n",
            data.display(),
            load()
        )
    };
    let many = "pair_style mdpd/psi 1.0 1.0 5\npair_coeff * * -40 25 4.5 1 0.75\n";
    let pairs = "pair_style dpd/spline 1.0 1.0 5\npair_coeff * * 9.5 2 1 0.8 1 4.5\n";
    for (special, more, name) in [
        ("0 1 1", "harmonic\nbond_coeff 1 10 0.5\nfix s all bond/swap 1 0.5 1.2 598934\n", "fix bond/swap"),
        ("1 1 1", "quartic\nbond_coeff 1 1200 -0.55 0.25 1.3 34.6878\n", "bond_style quartic"),
        ("1e-10 1e-10 1e-10", "special\nbond_coeff 1 0.5 0.5\n", "bond_style special"),
    ] {
        let error = outcome(&script(special, many, more), 1).unwrap_err();
        assert!(error.contains(name) && error.contains("with a many-body style"), "{error}");
        if let Err(error) = outcome(&script(special, pairs, more), 1) {
            assert!(!error.contains("many-body style"), "{error}");
        }
    }
    let write = format!("pair_write 1 1 20 r 0.1 1 {} F", folder.path().join("table").display());
    let error = outcome(&deck(&format!("{many}run 0\n{write}\n")), 1).unwrap_err();
    assert!(error.contains("pair_write cannot be used"), "{error}");
    outcome(&deck(&format!("{pairs}run 0\n{write}\n")), 1).unwrap();
}
