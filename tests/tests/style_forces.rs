//! Forces of the pair styles inside LAMMPS equal the reference evaluation of the model: every box, every
//! boundary, hybrids, and pairs from LAMMPS's list.

mod style_common;

use psidpd_core::maximum::largest;
use psidpd_core::model::{Model, SplinePair, spline_dpd};
use psidpd_tests::lammps;
use style_common::*;

const CLOSE: f64 = 1e-10;

/// Compares forces, energy and virial before the first step; returns the reference values.
fn compare(script: &str, model: &Model) {
    let l = open(&format!(
        "{script}\ncompute w all pressure NULL virial\nthermo_style custom step pe c_w[1]\nthermo_modify norm no lost ignore\n\
         fix 1 all nve\ntimestep {DT}\nrun 0\n"
    ));
    let truth = truth(&l, model, 1.0, Some(0));
    let apart = difference(&frame(&l).f, &truth.forces);
    assert!(apart < CLOSE, "forces differ by {apart}\n{script}");
    let energy = l.thermo("pe").unwrap();
    assert!((energy / truth.energy - 1.0).abs() < CLOSE, "{energy} {}\n{script}", truth.energy);
    let virial = l.compute_vector("w").unwrap();
    let volume = l.eval("vol").unwrap();
    let scale = largest(truth.virial);
    for (c, w) in truth.virial.iter().enumerate() {
        if model.dimensions() == 3 || [0, 1, 3].contains(&c) {
            // In two dimensions LAMMPS omits the zz, xz and yz components.
            let found = virial[c] * volume;
            assert!((found - w).abs() < 1e-9 * scale, "virial {c}: {found} {w}\n{script}");
        }
    }
}

#[test]
fn spline_style_is_the_potential_of_its_coefficients() {
    let pair = |a: f64, gamma: f64| SplinePair {
        strength: a,
        repulsion: 2.0,
        attraction: 1.0,
        repulsion_range: 0.8,
        attraction_range: 1.0,
        gamma,
    };
    let table = [Some(pair(18.75, 4.5)), Some(pair(10.0, 2.0)), None, Some(pair(25.0, 9.0))];
    let model = spline_dpd(&["T1".into(), "T2".into()], &table, 1.2, 3).unwrap();
    compare(
        &format!(
            "{}pair_style dpd/spline 1.0 1.2 {SEED}\npair_coeff 1 1 18.75 2 1 0.8 1.0 4.5\n\
             pair_coeff 1 2 10 2 1 0.8 1.0 2.0\npair_coeff 2 2 25 2 1 0.8 1.0 9.0",
            particles("", "block 0 5 0 5 0 5", 2, 500)
        ),
        &model,
    );
}

#[test]
fn spline_style_names_mistakes() {
    let l = open(&particles("", "block 0 5 0 5 0 5", 1, 10));
    let refused = |commands: &str, message: &str| {
        let error = l.commands(commands).unwrap_err().to_string();
        assert!(error.contains(message), "{commands}: {error}");
    };
    refused("pair_style dpd/spline 1.0 1.0", "expected 'pair_style dpd/spline T cutoff seed'");
    refused("pair_style dpd/spline 1.0 -1 5", "the cut-off must be positive");
    l.command("pair_style dpd/spline 1.0 1.0 5").unwrap();
    refused("pair_coeff 1 1 1 2 3", "expected 'pair_coeff I J a A B rc1 rc2 gamma', found 5 arguments");
    refused("pair_coeff 1 1 1 2 1 0.8 1.1 4.5", "must not exceed the cut-off");
    refused("pair_coeff 1 1 1 2 1 0.8 1.0 -4.5\nrun 0", "must not be negative");
    refused("pair_coeff 1 1 1 2 1 0.8 0.0 4.5\nrun 0", "range_B");
}

