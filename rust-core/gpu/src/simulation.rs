//! Particles that stay on the device.

mod arrays;
pub(crate) mod forces;
mod schedule;
mod status;

use crate::geometry::Geometry;
use crate::kernels::{Kernels, groups_of, read};
use crate::settings::{FROZEN, MOST_BODY_FORCES};
use crate::shader::{ENTRIES, Shader};
use crate::{Device, GpuError, Particles, Rule, Settings, Totals, Unsupported};
use arrays::{Arrays, BOXES, COUNTS, FORCES, POSITIONS, SUMS, VELOCITIES};
use psidpd_core::engine::Tally;
use psidpd_core::model::Fluid;

/// Device time of one kernel.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// Name of the kernel.
    pub kernel: String,
    /// Number of its runs.
    pub runs: u64,
    /// Seconds of all runs, by timestamps of the device.
    pub seconds: f64,
}

/// Steps that are sent to the device at once.
const STEPS_AT_ONCE: u64 = 64;
/// Steps after which faults are looked for.
const STEPS_UNSEEN: u64 = 512;
/// Most iterations of one update.
const MOST_ITERATIONS: u32 = 512;

/// Particles of one fluid in a box on a device.
///
/// Forces of step `n` have noise of number `n`, as in the native runner: forces before the first step have number 0.
#[derive(Debug)]
pub struct GpuSimulation {
    device: Device,
    fluid: Fluid,
    settings: Settings,
    geometry: Geometry,
    kernels: Kernels,
    arrays: Option<Arrays>,
    number: u64,
    count: usize,
    /// Which arrays hold the particles.
    side: usize,
    /// Number of the last kernel since the status was read.
    sequence: u32,
    /// Iterations that are sent to the device for each update of the implicit thermostat.
    iterations: u32,
    out_of_bounds: [u64; 2],
    effort: [u64; 3],
}

