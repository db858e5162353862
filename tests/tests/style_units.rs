//! One fluid in several units of LAMMPS.

mod style_common;

use psidpd_core::maximum::largest;
use std::fmt::Write;
use style_common::*;

/// Units of the model in SI.
const LENGTH: f64 = 7.11e-10;
const MASS: f64 = 1.5e-25;
const ENERGY: f64 = 4.11e-21;

/// Units of LAMMPS in SI, and its Boltzmann constant.
struct Units {
    name: &'static str,
    length: f64,
    mass: f64,
    energy: f64,
    time: f64,
    pressure: f64,
    boltzmann: f64,
}

/// Fixes that integrate, with drag and noise among the forces and apart from them.
const FIXES: [&str; 2] = ["nve", "dpd/splitting force-gradient"];

const AVOGADRO: f64 = 6.022_140_76e23;

const ALL: [Units; 4] = [
    Units {
        name: "lj",
        length: LENGTH,
        mass: MASS,
        energy: ENERGY,
        time: f64::NAN,
        pressure: ENERGY / (LENGTH * LENGTH * LENGTH),
        boltzmann: 1.0,
    },
    Units {
        name: "real",
        length: 1e-10,
        mass: 1e-3 / AVOGADRO,
        energy: 4184.0 / AVOGADRO,
        time: 1e-15,
        pressure: 101_325.0,
        boltzmann: 0.001_987_206_7,
    },
    Units {
        name: "metal",
        length: 1e-10,
        mass: 1e-3 / AVOGADRO,
        energy: 1.602_176_634e-19,
        time: 1e-12,
        pressure: 1e5,
        boltzmann: 8.617_343e-5,
    },
    Units {
        name: "si",
        length: 1.0,
        mass: 1.0,
        energy: 1.0,
        time: 1.0,
        pressure: 1.0,
        boltzmann: 1.380_650_4e-23,
    },
];

impl Units {
    /// The model's units of length, energy and time in units of LAMMPS.
    fn of_model(&self) -> [f64; 3] {
        let time = LENGTH * (MASS / ENERGY).sqrt();
        let here = if self.name == "lj" { time } else { self.time };
        [LENGTH / self.length, ENERGY / self.energy, time / here]
    }
}

/// A data file of 500 moving particles in a box of 5 × 5 × 5.
fn data(units: &Units) -> String {
    let [length, _, time] = units.of_model();
    let mut word = 4711u64;
    let mut uniform = || {
        word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (word >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut atoms, mut velocities) = (String::new(), String::new());
    for id in 1..=500 {
        let kind = 1 + id % 2;
        let mut three = |scale: f64, shift: f64| {
            let [x, y, z] = [(); 3].map(|()| scale * (uniform() - shift));
            format!("{x:.17e} {y:.17e} {z:.17e}")
        };
        writeln!(atoms, "{id} {kind} {}", three(5.0 * length, 0.0)).unwrap();
        writeln!(velocities, "{id} {}", three(3.0 * length / time, 0.5)).unwrap();
    }
    let (high, mass) = (5.0 * length, MASS / units.mass);
    format!(
        "fluid\n\n500 atoms\n2 atom types\n\n0 {high:.17e} xlo xhi\n0 {high:.17e} ylo yhi\n0 {high:.17e} zlo zhi\n\n\
         Masses\n\n1 {mass:.17e}\n2 {mass:.17e}\n\nAtoms # atomic\n\n{atoms}\nVelocities\n\n{velocities}"
    )
}

/// Positions and velocities after some steps; energy, pressure, energies of atoms and the mean density, in
/// units of the model, with what presses on a wall `w`; and the log.
fn outcome(units: &Units, style: &str, fix: &str, ranks: usize) -> (Frame, Vec<f64>, String) {
    let [length, energy, time] = units.of_model();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("fluid.data"), data(units)).unwrap();
    let name = style.split("pair_style ").nth(1).unwrap().split_whitespace().next().unwrap();
    let on_wall = if style.contains("fix w ") { " $(f_w[1]:%.17g)" } else { "" };
    let script = format!(
        "units {}\natom_style atomic\natom_modify map yes\ncomm_modify vel yes\nneighbor {:.17e} bin\n\
         read_data fluid.data\n{}{style}fix 1 all {fix}\ntimestep {:.17e}\nfix n all pair 1 {name} density 0\n\
         compute n all reduce ave f_n[1]\ncompute e all pe/atom pair\ncompute s all reduce sum c_e\n\
         thermo_style custom step pe press c_s c_n\nthermo_modify norm no\nrun 20\n\
         print \"$(pe:%.17g) $(press:%.17g) $(c_s:%.17g) $(c_n:%.17g){on_wall}\" file totals\n",
        units.name,
        0.3 * length,
        load(),
        DT * time,
    );
    let mut frame = run_in(folder.path(), &script, ranks);
    let scale = |of: &mut Vec<[f64; 3]>, by: f64| of.as_flattened_mut().iter_mut().for_each(|x| *x /= by);
    scale(&mut frame.x, length);
    scale(&mut frame.v, length / time);
    scale(&mut frame.f, energy / length);
    let totals = std::fs::read_to_string(folder.path().join("totals")).unwrap();
    let totals = totals.split_whitespace().map(|t| t.parse::<f64>().unwrap());
    let pressure = ENERGY / LENGTH.powi(3) / units.pressure;
    let here = [energy, pressure, energy, length.powi(-3), energy / length];
    let log = std::fs::read_to_string(folder.path().join("log.lammps")).unwrap();
    (frame, totals.zip(here).map(|(t, unit)| t / unit).collect(), log)
}

