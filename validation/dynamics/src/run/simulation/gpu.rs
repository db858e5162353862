//! Steps on a GPU. The particles stay there; the arrays of the host are a copy, which [`Simulation::fetch`] renews.
//!
//! Steps are collected, so that the device does not wait for the host between them: they are made when their results are
//! asked for, or when they take [`BATCH`]. What the device does not compute, the paths of momentum that some observables
//! sample, comes from a copy of the same step on the host.

use super::{Place, RunError, Simulation};
use crate::device::{DeviceError, refused_step};
use crate::integrator::Integrator;
use crate::particles::BodyForce;
use psidpd_core::engine::thermostat::Effort;
use psidpd_core::engine::{EngineError, Want};
use psidpd_gpu::{self as gpu, Fault, GpuError, GpuSimulation, Rule, Stop};
use std::time::{Duration, Instant};

/// Time that collected steps may take: a run can stop, and shows its progress, after so long.
const BATCH: Duration = Duration::from_millis(100);
/// Most steps that are collected.
const MOST: u64 = 256;

#[derive(Debug)]
pub(super) struct Gpu {
    device: gpu::Device,
    machine: GpuSimulation,
    /// The conditions that the machine computes.
    conditions: Conditions,
    /// Whether the machine has the particles.
    uploaded: bool,
    /// Whether the arrays of the host are those of the machine.
    fetched: bool,
    /// Steps to make, their length and their rule.
    collected: Option<(u64, f64, Rule)>,
    /// How many steps to collect.
    batch: u64,
    particles: gpu::Particles,
    /// Evaluations of ψ outside bounds that the machine has not counted.
    earlier_out_of_bounds: [u64; 2],
}

#[derive(Debug, Clone, PartialEq)]
struct Conditions {
    kt: f64,
    thermostat: bool,
    body_forces: Vec<BodyForce>,
}

impl From<GpuError> for DeviceError {
    fn from(error: GpuError) -> DeviceError {
        match error {
            GpuError::NoDevice => DeviceError::NotFound,
            GpuError::Index { index, count } => {
                DeviceError::Number { asked: index, last: count.saturating_sub(1) }
            }
            GpuError::Unsupported(found) => DeviceError::Lacks(found.what),
            other => DeviceError::Failed(other.to_string()),
        }
    }
}

fn failed(error: GpuError) -> RunError {
    RunError::Device(error.into())
}

fn rule(integrator: Integrator) -> Result<Rule, RunError> {
    match (integrator, refused_step(integrator)) {
        (Integrator::VelocityVerlet, None) => Ok(Rule::VelocityVerlet),
        (Integrator::TwoStage { lambda, coupling }, None) => {
            Ok(Rule::TwoStage { lambda, gradient: 0.0, every: coupling.every })
        }
        (Integrator::ForceGradient { lambda, gradient, coupling }, None) => {
            Ok(Rule::TwoStage { lambda, gradient, every: coupling.every })
        }
        (other, refused) => {
            Err(DeviceError::Lacks(refused.unwrap_or_else(|| other.name().to_owned())).into())
        }
    }
}

impl Simulation {
    pub(super) fn use_gpu(&mut self, number: usize) -> Result<(), RunError> {
        let device = gpu::Device::open(Some(number)).map_err(failed)?;
        let conditions = self.conditions();
        let machine =
            GpuSimulation::new(&device, &self.model().at(self.kt())?, self.gpu_settings(&conditions)?)
                .map_err(failed)?;
        self.gpu = Some(Box::new(Gpu {
            device,
            machine,
            conditions,
            uploaded: false,
            fetched: true,
            collected: None,
            batch: 1,
            particles: gpu::Particles::default(),
            earlier_out_of_bounds: self.forces.out_of_bounds(),
        }));
        Ok(())
    }

    pub fn gpu(&mut self) -> Option<&mut GpuSimulation> {
        self.gpu.as_mut().map(|gpu| &mut gpu.machine)
    }

    pub fn gpu_name(&self) -> Option<String> {
        self.gpu.as_ref().map(|gpu| gpu.device.info().to_string())
    }

    fn conditions(&self) -> Conditions {
        let (kt, thermostat) = (self.kt(), self.thermostat.on);
        Conditions { kt, thermostat, body_forces: self.external.body_forces.clone() }
    }

    fn gpu_settings(&self, conditions: &Conditions) -> Result<gpu::Settings, RunError> {
        if conditions.body_forces.len() > gpu::MOST_BODY_FORCES {
            let what = format!("more than {} tables [[body_force]]", gpu::MOST_BODY_FORCES);
            return Err(DeviceError::Lacks(what).into());
        }
        let acceleration = |force: &BodyForce| gpu::BodyForce {
            acceleration: force.acceleration,
            reversed_along: force.reversed_along,
        };
        Ok(gpu::Settings {
            domain: self.particles.now().domain.clone(),
            mass: self.particles.now().mass.clone(),
            seed: self.seed,
            thermostat: conditions.thermostat,
            body_forces: conditions.body_forces.iter().map(acceleration).collect(),
        })
    }

