//! What kernels report: faults, evaluations out of bounds, and the effort of the implicit thermostat.

use super::GpuSimulation;
use super::arrays::STATUS;
use crate::kernels::{Run, read};
use crate::{Fault, GpuError, Stop};

/// `Status` of `wgsl/common.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Status {
    pub(super) failed: u32,
    /// Lowest tag with a velocity, a move, a ψ and a force that fails.
    pub(super) tags: [u32; 4],
    pub(super) unfinished: u32,
    pub(super) out_of_bounds: [u32; 2],
    pub(super) effort: [u32; 3],
    pub(super) state: u32,
    pub(super) rest: [u32; 8],
}

impl GpuSimulation {
    pub(super) fn submit(&mut self, list: &[Run]) -> Result<(), GpuError> {
        match &self.arrays {
            None => Err(GpuError::Host("there are no particles")),
            Some(arrays) => self.kernels.submit(&self.device, &arrays.groups, list),
        }
    }

    pub(super) fn clear_status(&mut self) {
        let Some(arrays) = &self.arrays else { return };
        self.sequence = 0;
        let clear = [0, u32::MAX, u32::MAX, u32::MAX, u32::MAX, 0, 0, 0, 0, 0, 0];
        self.device.queue.write_buffer(&arrays.buffers[STATUS], 0, bytemuck::cast_slice(&clear));
    }

    /// Reads and clears what kernels reported.
    pub(super) fn status(&mut self) -> Result<Status, GpuError> {
        let Some(arrays) = &self.arrays else { return Err(GpuError::Host("there are no particles")) };
        let found = read(&self.device, &[(&arrays.buffers[STATUS], size_of::<Status>() as u64)])?;
        self.count_status(&found[0]);
        self.clear_status();
        Ok(found[0])
    }

    pub(super) fn count_status(&mut self, status: &Status) {
        (0..2).for_each(|k| self.out_of_bounds[k] += u64::from(status.out_of_bounds[k]));
        (0..3).for_each(|k| self.effort[k] += u64::from(status.effort[k]));
    }

    /// The fault that kernels reported, in step `step`.
    pub(super) fn fault(&self, status: &Status, step: u64) -> Option<Stop> {
        let faults = [Fault::Velocity, Fault::Runaway, Fault::ExcessFreeEnergy, Fault::Force];
        let found = faults.into_iter().zip(status.tags).find(|(_, tag)| *tag != u32::MAX);
        found.map(|(fault, tag)| Stop { step, tag: tag as i32, fault })
    }
}
