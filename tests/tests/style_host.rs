//! Further requests of LAMMPS to a pair style: single pairs, quantities by name, computes, minimisers, boxes
//! that change, and errors.

mod style_common;

use psidpd_core::model::Model;
use style_common::*;

/// Warren's fluid without drag.
fn quiet() -> String {
    let text = std::fs::read_to_string(warren()).unwrap();
    text.split("[[thermostat]]").next().unwrap().to_owned()
}

fn deck(more: &str) -> String {
    format!("{}{more}", particles("", "block 0 5 0 5 0 5", 1, 500))
}

fn psi() -> String {
    format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * \"{}\" F\n", warren())
}

/// The forces of single pairs add up to the forces, and their virials to the virial.
#[test]
fn single_pairs_add_up() {
    let (_wide, wide) = file(WIDE);
    let (_quiet, quiet) = file(&quiet());
    let text = WIDE.split("[[thermostat]]").next().unwrap().to_owned();
    std::fs::write(&wide, text).unwrap();
    for style in [
        format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {quiet} F F\n"),
        format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B\n"),
        format!("pair_style mdpd/psi 1.0 1.0 {SEED}\npair_coeff * * -40 25 0 1 0.75\n"),
        format!("pair_style dpd/spline 1.0 1.0 {SEED}\npair_coeff * * 18.75 2 1 0.8 1 0\n"),
    ] {
        for newton in ["on", "off"] {
            let l = open(
                &format!(
                    "{}{style}group half id 1:200\ngroup rest subtract all half\n\
                 compute between half group/group rest\n\
                 compute dist all pair/local dist eng force fx fy fz\n\
                 compute work all reduce sum c_dist[2] inputs local\n\
                 compute f half reduce sum fx fy fz\n\
                 compute s all stress/atom NULL virial\ncompute c all centroid/stress/atom NULL virial\n\
                 compute ss all reduce sum c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]\n\
                 compute cs all reduce sum c_c[1] c_c[2] c_c[3] c_c[4] c_c[5] c_c[6]\n\
                 compute e all pe/atom\ncompute es all reduce sum c_e\n\
                 compute p all pressure NULL virial\ncompute pair all pair PAIR\ncompute g all rdf 20\n\
                 thermo_style custom step pe c_p[1] c_work c_between c_ss[1] c_cs[1] c_es c_pair c_g[1][1]\n\
                 thermo_modify norm no\nfix 1 all nve\nrun 0\n",
                    particles(&format!("newton {newton}"), "block 0 5 0 5 0 5", 2, 500)
                )
                .replace("PAIR", style.split_whitespace().nth(1).unwrap()),
            );
            let close = |a: f64, b: f64, what: &str| {
                assert!((a - b).abs() < 1e-9 * (1.0 + a.abs().max(b.abs())), "{what}: {a} {b}\n{style}");
            };
            // Forces of one half on the other by pairs equal the sum of the forces on that half.
            let between = l.compute_vector("between").unwrap();
            let sum = l.compute_vector("f").unwrap();
            for k in 0..3 {
                close(between[k], sum[k], "group/group");
            }
            // Compute pair gives psi, then phi; pair/local gives the part of the pairs.
            let parts = l.compute_vector("pair").unwrap();
            let pe = l.thermo("pe").unwrap();
            close(parts[0] + parts[1], pe, "compute pair");
            close(l.compute_scalar("es").unwrap(), pe, "pe/atom");
            let work = l.compute_scalar("work").unwrap();
            if style.contains("spline") {
                close(work, pe, "pair/local");
                close(parts[0], 0.0, "excess");
            } else if !style.contains(&wide) {
                close(work, parts[1], "pair/local");
            }
            let volume = l.eval("vol").unwrap();
            let p = l.compute_vector("p").unwrap();
            for id in ["ss", "cs"] {
                let all = l.compute_vector(id).unwrap();
                for k in 0..6 {
                    close(-all[k], p[k] * volume, id);
                }
            }
        }
    }
}

