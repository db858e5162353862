//! The slopes of ψ, as the second pass reads them.

use super::cell_order::CellOrder;
use super::input::VECTOR_PADDING;
use psidpd_passes::pair_batch::room::resize;
use psidpd_passes::plane::slopes::{SLOPES_PER_BLOCK, Slopes};
use psidpd_passes::simd::Scalar;
use psidpd_threads::{Pool, SharedSlice, part};
use std::ops::Range;

/// Slopes of all particles in the order of cells, then those of the copies of the first plane.
#[derive(Default)]
pub struct SlopeArrays<T> {
    /// Number of slopes of each particle.
    width: usize,
    /// A row for each particle.
    pub rows: Vec<f64>,
    /// Copies in the precision of pairs, for the full pair cache: rows of eight slopes for all particles, then rows of the
    /// next eight …
    packed: Vec<T>,
    /// Distance between the rows of eight of a particle.
    stride: usize,
}

/// The slopes while passes run: a thread writes those of its slab, and reads those of its slab and of the next plane.
#[derive(Clone, Copy)]
pub struct SharedSlopes<'a, T> {
    width: usize,
    pub slopes: Slopes<'a, T>,
}

impl<T: Scalar> SlopeArrays<T> {
    /// Makes room for all particles of an order, and for packed rows if they are requested.
    pub fn make_room(&mut self, order: &CellOrder, width: usize, packs: bool) {
        let total = order.particles() + order.copies();
        self.width = width;
        resize(&mut self.rows, width * total, 0.0);
        self.stride = SLOPES_PER_BLOCK * (total + VECTOR_PADDING);
        let blocks = if packs { width.div_ceil(SLOPES_PER_BLOCK) } else { 0 };
        resize(&mut self.packed, blocks * self.stride, T::of(0.0));
    }

    /// Lends the slopes to the passes.
    pub fn share(&mut self) -> SharedSlopes<'_, T> {
        SharedSlopes {
            width: self.width,
            slopes: Slopes {
                values: SharedSlice::new(&mut self.rows),
                packed: SharedSlice::new(&mut self.packed),
                stride: self.stride,
            },
        }
    }

    /// Takes the slopes of ghosts from rows of the host.
    pub fn take_ghosts(&mut self, pool: &Pool, order: &CellOrder, rows: &[f64]) {
        let (width, shared) = (self.width, self.share());
        pool.run(&|t| {
            for plane in part(order.grid.planes, t, pool.threads()) {
                let ghosts = order.ghosts_of(plane);
                // SAFETY: each ghost is in one plane, and each plane in the part of one thread.
                unsafe {
                    let to = shared.rows_mut(ghosts.clone());
                    let numbers = &order.order[ghosts.clone()];
                    match width {
                        1 => to.iter_mut().zip(numbers).for_each(|(to, k)| *to = rows[*k as usize]),
                        _ => {
                            for (to, k) in to.chunks_exact_mut(width).zip(numbers) {
                                to.copy_from_slice(&rows[width * *k as usize..][..width]);
                            }
                        }
                    }
                    shared.pack(ghosts, to);
                }
            }
        });
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<f64>() + self.packed.capacity() * size_of::<T>()
    }
}

impl<'a, T: Scalar> SharedSlopes<'a, T> {
    /// The rows of particles, for writing.
    ///
    /// # Safety
    /// No other thread accesses their slopes while the rows are in use.
    pub unsafe fn rows_mut(self, particles: Range<usize>) -> &'a mut [f64] {
        // SAFETY: the caller promises that no other thread accesses the rows of these particles.
        unsafe { self.slopes.values.slice_mut(self.width * particles.start..self.width * particles.end) }
    }

    /// Copies the slopes of particles to particles that are `distance` places after them.
    ///
    /// # Safety
    /// No other thread accesses the slopes of either meanwhile.
    pub unsafe fn copy(self, particles: Range<usize>, distance: usize) {
        let Slopes { values, packed, stride } = self.slopes;
        let rows = |range: &Range<usize>| self.width * range.start..self.width * range.end;
        let to = particles.start + distance..particles.end + distance;
        // SAFETY: the caller promises that no other thread accesses these slopes; the ranges do not overlap.
        unsafe {
            values.slice_mut(rows(&to)).copy_from_slice(values.slice(rows(&particles)));
            for first in (0..packed.len()).step_by(stride) {
                let eights = |range: &Range<usize>| {
                    first + SLOPES_PER_BLOCK * range.start..first + SLOPES_PER_BLOCK * range.end
                };
                packed.slice_mut(eights(&to)).copy_from_slice(packed.slice(eights(&particles)));
            }
        }
    }

    /// Packs the slopes of particles, if packed rows are requested.
    ///
    /// # Safety
    /// No other thread accesses their slopes meanwhile.
    pub unsafe fn pack(self, particles: Range<usize>, slopes: &[f64]) {
        let Slopes { packed, stride, .. } = self.slopes;
        let mut first = SLOPES_PER_BLOCK * particles.start;
        for eight in 0..packed.len() / stride {
            // SAFETY: the caller promises that no other thread accesses the packed rows of these particles.
            let to = unsafe { packed.slice_mut(first..first + SLOPES_PER_BLOCK * particles.len()) };
            match self.width {
                2 => pack_few::<2, T>(slopes, to),
                3 => pack_few::<3, T>(slopes, to),
                4 => pack_few::<4, T>(slopes, to),
                width => pack(width, eight, slopes, to),
            }
            first += stride;
        }
    }
}

/// Packs slopes, `width` of each particle, into row `eight`, which has eight slopes or the remaining ones.
fn pack<T: Scalar>(width: usize, eight: usize, slopes: &[f64], to: &mut [T]) {
    for (to, slopes) in to.as_chunks_mut::<SLOPES_PER_BLOCK>().0.iter_mut().zip(slopes.chunks_exact(width)) {
        for (to, slope) in to.iter_mut().zip(&slopes[SLOPES_PER_BLOCK * eight..]) {
            *to = T::of(*slope);
        }
    }
}

/// Packs `W` slopes of each particle, which fit into one row.
fn pack_few<const W: usize, T: Scalar>(slopes: &[f64], to: &mut [T]) {
    for (to, slopes) in to.as_chunks_mut::<SLOPES_PER_BLOCK>().0.iter_mut().zip(slopes.as_chunks::<W>().0) {
        for (to, slope) in to.iter_mut().zip(slopes) {
            *to = T::of(*slope);
        }
    }
}
