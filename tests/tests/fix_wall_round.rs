//! Cylinders and spheres of the fix of walls of matter. `export_lammps.rs` compares their steps, energies and pressures with those of the
//! native runner; the tests here compare forces with the reference evaluation, and show that ranks and restarts do not matter, that
//! reflection keeps energy and momentum, and that wrong input is refused.

mod style_common;

use psidpd_core::model::Model;
use psidpd_core::model::wall::{Round, Surface, Wall};
use psidpd_tests::lammps;
use std::path::Path;
use style_common::*;

const CAPILLARY: &str = "cylinder z 2.6 2.4 2 inside";
const FIBRE: &str = "cylinder x 1.2 1.3 1.1 outside";
const BALL: &str = "sphere 2.5 4.1 4 1.2 outside";

/// The walls of [`CAPILLARY`], [`FIBRE`] and [`BALL`].
fn round(text: &str) -> Wall {
    let (across, center, radius) = match text {
        CAPILLARY => ([true, true, false], [2.6, 2.4, 0.0], 2.0),
        FIBRE => ([false, true, true], [0.0, 1.2, 1.3], 1.1),
        _ => ([true; 3], [2.5, 4.1, 4.0], 1.2),
    };
    Wall {
        surface: Surface::Round(Round { across, center, radius, inside: text == CAPILLARY }),
        species: 1,
        density: 4.0,
        local_densities: Vec::new(),
        strength: 0.8,
        velocity: [0.0; 3],
        drag: [None; 2],
    }
}

/// Commands that delete what is in the matter of some walls.
fn cleared(walls: &[&str]) -> String {
    let one = |(k, wall): (usize, &&str)| {
        let words: Vec<&str> = wall.split(' ').collect();
        let [place, side] = [&words[..words.len() - 1], &words[words.len() - 1..]];
        let ends = if words[0] == "cylinder" { "EDGE EDGE" } else { "" };
        let part = if side == ["inside"] { "out" } else { "in" };
        format!("region m{k} {} {ends} side {part}\ndelete_atoms region m{k} compress yes\n", place.join(" "))
    };
    walls.iter().filter(|wall| **wall != "zhi").enumerate().map(one).collect()
}

#[test]
fn forces_are_those_of_the_reference() {
    let (_folder, path) = file(WIDE);
    let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A B\n");
    let keys = "density 4 type 2 strength 0.8";
    let end = Wall { surface: Surface::Face { axis: 2, high: true }, ..round(CAPILLARY) };
    for (walls, before) in [
        (&[CAPILLARY][..], "boundary p p p"),
        (&[CAPILLARY], "boundary f f p\nnewton off"),
        (&[FIBRE, BALL], "boundary p p p"),
        (&[FIBRE, BALL], "boundary p p p\nnewton off"),
        (&[CAPILLARY, "zhi"], "boundary p p f"),
    ] {
        let all = walls.iter().map(|wall| if *wall == "zhi" { end.clone() } else { round(wall) });
        let model = Model::parse("wide", WIDE).unwrap().with_walls(all.collect());
        let script = format!(
            "{}{}{style}fix w all dpd/wall {} {keys}\n",
            particles(before, "block 0 5.1 0 6 0 6", 2, 700),
            cleared(walls),
            walls.join(" ")
        );
        compare_walls(&script, &model, &["w[1]", "w[2]"][..walls.len()]);
    }
    // Two dimensions, and a fix for each of two circles.
    let (_folder, path) = file(FLAT);
    let circle = |center: [f64; 3]| Wall {
        surface: Surface::Round(Round { across: [true, true, false], center, radius: 1.4, inside: false }),
        species: 0,
        density: 3.0,
        local_densities: vec![2.0],
        strength: 1.0,
        velocity: [0.0; 3],
        drag: [None; 2],
    };
    let flat = Model::parse("flat", FLAT)
        .unwrap()
        .with_walls(vec![circle([1.45, 4.0, 0.0]), circle([5.0, 7.5, 0.0])]);
    let start = particles("dimension 2\nboundary p p p", "block 0 9 0 9 -0.1 0.1", 1, 300);
    let walls = ["sphere 1.45 4 0 1.4 outside", "sphere 5 7.5 0 1.4 outside"];
    let style = format!(
        "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} F\nfix flat all enforce2d\n\
         fix v all dpd/wall {} density 3 local/density 2\nfix w all dpd/wall {} density 3 local/density 2\n",
        walls[0], walls[1]
    );
    compare_walls(&format!("{start}{}{style}", cleared(&walls)), &flat, &["v[1]", "w[1]"]);
}