/// Boxes, boundaries and newton settings on one rank.
#[test]
fn forces_are_the_models_in_every_box() {
    let model = Model::open(warren().as_ref()).unwrap();
    let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F", warren());
    for (before, region) in [
        ("", "block 0 5 0 5 0 5"),
        ("newton off", "block 0 5 0 4 0 3"),
        ("", "prism 0 5 0 5 0 5 1.5 -1 2"),
        ("newton off", "prism -1 4 0 5 0 5 -2 1 0.5"),
        ("boundary p p f", "block 0 5 0 5 0 5"),
        ("boundary s m f", "block -1 4 0 5 0 5"),
        ("boundary f p p\nnewton off", "block 0 5 0 5 0 5"),
        ("atom_modify sort 1 0.5", "block 0 5 0 5 0 5"),
    ] {
        compare(&format!("{}{style}", particles(before, region, 1, 500)), &model);
    }
}

#[test]
fn forces_are_the_models_in_two_dimensions() {
    let (_folder, path) = file(FLAT);
    let model = Model::parse("flat", FLAT).unwrap();
    for (before, region) in [
        ("dimension 2", "block 0 9 0 9 -0.1 0.1"),
        ("dimension 2\nnewton off", "block 0 9 0 9 -0.1 0.1"),
        ("dimension 2", "prism 0 9 0 9 -0.1 0.1 3 0 0"),
        ("dimension 2\nboundary s p p", "block 0 9 0 9 -0.1 0.1"),
    ] {
        let script = format!(
            "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} F\nfix flat all enforce2d",
            particles(before, region, 1, 300)
        );
        compare(&script, &model);
    }
}

#[test]
fn wide_models_too() {
    let (_folder, path) = file(WIDE);
    let model = Model::parse("wide", WIDE).unwrap();
    let style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A B");
    compare(&format!("{}{style}", particles("", "block 0 5 0 5 0 5", 2, 500)), &model);
    // A hybrid forwards slopes in portions.
    let style = format!("pair_style hybrid dpd/psi 1.0 {SEED}\npair_coeff * * dpd/psi {path} A B");
    compare(&format!("{}{style}", particles("", "block 0 5 0 5 0 5", 2, 500)), &model);
    // Excluding types without atoms changes only the source of the pairs.
    let style = format!(
        "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} A B\ngroup none empty\n\
         neigh_modify exclude group none none"
    );
    for before in ["", "newton off"] {
        compare(&format!("{}{style}", particles(before, "block 0 5 0 5 0 5", 2, 500)), &model);
        compare(&format!("{}{style}", particles(before, "prism 0 5 0 5 0 5 1 1 1", 2, 500)), &model);
    }
}

/// Trajectories agree on one, two and four ranks, with sorting, in a tilted box, newton on and off.
#[test]
fn ranks_do_not_matter() {
    let (_folder, wide) = file(WIDE);
    for (before, region, style) in [
        ("", "block 0 6 0 6 0 6", format!("dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F F", warren())),
        ("newton off", "prism 0 6 0 6 0 6 1 2 -1", format!("dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B")),
        (
            "atom_modify sort 3 0.7\nboundary p f p\ncomm_style tiled",
            "block 0 6 0 6 0 6",
            format!("hybrid dpd/psi 1.0 {SEED}\npair_coeff * * dpd/psi {wide} A B"),
        ),
        (
            "",
            "block 0 6 0 6 0 6",
            format!(
                "dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B\ngroup g id 1:100\n\
                 neigh_modify exclude group g g"
            ),
        ),
    ] {
        // The IDs of atoms depend on the ranks that create them.
        let folder = tempfile::tempdir().unwrap();
        let start = folder.path().join("start.data").display().to_string();
        open(&format!(
            "{}pair_style zero 1.0\npair_coeff * *\nwrite_data {start} nocoeff\n",
            particles("", region, 2, 700)
        ));
        let script = format!(
            "units lj\natom_style atomic\natom_modify map yes\n{before}\ncomm_modify vel yes\nread_data {start}\n{}\
             pair_style {style}\nfix 1 all nve\nfix wall all wall/reflect ylo EDGE yhi EDGE\n\
             timestep {DT}\nrun 10\n",
            load()
        );
        let script = if before.contains("p f p") {
            script
        } else {
            script.replace("fix wall all wall/reflect ylo EDGE yhi EDGE\n", "")
        };
        let one = run(&script, 1);
        for ranks in [2, 4] {
            let other = run(&script, ranks);
            let apart =
                [difference(&other.x, &one.x), difference(&other.v, &one.v), difference(&other.f, &one.f)];
            assert!(apart.iter().all(|d| *d < 1e-9), "{ranks} ranks: {apart:?}\n{script}");
        }
    }
}

