use super::dump::write_frame;
use super::error::RunError;
use super::restart::write_data;
use super::simulation::Simulation;
use super::state::State;
use super::summary::{Means, Summary};
use super::thermo::{Thermo, ThermoFile};
use crate::observe::{Observers, write_csv, write_json};
use crate::scene::{Scene, Stage};
use psidpd_core::engine::Want;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Where a run is, after every step.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Name of the stage.
    pub stage: &'a str,
    /// Steps made, over all stages.
    pub step: u64,
    /// Steps to make, over all stages.
    pub steps: u64,
    /// The totals, on steps that have them.
    pub thermo: Option<&'a Thermo>,
}

/// Runs a scene and writes `thermo.csv`, `dump.lammpstrj`, `final.data` and `summary.json` to the
/// folder `out`, which is made if need be.
///
/// If the physics fails on the way, the last good state, that of the last thermo row (or of the start
/// of the stage), is written to `last-good.data`.
///
/// # Errors
/// [`RunError::Stopped`] if the physics fails; [`RunError::Output`] if a file cannot be written.
pub fn run_scene(scene: &Scene, out: &Path, progress: &mut dyn FnMut(Progress)) -> Result<Summary, RunError> {
    std::fs::create_dir_all(out).map_err(RunError::output(out))?;
    let state = scene.initial_state();
    let simulation = Simulation::new(&scene.model, scene.kt, state.clone(), scene.seed)?;
    let mut run = Run {
        scene,
        output: Output::create(scene, out)?,
        good: Good { step: 0, state },
        simulation,
        time: 0.0,
        steps: scene.stages.iter().map(|s| s.steps).sum(),
        rows: Vec::new(),
        last: None,
        observers: Observers::new(scene),
        progress,
    };
    let start = Instant::now();
    for stage in &scene.stages {
        run.stage(stage).map_err(|error| run.stop(stage, error))?;
    }
    run.finish(start.elapsed().as_secs_f64())
}

/// A run on its way.
struct Run<'a> {
    scene: &'a Scene,
    simulation: Simulation,
    output: Output,
    good: Good,
    time: f64,
    steps: u64,
    /// Thermo rows of the stage.
    rows: Vec<Thermo>,
    last: Option<Thermo>,
    observers: Observers,
    progress: &'a mut dyn FnMut(Progress),
}

/// A state to fall back to.
struct Good {
    step: u64,
    state: State,
}