/// Compares to six digits, the precision of LAMMPS's constants.
fn agree(found: &(Frame, Vec<f64>, String), expected: &(Frame, Vec<f64>, String), what: &str) {
    let apart = [
        difference(&found.0.x, &expected.0.x),
        difference(&found.0.v, &expected.0.v),
        difference(&found.0.f, &expected.0.f),
    ];
    assert!(largest(apart) < 1e-5, "{what}: {apart:?}");
    for (a, b) in found.1.iter().zip(&expected.1) {
        assert!((a / b - 1.0).abs() < 1e-5, "{what}: {:?} {:?}", found.1, expected.1);
    }
}

/// A model that states its units gives the same results in each of LAMMPS's units as in its own: forces, drag
/// and noise, energies, pressure, densities, and values of single atoms.
#[test]
fn a_model_moves_the_same_in_all_units() {
    let (_folder, model) =
        file(&format!("{WIDE}[units]\nlength = {LENGTH:e}\nmass = {MASS:e}\nenergy = {ENERGY:e}\n"));
    let style = |units: &Units| {
        let temperature = units.of_model()[1] / units.boltzmann;
        format!("pair_style dpd/psi {temperature:.17e} {SEED}\npair_coeff * * \"{model}\" A B\n")
    };
    for fix in FIXES {
        let expected = outcome(&ALL[0], &style(&ALL[0]), fix, 1);
        assert!(!expected.2.contains("  units         the model's"), "{}", expected.2);
        for units in &ALL[1..] {
            for ranks in [1, 2] {
                let found = outcome(units, &style(units), fix, ranks);
                agree(&found, &expected, &format!("{}, {fix}, {ranks} ranks", units.name));
                assert!(found.2.contains("  units         the model's"), "{}", found.2);
            }
        }
    }
}

/// Coefficients are in the units of the simulation, as those of LAMMPS's own styles.
#[test]
fn coefficients_are_in_the_units_of_the_simulation() {
    let style = |units: &Units| {
        let [length, energy, time] = units.of_model();
        let (kt, force) = (energy / units.boltzmann, energy / length);
        let volume = length.powi(3);
        format!(
            "pair_style mdpd/psi {kt:.17e} {length:.17e} {SEED}\npair_coeff * * {:.17e} {:.17e} {:.17e} {:.17e} {:.17e}\n",
            -40.0 * force,
            25.0 * force * volume,
            18.0 * force * time / length,
            length,
            0.75 * length
        )
    };
    for fix in FIXES {
        let expected = outcome(&ALL[0], &style(&ALL[0]), fix, 1);
        for units in &ALL[1..3] {
            agree(&outcome(units, &style(units), fix, 2), &expected, &format!("{}, {fix}", units.name));
        }
    }
}