/// Energies, stresses, densities and ψ of single atoms agree on one and two ranks and add up to the totals;
/// forces in mixed precision with two threads per rank equal those in double precision to rounding.
#[test]
fn single_atoms_and_mixed_precision_on_two_ranks() {
    let (_folder, wide) = file(WIDE);
    let folder = tempfile::tempdir().unwrap();
    let start = folder.path().join("start.data").display().to_string();
    open(&format!(
        "{}pair_style zero 1.0\npair_coeff * *\nwrite_data \"{start}\" nocoeff\n",
        particles("", "block 0 6 0 6 0 6", 2, 700)
    ));
    let script = |keywords: &str, more: &str| {
        format!(
            "units lj\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\nread_data \"{start}\"\n{}\
             pair_style dpd/psi 1.0 {SEED} {keywords}\npair_coeff * * \"{wide}\" A B\n{more}fix 1 all nve\n\
             thermo_modify norm no\ntimestep {DT}\nrun 2\n",
            load()
        )
    };
    let exact = run(&script("precision double", ""), 1);
    for ranks in [1, 2] {
        let mixed = run(&script("precision mixed threads 2", ""), ranks);
        let apart = difference(&mixed.f, &exact.f);
        assert!(apart > 1e-13 && apart < 1e-4, "{ranks} ranks: {apart}");
    }
    let values = |ranks: usize| -> (Vec<f64>, Vec<f64>) {
        let more = "fix n all pair 1 dpd/psi density 0\nfix u all pair 1 dpd/psi psi 0\n\
            compute e all pe/atom\ncompute s all stress/atom NULL virial\ncompute w all pressure NULL virial\n\
            compute all all reduce sum c_e c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]\n\
            thermo_style custom step pe c_all[1] c_w[1] c_w[2] c_w[3] c_w[4] c_w[5] c_w[6]\n";
        let last = "print \"$(pe:%.17g) $(c_w[1]*vol:%.17g) $(c_w[2]*vol:%.17g) $(c_w[3]*vol:%.17g) \
            $(c_w[4]*vol:%.17g) $(c_w[5]*vol:%.17g) $(c_w[6]*vol:%.17g) \" file totals.txt screen no\n\
            write_dump all custom atoms.dump id f_n[1] f_n[2] f_n[3] f_n[4] f_u c_e c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] \
            c_s[6] modify sort id format float %.17g\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("in.lammps");
        let text = script("precision mixed threads 2", more);
        std::fs::write(&path, format!("{text}{last}")).unwrap();
        lammps().0.run_script(ranks, folder.path(), &path, &[], LIMIT).unwrap();
        let numbers = |name: &str, skip: usize| -> Vec<f64> {
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            let lines = text.lines().skip(skip);
            lines.flat_map(|l| l.split_whitespace().map(|w| w.parse().unwrap())).collect()
        };
        (numbers("totals.txt", 0), numbers("atoms.dump", 9))
    };
    let (totals, one) = values(1);
    let (others, two) = values(2);
    assert_eq!((totals.len(), one.len(), two.len()), (7, 700 * 13, 700 * 13));
    let near = |a: f64, b: f64, scale: f64| (a - b).abs() < 1e-4 * scale;
    for (totals, atoms) in [(&totals, &one), (&others, &two)] {
        for (k, total) in totals.iter().enumerate() {
            let sum: f64 = atoms.chunks(13).map(|row| row[6 + k]).sum();
            let sign = if k == 0 { 1.0 } else { -1.0 };
            assert!((sign * sum - total).abs() < 1e-9 * totals[0].abs(), "{k}: {sum} {total}");
        }
    }
    for column in 0..13 {
        let of = |rows: &[f64]| -> Vec<f64> { rows.chunks(13).map(|row| row[column]).collect() };
        let (a, b) = (of(&one), of(&two));
        let scale = (a.iter().map(|x| x * x).sum::<f64>() / 700.0).sqrt();
        assert!(scale > 0.0, "{column}");
        // Drag and noise of mixed precision have acted on the atoms for two steps.
        assert!(a.iter().zip(&b).all(|(a, b)| near(*a, *b, scale)), "{column}");
    }
}

