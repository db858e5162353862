//! Other programs read the files of a run: MDAnalysis, ASE, gsd, PyVista and LAMMPS find the same particles, the same
//! g(r), the same density and the same energies.
//!
//! Tolerances: ASE keeps doubles and converts the coordinates of a dump to fractions of the box and back,
//! hence 10⁻¹² for a dump and no difference for copied values. MDAnalysis keeps single precision: 10⁻⁶ for
//! numbers below 8, and pairs that close to the edge of a bin may count in the next one. GSD has single precision too.
//! LAMMPS sums the same doubles in another order: 10⁻¹¹ of the largest term.

use psidpd::formats::{DataFile, dump};
use psidpd_core::maximum::largest;
use psidpd_core::model::kernel::{Kernel, KernelKind};
use psidpd_tests::{lammps, psidpd, python, said};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

const MODEL: &str = r#"
title   = "Two species"
species = ["A", "B"]

[density.n]
kernel = "quadratic"
range  = 1.2

[excess_free_energy]
A = "0.3*n^2 + 0.5*n_B"
B = "0.2*n^2 + 0.5*n_A"

[[pair]]
between  = ["A", "A"]
form     = "soft"
strength = 10.0
range    = 1.0

[[pair]]
between  = ["A", "B"]
form     = "soft"
strength = 20.0
range    = 1.0
"#;

/// A scene without a thermostat, so that LAMMPS's pressure has no noise of its own step.
const SCENE: &str = r#"
title = "for others to read"
model = "model.toml"
kT    = 1.0
seed  = 3
precision = "double"

[box]
lengths = [5.0, 4.5, 6.0]

[masses]
B = 2.0

[initial]
kind    = "lattice"
density = 3.0

[[stage]]
name  = "run"
steps = 40
dt    = 0.01

[output]
thermo = 20
dump   = 20
xyz    = 20
gsd    = 20
vtk    = 20

# Of the last frame alone.
[observe.rdf]
every = 40
range = 2.0
bins  = 40
"#;

const BINS: usize = 40;
const RANGE: f64 = 2.0;

