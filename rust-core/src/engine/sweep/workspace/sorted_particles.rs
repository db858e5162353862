//! Particles in the order of cells, as the passes read them.

mod fill;

use super::cell_order::CellOrder;
use super::input::VECTOR_PADDING;
use psidpd_passes::ground::arithmetic::PackedParticle;
use psidpd_passes::ground::fixed_point::FixedPoint16;
use psidpd_passes::pair_batch::room::resize;
use psidpd_threads::SharedSlice;

/// Arrays in the order of cells; copies of the first plane follow the last particle, then padding.
#[derive(Debug, Clone, Default)]
pub struct SortedParticles<R> {
    /// Positions relative to the origin of the box.
    pub x: [Vec<f32>; 3],
    pub fixed16_scale: FixedPoint16,
    pub fixed16: [Vec<u16>; 3],
    pub packed: Vec<R>,
    /// Species of the particles; empty with one species.
    pub species: Vec<u8>,
}

/// The arrays while passes run: threads fill the particles of their own slabs, and read these and one plane more.
pub struct SharedParticles<'a, R> {
    pub x: [SharedSlice<'a, f32>; 3],
    pub fixed16_scale: FixedPoint16,
    pub fixed16: [SharedSlice<'a, u16>; 3],
    pub packed: SharedSlice<'a, R>,
    pub species: SharedSlice<'a, u8>,
}

impl<R: PackedParticle> SortedParticles<R> {
    /// Makes room for all particles of an order and the copies of the first plane.
    pub fn make_room(&mut self, order: &CellOrder, multispecies: bool) {
        let total = order.particles() + order.copies();
        self.fixed16_scale = FixedPoint16::new(&order.geometry, &order.grid);
        for x in &mut self.x {
            resize(x, total + VECTOR_PADDING, 0.0);
        }
        // A j-cluster of sixteen, and one that is not used, may begin after the last particle.
        for fixed16 in &mut self.fixed16 {
            resize(fixed16, total + 4 * VECTOR_PADDING, 0);
        }
        resize(&mut self.packed, total + VECTOR_PADDING, R::default());
        resize(&mut self.species, if multispecies { total + VECTOR_PADDING } else { 0 }, 0);
    }

    /// Copies the first plane after the last, one period further.
    pub fn copy_first_plane(&mut self, order: &CellOrder) {
        let (n, copies) = (order.particles(), order.copies());
        let edge = order.geometry.edge(order.grid.plane_axis);
        for c in 0..3 {
            let shift = (edge[c] * self.fixed16_scale.per_length).round() as i64 as u16;
            for k in 0..copies {
                self.x[c][n + k] = (self.x[c][k] as f64 + edge[c]) as f32;
                self.fixed16[c][n + k] = self.fixed16[c][k].wrapping_add(shift);
            }
        }
        self.packed.copy_within(..copies, n);
        if !self.species.is_empty() {
            self.species.copy_within(..copies, n);
        }
    }

    /// Lends the arrays to the passes.
    pub fn share(&mut self) -> SharedParticles<'_, R> {
        SharedParticles {
            x: self.x.each_mut().map(|x| SharedSlice::new(x)),
            fixed16_scale: self.fixed16_scale,
            fixed16: self.fixed16.each_mut().map(|fixed16| SharedSlice::new(fixed16)),
            packed: SharedSlice::new(&mut self.packed),
            species: SharedSlice::new(&mut self.species),
        }
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        self.x.iter().map(|x| x.capacity() * size_of::<f32>()).sum::<usize>()
            + self.fixed16.iter().map(|x| x.capacity() * size_of::<u16>()).sum::<usize>()
            + self.packed.capacity() * size_of::<R>()
            + self.species.capacity()
    }
}