/// Forces of a hybrid with lj/cut and bonds are the sum of the forces of its parts.
#[test]
fn overlays_add_up() {
    let (_folder, data) = file(&chains(100));
    let head = |style: &str| {
        format!(
            "units lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\nspecial_bonds lj 1 1 1\n\
             read_data {data}\nmass * 1\nvelocity all create 1.0 87 loop geom\n{}{style}\nfix 1 all nve\n\
             timestep {DT}\nrun 0\n",
            load()
        )
    };
    let none = "bond_style zero\nbond_coeff *";
    let bonds = "bond_style harmonic\nbond_coeff 1 20 0.5";
    let psi = format!("dpd/psi 1.0 {SEED}");
    let lj = "pair_coeff * * lj/cut 0.1 0.3";
    let model = format!("pair_coeff * * dpd/psi \"{}\" F F", warren());
    let all =
        frame(&open(&head(&format!("pair_style hybrid/overlay lj/cut 1.0 {psi}\n{lj}\n{model}\n{bonds}"))));
    let parts = [
        format!("pair_style {psi}\npair_coeff * * \"{}\" F F\n{none}", warren()),
        format!("pair_style lj/cut 1.0\npair_coeff * * 0.1 0.3\n{none}"),
        format!("pair_style zero 1.0\npair_coeff * *\n{bonds}"),
    ];
    let mut sum = vec![[0.0; 3]; all.f.len()];
    for part in &parts {
        for (sum, f) in sum.iter_mut().zip(frame(&open(&head(part))).f) {
            (0..3).for_each(|k| sum[k] += f[k]);
        }
    }
    let apart = difference(&all.f, &sum);
    assert!(apart < CLOSE, "{apart}");
}

/// In a hybrid, types of another style contribute neither to forces nor to densities.
#[test]
fn other_styles_types_take_no_part() {
    let head = particles("", "block 0 5 0 5 0 5", 2, 500);
    let lj = "pair_coeff * 2 lj/cut 0.0 0.3";
    let psi = frame(&open(&format!(
        "{head}pair_style hybrid dpd/psi 1.0 {SEED} lj/cut 1.0\npair_coeff * * dpd/psi \"{}\" F NULL\n{lj}\nrun 0\n",
        warren()
    )));
    let mdpd = frame(&open(&format!(
        "{head}pair_style hybrid mdpd/psi 1.0 1.0 {SEED} lj/cut 1.0\npair_coeff 1 1 mdpd/psi -40 25 18 1 0.75\n\
         {lj}\nrun 0\n"
    )));
    assert!(difference(&mdpd.f, &psi.f) < CLOSE);
    let alone = open(&format!(
        "{head}group other type 2\ndelete_atoms group other\nreset_atoms id\npair_style dpd/psi 1.0 {SEED}\n\
         pair_coeff * * \"{}\" F F\nrun 0\n",
        warren()
    ));
    let conservative = |f: &Frame| f.f.iter().filter(|f| f.iter().any(|c| *c != 0.0)).count();
    assert_eq!(conservative(&psi), alone.natoms().unwrap());
    assert!(psi.f.iter().zip(&psi.kind).all(|(f, k)| *k == 1 || *f == [0.0; 3]));
}

