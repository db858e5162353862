//! The fix that integrates with drag and noise apart from the forces. `export_lammps.rs` compares its steps
//! with those of the native runner; the tests here show that ranks, ghosts and restarts do not matter, and
//! that wrong input is refused.

mod style_common;

use psidpd_core::model::Model;
use psidpd_core::truth::conservative as evaluate;
use psidpd_tests::lammps;
use style_common::*;

/// Warren's liquid, so fast that ghosts are rebuilt in the middle of steps.
fn deck(before_box: &str, fix: &str, dt: f64) -> String {
    format!(
        "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F F\nfix 1 all dpd/splitting {fix}\ntimestep {dt}\n\
         thermo_modify norm no\n",
        particles(before_box, "block 0 6 0 5 0 5", 2, 600),
        warren()
    )
}

/// The same fluid from a data file, so that atoms have the same numbers on any ranks.
fn from_data(folder: &std::path::Path, before_box: &str, fix: &str, dt: f64) -> String {
    let data = folder.join("start.data");
    if !data.exists() {
        let settle = deck("", "two-stage", 0.005);
        run(&format!("{settle}run 100\nreset_timestep 0\nwrite_data {} nocoeff\n", data.display()), 1);
    }
    format!(
        "units lj\natom_style atomic\natom_modify map yes\n{before_box}\nread_data {}\n{}pair_style dpd/psi 1.0 {SEED}\n\
         pair_coeff * * \"{}\" F F\nfix 1 all dpd/splitting {fix}\ntimestep {dt}\nthermo_modify norm no\n",
        data.display(),
        load(),
        warren()
    )
}

/// Steps agree on one rank and on several, divided along other directions, with newton on and off, and with a
/// skin that is used up within half a step; ghosts need no velocities.
#[test]
fn ranks_newton_and_skin_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    for fix in ["two-stage", "aboba every 2", "two-stage every 3 lambda 0.25 noise uniform"] {
        let truth = run(&format!("{}run 12\n", from_data(folder.path(), "", fix, 0.03)), 1);
        for (ranks, head) in [
            (1, "newton off\nneighbor 0.02 bin"),
            (2, "newton on\nneighbor 0.02 bin"),
            (2, "newton off\nneighbor 0.3 bin"),
            (2, "newton on\ncomm_modify vel yes\nprocessors 1 1 *"),
            (2, "comm_style tiled"),
        ] {
            let head = format!("{head}\nneigh_modify delay 0 every 1 check yes");
            let other = run(&format!("{}run 12\n", from_data(folder.path(), &head, fix, 0.03)), ranks);
            let length = [6.0, 5.0, 5.0];
            for (a, b) in other.x.iter().zip(&truth.x) {
                for c in 0..3 {
                    let d = a[c] - b[c];
                    let d = d - length[c] * (d / length[c]).round();
                    assert!(d.abs() < 1e-5, "{fix}, {head}, {ranks} ranks: {a:?} {b:?}");
                }
            }
            let apart = difference(&other.v, &truth.v);
            assert!(apart < 1e-5, "{fix}, {head}, {ranks} ranks: {apart:e}");
        }
    }
}

/// In double precision ranks change forces by rounding only, as with forces alone, however the box is divided.
#[test]
fn ranks_agree_in_double_precision() {
    let folder = tempfile::tempdir().unwrap();
    let script = |head: &str, more: &str| {
        format!("{}{more}run 50\n", from_data(folder.path(), head, "two-stage", 0.01))
    };
    let truth = run(&script("", ""), 1);
    for (ranks, head, more) in [
        (1, "newton off", ""),
        (2, "", ""),
        (4, "processors 1 2 2", ""),
        (4, "", "balance 1.0 shift xyz 10 1.01\n"),
        (8, "comm_style tiled", "balance 1.0 rcb\n"),
    ] {
        let other = run(&script(head, more), ranks);
        let apart = difference(&other.v, &truth.v);
        assert!(apart < 1e-10, "{head}, {more}, {ranks} ranks: {apart:e}");
    }
}