    /// Gives the machine the present conditions, and the particles if it has none.
    fn supply_gpu(&mut self) -> Result<(), RunError> {
        let now = self.conditions();
        let Some(before) = self.gpu.as_ref().map(|gpu| gpu.conditions.clone()) else { return Ok(()) };
        if before != now {
            let fluid = self.model().at(now.kt)?;
            let settings = self.gpu_settings(&now)?;
            if before.body_forces != now.body_forces {
                // The machine knows by marks of the particles on which of them a body force acts.
                self.fetch()?;
            }
            let Some(gpu) = &mut self.gpu else { return Ok(()) };
            gpu.uploaded &= before.body_forces == now.body_forces;
            gpu.machine.replace(&fluid, settings).map_err(failed)?;
            gpu.conditions = now;
        }
        let Simulation { gpu: Some(gpu), particles, external, number, .. } = self else { return Ok(()) };
        if gpu.uploaded {
            return Ok(());
        }
        let state = particles.now();
        let bodies = &gpu.conditions.body_forces;
        let mark = |k: usize| {
            let frozen = if external.frozen.get(k) == Some(&true) { gpu::FROZEN } else { 0 };
            let acts = bodies.iter().enumerate().filter(|(_, b)| b.acts_on(state.species[k], state.tag[k]));
            acts.fold(frozen, |mark, (index, _)| mark | gpu::body_force_mark(index))
        };
        let to = &mut gpu.particles;
        to.x.clone_from(&state.x);
        to.v.clone_from(&state.v);
        to.force.clear();
        to.force.extend_from_slice(particles.forces());
        to.species.clone_from(&state.species);
        to.tag.clone_from(&state.tag);
        to.image.clone_from(&state.image);
        to.marks = (0..state.len()).map(mark).collect();
        gpu.machine.upload(to, *number).map_err(failed)?;
        gpu.uploaded = true;
        Ok(())
    }

    /// [`Simulation::prepare_for`] on the GPU.
    pub(super) fn prepare_on_gpu(
        &mut self,
        integrator: Integrator,
        dt: f64,
        want: Want,
    ) -> Result<(), RunError> {
        let rule = rule(integrator)?;
        self.make_collected(false)?;
        self.supply_gpu()?;
        self.thermostat.in_forces = Some(integrator.properties().drag_in_forces);
        let totals = want.energy || want.virial;
        let Some(gpu) = &mut self.gpu else { return Ok(()) };
        gpu.fetched = false;
        let made = gpu.machine.prepare(dt, rule, totals);
        made.map_err(|error| self.failure(error, dt))?;
        if !totals {
            return Ok(());
        }
        self.take_totals()?;
        let Some(coupling) = integrator.at_setup(self, want) else { return Ok(()) };
        self.fetch()?;
        coupling.rehearse(self, dt)
    }

    /// Makes a step on the GPU, or collects it for later.
    pub(super) fn step_on_gpu(
        &mut self,
        dt: f64,
        integrator: Integrator,
        want: Want,
    ) -> Result<(), RunError> {
        let rule = rule(integrator)?;
        self.supply_gpu()?;
        // The GPU computes the thermostat's virial for steps that it acts in; that for several steps comes from the host.
        let every = integrator.thermostat_every();
        let acts_for_several = every > 1 && (self.number + 1).is_multiple_of(every);
        if acts_for_several {
            self.forget_impulses();
        }
        let heat = self.wants_of_heat(want).virial && acts_for_several;
        if self.record.is_some() || heat {
            self.make_collected(false)?;
            self.record_on_host(dt, integrator, Want { virial: heat, ..Want::FORCES })?;
        }
        let alike = |(_, before, with): &mut (u64, f64, Rule)| (*before, *with) == (dt, rule);
        if !self.gpu.as_mut().is_some_and(|gpu| gpu.collected.as_mut().is_none_or(alike)) {
            self.make_collected(false)?;
        }
        self.number += 1;
        self.forces_at = Place::End;
        let Some(gpu) = &mut self.gpu else { return Ok(()) };
        gpu.fetched = false;
        let (steps, ..) = gpu.collected.get_or_insert((0, dt, rule));
        *steps += 1;
        let totals = want.energy || want.virial;
        if totals || *steps >= gpu.batch { self.make_collected(totals) } else { Ok(()) }
    }

