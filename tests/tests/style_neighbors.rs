//! The styles together with LAMMPS's commands about neighbours: `compute rdf`, `comm_modify mode multi`.

mod style_common;

use psidpd_core::engine::PeriodicBox;
use psidpd_core::maximum::largest;
use psidpd_core::model::Model;
use std::f64::consts::PI;
use std::panic::{AssertUnwindSafe, catch_unwind};
use style_common::*;

const BINS: usize = 20;

/// Numbers of ordered pairs of kinds `a`, `b` in shells of width `reach/BINS`; kind 0 is any.
fn shells(now: &Frame, domain: &PeriodicBox, [a, b]: [i32; 2], reach: f64) -> Vec<f64> {
    let is = |i: usize, kind: i32| kind == 0 || now.kind[i] == kind;
    let mut found = vec![0.0; BINS];
    for i in (0..now.x.len()).filter(|i| is(*i, a)) {
        for j in (0..now.x.len()).filter(|j| *j != i && is(*j, b)) {
            let d = domain.minimum_image(now.x[i], now.x[j]);
            let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            if r < reach {
                found[(r / reach * BINS as f64) as usize] += 1.0;
            }
        }
    }
    found
}

/// `compute rdf` gets its pairs from a list of its own: g(r) and coordination numbers equal those of a direct
/// count, whatever the source of the style's pairs.
#[test]
fn radial_distributions_are_those_of_a_direct_count() {
    let (model, listed) = (warren(), listed());
    for (before, region, more) in [
        ("", "block 0 5 0 5 0 5", ""),
        ("newton off", "block 0 5 0 5 0 5", ""),
        ("", "prism 0 5 0 5 0 5 1 -1 1", ""),
        // The style's pairs come from LAMMPS's list here, and no atom is excluded.
        ("", "block 0 5 0 5 0 5", &listed),
    ] {
        let l = open(&format!(
            "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{model}\" F F\n{more}\n\
             compute g all rdf {BINS} * * 1 2 2 2\nfix 1 all nve\ntimestep {DT}\n\
             thermo_style custom step c_g[1][1]\nthermo 5\nrun 5\n",
            particles(before, region, 2, 500)
        ));
        let (now, domain) = (frame(&l), domain(&l));
        let volume = domain.volume(3);
        let of = |kind: i32| now.kind.iter().filter(|k| kind == 0 || **k == kind).count() as f64;
        for (column, kinds) in [[0, 0], [1, 2], [2, 2]].into_iter().enumerate() {
            let [from, to] = kinds.map(of);
            // A particle is not its own neighbour.
            let others = if kinds[0] == kinds[1] { to - 1.0 } else { to };
            let counts = shells(&now, &domain, kinds, 1.0);
            assert!(counts.iter().sum::<f64>() > 100.0);
            let mut inside = 0.0;
            for (bin, count) in counts.iter().enumerate() {
                let [low, high] = [bin, bin + 1].map(|b| b as f64 / BINS as f64);
                let shell = 4.0 / 3.0 * PI * (high.powi(3) - low.powi(3)) / volume;
                inside += count / from;
                let value = |k: usize| l.eval(&format!("c_g[{}][{k}]", bin + 1)).unwrap();
                let found = [value(1), value(2 + 2 * column), value(3 + 2 * column)];
                let expected = [0.5 * (low + high), count / (from * others * shell), inside];
                for (found, expected) in found.iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < 1e-9 * (1.0 + expected),
                        "{kinds:?}, bin {bin}: {found} {expected}\n{before} {region} {more}"
                    );
                }
            }
        }
    }
}

/// On one rank the style needs no ghosts. The test rebuilds them every twentieth step only, when atoms have
/// long left the box, without a skin and without reverse communication: energy and pressure do not change.
/// They do change if the style takes its pairs from LAMMPS's list.
#[test]
fn one_rank_needs_no_ghosts_in_time() {
    let (model, listed) = (warren(), listed());
    let run = |region: &str, more: &str, [before, skin, when]: [&str; 3]| {
        let l = open(&format!(
            "{}neighbor {skin} bin\nneigh_modify delay 0 {when}\n\
             pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{model}\" F F\n{more}\n\
             velocity all create 4.0 4711 loop geom\nfix 1 all nve\ntimestep {DT}\nrun 60\n",
            particles(before, region, 2, 700)
        ));
        ["pe", "ke", "press", "pxy"].map(|name| l.eval(name).unwrap())
    };
    let far = |region: &str, more: &str| {
        let often = run(region, more, ["newton on", "0.2", "every 1 check yes"]);
        let seldom = run(region, more, ["newton off", "0.0", "every 20 check no"]);
        largest(often.iter().zip(seldom).map(|(a, b)| (a - b).abs() / (1.0 + a.abs())))
    };
    for region in ["block 0 5 0 5 0 5", "prism 0 5 0 5 0 5 1 -1 1"] {
        let far = far(region, "");
        assert!(far < 1e-8, "{region}: {far:e}");
    }
    // With a neighbor list pairs would be missing, so the run stops.
    let stopped = catch_unwind(AssertUnwindSafe(|| {
        run("block 0 5 0 5 0 5", &listed, ["newton off", "0.0", "every 20 check no"])
    }));
    let why = *stopped.unwrap_err().downcast::<String>().unwrap();
    assert!(why.contains("pairs would be left out") && why.contains("check yes"), "{why}");
}