/// LAMMPS's fix pair gets local densities and psi by name.
#[test]
fn densities_by_name() {
    let (_wide, wide) = file(WIDE);
    let model = Model::parse("wide", WIDE).unwrap();
    let l = open(&format!(
        "{}pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {wide} A B\n\
         fix n all pair 1 dpd/psi density 0\nfix u all pair 1 dpd/psi psi 0\nfix 1 all nve\ntimestep {DT}\n\
         compute u all reduce sum f_u\nthermo_style custom step pe\nthermo 1\nthermo_modify norm no\nrun 3\n",
        particles("", "block 0 5 0 5 0 5", 2, 500)
    ));
    let truth = truth(&l, &model, 1.0, None);
    let found = l.gather("f_n", 4).unwrap();
    for (found, n) in found.iter().zip(&truth.densities) {
        assert!((found - n).abs() < 1e-9 * (1.0 + n.abs()), "{found} {n}");
    }
    assert!(l.eval("c_u").unwrap() > 0.0);
    drop(l);
    // One density of one species is a vector.
    let l = open(&deck(&format!("{}fix n all pair 1 dpd/psi rho 0\nfix 1 all nve\nrun 1\n", psi())));
    let n = l.gather("f_n", 1).unwrap();
    assert!(n.iter().sum::<f64>() / n.len() as f64 > 1.0);
}

/// `fix adapt` changes the temperature and coefficients during a run.
#[test]
fn adapted_styles_are_those_set_directly() {
    let mdpd = |t: &str, a: &str| {
        format!(
            "pair_style mdpd/psi {t} 1.0 {SEED}\npair_coeff * * {a} 25 18 1 0.75\nfix 1 all nve\ntimestep {DT}\n"
        )
    };
    let l = open(&deck(&format!(
        "{}variable t equal 1.0+step/10\nvariable a equal -40+step\n\
         fix adapt all adapt 1 pair mdpd/psi T * * v_t pair mdpd/psi A * * v_a\nrun 10\n",
        mdpd("1.0", "-40")
    )));
    let adapted = frame(&l);
    drop(l);
    let l = open(&deck(&mdpd("2.0", "-30")));
    let x: Vec<f64> = adapted.x.as_flattened().to_vec();
    let v: Vec<f64> = adapted.v.as_flattened().to_vec();
    l.command("run 0").unwrap();
    l.scatter("x", 3, &x).unwrap();
    l.scatter("v", 3, &v).unwrap();
    l.commands("reset_timestep 10\nrun 0").unwrap();
    // The first run has half-step velocities and this one full-step velocities, so the comparison is without drag.
    let conservative = |l: &Only| {
        l.commands("pair_coeff * * -30 25 0 1 0.75\nrun 0").unwrap();
        frame(l).f
    };
    let direct = conservative(&l);
    drop(l);
    let l = open(&deck(&format!(
        "{}variable t equal 1.0+step/10\nvariable a equal -40+step\nrun 0\n",
        mdpd("1.0", "-40").replace(" 25 18 ", " 25 0 ")
    )));
    l.scatter("x", 3, &x).unwrap();
    l.commands(
        "reset_timestep 10\nfix adapt all adapt 1 pair mdpd/psi T * * v_t pair mdpd/psi A * * v_a\nrun 0",
    )
    .unwrap();
    let apart = difference(&frame(&l).f, &direct);
    assert!(apart < 1e-9, "{apart}");
    l.commands("variable bad equal -1\nfix adapt all adapt 1 pair mdpd/psi T * * v_bad").unwrap();
    let error = l.command("run 1").unwrap_err().to_string();
    assert!(error.contains("the temperature must be positive"), "{error}");
}

/// A model file with kT in psi follows the temperature, and so does a second pair_style.
#[test]
fn the_model_sees_the_new_temperature() {
    let text = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                [excess_free_energy]\nF = \"kT*0.1*n^2\"\n";
    let (_folder, path) = file(text);
    let head = format!(
        "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {path} F\nfix 1 all nve\nthermo_modify norm no\n"
    );
    let l = open(&deck(&format!("{head}run 0\n")));
    let (one, f) = (l.thermo("pe").unwrap(), frame(&l).f);
    let twice = |l: &Only| {
        assert!((l.thermo("pe").unwrap() / one - 2.0).abs() < 1e-12);
        let double: Vec<[f64; 3]> = f.iter().map(|f| f.map(|c| 2.0 * c)).collect();
        assert!(difference(&frame(l).f, &double) < 1e-12);
    };
    l.commands("variable t equal 2\nfix a all adapt 1 pair dpd/psi temperature * * v_t\nrun 0").unwrap();
    twice(&l);
    l.commands(&format!("unfix a\npair_style dpd/psi 2.0 {SEED}\nrun 0")).unwrap();
    twice(&l);
}