/// Steps without drag follow their formula with the reference forces: two masses, and atoms outside the fix.
#[test]
fn force_gradient_steps_are_those_of_the_formula() {
    let (_folder, path) = file(WIDE.split("[[thermostat]]").next().unwrap());
    let fluid = Model::open(path.as_ref()).unwrap().at(1.0).unwrap();
    let [dt, lambda, gradient] = [0.03, 0.15, 0.1];
    let l = open(&format!(
        "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{path}\" A B\nmass 2 2.5\n\
         group moving id > 100\nfix 1 moving dpd/splitting force-gradient lambda {lambda} gradient {gradient}\n\
         timestep {dt}\nrun 0\n",
        particles("", "block 0 5 0 4 0 4", 2, 300),
    ));
    let Frame { kind, mut x, mut v, .. } = frame(&l);
    let domain = domain(&l);
    let species: Vec<usize> = kind.iter().map(|k| *k as usize - 1).collect();
    let over_mass = |k: usize, h: f64| if k < 100 { 0.0 } else { h / [1.0, 2.5][species[k]] };
    let forces = |x: &[[f64; 3]]| evaluate(&fluid, x, &species, &domain).unwrap().forces;
    let plus = |a: &[[f64; 3]], h: f64, f: &[[f64; 3]]| -> Vec<[f64; 3]> {
        let sum = |k: usize| std::array::from_fn(|c| a[k][c] + over_mass(k, h) * f[k][c]);
        (0..a.len()).map(sum).collect()
    };
    let drift = |x: &[[f64; 3]], v: &[[f64; 3]]| -> Vec<[f64; 3]> {
        let moved =
            |k: usize| std::array::from_fn(|c| x[k][c] + if k < 100 { 0.0 } else { 0.5 * dt * v[k][c] });
        (0..x.len()).map(moved).collect()
    };
    for _ in 0..3 {
        v = plus(&v, lambda * dt, &forces(&x));
        x = drift(&x, &v);
        let displaced = plus(&x, gradient * dt * dt, &forces(&x));
        v = plus(&v, (1.0 - 2.0 * lambda) * dt, &forces(&displaced));
        x = drift(&x, &v);
        v = plus(&v, lambda * dt, &forces(&x));
    }
    l.commands("run 3").unwrap();
    let end = frame(&l);
    assert!(difference(&end.v, &v) < 1e-11, "{:e}", difference(&end.v, &v));
    for (a, b) in end.x.iter().zip(&x) {
        assert!(domain.minimum_image(*a, *b).iter().all(|d| d.abs() < 1e-11), "{a:?} {b:?}");
    }
}

/// Omitted keywords give the same bits as the documented default values, and any other value gives other steps.
#[test]
fn defaults_are_those_of_the_page() {
    let page =
        std::fs::read_to_string(psidpd_tests::root().join("lammps-plugin/doc/fix_dpd_splitting.md")).unwrap();
    assert!(page.contains(
        "## Default\n\nevery 1, lambda 0.21 with two-stage and 0.17 with force-gradient, gradient 1/24, noise gaussian\n"
    ));
    let folder = tempfile::tempdir().unwrap();
    let end = |fix: &str| run(&format!("{}run 4\n", from_data(folder.path(), "", fix, 0.03)), 1).v;
    let part = 1.0 / 24.0;
    for (scheme, documented, others) in [
        (
            "two-stage",
            "every 1 lambda 0.21 noise gaussian".to_owned(),
            vec!["lambda 0.2101", "every 2", "noise uniform"],
        ),
        (
            "force-gradient",
            format!("every 1 lambda 0.17 gradient {part} noise gaussian"),
            vec!["lambda 0.1701", "gradient 0.0417"],
        ),
        ("aboba", "every 1 noise gaussian".to_owned(), vec!["every 2", "noise uniform"]),
    ] {
        let left_out = end(scheme);
        assert!(left_out == end(&format!("{scheme} {documented}")), "{scheme}");
        for other in others {
            let apart = difference(&left_out, &end(&format!("{scheme} {other}")));
            assert!(apart > 1e-9, "{scheme} {other}: {apart:e}");
        }
    }
}

