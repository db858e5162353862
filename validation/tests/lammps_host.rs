//! The installed LAMMPS within this process, as a program, and with psidpd's files.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use psidpd::formats::data::Atom;
use psidpd::formats::files::Existing;
use psidpd::formats::setfl::{Element, Setfl};
use psidpd::formats::{DataFile, dump};
use psidpd::lammps::{Host, Lammps, LammpsError, install};

fn host() -> Host {
    install(&|_| {}).unwrap()
}

const FLUID: &str = "
    units lj
    atom_modify map yes
    region b block 0 5 0 5 0 5
    create_box 2 b
    create_atoms 1 random 60 123 NULL
    create_atoms 2 random 40 321 NULL
    mass * 1.0
    pair_style soft 1.2
    pair_coeff * * 3.0
    velocity all create 1.0 87 loop geom
    compute pea all pe/atom
    compute st all stress/atom NULL
    compute s all reduce sum c_pea
    thermo_style custom step pe press c_s
    fix 1 all nve
    run 10
";

#[test]
fn forces_energies_and_properties_by_atom_id() {
    let l = Lammps::open(&host(), &[]).unwrap();
    assert!(l.simulation_box().is_err());
    l.commands(FLUID).unwrap();
    assert!(l.version().unwrap() >= 20250722);
    assert_eq!(l.natoms().unwrap(), 100);
    assert!(l.has_style("pair", "mdpd").unwrap() && !l.has_style("pair", "nosuch").unwrap());
    let b = l.simulation_box().unwrap();
    assert_eq!((b.lo, b.hi, b.tilt), ([0.0; 3], [5.0; 3], [0.0; 3]));
    assert_eq!(b.periodic, [true; 3]);
    let ids: Vec<i32> = (1..=100).collect();
    assert_eq!(l.gather_ints("id", 1).unwrap(), ids);
    let kinds = l.gather_ints("type", 1).unwrap();
    assert_eq!(kinds.iter().filter(|&&k| k == 1).count(), 60);
    assert_eq!(l.gather_ints("image", 3).unwrap().len(), 300);

    // The forces follow the pair style's formula at these positions.
    let (x, f) = (l.gather("x", 3).unwrap(), l.gather("f", 3).unwrap());
    let (mut energy, mut worst) = (0.0, 0.0f64);
    for i in 0..100 {
        let mut force = [0.0; 3];
        for j in (0..100).filter(|&j| j != i) {
            let d: [f64; 3] = std::array::from_fn(|k| {
                let d = x[3 * i + k] - x[3 * j + k];
                d - 5.0 * (d / 5.0).round()
            });
            let r = d.iter().map(|d| d * d).sum::<f64>().sqrt();
            if r < 1.2 {
                let k = std::f64::consts::PI / 1.2;
                energy += 0.5 * 3.0 * (1.0 + (k * r).cos());
                let magnitude = 3.0 * k * (k * r).sin() / r;
                force.iter_mut().zip(d).for_each(|(f, d)| *f += magnitude * d);
            }
        }
        for k in 0..3 {
            worst = worst.max((force[k] - f[3 * i + k]).abs());
        }
    }
    assert!(worst < 1e-12, "{worst}");
    let pe = l.thermo("pe").unwrap();
    assert!((pe * 100.0 - energy).abs() < 1e-10 * energy, "{pe} {energy}");
    let each = l.gather("c_pea", 1).unwrap();
    assert!((each.iter().sum::<f64>() - energy).abs() < 1e-10 * energy);
    assert!((l.compute_scalar("s").unwrap() - energy).abs() < 1e-10 * energy);
    let p = l.compute_vector("thermo_press").unwrap();
    let mean = (p[0] + p[1] + p[2]) / 3.0;
    assert!((mean - l.thermo("press").unwrap()).abs() < 1e-12);
    assert_eq!(l.eval("2*3").unwrap(), 6.0);

    // Scattered positions are read back unchanged.
    let moved: Vec<f64> = x.iter().map(|x| (x + 0.125).rem_euclid(5.0)).collect();
    l.scatter("x", 3, &moved).unwrap();
    assert_eq!(l.gather("x", 3).unwrap(), moved);
    l.command("run 0").unwrap();
    assert!((l.thermo("pe").unwrap() - pe).abs() < 1e-10);
}