/// If the reach of ghosts depends on their types, forces and trajectories are the same as with one reach,
/// also beside a style of another range.
#[test]
fn ghosts_by_type_are_enough() {
    let (_folder, wide) = file(WIDE);
    let model = Model::parse("wide", WIDE).unwrap();
    let psi = format!("dpd/psi 1.0 {SEED}");
    let alone = format!("pair_style {psi}\npair_coeff * * {wide} A B\n");
    let multi = "neighbor 0.3 multi\ncomm_modify mode multi vel yes";
    for (before, region) in [("", "block 0 6 0 6 0 6"), ("newton off", "prism 0 6 0 6 0 6 1 2 -1")] {
        let deck = |comm: &str, style: &str, types: usize| {
            format!(
                "{}{style}fix 1 all nve\ntimestep {DT}\nrun 0\n",
                particles(&format!("{before}\n{comm}"), region, types, 700)
                    .replace("comm_modify vel yes", if comm.is_empty() { "comm_modify vel yes" } else { "" })
            )
        };
        let l = open(&deck(multi, &alone, 2));
        let truth = truth(&l, &model, 1.0, Some(0));
        let apart = difference(&frame(&l).f, &truth.forces);
        assert!(apart < 1e-10, "{apart}");
        drop(l);
        // A third type of long range makes the reaches differ.
        let mixed = "set type 1 type/ratio 2 0.4 77\n";
        let beside = format!(
            "pair_style hybrid {psi} lj/cut 2.0\n\
             pair_coeff * * dpd/psi {wide} A B NULL\npair_coeff * 3 lj/cut 0.01 0.3 0.6\npair_coeff 3 3 lj/cut 0.01 0.3 2.0\n"
        );
        let single = frame(&open(&deck("", &format!("{mixed}{beside}"), 3)));
        let l = open(&deck(multi, &format!("{mixed}{beside}"), 3));
        let found = frame(&l);
        drop(l);
        assert_eq!(found.kind, single.kind);
        assert!(found.kind.contains(&1) && found.kind.contains(&2) && found.kind.contains(&3));
        let apart = difference(&found.f, &single.f);
        assert!(apart < 1e-10, "{apart}");

        let folder = tempfile::tempdir().unwrap();
        let start = folder.path().join("start.data").display().to_string();
        open(&format!(
            "{}{mixed}pair_style zero 1.0\npair_coeff * *\nwrite_data {start} nocoeff\n",
            particles("", region, 3, 700)
        ));
        let script = |comm: &str| {
            format!(
                "units lj\natom_style atomic\natom_modify map yes\n{before}\n{comm}\nread_data {start}\n{}{beside}\
                 fix 1 all nve\ntimestep {DT}\nrun 10\n",
                load()
            )
        };
        let one = run(&script("comm_modify vel yes"), 1);
        for ranks in [1, 2, 4] {
            let other = run(&script(multi), ranks);
            let apart = [difference(&other.x, &one.x), difference(&other.f, &one.f)];
            assert!(apart.iter().all(|d| *d < 1e-9), "{ranks} ranks: {apart:?}");
        }
    }
}

/// Where LAMMPS is told not to look how far atoms go, a run stops as soon as pairs would be missing: on several ranks, and on one
/// where a compute has asked for a list. Otherwise nothing is needed of LAMMPS, and with `check yes` all is as ever.
#[test]
fn ghosts_that_are_too_old_stop_the_run() {
    let fast = "neighbor 0.0 bin\nneigh_modify delay 0 every 20 check no";
    let rdf = "compute g all rdf 20\nfix a all ave/time 1 1 1 c_g[*] mode vector\n";
    let outcome = |before: &str, more: &str, ranks: usize| {
        let folder = tempfile::tempdir().unwrap();
        let script = format!(
            "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F F\n{more}timestep 0.02\nrun 25\n",
            particles(before, "block 0 5 0 5 0 5", 2, 500),
            warren()
        );
        let path = folder.path().join("in.lammps");
        std::fs::write(&path, script).unwrap();
        let run = || psidpd_tests::lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT);
        let mut said = run().map(|run| run.stdout).map_err(|e| e.to_string());
        // A launcher that is told to abort may drop what a rank has said last.
        for _ in 0..6 {
            if said.as_ref().is_err_and(|said| ranks > 1 && !said.contains("ERROR")) {
                said = run().map(|run| run.stdout).map_err(|e| e.to_string());
            }
        }
        said
    };
    for fix in
        ["fix 1 all nve\n", "fix 1 all dpd/splitting two-stage\n", "fix 1 all dpd/splitting force-gradient\n"]
    {
        for (before, more, ranks, refused) in [
            (fast, fix.to_owned(), 1, false),
            (fast, fix.to_owned(), 2, true),
            (fast, format!("{fix}{rdf}"), 1, true),
            ("neighbor 0.02 bin\nneigh_modify delay 0 every 20 check no", fix.to_owned(), 2, true),
            ("neighbor 0.3 bin\nneigh_modify delay 0 every 1 check yes", format!("{fix}{rdf}"), 1, false),
            ("neighbor 0.3 bin\nneigh_modify delay 0 every 1 check yes", fix.to_owned(), 2, false),
            ("neighbor 1.5 bin\nneigh_modify delay 0 every 5 check no", format!("{fix}{rdf}"), 2, false),
        ] {
            match outcome(before, &more, ranks) {
                Ok(said) => assert!(!refused, "{before}, {more}, {ranks} ranks: {said}"),
                Err(said) => {
                    let named = said.contains("more than half the skin of");
                    assert!(refused && named, "{before}, {more}, {ranks} ranks: {said}");
                    assert!(ranks > 1 || said.contains("has asked for neighbor lists"), "{said}");
                }
            }
        }
    }
}
