//! The fix of walls of matter. `export_lammps.rs` compares its steps, energies and pressures with those of the native runner; the
//! tests here compare forces with the reference evaluation, and show that ranks do not matter, that flows do not slip, that the gas
//! beside a wall has its temperature, and that wrong input is refused.

mod style_common;

use psidpd_core::model::wall::{Surface, Wall};
use psidpd_core::model::{ForceLaw, Model, WarrenPair, warren_ab};
use psidpd_tests::{lammps, last_words};
use std::path::Path;
use style_common::*;

/// Walls at both faces of z, one of them moving, of the second species of [`WIDE`] and of its first.
const COMMANDS: &str = "fix lo all dpd/wall zlo density 4 type 2 strength 0.8 drag 9 drag/range 0.9 velocity 0.5 -0.2 0\n\
    fix hi all dpd/wall zhi density 3 species A local/density 2.5 1.5\n";

fn wall(axis: usize, high: bool) -> Wall {
    Wall {
        surface: Surface::Face { axis, high },
        species: 0,
        density: 3.0,
        local_densities: Vec::new(),
        strength: 1.0,
        velocity: [0.0; 3],
        drag: [None; 2],
    }
}

/// The walls of [`COMMANDS`].
fn walls() -> Vec<Wall> {
    let low = Wall { species: 1, density: 4.0, strength: 0.8, ..wall(2, false) };
    vec![low, Wall { local_densities: vec![2.5, 1.5], ..wall(2, true) }]
}

#[test]
fn forces_are_those_of_the_reference() {
    let (_folder, path) = file(WIDE);
    let model = Model::parse("wide", WIDE).unwrap().with_walls(walls());
    let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A B\n{COMMANDS}");
    let both = ["lo[1]", "hi[1]"];
    for (before, region) in [
        ("boundary p p f", "block 0 5 0 5 0 5"),
        ("boundary f p f\nnewton off", "block -1 4 0 4 1 6"),
        ("boundary p p f", "prism 0 5 0 5 0 5 1.5 0 0"),
        ("boundary p p f", "block 0 5 0 5 0 0.8"),
    ] {
        compare_walls(
            &format!(
                "{}{style}",
                particles(before, region, 2, if region.ends_with("0.8") { 80 } else { 500 })
            ),
            &model,
            &both,
        );
    }
    // Six faces in one command, of which corners feel three.
    let six = (0..6).map(|k| wall(k / 2, k % 2 == 1)).collect();
    let text = std::fs::read_to_string(warren()).unwrap();
    let local = 4.5;
    let six: Vec<Wall> =
        Vec::from_iter(Vec::into_iter(six).map(|w: Wall| Wall { local_densities: vec![local], ..w }));
    let model = Model::parse("warren", &text).unwrap().with_walls(six);
    let names = ["all[1]", "all[2]", "all[3]", "all[4]", "all[5]", "all[6]"];
    let style = format!(
        "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n\
         fix all all dpd/wall xlo xhi ylo yhi zlo zhi density 3 local/density {local}\n",
        warren()
    );
    compare_walls(
        &format!("{}{style}", particles("boundary f f f", "block 0 5 0 4 0 3", 1, 360)),
        &model,
        &names,
    );
    let hybrid = style.replace("dpd/psi 1.0", "hybrid dpd/psi 1.0").replace("* * \"", "* * dpd/psi \"");
    compare_walls(
        &format!("{}{hybrid}", particles("boundary f f f", "block 0 5 0 4 0 3", 1, 360)),
        &model,
        &names,
    );
}

