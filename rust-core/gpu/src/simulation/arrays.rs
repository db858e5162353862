//! The buffers of a number of particles on the device.

use super::GpuSimulation;
use super::status::Status;
use crate::kernels::groups_of;
use crate::settings::MOST_BODY_FORCES;
use crate::shader::{ENTRIES, SCAN};
use crate::{GpuError, Unsupported};
use wgpu::BufferUsages as Usage;

/// Buffers for a number of particles.
#[derive(Debug)]
pub(super) struct Arrays {
    pub(super) buffers: Vec<wgpu::Buffer>,
    pub(super) groups: [wgpu::BindGroup; 2],
    /// Workgroups of the scan.
    pub(super) scans: u32,
    pub(super) has_thermostat: bool,
    /// Particles and cells that fit in.
    pub(super) room: (usize, u64),
}

/// Bindings of `wgsl/common.wgsl`.
pub(super) const PARAMS: usize = 0;
pub(super) const CONSTANTS: usize = 1;
pub(super) const POSITIONS: usize = 2;
pub(super) const VELOCITIES: usize = 3;
pub(super) const BOXES: usize = 4;
pub(super) const FORCES: usize = 8;
pub(super) const COUNTS: usize = 9;
pub(super) const STATUS: usize = 14;
pub(super) const SUMS: usize = 15;
pub(super) const TABLES: usize = 16;
pub(super) const EXCHANGE: usize = 17;

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

impl GpuSimulation {
    /// Creates the buffers, with those of the implicit thermostat if asked for; particles keep their place.
    pub(super) fn allocate(&mut self, thermostat: bool) -> Result<(), GpuError> {
        if self.arrays.as_ref().is_some_and(|arrays| arrays.has_thermostat || !thermostat) {
            return Ok(());
        }
        self.allocate_room((self.count, self.cells()), thermostat, 0)
    }

    /// Number of cells.
    pub(super) fn cells(&self) -> u64 {
        let along = self.geometry.cells(self.fluid.cutoff(), self.count);
        along.iter().map(|n| u64::from(*n)).product()
    }

    /// Creates the buffers for numbers of particles and cells; `exchange` numbers of each particle go to the host.
    pub(super) fn allocate_room(
        &mut self,
        room: (usize, u64),
        thermostat: bool,
        exchange: u64,
    ) -> Result<(), GpuError> {
        let (count, cells) = (room.0 as u64, room.1 + 1);
        let scans = cells.div_ceil(u64::from(SCAN));
        let shader = self.kernels.shader();
        let vectors = 16 * count;
        let of_thermostat = if thermostat { vectors } else { 16 };
        let mut sizes = vec![size_of::<Params>() as u64, 4 * shader.constants.len() as u64];
        // Particles twice, as sorting copies them, and forces.
        sizes.extend([vectors; 7]);
        sizes.extend([4 * cells, 4 * scans * u64::from(SCAN), 4 * scans, 8 * count]);
        sizes.extend([4 * count * shader.variables.max(1) as u64, size_of::<Status>() as u64]);
        sizes.extend([u64::from(4 * ENTRIES * groups_of(room.0)), 4 * shader.tables.len() as u64]);
        sizes.extend([of_thermostat.max(4 * exchange * count), of_thermostat, of_thermostat, of_thermostat]);
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
                _ => {
                    let usage = if k < 2 { Usage::UNIFORM } else { Usage::STORAGE };
                    self.device.buffer(*size, Usage::COPY_DST | Usage::COPY_SRC | usage)
                }
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
        let write = |k: usize, numbers| {
            self.device.queue.write_buffer(&buffers[k], 0, bytemuck::cast_slice(numbers));
        };
        write(CONSTANTS, &shader.constants);
        write(TABLES, &shader.tables);
        self.arrays = Some(Arrays { buffers, groups, scans: scans as u32, has_thermostat: thermostat, room });
        Ok(())
    }

    pub(super) fn write_params(&self) {
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
}