/// Steps that are the same by their formulas: without drag two of velocity Verlet are one of *two-stage* with λ = ¼; with *gradient 0*
/// the force gradient is absent. Threads, and whether energies are asked for, do not matter.
#[test]
fn steps_that_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(warren()).unwrap();
    let (_quiet, quiet) = file(text.split("[[thermostat]]").next().unwrap());
    let end = |fix: &str, dt: f64, rest: &str, edit: &dyn Fn(String) -> String, ranks| {
        run(&edit(format!("{}{rest}\n", from_data(folder.path(), "", fix, dt))), ranks).v
    };
    let same = |script: String| script;
    let without_drag = |script: String| script.replace(&warren(), &quiet);
    let verlet = |script: String| without_drag(script).replace("dpd/splitting none", "nve");
    let two = end("two-stage lambda 0.25", 0.02, "run 10", &without_drag, 1);
    let apart = difference(&two, &end("none", 0.01, "run 20", &verlet, 1));
    assert!(apart < 1e-9, "{apart:e}");
    let plain = end("two-stage", 0.03, "run 6", &same, 1);
    assert!(plain == end("force-gradient gradient 0 lambda 0.21", 0.03, "run 6", &same, 1));
    let threads =
        |script: String| script.replace(&format!("psi 1.0 {SEED}"), &format!("psi 1.0 {SEED} threads 2"));
    assert!(plain == end("two-stage", 0.03, "run 6", &threads, 1));
    let seldom = end("aboba", 0.03, "thermo 100\nrun 6", &same, 1);
    let apart = difference(&end("aboba", 0.03, "thermo 1\nrun 6", &same, 1), &seldom);
    assert!(apart < 1e-9, "{apart:e}");
    let mixed = |script: String| {
        script.replace(&format!("psi 1.0 {SEED}"), &format!("psi 1.0 {SEED} precision mixed"))
    };
    let [one, two] = [1, 2].map(|ranks| end("two-stage", 0.03, "run 1", &mixed, ranks));
    let apart = difference(&two, &one);
    assert!(apart < 2e-6 && apart > 0.0, "{apart:e}");
}

/// Two atoms half a range apart, so slow that they stay there, and so cold that there is no noise. With x =
/// DΔt/μ = 0.6 the midpoint rule leaves (1 − x/2)/(1 + x/2) of their relative velocity in a step. Velocity
/// Verlet, whose drag uses half-step velocities, leaves (1 − x/2)² in the first step and 1 − x in later ones.
#[test]
fn the_drag_of_a_pair_is_that_of_the_formula() {
    let (_folder, path) =
        file("title = \"pair\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 6\nrange = 1\n");
    let along = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    let near = along.map(|e| 2.0 - 0.5 * e);
    let alone = ["dpd/psi", ""];
    for (fix, [style, name], steps, left) in [
        ("dpd/splitting two-stage", alone, 3, (0.7f64 / 1.3).powi(3)),
        // A scaled hybrid scales forces, and neither drag nor noise.
        ("dpd/splitting two-stage", ["hybrid/scaled 0.5 dpd/psi", "dpd/psi"], 3, (0.7f64 / 1.3).powi(3)),
        ("dpd/splitting force-gradient every 2", alone, 4, (0.4f64 / 1.6).powi(2)),
        ("dpd/splitting aboba", alone, 3, (0.7f64 / 1.3).powi(3)),
        ("nve", alone, 3, (0.7f64 * 0.4).powi(2)),
    ] {
        let script = format!(
            "units lj\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\nregion b block 0 4 0 4 0 4\n\
             create_box 2 b\ncreate_atoms 1 single 2 2 2\ncreate_atoms 2 single {} {} {}\nmass 1 1\nmass 2 3\n{}\
             pair_style {style} 1e-60 {SEED}\npair_coeff * * {name} \"{path}\" A B\ngroup first type 1\n\
             velocity first set 3e-12 -1e-12 2e-12\nfix 1 all {fix}\ntimestep 0.3\nrun {steps}\n",
            near[0],
            near[1],
            near[2],
            load()
        );
        let end = run(&script, 1);
        let start = [3e-12, -1e-12, 2e-12];
        let u: f64 = (0..3).map(|c| start[c] * along[c]).sum();
        for c in 0..3 {
            let lost = (1.0 - left) * u * along[c];
            let expected = [start[c] - 0.75 * lost, 0.25 * lost];
            for k in 0..2 {
                let off = (end.v[k][c] - expected[k]).abs();
                assert!(off < 1e-10 * 1e-12, "{fix}: {:?}, {expected:?} along {c}", end.v);
            }
        }
    }
}