/// Atoms between some walls, with the same numbers on any ranks.
fn between(folder: &Path, walls: &[&str], before_box: &str, fix: &str) -> String {
    let (data, model) = (folder.join("start.data"), folder.join("wide.toml"));
    let commands = |keys: &str| {
        let one = |(k, wall): (usize, &&str)| {
            format!("fix w{} all dpd/wall {wall} density 4 type 2 {keys}\n", k + 1)
        };
        walls.iter().enumerate().map(one).collect::<String>()
    };
    if !data.exists() {
        std::fs::write(&model, WIDE).unwrap();
        let settle = particles("boundary p p p", "block 0 5.1 0 6 0 6", 2, 700) + &cleared(walls);
        let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {} A B\n", model.display());
        run(
            &format!(
                "{settle}{style}{}fix 1 all nve\ntimestep 0.01\nrun 50\nreset_timestep 0\nwrite_data {} nocoeff\n",
                commands(""),
                data.display()
            ),
            1,
        );
    }
    format!(
        "units lj\natom_style atomic\natom_modify map yes\n{before_box}\ncomm_modify vel yes\nread_data {}\n{}\
         pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {} A B\n{}fix 1 all {fix}\ntimestep 0.02\nthermo_modify norm no\n",
        data.display(),
        load(),
        model.display(),
        commands("drag 9 drag/range 0.9")
    )
}