/// Precision and threads of a second pair_style hold without a second pair_coeff, for all styles, and the log says so.
#[test]
fn settings_given_again_hold() {
    for (style, coefficients) in [
        ("dpd/psi 1.0", format!("* * \"{}\" F", warren())),
        ("mdpd/psi 1.0 1.0", "* * -40 25 18 1 0.75".to_owned()),
        ("dpd/spline 1.0 1.0", "* * 18.75 2 1 0.8 1 4.5".to_owned()),
    ] {
        let script = deck(&format!(
            "pair_style {style} {SEED}\npair_coeff {coefficients}\nfix 1 all nve\nrun 0\n\
             pair_style {style} {SEED} precision mixed threads 2\nrun 0\n"
        ));
        let (folder, path) = file(&script);
        let run = psidpd_tests::lammps().0.run_script(1, folder.path(), path.as_ref(), &[], LIMIT);
        let said = run.unwrap_or_else(|e| panic!("{e}")).stdout;
        let lines: Vec<&str> = said.lines().filter(|l| l.starts_with("  arithmetic")).collect();
        let [first, second] = lines[..] else { panic!("{style}: {said}") };
        assert!(first.contains("double precision") && first.contains("1 thread(s)"), "{style}: {first}");
        let threads = std::thread::available_parallelism().unwrap().get().min(2);
        let threads = format!("{threads} thread(s)");
        assert!(second.contains("mixed precision") && second.contains(&threads), "{style}: {second}");
        // The forces are those of mixed precision: near those of double precision, and not the same.
        let [mixed, double] = [2, 1].map(|runs| {
            let script: String = script.split_inclusive("run 0\n").take(runs).collect();
            frame(&open(&script)).f
        });
        let apart = difference(&mixed, &double);
        assert!((1e-9..1e-4).contains(&apart), "{style}: {apart:e}");
    }
}

/// Commands that use no drag need no velocities of ghosts; a run does.
#[test]
fn only_runs_need_velocities_of_ghosts() {
    let (folder, path) = file("");
    let out = folder.path().join("all.data");
    let start = deck(&format!("{}fix 1 all nve\n", psi())).replace("comm_modify vel yes\n", "");
    let commands = format!(
        "balance 1.0 shift x 5 1.1\nwrite_data {}\ndelete_atoms overlap 0.01 all all\nminimize 0 1e-3 3 10\n",
        out.display()
    );
    for (more, message) in [
        ("", None),
        ("run 0\n", Some("add 'comm_modify vel yes'")),
        ("unfix 1\nfix 1 all dpd/splitting aboba\nrun 1\n", None),
    ] {
        std::fs::write(&path, format!("{start}{commands}{more}")).unwrap();
        let run = psidpd_tests::lammps().0.run_script(1, folder.path(), path.as_ref(), &[], LIMIT);
        match (run, message) {
            (Ok(_), None) => assert!(out.is_file()),
            (Err(error), Some(message)) => assert!(error.to_string().contains(message), "{more}: {error}"),
            (run, _) => panic!("{more}: {:?}", run.map(|run| run.stdout)),
        }
    }
}

/// Minimising lowers the energy, draws no noise, and ends where forces vanish.
#[test]
fn minimisers_go_downhill() {
    let l = open(&deck(&format!(
        "{}fix 1 all nve\nthermo_style custom step pe fnorm\nthermo_modify norm no\nrun 0\n",
        psi()
    )));
    let before = l.thermo("pe").unwrap();
    for style in ["cg", "fire"] {
        l.commands(&format!("min_style {style}\nminimize 0 1e-3 200 1000")).unwrap();
    }
    let after = l.thermo("pe").unwrap();
    assert!(after < before, "{before} {after}");
    // A second minimisation gives the same result, whatever the seed.
    let x = frame(&l).x;
    drop(l);
    let l = open(&deck(&format!(
        "{}fix 1 all nve\nthermo_modify norm no\nrun 0\n",
        psi().replace(" 5\n", " 77\n")
    )));
    for style in ["cg", "fire"] {
        l.commands(&format!("min_style {style}\nminimize 0 1e-3 200 1000")).unwrap();
    }
    assert!(difference(&frame(&l).x, &x) < 1e-9);
}

/// The plugin can be unloaded and loaded again; `clear` and several runs work.
#[test]
fn the_plugin_goes_and_comes() {
    let script = deck(&format!("{}fix 1 all nve\ntimestep {DT}\nrun 5\n", psi()));
    let l = open(&script);
    let first = frame(&l);
    l.commands("plugin unload pair dpd/psi\nplugin unload pair mdpd/psi\nplugin unload pair dpd/spline")
        .unwrap();
    assert!(l.command("run 1").is_err() || !l.has_style("pair", "dpd/psi").unwrap());
    l.commands(&format!("clear\n{script}")).unwrap();
    assert!(difference(&frame(&l).x, &first.x) < 1e-12);
    l.commands(&format!("clear\n{script}run 0\nrun 0 pre no\nrun 5 pre no")).unwrap();
}