/// So are walls of matter: densities, velocity, drag and viscosity are converted.
#[test]
fn walls_are_the_same_in_all_units() {
    let (_folder, model) =
        file(&format!("{WIDE}[units]\nlength = {LENGTH:e}\nmass = {MASS:e}\nenergy = {ENERGY:e}\n"));
    let style = |units: &Units| {
        let [length, energy, time] = units.of_model();
        let (volume, velocity) = (length.powi(3), length / time);
        let (kt, drag, eta) = (energy / units.boltzmann, energy / length / velocity, energy * time / volume);
        format!(
            "change_box all boundary p p f\npair_style dpd/psi {kt:.17e} {SEED}\npair_coeff * * \"{model}\" A B\n\
             fix lo all dpd/wall zlo density {:.17e} type 2 local/density {:.17e} viscosity {:.17e} fluid/density {:.17e}\n\
             fix hi all dpd/wall zhi density {:.17e} species A velocity {:.17e} 0 0 drag {:.17e} drag/range {:.17e}\n\
             fix_modify lo energy yes virial yes\nfix_modify hi energy yes virial yes\n\
             fix r all wall/reflect zlo EDGE zhi EDGE\n",
            4.0 / volume,
            3.0 / volume,
            0.9 * eta,
            2.0 / volume,
            3.0 / volume,
            0.7 * velocity,
            30.0 * drag,
            0.8 * length
        )
    };
    for fix in FIXES {
        let expected = outcome(&ALL[0], &style(&ALL[0]), fix, 1);
        for units in &ALL[1..] {
            agree(&outcome(units, &style(units), fix, 2), &expected, &format!("{}, {fix}", units.name));
        }
    }
}

/// And so are round walls, which reflect atoms.
#[test]
fn round_walls_are_the_same_in_all_units() {
    let (_folder, model) =
        file(&format!("{WIDE}[units]\nlength = {LENGTH:e}\nmass = {MASS:e}\nenergy = {ENERGY:e}\n"));
    let style = |units: &Units| {
        let [length, energy, time] = units.of_model();
        let (kt, drag) = (energy / units.boltzmann, energy * time / length.powi(2));
        let place = format!("cylinder y {:.17e} {:.17e} {:.17e}", 2.4 * length, 2.5 * length, 1.9 * length);
        format!(
            "region m {place} EDGE EDGE side out\ndelete_atoms region m compress no\n\
             pair_style dpd/psi {kt:.17e} {SEED}\npair_coeff * * \"{model}\" A B\n\
             fix w all dpd/wall {place} inside density {:.17e} type 2 velocity 0 {:.17e} 0 drag {:.17e}\n\
             fix_modify w energy yes virial yes\n",
            4.0 / length.powi(3),
            0.7 * length / time,
            30.0 * drag,
        )
    };
    for fix in FIXES {
        let expected = outcome(&ALL[0], &style(&ALL[0]), fix, 1);
        for units in &ALL[1..] {
            agree(&outcome(units, &style(units), fix, 2), &expected, &format!("{}, {fix}", units.name));
        }
    }
}

/// Models without units, and units that the styles do not support, are refused.
#[test]
fn other_units_are_refused() {
    let model = warren();
    let temperature = "pair_style dpd/psi 300 5\npair_coeff * * \"{model}\" F F";
    let style = temperature.replace("{model}", &model);
    for (units, style, why) in [
        (
            "real",
            style.as_str(),
            "'units real' needs a model that says what its numbers stand for: add a table [units]",
        ),
        ("cgs", style.as_str(), "a model works in units lj, real, metal and si, found 'units cgs'"),
        (
            "si",
            "pair_style mdpd/psi 300 1 5\npair_coeff * * 1 1 1 1 1",
            "works in units lj, real and metal, found 'units si'",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("in.lammps");
        let text = format!(
            "units {units}\natom_style atomic\ncomm_modify vel yes\nregion b block 0 30 0 30 0 30\ncreate_box 2 b\n\
             create_atoms 1 single 1 1 1\nmass * 1\n{}{style}\nfix 1 all nve\nrun 0\n",
            load()
        );
        std::fs::write(&path, text).unwrap();
        let error = psidpd_tests::lammps().0.run_script(1, folder.path(), &path, &[], LIMIT).unwrap_err();
        assert!(error.to_string().contains(why), "{error}");
    }
}
