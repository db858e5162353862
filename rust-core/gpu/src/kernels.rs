//! Compiled kernels, and lists of their runs.

use crate::shader::{LANES, Shader};
use crate::{Device, GpuError, Timing};
use std::collections::HashMap;
use wgpu::BufferUsages as Usage;

/// The arguments of one run: see `Step` of `wgsl/common.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Arguments {
    pub numbers: [f32; 4],
    pub key: [u32; 2],
    pub sequence: u32,
    pub flags: u32,
}

/// Flags of [`Arguments`].
pub const DEFERRED: u32 = 1;
pub const NOISE: u32 = 4;

/// One run of a kernel.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    pub kernel: &'static str,
    /// Whether it computes totals too.
    pub totals: bool,
    /// Which arrays hold the particles.
    pub side: usize,
    pub groups: u32,
    pub arguments: Arguments,
}

/// Workgroups in a row: more take several rows.
const ROW: u32 = 32_768;

#[derive(Debug)]
pub struct Kernels {
    shader: Shader,
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    pub groups_layout: wgpu::BindGroupLayout,
    pipelines: HashMap<(&'static str, bool), wgpu::ComputePipeline>,
    is_tilted: bool,
    clock: Option<Clock>,
}

/// Measures the time of each kernel.
#[derive(Debug)]
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
    /// Runs and seconds.
    times: HashMap<&'static str, (u64, f64)>,
}

/// Timestamps of one submission.
const STAMPS: u32 = 2048;

impl Kernels {
    pub fn new(device: &Device, shader: Shader, is_tilted: bool) -> Result<Kernels, GpuError> {
        let entries: Vec<_> = (0..21)
            .map(|binding| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: if binding < 2 {
                        wgpu::BufferBindingType::Uniform
                    } else {
                        wgpu::BufferBindingType::Storage { read_only: false }
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let gpu = &device.device;
        let groups_layout =
            gpu.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let layout = gpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&groups_layout)],
            immediate_size: size_of::<Arguments>() as u32,
        });
        let module = module(device, &shader)?;
        Ok(Kernels {
            shader,
            module,
            layout,
            groups_layout,
            pipelines: HashMap::new(),
            is_tilted,
            clock: None,
        })
    }

    /// Takes another box, and compiles anew if it is tilted and the other was not, or the reverse.
    pub fn set_tilted(&mut self, is_tilted: bool) {
        if is_tilted != self.is_tilted {
            self.pipelines.clear();
        }
        self.is_tilted = is_tilted;
    }

    pub fn shader(&self) -> &Shader {
        &self.shader
    }

    /// Takes another fluid, and compiles anew if its text differs.
    pub fn replace(&mut self, device: &Device, shader: Shader) -> Result<(), GpuError> {
        if shader.text != self.shader.text {
            self.module = module(device, &shader)?;
            self.pipelines.clear();
        }
        self.shader = shader;
        Ok(())
    }

    fn compile(&mut self, device: &Device, run: &Run) -> Result<(), GpuError> {
        if self.pipelines.contains_key(&(run.kernel, run.totals)) {
            return Ok(());
        }
        let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let constants = &[("TOTALS", flag(run.totals)), ("TILTED", flag(self.is_tilted))];
        let pipeline = device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(run.kernel),
            layout: Some(&self.layout),
            module: &self.module,
            entry_point: Some(run.kernel),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        });
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(device.failed(format!("kernel {}: {error}", run.kernel)));
        }
        self.pipelines.insert((run.kernel, run.totals), pipeline);
        Ok(())
    }

    /// Sends runs to the device, one after the other.
    pub fn submit(
        &mut self,
        device: &Device,
        groups: &[wgpu::BindGroup; 2],
        runs: &[Run],
    ) -> Result<(), GpuError> {
        for run in runs {
            self.compile(device, run)?;
        }
        let parts = if self.clock.is_some() { STAMPS as usize / 2 } else { runs.len().max(1) };
        for runs in runs.chunks(parts) {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            match &self.clock {
                None => self.encode(&mut encoder, groups, runs, None),
                Some(clock) => {
                    for (k, run) in runs.iter().enumerate() {
                        let stamps = wgpu::ComputePassTimestampWrites {
                            query_set: &clock.queries,
                            beginning_of_pass_write_index: Some(2 * k as u32),
                            end_of_pass_write_index: Some(2 * k as u32 + 1),
                        };
                        self.encode(&mut encoder, groups, std::slice::from_ref(run), Some(stamps));
                    }
                    let all = 2 * runs.len() as u32;
                    encoder.resolve_query_set(&clock.queries, 0..all, &clock.resolved, 0);
                    encoder.copy_buffer_to_buffer(&clock.resolved, 0, &clock.read, 0, u64::from(8 * all));
                }
            }
            device.queue.submit([encoder.finish()]);
            if let Some(clock) = &mut self.clock {
                let stamps: Vec<u64> = read_mapped(device, &clock.read, 16 * runs.len() as u64)?;
                let period = f64::from(device.queue.get_timestamp_period()) * 1e-9;
                for (run, stamps) in runs.iter().zip(stamps.chunks_exact(2)) {
                    let (count, seconds) = clock.times.entry(run.kernel).or_default();
                    *count += 1;
                    *seconds += stamps[1].saturating_sub(stamps[0]) as f64 * period;
                }
            }
        }
        Ok(())
    }

    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        groups: &[wgpu::BindGroup; 2],
        runs: &[Run],
        timestamp_writes: Option<wgpu::ComputePassTimestampWrites>,
    ) {
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: None, timestamp_writes });
        for run in runs {
            let Some(pipeline) = self.pipelines.get(&(run.kernel, run.totals)) else { continue };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &groups[run.side], &[]);
            pass.set_immediates(0, bytemuck::bytes_of(&run.arguments));
            pass.dispatch_workgroups(run.groups.min(ROW), run.groups.div_ceil(ROW), 1);
        }
    }

    pub fn measure_time(&mut self, device: &Device, on: bool) {
        let buffer = |usage| device.buffer(u64::from(8 * STAMPS), usage);
        self.clock = on.then(|| Clock {
            queries: device.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count: STAMPS,
            }),
            resolved: buffer(Usage::QUERY_RESOLVE | Usage::COPY_SRC),
            read: buffer(Usage::MAP_READ | Usage::COPY_DST),
            times: HashMap::new(),
        });
    }

    pub fn timings(&self) -> Vec<Timing> {
        let times = self.clock.iter().flat_map(|clock| &clock.times);
        let mut all: Vec<Timing> = times
            .map(|(kernel, (runs, seconds))| Timing {
                kernel: (*kernel).to_owned(),
                runs: *runs,
                seconds: *seconds,
            })
            .collect();
        all.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        all
    }
}