/// Pairs of types that a hybrid gives to another style alone are left out of forces and densities, with `newton` on and
/// off, on one rank and on several.
#[test]
fn pairs_of_another_style_are_left_out() {
    let psi = |types: &str, name: &str| match name {
        "mdpd/psi 1.0 1.0" => format!("pair_coeff {types} mdpd/psi -40 25 0 1 0.75\n"),
        _ => String::new(),
    };
    let text = std::fs::read_to_string(warren()).unwrap();
    let (_folder, quiet) = file(text.split("[[thermostat]]").next().unwrap());
    for name in ["mdpd/psi 1.0 1.0", "dpd/psi 1.0"] {
        let model = match name {
            "dpd/psi 1.0" => format!("pair_coeff * * dpd/psi \"{quiet}\" F F\n"),
            _ => String::new(),
        };
        for (like, unlike) in [(true, false), (false, true)] {
            let of = |lj: &str| {
                let same = ["1 1", "2 2"].map(|types| match like {
                    true => psi(types, name),
                    false => format!("pair_coeff {types} lj/cut {lj}\n"),
                });
                let other = match unlike {
                    true => psi("1 2", name),
                    false => format!("pair_coeff 1 2 lj/cut {lj}\n"),
                };
                format!("pair_style hybrid {name} {SEED} lj/cut 1.0\n{model}{}{other}", same.concat())
            };
            for (newton, ranks) in [("on", 1), ("off", 2)] {
                let head = particles(&format!("newton {newton}"), "block 0 5 0 5 0 5", 2, 500);
                let ours = run(&format!("{head}{}fix 1 all nve\nrun 0\n", of("0.0 0.3")), ranks);
                let (_, f) =
                    scaled(&ours.x, 5.0, |i, j| f64::from(u8::from((ours.kind[i] == ours.kind[j]) == like)));
                let apart = difference(&ours.f, &f);
                assert!(apart < CLOSE, "{name}, {like}, newton {newton}, {ranks} ranks: {apart:e}");
            }
        }
    }
    // Alone, the style wants coefficients of all pairs.
    let script = format!(
        "{}pair_style mdpd/psi 1.0 1.0 5\npair_coeff 1 1 -40 25 0 1 0.75\npair_coeff 2 2 -40 25 0 1 0.75\nrun 0\n",
        particles("", "block 0 5 0 5 0 5", 2, 50)
    );
    let (folder, path) = file(&script);
    let error = psidpd_tests::lammps().0.run_script(1, folder.path(), path.as_ref(), &[], LIMIT).unwrap_err();
    assert!(error.to_string().contains("no coefficients for types 1 and 2"), "{error}");
}

/// Bonded neighbours with factors of a half and zero, and excluded types; the engine's pairs then come from LAMMPS's list.
#[test]
fn special_bonds_and_exclusions() {
    let (_folder, data) = file(&chains(120));
    let deck = |newton: &str, special: &str, more: &str| {
        format!(
            "newton {newton}\nunits lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\n\
             special_bonds lj {special}\nread_data {data}\nmass * 1\n{}pair_style mdpd/psi 1.0 1.0 {SEED}\n\
             pair_coeff * * -40 25 0 1 0.75\nbond_style zero\nbond_coeff *\n{more}\n\
             fix 1 all nve\ntimestep {DT}\nthermo_modify norm no\nrun 0\n",
            load()
        )
    };
    let chain = |i: usize, j: usize| (i / 5 == j / 5).then(|| i.abs_diff(j));
    for newton in ["on", "off"] {
        let l = open(&deck(newton, "0.5 0.0 0.8", ""));
        let (energy, f) = scaled(&frame(&l).x, 5.0, |i, j| match chain(i, j) {
            Some(1) => 0.5,
            Some(2) => 0.0,
            Some(3) => 0.8,
            _ => 1.0,
        });
        let apart = difference(&frame(&l).f, &f);
        assert!(apart < CLOSE, "newton {newton}: {apart}");
        let found = l.thermo("pe").unwrap();
        assert!((found / energy - 1.0).abs() < CLOSE, "{found} {energy}");

        let kind = frame(&l).kind;
        drop(l);
        let l = open(&deck(newton, "1 1 1", "neigh_modify exclude type 1 2"));
        let (_, f) = scaled(&frame(&l).x, 5.0, |i, j| if kind[i] == kind[j] { 1.0 } else { 0.0 });
        let apart = difference(&frame(&l).f, &f);
        assert!(apart < CLOSE, "newton {newton}, exclusions: {apart}");
    }
    let two = deck("on", "0.5 0.0 0.8", "").replace("-40 25 0 1", "-40 25 18 1").replace("run 0", "run 10");
    let one = run(&two, 1);
    for ranks in [2, 4] {
        let other = run(&two, ranks);
        assert!(difference(&other.f, &one.f) < 1e-9, "{ranks} ranks");
    }
}