/// 1 728 pairs at rest, half a range apart along x and too far from others to see them: a short step gives each atom the velocity
/// √(2γkTΔt) w_R ξ/m, whose fourth moment over the square of its second is 3 if ξ is normal and 1.8 if it is uniform. Their standard
/// errors are √(24/1728) = 0.12 and below 0.03, that of the second moment √(2/1728), 3.4 %; all bounds are five of them.
#[test]
fn the_noise_of_a_pair_has_the_distribution_of_its_name() {
    let (_folder, path) = file("title = \"pair\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 6\nrange = 1\n");
    for (noise, fourth, off) in [("", 3.0, 0.6), ("noise gaussian", 3.0, 0.6), ("noise uniform", 1.8, 0.15)] {
        let script = format!(
            "units lj\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\n\
             lattice custom 0.25 a1 2 0 0 a2 0 2 0 a3 0 0 2 basis 0.25 0.25 0.25 basis 0.5 0.25 0.25\n\
             region b block 0 12 0 12 0 12\ncreate_box 1 b\ncreate_atoms 1 box\nmass 1 2\n{}\
             pair_style dpd/psi 0.7 {SEED}\npair_coeff * * \"{path}\" A\n\
             fix 1 all dpd/splitting two-stage {noise}\ntimestep 1e-4\nrun 1\n",
            load()
        );
        let end = run(&script, 1);
        assert_eq!(end.v.len(), 2 * 1728);
        let mean = |power: i32| end.v.iter().map(|v| v[0].powi(power)).sum::<f64>() / end.v.len() as f64;
        let second = 2.0 * 6.0 * 0.7 * 1e-4 * 0.25 / 4.0;
        assert!((mean(2) / second - 1.0).abs() < 0.17, "{noise}: {} {second}", mean(2));
        let found = mean(4) / mean(2).powi(2);
        assert!((found - fourth).abs() < off, "{noise}: {found}");
        assert!(end.v.iter().all(|v| v[1].abs().max(v[2].abs()) < 1e-12), "{noise}");
    }
}

/// A liquid with large displacements takes the same steps on any ranks.
#[test]
fn displaced_atoms_find_their_ghosts() {
    let folder = tempfile::tempdir().unwrap();
    let fix = "force-gradient gradient 0.5 every 2";
    let truth = run(&format!("{}run 12\n", from_data(folder.path(), "neighbor 0.8 bin", fix, 0.03)), 1);
    for (ranks, head) in [
        (2, "newton off\nprocessors 1 2 1"),
        (4, "newton on\ncomm_modify vel yes\nprocessors 2 2 1"),
        (4, "comm_style tiled"),
    ] {
        let head = format!("{head}\nneighbor 0.25 bin\nneigh_modify delay 0 every 1 check yes");
        let other = run(&format!("{}run 12\n", from_data(folder.path(), &head, fix, 0.03)), ranks);
        let apart = difference(&other.v, &truth.v);
        assert!(apart < 1e-5, "{head}, {ranks} ranks: {apart:e}");
    }
}

