//! Accumulators: the sums over pairs of forces and densities. Each plane has accumulators for its own particles and
//! for those of the next plane, so that the order of every sum is fixed, whichever thread works on a plane.

use super::cell_order::CellOrder;
use psidpd_passes::pair_batch::accumulators::Accumulator;
use std::ops::Range;

/// Number of blocks of accumulators of a thread slab. The blocks of its first two planes are kept until
/// all threads are done; the other planes reuse three blocks in turn.
const ACCUMULATOR_SLOTS: usize = 2 + TURNS;

/// Number of planes whose accumulators are needed at once. When a plane begins, the previous plane still lacks its
/// many-body forces, and the additions of the plane before that to it are not yet part of the forces.
const TURNS: usize = 3;

/// The accumulators of all planes. Those of a thread slab are contiguous.
#[derive(Default)]
pub struct AccumulatorArrays {
    /// For each plane: index of an accumulator minus index of its particle.
    offset: Vec<isize>,
    /// Number of accumulators of each thread slab.
    slab_sizes: Vec<usize>,
    /// Force sums, and density sums if there is one variable.
    forces: Vec<Accumulator>,
    /// Density sums, if there are several variables: `quads` for each particle.
    densities: Vec<Accumulator>,
    quads: usize,
}

/// The accumulators of one thread slab.
pub struct SlabSums<'a> {
    forces: &'a mut [Accumulator],
    densities: &'a mut [Accumulator],
    offset: &'a [isize],
    begin: usize,
    quads: usize,
}

/// Accumulators for reading: of one thread slab, or of all.
#[derive(Clone, Copy)]
pub struct Sums<'a> {
    forces: &'a [Accumulator],
    densities: &'a [Accumulator],
    offset: &'a [isize],
    begin: usize,
    quads: usize,
}

/// The sums of consecutive particles over the pairs of one plane.
#[derive(Clone, Copy)]
pub struct Added<'a> {
    pub forces: &'a [Accumulator],
    pub densities: &'a [Accumulator],
}

impl AccumulatorArrays {
    /// Lays out accumulators for thread slabs, for `variables` densities. All planes but the first two
    /// of a slab share blocks with the third plane after them.
    pub fn lay_out(&mut self, order: &CellOrder, slabs: &[Range<usize>], variables: usize) {
        self.offset.clear();
        self.slab_sizes.clear();
        let mut begin = 0;
        for slab in slabs {
            let slot = |plane: usize| match plane - slab.start {
                k if k < ACCUMULATOR_SLOTS => k,
                k => ACCUMULATOR_SLOTS - TURNS + (k - ACCUMULATOR_SLOTS) % TURNS,
            };
            let mut sizes = [0; ACCUMULATOR_SLOTS];
            for plane in slab.clone() {
                let size = block_size(order, plane);
                sizes[slot(plane)] = size.max(sizes[slot(plane)]);
            }
            let mut end = begin;
            let mut begins = Vec::with_capacity(sizes.len());
            for size in &sizes {
                begins.push(end);
                end += size;
            }
            let places =
                slab.clone().map(|plane| begins[slot(plane)] as isize - order.plane_start(plane) as isize);
            self.offset.extend(places);
            self.slab_sizes.push(end - begin);
            begin = end;
        }
        self.quads = if variables > 1 { variables.div_ceil(4) } else { 0 };
        self.forces.resize(begin, Accumulator::default());
        self.densities.resize(self.quads * begin, Accumulator::default());
    }

    /// Splits the accumulators by thread slab.
    pub fn split(&mut self) -> impl Iterator<Item = SlabSums<'_>> {
        let AccumulatorArrays { offset, slab_sizes, forces, densities, quads } = self;
        let (offset, quads) = (&offset[..], *quads);
        let (mut forces, mut densities, mut next) = (&mut forces[..], &mut densities[..], 0);
        slab_sizes.iter().map(move |size| {
            let (of_slab, behind) = std::mem::take(&mut forces).split_at_mut(*size);
            forces = behind;
            let (densities_of_slab, behind) = std::mem::take(&mut densities).split_at_mut(quads * size);
            densities = behind;
            let begin = next;
            next += size;
            SlabSums { forces: of_slab, densities: densities_of_slab, offset, begin, quads }
        })
    }

    /// Read access to all accumulators.
    pub fn sums(&self) -> Sums<'_> {
        let AccumulatorArrays { offset, forces, densities, quads, .. } = self;
        Sums { forces, densities, offset, begin: 0, quads: *quads }
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        (self.forces.capacity() + self.densities.capacity()) * size_of::<Accumulator>()
    }
}

/// Number of accumulators of a plane: of its own particles and of those of the next.
fn block_size(order: &CellOrder, plane: usize) -> usize {
    order.plane(plane).1 + order.next_plane(plane)
}

impl SlabSums<'_> {
    /// The force and density accumulators of a plane: of its own particles, then of those of the next plane.
    pub fn of_plane(&mut self, order: &CellOrder, plane: usize) -> [&mut [Accumulator]; 2] {
        let first = (order.plane_start(plane) as isize + self.offset[plane]) as usize - self.begin;
        let range = first..first + block_size(order, plane);
        let quads = self.quads;
        [&mut self.forces[range.clone()], &mut self.densities[quads * range.start..quads * range.end]]
    }

    /// Read access to the accumulators of the slab.
    pub fn sums(&self) -> Sums<'_> {
        let SlabSums { forces, densities, offset, begin, quads } = self;
        Sums { forces, densities, offset, begin: *begin, quads: *quads }
    }
}

impl<'a> Sums<'a> {
    /// The sums of particles of a plane: over the pairs of that plane, and over those of the previous plane.
    pub fn of_particles(
        &self,
        order: &CellOrder,
        plane: usize,
        particles: Range<usize>,
    ) -> (Added<'a>, Option<Added<'a>>) {
        let before = match plane {
            // The copies of the first plane follow the last particle.
            0 if order.is_periodic() => Some(self.offset[order.grid.planes - 1] + order.particles() as isize),
            0 => None,
            _ => Some(self.offset[plane - 1]),
        };
        let of = |offset: isize| {
            let first = (particles.start as isize + offset) as usize - self.begin;
            let end = first + particles.len();
            Added {
                forces: &self.forces[first..end],
                densities: &self.densities[self.quads * first..self.quads * end],
            }
        };
        (of(self.offset[plane]), before.map(of))
    }
}