/// The other styles, whose species are types, and two dimensions.
#[test]
fn walls_of_the_other_styles() {
    let pair = |a: f64, b: f64| WarrenPair { a, b, gamma: 4.5, rc: 1.0, rd: 0.75, weight: None };
    let table = [Some(pair(-40.0, 25.0)), Some(pair(-30.0, 25.0)), None, Some(pair(-20.0, 25.0))];
    let model = warren_ab(&["T1".into(), "T2".into()], &table, 3, ForceLaw::Conservative).unwrap();
    let model = model.with_walls(vec![Wall { species: 1, strength: 1.3, ..wall(1, true) }]);
    let style = format!(
        "pair_style mdpd/psi 1.0 1.0 {SEED}\npair_coeff 1 1 -40 25 4.5 1 0.75\npair_coeff 1 2 -30 25 4.5 1 0.75\n\
         pair_coeff 2 2 -20 25 4.5 1 0.75\nfix w all dpd/wall yhi density 3 type 2 strength 1.3\n"
    );
    compare_walls(
        &format!("{}{style}", particles("boundary p f p", "block 0 5 0 5 0 5", 2, 500)),
        &model,
        &["w[1]"],
    );
    let (_folder, path) = file(FLAT);
    let flat = Model::parse("flat", FLAT)
        .unwrap()
        .with_walls(vec![Wall { local_densities: vec![2.0], ..wall(0, false) }]);
    let style = format!(
        "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} F\nfix flat all enforce2d\n\
         fix w all dpd/wall xlo density 3 local/density 2\n"
    );
    let start = particles("dimension 2\nboundary f p p", "block 0 9 0 9 -0.1 0.1", 1, 300);
    compare_walls(&format!("{start}{style}"), &flat, &["w[1]"]);
}

/// Atoms between the walls of [`COMMANDS`], with the same numbers on any ranks.
fn between(folder: &Path, before_box: &str, fix: &str, more: &str) -> String {
    let (data, model) = (folder.join("start.data"), folder.join("wide.toml"));
    if !data.exists() {
        std::fs::write(&model, WIDE).unwrap();
        let settle = particles("boundary p p f", "block 0 6 0 5 0 5", 2, 600);
        let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {} A B\n", model.display());
        run(
            &format!(
                "{settle}{style}fix walls all wall/reflect zlo EDGE zhi EDGE\nfix 1 all nve\ntimestep 0.005\nrun 50\n\
                 reset_timestep 0\nwrite_data {} nocoeff\n",
                data.display()
            ),
            1,
        );
    }
    format!(
        "units lj\natom_style atomic\natom_modify map yes\nboundary p p f\n{before_box}\ncomm_modify vel yes\nread_data {}\n{}\
         pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {} A B\n{COMMANDS}fix walls all wall/reflect zlo EDGE zhi EDGE\n\
         fix 1 all {fix}\ntimestep 0.02\nthermo_modify norm no\n{more}",
        data.display(),
        load(),
        model.display()
    )
}

/// Trajectories, energies, forces on walls and densities agree on one, two and four ranks, divided along any direction, with newton on
/// and off, and also where single atoms have energies.
#[test]
fn ranks_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let of_atoms = "compute e all pe/atom\ncompute s all stress/atom NULL\ncompute t all reduce sum c_e c_s[3]\n\
        fix n all pair 1 dpd/psi density 0\ncompute n all reduce sum f_n[1] f_n[4]\nfix_modify lo energy yes virial yes\n\
        thermo_style custom step pe press c_t[1] c_t[2] c_n[1] c_n[2]\nthermo 1\n";
    let last = "print \"$(pe:%.15g) $(press:%.15g) $(f_lo:%.15g) $(f_lo[1]:%.15g) $(f_hi[1]:%.15g) $(f_lo[1][1]:%.15g) \
        $(f_lo[1][3]:%.15g) $(f_hi[1][2]:%.15g)\" file totals screen no\n";
    for (fix, more) in
        [("nve", ""), ("nve", of_atoms), ("dpd/splitting two-stage", ""), ("dpd/splitting aboba every 2", "")]
    {
        let outcome = |head: &str, ranks: usize| {
            let end = run_in(
                folder.path(),
                &format!("{}run 12\n{last}", between(folder.path(), head, fix, more)),
                ranks,
            );
            let totals = std::fs::read_to_string(folder.path().join("totals")).unwrap();
            (end, totals.split_whitespace().map(|n| n.parse().unwrap()).collect::<Vec<f64>>())
        };
        let (one, totals) = outcome("", 1);
        for (ranks, head) in [
            (1, "newton off"),
            (2, "newton off\nprocessors 1 1 2"),
            (2, "processors 2 1 1"),
            (4, "processors 1 2 2"),
            (4, "newton off\nprocessors * * *\ncomm_style tiled"),
        ] {
            let (other, sums) = outcome(head, ranks);
            let apart = [difference(&other.v, &one.v), difference(&other.f, &one.f)];
            assert!(apart.iter().all(|d| *d < 1e-8), "{fix}, {head}, {ranks} ranks: {apart:?}");
            for (a, b) in sums.iter().zip(&totals) {
                assert!(
                    (a - b).abs() < 1e-8 * (1.0 + b.abs()),
                    "{fix}, {head}, {ranks} ranks: {sums:?} {totals:?}"
                );
            }
        }
    }
}

