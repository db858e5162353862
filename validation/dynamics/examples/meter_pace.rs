//! Times what each observable of a scene costs a step that it samples, in steps of velocity Verlet of the same scene, on one thread: the
//! difference of medians, of means of two, as the thermostat may act in one of the two. So what one sample in eight does, the stretches of `surface_tension`, does not count; what momentum transport
//! and totals cost in that step does.
//!
//! `cargo run --release -p psidpd-dynamics --example meter_pace SCENE`

use psidpd_core::engine::{Precision, Settings, Want};
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::scene::Scene;
use psidpd_observe::{Observe, Observers, Recorded};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// The first samples, and those that are timed. Some of the first choose settings or look at the order of particles; few of the others
/// do so.
const FIRST: u64 = 17;
const TIMED: u64 = 30;

/// Steps without a sample, for each with one.
const PLAIN: u64 = 4;

fn median_of_means(times: &[f64]) -> f64 {
    let mut means: Vec<f64> = times.chunks_exact(2).map(|two| 0.5 * (two[0] + two[1])).collect();
    means.sort_by(f64::total_cmp);
    means[means.len() / 2]
}

fn main() -> Result<(), Box<dyn Error>> {
    psidpd_core::memory::keep_released();
    let scene = std::env::args().nth(1).ok_or("usage: meter_pace SCENE")?;
    let scene = Scene::open(Path::new(&scene))?;
    let (settle, stage) = (&scene.stages[0], scene.stages.last().ok_or("a scene without stages")?);
    let mut run = scene.simulation(scene.initial_state())?;
    run.set_settings(Settings { precision: Precision::Mixed, ..run.settings() })?;
    scene.enter(settle, &mut run)?;
    run.prepare_for(settle.integrator, settle.dt, Want::FORCES)?;
    run.advance(settle.steps, settle.dt, settle.integrator)?;
    scene.enter(stage, &mut run)?;
    let (dt, own, verlet) = (settle.dt, stage.integrator, Integrator::VelocityVerlet);
    println!(
        "observable: what it costs a step, in steps of velocity Verlet; nanoseconds of such a step for a particle"
    );
    for request in &scene.observe.requests {
        let observe = Observe { requests: vec![request.clone()] };
        let mut observers = Observers::new(&observe, [stage.name.as_str()]);
        let name = format!("{:?}", request.meter);
        // Steps with a sample, without, and of velocity Verlet.
        let mut times = [const { Vec::new() }; 3];
        for round in 1..=FIRST + TIMED {
            let mut spent = [0.0; 3];
            let step = round * request.every + request.skip;
            for (k, integrator) in [(0, own), (1, own), (2, verlet)] {
                run.prepare_for(integrator, dt, Want::FORCES)?;
                let begin = Instant::now();
                for _ in 0..if k == 0 { 0 } else { PLAIN } {
                    run.step(dt, integrator, Want::FORCES)?;
                }
                if k == 0 {
                    run.record_flux(observers.wants_flux(step, &stage.name));
                    run.ask_for_impulses(Some(observers.wants_pressure(step, &stage.name)));
                    run.step(dt, integrator, observers.wants(step, &stage.name))?;
                    if observers.wants_conservative_forces(step, &stage.name) {
                        run.find_conservative_forces()?;
                    }
                    let mut view = run.view(round as f64);
                    view.step = step;
                    observers.sample(view, &stage.name);
                }
                spent[k] = begin.elapsed().as_secs_f64() / if k == 0 { 1.0 } else { PLAIN as f64 };
                run.record_flux(Recorded::Nothing);
                run.ask_for_impulses(None);
            }
            if round > FIRST {
                times.iter_mut().zip(spent).for_each(|(times, spent)| times.push(spent));
            }
        }
        let [sampled, plain, unit] = times.each_ref().map(|times| median_of_means(times));
        let per_particle = unit * 1e9 / run.len() as f64;
        let name = name.split(['(', ' ']).next().unwrap_or_default();
        println!("{name:20} {:5.1}   {per_particle:.0}", (sampled - plain) / unit);
    }
    Ok(())
}