/// A rerun of dumped positions gives the energies of the run.
#[test]
fn rerun_gives_the_same_energies() {
    let folder = tempfile::tempdir().unwrap();
    let (_quiet, model) = file(&quiet());
    let dump = folder.path().join("d").display().to_string();
    let head = format!(
        "pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {model} F\nfix 1 all nve\ntimestep 0.002\n\
         thermo_style custom step pe press\nthermo_modify norm no\nthermo 5\n"
    );
    let l = open(&deck(&format!(
        "{head}dump d all custom 5 {dump} id type x y z vx vy vz\ndump_modify d format float %.17g\nrun 10\n"
    )));
    let (pe, press) = (l.thermo("pe").unwrap(), l.thermo("press").unwrap());
    drop(l);
    let l = open(&deck(&format!("{head}rerun {dump} dump x y z vx vy vz\n")));
    assert!((l.thermo("pe").unwrap() / pe - 1.0).abs() < 1e-10);
    assert!((l.thermo("press").unwrap() / press - 1.0).abs() < 1e-10);
}

/// With deforming boxes, walls, gravity, frozen particles and velocities set between runs, forces are those
/// of the model at the positions.
#[test]
fn other_fixes_are_honoured() {
    let model = Model::open(warren().as_ref()).unwrap();
    let check = |l: &Only, step: u64| {
        l.command("run 0").unwrap();
        let truth = truth(l, &model, 1.0, Some(step));
        let apart = difference(&frame(l).f, &truth.forces);
        assert!(apart < 1e-10, "{apart}");
    };
    let head = |before: &str, region: &str| {
        format!("{}{}timestep {DT}\nfix 1 all nve\n", particles(before, region, 1, 500), psi())
    };
    let l = open(&head("", "prism 0 5 0 5 0 5 0 0 0"));
    l.commands("fix d all deform 1 xy erate 2.0 z scale 0.9 remap v\nrun 20\nunfix d").unwrap();
    check(&l, 20);
    drop(l);
    let l = open(&head("boundary p p f", "block 0 5 0 5 0 5"));
    l.commands(
        "fix w all wall/reflect zlo EDGE zhi EDGE\nfix g all gravity 2 vector 0 0 -1\nrun 20\nunfix g",
    )
    .unwrap();
    assert!(frame(&l).x.iter().all(|x| x[2] >= 0.0 && x[2] <= 5.0));
    check(&l, 20);
    drop(l);
    let l = open(&head("", "block 0 5 0 5 0 5"));
    let start = frame(&l).x;
    l.commands("group wall id 1:50\nvelocity wall set 0 0 0\nfix s wall setforce 0 0 0\nrun 20\nunfix s")
        .unwrap();
    let now = frame(&l).x;
    assert!(difference(&now[..50], &start[..50]) < 1e-12);
    assert!(now[50..] != start[50..]);
    l.commands("velocity all create 3.0 99 loop geom").unwrap();
    check(&l, 20);
    drop(l);
    // A box that becomes too narrow for the noise stops the run.
    let l = open(&head("", "block 0 5 0 5 0 5"));
    let error = l.commands("fix d all deform 1 z final 0 1.5\nrun 100").unwrap_err().to_string();
    assert!(error.contains("less than twice the range of the thermostat"), "{error}");
}