#[test]
fn wrong_requests_are_errors_and_leave_lammps_usable() {
    let l = Lammps::open(&host(), &[]).unwrap();
    let e = l.commands("units lj\nnonsense 1 2\nunits lj").unwrap_err();
    let LammpsError::Lammps { message, doing } = &e else { panic!("{e}") };
    assert!(message.contains("Unknown command: nonsense"), "{message}");
    assert_eq!(doing, "nonsense 1 2");
    l.commands(FLUID).unwrap();
    let text = |e: LammpsError| e.to_string();
    assert!(text(l.thermo("nosuch").unwrap_err()).contains("nosuch"));
    assert!(l.thermo("pe+1").is_err());
    assert!(l.eval("1+").is_err());
    for (name, width) in [
        ("x", 1),
        ("x", 4),
        ("x", 0),
        ("type", 1),
        ("nosuch", 1),
        ("c_pea", 3),
        ("c_st", 1),
        ("c_st", 3),
        ("c_nosuch", 1),
        ("c_s", 1),
        ("f_nosuch", 1),
        ("f_1", 1),
        ("d_nosuch", 1),
        ("x\0", 3),
    ] {
        assert!(l.gather(name, width).is_err(), "{name} {width}");
    }
    assert!(l.gather_ints("x", 3).is_err() && l.gather_ints("c_pea", 1).is_err());
    assert!(l.scatter("x", 3, &[0.0; 7]).is_err());
    assert!(l.compute_scalar("nosuch").is_err() && l.compute_vector("s").is_err());
    assert_eq!(l.gather("c_st", 6).unwrap().len(), 600);

    // With a gap in the ids, values cannot be sorted by id.
    l.commands("group g id 50\ndelete_atoms group g compress no").unwrap();
    assert!(l.gather("x", 3).is_err());

    let e = Lammps::open(&host(), &["-nosuch"]).unwrap_err();
    assert!(text(e).contains("-nosuch"));
    let other = Host { library: "/nowhere/liblammps.so".into(), ..host() };
    let e = Lammps::open(&other, &[]).unwrap_err();
    assert!(matches!(e, LammpsError::OtherLoaded { .. }), "{e}");
}

#[test]
fn several_at_once_on_several_threads() {
    let energies: Vec<f64> = std::thread::scope(|s| {
        let run = || {
            let l = Lammps::open(&host(), &[]).unwrap();
            let other = Lammps::open(&host(), &[]).unwrap();
            l.commands(FLUID).unwrap();
            drop(other);
            l.thermo("pe").unwrap()
        };
        let threads: Vec<_> = (0..3).map(|_| s.spawn(run)).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    assert!(energies.iter().all(|e| *e == energies[0]));
}

/// Runs one test of this file again, in a process of its own.
fn again(test: &str) -> std::process::ExitStatus {
    // A killed process may have left a file of the same number: MPICH then takes it, and does not remove it.
    let old: Vec<PathBuf> =
        std::fs::read_dir("/dev/shm").into_iter().flatten().flatten().map(|f| f.path()).collect();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test])
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let id = child.id();
    let start = std::time::Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            let left = PathBuf::from(format!("/dev/shm/mpich_shm_{id:x}_0"));
            assert!(old.contains(&left) || !left.exists(), "{left:?} is left behind");
            return status;
        }
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            panic!("{test} hangs");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_process_with_lammps_inside_ends_cleanly() {
    assert!(again("several_at_once_on_several_threads").success());
    assert!(again("wrong_requests_are_errors_and_leave_lammps_usable").success());
}