/// Two atoms that have no common ghosts at the start meet when displaced: the velocity moves each by less
/// than half the skin, and the displacement by as much again. One atom changes ranks, with its displacement.
#[test]
fn atoms_that_meet_when_displaced() {
    let script = |head: &str| {
        format!(
            "units lj\natom_style atomic\natom_modify map yes\n{head}\n\
             neigh_modify delay 0 every 1 check yes\nregion b block -5 5 0 5 0 5\ncreate_box 1 b\n\
             create_atoms 1 single -0.05 2 2\ncreate_atoms 1 single 1.55 2.1 2\nmass 1 1\n{}\
             pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n\
             group one id 1\ngroup two id 2\nvelocity one set 3.45 0 0\nvelocity two set -3.45 0 0\n\
             fix 2 one addforce 9 0 0\nfix 3 two addforce -9 0 0\n\
             fix 1 all dpd/splitting force-gradient gradient 2\ntimestep 0.1\nrun 1\n",
            load(),
            warren()
        )
    };
    let truth = run(&script("neighbor 1.5 bin"), 1);
    let apart = difference(&run(&script("").replace("gradient 2", "gradient 0"), 1).v, &truth.v);
    assert!(apart > 1e-2, "they do not meet when displaced: {apart:e}");
    for (ranks, head) in [(2, "newton on"), (2, "newton off"), (2, "comm_style tiled"), (1, "newton on")] {
        let other = run(&script(&format!("{head}\nneighbor 0.4 bin\nprocessors {ranks} 1 1")), ranks);
        let apart = difference(&other.v, &truth.v);
        assert!(apart < 1e-6, "{head}, {ranks} ranks: {apart:e} {:?} {:?}", other.v, truth.v);
    }
}

/// Displaced atoms beyond reflecting walls are neither lost nor reflected; the fluid presses against the walls.
#[test]
fn displaced_atoms_beyond_walls_are_not_lost() {
    let folder = tempfile::tempdir().unwrap();
    let (_folder, path) = file(WIDE);
    let script = |head: &str| {
        let start =
            from_data(folder.path(), &format!("boundary f p f\n{head}"), "force-gradient gradient 2", 0.02);
        let start = start.replace(&format!("\"{}\" F F", warren()), &format!("\"{path}\" A B"));
        format!("{start}fix w all wall/reflect xlo EDGE xhi EDGE zlo EDGE zhi EDGE\nrun 20\n")
    };
    let truth = run(&script("neighbor 0.8 bin"), 1);
    let beyond = |x: &[f64; 3], f: &[f64; 3]| !(0.0..6.0).contains(&(x[0] + 2.0 * 0.02 * 0.02 * f[0]));
    let count = truth.x.iter().zip(&truth.f).filter(|(x, f)| beyond(x, f)).count();
    assert!(count > 3, "{count} atoms would be displaced to beyond a wall");
    for (ranks, head) in [(2, "processors 2 1 1"), (4, "processors 2 1 2"), (4, "comm_style tiled")] {
        let other = run(&script(&format!("{head}\nneigh_modify delay 0 every 1 check yes")), ranks);
        let apart = difference(&other.v, &truth.v);
        assert!(apart < 1e-5, "{head}, {ranks} ranks: {apart:e}");
    }
}