impl GpuSimulation {
    /// Compiles the kernels of a fluid. There are no particles before [`GpuSimulation::upload`].
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] names what the device cannot compute: for instance boxes narrower than twice the cutoff
    /// along a period, or tilted ones with walls.
    pub fn new(device: &Device, fluid: &Fluid, settings: Settings) -> Result<GpuSimulation, GpuError> {
        check(&settings, fluid)?;
        let geometry = Geometry::new(&settings.domain, fluid.dimensions, fluid.cutoff())?;
        Ok(GpuSimulation {
            kernels: Kernels::new(device, Shader::new(fluid)?, geometry.is_tilted)?,
            device: device.clone(),
            fluid: fluid.clone(),
            settings,
            geometry,
            arrays: None,
            number: 0,
            count: 0,
            side: 0,
            sequence: 0,
            iterations: 2,
            out_of_bounds: [0; 2],
            effort: [0; 3],
        })
    }

    /// Replaces all particles, after step `number`. Without forces, [`GpuSimulation::prepare`] must follow.
    ///
    /// # Errors
    /// Lists differ in length, species or tags are invalid, a position is not finite or beyond a wall, or the device
    /// has not enough memory.
    pub fn upload(&mut self, particles: &Particles, number: u64) -> Result<(), GpuError> {
        let Particles { x, v, force, species, tag, image, marks } = particles;
        let count = x.len();
        let same = [v.len(), species.len(), tag.len(), image.len(), marks.len()].iter().all(|n| *n == count);
        if !same || !(force.is_empty() || force.len() == count) || count == 0 {
            return Err(GpuError::Host("the lists of particles differ in length, or are empty"));
        }
        let mut positions = Vec::with_capacity(count);
        let mut velocities = Vec::with_capacity(count);
        let mut boxes = Vec::with_capacity(count);
        for k in 0..count {
            if species[k] < 0
                || species[k] as usize >= self.fluid.species.len()
                || tag[k] <= 0
                || marks[k] >> 16 != 0
            {
                return Err(GpuError::Host("a species, a tag or a mark is out of range"));
            }
            let Some((s, away)) = self.geometry.coordinates(x[k]) else {
                return Err(GpuError::Host("a position is not finite, or beyond a wall"));
            };
            positions.push([s[0], s[1], s[2], tag[k] as u32]);
            let [x, y, z] = if marks[k] & FROZEN != 0 { [0.0; 3] } else { v[k].map(|v| v as f32) };
            velocities.push([x, y, z, f32::from_bits(species[k] as u32 | marks[k] << 16)]);
            boxes.push([image[k][0] + away[0], image[k][1] + away[1], image[k][2] + away[2], 0]);
        }
        if self.arrays.is_none() || count != self.count {
            self.arrays = None;
            self.count = count;
            self.allocate(false)?;
        }
        (self.number, self.side) = (number, 0);
        self.write_params();
        let Some(arrays) = &self.arrays else { return Ok(()) };
        let queue = &self.device.queue;
        queue.write_buffer(&arrays.buffers[POSITIONS], 0, bytemuck::cast_slice(&positions));
        queue.write_buffer(&arrays.buffers[VELOCITIES], 0, bytemuck::cast_slice(&velocities));
        queue.write_buffer(&arrays.buffers[BOXES], 0, bytemuck::cast_slice(&boxes));
        if !force.is_empty() {
            let force: Vec<[f32; 4]> =
                force.iter().map(|[x, y, z]| [*x as f32, *y as f32, *z as f32, 0.0]).collect();
            queue.write_buffer(&arrays.buffers[FORCES], 0, bytemuck::cast_slice(&force));
        }
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&arrays.buffers[COUNTS], 0, None);
        queue.submit([encoder.finish()]);
        self.clear_status();
        Ok(())
    }

    /// Computes the forces with which steps of `dt` by `rule` begin, at the present positions and velocities; with `totals`
    /// also their sums.
    ///
    /// # Errors
    /// [`GpuError::Stopped`] with the number of the present step.
    pub fn prepare(&mut self, dt: f64, rule: Rule, totals: bool) -> Result<(), GpuError> {
        let noise = self.noise_of(rule, dt, self.number);
        let list = self.record(|runs| {
            runs.all("count_cells", [0.0; 4], 0);
            runs.sort();
            runs.forces(totals, noise);
        });
        self.submit(&list)?;
        let status = self.status()?;
        self.fault(&status, self.number).map_or(Ok(()), |stop| Err(stop.into()))
    }

    /// Makes steps of `dt`; with `totals` the last one also computes the sums of [`GpuSimulation::totals`].
    ///
    /// # Errors
    /// [`GpuError::Stopped`] names the step and a particle. The particles are then those of an unfinished step.
    pub fn advance(&mut self, steps: u64, dt: f64, rule: Rule, totals: bool) -> Result<(), GpuError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(GpuError::Host("the time step must be positive and finite"));
        }
        if let Rule::TwoStage { every, gradient, .. } = rule {
            if every == 0 {
                return Err(GpuError::Host("the thermostat must act every step, or every n-th"));
            }
            if self.heats(rule) || gradient != 0.0 {
                self.allocate(true)?;
            }
        }
        let last = self.number + steps;
        while self.number < last {
            let to = last
                .min(self.number + STEPS_UNSEEN.min((u64::from(u32::MAX) / 4 / self.count as u64).max(1)));
            self.advance_unseen(to, dt, rule, totals.then_some(last))?;
        }
        Ok(())
    }

    /// Makes the steps to the end of step `to`, and looks for faults then.
    fn advance_unseen(&mut self, to: u64, dt: f64, rule: Rule, totals: Option<u64>) -> Result<(), GpuError> {
        // The numbers of the last kernels of the steps since the status was read.
        let (mut ends, first) = (Vec::new(), self.number + 1);
        let mut resumes = false;
        let mut begins = true;
        loop {
            while self.number < to || resumes {
                let until = to.min(self.number + STEPS_AT_ONCE);
                let mut list = Vec::new();
                if resumes {
                    let (number, iterations) = (self.number, self.iterations);
                    let heat = self.heat_of(rule, dt, number, totals == Some(number));
                    list.extend(self.record(|runs| heat.iterate(runs, iterations)));
                    ends.push((number, self.sequence));
                    resumes = false;
                }
                while self.number < until {
                    self.number += 1;
                    let (number, ends_here) = (self.number, self.number == to);
                    let step = self.step(number, dt, rule, totals == Some(number), begins, ends_here);
                    list.extend(step);
                    ends.push((number, self.sequence));
                    begins = false;
                }
                self.submit(&list)?;
            }
            let sequence = self.sequence;
            let status = self.status()?;
            let at = ends.iter().find(|(_, end)| *end >= status.failed).map_or(first, |(number, _)| *number);
            if let Some(stop) = self.fault(&status, at) {
                self.number = at;
                return Err(stop.into());
            }
            if status.unfinished == 0 {
                debug_assert!(status.failed == 0, "{status:?} {sequence}");
                return Ok(());
            }
            self.number = at;
            self.iterations = (2 * self.iterations).min(MOST_ITERATIONS);
            ends.clear();
            resumes = true;
        }
    }

    /// The sums at the end of the last step that computed them. Momenta and forces are those of the present particles.
    ///
    /// # Errors
    /// The device was lost.
    pub fn totals(&mut self) -> Result<Totals, GpuError> {
        let list = self.record(|runs| runs.all("measure", [0.0; 4], 0));
        self.submit(&list)?;
        let Some(arrays) = &self.arrays else { return Ok(Totals::default()) };
        Ok(sums_of(&read(&self.device, &[(&arrays.buffers[SUMS], self.bytes_of_sums())])?))
    }

    fn bytes_of_sums(&self) -> u64 {
        4 * u64::from(groups_of(self.count) * ENTRIES)
    }

    /// Copies all particles to the host, in the device's order, and reuses the memory of the lists. Uploaded again, they
    /// continue with the same bits.
    ///
    /// # Errors
    /// The device was lost.
    pub fn download(&mut self, to: &mut Particles) -> Result<(), GpuError> {
        let Some(arrays) = &self.arrays else { return Ok(()) };
        let bytes = 16 * self.count as u64;
        let buffer = |k: usize| &arrays.buffers[if k == FORCES { k } else { k + 3 * self.side }];
        let positions: Vec<[u32; 4]> = read(&self.device, &[(buffer(POSITIONS), bytes)])?;
        let velocities: Vec<[f32; 4]> = read(&self.device, &[(buffer(VELOCITIES), bytes)])?;
        let boxes: Vec<[i32; 4]> = read(&self.device, &[(buffer(BOXES), bytes)])?;
        let forces: Vec<[f32; 4]> = read(&self.device, &[(buffer(FORCES), bytes)])?;
        let Particles { x, v, force, species, tag, image, marks } = to;
        let vector = |[x, y, z, _]: [f32; 4]| [x, y, z].map(f64::from);
        let bits = |v: &[f32; 4]| v[3].to_bits();
        refill(x, positions.iter().map(|[x, y, z, _]| self.geometry.point([*x, *y, *z])));
        refill(tag, positions.iter().map(|s| s[3] as i32));
        refill(v, velocities.iter().map(|v| vector(*v)));
        refill(species, velocities.iter().map(|v| (bits(v) & 0xffff) as i32));
        refill(marks, velocities.iter().map(|v| bits(v) >> 16));
        refill(image, boxes.iter().map(|[x, y, z, _]| [*x, *y, *z]));
        let moves = |v: &[f32; 4]| bits(v) >> 16 & FROZEN == 0;
        refill(
            force,
            forces.iter().zip(&velocities).map(|(f, v)| if moves(v) { vector(*f) } else { [0.0; 3] }),
        );
        Ok(())
    }

    /// Replaces the fluid, for instance by the same model at another temperature, box, masses, seed and body forces. The particles
    /// keep their positions; forces must be prepared anew.
    ///
    /// # Errors
    /// As [`GpuSimulation::new`] and [`GpuSimulation::upload`].
    pub fn replace(&mut self, fluid: &Fluid, settings: Settings) -> Result<(), GpuError> {
        check(&settings, fluid)?;
        let geometry = Geometry::new(&settings.domain, fluid.dimensions, fluid.cutoff())?;
        let shader = Shader::new(fluid)?;
        let mut particles = Particles::default();
        self.download(&mut particles)?;
        self.kernels.replace(&self.device, shader)?;
        self.kernels.set_tilted(geometry.is_tilted);
        (self.fluid, self.settings, self.geometry, self.arrays) = (fluid.clone(), settings, geometry, None);
        if particles.x.is_empty() { Ok(()) } else { self.upload(&particles, self.number) }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no particles.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of the present step.
    pub fn step_number(&self) -> u64 {
        self.number
    }

    /// Number of evaluations of ψ below and above density bounds since the start.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        self.out_of_bounds
    }

    /// Updates of the implicit thermostat, their iterations, and how many of them ended before they were accurate.
    pub fn effort(&self) -> [u64; 3] {
        self.effort
    }

    /// Memory on the device, in bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.arrays.iter().flat_map(|arrays| &arrays.buffers).map(wgpu::Buffer::size).sum()
    }

    /// Starts measuring the time of each kernel, or ends it. Steps are then slower, because kernels run one by one.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] if the device has no timestamps.
    pub fn measure_time(&mut self, on: bool) -> Result<(), GpuError> {
        if on && !self.device.has_timestamps {
            return Err(Unsupported { what: "timestamps of this device".into() }.into());
        }
        self.kernels.measure_time(&self.device, on);
        Ok(())
    }

    /// Times since the last call of [`GpuSimulation::measure_time`], longest first.
    pub fn timings(&self) -> Vec<Timing> {
        self.kernels.timings()
    }
}