fn script(dir: &Path, text: &str) -> PathBuf {
    let path = dir.join("in.test");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_program_on_one_and_more_ranks() {
    let (host, dir) = (host(), tempfile::tempdir().unwrap());
    let version = host.version().unwrap();
    assert_eq!((version.number, version.abi.as_str()), (20250722, "smallbig mpich"));
    let s = script(dir.path(), &format!("{FLUID}\nprint \"${{word}} $(extract_setting(world_size)) $(pe)\""));
    let limit = Duration::from_secs(100);
    let mut energies = vec![];
    for ranks in [1, 2, 3] {
        let out = host.run_script(ranks, dir.path(), &s, &["-var", "word", "ranks:"], limit).unwrap();
        let start = format!("ranks: {ranks} ");
        let line = out.stdout.lines().find_map(|l| l.strip_prefix(&start));
        energies.push(line.unwrap().trim().parse::<f64>().unwrap());
        assert!(dir.path().join("log.lammps").is_file());
    }
    assert!(energies.iter().all(|e| (e - energies[0]).abs() < 1e-10), "{energies:?}");
}

#[test]
fn failures_of_the_program_are_told() {
    let (host, dir) = (host(), tempfile::tempdir().unwrap());
    let limit = Duration::from_secs(60);
    let s = script(dir.path(), "units lj\nnonsense 1 2\n");
    for ranks in [1, 2] {
        let e = host.run_script(ranks, dir.path(), &s, &[], limit).unwrap_err();
        assert!(matches!(e, LammpsError::Run { .. }), "{e}");
        assert!(e.to_string().contains("ERROR: Unknown command: nonsense"), "{e}");
    }
    let endless = format!("{FLUID}\nrun 1000000000");
    let s = script(dir.path(), &endless);
    for ranks in [1, 2] {
        let start = std::time::Instant::now();
        let limit = Duration::from_secs(2);
        let e = host.run_script(ranks, dir.path(), &s, &[], limit).unwrap_err();
        assert!(matches!(e, LammpsError::Timeout { .. }), "{e}");
        assert!(start.elapsed() < Duration::from_secs(8));
    }
    // No rank is still running.
    let busy = std::fs::read_dir("/proc")
        .unwrap()
        .flatten()
        .any(|p| std::fs::read_link(p.path().join("cwd")).is_ok_and(|cwd| cwd == dir.path()));
    assert!(!busy);
    let e = host.run_script(1, dir.path(), Path::new("none.in"), &[], limit);
    assert!(e.unwrap_err().to_string().contains("none.in"));
}

/// Compares positions up to rounding: in a tilted box LAMMPS converts to fractional coordinates and back.
fn close(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14)
}