/// Pairs that the fast sweep corrects equal those of LAMMPS's list with their factors, including drag, noise
/// and pressure, for two species with two densities, and on every number of ranks.
#[test]
fn special_bonds_are_the_same_by_the_sweep_and_by_the_list() {
    let (_folder, data) = file(&chains(120));
    let (_model, model) = file(WIDE);
    let outcome = |listed: bool, precision: &str, newton: &str, special: &str, more: &str, ranks: usize| {
        let list = if listed { self::listed() } else { String::new() };
        let script = format!(
            "newton {newton}\nunits lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\n\
             special_bonds lj {special}\nread_data \"{data}\"\nmass * 1\nvelocity all create 1.0 87 loop geom\n{}\
             pair_style dpd/psi 1.0 {SEED} precision {precision}\npair_coeff * * \"{model}\" A B\nbond_style zero\n\
             bond_coeff *\n{list}{more}fix 1 all nve\ntimestep {DT}\nthermo_modify norm no\n\
             thermo_style custom step pe pxx pyy pzz pxy pxz pyz\nrun 3\n\
             print \"$(pe:%.17g) $(pxx:%.17g) $(pyy:%.17g) $(pzz:%.17g) $(pxy:%.17g) $(pxz:%.17g) $(pyz:%.17g)\" \
             file totals\n",
            load()
        );
        let folder = tempfile::tempdir().unwrap();
        let frame = run_in(folder.path(), &script, ranks);
        let log = std::fs::read_to_string(folder.path().join("log.lammps")).unwrap();
        assert_eq!(log.contains("because of more exclusions"), listed, "{log}");
        assert_eq!(log.contains("  special bonds factors"), !listed, "{log}");
        let totals = std::fs::read_to_string(folder.path().join("totals")).unwrap();
        let totals: Vec<f64> = totals.split_whitespace().map(|t| t.parse().unwrap()).collect();
        (frame, totals)
    };
    let strained = "fix d all deform 1 xy erate 0.3 remap x\n";
    for (special, more) in [("0 0 0", ""), ("0.5 0 0.8", ""), ("0 0.3 0.7", strained)] {
        let more = if more.is_empty() { more.into() } else { format!("change_box all triclinic\n{more}") };
        let expected = outcome(true, "double", "on", special, &more, 1);
        let scale = largest(&expected.1);
        let worst = |(frame, totals): (Frame, Vec<f64>)| {
            let totals = largest(totals.iter().zip(&expected.1).map(|(a, b)| (a - b).abs() / scale));
            [difference(&frame.f, &expected.0.f), totals]
        };
        let plain = worst(outcome(false, "double", "on", "0.9 1 1", &more, 1));
        assert!(plain[0] > 0.01, "factors matter: {plain:?}");
        for (newton, ranks) in [("on", 1), ("on", 2), ("off", 2), ("on", 4), ("off", 4)] {
            let off = worst(outcome(false, "double", newton, special, &more, ranks));
            assert!(off[0] < 1e-11 && off[1] < 1e-12, "{special}, newton {newton}, {ranks} ranks: {off:?}");
        }
        let off = worst(outcome(false, "mixed", "on", special, &more, 2));
        assert!(off[0] < 2e-5 && off[1] < 2e-5, "{special}, mixed: {off:?}");
    }
}

/// Boxes so narrow that a pair has two images use the list.
#[test]
fn special_bonds_that_need_the_list() {
    let (_folder, data) = file(&chains(120));
    let folder = tempfile::tempdir().unwrap();
    let script = format!(
        "units lj\natom_style bond\ncomm_modify vel yes cutoff 3\nspecial_bonds lj 0 1 1\nread_data \"{data}\"\n\
         mass * 1\n{}pair_style mdpd/psi 1.0 3.0 {SEED}\npair_coeff * * -4 2 0 3 0.75\nbond_style zero\nbond_coeff *\n\
         fix 1 all nve\nrun 0\n",
        load()
    );
    run_in(folder.path(), &script, 1);
    let log = std::fs::read_to_string(folder.path().join("log.lammps")).unwrap();
    let why = "neighbor list of LAMMPS, because of special_bonds in a box narrower than twice the cut-off";
    assert!(log.contains(why), "{log}");
}

