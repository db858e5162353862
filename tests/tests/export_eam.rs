//! Tables for LAMMPS's `eam/alloy`, written from a model, agree with the plugin's `dpd/psi` and the same
//! model: the test compares one configuration in one LAMMPS.

use psidpd::export::eam::{Grid, write};
use psidpd::formats::files::Existing;
use psidpd::lammps::Lammps;
use psidpd::lammps::LammpsError;
use psidpd_core::maximum::largest;
use psidpd_core::model::{Fluid, Model};
use psidpd_tests::{lammps, root};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// LAMMPS keeps the styles of loaded plugins for the whole process: closing one instance removes them from all.
static ALONE: Mutex<()> = Mutex::new(());

fn text(name: &str) -> String {
    std::fs::read_to_string(root().join(format!("validation/models/{name}.toml"))).unwrap()
}

/// Drops the lines that start with `key`.
fn without(text: &str, key: &str) -> String {
    text.lines().filter(|line| !line.starts_with(key)).map(|line| format!("{line}\n")).collect()
}

fn fluid(text: &str, kt: f64) -> Fluid {
    Model::parse("model.toml", text).unwrap_or_else(|e| panic!("{e}\n{text}")).at(kt).unwrap()
}

/// The energy, and the forces by atom.
fn point(lammps: &Lammps) -> (f64, Vec<f64>) {
    lammps.command("run 0 post no").unwrap();
    (lammps.thermo("pe").unwrap(), lammps.gather("f", 3).unwrap())
}

/// Equilibrates a fluid with the thermostat of `text`, and then compares both styles without it.
fn compare(text: &str, kt: f64, density: f64, grid: Grid) {
    let fluid = fluid(text, kt);
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(place("warm.toml"), text).unwrap();
    let cold = text.split("[[thermostat]]").next().unwrap();
    std::fs::write(place("cold.toml"), cold).unwrap();
    let masses = vec![1.0; fluid.species.len()];
    write(&fluid, &masses, grid, Path::new(&place("fluid.eam.alloy")), Existing::Keep).unwrap();

    let (host, plugin) = lammps();
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let l = Lammps::open(host, &[]).unwrap();
    let types = fluid.species.len();
    let names = fluid.species.join(" ");
    let count = (density * 5.0f64.powi(3)).round() as usize / types;
    let atoms: String =
        (1..=types).map(|k| format!("create_atoms {k} random {count} {} NULL\n", 100 + k)).collect();
    l.commands(&format!(
        "units lj\natom_style atomic\natom_modify map array\ncomm_modify vel yes\nregion b block 0 5 0 5 0 5\n\
         create_box {types} b\n{atoms}mass * 1.0\nvelocity all create {kt} 87 loop geom\n\
         neighbor 0.3 bin\nneigh_modify delay 0 every 1 check yes\nthermo_modify norm no\n\
         plugin load \"{}\"\npair_style dpd/psi {kt} 5\npair_coeff * * \"{}\" {names}\n\
         fix move all nve\ntimestep 0.002\nrun 300 post no\n",
        plugin.display(),
        place("warm.toml"),
    ))
    .unwrap();
    l.commands(&format!("pair_style dpd/psi {kt} 5\npair_coeff * * \"{}\" {names}\n", place("cold.toml")))
        .unwrap();
    let (energy, forces) = point(&l);
    l.commands(&format!("pair_style eam/alloy\npair_coeff * * \"{}\" {names}\n", place("fluid.eam.alloy")))
        .unwrap();
    let (tabulated, tabulated_forces) = point(&l);

    assert_eq!(forces.len(), 3 * count * types);
    let rms = (forces.iter().map(|f| f * f).sum::<f64>() / (count * types) as f64).sqrt();
    let worst = largest(forces.iter().zip(&tabulated_forces).map(|(a, b)| (a - b).abs()));
    println!("{}: force {:.1e}, energy {energy} {tabulated}", fluid.title, worst / rms);
    assert!(rms > 1.0 && worst < 1e-6 * rms, "{}: {worst} of {rms}", fluid.title);
    let scale = energy.abs().max((count * types) as f64);
    assert!((energy - tabulated).abs() < 1e-6 * scale, "{}: {energy} {tabulated}", fluid.title);
}

#[test]
fn van_der_waals_below_its_pole() {
    let grid = Grid { spacing: 1e-6, largest_density: 19.5, densities: 40_001 };
    compare(&without(&text("van-der-waals-3d"), "bounds"), 2.5, 8.0, grid);
}

#[test]
fn power_law() {
    let grid = Grid { spacing: 1e-6, largest_density: 40.0, densities: 20_001 };
    compare(&text("power-law-k3"), 1.0, 4.0, grid);
}

#[test]
fn two_species_that_feel_the_total_density() {
    let pair = |a: &str, b: &str, strength: f64| {
        format!(
            "[[pair]]\nbetween = [\"{a}\", \"{b}\"]\nform = \"soft\"\nstrength = {strength:?}\nrange = 1.0\n"
        )
    };
    let text = format!(
        "title = \"two species\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"wendland-c2\"\nrange = 1.0\n\
         [excess_free_energy]\nA = \"0.3*n^2 + kT*ln(1 + n)\"\nB = \"2*sqrt(1 + n^2) - exp(-0.2*n)\"\n{}{}{}\
         [[thermostat]]\ngamma = 4.5\nrange = 1.0\n",
        pair("A", "A", 10.0),
        pair("A", "B", 15.0),
        pair("B", "B", 5.0)
    );
    let grid = Grid { spacing: 2e-6, largest_density: 40.0, densities: 20_001 };
    compare(&text, 1.0, 5.0, grid);
}

/// The export refuses models that a table of one density cannot represent.
#[test]
fn fluids_beyond_a_table_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |text: &str, kt: f64| {
        let fluid = fluid(text, kt);
        let masses = vec![1.0; fluid.species.len()];
        write(&fluid, &masses, Grid::default(), &folder.path().join("fluid"), Existing::Keep).unwrap_err()
    };
    assert!(matches!(refusal(&text("van-der-waals-2d"), 1.0), LammpsError::Flat));
    assert!(matches!(refusal(&text("van-der-waals-3d"), 2.5), LammpsError::Bounds(_)));
    let pole = without(&text("van-der-waals-3d"), "bounds");
    assert!(matches!(refusal(&pole, 2.5), LammpsError::Singular { .. }));
    assert!(matches!(refusal(&text("lennard-jones"), 1.0), LammpsError::Bounds(_)));
    assert!(matches!(refusal(&text("power-law-k3-corrected"), 1.0), LammpsError::Correction(_)));
    let partial = without(&text("huggins"), "correction");
    assert!(matches!(refusal(&partial, 1.0), LammpsError::PartialDensities { .. }));
}