/// Tilted boxes, on one rank and on two, and boxes barely two ranges wide.
#[test]
fn boxes_that_lean_and_narrow_ones() {
    for (region, count, fix) in [
        ("prism 0 5 0 4 0 4 1.2 -0.5 0.7", 400, "two-stage"),
        ("prism 0 5 0 4 0 4 1.2 -0.5 0.7", 400, "force-gradient gradient 0.2"),
        ("block 0 2.001 0 2.2 0 9", 200, "two-stage"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("start.data").display().to_string();
        let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n", warren());
        let fix = format!("fix 1 all dpd/splitting {fix}\ntimestep 0.02\n");
        run(
            &format!("{}{style}{fix}run 20\nwrite_data {data} nocoeff\n", particles("", region, 1, count)),
            1,
        );
        let script = format!("units lj\natom_style atomic\nread_data {data}\n{}{style}{fix}run 10\n", load());
        let [one, two] = [1, 2].map(|ranks| run(&script, ranks));
        let apart = difference(&two.v, &one.v);
        assert!(apart < 1e-5, "{region}: {apart:e}");
    }
}

/// A rank without atoms takes part in all sums.
#[test]
fn a_rank_may_be_empty() {
    let folder = tempfile::tempdir().unwrap();
    let start = from_data(folder.path(), "processors 2 1 1", "two-stage", 0.01);
    let script = format!("{start}change_box all x final -3 17\nrun 10\n");
    let [one, two] = [1, 2].map(|ranks| run(&script.replace("2 1 1", &format!("{ranks} 1 1")), ranks));
    let apart = difference(&two.v, &one.v);
    assert!(apart < 1e-5, "{apart:e}");
}

/// A run from a restart file takes the steps of the unbroken run, with the thermostat at the same steps.
#[test]
fn a_restart_goes_on_as_the_unbroken_run() {
    let folder = tempfile::tempdir().unwrap();
    let restart = folder.path().join("middle.restart").display().to_string();
    for (ranks, fix) in
        [(1, "two-stage every 3"), (2, "two-stage every 3"), (2, "force-gradient every 3"), (2, "aboba")]
    {
        let head = from_data(folder.path(), "", fix, 0.02);
        let whole = run(&format!("{head}run 17\n"), ranks);
        let split = run(&format!("{head}run 10\nwrite_restart {restart}\nrun 7\n"), ranks);
        let going_on = run(
            &format!(
                "{}read_restart {restart}\nfix 1 all dpd/splitting {fix}\ntimestep 0.02\nrun 7\n",
                load()
            ),
            ranks,
        );
        for other in [&split, &going_on] {
            let apart = [difference(&other.v, &whole.v), difference(&other.f, &whole.f)];
            assert!(apart.iter().all(|d| *d < 1e-5), "{fix}, {ranks} ranks: {apart:?}");
        }
    }
}

/// Energies printed after a step equal those computed again at its end. The virial also includes the impulses.
#[test]
fn energies_are_those_of_ends_of_steps() {
    for (fix, ranks_have) in [("two-stage", 33), ("force-gradient", 33), ("aboba", 33)] {
        let l = open(&deck("", fix, 0.02));
        l.commands(&format!("run {ranks_have}")).unwrap();
        let names = ["pe", "ke", "temp"];
        let before = names.map(|name| l.thermo(name).unwrap());
        let forces = frame(&l).f;
        let press = l.thermo("press").unwrap();
        l.commands("fix_modify 1 virial no\nrun 0").unwrap();
        let after = names.map(|name| l.thermo(name).unwrap());
        for (a, b) in before.iter().zip(after) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{fix}: {before:?} {after:?}");
        }
        assert!(difference(&frame(&l).f, &forces) < 1e-9, "{fix}");
        assert!((l.thermo("press").unwrap() - press).abs() > 1e-3, "{fix}: the impulses have no virial");
    }
}

/// A run with a large step on two ranks keeps temperature and momentum, and the iterations are counted.
#[test]
fn a_large_step_keeps_temperature_and_momentum() {
    for fix in ["two-stage", "force-gradient"] {
        let folder = tempfile::tempdir().unwrap();
        let script = format!(
            "{}velocity all zero linear\nvariable px equal vcm(all,x)\nvariable py equal vcm(all,y)\n\
             fix t all ave/time 1 500 500 c_thermo_temp\nfix n all ave/time 1 500 500 f_1\nrun 500\n\
             print \"mean $(f_t) iterations $(f_n) drift $(abs(v_px)+abs(v_py):%.3e)\" file said.txt\n",
            from_data(folder.path(), "", fix, 0.05)
        );
        let script = script.replace("reset_timestep 0\n", "");
        run_in(folder.path(), &script, 2);
        let said = std::fs::read_to_string(folder.path().join("said.txt")).unwrap();
        let words: Vec<f64> = said.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let [mean, iterations, drift] = words[..] else { panic!("{said}") };
        // The mean scatters by about half a percent; the limit is six times that.
        assert!((mean - 1.0).abs() < 0.03, "{fix}: {said}");
        assert!((1.0..4.0).contains(&iterations), "{fix}: {said}");
        assert!(drift < 1e-9, "{fix}: {said}");
    }
}

