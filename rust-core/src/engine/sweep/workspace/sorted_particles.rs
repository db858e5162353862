//! Particles in the order of cells, as the passes read them.

mod fill;

use super::cell_order::CellOrder;
use super::input::VECTOR_PADDING;
use psidpd_passes::cells::ghosts::{Ghosts, OwnedOfColumn};
use psidpd_passes::ground::arithmetic::PackedParticle;
use psidpd_passes::ground::fixed_point::FixedPoint16;
use psidpd_threads::{Pool, SharedSlice, part, take};
use std::ops::Range;

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
    pub fn make_room(&mut self, pool: &Pool, order: &CellOrder, multispecies: bool) {
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
        self.find_owned(pool, order);
    }

    /// If there are ghosts, finds their flags, and the owned particles of each column, including the copies.
    fn find_owned(&mut self, pool: &Pool, order: &CellOrder) {
        self.owned_of_column.clear();
        self.owned_bits.clear();
        if self.ghost.is_empty() {
            return;
        }
        /// Groups of eight particles and their bits, the first column of some, and these.
        type Part<'a> = (Range<usize>, &'a mut [u8], usize, &'a mut [OwnedOfColumn]);
        let cells_per_column = order.grid.cells_per_column;
        self.owned_of_column.resize((order.start.len() - 1) / cells_per_column, OwnedOfColumn::default());
        self.owned_bits.resize(self.ghost.len() / 8 + VECTOR_PADDING, 0);
        let (eights, columns) = (self.ghost.len() / 8, self.owned_of_column.len());
        let ghost = SharedSlice::new(&mut self.ghost);
        let (mut bits, mut of_column) = (&mut self.owned_bits[..eights], &mut self.owned_of_column[..]);
        let of_thread = |t: usize| {
            let (eights, columns) = (part(eights, t, pool.threads()), part(columns, t, pool.threads()));
            let (bits, of_column) = (take(&mut bits, eights.len()), take(&mut of_column, columns.len()));
            (eights, bits, columns.start, of_column)
        };
        let mut parts: Vec<_> = (0..pool.threads()).map(of_thread).collect();
        let (all, copies) = (order.particles(), order.copies());
        let find_flags = |(eights, bits, ..): &mut Part| {
            // SAFETY: the ranges of different threads are disjoint.
            let flags = unsafe { ghost.slice_mut(8 * eights.start..8 * eights.end) };
            let first = all.min(8 * eights.start);
            let (own, beyond) = flags.split_at_mut(all.min(8 * eights.end) - first);
            for (flag, k) in own.iter_mut().zip(&order.order[first..]) {
                *flag = *k as usize >= order.owned;
            }
            // Copies of the first particles follow the last one, then padding.
            let copied = (8 * eights.start).max(all) - all;
            for (flag, k) in beyond.iter_mut().zip(&order.order[copied.min(all)..]) {
                *flag = *k as usize >= order.owned;
            }
            for (bits, eight) in bits.iter_mut().zip(flags.as_chunks::<8>().0) {
                *bits = bits_of_owned(eight);
            }
        };
        let find_columns = |(_, _, first, of_column): &mut Part| {
            // SAFETY: no thread writes flags in this stage.
            let ghost = unsafe { ghost.slice(0..all + copies) };
            for (column, owned) in (*first..).zip(of_column.iter_mut()) {
                let [start, end] =
                    [column, column + 1].map(|column| order.start[column * cells_per_column] as usize);
                let ghosts = &ghost[start..end];
                owned.with_ghosts = ghosts.contains(&true);
                if let Some(a) = ghosts.iter().position(|g| !*g) {
                    let b = ghosts.iter().rposition(|g| !*g).unwrap_or(a);
                    owned.range = [start + a, start + b + 1].map(|at| at as u32);
                }
            }
        };
        pool.in_stages(&mut parts, &[&find_flags, &find_columns]);
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