    /// Makes the next step with the arrays of the host, for its record or its impulses; they are fetched again after the step of the GPU.
    fn record_on_host(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        self.fetch()?;
        let gpu = self.gpu.take();
        let number = self.number;
        let made = self.begin_step(dt, integrator, want).and_then(|()| self.end_step());
        self.motion.deferred = None;
        self.number = number;
        self.gpu = gpu;
        made
    }

    /// Makes the steps that were collected; the last one with totals, if they are asked for.
    pub(super) fn make_collected(&mut self, totals: bool) -> Result<(), RunError> {
        let Some(gpu) = &mut self.gpu else { return Ok(()) };
        let Some((steps, dt, rule)) = gpu.collected.take() else { return Ok(()) };
        let start = Instant::now();
        let made = gpu.machine.advance(steps, dt, rule, totals);
        let step = start.elapsed().as_secs_f64() / steps as f64;
        gpu.batch = ((BATCH.as_secs_f64() / step) as u64).clamp(1, MOST);
        made.map_err(|error| self.failure(error, dt))?;
        if !totals {
            return Ok(());
        }
        self.take_totals()?;
        if matches!(rule, Rule::TwoStage { every, .. } if every > 1) {
            self.forces.tally.thermostat_virial = self.thermostat.impulse_virial;
        }
        Ok(())
    }

    fn take_totals(&mut self) -> Result<(), RunError> {
        let Some(gpu) = &mut self.gpu else { return Ok(()) };
        let gpu::Totals { tally, momentum_flux, support_force, .. } = gpu.machine.totals().map_err(failed)?;
        self.forces.tally = tally;
        self.particles.set_momentum_flux(momentum_flux);
        self.external.support_force = support_force;
        Ok(())
    }

    /// Copies the particles of the GPU into the arrays of the host, where they differ.
    pub(super) fn fetch_from_gpu(&mut self) -> Result<(), RunError> {
        self.make_collected(false)?;
        let Simulation { gpu: Some(gpu), particles, external, .. } = self else { return Ok(()) };
        if gpu.fetched {
            return Ok(());
        }
        gpu.machine.download(&mut gpu.particles).map_err(failed)?;
        let gpu::Particles { x, v, force, species, tag, image, .. } = &gpu.particles;
        particles.replace_with(
            |state| {
                state.x.clone_from(x);
                state.v.clone_from(v);
                state.species.clone_from(species);
                state.tag.clone_from(tag);
                state.image.clone_from(image);
            },
            force,
        );
        external.find_frozen(particles);
        gpu.fetched = true;
        Ok(())
    }

    pub(super) fn is_fetched(&self) -> bool {
        self.gpu.as_ref().is_none_or(|gpu| gpu.fetched && gpu.collected.is_none())
    }

    /// The arrays of the host have changed: the GPU takes the particles from them before its next step.
    pub(super) fn forget_gpu(&mut self, out_of_bounds: [u64; 2]) {
        if let Some(gpu) = &mut self.gpu {
            let counted = gpu.machine.out_of_bounds();
            gpu.earlier_out_of_bounds = [0, 1].map(|k| out_of_bounds[k].wrapping_sub(counted[k]));
            (gpu.uploaded, gpu.fetched, gpu.collected) = (false, true, None);
        }
    }

    pub(super) fn out_of_bounds_on_gpu(&self) -> Option<[u64; 2]> {
        let gpu = self.gpu.as_ref()?;
        let counted = gpu.machine.out_of_bounds();
        Some([0, 1].map(|k| gpu.earlier_out_of_bounds[k].wrapping_add(counted[k])))
    }

    pub(super) fn effort_on_gpu(&self) -> Option<Effort> {
        let [updates, iterations, inaccurate] = self.gpu.as_ref()?.machine.effort();
        Some(Effort { updates, iterations, inaccurate, ..Effort::default() })
    }

    /// The error of a step that failed, as the host words it.
    fn failure(&mut self, error: GpuError, dt: f64) -> RunError {
        let GpuError::Stopped(Stop { step, tag, fault }) = error else { return failed(error) };
        self.number = step;
        let fetched = self.fetch();
        match fault {
            Fault::Velocity => RunError::Velocity { step, tag },
            Fault::Runaway => {
                let found = self.particles.now().tag.iter().position(|other| *other == tag);
                let v = found.map_or([f64::NAN; 3], |k| self.particles.now().v[k]);
                RunError::Runaway { step, tag, distance: dt * v[0].hypot(v[1]).hypot(v[2]) }
            }
            Fault::ExcessFreeEnergy | Fault::Force => {
                // The host says at which densities, at the positions of the failed step.
                let again = fetched.and_then(|()| self.compute(Want::FORCES, None));
                let error = again.err().filter(|error| matches!(error, RunError::Engine { .. }));
                error.unwrap_or(RunError::Engine { step, source: EngineError::Force { tag } })
            }
        }
    }
}