impl Run<'_> {
    fn stage(&mut self, stage: &Stage) -> Result<(), RunError> {
        self.rows.clear();
        self.simulation.set_temperature(stage.kt)?;
        self.simulation.set_thermostat(stage.thermostat);
        self.simulation.prepare(stage.dt, Want::TOTALS)?;
        if self.simulation.step_number() == 0 {
            self.report(stage, true)?;
        }
        self.keep_state();
        let begin = self.time;
        for step in 1..=stage.steps {
            let number = self.simulation.step_number() + 1;
            let totals = self.is_row(number);
            let want = if totals { Want::TOTALS } else { self.observers.wants_in(number, &stage.name) };
            self.simulation.step(stage.dt, stage.integrator, want)?;
            self.time = begin + step as f64 * stage.dt;
            self.observers.sample(&self.simulation, &stage.name, self.time);
            self.report(stage, totals)?;
        }
        Ok(())
    }

    fn is_row(&self, step: u64) -> bool {
        every(self.scene.output.thermo, step) || step == self.steps
    }

    fn keep_state(&mut self) {
        self.good.step = self.simulation.step_number();
        self.simulation.copy_state(&mut self.good.state);
    }

    /// Writes what is due after a step.
    fn report(&mut self, stage: &Stage, totals: bool) -> Result<(), RunError> {
        let step = self.simulation.step_number();
        let thermo = totals.then(|| Thermo::of(&self.simulation, self.time));
        if let Some(thermo) = &thermo {
            self.last = Some(*thermo);
            if let Some(file) = &mut self.output.thermo {
                file.row(thermo)?;
                // The state a stage starts from is not of that stage.
                if step > 0 {
                    self.rows.push(*thermo);
                }
            }
            self.keep_state();
        }
        if every(self.scene.output.dump, step) {
            self.output.frame(&self.simulation)?;
        }
        (self.progress)(Progress { stage: &stage.name, step, steps: self.steps, thermo: thermo.as_ref() });
        Ok(())
    }

    /// `observables.json` and the tables in `observables/`, if the scene asks for any.
    fn write_observations(&self) -> Result<(), RunError> {
        let observations = self.observers.finish();
        if observations.is_empty() {
            return Ok(());
        }
        let (json, tables) =
            (self.output.folder.join("observables.json"), self.output.folder.join("observables"));
        write_json(&json, &observations).map_err(RunError::output(&json))?;
        write_csv(&tables, &observations).map_err(RunError::output(&tables))
    }

    /// Saves what is left of a run that failed.
    fn stop(&self, stage: &Stage, cause: RunError) -> RunError {
        if matches!(cause, RunError::Output { .. }) {
            return cause;
        }
        let saved = self.output.folder.join("last-good.data");
        let title = format!("psidpd: {}, step {}", self.scene.title, self.good.step);
        match write_data(&saved, &title, &self.good.state) {
            Ok(()) => RunError::Stopped {
                stage: stage.name.clone(),
                cause: Box::new(cause),
                good: self.good.step,
                saved,
            },
            // The physics failed first, and says more.
            Err(_) => cause,
        }
    }

    fn finish(mut self, wall_seconds: f64) -> Result<Summary, RunError> {
        self.output.flush()?;
        let title = format!("psidpd: {}, step {}", self.scene.title, self.simulation.step_number());
        write_data(&self.output.folder.join("final.data"), &title, &self.simulation.state())?;
        self.write_observations()?;
        let particles = self.simulation.len();
        let summary = Summary {
            title: self.scene.title.clone(),
            particles,
            steps: self.steps,
            wall_seconds,
            particle_steps_per_second: particles as f64 * self.steps as f64 / wall_seconds,
            out_of_bounds: self.simulation.out_of_bounds(),
            last: self.last.unwrap_or_else(|| Thermo::of(&self.simulation, self.time)),
            means: Means::of(&self.rows),
        };
        summary.write(&self.output.folder.join("summary.json"))?;
        Ok(summary)
    }
}

fn every(interval: u64, step: u64) -> bool {
    interval > 0 && step.is_multiple_of(interval)
}

/// The files of a run.
struct Output {
    folder: PathBuf,
    thermo: Option<ThermoFile>,
    dump: Option<(PathBuf, BufWriter<File>)>,
}

impl Output {
    fn create(scene: &Scene, folder: &Path) -> Result<Output, RunError> {
        // What an earlier run left at its end is not of this one.
        for name in ["final.data", "last-good.data", "summary.json", "observables.json"] {
            let path = folder.join(name);
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(RunError::output(&path)(error));
                }
                _ => {}
            }
        }
        let thermo = match scene.output.thermo {
            0 => None,
            _ => Some(ThermoFile::create(&folder.join("thermo.csv"))?),
        };
        let dump = match scene.output.dump {
            0 => None,
            _ => {
                let path = folder.join("dump.lammpstrj");
                let file = File::create(&path).map_err(RunError::output(&path))?;
                Some((path, BufWriter::new(file)))
            }
        };
        Ok(Output { folder: folder.to_owned(), thermo, dump })
    }

    fn frame(&mut self, simulation: &Simulation) -> Result<(), RunError> {
        match &mut self.dump {
            None => Ok(()),
            Some((path, file)) => write_frame(simulation, file).map_err(RunError::output(path)),
        }
    }

    fn flush(&mut self) -> Result<(), RunError> {
        match &mut self.dump {
            None => Ok(()),
            Some((path, file)) => file.flush().map_err(RunError::output(path)),
        }
    }
}
