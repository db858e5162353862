//! The devices of this machine.

use crate::GpuError;
use std::fmt;
use std::sync::{Arc, Mutex};
use wgpu::{
    Adapter, Backend, Backends, Buffer, BufferDescriptor, BufferUsages, DeviceType, Features, Instance,
    InstanceDescriptor, Limits,
};

/// A device that can run simulations.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// Index for [`Device::open`].
    pub index: usize,
    /// Name of the device.
    pub name: String,
    /// The interface: `vulkan` or `metal`.
    pub backend: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub kind: String,
    /// Name and version of the driver.
    pub driver: String,
}

impl fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DeviceInfo { index, name, backend, driver, .. } = self;
        write!(f, "gpu:{index}, {name} ({backend}, {driver})")
    }
}

/// Lists the devices: graphics cards first, then devices that share the processor's memory, then software.
///
/// # Errors
/// There is none.
pub fn devices() -> Result<Vec<DeviceInfo>, GpuError> {
    Ok(adapters()?.into_iter().map(|(info, _)| info).collect())
}

fn adapters() -> Result<Vec<(DeviceInfo, Adapter)>, GpuError> {
    let backends = Backends::VULKAN | Backends::METAL;
    let instance =
        Instance::new(InstanceDescriptor { backends, ..InstanceDescriptor::new_without_display_handle() });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    let rank = |adapter: &Adapter| match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    };
    adapters.sort_by_key(rank);
    if adapters.is_empty() {
        return Err(GpuError::NoDevice);
    }
    let describe = |(index, adapter): (usize, Adapter)| {
        let info = adapter.get_info();
        let kind = match info.device_type {
            DeviceType::DiscreteGpu => "discrete",
            DeviceType::IntegratedGpu => "integrated",
            DeviceType::VirtualGpu => "virtual",
            DeviceType::Cpu => "cpu",
            DeviceType::Other => "other",
        };
        let backend = if info.backend == Backend::Metal { "metal" } else { "vulkan" };
        let driver = format!("{} {}", info.driver, info.driver_info).trim().to_owned();
        (DeviceInfo { index, name: info.name, backend: backend.into(), kind: kind.into(), driver }, adapter)
    };
    Ok(adapters.into_iter().enumerate().map(describe).collect())
}

/// An open device.
#[derive(Debug, Clone)]
pub struct Device {
    info: DeviceInfo,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) limits: Arc<Limits>,
    pub(crate) has_timestamps: bool,
    /// Memory that both sides see, through which results come back.
    pub(crate) staging: Arc<Mutex<Option<Buffer>>>,
}

/// Storage buffers that the kernels bind.
const STORAGE_BUFFERS: u32 = 19;

impl Device {
    /// Opens the device of an index of [`devices`], or the first.
    ///
    /// # Errors
    /// There is none, or it lacks something that every simulation needs.
    pub fn open(index: Option<usize>) -> Result<Device, GpuError> {
        let mut all = adapters()?;
        let index = index.unwrap_or(0);
        if index >= all.len() {
            return Err(GpuError::Index { index, count: all.len() });
        }
        let (info, adapter) = all.swap_remove(index);
        let failed = |reason: String| GpuError::Device { name: info.name.clone(), reason };
        let (has, limits) = (adapter.features(), adapter.limits());
        if !has.contains(Features::IMMEDIATES) {
            return Err(failed("it has no push constants".into()));
        }
        if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
            return Err(failed(format!(
                "its kernels have {} buffers, {STORAGE_BUFFERS} are needed",
                limits.max_storage_buffers_per_shader_stage
            )));
        }
        let required_features = Features::IMMEDIATES | (has & Features::TIMESTAMP_QUERY);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("psidpd"),
            required_features,
            required_limits: limits.clone(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| failed(error.to_string()))?;
        let has_timestamps = required_features.contains(Features::TIMESTAMP_QUERY);
        let (limits, staging) = (Arc::new(limits), Arc::default());
        Ok(Device { info, device, queue, limits, has_timestamps, staging })
    }

    /// Describes the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    pub(crate) fn buffer(&self, size: u64, usage: BufferUsages) -> Buffer {
        self.device.create_buffer(&BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    }

    pub(crate) fn failed(&self, reason: impl ToString) -> GpuError {
        GpuError::Device { name: self.info.name.clone(), reason: reason.to_string() }
    }
}