/// The fast sweep excludes types, groups and molecules exactly as LAMMPS's list does: drag, noise, pressure
/// and energies of atoms agree on every number of ranks, together with special factors, which survive a
/// change of temperature.
#[test]
fn exclusions_are_the_same_by_the_sweep_and_by_the_list() {
    let (_folder, data) = file(&chains(120));
    let (_model, model) = file(WIDE);
    let outcome = |listed: bool, newton: &str, rules: &str, ranks: usize| {
        let list = if listed { self::listed() } else { String::new() };
        let script = format!(
            "newton {newton}\nunits lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\n\
             special_bonds lj 0.3 0 1\nread_data \"{data}\"\nmass * 1\nvelocity all create 1.0 87 loop geom\n{}\
             pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{model}\" A B\nbond_style zero\nbond_coeff *\n\
             group one id 1:150\ngroup two id 100:400\nneigh_modify {rules}\n{list}fix 1 all nve\ntimestep {DT}\n\
             variable t equal ramp(1,1.2)\nfix 2 all adapt 1 pair dpd/psi T * * v_t\n\
             compute e all pe/atom pair\ncompute sum all reduce sum c_e\nthermo_modify norm no\n\
             thermo_style custom step pe pxx pyy pxy c_sum\nrun 3\n\
             print \"$(pe:%.17g) $(pxx:%.17g) $(pyy:%.17g) $(pxy:%.17g) $(c_sum:%.17g)\" file totals\n",
            load()
        );
        let folder = tempfile::tempdir().unwrap();
        let frame = run_in(folder.path(), &script, ranks);
        let log = std::fs::read_to_string(folder.path().join("log.lammps")).unwrap();
        assert_eq!(
            log.contains("exclusions    pairs that neigh_modify excludes are left out"),
            !listed,
            "{log}"
        );
        let totals = std::fs::read_to_string(folder.path().join("totals")).unwrap();
        let totals: Vec<f64> = totals.split_whitespace().map(|t| t.parse().unwrap()).collect();
        (frame, totals)
    };
    let plain = outcome(true, "on", "every 1", 1).0;
    for rules in [
        "exclude type 1 2",
        "exclude type 1 1 exclude group one two",
        "exclude molecule/intra one",
        "exclude molecule/inter two exclude group one one",
    ] {
        let expected = outcome(true, "on", rules, 1);
        assert!(difference(&plain.f, &expected.0.f) > 0.01, "{rules} matters");
        for (newton, ranks) in [("on", 1), ("off", 2), ("on", 4)] {
            let (frame, totals) = outcome(false, newton, rules, ranks);
            let off = difference(&frame.f, &expected.0.f);
            assert!(off < 1e-10, "{rules}, newton {newton}, {ranks} ranks: {off}");
            for (a, b) in totals.iter().zip(&expected.1) {
                assert!(
                    (a - b).abs() < 1e-10 * largest(expected.1.iter().copied()),
                    "{rules}, {ranks} ranks: {a} {b}"
                );
            }
        }
    }
}