fn run_scene(folder: &Path) {
    std::fs::write(folder.join("model.toml"), MODEL).unwrap();
    std::fs::write(folder.join("scene.toml"), SCENE).unwrap();
    let output = psidpd(folder, &["run", "scene.toml", "--out", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
}

fn vectors(value: &Value) -> Vec<[f64; 3]> {
    let row = |r: &Value| [0, 1, 2].map(|k| r[k].as_f64().expect("a number"));
    value.as_array().expect("a list of vectors").iter().map(row).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn words(value: &Value) -> Vec<&str> {
    value.as_array().expect("a list").iter().map(|x| x.as_str().expect("a word")).collect()
}

fn assert_near(what: &str, found: &[[f64; 3]], expected: &[[f64; 3]], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (k, (a, b)) in found.iter().zip(expected).enumerate() {
        let off = largest((0..3).map(|c| (a[c] - b[c]).abs()));
        assert!(off <= tolerance, "{what}, particle {k}: {a:?} against {b:?}");
    }
}

/// A frame in the order of the ids.
struct Expected {
    step: f64,
    time: f64,
    types: Vec<f64>,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
}

const BOX: [f64; 3] = [5.0, 4.5, 6.0];

#[test]
fn other_programs_see_the_same_particles() {
    let folder = tempfile::tempdir().unwrap();
    run_scene(folder.path());
    let out = folder.path().join("out");
    let script = psidpd_tests::root().join("tests/python/read_back.py");
    let read = Command::new(python())
        .arg(script)
        .arg(&out)
        .args([BINS.to_string(), RANGE.to_string()])
        .output()
        .expect("python starts");
    assert!(read.status.success(), "{}", said(&read));
    let seen: Value = serde_json::from_slice(&read.stdout).expect("the script writes JSON");

    let mut frames = dump::read(&out.join("dump.lammpstrj")).unwrap();
    let expected: Vec<Expected> = frames
        .iter_mut()
        .map(|f| {
            f.sort_by_id();
            Expected {
                step: f.step as f64,
                time: f.step as f64 * 0.01,
                types: f.get("type").unwrap(),
                x: f.vectors(["x", "y", "z"]).unwrap(),
                v: f.vectors(["vx", "vy", "vz"]).unwrap(),
            }
        })
        .collect();
    assert_eq!(expected.iter().map(|e| e.step).collect::<Vec<_>>(), [0.0, 20.0, 40.0]);
    let count = expected[0].x.len();
    let ids: Vec<f64> = (1..=count).map(|k| k as f64).collect();
    // ASE takes B for boron, so the file has another name.
    let names: Vec<&str> = expected[0].types.iter().map(|t| if *t == 1.0 { "A" } else { "B_" }).collect();
    assert!(names.contains(&"A") && names.contains(&"B_"));

    for source in ["mda_dump", "mda_xyz", "ase_dump", "ase_xyz", "gsd", "mda_gsd", "vtp", "vti"] {
        assert_eq!(seen[source].as_array().map(Vec::len), Some(3), "{source}");
    }
    for (k, e) in expected.iter().enumerate() {
        let at = |source: &str| format!("{source}, frame {k}");
        let frame = &seen["mda_dump"][k];
        assert_eq!(frame["step"], e.step, "{}", at("mda_dump"));
        assert_near(&at("mda_dump x"), &vectors(&frame["x"]), &e.x, 1e-6);
        assert_near(&at("mda_dump v"), &vectors(&frame["v"]), &e.v, 1e-6);
        assert_eq!(numbers(&frame["ids"]), ids);
        let types: Vec<f64> = words(&frame["types"]).iter().map(|t| t.parse().unwrap()).collect();
        assert_eq!(types, e.types);
        assert_eq!(numbers(&frame["box"]), [BOX[0], BOX[1], BOX[2], 90.0, 90.0, 90.0]);

        // MDAnalysis reads no box from an XYZ file.
        let frame = &seen["mda_xyz"][k];
        assert_near(&at("mda_xyz x"), &vectors(&frame["x"]), &e.x, 1e-6);
        assert_eq!(words(&frame["names"]), names);

        let frame = &seen["ase_dump"][k];
        assert_near(&at("ase_dump x"), &vectors(&frame["x"]), &e.x, 1e-12);
        assert_near(&at("ase_dump v"), &vectors(&frame["v"]), &e.v, 1e-12);
        assert_near(&at("ase_dump cell"), &vectors(&frame["cell"]), &cell(), 0.0);
        assert_eq!(numbers(&frame["numbers"]), e.types);

        let frame = &seen["ase_xyz"][k];
        assert_near(&at("ase_xyz x"), &vectors(&frame["x"]), &e.x, 0.0);
        assert_near(&at("ase_xyz v"), &vectors(&frame["velo"]), &e.v, 0.0);
        assert_near(&at("ase_xyz cell"), &vectors(&frame["cell"]), &cell(), 0.0);
        assert_eq!(frame["pbc"], serde_json::json!([true, true, true]));
        assert_eq!(numbers(&frame["id"]), ids);
        assert_eq!(numbers(&frame["numbers"]), e.types);
        assert_eq!(frame["info"]["Step"], e.step);
        let time = frame["info"]["Time"].as_f64().unwrap();
        assert!((time - e.time).abs() < 1e-12, "{time}");

        // HOOMD-blue's box is centred at the origin.
        let centred: Vec<[f64; 3]> =
            e.x.iter().map(|x| std::array::from_fn(|k| x[k] - 0.5 * BOX[k])).collect();
        let kinds: Vec<f64> = e.types.iter().map(|t| t - 1.0).collect();
        let frame = &seen["gsd"][k];
        assert_near(&at("gsd x"), &vectors(&frame["x"]), &centred, 1e-6);
        assert_near(&at("gsd v"), &vectors(&frame["v"]), &e.v, 1e-6);
        assert_eq!(
            (&frame["step"], frame["dimensions"].as_i64()),
            (&serde_json::json!(e.step as u64), Some(3))
        );
        assert!((frame["time"].as_f64().unwrap() - e.time).abs() < 1e-12);
        assert_eq!(numbers(&frame["box"]), [BOX[0], BOX[1], BOX[2], 0.0, 0.0, 0.0]);
        assert_eq!((words(&frame["types"]), numbers(&frame["typeid"])), (vec!["A", "B"], kinds.clone()));
        assert_eq!(numbers(&frame["mass"]), e.types, "A has mass 1, B 2");
        let frame = &seen["mda_gsd"][k];
        assert_near(&at("mda_gsd x"), &vectors(&frame["x"]), &centred, 1e-6);
        assert_eq!(numbers(&frame["box"]), [BOX[0], BOX[1], BOX[2], 90.0, 90.0, 90.0]);

        for source in ["vtp", "vti"] {
            let frame = &seen[source][k];
            assert_eq!(frame["step"], e.step as u64, "{}", at(source));
            assert!((frame["time"].as_f64().unwrap() - e.time).abs() < 1e-12);
            assert_eq!(words(&frame["names"]), ["A", "B"]);
        }
        let frame = &seen["vtp"][k];
        assert_near(&at("vtp x"), &vectors(&frame["x"]), &e.x, 0.0);
        assert_near(&at("vtp v"), &vectors(&frame["arrays"]["velocity"]), &e.v, 0.0);
        assert_eq!(numbers(&frame["arrays"]["species"]), kinds);
        assert_eq!(numbers(&frame["arrays"]["id"]), ids);
        // A vertex is its number of points, 1, and the point.
        let vertices: Vec<f64> = (0..count).flat_map(|k| [1.0, k as f64]).collect();
        assert_eq!(numbers(&frame["vertices"]), vertices);
        assert_density(&at("vti"), &seen["vti"][k], &e.x, &kinds);
    }
    let last = &expected[2];
    let mut data = DataFile::read(&out.join("final.data")).unwrap();
    data.sort_by_id();
    assert!(data.atoms.iter().any(|a| a.image != [0; 3]), "no particle has crossed the box");
    // ASE gives unwrapped positions.
    let unwrapped: Vec<[f64; 3]> =
        data.atoms.iter().map(|a| std::array::from_fn(|k| a.x[k] + f64::from(a.image[k]) * BOX[k])).collect();
    for (source, x, tolerance) in [("mda_data", &last.x, 1e-6), ("ase_data", &unwrapped, 1e-12)] {
        let frame = &seen[source][0];
        assert_near(source, &vectors(&frame["x"]), x, tolerance);
        assert_near(source, &vectors(&frame["v"]), &last.v, tolerance);
    }
    assert_eq!(numbers(&seen["mda_data"][0]["ids"]), ids);
    assert_eq!(numbers(&seen["ase_data"][0]["id"]), ids);
    assert_eq!(numbers(&seen["ase_data"][0]["type"]), last.types);
    assert_eq!(numbers(&seen["mda_data"][0]["masses"]), last.types, "A has mass 1, B 2");

    let mine = count_pairs(&last.x);
    let total: f64 = mine.iter().sum();
    assert!(total > 1000.0, "{total}");
    // MDAnalysis counts each pair twice. About one pair in 10⁵ is within its precision of an edge.
    let theirs = numbers(&seen["mda_pairs"]);
    let moved: f64 = mine.iter().zip(&theirs).map(|(a, b)| (a - 0.5 * b).abs()).sum();
    assert!(moved <= 4.0, "{mine:?}\n{theirs:?}");
    // ASE divides by the volume of the shell.
    let width = RANGE / BINS as f64;
    let density = count as f64 / BOX.iter().product::<f64>();
    let observed: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("observables.json")).unwrap()).unwrap();
    assert_eq!(observed[0]["samples"], 1, "{observed}");
    let own = numbers(&observed[0]["columns"][0]["values"]);
    assert_eq!(own.len(), BINS);
    // ASE's ideal gas has N neighbours for each particle, psidpd's has N − 1. Bins with an edge at a pair
    // distance of the initial lattice may differ by one pair.
    let finite = count as f64 / (count as f64 - 1.0);
    let theirs = numbers(&seen["ase_g"]);
    let differing = own.iter().zip(&theirs).filter(|(g, ase)| (**g - finite * **ase).abs() > 1e-9).count();
    assert!(differing <= 2, "{own:?}\n{theirs:?}");
    for (k, (pairs, g)) in mine.iter().zip(theirs).enumerate() {
        let (inner, outer) = (k as f64 * width, (k + 1) as f64 * width);
        let shell = 4.0 / 3.0 * std::f64::consts::PI * (outer.powi(3) - inner.powi(3));
        let direct = 2.0 * pairs / (count as f64 * density * shell);
        assert!((g - direct).abs() < 1e-9, "bin {k}: {g} against {direct}");
    }
}

/// The grid has the densities of the model's kernel, from their definition: at every seventh point, of all and of each species.
fn assert_density(what: &str, frame: &Value, x: &[[f64; 3]], kinds: &[f64]) {
    let (origin, spacing, size) =
        (numbers(&frame["origin"]), numbers(&frame["spacing"]), numbers(&frame["size"]));
    assert_eq!(origin, [0.0; 3]);
    for k in 0..3 {
        // A third of the range, or less; from face to face.
        assert!(spacing[k] <= 0.4 && (spacing[k] * (size[k] - 1.0) - BOX[k]).abs() < 1e-12, "{what}");
    }
    let kernel = Kernel::new(KernelKind::Quadratic, 1.2, 3);
    let fields = ["density", "density_A", "density_B"].map(|name| numbers(&frame["arrays"][name]));
    assert_eq!(fields[0].len() as f64, size.iter().product::<f64>());
    for at in (0..fields[0].len()).step_by(7) {
        let number = [
            at % size[0] as usize,
            at / size[0] as usize % size[1] as usize,
            at / (size[0] * size[1]) as usize,
        ];
        let mut sums = [0.0; 3];
        for (x, kind) in x.iter().zip(kinds) {
            // The box is wider than twice the range, so that one image counts.
            let square = |k: usize| {
                let d = x[k] - number[k] as f64 * spacing[k];
                (d - BOX[k] * (d / BOX[k]).round()).powi(2)
            };
            let w = kernel.value((square(0) + square(1) + square(2)).sqrt());
            sums[0] += w;
            sums[1 + *kind as usize] += w;
        }
        for (field, sum) in fields.iter().zip(sums) {
            assert!(
                (field[at] - sum).abs() <= 1e-6 * sum.max(1.0),
                "{what} at {number:?}: {} {sum}",
                field[at]
            );
        }
    }
}

fn cell() -> Vec<[f64; 3]> {
    (0..3).map(|k| std::array::from_fn(|c| if c == k { BOX[k] } else { 0.0 })).collect()
}

/// Counts pairs by distance to the nearest image, each once.
fn count_pairs(x: &[[f64; 3]]) -> Vec<f64> {
    let mut bins = vec![0.0; BINS];
    for (i, a) in x.iter().enumerate() {
        for b in &x[..i] {
            let square = |k: usize| {
                let d = a[k] - b[k];
                (d - BOX[k] * (d / BOX[k]).round()).powi(2)
            };
            let r = (square(0) + square(1) + square(2)).sqrt();
            // As in ASE, the upper edge belongs to the bin.
            let bin = (r / (RANGE / BINS as f64)).ceil() as usize;
            if (1..=BINS).contains(&bin) {
                bins[bin - 1] += 1.0;
            }
        }
    }
    bins
}

/// LAMMPS reads the last state by `read_data` and the dump by `rerun`, with the plugin's forces.
#[test]
fn lammps_finds_the_energies_of_the_series_again() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run_scene(here);
    let (host, plugin) = lammps();
    let head = |extra: &str| {
        format!(
            "units lj\natom_style atomic\ncomm_modify vel yes\n{extra}plugin load \"{}\"\npair_style dpd/psi 1.0 1\n\
             pair_coeff * * model.toml A B\nthermo_style custom step temp pe ke press pxx pyy pzz pxy pxz pyz\n\
             thermo_modify norm no format float %.17g\nthermo 1\n",
            plugin.display()
        )
    };
    let data = head("read_data out/final.data\n");
    std::fs::write(here.join("in.data"), format!("{data}run 0\n")).unwrap();
    // Positions come from the dump alone; the data file gives box, types and masses.
    let rerun = format!("{data}rerun out/dump.lammpstrj dump x y z vx vy vz box yes\n");
    std::fs::write(here.join("in.rerun"), rerun).unwrap();
    let limit = Duration::from_secs(120);
    let rows = |script: &str| -> Vec<Vec<f64>> {
        let run = host.run_script(1, here, &here.join(script), &["-log", "none"], limit).unwrap();
        let mut rows = Vec::new();
        let mut inside = false;
        for line in run.stdout.lines() {
            if line.trim_start().starts_with("Step") {
                inside = true;
            } else if line.starts_with("Loop time") {
                inside = false;
            } else if inside && let Ok(row) = line.split_whitespace().map(str::parse).collect() {
                rows.push(row);
            }
        }
        assert!(!rows.is_empty(), "{}", run.stdout);
        rows
    };
    // The columns are step, time, temperature, potential, kinetic, pressure and six components.
    let thermo = std::fs::read_to_string(here.join("out/thermo.csv")).unwrap();
    let thermo: Vec<Vec<f64>> =
        thermo.lines().skip(1).map(|l| l.split(',').map(|w| w.parse().unwrap()).collect()).collect();
    let compare = |theirs: &[f64], ours: &[f64]| {
        let near = |a: f64, b: f64, scale: f64| {
            assert!((a - b).abs() <= 1e-11 * scale, "{theirs:?}\nagainst {ours:?}");
        };
        near(theirs[1], ours[2], ours[2]);
        near(theirs[2], ours[3], ours[3]);
        near(theirs[3], ours[4], ours[4]);
        for k in 0..7 {
            near(theirs[4 + k], ours[5 + k], ours[5]);
        }
    };
    let again = rows("in.rerun");
    assert_eq!(again.iter().map(|r| r[0]).collect::<Vec<_>>(), [0.0, 20.0, 40.0]);
    for (theirs, ours) in again.iter().zip(&thermo) {
        compare(theirs, ours);
    }
    compare(&rows("in.data")[0], &thermo[2]);
    // The data file holds the last frame of the dump.
    let data = DataFile::read(&here.join("out/final.data")).unwrap();
    let frames = dump::read(&here.join("out/dump.lammpstrj")).unwrap();
    let x: Vec<[f64; 3]> = data.atoms.iter().map(|a| a.x).collect();
    assert_eq!(Some(x), frames[2].vectors(["x", "y", "z"]));
}

