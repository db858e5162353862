//! A setting as the lines that a user writes.

use super::origin::Origin;
use super::setting::{Physics, Setting};
use psidpd_core::engine::noise::Law;
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::scene::{Scene, Stage};
use psidpd_lammps_host::LammpsError;
use psidpd_lammps_host::export::lammps::{self as deck, Script};
use std::fmt::Write;

pub fn scene_lines(dt: f64, setting: &Setting) -> String {
    let Physics { mut integrator, precision, .. } = setting.physics;
    let mut s = format!("dt = {}\nintegrator = \"{}\"\n", dt, integrator.name());
    // Writing to a String cannot fail.
    if let Some((lambda, _)) = integrator.settings().lambda {
        let _ = writeln!(s, "lambda = {lambda}");
    }
    if let Some(gradient) = integrator.settings().gradient {
        let _ = writeln!(s, "gradient = {gradient}");
    }
    if let Some(coupling) = integrator.settings().coupling {
        let _ = writeln!(s, "thermostat_step = \"{}\"", coupling.name());
        if coupling.every > 1 {
            let _ = writeln!(s, "thermostat_every = {}", coupling.every);
        }
    }
    if let Some(Law::Uniform) = integrator.noise() {
        s += "noise = \"uniform\"\n";
    }
    let _ = writeln!(s, "precision = \"{precision}\"");
    if setting.threads.get() > 1 {
        let _ = writeln!(s, "# run with --threads {}", setting.threads);
    }
    s
}

/// The scene with one stage: a setting, for so many steps.
pub fn scene_of(origin: &Origin, physics: &Physics, steps: &[u64]) -> Scene {
    let mut scene = origin.scene.clone();
    scene.precision = Some(physics.precision);
    let stage = |steps: &u64| Stage {
        steps: *steps,
        dt: origin.dt(physics),
        integrator: physics.integrator,
        ..origin.stage.clone()
    };
    scene.stages = steps.iter().map(stage).collect();
    scene.output.thermo = 0;
    scene.output.dump = 0;
    scene
}

/// The lines of a LAMMPS script that make the same steps.
pub fn lammps_lines(origin: &Origin, physics: &Physics) -> Result<String, LammpsError> {
    let script = deck::script_of(&scene_of(origin, physics, &[origin.stage.steps]), Script::default())?;
    let wanted = ["comm_modify", "pair_style", "pair_coeff", "fix ", "fix_modify", "timestep", "run_style"];
    let lines = script.lines().filter(|line| wanted.iter().any(|word| line.starts_with(word)));
    Ok(lines.fold(String::new(), |all, line| all + line + "\n"))
}

pub fn in_lammps(origin: &Origin, physics: &Physics) -> bool {
    lammps_lines(origin, physics).is_ok()
}

/// The name of an integrator, without what every one of them has.
pub fn short(integrator: &Integrator) -> String {
    integrator.to_string().replace(", thermostat_step = midpoint", "")
}
