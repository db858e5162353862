//! Tests that every host of scripts must pass.

#![allow(dead_code)]

use super::style_common::{chains, difference, scaled};
use psidpd::formats::{DataFile, dump};
use psidpd::lammps::Host;
use psidpd_core::maximum::largest;
use psidpd_tests::{psidpd, root, said};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub const LIMIT: Duration = Duration::from_secs(120);

pub fn model() -> PathBuf {
    root().join("validation/models/warren2003-set6.toml")
}

/// A script without a command that loads the styles.
pub fn script(model: &Path) -> String {
    format!(
        "units lj\natom_style atomic\ncomm_modify vel yes\nregion b block 0 5 0 5 0 5\ncreate_box 1 b\n\
         create_atoms 1 random 600 4711 NULL\nmass 1 1\nvelocity all create 1.0 87 loop geom\n\
         pair_style dpd/psi 1.0 5\npair_coeff * * \"{}\" F\nfix 1 all nve\ntimestep 0.001\nthermo 10\nrun 10\n",
        model.display()
    )
}

/// A LAMMPS that runs scripts with the styles.
pub struct Runs {
    pub host: Host,
    /// The command that loads the styles; empty where none is needed.
    pub load: String,
}

impl Runs {
    /// Runs a script and returns its output, or its error.
    pub fn outcome(&self, text: &str, ranks: usize, folder: &Path) -> Result<String, String> {
        let path = folder.join("in.lammps");
        std::fs::write(&path, format!("{}{text}", self.load)).unwrap();
        self.host
            .run_script(ranks, folder, &path, &[], LIMIT)
            .map(|run| run.stdout)
            .map_err(|e| e.to_string())
    }
}

/// Positions and forces, sorted by ID, from a dump of `x y z fx fy fz`.
pub fn read_forces(path: &Path) -> [Vec<[f64; 3]>; 2] {
    let frame = dump::read(path).unwrap().pop().unwrap();
    [["x", "y", "z"], ["fx", "fy", "fz"]].map(|names| frame.vectors(names).unwrap())
}

/// The energy that a script prints as `energy …`.
pub fn energy(said: &str) -> f64 {
    said.lines().find_map(|l| l.strip_prefix("energy ")).expect(said).trim().parse().unwrap()
}