/// Number of workgroups for `count` invocations.
pub fn groups_of(count: usize) -> u32 {
    count.div_ceil(LANES as usize) as u32
}

fn module(device: &Device, shader: &Shader) -> Result<wgpu::ShaderModule, GpuError> {
    let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let descriptor = wgpu::ShaderModuleDescriptor {
        label: Some("psidpd"),
        source: wgpu::ShaderSource::Wgsl(shader.text.as_str().into()),
    };
    // Without counters in every loop, which would add to the cost of each candidate of a pair.
    let checks =
        wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
    // SAFETY: all loops end: they count up to a constant, to a number of particles, cells or rows of a table, or halve.
    let module = unsafe { device.device.create_shader_module_trusted(descriptor, checks) };
    match pollster::block_on(scope.pop()) {
        Some(error) => Err(device.failed(error)),
        None => Ok(module),
    }
}

/// Copies the beginnings of buffers to the host, one after the other.
pub fn read<T: bytemuck::Pod>(device: &Device, parts: &[(&wgpu::Buffer, u64)]) -> Result<Vec<T>, GpuError> {
    let bytes = parts.iter().map(|(_, bytes)| bytes).sum();
    let mut staging = device.staging.lock().map_err(|error| device.failed(error))?;
    let staging = match &mut *staging {
        Some(buffer) if buffer.size() >= bytes => buffer,
        other => other.insert(device.buffer(bytes, Usage::MAP_READ | Usage::COPY_DST)),
    };
    let mut encoder = device.device.create_command_encoder(&Default::default());
    let mut to = 0;
    for (buffer, bytes) in parts.iter().filter(|(_, bytes)| *bytes > 0) {
        encoder.copy_buffer_to_buffer(buffer, 0, staging, to, *bytes);
        to += bytes;
    }
    device.queue.submit([encoder.finish()]);
    read_mapped(device, staging, bytes)
}

fn read_mapped<T: bytemuck::Pod>(
    device: &Device,
    buffer: &wgpu::Buffer,
    bytes: u64,
) -> Result<Vec<T>, GpuError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.slice(..bytes).map_async(wgpu::MapMode::Read, move |result| {
        // The receiver lives until the end of this function.
        let _ = sender.send(result);
    });
    device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| device.failed(error))?;
    let mapped = receiver.recv().map_err(|error| device.failed(error))?;
    mapped.map_err(|error| device.failed(error))?;
    let view = buffer.slice(..bytes).get_mapped_range().map_err(|error| device.failed(error))?;
    let values = bytemuck::pod_collect_to_vec(&view);
    drop(view);
    buffer.unmap();
    Ok(values)
}