/// The log has the iterations of the thermostat, those of several ranks as of one, and how often the forces had listed its pairs;
/// it says where drag is too strong: with γ 10¹² half a step times drag is 10⁹ times the inertia.
#[test]
fn iterations_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let head = from_data(folder.path(), "", "two-stage every 2", 0.01);
    let said = |script: &str, ranks| {
        let path = folder.path().join("in.lammps");
        std::fs::write(&path, script).unwrap();
        lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT).unwrap().stdout
    };
    let line = |ranks, precision: &str| {
        let settings = format!("pair_style dpd/psi 1.0 {SEED} {precision}\n");
        let head = head.replace(&format!("pair_style dpd/psi 1.0 {SEED}\n"), &settings);
        let said = said(&format!("{head}run 9\n"), ranks);
        let line = said.lines().find(|line| line.contains("the thermostat acted")).map(str::to_owned);
        assert!(!said.contains("the thermostat is inaccurate"), "{said}");
        line.unwrap_or_else(|| panic!("{said}"))
    };
    assert!(line(1, "").contains("acted 4 times, with "), "{}", line(1, ""));
    assert_eq!(line(1, ""), line(2, ""));
    // The forces list the pairs each time, on several ranks too.
    for ranks in [1, 2] {
        for precision in ["", "precision mixed"] {
            let line = line(ranks, precision);
            assert!(line.ends_with("its pairs were those of the forces 4 times"), "{ranks} ranks: {line}");
        }
    }
    // Each run counts its own.
    let both = said(&format!("{head}run 9\nrun 6\n"), 1);
    assert!(both.contains("acted 4 times") && both.contains("acted 3 times"), "{both}");
    let strong = head.replace(&warren(), &folder.path().join("strong.toml").display().to_string());
    let model = std::fs::read_to_string(warren()).unwrap().replace("gamma = 18.0", "gamma = 1e12");
    assert!(model.contains("1e12"));
    std::fs::write(folder.path().join("strong.toml"), model).unwrap();
    let said = said(&format!("{strong}run 3\n"), 2);
    assert_eq!(said.matches("the thermostat is inaccurate").count(), 1, "{said}");
    assert!(said.contains("as drag is too strong for this timestep"), "{said}");
}

/// Minimisers work as without the fix, after a run too, and the pair style has no drag: positions, and with a box that is relaxed
/// its size and pressure.
#[test]
fn minimisation_is_not_affected() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("said.txt").display().to_string();
    for (before, relax) in [
        ("", ""),
        ("run 20\n", ""),
        ("", "fix br all box/relax iso 0.0 vmax 0.01\n"),
        ("run 20\n", "fix br all box/relax iso 0.0 vmax 0.01\n"),
    ] {
        for fix in ["two-stage", "force-gradient every 2", "aboba"] {
            let minimise = format!(
                "{relax}thermo_style custom step pe press lx\nmin_style cg\nminimize 0 1e-3 50 500\n\
                 print \"$(press:%.15g) $(lx:%.15g)\" file {out}\n"
            );
            let head = from_data(folder.path(), "comm_modify vel yes", fix, 0.01);
            let end = |script: &str| {
                let frame = run(script, 1);
                let said = std::fs::read_to_string(&out).unwrap();
                let words = said.split_whitespace().map(|w| w.parse::<f64>().unwrap());
                (frame, words.collect::<Vec<_>>())
            };
            let (with, found) = end(&format!("{head}{before}{minimise}"));
            let (without, expected) = end(&format!("{head}{before}unfix 1\n{minimise}"));
            assert!(difference(&with.x, &without.x) < 1e-9, "{fix}, {before}{relax}");
            for (a, b) in found.iter().zip(&expected) {
                assert!(
                    (a - b).abs() < 1e-9 * (1.0 + b.abs()),
                    "{fix}, {before}{relax}: {found:?} {expected:?}"
                );
            }
            let start = run(&format!("{head}run 0\n"), 1);
            assert!(difference(&with.x, &start.x) > 1e-4);
        }
    }
}