/// In mixed precision with threads forces are those of double precision to rounding.
#[test]
fn mixed_precision_and_threads() {
    let folder = tempfile::tempdir().unwrap();
    let script = between(folder.path(), "", "nve", "run 1\n");
    let exact = run(&script, 1);
    for ranks in [1, 2] {
        let mixed =
            script.replace(&format!("psi 1.0 {SEED}"), &format!("psi 1.0 {SEED} precision mixed threads 2"));
        let apart = difference(&run(&mixed, ranks).f, &exact.f);
        assert!(apart > 1e-13 && apart < 1e-4, "{ranks}: {apart}");
    }
}

/// An ideal gas whose drag is `gamma`.
fn gas(gamma: f64) -> String {
    format!("title = \"gas\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = {gamma}\nrange = 1\n")
}

/// What walls take along themselves in a step is what the gas loses in it, and atoms outside the group keep their velocities.
#[test]
fn walls_take_the_momentum_that_the_gas_loses() {
    let (_folder, path) = file(&gas(4.5));
    for (group, first) in [("all", 0), ("moving", 100)] {
        let l = open(&format!(
            "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A\nmass 1 1.7\ngroup moving id > 100\n\
             group still subtract all {group}\nvelocity still set 0 0 0\n\
             fix w {group} dpd/wall zlo zhi density 3 drag 30 velocity 2 -1 0\nfix r all wall/reflect zlo EDGE zhi EDGE\n\
             fix 1 {group} nve\ntimestep 0.02\nthermo_style custom step f_w[1][1] f_w[1][2] f_w[2][1] f_w[2][2]\nrun 0\n",
            particles("boundary p p f", "block 0 4 0 4 0 5", 1, 400)
        ));
        let sum = |v: &[[f64; 3]], c: usize| 1.7 * v.iter().map(|v| v[c]).sum::<f64>();
        for _ in 0..4 {
            let before = frame(&l).v;
            l.commands("run 1").unwrap();
            let after = frame(&l).v;
            assert!(after[..first].iter().all(|v| *v == [0.0; 3]));
            for c in 0..2 {
                let given = |w: usize| l.eval(&format!("f_w[{w}][{}]", c + 1)).unwrap();
                let (given, lost) = (given(1) + given(2), sum(&before, c) - sum(&after, c));
                assert!(given.abs() > 1.0);
                assert!(first > 0 || (lost - 0.02 * given).abs() < 1e-9, "{c}: {lost} {given}");
            }
        }
    }
}