/// A box that is tilted in all three ways and a tilted plane, as other programs read them: GSD has the edges' ratios, a dump the
/// edges. GSD has no height of a plane. Velocities and positions from the middle of the box are those of the dump.
#[test]
fn other_programs_see_tilted_boxes() {
    for (flat, edges, middle, shape) in [
        (
            false,
            [[8.0, 0.0, 0.0], [1.0, 4.0, 0.0], [-2.0, 1.5, 8.0]],
            [4.5, 0.75, 7.0],
            [8.0, 4.0, 8.0, 0.25, -0.25, 0.1875],
        ),
        (
            true,
            [[8.0, 0.0, 0.0], [1.0, 4.0, 0.0], [0.0, 0.0, 1.0]],
            [5.5, 0.0, 0.0],
            [8.0, 4.0, 0.0, 0.25, 0.0, 0.0],
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (dimensions, bounds, tilt) = match flat {
            true => ("dimensions = 2\n", "-0.5 0.5 zlo zhi", "1 0 0"),
            false => ("", "3 11 zlo zhi", "1 -2 1.5"),
        };
        let model = format!(
            "title = \"gas\"\n{dimensions}species = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n"
        );
        let height = if flat { 0.0 } else { 6.5 };
        let data = format!(
            "tilted\n\n4 atoms\n2 atom types\n\n1 9 xlo xhi\n-2 2 ylo yhi\n{bounds}\n{tilt} xy xz yz\n\nMasses\n\n1 1.0\n\
             2 3.0\n\nAtoms # atomic\n\n1 1 2.0 -1.0 {height}\n2 2 4.5 0.5 {height}\n3 1 6.0 1.25 {height}\n4 2 5.0 -0.75 {height}\n"
        );
        let scene = "title = \"t\"\nmodel = \"model.toml\"\nkT = 0.7\nseed = 1\n[initial]\nkind = \"data\"\nfile = \"start.data\"\n\
                     velocities = \"thermal\"\n[[stage]]\nname = \"run\"\nsteps = 2\ndt = 0.01\n[output]\ngsd = 1\ndump = 1\n";
        for (name, text) in [("model.toml", &model[..]), ("start.data", &data[..]), ("scene.toml", scene)] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let output = psidpd(folder.path(), &["run", "scene.toml", "--out", "out"]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        let out = folder.path().join("out");
        let script = psidpd_tests::root().join("tests/python/read_tilted.py");
        let read = Command::new(python()).arg(script).arg(&out).output().expect("python starts");
        assert!(read.status.success(), "{}", said(&read));
        let seen: Value = serde_json::from_slice(&read.stdout).expect("the script writes JSON");
        assert_eq!(numbers(&seen["gsd"]), shape);
        assert_eq!(seen["dimensions"].as_i64(), Some(if flat { 2 } else { 3 }));
        assert_eq!(numbers(&seen["mass"]), [1.0, 3.0, 1.0, 3.0]);
        assert_near("ase", &vectors(&seen["ase"]), &edges, 1e-12);
        // Single precision, by way of lengths and angles.
        assert_near("mda", &vectors(&seen["mda"]), &edges, 1e-5);
        let mut frame = dump::read(&out.join("dump.lammpstrj")).unwrap().pop().unwrap();
        assert!(frame.sort_by_id());
        let x = frame.vectors(["x", "y", "z"]).unwrap();
        let from_middle: Vec<[f64; 3]> =
            x.iter().map(|x| std::array::from_fn(|k| x[k] - middle[k])).collect();
        assert_near("gsd x", &vectors(&seen["x"]), &from_middle, 1e-6);
        assert_near("gsd v", &vectors(&seen["v"]), &frame.vectors(["vx", "vy", "vz"]).unwrap(), 1e-6);
    }
}