/// Each error is one line, before any step.
#[test]
fn what_does_not_go_together_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let head = from_data(folder.path(), "", "two-stage", 0.01);
    let fix = "fix 1 all dpd/splitting two-stage";
    let style = head.lines().find(|l| l.starts_with("pair_style")).unwrap().to_owned();
    let coeff = head.lines().find(|l| l.starts_with("pair_coeff")).unwrap().to_owned();
    let with = |more: &str| head.clone() + more;
    let instead = |fix_now: &str| head.replace(fix, fix_now);
    let cases = [
        (with("fix 2 all nve\n"), "fix 2 (nve) integrates too"),
        (with("fix 2 all dpd/splitting aboba\n"), "only one such fix is allowed"),
        (with("fix 2 all langevin 1 1 1 77\n"), "expects one evaluation of forces"),
        (with("run_style respa 2 2\n"), "works with 'run_style verlet' only, found 'respa'"),
        (with("neigh_modify exclude type 1 2\n"), "neigh_modify excludes pairs"),
        (
            with("fix 2 all deform 1 xy erate 0.1 remap v\n")
                .replace("read_data", "box tilt large\nread_data"),
            "fix deform",
        ),
        (
            head.replace(&style, "pair_style soft 1.0").replace(&coeff, "pair_coeff * * 25"),
            "needs pair_style dpd/psi, mdpd/psi or dpd/spline",
        ),
        (instead("fix 1 all dpd/splitting"), "expected 'two-stage', 'force-gradient' or 'aboba'"),
        (instead("fix 1 all dpd/splitting baoab"), "unknown splitting 'baoab'"),
        (instead("fix 1 all dpd/splitting two-stage every"), "keyword 'every' needs a value"),
        (instead("fix 1 all dpd/splitting two-stage every 0"), "every must be 1 or more, found 0"),
        (instead("fix 1 all dpd/splitting two-stage lambda 0.6"), "lambda must be from 0 to 0.5, found 0.6"),
        (
            instead("fix 1 all dpd/splitting aboba lambda 0.2"),
            "unknown keyword 'lambda': expected 'every' or 'noise'",
        ),
        (instead("fix 1 all dpd/splitting two-stage noise pink"), "unknown noise 'pink'"),
        (
            instead("fix 1 all dpd/splitting two-stage gradient 0.04"),
            "unknown keyword 'gradient': expected 'every', 'lambda' or 'noise'",
        ),
        (
            instead("fix 1 all dpd/splitting force-gradient length 0.04"),
            "unknown keyword 'length': expected 'every', 'lambda', 'gradient' or 'noise'",
        ),
        (
            instead("fix 1 all dpd/splitting force-gradient lambda -0.1"),
            "lambda must be from 0 to 0.5, found -0.1",
        ),
        (
            instead("fix 1 all dpd/splitting force-gradient gradient -0.1"),
            "gradient must be 0 or more, found -0.1",
        ),
        (
            instead("neighbor 0.01 bin\nfix 1 all dpd/splitting force-gradient gradient 100"),
            "the forces of step 1 displace atoms by more than half the skin of 0.01",
        ),
    ];
    for (script, message) in cases {
        let script = match message {
            "fix deform" => script.replace("fix 2", "change_box all triclinic\nfix 2"),
            _ => script,
        };
        let path = folder.path().join("in.refused");
        std::fs::write(&path, format!("{script}run 1\n")).unwrap();
        let outcome = psidpd_tests::lammps().0.run_script(1, folder.path(), &path, &[], LIMIT);
        let error = outcome.map(|run| run.stdout).expect_err(message).to_string();
        assert!(error.contains(message), "{message}\nfound: {error}");
    }
}

/// With factors between 0 and 1 bonded neighbours have the same drag as other pairs; with 0 the fix is refused.
#[test]
fn bonded_neighbours() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("chains.data"), chains(60)).unwrap();
    let script = |special: &str| {
        format!(
            "units lj\natom_style bond\nspecial_bonds lj {special}\nread_data {}\n{}pair_style mdpd/psi 1.0 1.0 {SEED}\n\
             pair_coeff * * -40 25 18 1 0.75\nbond_style harmonic\nbond_coeff * 50 0.5\n\
             fix 1 all dpd/splitting two-stage\ntimestep 0.005\nrun 10\n",
            folder.path().join("chains.data").display(),
            load()
        )
    };
    for special in ["1 1 1", "0.5 1 0.8"] {
        let [one, two] = [1, 2].map(|ranks| run(&script(special), ranks));
        let apart = difference(&two.v, &one.v);
        assert!(apart < 1e-5, "{special}: {apart:e}");
    }
    let path = folder.path().join("in.refused");
    std::fs::write(&path, script("0 1 1")).unwrap();
    let outcome = psidpd_tests::lammps().0.run_script(1, folder.path(), &path, &[], LIMIT);
    assert!(outcome.expect_err("refused").to_string().contains("special_bonds has factors of 0"));
}