/// Beside strong drag a gas has its temperature, with both integrators: mean of 20 blocks, of which Student's t exceeds 6 less than
/// once in 10^5 seeds. Each block has 12 samples of some 60 particles.
#[test]
fn a_gas_beside_walls_has_its_temperature() {
    let (_folder, path) = file(&gas(1.0));
    for fix in ["nve", "dpd/splitting two-stage"] {
        let folder = tempfile::tempdir().unwrap();
        let script = format!(
            "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A\nfix w all dpd/wall zlo zhi density 4 drag 200\n\
             fix r all wall/reflect zlo EDGE zhi EDGE\nfix 1 all {fix}\ntimestep 0.05\nvariable u atom \"vx*vx+vy*vy+vz*vz\"\n\
             compute c all chunk/atom bin/1d z lower 0.1 units reduced\n\
             run 120\nfix a all ave/chunk 2 12 24 c v_u ave one file slabs\nrun 480\n",
            particles("boundary p p f", "block 0 4 0 4 0 5", 1, 320)
        );
        run_in(folder.path(), &script, 1);
        let text = std::fs::read_to_string(folder.path().join("slabs")).unwrap();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split_whitespace().map(|n| n.parse().unwrap()).collect())
            .collect();
        let rows: Vec<&Vec<f64>> = rows.iter().filter(|row| row.len() == 4).collect();
        assert_eq!(rows.len(), 200, "{text}");
        let means: Vec<f64> = rows
            .chunks(10)
            .map(|block| {
                let ends = [block[0], block[9]];
                ends.iter().map(|row| row[2] * row[3]).sum::<f64>()
                    / ends.iter().map(|row| 3.0 * row[2]).sum::<f64>()
            })
            .collect();
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let error = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        assert!((mean - 1.0).abs() < 6.0 * error && error < 0.02, "{fix}: {mean} +- {error}");
    }
}

/// Standard DPD between walls that move against each other has their velocities at their faces: a straight line through the profile
/// reaches them within 0.4 of the faces, and the forces on the walls are the stress of that flow. In eight seeds the places were 0.03
/// and 0.06 from the faces, into the fluid, with a scatter of 0.07, and the stress 0.97 of that of the viscosity, with a scatter of 2 %: five of those are exceeded less
/// than once in 10^5 seeds. Without drag the fluid would not flow at all.
#[test]
fn a_shear_flow_does_not_slip() {
    let folder = tempfile::tempdir().unwrap();
    let model = psidpd_tests::root().join("validation/models/standard-dpd.toml");
    let name = Model::open(&model).unwrap().species()[0].clone();
    let script = format!(
        "{}pair_style dpd/psi 1.0 {SEED} precision mixed\npair_coeff * * \"{}\" {name}\n\
         fix lo all dpd/wall zlo density 3 viscosity 0.85 velocity -1 0 0\nfix hi all dpd/wall zhi density 3 viscosity 0.85 velocity 1 0 0\n\
         fix r all wall/reflect zlo EDGE zhi EDGE\nfix 1 all dpd/splitting two-stage\ntimestep 0.04\n\
         compute c all chunk/atom bin/1d z lower 0.1 units reduced\n\
         variable lo equal f_lo[1][1]\nvariable hi equal f_hi[1][1]\nfix f all ave/time 1 8000 10000 v_lo v_hi file forces\n\
         run 2000\nfix a all ave/chunk 1 8000 10000 c vx file slabs\nrun 8000\n",
        particles("boundary p p f", "block 0 5 0 5 0 6", 1, 450),
        model.display()
    );
    run_in(folder.path(), &script, 1);
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let rows: Vec<Vec<f64>> = read("slabs")
        .lines()
        .map(|line| line.split_whitespace().filter_map(|n| n.parse().ok()).collect())
        .collect();
    let rows: Vec<[f64; 2]> =
        rows.iter().filter(|row| row.len() == 4).map(|row| [6.0 * row[1], row[3]]).collect();
    assert_eq!(rows.len(), 10, "{}", read("slabs"));
    let inner = &rows[2..8];
    let mean = |c: usize| inner.iter().map(|row| row[c]).sum::<f64>() / inner.len() as f64;
    let (z, v) = (mean(0), mean(1));
    let slope = inner.iter().map(|row| (row[0] - z) * (row[1] - v)).sum::<f64>()
        / inner.iter().map(|row| (row[0] - z).powi(2)).sum::<f64>();
    // The heights at which the line has the velocities of the walls.
    let [low, high] = [-1.0, 1.0].map(|wall| z + (wall - v) / slope);
    assert!(low.abs() < 0.4 && (high - 6.0).abs() < 0.4, "{low} {high} {rows:?}");
    let forces = read("forces");
    let last: Vec<f64> =
        forces.lines().last().unwrap().split_whitespace().map(|n| n.parse().unwrap()).collect();
    let stress = 0.85 * slope * 25.0;
    assert!(
        (last[1] / stress - 1.0).abs() < 0.15 && (last[2] / stress + 1.0).abs() < 0.15,
        "{last:?} {stress}"
    );
}