/// The special factors that a hybrid gives to one of its styles apply to that style.
#[test]
fn a_hybrids_special_factors() {
    let (_folder, data) = file(&chains(120));
    let deck = |special: &str, style: &str| {
        format!(
            "units lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\nspecial_bonds lj {special}\n\
             read_data {data}\nmass * 1\n{}{style}\nbond_style zero\nbond_coeff *\nfix 1 all nve\nrun 0\n",
            load()
        )
    };
    let alone = frame(&open(&deck(
        "0.5 0.2 1",
        &format!("pair_style mdpd/psi 1.0 1.0 {SEED}\npair_coeff * * -40 25 18 1 0.75"),
    )));
    let coefficients = "pair_coeff * * mdpd/psi -40 25 18 1 0.75\npair_coeff * * zero";
    for (special, more) in
        [("0.5 0.2 1", ""), ("0.9 0.9 0.9", "\npair_modify pair mdpd/psi special lj 0.5 0.2 1")]
    {
        let hybrid = open(&deck(
            special,
            &format!("pair_style hybrid/overlay mdpd/psi 1.0 1.0 {SEED} zero 1.0\n{coefficients}{more}"),
        ));
        let apart = difference(&frame(&hybrid).f, &alone.f);
        assert!(apart < CLOSE, "{special}: {apart}");
    }
    // LAMMPS refuses exclusions that its list cannot represent.
    let script = deck(
        "1 1 1",
        &format!(
            "pair_style hybrid/overlay mdpd/psi 1.0 1.0 {SEED} zero 1.0\n{coefficients}\n\
             pair_modify pair mdpd/psi special lj 0.5 0.2 1"
        ),
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    std::fs::write(&path, script).unwrap();
    let host = &psidpd_tests::lammps().0;
    assert!(host.run_script(1, folder.path(), &path, &[], LIMIT).is_err());
}

/// Forces of a fluid with special factors are the gradient of its energy.
#[test]
fn special_factors_keep_the_potential() {
    let (_folder, data) = file(&chains(60));
    let l = open(&format!(
        "units lj\natom_style bond\natom_modify map yes\nspecial_bonds lj 0.3 0.7 1\nread_data {data}\nmass * 1\n\
         {}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F F\nbond_style zero\nbond_coeff *\nfix 1 all nve\n\
         thermo_modify norm no\ncomm_modify vel yes\nmin_style quickmin\nminimize 0 0 0 0\nrun 0\n",
        load(),
        // The model has no drag, because the test compares forces with the energy.
        quiet().1
    ));
    let start = frame(&l);
    for (i, c) in [(0, 0), (17, 1), (101, 2)] {
        let h = 1e-5;
        let mut energy = [0.0; 2];
        for (side, energy) in energy.iter_mut().enumerate() {
            let mut x: Vec<f64> = start.x.as_flattened().to_vec();
            x[3 * i + c] += if side == 0 { h } else { -h };
            l.scatter("x", 3, &x).unwrap();
            l.command("run 0").unwrap();
            *energy = l.thermo("pe").unwrap();
        }
        let slope = -(energy[0] - energy[1]) / (2.0 * h);
        let f = start.f[i][c];
        assert!((slope - f).abs() < 1e-4 * (1.0 + f.abs()), "{slope} {f}");
    }
}

/// Warren's model without a thermostat, in a file for all tests.
fn quiet() -> &'static (tempfile::TempDir, String) {
    static QUIET: std::sync::OnceLock<(tempfile::TempDir, String)> = std::sync::OnceLock::new();
    QUIET.get_or_init(|| {
        let text = std::fs::read_to_string(warren()).unwrap();
        file(text.split("[[thermostat]]").next().unwrap())
    })
}

/// Special factors and exclusions leave the temperature at that of the thermostat, 1. With 600 particles the
/// temperature fluctuates by √(2/(3·600)) = 0.033 at one time, and by about 0.006 in the mean over 12 time
/// units, about thirty relaxation times of the thermostat. The time step adds 0.01. The limit 0.04 is five
/// times 0.006, and 0.01.
#[test]
fn factors_do_not_shift_the_temperature() {
    let (_folder, data) = file(&chains(120));
    for (special, exclude) in [("0.5 0.2 1", ""), ("0 0 0", "neigh_modify exclude type 1 2")] {
        let l = open(&format!(
            "units lj\natom_style bond\natom_modify map yes\ncomm_modify vel yes\nspecial_bonds lj {special}\n\
             read_data {data}\nmass * 1\nvelocity all create 1.0 87 loop geom\n{}\
             pair_style dpd/spline 1.0 1.0 {SEED}\npair_coeff * * 18.75 1 0 1.0 1.0 9\n\
             bond_style harmonic\nbond_coeff 1 10 0.3\n{exclude}\nfix 1 all nve\ntimestep 0.01\nrun 1200\n\
             fix mean all ave/time 1 1200 1200 c_thermo_temp\nrun 1200\n",
            load()
        ));
        let mean = l.eval("f_mean").unwrap();
        assert!((mean - 1.0).abs() < 0.04, "special {special} {exclude}: {mean}");
    }
}