/// The sums of all workgroups.
fn sums_of(partial: &[f32]) -> Totals {
    let sum = |k: usize| partial.chunks_exact(ENTRIES as usize).map(|block| f64::from(block[k])).sum::<f64>();
    Totals {
        tally: Tally {
            excess: sum(0),
            pair: sum(1),
            virial: std::array::from_fn(|k| sum(2 + k)),
            thermostat_virial: std::array::from_fn(|k| sum(8 + k)),
            // No step here records it.
            drag_virial: [f64::NAN; 6],
        },
        momentum_flux: std::array::from_fn(|k| sum(14 + k)),
        momentum: std::array::from_fn(|k| sum(20 + k)),
        support_force: std::array::from_fn(|k| sum(23 + k)),
    }
}

fn refill<T>(list: &mut Vec<T>, values: impl Iterator<Item = T>) {
    list.clear();
    list.extend(values);
}

fn check(settings: &Settings, fluid: &Fluid) -> Result<(), GpuError> {
    if settings.mass.len() != fluid.species.len() {
        return Err(GpuError::Host("there must be one mass for each species"));
    }
    if settings.body_forces.len() > MOST_BODY_FORCES {
        return Err(Unsupported { what: format!("more than {MOST_BODY_FORCES} body forces") }.into());
    }
    Ok(())
}
