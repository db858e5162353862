//! The processor that computes a run.

use crate::integrator::Integrator;
use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::Update;
use serde::Serialize;
use std::fmt;
use std::str::FromStr;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Device {
    #[default]
    Cpu,
    /// The GPU with this number in the list of `psidpd devices`.
    Gpu(usize),
}

impl FromStr for Device {
    type Err = String;

    /// Reads `cpu`, `gpu` (the first) or `gpu:N`.
    fn from_str(name: &str) -> Result<Device, String> {
        let digits = |text: &&str| text.bytes().all(|b| b.is_ascii_digit());
        match name.split_once(':') {
            None if name == "cpu" => Some(Device::Cpu),
            None if name == "gpu" => Some(Device::Gpu(0)),
            Some(("gpu", number)) => {
                Some(number).filter(digits).and_then(|n| n.parse().ok()).map(Device::Gpu)
            }
            _ => None,
        }
        .ok_or_else(|| {
            format!("unknown device \"{name}\"; known: cpu, gpu, gpu:N, N from the list of psidpd devices")
        })
    }
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Device::Cpu => f.write_str("cpu"),
            Device::Gpu(number) => write!(f, "gpu:{number}"),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    #[error("this psidpd was built without support for GPUs")]
    NotBuilt,
    #[error("no GPU was found: no Vulkan or Metal driver answers")]
    NotFound,
    #[error("there is no device gpu:{asked}: the last that psidpd devices lists is gpu:{last}")]
    Number { asked: usize, last: usize },
    #[error("not on a GPU: {0}")]
    Lacks(String),
    #[error("the GPU failed: {0}")]
    Failed(String),
}

impl DeviceError {
    /// Advice that the message does not contain.
    pub fn help(&self) -> Option<&'static str> {
        match self {
            DeviceError::NotBuilt => Some(
                "build it with `cargo build --release --features gpu`, the Python package with \
                 `PSIDPD_WITH_GPU=1 pip install .`; see docs/gpu.md",
            ),
            DeviceError::NotFound => Some(
                "install the driver of the graphics card with its Vulkan part, or mesa-vulkan-drivers of Debian, Ubuntu \
                 or Fedora, which also computes on the processor; see docs/gpu.md",
            ),
            DeviceError::Number { .. } => None,
            DeviceError::Lacks(_) => {
                Some("use device = \"cpu\", or --device cpu; docs/gpu.md lists what a GPU computes")
            }
            DeviceError::Failed(_) => {
                Some("docs/gpu.md names drivers; --device cpu continues a run from its checkpoint")
            }
        }
    }
}

/// A GPU, as `psidpd devices` lists it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Found {
    /// The name in scenes and options, `gpu:N`.
    pub device: String,
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` (a driver that computes on the processor) or `other`.
    pub kind: String,
    /// `vulkan` or `metal`.
    pub interface: String,
    /// Name and version.
    pub driver: String,
}

/// The GPUs of this machine, graphics cards first.
pub fn gpus() -> Result<Vec<Found>, DeviceError> {
    #[cfg(not(feature = "gpu"))]
    return Err(DeviceError::NotBuilt);
    #[cfg(feature = "gpu")]
    {
        let found = |info: psidpd_gpu::DeviceInfo| Found {
            device: Device::Gpu(info.index).to_string(),
            name: info.name,
            kind: info.kind,
            interface: info.backend,
            driver: info.driver,
        };
        Ok(psidpd_gpu::devices()?.into_iter().map(found).collect())
    }
}

/// The part of a step that GPUs do not make; `None` if they make the whole step.
pub fn refused_step(integrator: Integrator) -> Option<String> {
    match integrator {
        Integrator::VelocityVerlet => None,
        Integrator::TwoStage { coupling, .. } | Integrator::ForceGradient { coupling, .. }
            if coupling.update != Update::Midpoint =>
        {
            Some(format!("thermostat_step = \"{}\"", coupling.name()))
        }
        Integrator::TwoStage { coupling, .. } | Integrator::ForceGradient { coupling, .. }
            if coupling.noise != Law::Gaussian =>
        {
            Some("noise = \"uniform\"".into())
        }
        Integrator::TwoStage { .. } | Integrator::ForceGradient { .. } => None,
        other => Some(format!("integrator = \"{}\"", other.name())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written() {
        for (name, device) in [("cpu", Device::Cpu), ("gpu", Device::Gpu(0)), ("gpu:3", Device::Gpu(3))] {
            assert_eq!(name.parse(), Ok(device));
            assert_eq!(device.to_string().parse(), Ok(device));
        }
        for wrong in ["", "GPU", "gpu:", "gpu:+1", "gpu:-1", "gpu:x", "cpu:0", "cuda"] {
            let error = wrong.parse::<Device>().unwrap_err();
            assert!(error.contains("cpu, gpu, gpu:N"), "{error}");
        }
    }

    /// llvmpipe will do.
    #[cfg(feature = "gpu")]
    #[test]
    fn a_gpu_is_found() {
        let found = gpus().unwrap_or_else(|error| panic!("{error}: {}", error.help().unwrap_or_default()));
        for (number, gpu) in found.iter().enumerate() {
            assert_eq!(gpu.device.parse(), Ok(Device::Gpu(number)));
            println!("{}: {} ({}, {}, {})", gpu.device, gpu.name, gpu.kind, gpu.interface, gpu.driver);
        }
    }
}