/// LAMMPS's output, or its error.
fn outcome(text: &str, ranks: usize) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    std::fs::write(&path, text).unwrap();
    let done = lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT);
    done.map(|run| run.stdout).map_err(|e| e.to_string())
}

/// Each row has a text to replace, its replacement, and a part of the error.
#[test]
fn what_cannot_work_is_refused() {
    let (_folder, wide) = file(WIDE);
    let base = format!(
        "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B\nfix w all dpd/wall zlo density 3 species A\n\
         fix r all wall/reflect zlo EDGE zhi EDGE\nfix 1 all nve\nrun 2\n",
        particles("boundary p p f", "block 0 5 0 5 0 5", 2, 100)
    );
    let said = outcome(&base, 1).unwrap();
    assert!(said.contains("wall          zlo: A at a density of 3"), "{said}");
    let (style, fix) = ("pair_style dpd/psi 1.0 5", "fix w all dpd/wall zlo density 3 species A");
    for (from, to, message) in [
        (fix, "fix w all dpd/wall", "expected faces of the box"),
        (
            fix,
            "fix w all dpd/wall density 3",
            "expected faces of the box, xlo, xhi, ylo, yhi, zlo or zhi, or a cylinder or a sphere, found 'density'",
        ),
        (fix, "fix w all dpd/wall zlo zlo density 3", "face zlo is named twice"),
        (fix, "fix w all dpd/wall zlo", "the density of the wall's matter is missing"),
        (fix, "fix w all dpd/wall zlo density 0", "density must be positive, found 0"),
        (fix, "fix w all dpd/wall zlo density 3 strength -1", "strength must not be negative"),
        (fix, "fix w all dpd/wall zlo density 3 strength", "needs a value"),
        (fix, "fix w all dpd/wall zlo density 3 velocity 1 0", "needs three values"),
        (fix, "fix w all dpd/wall zlo density 3 velocity 0 0 1", "a wall moves along its face only"),
        (fix, "fix w all dpd/wall zlo density 3 gamma 1", "unknown keyword 'gamma'"),
        (fix, "fix w all dpd/wall zlo density 3 type 3", "there is no type 3"),
        (fix, "fix w all dpd/wall zlo density 3 species C", "no species \"C\"; the model has A, B"),
        (fix, "fix w all dpd/wall zlo density 3", "the model has several species"),
        (fix, "fix w all dpd/wall zlo density 3 type 1 drag 1 viscosity 1", "give one of them"),
        (
            fix,
            "fix w all dpd/wall zlo density 3 type 1 fluid/density 3",
            "fluid/density belongs to viscosity",
        ),
        (fix, "fix w all dpd/wall zlo density 3 type 1 local/density 1 2 3", "local/density has 3 numbers"),
        (fix, "fix w all dpd/wall xlo density 3 type 1", "the box is periodic across face xlo"),
        ("boundary p p f", "boundary p p s", "face zlo follows the atoms"),
        (fix, &format!("{fix}\nfix v all dpd/wall zhi zlo density 3 type 1"), "face zlo has a wall of fix"),
        ("run 2", "run_style respa 2 1 pair 2\nrun 2", "works with 'run_style verlet' only"),
        ("fix 1 all nve", "fix 1 all nve\nfix d all deform 1 z scale 1.1", "face zlo moves"),
        (
            "run 2",
            "unfix w\nrun 2\nfix w all dpd/wall zlo density 3 type 1\nrun 2 pre no",
            "was made or removed after the last setup",
        ),
        ("run 2", &format!("{}run 2", listed()), "pairs come from a neighbor list"),
    ] {
        let script = base.replace(from, to);
        assert!(script != base, "{from}");
        let error = outcome(&script, 1).expect_err(to);
        assert!(error.contains(message), "{to}: {error}");
    }
    let zero = base
        .replace(style, "pair_style zero 1.0\npair_coeff * *\n#")
        .replace(&format!("pair_coeff * * {wide} A B\n"), "");
    assert!(outcome(&zero, 1).unwrap_err().contains("needs pair_style dpd/psi, mdpd/psi or dpd/spline"));
    let two = "pair_style hybrid/overlay dpd/psi 1.0 5 dpd/spline 1.0 1.0 5\npair_coeff * * dpd/spline 18.75 2 1 0.8 1 4.5\n";
    let two = base
        .replace("pair_style dpd/psi 1.0 5\n", two)
        .replace(&format!("* * {wide}"), &format!("* * dpd/psi {wide}"))
        .replace("zlo density 3 species A", "zlo density 3 type 1");
    let error = outcome(&two, 1).unwrap_err();
    assert!(error.contains("the hybrid contains several"), "{error}");
    let scaled = base
        .replace("pair_style dpd/psi 1.0 5", "pair_style hybrid/scaled 0.5 dpd/psi 1.0 5")
        .replace(&format!("* * {wide}"), &format!("* * dpd/psi {wide}"));
    let error = outcome(&scaled, 1).unwrap_err();
    assert!(error.contains("hybrid/scaled scales the forces of walls too"), "{error}");
    // Rigid bodies of atoms that drag and noise of the wall leave alone are allowed.
    let rigid = base.replace(
        "fix 1 all nve",
        "group body id 1:4\ngroup free subtract all body\nfix b body rigid/nve single\nfix 1 free nve",
    );
    let error = outcome(&rigid, 1).unwrap_err();
    assert!(error.contains("fix b (rigid/nve) keeps atoms of the group together"), "{error}");
    let (fixes, wall) = (rigid.find("group body").unwrap(), rigid.find("fix w all").unwrap());
    let groups = "group body id 1:4\ngroup free subtract all body\n";
    let rigid = format!(
        "{}{groups}{}",
        &rigid[..wall],
        rigid[wall..].replace(groups, "").replace("fix w all", "fix w free")
    );
    assert!(fixes > wall);
    outcome(&rigid, 1).unwrap_or_else(|e| panic!("{e}\n{rigid}"));
    // A hard core has no integral, and forces without a potential have no energy.
    let hard = "title = \"m\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\n\
        phi = \"1/r^12 - 1\"\nrange = 1.0\n";
    let (_folder, hard) = file(hard);
    let error = outcome(&base.replace(&format!("{wide} A B"), &format!("{hard} A A")), 1).unwrap_err();
    assert!(error.contains("fix dpd/wall: the potential between A and A has no finite integral"), "{error}");
    let lucy = base.replace("pair_style dpd/psi 1.0 5", "pair_style mdpd/psi 1.0 1.0 5 law lucy");
    let lucy =
        lucy.replace(&format!("* * {wide} A B"), "* * -40 25 4.5 1 0.75").replace("species A", "type 1");
    for ranks in [1, 2] {
        let error = last_words(ranks, || outcome(&lucy, ranks));
        assert!(error.contains("fix dpd/wall: the model states forces that have no potential"), "{error}");
    }
    let flat = particles("dimension 2\nboundary p p p", "block 0 9 0 9 -0.1 0.1", 1, 10);
    let error = outcome(&format!("{flat}fix w all dpd/wall zlo density 3\n"), 1).unwrap_err();
    assert!(error.contains("a box of two dimensions has no face zlo"), "{error}");
    let tilted = particles("boundary p f p", "prism 0 5 0 5 0 5 0 1 0", 1, 10);
    let error = outcome(&format!("{tilted}fix w all dpd/wall ylo density 3\n"), 1).unwrap_err();
    assert!(error.contains("in a tilted box only zlo and zhi can be walls"), "{error}");
    // Without anything that keeps atoms in the box there is a warning.
    let said = outcome(&base.replace("fix r all wall/reflect zlo EDGE zhi EDGE\n", ""), 1).unwrap();
    assert!(
        said.contains("nothing keeps atoms from going through the face")
            && said.contains("wall/reflect zlo EDGE"),
        "{said}"
    );
}

