//! One run of any code, as series of what is compared.

use super::Context;
use super::LOG;
use super::setup::Setup;
use crate::ExperimentError;
use crate::code::Host;
use crate::files;
use crate::start::simulation;
use psidpd_core::engine::Want;
use psidpd_dynamics::run::{Integrator, State};
use psidpd_formats::dump;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

#[derive(Debug, Clone, Copy)]
pub struct Length {
    pub dt: f64,
    pub steps: u64,
    /// Steps between samples of temperature, energy and pressure.
    pub sample: u64,
    /// Whether a sample is the mean over these steps, which has less of the random force in it.
    pub averaged: bool,
    /// Steps between frames of positions; 0 for none.
    pub frame: u64,
}

/// Series of a run, sampled every [`Length::sample`] steps, from step 0 unless averaged.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    pub time: Vec<f64>,
    pub temperature: Vec<f64>,
    pub kinetic: Vec<f64>,
    /// Potential energy, as the code reports it.
    pub potential: Vec<f64>,
    /// Pressure tensor xx, yy, zz, xy, xz, yz.
    pub pressure: [Vec<f64>; 6],
    /// The pressure tensor without drag and noise; of the native runner alone.
    pub conservative: [Vec<f64>; 6],
    /// z of every particle, for each frame.
    pub frames: Vec<Vec<f64>>,
    pub particles: usize,
}

impl Trace {
    /// Time, temperature, kinetic and potential energy, pressure tensor, and perhaps that of conservative forces.
    fn push(&mut self, sample: &[f64]) {
        let Trace { time, temperature, kinetic, potential, pressure, conservative, .. } = self;
        let first = [time, temperature, kinetic, potential];
        let series = first.into_iter().chain(pressure).chain(conservative);
        series.zip(sample).for_each(|(series, x)| series.push(*x));
    }

    /// A third of the trace of the pressure tensor.
    pub fn scalar_pressure(&self) -> Vec<f64> {
        let [xx, yy, zz, ..] = &self.pressure;
        (0..xx.len()).map(|k| (xx[k] + yy[k] + zz[k]) / 3.0).collect()
    }

    pub fn energy_per_particle(&self) -> Vec<f64> {
        self.kinetic.iter().zip(&self.potential).map(|(k, u)| (k + u) / self.particles as f64).collect()
    }
}

/// Runs one code from `state`. `advance` is called with steps made.
pub fn run(
    context: &Context,
    setup: &Setup,
    state: &State,
    length: Length,
    name: &str,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Trace, ExperimentError> {
    if setup.code.host() == Host::Native {
        native(setup, state, length, advance)
    } else {
        lammps(context, setup, state, length, &context.work.join(name), advance)
    }
}

/// A run of the native runner.
pub(super) fn native(
    setup: &Setup,
    state: &State,
    length: Length,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Trace, ExperimentError> {
    let model = setup.set.model(setup.law, setup.gamma)?;
    let mut simulation = simulation(&model, 1.0, state, setup.seed, setup.precision)?;
    let mut trace = Trace { particles: state.len(), ..Trace::default() };
    simulation.prepare(length.dt, Want::TOTALS)?;
    let (mut sum, mut count) = ([0.0; 16], 0.0);
    for step in 0..=length.steps {
        let due = step % length.sample == 0;
        let taken = due || length.averaged;
        if step > 0 {
            let want = if taken { Want::TOTALS } else { Want::FORCES };
            simulation.step(length.dt, Integrator::VelocityVerlet, want)?;
        }
        if taken && (step > 0 || !length.averaged) {
            let scalars =
                [simulation.temperature(), simulation.kinetic_energy(), simulation.potential_energy()];
            let tensors = [simulation.pressure_tensor(), simulation.conservative_pressure_tensor()];
            let values = scalars.iter().chain(tensors.as_flattened());
            sum[1..].iter_mut().zip(values).for_each(|(sum, x)| *sum += x);
            count += 1.0;
        }
        if due && count > 0.0 {
            let mut sample = sum.map(|sum| sum / count);
            sample[0] = step as f64 * length.dt;
            trace.push(&sample);
            (sum, count) = ([0.0; 16], 0.0);
            advance(step);
        }
        if length.frame > 0 && step % length.frame == 0 {
            trace.frames.push(simulation.state().x.iter().map(|x| x[2]).collect());
        }
    }
    Ok(trace)
}

/// LAMMPS's own `fix nve` and output around the pair style.
fn lammps(
    context: &Context,
    setup: &Setup,
    state: &State,
    length: Length,
    folder: &Path,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Trace, ExperimentError> {
    let mut deck = setup.prepare(context, state, folder, false)?;
    deck.push_str(&format!(
        "fix move all nve\ntimestep {}\nthermo_modify norm no\nvariable kinetic equal ke\n\
         variable potential equal pe\nfix series all ave/time {} {s} c_thermo_temp v_kinetic v_potential \
         c_thermo_press[1] c_thermo_press[2] c_thermo_press[3] c_thermo_press[4] c_thermo_press[5] \
         c_thermo_press[6] file series.txt format \" %.16g\"\n",
        length.dt,
        if length.averaged { format!("1 {}", length.sample) } else { format!("{} 1", length.sample) },
        s = length.sample,
    ));
    if length.frame > 0 {
        deck.push_str(&format!(
            "dump frames all custom {} frames.txt id z\ndump_modify frames format float %.10g\n",
            length.frame
        ));
    }
    deck.push_str(&format!("thermo {}\nrun {}\n", length.steps, length.steps));
    let limit = Duration::from_secs(if context.full { 6 * 3600 } else { 1200 });
    let over = AtomicBool::new(false);
    let series = folder.join("series.txt");
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !over.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(200));
                if let Some(step) = last_step(&series) {
                    advance(step);
                }
            }
        });
        let done = context.lammps.run(1, folder, &deck, LOG, limit);
        over.store(true, Ordering::Relaxed);
        done
    })?;
    let mut trace = Trace { particles: state.len(), ..Trace::default() };
    read_series(&series, length, &mut trace)?;
    if length.frame > 0 {
        let path = folder.join("frames.txt");
        for frame in dump::read(&path)? {
            let missing = || ExperimentError::at(&path)("a frame has no column z");
            trace.frames.push(frame.get("z").ok_or_else(missing)?);
        }
    }
    Ok(trace)
}

/// The step of the last whole line of that file.
fn last_step(path: &Path) -> Option<u64> {
    const ENOUGH: u64 = 1000;
    let mut file = std::fs::File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(ENOUGH))).ok()?;
    let mut text = String::new();
    file.read_to_string(&mut text).ok()?;
    text.rsplit('\n').nth(1)?.split_whitespace().next()?.parse().ok()
}

/// The file of `fix ave/time`: comments, then step and nine numbers.
fn read_series(path: &Path, length: Length, trace: &mut Trace) -> Result<(), ExperimentError> {
    for numbers in files::rows(path)? {
        let found = numbers.len();
        let wrong = |_| ExperimentError::at(path)(format!("a row has {found} numbers, expected 10"));
        let mut sample = <[f64; 10]>::try_from(numbers).map_err(wrong)?;
        sample[0] *= length.dt;
        trace.push(&sample);
    }
    let expected = (length.steps / length.sample) as usize + usize::from(!length.averaged);
    if trace.time.len() != expected {
        let problem = format!("{} samples, expected {expected}", trace.time.len());
        return Err(ExperimentError::at(path)(problem));
    }
    Ok(())
}
