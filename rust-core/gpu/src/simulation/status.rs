//! What kernels report: faults, evaluations out of bounds, and the effort of the implicit thermostat.

use super::GpuSimulation;
use super::arrays::STATUS;
use crate::kernels::{Run, read};
use crate::{GpuError, Stop};

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

    /// The fault that kernels reported, of a step.
    pub(super) fn fault(&self, status: &Status) -> Option<impl Fn(u64) -> Stop + use<>> {
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