/// Trajectories, energies and forces on walls agree on one, two and four ranks, divided along any direction, with newton on and off, and with
/// output at any steps. Some thirty atoms meet a surface.
#[test]
fn ranks_and_output_do_not_matter() {
    for (walls, fix) in [
        (&[CAPILLARY][..], "nve"),
        (&[FIBRE, BALL], "nve"),
        (&[FIBRE, BALL], "dpd/splitting two-stage"),
        (&[CAPILLARY], "dpd/splitting force-gradient"),
        (&[FIBRE, BALL], "dpd/splitting aboba every 2"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let last = "print \"$(pe:%.15g) $(press:%.15g) $(f_w1:%.15g) $(f_w1[1]:%.15g) $(f_w1[1][1]:%.15g) $(f_w1[1][2]:%.15g) \
            $(f_w1[1][3]:%.15g)\" file totals screen no\n";
        let outcome = |head: &str, ranks: usize, thermo: usize| {
            let end = run_in(
                folder.path(),
                &format!(
                    "{}fix_modify w1 energy yes virial yes\nthermo {thermo}\nrun 12\n{last}",
                    between(folder.path(), walls, head, fix)
                ),
                ranks,
            );
            let totals = std::fs::read_to_string(folder.path().join("totals")).unwrap();
            (end, totals.split_whitespace().map(|n| n.parse().unwrap()).collect::<Vec<f64>>())
        };
        let (one, totals) = outcome("", 1, 0);
        for (ranks, head, thermo) in [
            (1, "newton off", 1),
            (2, "newton off\nprocessors 1 1 2", 0),
            (2, "processors 2 1 1", 1),
            (4, "processors 1 2 2", 5),
            (4, "newton off\nprocessors * * *\ncomm_style tiled", 0),
        ] {
            let (other, sums) = outcome(head, ranks, thermo);
            let apart = [difference(&other.v, &one.v), difference(&other.f, &one.f)];
            assert!(apart.iter().all(|d| *d < 1e-8), "{walls:?} {fix}, {head}, {ranks} ranks: {apart:?}");
            for (a, b) in sums.iter().zip(&totals) {
                let near = (a - b).abs() < 1e-8 * (1.0 + b.abs());
                assert!(near, "{walls:?} {fix}, {head}, {ranks} ranks: {sums:?} {totals:?}");
            }
        }
    }
}

/// A run that goes on from a restart file with the same commands, without the thermostat in the forces, is that of one run.
#[test]
fn a_run_goes_on_from_a_restart_file() {
    let folder = tempfile::tempdir().unwrap();
    let script = between(folder.path(), &[CAPILLARY], "", "dpd/splitting two-stage");
    let whole = run(&format!("{script}run 10\n"), 1);
    let path = folder.path().join("half.restart");
    run(&format!("{script}run 5\nwrite_restart {}\n", path.display()), 1);
    let (from, to) = (script.find("units").unwrap(), script.find("plugin load").unwrap());
    let again = format!(
        "{}comm_modify vel yes\n{}read_restart {}\n{}",
        &script[..from],
        load(),
        path.display(),
        &script[to..]
    );
    let rest = run(&format!("{again}run 5\n"), 1);
    let apart = difference(&rest.v, &whole.v);
    assert!(apart < 1e-10, "{apart}");
}

/// Without drag and noise the deviations of the energy fall with Δt².
#[test]
fn energy_is_conserved_to_second_order() {
    let text = std::fs::read_to_string(warren()).unwrap();
    let cold: String = text.split("[[thermostat]]").next().unwrap().to_owned();
    let model = Model::parse("cold", &cold).unwrap();
    assert!(model.at(1.0).unwrap().thermostats.iter().all(Option::is_none));
    let (_folder, path) = file(&cold);
    for fix in ["nve", "dpd/splitting two-stage", "dpd/splitting aboba"] {
        let start = particles("boundary p p p", "block 0 5.1 0 6 0 6", 1, 1110);
        let deviation = |dt: f64| {
            let l = open(&format!(
                "{start}{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n\
                 fix w all dpd/wall {FIBRE} {BALL} density 6.05 local/density 2.3\nfix_modify w energy yes\nfix 1 all nve\n\
                 timestep 0.01\nthermo_style custom step etotal\nthermo_modify norm no\nrun 150\n\
                 pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} F\nunfix 1\nfix 1 all {fix}\ntimestep {dt}\nrun 0\n",
                cleared(&[FIBRE, BALL]),
                warren()
            ));
            let count = l.eval("atoms").unwrap();
            let (first, mut squares, steps) = (l.thermo("etotal").unwrap(), 0.0, (0.3 / dt).round() as usize);
            for _ in 0..steps {
                l.commands("run 1 pre no").unwrap();
                squares += (l.thermo("etotal").unwrap() - first).powi(2);
            }
            (squares / steps as f64).sqrt() / count
        };
        let [coarse, fine] = [0.01, 0.0025].map(deviation);
        assert!(coarse < 6e-3 && fine < coarse / 7.0, "{fix}: {coarse} {fine}");
    }
}

/// An ideal gas whose drag is `gamma`.
fn gas(gamma: f64) -> String {
    let thermostat = format!("[[thermostat]]\ngamma = {gamma}\nrange = 1\n");
    format!("title = \"gas\"\nspecies = [\"A\"]\n{}", if gamma > 0.0 { &thermostat } else { "" })
}

/// What walls take in a step, by drag, noise and reflection, is what the gas loses in it, and atoms outside the group keep their places.
#[test]
fn walls_take_the_momentum_that_the_gas_loses() {
    let (_folder, path) = file(&gas(0.0));
    for (walls, fix, group) in [
        (&[CAPILLARY][..], "nve", "all"),
        (&[FIBRE, BALL], "nve", "moving"),
        (&[FIBRE, BALL], "dpd/splitting two-stage", "all"),
        (&[CAPILLARY], "dpd/splitting aboba", "moving"),
    ] {
        let velocity = if walls.len() == 1 { "velocity 0 0 2" } else { "" };
        let l = open(&format!(
            "{}{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A\nmass 1 1.7\ngroup moving id > 100\n\
             group still subtract all {group}\nvelocity still set 0 0 0\n\
             fix w {group} dpd/wall {} density 3 drag 30 drag/range 1 {velocity}\n\
             fix 1 {group} {fix}\ntimestep 0.05\nthermo_style custom step f_w[1][1]\nrun 0\n",
            particles("boundary p p p", "block 0 5.1 0 6 0 6", 1, 700),
            cleared(walls),
            walls.join(" ")
        ));
        let sum = |v: &[[f64; 3]], c: usize| 1.7 * v.iter().map(|v| v[c]).sum::<f64>();
        let still = frame(&l).x[..if group == "all" { 0 } else { 50 }].to_vec();
        for _ in 0..4 {
            let before = frame(&l).v;
            l.commands("run 1").unwrap();
            let after = frame(&l).v;
            for c in 0..3 {
                let given = |w: usize| l.eval(&format!("f_w[{w}][{}]", c + 1)).unwrap();
                let given: f64 = (1..=walls.len()).map(given).sum();
                let lost = sum(&before, c) - sum(&after, c);
                assert!(
                    given.abs() > 1.0 && (lost - 0.05 * given).abs() < 1e-9,
                    "{walls:?} {fix} {c}: {lost} {given}"
                );
            }
        }
        assert!(still == frame(&l).x[..still.len()]);
    }
}

/// An ideal gas beside a wall without forces keeps the speed of every atom and its uniform density, and presses with ρkT: on one rank and on
/// two. Four shells of equal volume have a quarter of the atoms each, some 1000 with a deviation of 28; the pressure of some 4 10⁴ bounces is known
/// to 1 %. A fix nvt multiplies the speeds of all atoms by one factor.
#[test]
fn an_ideal_gas_in_a_sphere_stays_as_it_is() {
    let (_folder, path) = file(&gas(0.0));
    let cavity = "sphere 2.6 3 3.2 2.5 inside";
    for (fix, ranks) in [
        ("nve", 1),
        ("nve", 2),
        ("nvt temp 1 1 2", 2),
        ("dpd/splitting two-stage", 2),
        ("dpd/splitting aboba", 1),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let settings = format!(
            "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A\n\
             fix w all dpd/wall {cavity} density 3 strength 0 drag 0\nfix 1 all {fix}\ntimestep 0.1\nthermo_modify norm no\n"
        );
        let gas = particles("boundary p p p", "block 0 6 0 6 0 6", 1, 13_000);
        let gas = gas.replace("overlap 0.3 maxtry 200", "") + &cleared(&[cavity]);
        let data =
            "units lj\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\nread_data start.data\n";
        let start = format!("{data}{}{settings}", load());
        run_in(folder.path(), &format!("{gas}{settings}run 0\nwrite_data start.data nocoeff\n"), 1);
        let first = run_in(folder.path(), &format!("{start}run 0\n"), 1);
        let mean = "fix p all ave/time 1 60 60 f_w[1] file push\nrun 60\nprint \"$(ke:%.15g)\" file heat screen no\n";
        let last = run_in(folder.path(), &format!("{start}{mean}"), ranks);
        let speed = |v: &[f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let sum = |v: &[[f64; 3]]| v.iter().map(speed).sum::<f64>();
        let factor = if fix.starts_with("nvt") { sum(&last.v) / sum(&first.v) } else { 1.0 };
        for (a, b) in first.v.iter().zip(&last.v) {
            assert!((factor * speed(a) - speed(b)).abs() < 1e-9 * (1.0 + speed(a)), "{fix}: {a:?} {b:?}");
        }
        let mut shells = [0.0; 4];
        for x in &last.x {
            let r = [x[0] - 2.6, x[1] - 3.0, x[2] - 3.2].iter().map(|d| d * d).sum::<f64>().sqrt();
            assert!(r < 2.5 + 1e-6);
            shells[((r / 2.5).powi(3) * 4.0).min(3.0) as usize] += 1.0;
        }
        let each = last.x.len() as f64 / 4.0;
        assert!(shells.iter().all(|n| (n - each).abs() < 5.0 * (0.75 * each).sqrt()), "{fix}: {shells:?}");
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        let number = |text: String| text.split_whitespace().last().unwrap().parse::<f64>().unwrap();
        let (push, heat) = (number(read("push")), number(read("heat")));
        let expected = 2.0 * heat / 2.5;
        assert!((push / expected - 1.0).abs() < 0.05, "{fix}: {push} {expected}");
    }
}

/// LAMMPS's output, or its error.
fn outcome(text: &str) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    std::fs::write(&path, text).unwrap();
    let done = lammps().0.run_script(1, folder.path(), &path, &[], LIMIT);
    done.map(|run| run.stdout).map_err(|e| e.to_string())
}

/// Each row has a text to replace, its replacement, and a part of the error.
#[test]
fn what_cannot_work_is_refused() {
    let (_folder, wide) = file(WIDE);
    let base = format!(
        "{}{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B\nfix w all dpd/wall {BALL} density 3 species A\n\
         fix 1 all nve\nrun 2\n",
        particles("boundary p p p", "block 0 5.1 0 6 0 6", 2, 300),
        cleared(&[BALL])
    );
    let said = outcome(&base).unwrap();
    assert!(said.contains("wall          sphere") && !said.contains("nothing keeps atoms"), "{said}");
    let (whole, fix) = (format!("fix w all dpd/wall {BALL} density 3 species A"), format!("{BALL} density"));
    for (from, to, message) in [
        (
            &fix[..],
            "sphere 2 2 2 1 density",
            "the fluid of a sphere is 'inside' or 'outside', found 'density'",
        ),
        (
            &whole,
            "fix w all dpd/wall sphere 2 2 2",
            "expected 'sphere X Y Z RADIUS' and 'inside' or 'outside'",
        ),
        (&fix, "sphere 2.5 4.1 4 -1.2 outside density", "radius must be positive, found -1.2"),
        (&fix, "cylinder w 2 2 1.2 outside density", "the axis of a cylinder is x, y or z, found 'w'"),
        (&fix, "sphere 2.5 4.1 4 0.9 outside density", "smaller than the range"),
        (&fix, "sphere 2.5 4.1 4 2.6 inside density", "sphere: the surface does not lie in the box along x"),
        (&fix, "cylinder z 2.5 3 2.4 inside density", "a length of 5.8 along x, or more"),
        (&fix, "sphere 2.5 1.3 4 1.2 outside sphere 2.5 4.1 4 1.2 outside density", "two round walls are"),
        (
            &fix,
            "cylinder z 2.5 3 2 inside sphere 2.5 4.1 4 1.2 outside density",
            "has no other round one beside it",
        ),
        (
            "species A",
            "species A velocity 0 0 1",
            "a cylinder moves along its axis only, and a sphere not at all",
        ),
        ("boundary p p p", "boundary p p s", "the box follows the atoms across a sphere"),
        (
            "fix 1 all nve",
            "fix 1 all nve\nfix d all deform 1 z scale 1.1",
            "a sphere stays as it is, and fix d (deform) changes the box across it",
        ),
        (
            "region b block 0 5.1 0 6 0 6",
            "region b prism 0 5.1 0 6 0 6 0 0 0",
            "a sphere needs a box without tilt",
        ),
        ("delete_atoms", "#", "is in the matter of a cylinder or a sphere"),
        (
            "run 2",
            "unfix w\nrun 2\nfix w all dpd/wall zlo density 3 type 1",
            "the box is periodic across face zlo",
        ),
    ] {
        let script = base.replace(from, to);
        assert!(script != base, "{from}");
        let error = outcome(&script).expect_err(to);
        assert!(error.contains(message), "{to}: {error}");
    }
    let flat = particles("dimension 2\nboundary p p p", "block 0 9 0 9 -0.1 0.1", 1, 10);
    let error =
        outcome(&format!("{flat}fix w all dpd/wall cylinder z 4 4 2 outside density 3\n")).unwrap_err();
    assert!(error.contains("in two dimensions a circle is a sphere"), "{error}");
    // Along a cylinder the box may change.
    let along = base.replace(&format!("fix w all dpd/wall {BALL}"), &format!("fix w all dpd/wall {FIBRE}"));
    let along = along.replace(&cleared(&[BALL]), &cleared(&[FIBRE]));
    outcome(&along.replace("fix 1 all nve", "fix 1 all nve\nfix d all deform 1 x scale 1.01")).unwrap();
}