/// Ghosts that are only images of a rank's own atoms are omitted, but not if pairs come from LAMMPS's list.
/// Trajectories are the same in boxes that shear with or without velocities, that shrink, that are too
/// narrow, or that are open along a direction, and for ranks along any direction.
#[test]
fn leaving_out_images_changes_nothing() {
    let (_folder, wide) = file(WIDE);
    let narrow = WIDE.split("[[thermostat]]").next().unwrap().to_owned();
    let (_narrow, narrow) = file(&narrow);
    for (before, region, model, more) in [
        ("", "prism 0 5 0 5 0 5 0 0 0", &wide, "fix d all deform 1 xy erate 3.0 remap v"),
        ("", "prism 0 5 0 5 0 5 0 0 0", &wide, "fix d all deform 1 xy erate 1.0"),
        ("", "block 0 5 0 5 0 5", &wide, "fix d all deform 1 x scale 0.9 z scale 1.1 remap x"),
        ("", "block 0 1.8 0 5 0 5", &narrow, ""),
        ("boundary p p f", "block 0 5 0 5 0 5", &wide, "fix w all wall/reflect zlo EDGE zhi EDGE"),
        ("processors 2 1 1", "block 0 5 0 5 0 5", &wide, ""),
        ("processors 1 2 1", "block 0 5 0 5 0 5", &wide, ""),
        (
            "processors 1 1 2",
            "block 0 5 0 5 0 5",
            &wide,
            "fix d all deform 1 x scale 0.9 z scale 1.1 remap x",
        ),
        ("processors 2 2 1", "block 0 5 0 5 0 5", &wide, ""),
        ("processors 1 2 2", "block 0 5 0 5 0 5", &wide, ""),
        ("processors 1 2 1", "prism 0 5 0 5 0 5 1 0.5 -1", &wide, ""),
        (
            "processors 1 1 2\nboundary p f p",
            "block 0 5 0 5 0 5",
            &wide,
            "fix w all wall/reflect ylo EDGE yhi EDGE",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let start = folder.path().join("start.data").display().to_string();
        let start_of =
            before.lines().filter(|line| !line.starts_with("processors")).collect::<Vec<_>>().join("\n");
        open(&format!(
            "{}pair_style zero 1.0\npair_coeff * *\nwrite_data {start} nocoeff\n",
            particles(&start_of, region, 2, if region.contains("1.8") { 180 } else { 500 })
        ));
        let script = |list: &str| {
            format!(
                "units lj\natom_style atomic\natom_modify map yes\n{before}\ncomm_modify vel yes\nread_data {start}\n{}\
                 pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {model} A B\n{list}fix 1 all nve\n{more}\n\
                 timestep {DT}\nrun 20\n",
                load()
            )
        };
        let ranks = before.split_whitespace().skip_while(|w| *w != "processors").skip(1).take(3);
        let ranks = ranks.map(|n| n.parse::<usize>().unwrap()).product::<usize>().max(1);
        let here = run(&script(""), ranks);
        let listed = run(&script(&listed()), ranks);
        let apart =
            [difference(&here.x, &listed.x), difference(&here.v, &listed.v), difference(&here.f, &listed.f)];
        assert!(apart.iter().all(|d| *d < 1e-9), "{before}, {region}, {more}: {apart:?}");
    }
}

/// An error on one of several ranks stops all, and names the step and the particle.
#[test]
fn trouble_is_named_on_every_rank() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.lammps");
    let singular = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                    [excess_free_energy]\nF = \"-ln(30 - n)\"\n";
    let (_folder, singular) = file(singular);
    let singular_style = format!("pair_style dpd/psi 1.0 {SEED}\npair_coeff * * {singular} F\n");
    let cases = [
        // All atoms of one rank are at one point: the density is beyond the singularity.
        (
            format!(
                "{singular_style}region corner block 0 1.5 0 1.5 0 1.5\ngroup c region corner\nfix 1 all nve\n\
                 run 0\nset group c x 0.2 y 0.2 z 0.2\nrun 1\n"
            ),
            "is not finite at local densities",
        ),
        (format!("{}fix 1 all nve\nrun 2\nset atom 7 vx 1e200\nrun 5\n", psi()), ""),
        (
            format!(
                "{}fix 1 all nve\nrun 2\nvariable nan atom exp(1000*(id==7))*0\nvelocity all set v_nan NULL NULL sum yes\nrun 5\n",
                psi()
            ),
            "is not finite",
        ),
    ];
    for (text, message) in cases {
        std::fs::write(&path, deck(&text)).unwrap();
        for ranks in [1, 2, 4] {
            let error = psidpd_tests::last_words(ranks, || {
                let host = &psidpd_tests::lammps().0;
                match host.run_script(ranks, folder.path(), &path, &[], LIMIT) {
                    Ok(_) => Ok(text.clone()),
                    Err(error) => Err(error.to_string()),
                }
            });
            assert!(error.contains("ERROR") && !error.contains("imeout"), "{ranks}: {error}");
            assert!(error.contains(message), "{ranks}: {error}");
            // The message blames the numbers, not the formula that gave them.
            assert!(!error.contains("variable formula"), "{ranks}: {error}");
            if !message.is_empty() {
                assert!(
                    error.contains("dpd/psi at step 2") || error.contains("dpd/psi at step 0"),
                    "{error}"
                );
                assert!(error.contains("particle "), "{error}");
            }
        }
    }
}