/// Without drag and noise, LAMMPS's forces equal those of the native engine to rounding.
pub fn forces_equal_the_native_engine(runs: &Runs) {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(model()).unwrap();
    let conservative = text.split("[[thermostat]]").next().unwrap();
    let model = folder.path().join("model.toml");
    std::fs::write(&model, conservative).unwrap();
    let mut script = script(&model).replace("run 10\n", "");
    script.push_str(
        "run 40\nwrite_data atoms.data\nreset_timestep 0\n\
         dump d all custom 1 forces.dump id type x y z fx fy fz\n\
         dump_modify d sort id format float %.17g\nrun 0\nvariable u equal pe\nprint \"energy $(v_u:%.17g)\"\n",
    );
    for ranks in [1, 2] {
        let said_here = runs.outcome(&script, ranks, folder.path()).unwrap();
        let [positions, forces] = read_forces(&folder.path().join("forces.dump"));
        assert_eq!(forces.len(), 600);

        // The forces belong to the positions in the dump.
        let mut data = DataFile::read(&folder.path().join("atoms.data")).unwrap();
        data.sort_by_id();
        for (atom, x) in data.atoms.iter_mut().zip(&positions) {
            atom.x = *x;
        }
        data.write(&folder.path().join(format!("{ranks}.data"))).unwrap();
        let arguments = format!("forces --model model.toml --data {ranks}.data --kT 1 --json {ranks}.json");
        let native = psidpd(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        assert!(native.status.success(), "{}", said(&native));
        let native = std::fs::read_to_string(folder.path().join(format!("{ranks}.json"))).unwrap();
        let native: serde_json::Value = serde_json::from_str(&native).unwrap();
        let own: Vec<[f64; 3]> = serde_json::from_value(native["forces"].clone()).unwrap();

        let size = (own.iter().flatten().map(|c| c * c).sum::<f64>() / 600.0).sqrt();
        assert!(size > 1.0, "{size}");
        let pairs = own.as_flattened().iter().zip(forces.as_flattened());
        let worst = largest(pairs.map(|(a, b)| (a - b).abs() / size));
        assert!(worst < 1e-12, "{worst:e} on {ranks} ranks");

        // LAMMPS prints energies per particle.
        let energy = energy(&said_here);
        let own = native["energy"].as_f64().unwrap() / 600.0;
        assert!((energy - own).abs() < 1e-12 * own.abs(), "{energy} {own}");
    }
}

const DUMP: &str = "dump d all custom 1 forces.dump id type x y z fx fy fz\n\
    dump_modify d sort id format float %.17g\nrun 0\nvariable u equal pe*atoms\nprint \"energy $(v_u:%.17g)\"\n";

/// Decks with chains whose bonded neighbours interact weakly, and with types that exclude each other: the
/// pairs then come from LAMMPS's list.
pub fn weakened_decks(newton: &str, folder: &Path) -> [String; 2] {
    std::fs::write(folder.join("chains.data"), chains(120)).unwrap();
    let deck = |special: &str, more: &str| {
        format!(
            "newton {newton}\nunits lj\natom_style bond\ncomm_modify vel yes\nspecial_bonds lj {special}\n\
             read_data chains.data\nmass * 1\npair_style mdpd/psi 1.0 1.0 5\npair_coeff * * -40 25 0 1 0.75\n\
             bond_style zero\nbond_coeff *\n{more}fix 1 all nve\n{DUMP}"
        )
    };
    [deck("0.5 0.0 0.8", ""), deck("1 1 1", "neigh_modify exclude type 1 2\n")]
}

/// Compares the forces and energies of these decks with the formulas, on one rank and on several; returns the
/// outputs on one rank.
pub fn special_factors_and_exclusions(runs: &Runs, newton: &str) -> [String; 2] {
    let folder = tempfile::tempdir().unwrap();
    let factor = |i: usize, j: usize| match i.abs_diff(j) {
        1 if i / 5 == j / 5 => 0.5,
        2 if i / 5 == j / 5 => 0.0,
        3 if i / 5 == j / 5 => 0.8,
        _ => 1.0,
    };
    let kind = |i: usize| if i % 5 < 3 { 1 } else { 2 };
    let same = |i: usize, j: usize| if kind(i) == kind(j) { 1.0 } else { 0.0 };
    let strengths: [&dyn Fn(usize, usize) -> f64; 2] = [&factor, &same];
    let mut on_one = [String::new(), String::new()];
    for (k, (deck, strength)) in weakened_decks(newton, folder.path()).iter().zip(strengths).enumerate() {
        for ranks in [4, 2, 1] {
            let said = runs.outcome(deck, ranks, folder.path()).unwrap_or_else(|e| panic!("{e}\n{deck}"));
            let [x, forces] = read_forces(&folder.path().join("forces.dump"));
            let (expected, f) = scaled(&x, 5.0, strength);
            let apart = difference(&forces, &f);
            assert!(apart < 1e-10, "newton {newton}, {ranks} ranks: {apart}\n{deck}");
            assert!((energy(&said) / expected - 1.0).abs() < 1e-10, "{} {expected}", energy(&said));
            on_one[k] = said;
        }
    }
    on_one
}

/// The fix that integrates, in a deck that the program writes, takes the steps of the native runner.
pub fn splittings_are_the_native_ones(runs: &Runs) {
    for integrator in ["two-stage", "force-gradient", "aboba"] {
        let scene = format!(
            "title = \"steps\"\nmodel = \"{}\"\nkT = 1.0\nseed = 4\nprecision = \"double\"\n\
             [box]\nlengths = [5.0, 4.0, 4.0]\n[initial]\nkind = \"random\"\ndensity = 6.0\n\
             [[stage]]\nname = \"all\"\nsteps = 40\ndt = 0.005\nintegrator = \"{integrator}\"\n[output]\nthermo = 10\n",
            model().display()
        );
        compare_with_native(runs, &scene, &format!("dpd/splitting {integrator}"));
    }
}

/// Walls of matter that move, with drag and noise: planes, whose faces no atom reaches, as native runs bounce there on the exact path,
/// and a cylinder.
pub fn walls_are_the_native_ones(runs: &Runs) {
    let planes = "boundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\
        [[part]]\nshape = \"box\"\nlow = [0.0, 0.0, 0.5]\nhigh = [5.0, 4.0, 4.5]\ndensity = 6.0\n\
        [[wall]]\nfaces = [\"zlo\", \"zhi\"]\nvelocity = [0.5, 0.0, 0.0]\n";
    let cylinder = "[[part]]\nshape = \"rest\"\ndensity = 6.0\n\
        [[wall]]\nshape = \"cylinder\"\naxis = \"y\"\nradius = 2.0\nfluid = \"inside\"\nvelocity = [0.0, 0.5, 0.0]\n";
    let cases = [(planes, "dpd/wall zhi density 5.0"), (cylinder, "dpd/wall cylinder y 2.5 2.5 2.0 inside")];
    for (integrator, (wall, part)) in
        ["velocity-verlet", "two-stage"].into_iter().flat_map(|i| cases.map(|case| (i, case)))
    {
        let scene = format!(
            "title = \"walls\"\nmodel = \"{}\"\nkT = 1.0\nseed = 4\nprecision = \"double\"\n\
             [box]\nlengths = [5.0, 4.0, 5.0]\n{wall}kind = \"continuum\"\ndensity = 5.0\nviscosity = 7.8\n\
             [[stage]]\nname = \"all\"\nsteps = 15\ndt = 0.005\nintegrator = \"{integrator}\"\n[output]\nthermo = 5\n",
            model().display()
        );
        compare_with_native(runs, &scene, part);
    }
}

/// Runs a scene natively and exported, on one rank and on two: velocities at the end agree, and the deck contains a text.
fn compare_with_native(runs: &Runs, scene: &str, part: &str) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    for arguments in ["run scene.toml --out native", "export lammps scene.toml --out deck"] {
        let out = psidpd(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        assert!(out.status.success(), "{}", said(&out));
    }
    let deck = folder.path().join("deck");
    let script = std::fs::read_to_string(deck.join("in.lammps")).unwrap();
    assert!(script.contains(part), "{script}");
    // The host loads the styles in its own way.
    let script = script.replace("plugin        load ${plugin}\n", &runs.load);
    std::fs::write(deck.join("in.here"), script).unwrap();
    for ranks in [1, 2] {
        let run = runs.host.run_script(ranks, &deck, Path::new("in.here"), &[], LIMIT);
        run.unwrap_or_else(|e| panic!("{part}, {ranks} ranks: {e}"));
        let [own, theirs] = ["native", "deck"].map(|of| {
            let mut data = DataFile::read(&folder.path().join(of).join("final.data")).unwrap();
            data.sort_by_id();
            data.velocities.expect("velocities")
        });
        let apart = difference(&theirs, &own);
        assert!(apart < 1e-10, "{part}, {ranks} ranks: {apart:e}");
    }
}
