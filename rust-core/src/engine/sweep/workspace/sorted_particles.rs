//! Particles in the order of cells, as the passes read them.

mod fill;

use super::cell_order::CellOrder;
use super::input::VECTOR_PADDING;
use psidpd_passes::cells::ghosts::{Ghosts, OwnedOfColumn};
use psidpd_passes::ground::arithmetic::PackedParticle;
use psidpd_passes::ground::fixed_point::FixedPoint16;
use psidpd_threads::SharedSlice;

/// Arrays in the order of cells; copies of the first plane follow the last particle, then padding.
#[derive(Clone, Default)]
pub struct SortedParticles<R> {
    /// Positions relative to the origin of the box.
    pub x: [Vec<f32>; 3],
    pub fixed16_scale: FixedPoint16,
    pub fixed16: [Vec<u16>; 3],
    pub packed: Vec<R>,
    /// Species of the particles; empty with one species.
    pub species: Vec<u8>,
    /// Ghost flags; these and the next two arrays are empty without ghosts.
    pub ghost: Vec<bool>,
    owned_bits: Vec<u8>,
    owned_of_column: Vec<OwnedOfColumn>,
}

/// The arrays while passes run: threads fill the particles of their own slabs, and read these and one plane more.
pub struct SharedParticles<'a, R> {
    pub x: [SharedSlice<'a, f32>; 3],
    pub fixed16_scale: FixedPoint16,
    pub fixed16: [SharedSlice<'a, u16>; 3],
    pub packed: SharedSlice<'a, R>,
    pub species: SharedSlice<'a, u8>,
    pub ghosts: Ghosts<'a>,
}

impl<R: PackedParticle> SortedParticles<R> {
    /// Makes room for all particles of an order and the copies of the first plane, and finds ghosts.
    pub fn make_room(&mut self, order: &CellOrder, multispecies: bool) {
        let total = order.particles() + order.copies();
        let with_ghosts = order.owned < order.all;
        self.fixed16_scale = FixedPoint16::new(&order.geometry, &order.grid);
        for x in &mut self.x {
            x.resize(total + VECTOR_PADDING, 0.0);
        }
        // A j-cluster of sixteen, and one that is not used, may begin after the last particle.
        for fixed16 in &mut self.fixed16 {
            fixed16.resize(total + 4 * VECTOR_PADDING, 0);
        }
        self.packed.resize(total + VECTOR_PADDING, R::default());
        self.species.resize(if multispecies { total.max(1) } else { 0 }, 0);
        self.ghost.resize(if with_ghosts { (total + VECTOR_PADDING).next_multiple_of(8) } else { 0 }, false);
        self.find_owned(order);
    }

    /// If there are ghosts, finds their flags, and the owned particles of each column, including the copies.
    fn find_owned(&mut self, order: &CellOrder) {
        self.owned_of_column.clear();
        self.owned_bits.clear();
        if self.ghost.is_empty() {
            return;
        }
        for (ghost, k) in self.ghost.iter_mut().zip(&order.order) {
            *ghost = *k as usize >= order.owned;
        }
        self.ghost.copy_within(..order.copies(), order.particles());
        self.owned_bits.extend(self.ghost.as_chunks::<8>().0.iter().map(bits_of_owned));
        self.owned_bits.resize(self.owned_bits.len() + VECTOR_PADDING, 0);
        let cells_per_column = order.grid.cells_per_column;
        for column in 0..(order.start.len() - 1) / cells_per_column {
            let [first, end] =
                [column, column + 1].map(|column| order.start[column * cells_per_column] as usize);
            let ghosts = &self.ghost[first..end];
            let mut owned = OwnedOfColumn { range: [0; 2], with_ghosts: ghosts.contains(&true) };
            if let Some(a) = ghosts.iter().position(|g| !*g) {
                let b = ghosts.iter().rposition(|g| !*g).unwrap_or(a);
                owned.range = [first + a, first + b + 1].map(|at| at as u32);
            }
            self.owned_of_column.push(owned);
        }
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
            ghosts: Ghosts {
                flags: &self.ghost,
                owned_bits: &self.owned_bits,
                owned_of_column: &self.owned_of_column,
            },
        }
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        self.x.iter().map(|x| x.capacity() * size_of::<f32>()).sum::<usize>()
            + self.fixed16.iter().map(|x| x.capacity() * size_of::<u16>()).sum::<usize>()
            + self.packed.capacity() * size_of::<R>()
            + self.species.capacity()
            + self.ghost.capacity()
            + self.owned_bits.capacity()
    }
}

/// One bit for each of eight particles, set if it is not a ghost.
#[inline(always)]
fn bits_of_owned(ghosts: &[bool; 8]) -> u8 {
    // The highest byte of the product contains the lowest bits of all bytes.
    let bytes = u64::from_le_bytes(ghosts.map(u8::from));
    !(bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}
