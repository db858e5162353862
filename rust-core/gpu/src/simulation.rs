//! Particles that stay on the device.

use crate::geometry::Geometry;
use crate::kernels::{Arguments, DEFERRED, Kernels, NOISE, Run, groups_of, read};
use crate::settings::{FROZEN, MOST_BODY_FORCES};
use crate::shader::{ENTRIES, SCAN, Shader};
use crate::{Device, GpuError, Particles, Rule, Settings, Stop, Totals, Unsupported};
use psidpd_core::engine::noise::PairNoise;
use psidpd_core::model::Fluid;
use wgpu::BufferUsages as Usage;

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
/// Tolerance of conjugate gradients and least tolerance, as on the CPU; single precision ends before its `FINEST` of 10⁻⁶.
const TOLERANCE: f32 = 2e-2;
const FINEST: f32 = 3e-5;
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

/// Buffers for a number of particles.
#[derive(Debug)]
struct Arrays {
    buffers: Vec<wgpu::Buffer>,
    groups: [wgpu::BindGroup; 2],
    /// Workgroups of the scan.
    scans: u32,
    has_thermostat: bool,
}

/// Bindings of `wgsl/common.wgsl`.
const PARAMS: usize = 0;
const CONSTANTS: usize = 1;
const POSITIONS: usize = 2;
const VELOCITIES: usize = 3;
const BOXES: usize = 4;
const FORCES: usize = 8;
const COUNTS: usize = 9;
const STATUS: usize = 14;
const SUMS: usize = 15;

#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    count: u32,
    nan_bits: u32,
    body_forces: u32,
    blocks: u32,
    cells: [u32; 4],
    walls: [u32; 4],
    edge: [[f32; 4]; 3],
    row: [[f32; 4]; 3],
    body: [[f32; 4]; MOST_BODY_FORCES],
    mass: [[f32; 4]; 64],
}

/// `Status` of `wgsl/common.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Status {
    failed: u32,
    /// Lowest tag with a velocity, a move, a ψ and a force that fails.
    tags: [u32; 4],
    unfinished: u32,
    out_of_bounds: [u32; 2],
    effort: [u32; 3],
    state: u32,
    rest: [u32; 8],
}

/// Runs of kernels, each with its number.
struct Runs<'a> {
    list: Vec<Run>,
    side: &'a mut usize,
    sequence: &'a mut u32,
    groups: u32,
    scans: u32,
    passes: bool,
}

impl Runs<'_> {
    fn push(&mut self, kernel: &'static str, totals: bool, groups: u32, arguments: Arguments) {
        *self.sequence += 1;
        let arguments = Arguments { sequence: *self.sequence, ..arguments };
        self.list.push(Run { kernel, totals, side: *self.side, groups, arguments });
    }

    fn all(&mut self, kernel: &'static str, numbers: [f32; 4], flags: u32) {
        self.push(kernel, false, self.groups, Arguments { numbers, flags, ..Arguments::default() });
    }

    /// Puts the particles, which are counted, into the order of cells.
    fn sort(&mut self) {
        let arguments = Arguments::default();
        self.push("scan_cells", false, self.scans, arguments);
        self.push("scan_sums", false, 1, arguments);
        self.push("list_cells", false, self.groups, arguments);
        self.push("sort", false, self.groups, arguments);
        *self.side = 1 - *self.side;
    }

    fn forces(&mut self, totals: bool, noise: Option<(f32, [u32; 2])>) {
        if self.passes || totals {
            self.push("densities", totals, self.groups, Arguments::default());
        }
        let (a, key) = noise.unwrap_or_default();
        let flags = if noise.is_some() { NOISE } else { 0 };
        self.push(
            "forces",
            totals,
            self.groups,
            Arguments { numbers: [a, 0.0, 0.0, 0.0], key, flags, ..Default::default() },
        );
    }
}

