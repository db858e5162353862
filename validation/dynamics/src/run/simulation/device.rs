//! The processor that makes the steps.

use super::{RunError, Simulation};
use crate::device::{Device, DeviceError};

impl Simulation {
    /// Sets the processor of later steps; a new simulation is on the CPU.
    pub fn use_device(&mut self, device: Device) -> Result<(), RunError> {
        match device {
            Device::Cpu => Ok(()),
            Device::Gpu(_) if !self.engine().plan().walls().is_empty() => {
                Err(DeviceError::Lacks("walls of matter".into()).into())
            }
            #[cfg(feature = "gpu")]
            Device::Gpu(number) => self.use_gpu(number),
            #[cfg(not(feature = "gpu"))]
            Device::Gpu(_) => Err(DeviceError::NotBuilt.into()),
        }
    }

    /// The GPU in words; `None` for the CPU.
    pub fn device_name(&self) -> Option<String> {
        #[cfg(feature = "gpu")]
        return self.gpu_name();
        #[cfg(not(feature = "gpu"))]
        None
    }

    /// The processor and its arithmetic, which rounding depends on.
    pub(in crate::run) fn arithmetic(&self) -> String {
        self.device_name().unwrap_or_else(|| self.settings().instructions.to_string())
    }

    /// Copies the particles of the present step from the device into the arrays of the host. Until then the arrays are
    /// those of an earlier step; totals, temperature and pressure are always those of the present one.
    pub(super) fn fetch(&mut self) -> Result<(), RunError> {
        #[cfg(feature = "gpu")]
        self.fetch_from_gpu()?;
        Ok(())
    }

    /// Whether the arrays of the host are those of the present step.
    pub(super) fn is_here(&self) -> bool {
        #[cfg(feature = "gpu")]
        return self.is_fetched();
        #[cfg(not(feature = "gpu"))]
        true
    }
}
