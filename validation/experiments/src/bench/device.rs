//! The speed of a GPU: particle-steps per second at several sizes, and where the time goes by the clock of the device.

use super::contender::FEW_ABOVE;
use super::length::{CYCLE, Length};
use super::native;
use super::spread::Spread;
use crate::ExperimentError;
use crate::fluids::{SIZES, SUBJECTS, Subject};
use crate::start::{self, SEED};
use psidpd_core::engine::{Instructions, PeriodicBox, Settings, Want};
use psidpd_dynamics::device::{Device, Found, gpus};
use psidpd_dynamics::run::{RunError, Simulation, State};
use psidpd_gpu::{GpuError, Rule};
use psidpd_report::{Progress, Table};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Steps before the clock starts, and steps whose kernels are timed one by one.
const WARM_UP: u64 = 5;
const TIMED: u64 = 10;

#[derive(Debug, Clone)]
pub struct Options<'a> {
    pub device: Device,
    pub sizes: &'a [usize],
    pub rounds: usize,
    pub seconds: f64,
    pub out: &'a Path,
}

#[derive(Debug, Clone, Serialize)]
pub struct Speed {
    pub fluid: &'static str,
    pub particles: usize,
    pub steps: u64,
    pub particle_steps_per_second: Spread,
    pub bytes_per_particle: f64,
    /// Nanoseconds of each kernel per particle and step, by timestamps; empty for a device without them.
    pub kernels: BTreeMap<String, f64>,
    /// The speed of one thread of the CPU with portable instructions, in the same state; `None` above [`FEW_ABOVE`] particles.
    pub portable_cpu: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    pub device: Found,
    pub speeds: Vec<Speed>,
}

pub fn run(options: &Options, progress: &Progress) -> Result<Outcome, ExperimentError> {
    let name = options.device.to_string();
    let found = gpus().map_err(RunError::from)?.into_iter().find(|found| found.device == name);
    let mut speeds = Vec::new();
    for &size in options.sizes {
        for subject in &SUBJECTS {
            let name = format!("{}, {size}", subject.name);
            speeds.push(progress.spinner(&name, || speed(options, subject, size))?);
        }
    }
    match found {
        Some(device) => Ok(Outcome { device, speeds }),
        // The runs would have failed first.
        None => Err(RunError::from(psidpd_dynamics::device::DeviceError::NotFound).into()),
    }
}

fn speed(options: &Options, subject: &Subject, size: usize) -> Result<Speed, ExperimentError> {
    let small = start::kept(subject, SIZES[0].min(size), &options.out.join("starts"))?.state;
    let state = repeated(&small, ((size as f64 / SIZES[0] as f64).cbrt().round() as usize).max(1))?;
    let count = state.len() as f64;
    let mut simulation = Simulation::new(&subject.model()?, 1.0, state.clone(), SEED)?;
    simulation.use_device(options.device)?;
    simulation.prepare(subject.dt, Want::FORCES)?;
    simulation.advance(WARM_UP, subject.dt, Default::default())?;
    let failed = |error: GpuError| ExperimentError::from(RunError::Device(error.into()));
    let Some(gpu) = simulation.gpu() else { return Err(failed(GpuError::NoDevice)) };
    // Totals come back at the end, so that the device has made all steps when the clock stops.
    let mut time = |steps: u64| -> Result<f64, GpuError> {
        let start = Instant::now();
        gpu.advance(steps, subject.dt, Rule::VelocityVerlet, true)?;
        gpu.totals()?;
        Ok(start.elapsed().as_secs_f64())
    };
    let first = time(TIMED).map_err(failed)? / TIMED as f64;
    let steps = ((options.seconds / first.max(1e-9)) as u64).clamp(TIMED, 100_000);
    let rates = (0..options.rounds).map(|_| Ok(count * steps as f64 / time(steps)?));
    let rates: Vec<f64> = rates.collect::<Result<_, GpuError>>().map_err(failed)?;
    let mut kernels = BTreeMap::new();
    if gpu.measure_time(true).is_ok() {
        gpu.advance(TIMED, subject.dt, Rule::VelocityVerlet, false).map_err(failed)?;
        let per_step = 1e9 / (count * TIMED as f64);
        kernels.extend(gpu.timings().into_iter().map(|t| (t.kernel, t.seconds * per_step)));
    }
    let settings = Settings { instructions: Instructions::Portable, ..Settings::default() };
    let length = Length { warm_up: 1, steps: CYCLE };
    let cpu = (state.len() <= FEW_ABOVE)
        .then(|| native::run(subject, &state, Some(settings), length))
        .transpose()?;
    Ok(Speed {
        fluid: subject.name,
        particles: state.len(),
        steps,
        particle_steps_per_second: Spread::of(&rates).unwrap_or_default(),
        bytes_per_particle: gpu.memory_bytes() as f64 / count,
        kernels,
        portable_cpu: cpu.map(|cpu| count * cpu.steps as f64 / cpu.seconds),
    })
}

/// A cube repeated `times` along each direction: large sizes need no equilibration of their own.
fn repeated(small: &State, times: usize) -> Result<State, ExperimentError> {
    let lengths = small.domain.lengths();
    let wide = lengths.map(|l| l * times as f64);
    let domain = PeriodicBox::orthogonal(small.domain.origin(), wide, [true; 3])
        .map_err(|e| RunError::State(e.to_string()))?;
    let copies = || (0..times.pow(3)).map(|k| [k % times, k / times % times, k / times / times]);
    let shifted =
        |copy: [usize; 3]| small.x.iter().map(move |x| [0, 1, 2].map(|c| x[c] + lengths[c] * copy[c] as f64));
    let every = |all: &[i32]| all.repeat(times.pow(3));
    let state = State::at_rest(domain, small.mass.clone(), copies().flat_map(shifted).collect());
    Ok(State { v: small.v.repeat(times.pow(3)), species: every(&small.species), ..state })
}

impl Outcome {
    pub fn table(&self) -> Table {
        let speed = ["particle-steps/s", "(lowest–highest)", "bytes/particle", "one CPU thread, portable"];
        let mut table = Table::new(["fluid", "particles"].into_iter().chain(speed));
        for s in &self.speeds {
            let Spread { min, median, max } = s.particle_steps_per_second;
            table.push([
                s.fluid.to_owned(),
                s.particles.to_string(),
                format!("{median:.3e}"),
                format!("({min:.3e}–{max:.3e})"),
                format!("{:.0}", s.bytes_per_particle),
                s.portable_cpu.map_or(String::new(), |rate| format!("{rate:.3e}")),
            ]);
        }
        table
    }

    pub fn kernels(&self) -> Table {
        let mut table = Table::new(["fluid", "particles", "kernel", "ns"]);
        for s in &self.speeds {
            let mut longest: Vec<_> = s.kernels.iter().collect();
            longest.sort_by(|a, b| b.1.total_cmp(a.1));
            for (kernel, ns) in longest {
                table.push([s.fluid.to_owned(), s.particles.to_string(), kernel.clone(), format!("{ns:.3}")]);
            }
        }
        table
    }
}