impl GpuSimulation {
    /// Compiles the kernels of a fluid. There are no particles before [`GpuSimulation::upload`].
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] names what the device cannot compute: for instance boxes narrower than twice the cutoff
    /// along a period, or tilted ones with walls.
    pub fn new(device: &Device, fluid: &Fluid, settings: Settings) -> Result<GpuSimulation, GpuError> {
        check(&settings, fluid)?;
        let geometry = Geometry::new(&settings, fluid.dimensions, fluid.cutoff())?;
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
        let (list, _) = self.record(|runs| {
            runs.all("count_cells", [0.0; 4], 0);
            runs.sort();
            runs.forces(totals, noise);
        });
        self.submit(&list)?;
        let status = self.status()?;
        self.fault(&status).map_or(Ok(()), |fault| Err(GpuError::Stopped(fault(self.number))))
    }

    /// Makes steps of `dt`; with `totals` the last one also computes the sums of [`GpuSimulation::totals`].
    ///
    /// # Errors
    /// [`GpuError::Stopped`] names the step and a particle. The particles are then those of an unfinished step.
    pub fn advance(&mut self, steps: u64, dt: f64, rule: Rule, totals: bool) -> Result<(), GpuError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(GpuError::Host("the time step must be positive and finite"));
        }
        if let Rule::TwoStage { every, .. } = rule {
            if every == 0 {
                return Err(GpuError::Host("the thermostat must act every step, or every n-th"));
            }
            if self.heats(rule) {
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
                    list.extend(self.record(|runs| heat.iterate(runs, iterations)).0);
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
            if let Some(fault) = self.fault(&status) {
                self.number = at;
                return Err(GpuError::Stopped(fault(at)));
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

    /// The kernels of one step; `begins` without a deferred kick, and `ends` with all kicks made.
    fn step(&mut self, number: u64, dt: f64, rule: Rule, totals: bool, begins: bool, ends: bool) -> Vec<Run> {
        let noise = self.noise_of(rule, dt, number);
        let (heats_before, heats) = (self.heats_at(rule, number - 1), self.heats_at(rule, number));
        let heat = self.heat_of(rule, dt, number, totals);
        let iterations = self.iterations;
        let deferred = if begins || heats_before { 0 } else { DEFERRED };
        let single = |x: f64| x as f32;
        let (list, _) = self.record(|runs| match rule {
            Rule::VelocityVerlet => {
                runs.all("kick_drift", [single(0.5 * dt), single(dt), 0.0, 0.0], deferred);
                runs.sort();
                runs.forces(totals, noise);
                if ends {
                    runs.all("kick", [single(0.5 * dt), 0.0, 0.0, 0.0], 0);
                }
            }
            Rule::TwoStage { lambda, .. } => {
                let half = single(0.5 * dt);
                runs.all("kick_drift", [single(lambda * dt), half, 0.0, 0.0], deferred);
                runs.sort();
                runs.forces(false, None);
                runs.all("kick_drift", [single((1.0 - 2.0 * lambda) * dt), half, 0.0, 0.0], 0);
                runs.sort();
                runs.forces(totals, None);
                if ends || heats {
                    runs.all("kick", [single(lambda * dt), 0.0, 0.0, 0.0], 0);
                }
                if heats {
                    runs.push("heat_start", false, runs.groups, heat.arguments);
                    heat.iterate(runs, iterations);
                }
            }
        });
        list
    }

    /// The factor and the key of noise in the forces.
    fn noise_of(&self, rule: Rule, dt: f64, number: u64) -> Option<(f32, [u32; 2])> {
        let acts = rule == Rule::VelocityVerlet && self.has_drag();
        let key = PairNoise::new(self.settings.seed, number).key();
        acts.then(|| ((2.0 * self.fluid.kt / dt).sqrt() as f32, key))
    }

    fn has_drag(&self) -> bool {
        self.settings.thermostat && self.fluid.thermostats.iter().flatten().any(|law| law.gamma > 0.0)
    }

    /// Whether the implicit thermostat acts in steps by this rule.
    fn heats(&self, rule: Rule) -> bool {
        matches!(rule, Rule::TwoStage { .. }) && self.has_drag()
    }

    fn heats_at(&self, rule: Rule, number: u64) -> bool {
        matches!(rule, Rule::TwoStage { every, .. } if number.is_multiple_of(every)) && self.heats(rule)
    }

    fn heat_of(&self, rule: Rule, dt: f64, number: u64, virial: bool) -> Heat {
        let time = match rule {
            Rule::TwoStage { every, .. } => dt * every as f64,
            Rule::VelocityVerlet => dt,
        };
        let numbers = [(0.5 * time).sqrt() as f32, self.fluid.kt.sqrt() as f32, TOLERANCE, FINEST];
        let key = PairNoise::of_stream(self.settings.seed, number, 1).key();
        let of_virial = [numbers[0], numbers[1], (2.0 / dt) as f32, 0.0];
        Heat {
            arguments: Arguments { numbers, key, ..Arguments::default() },
            of_virial: virial.then_some(Arguments { numbers: of_virial, key, ..Arguments::default() }),
        }
    }

    /// The sums at the end of the last step that computed them. Momenta and forces are those of the present particles.
    ///
    /// # Errors
    /// The device was lost.
    pub fn totals(&mut self) -> Result<Totals, GpuError> {
        let (list, _) = self.record(|runs| runs.all("measure", [0.0; 4], 0));
        self.submit(&list)?;
        let Some(arrays) = &self.arrays else { return Ok(Totals::default()) };
        let blocks = groups_of(self.count) as usize;
        let bytes = (blocks * ENTRIES as usize * 4) as u64;
        let partial: Vec<f32> = read(&self.device, &arrays.buffers[SUMS], bytes)?;
        let entries = || partial.chunks_exact(ENTRIES as usize);
        let sum = |k: usize| entries().map(|block| f64::from(block[k])).sum::<f64>();
        Ok(Totals {
            excess: sum(0),
            pair: sum(1),
            virial: std::array::from_fn(|k| sum(2 + k)),
            thermostat_virial: std::array::from_fn(|k| sum(8 + k)),
            momentum_flux: std::array::from_fn(|k| sum(14 + k)),
            momentum: std::array::from_fn(|k| sum(20 + k)),
            support_force: std::array::from_fn(|k| sum(23 + k)),
            largest_force: entries().map(|block| f64::from(block[26])).fold(0.0, f64::max),
        })
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
        let positions: Vec<[u32; 4]> = read(&self.device, buffer(POSITIONS), bytes)?;
        let velocities: Vec<[f32; 4]> = read(&self.device, buffer(VELOCITIES), bytes)?;
        let boxes: Vec<[i32; 4]> = read(&self.device, buffer(BOXES), bytes)?;
        let forces: Vec<[f32; 4]> = read(&self.device, buffer(FORCES), bytes)?;
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

    /// Takes the same model at another temperature, from the next forces on.
    ///
    /// # Errors
    /// As [`GpuSimulation::new`].
    pub fn set_fluid(&mut self, fluid: &Fluid) -> Result<(), GpuError> {
        check(&self.settings, fluid)?;
        self.geometry = Geometry::new(&self.settings, fluid.dimensions, fluid.cutoff())?;
        let shader = Shader::new(fluid)?;
        let old = self.kernels.shader();
        let fits = shader.variables == old.variables
            && shader.constants.len() == old.constants.len()
            && shader.tables.len() == old.tables.len()
            && fluid.cutoff() == self.fluid.cutoff();
        self.kernels.replace(&self.device, shader)?;
        self.fluid = fluid.clone();
        match fits {
            true => {
                self.write_constants();
                Ok(())
            }
            false => self.reload(),
        }
    }

    /// Replaces box, masses, seed and body forces; the particles keep their positions. Forces must be prepared anew.
    ///
    /// # Errors
    /// As [`GpuSimulation::new`] and [`GpuSimulation::upload`].
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), GpuError> {
        check(&settings, &self.fluid)?;
        let geometry = Geometry::new(&settings, self.fluid.dimensions, self.fluid.cutoff())?;
        self.kernels.set_tilted(geometry.is_tilted);
        let mut particles = Particles::default();
        self.download(&mut particles)?;
        (self.settings, self.geometry, self.arrays) = (settings, geometry, None);
        if particles.x.is_empty() { Ok(()) } else { self.upload(&particles, self.number) }
    }

    /// Puts the particles into new arrays.
    fn reload(&mut self) -> Result<(), GpuError> {
        self.set_settings(self.settings.clone())
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

    /// Creates the buffers, with those of the implicit thermostat if asked for; particles keep their place.
    fn allocate(&mut self, thermostat: bool) -> Result<(), GpuError> {
        if self.arrays.as_ref().is_some_and(|arrays| arrays.has_thermostat || !thermostat) {
            return Ok(());
        }
        let count = self.count as u64;
        let cells = self
            .geometry
            .cells(self.fluid.cutoff(), self.count)
            .iter()
            .map(|n| u64::from(*n))
            .product::<u64>()
            + 1;
        let scans = cells.div_ceil(u64::from(SCAN));
        let shader = self.kernels.shader();
        let vectors = 16 * count;
        let of_thermostat = if thermostat { vectors } else { 16 };
        let mut sizes = vec![
            size_of::<Params>() as u64,
            4 * shader.constants.len() as u64,
            vectors,
            vectors,
            vectors,
            vectors,
            vectors,
            vectors,
            vectors,
            4 * cells,
            4 * scans * u64::from(SCAN),
            4 * scans,
            8 * count,
            4 * count * shader.variables.max(1) as u64,
            size_of::<Status>() as u64,
            u64::from(4 * ENTRIES * groups_of(self.count)),
            4 * shader.tables.len() as u64,
        ];
        sizes.extend([of_thermostat; 4]);
        let limits = &self.device.limits;
        let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        if let Some(size) = sizes.iter().find(|size| **size > most) {
            let what = format!("{count} particles: an array of {size} bytes on a device with at most {most}");
            return Err(Unsupported { what }.into());
        }
        let scope = self.device.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let old = self.arrays.take().map(|arrays| arrays.buffers).unwrap_or_default();
        let buffers: Vec<wgpu::Buffer> = sizes
            .iter()
            .enumerate()
            .map(|(k, size)| match old.get(k) {
                Some(buffer) if buffer.size() == *size => buffer.clone(),
                _ => self.device.device.create_buffer(&wgpu::BufferDescriptor {
                    label: None,
                    size: *size,
                    usage: Usage::COPY_DST
                        | Usage::COPY_SRC
                        | if k < 2 { Usage::UNIFORM } else { Usage::STORAGE },
                    mapped_at_creation: false,
                }),
            })
            .collect();
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(self.device.failed(error));
        }
        let groups = [0, 1].map(|side| {
            let entries: Vec<_> = (0..buffers.len())
                .map(|binding| {
                    let swapped = match binding {
                        2..5 if side == 1 => binding + 3,
                        5..8 if side == 1 => binding - 3,
                        other => other,
                    };
                    wgpu::BindGroupEntry {
                        binding: binding as u32,
                        resource: buffers[swapped].as_entire_binding(),
                    }
                })
                .collect();
            self.device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.kernels.groups_layout,
                entries: &entries,
            })
        });
        self.arrays = Some(Arrays { buffers, groups, scans: scans as u32, has_thermostat: thermostat });
        self.write_constants();
        Ok(())
    }

    fn write_constants(&self) {
        let Some(arrays) = &self.arrays else { return };
        let shader = self.kernels.shader();
        self.device.queue.write_buffer(
            &arrays.buffers[CONSTANTS],
            0,
            bytemuck::cast_slice(&shader.constants),
        );
        self.device.queue.write_buffer(
            &arrays.buffers[CONSTANTS + 15],
            0,
            bytemuck::cast_slice(&shader.tables),
        );
    }

    fn write_params(&self) {
        let Some(arrays) = &self.arrays else { return };
        let [nx, ny, nz] = self.geometry.cells(self.fluid.cutoff(), self.count);
        let [wx, wy, wz] = self.geometry.walls();
        let (mut body, mut mass) = ([[0.0; 4]; MOST_BODY_FORCES], [[0.0; 4]; 64]);
        for (to, force) in body.iter_mut().zip(&self.settings.body_forces) {
            let [x, y, z] = force.acceleration.map(|a| a as f32);
            *to = [x, y, z, force.reversed_along.unwrap_or(3) as f32];
        }
        for (to, m) in mass.iter_mut().zip(&self.settings.mass) {
            *to = [*m as f32, m.recip() as f32, 0.0, 0.0];
        }
        let params = Params {
            count: self.count as u32,
            nan_bits: 0x7fc0_0000,
            body_forces: self.settings.body_forces.len() as u32,
            blocks: groups_of(self.count),
            cells: [nx, ny, nz, 0],
            walls: [wx, wy, wz, 0],
            edge: self.geometry.edges(),
            row: self.geometry.rows(),
            body,
            mass,
        };
        self.device.queue.write_buffer(&arrays.buffers[PARAMS], 0, bytemuck::bytes_of(&params));
    }

    fn record(&mut self, work: impl FnOnce(&mut Runs)) -> (Vec<Run>, u32) {
        let scans = self.arrays.as_ref().map_or(0, |arrays| arrays.scans);
        let passes = self.kernels.shader().variables > 0;
        let groups = groups_of(self.count);
        let mut runs = Runs {
            list: Vec::new(),
            side: &mut self.side,
            sequence: &mut self.sequence,
            groups,
            scans,
            passes,
        };
        work(&mut runs);
        (runs.list, groups)
    }

    fn submit(&mut self, list: &[Run]) -> Result<(), GpuError> {
        match &self.arrays {
            None => Err(GpuError::Host("there are no particles")),
            Some(arrays) => self.kernels.submit(&self.device, &arrays.groups, list),
        }
    }

    fn clear_status(&mut self) {
        let Some(arrays) = &self.arrays else { return };
        self.sequence = 0;
        let clear = [0, u32::MAX, u32::MAX, u32::MAX, u32::MAX, 0, 0, 0, 0, 0, 0];
        self.device.queue.write_buffer(&arrays.buffers[STATUS], 0, bytemuck::cast_slice(&clear));
    }

    /// Reads and clears what kernels reported.
    fn status(&mut self) -> Result<Status, GpuError> {
        let Some(arrays) = &self.arrays else { return Err(GpuError::Host("there are no particles")) };
        let found: Vec<Status> = read(&self.device, &arrays.buffers[STATUS], size_of::<Status>() as u64)?;
        let status = found[0];
        (0..2).for_each(|k| self.out_of_bounds[k] += u64::from(status.out_of_bounds[k]));
        (0..3).for_each(|k| self.effort[k] += u64::from(status.effort[k]));
        self.clear_status();
        Ok(status)
    }

    /// The fault that kernels reported, of a step.
    fn fault(&self, status: &Status) -> Option<impl Fn(u64) -> Stop + use<>> {
        let found = status.tags.iter().position(|tag| *tag != u32::MAX);
        let tag = found.map_or(0, |reason| status.tags[reason] as i32);
        found.map(|reason| {
            move |step| match reason {
                0 => Stop::Velocity { step, tag },
                1 => Stop::Runaway { step, tag },
                2 => Stop::ExcessFreeEnergy { step, tag },
                _ => Stop::Force { step, tag },
            }
        })
    }
}

/// The arguments of the implicit thermostat's kernels.
#[derive(Debug, Clone, Copy)]
struct Heat {
    arguments: Arguments,
    of_virial: Option<Arguments>,
}

impl Heat {
    fn iterate(&self, runs: &mut Runs, iterations: u32) {
        for _ in 0..iterations {
            runs.push("heat_image", false, runs.groups, self.arguments);
            runs.push("heat_decide", false, 1, self.arguments);
            runs.push("heat_advance", false, runs.groups, self.arguments);
            runs.push("heat_judge", false, 1, self.arguments);
            runs.push("heat_turn", false, runs.groups, self.arguments);
        }
        if let Some(arguments) = self.of_virial {
            runs.push("heat_virial", false, runs.groups, arguments);
        }
        runs.push("heat_apply", false, runs.groups, self.arguments);
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