/// A minimisation follows the energy with that of the wall, without drag and noise, where fix_modify adds it.
#[test]
fn a_minimisation_has_walls_without_drag() {
    let (_folder, wide) = file(WIDE);
    let l = open(&format!(
        "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B\n{COMMANDS}fix_modify lo energy yes\nfix_modify hi energy yes\n\
         fix r all wall/reflect zlo EDGE zhi EDGE\nthermo_modify norm no\nmin_style cg\nminimize 0 0 3 20\n",
        particles("boundary p p f", "block 0 5 0 5 0 5", 2, 300)
    ));
    let model = Model::parse("wide", WIDE).unwrap().with_walls(walls());
    let truth = truth(&l, &model, 1.0, None);
    assert!(difference(&frame(&l).f, &truth.forces) < 1e-9);
    assert!((l.thermo("pe").unwrap() / truth.energy - 1.0).abs() < 1e-9);
}

/// Left out, keys have the default values of the page; type and species name the same matter; a wall that goes is gone.
#[test]
fn defaults_are_those_of_the_page() {
    let page =
        std::fs::read_to_string(psidpd_tests::root().join("lammps-plugin/doc/fix_dpd_wall.md")).unwrap();
    assert!(page.contains("strength 1, velocity 0 0 0, drag and drag/range those of the pair style, fluid/density that of the wall"));
    let start = particles("boundary p p f", "block 0 5 0 5 0 5", 1, 400);
    let end = |fix: &str| {
        run(
            &format!(
                "{start}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n{fix}\nfix r all wall/reflect zlo EDGE zhi EDGE\n\
                 fix 1 all nve\ntimestep 0.01\nrun 5\n",
                warren()
            ),
            1,
        )
        .v
    };
    let plain = end("fix w all dpd/wall zlo density 5");
    for same in [
        "fix w all dpd/wall zlo density 5 type 1 strength 1 velocity 0 0 0",
        "fix w all dpd/wall zlo density 5 species F drag 18 drag/range 1",
    ] {
        assert!(plain == end(same), "{same}");
    }
    assert!(
        end("fix w all dpd/wall zlo density 5 viscosity 7 fluid/density 5")
            == end("fix w all dpd/wall zlo density 5 viscosity 7")
    );
    let none = end("");
    assert!(end("fix w all dpd/wall zlo density 5\nrun 0\nunfix w") == none);
    for other in [
        "density 5.1",
        "density 5 strength 0.9",
        "density 5 velocity 0.1 0 0",
        "density 5 drag 17",
        "density 5 local/density 2",
    ] {
        let apart = difference(&end(&format!("fix w all dpd/wall zlo {other}")), &plain);
        assert!(apart > 1e-9, "{other}");
    }
}
