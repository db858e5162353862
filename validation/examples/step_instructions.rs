//! Makes steps of the native runner a given number of times, for counting the instructions of what it does
//! around the forces: one thread, the same start every time.
//!
//! ```text
//! valgrind --tool=callgrind --callgrind-out-file=steps.out target/release/examples/step_instructions 6050 40 [INTEGRATOR]
//! callgrind_annotate --inclusive=yes steps.out | grep -E 'Simulation::step|Sweep::evaluate'
//! ```
//!
//! What `Simulation::step` includes without `Sweep::evaluate` is the runner's own.

use psidpd::run::Integrator;
use psidpd::scene::Scene;
use psidpd_core::engine::{Instructions, Precision, Settings, Want};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (particles, steps, integrator) = match &arguments[..] {
        [particles, steps] => (particles, steps, "velocity-verlet"),
        [particles, steps, integrator] => (particles, steps, &integrator[..]),
        _ => return Err("usage: step_instructions PARTICLES STEPS [INTEGRATOR]".into()),
    };
    let (particles, steps): (u64, u64) = (particles.parse()?, steps.parse()?);
    let known = Integrator::ALL.iter().find(|(name, _)| *name == integrator);
    let integrator = known.ok_or("no such integrator")?.1;
    let length = (particles as f64 / 6.05).cbrt();
    let text = format!(
        "model = \"warren2003-set6.toml\"\nkT = 1.0\nbox = [{length}, {length}, {length}]\ndensity = 6.05\nsteps = 1\n"
    );
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let scene = Scene::parse("scene.toml", &text, &models)?;
    let mut run = scene.simulation(scene.initial_state())?;
    // What valgrind knows, if it is there.
    let instructions =
        if Instructions::Avx2.available() { Instructions::Avx2 } else { Instructions::Portable };
    run.set_settings(Settings { precision: Precision::Mixed, instructions, ..run.settings() })?;
    run.set_reordering(true);
    run.prepare(0.01, Want::FORCES)?;
    for _ in 0..steps {
        run.step(0.01, integrator, Want::FORCES)?;
    }
    println!("{} particles, kT = {}", run.len(), run.temperature());
    Ok(())
}
