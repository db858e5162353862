//! Diffusion and viscosity of a liquid agree with LAMMPS's own `dpd`, which shares no code with psidpd: its
//! forces and its noise, its displacements, and its stress in a shear flow, which needs no correlation
//! functions. `psidpd validate` compares slabs and tensions.

use psidpd::lammps::install;
use psidpd::observe::Measured;
use psidpd_tests::{psidpd, root, said};
use std::path::Path;
use std::time::Duration;

const EDGE: f64 = 7.0;
const DT: f64 = 0.02;
/// Number of blocks of a LAMMPS run, and their steps.
const BLOCKS: usize = 24;
const STEPS: usize = 2500;
/// Steps of the native run: correlations of stresses are noisier than a mean stress.
const OWN_STEPS: usize = 240_000;
/// Shear rate of the flow. Half of it gave the same viscosity: 0.832(17) after 0.827(9).
const RATE: f64 = 0.2;

fn scene() -> String {
    format!(
        "title = \"water\"\nmodel = \"{}\"\nkT = 1.0\nseed = 4\nbox = {EDGE}\ndensity = 3.0\n\
         [[stage]]\nname = \"equilibrate\"\nsteps = 1500\ndt = {DT}\n\
         [[stage]]\nname = \"produce\"\nsteps = {OWN_STEPS}\ndt = {DT}\n\
         [observe]\ntemperature = {{ every = 10 }}\nmsd = {{ every = 25, length = 100, spacing = 25 }}\n\
         viscosity = {{ length = 50 }}\n",
        root().join("validation/models/standard-dpd.toml").display(),
    )
}

/// The liquid after 1500 steps at rest; the box can be sheared.
fn liquid() -> String {
    format!(
        "units lj\natom_style atomic\ncomm_modify vel yes\nregion b prism 0 {EDGE} 0 {EDGE} 0 {EDGE} 0 0 0\n\
         create_box 1 b\ncreate_atoms 1 random {} 4711 b\nmass 1 1.0\nvelocity all create 1.0 87\n\
         pair_style dpd 1.0 1.0 3141\npair_coeff * * 25.0 4.5\nfix move all nve\ntimestep {DT}\nthermo 500\nrun 1500\n",
        (3.0 * EDGE.powi(3)).round()
    )
}

fn deck() -> String {
    format!(
        "{}variable k loop {BLOCKS}\nlabel again\ncompute d all msd com no\nvariable d equal c_d[4]\n\
         run {}\nprint \"MSD $(v_d)\" append msd.txt\nrun {}\nprint \"MSD $(v_d)\" append msd.txt\n\
         uncompute d\nvariable d delete\nnext k\njump SELF again\n",
        liquid(),
        STEPS / 2,
        STEPS - STEPS / 2,
    )
}

/// Plane Couette flow along x, driven by moving box edges (Lees and Edwards 1972).
fn flow() -> String {
    format!(
        "{}fix flow all deform 1 xy erate {RATE} remap v\nrun 3500\nvariable eta equal -pxy/{RATE}\n\
         fix eta all ave/time 1 {STEPS} {STEPS} v_eta file eta.txt\nrun {}\n",
        liquid(),
        BLOCKS * STEPS
    )
}

/// D and η from LAMMPS, with errors from blocks.
fn by_lammps(folder: &Path) -> [Measured; 2] {
    let host = install(&|line| eprintln!("{line}")).unwrap();
    for (name, text) in [("in.rest", deck()), ("in.flow", flow())] {
        let script = folder.join(name);
        std::fs::write(&script, text).unwrap();
        host.run_script(1, folder, &script, &[], Duration::from_secs(1800)).unwrap_or_else(|e| panic!("{e}"));
    }
    let second = |name: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        let lines = text.lines().filter(|l| !l.starts_with('#'));
        lines.map(|l| l.split_whitespace().nth(1).unwrap().parse().unwrap()).collect()
    };
    let (squares, viscosity) = (second("msd.txt"), second("eta.txt"));
    assert_eq!((squares.len(), viscosity.len()), (2 * BLOCKS, BLOCKS));
    let time = DT * (STEPS - STEPS / 2) as f64;
    let diffusion: Vec<f64> = squares.chunks(2).map(|s| (s[1] - s[0]) / (6.0 * time)).collect();
    [Measured::mean(&diffusion), Measured::mean(&viscosity)]
}

/// Each limit is three combined errors: one run in 200 with other seeds fails by chance.
#[test]
#[ignore = "minutes of LAMMPS: cargo test --release -p psidpd-tests --test transport -- --ignored"]
fn diffusion_and_viscosity_are_those_of_lammps() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("s.toml"), scene()).unwrap();
    let output = psidpd(here, &["run", "s.toml", "--out", "out", "--precision", "double"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = std::fs::read_to_string(here.join("out/observables.json")).unwrap();
    let observed: serde_json::Value = serde_json::from_str(&text).unwrap();
    let own = |observable: &str, column: &str| {
        let found = observed.as_array().unwrap().iter().find(|o| o["name"] == observable).unwrap();
        let column = found["columns"].as_array().unwrap().iter().find(|c| c["name"] == column).unwrap();
        Measured {
            value: column["values"][0].as_f64().unwrap(),
            error: column["errors"][0].as_f64().unwrap(),
        }
    };
    let theirs = by_lammps(here);
    let ours = [own("diffusion", "diffusion"), own("viscosity", "viscosity")];
    for (name, a, b, most) in [("D", ours[0], theirs[0], 0.03), ("viscosity", ours[1], theirs[1], 0.04)] {
        let error = a.error.hypot(b.error);
        println!("{name}: psidpd {:.4} ± {:.4}, LAMMPS {:.4} ± {:.4}", a.value, a.error, b.value, b.error);
        assert!(error < most * b.value, "{name}: {a:?} {b:?} tell too little");
        assert!((a.value - b.value).abs() < 3.0 * error, "{name}: {a:?} {b:?}");
    }
}