#[test]
fn lammps_reads_our_data_and_we_read_its() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    let third = 1.0 / 3.0;
    let l = Lammps::open(&host(), &[]).unwrap();
    for tilt in [None, Some([third, -0.5, 0.25])] {
        let ours = DataFile {
            title: "ours # with a remark".into(),
            boxlo: [-third, 0.0, 0.0],
            boxhi: [4.0, 5.0, 6.0],
            tilt,
            types: 2,
            masses: vec![1.0, 2.5],
            names: Vec::new(),
            atoms: (0..4)
                .map(|i| Atom {
                    id: 4 - i,
                    kind: 1 + i % 2,
                    x: [third * f64::from(i), 1.0 + third, 2.0],
                    image: [0, -1, i as i32],
                })
                .collect(),
            velocities: Some(vec![[third, 0.0, -1e-7]; 4]),
        };
        ours.write_over(&path("ours.data"), Existing::Replace).unwrap();
        l.commands(&format!(
            "clear\nunits lj\natom_style atomic\nread_data {}\npair_style zero 1.0\npair_coeff * *\n\
             dump d all custom 1 {} id type x y z vx vy vz\ndump_modify d format float %.17g\nrun 0 post no\nundump d\n\
             write_data {}",
            path("ours.data").display(),
            path("theirs.dump").display(),
            path("theirs.data").display()
        ))
        .unwrap();
        let mut sorted = ours.clone();
        sorted.sort_by_id();
        let x: Vec<f64> = sorted.atoms.iter().flat_map(|a| a.x).collect();
        let in_lammps = l.gather("x", 3).unwrap();
        assert!(close(&in_lammps, &x));
        assert!(tilt.is_some() || in_lammps == x);
        let images: Vec<i32> = sorted.atoms.iter().flat_map(|a| a.image).collect();
        assert_eq!(l.gather_ints("image", 3).unwrap(), images);

        let mut theirs = DataFile::read(&path("theirs.data")).unwrap();
        theirs.sort_by_id();
        theirs.title = sorted.title.clone();
        for (theirs, ours) in theirs.atoms.iter_mut().zip(&sorted.atoms) {
            assert!(close(&theirs.x, &ours.x));
            theirs.x = if tilt.is_some() { ours.x } else { theirs.x };
        }
        assert_eq!(theirs, sorted);
        let mut frames = dump::read(&path("theirs.dump")).unwrap();
        let frame = &mut frames[0];
        frame.sort_by_id();
        assert_eq!(frame.values[2..5], in_lammps[..3]);
        assert_eq!(frame.tilt, sorted.tilt);
        assert!(close(&frame.boxlo, &sorted.boxlo) && close(&frame.boxhi, &sorted.boxhi));
    }

    // The script uses the style with a density in the file.
    l.commands(&format!(
        "clear\nunits lj\natom_style mdpd\nregion b block 0 4 0 4 0 4\ncreate_box 1 b\ncreate_atoms 1 random 30 5 NULL\n\
         mass 1 1.0\nwrite_data {}",
        path("mdpd.data").display()
    ))
    .unwrap();
    let mut mdpd = DataFile::read(&path("mdpd.data")).unwrap();
    mdpd.sort_by_id();
    let x: Vec<f64> = mdpd.atoms.iter().flat_map(|a| a.x).collect();
    assert_eq!(l.gather("x", 3).unwrap(), x);
}

#[test]
fn eam_tables_give_the_model_they_were_made_from() {
    let dir = tempfile::tempdir().unwrap();
    let elements = ["A", "B"].map(|name| Element { name: name.into(), mass: 1.0 });
    let psi = |a: usize, rho: f64| (1.0 + a as f64) * rho * rho;
    let w = |b: usize, r: f64| (1.0 + b as f64) * (1.0 - r / 1.2).max(0.0).powi(2);
    let phi = |a: usize, b: usize, r: f64| (3.0 + (a + b) as f64) * (1.0 - r / 1.5).max(0.0).powi(2);
    Setfl {
        title: "a test",
        elements: &elements,
        nrho: 4000,
        drho: 0.01,
        nr: 6001,
        dr: 1.5 / 6000.0,
        cutoff: 1.5,
        embedding: &psi,
        density: &w,
        pair: &phi,
    }
    .write(&dir.path().join("test.eam"), psidpd::formats::files::Existing::Keep)
    .unwrap();
    let l = Lammps::open(&host(), &[]).unwrap();
    let text = FLUID
        .replace("pair_style soft 1.2", "pair_style eam/alloy")
        .replace("run 10", "thermo_modify norm no\nrun 0");
    let table = dir.path().join("test.eam");
    let text = text.replace("* * 3.0", &format!("* * {} A B", table.display()));
    l.commands(&text).unwrap();
    let (x, kinds) = (l.gather("x", 3).unwrap(), l.gather_ints("type", 1).unwrap());
    let mut energy = 0.0;
    for i in 0..100 {
        let (a, mut rho) = (kinds[i] as usize - 1, 0.0);
        for j in (0..100).filter(|&j| j != i) {
            let b = kinds[j] as usize - 1;
            let d = (0..3).map(|k| {
                let d = x[3 * i + k] - x[3 * j + k];
                d - 5.0 * (d / 5.0).round()
            });
            let r = d.map(|d| d * d).sum::<f64>().sqrt();
            rho += w(b, r);
            energy += 0.5 * phi(a, b, r);
        }
        energy += psi(a, rho);
    }
    let pe = l.thermo("pe").unwrap();
    assert!((pe - energy).abs() < 1e-6 * energy, "{pe} {energy}");
}
