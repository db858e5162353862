//! Accumulators: the sums over pairs of forces and densities. Each plane has accumulators for its own particles and
//! for those of the next plane, in as many sets as its units need: the order of every sum is fixed, whichever thread
//! works on a unit.

use super::cell_order::CellOrder;
use super::units::Unit;
use crate::engine::vectors::{self, Loop};
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::accumulators::{Accumulator, PlaneSums};
use psidpd_threads::SharedSlice;
use std::ops::Range;

/// Number of planes at the beginning of a thread slab whose accumulators are kept until all threads are done.
const KEPT: usize = 3;

/// Number of planes whose accumulators are needed at once. When a plane begins, the previous plane still lacks its
/// many-body forces, and the additions of the plane before that to it are not yet part of the forces.
const TURNS: usize = 3;

/// The accumulators of all planes.
#[derive(Default)]
pub struct AccumulatorArrays {
    /// For each set of each plane: index of an accumulator minus index of its particle.
    offset: Vec<[isize; 2]>,
    /// Force sums, and density sums if there is one variable.
    pub forces: Vec<Accumulator>,
    /// Density sums, if there are several variables: `quads` for each particle.
    densities: Vec<Accumulator>,
    quads: usize,
}

/// The accumulators while passes run: those of a unit are the accumulators of its set for the particles that it reaches.
#[derive(Clone, Copy)]
pub struct Sums<'a> {
    forces: SharedSlice<'a, Accumulator>,
    densities: SharedSlice<'a, Accumulator>,
    offset: &'a [[isize; 2]],
    quads: usize,
}

/// The sums of consecutive particles over the pairs of one plane.
#[derive(Clone, Copy)]
pub struct Added<'a> {
    pub forces: &'a [Accumulator],
    pub densities: &'a [Accumulator],
}

impl AccumulatorArrays {
    /// Lays out accumulators for thread slabs, for `variables` densities. A plane shares its accumulators with the
    /// third plane after it if both are wholly in one slab and behind its first planes.
    pub fn lay_out(&mut self, order: &CellOrder, slabs: &[Range<usize>], variables: usize) {
        let sets = order.units_per_plane().min(2);
        self.offset.clear();
        let mut end = 0;
        for slab in slabs {
            let planes = order.planes_of(slab);
            let mut turns = [[0; 2]; TURNS];
            for plane in planes.clone() {
                let (begin, size) = (order.plane_start(plane), block_size(order, plane));
                if plane < self.offset.len() {
                    // The previous slab has units of this plane too.
                    continue;
                }
                let turn = &mut turns[plane % TURNS];
                let whole = order.units_of(plane, slab).len() == order.units_per_plane();
                let mut first = end;
                if whole && plane >= planes.start + KEPT {
                    if turn[1] < size {
                        // All planes of this turn have room here.
                        let of_turn = (plane..planes.end).step_by(TURNS);
                        let size = of_turn.map(|plane| block_size(order, plane)).max().unwrap_or(size);
                        *turn = [end, size];
                        end += sets * size;
                    }
                    first = turn[0];
                } else {
                    end += sets * size;
                }
                let offset = first as isize - begin as isize;
                self.offset.push([offset, offset + if sets > 1 { size as isize } else { 0 }]);
            }
        }
        self.quads = if variables > 1 { variables.div_ceil(4) } else { 0 };
        // A thermostat that has had the memory may have needed more.
        self.forces.resize(end.max(self.forces.len()), Accumulator::default());
        self.densities.resize(self.quads * end, Accumulator::default());
    }

    /// Lends the accumulators to the passes.
    pub fn share(&mut self) -> Sums<'_> {
        let AccumulatorArrays { offset, forces, densities, quads } = self;
        let (forces, densities) = (SharedSlice::new(forces), SharedSlice::new(densities));
        Sums { forces, densities, offset, quads: *quads }
    }

    /// Size in bytes of the arrays.
    pub fn bytes(&self) -> usize {
        (self.forces.capacity() + self.densities.capacity()) * size_of::<Accumulator>()
    }
}

/// Number of accumulators of a set of a plane: of its own particles and of those of the next.
fn block_size(order: &CellOrder, plane: usize) -> usize {
    order.plane(plane).1 + order.next_plane(plane)
}

impl<'a> Sums<'a> {
    /// The accumulators that a unit adds to, for `variables` densities.
    pub fn of_unit(self, order: &CellOrder, unit: &Unit, variables: usize) -> PlaneSums<'a> {
        let first = order.plane_start(unit.plane);
        let at = (first as isize + self.offset[unit.plane][unit.set()]) as usize;
        assert!(at + block_size(order, unit.plane) <= self.forces.len(), "accumulators of the plane");
        // SAFETY: the accumulators begin with those of the plane's first particle.
        let (forces, densities) = unsafe { (self.forces.at(at), self.densities.at(self.quads * at)) };
        PlaneSums::new(first, forces, densities, variables)
    }

    /// Sets the accumulators that a unit adds to to zero.
    ///
    /// # Safety
    /// No other thread accesses them meanwhile.
    pub unsafe fn clear(self, set: InstructionSet, order: &CellOrder, unit: &Unit) {
        let offset = self.offset[unit.plane][unit.set()];
        for particles in order.reached(unit) {
            let at = self.places(offset, &particles);
            let densities = self.quads * at.start..self.quads * at.end;
            // SAFETY: the caller promises that no other thread accesses these.
            let both = unsafe { [self.forces.slice_mut(at), self.densities.slice_mut(densities)] };
            for sums in both {
                vectors::run(set, Clear(sums));
            }
        }
    }

    /// Adds the densities that the other set has of a unit's seams to those of the unit's set.
    ///
    /// # Safety
    /// No other thread accesses sums of the unit's particles meanwhile.
    pub unsafe fn join_densities(self, set: InstructionSet, order: &CellOrder, unit: &Unit) {
        let (densities, quads) = if self.quads > 0 { (self.densities, self.quads) } else { (self.forces, 1) };
        self.each_seam(order, unit, |seam| {
            let [to, from] = seam.map(|at| quads * at.start..quads * at.end);
            // SAFETY: the two sets are apart, and the caller promises that no other thread accesses these sums.
            let (to, from) = unsafe { (densities.slice_mut(to), densities.slice(from)) };
            match self.quads {
                0 => to.iter_mut().zip(from).for_each(|(to, from)| to.0[3] += from.0[3]),
                _ => vectors::run(set, Join { to, from }),
            }
        });
    }

    /// Adds the forces that the other set has of a unit's seams to those of the unit's set.
    ///
    /// # Safety
    /// No other thread accesses sums of the unit's particles meanwhile.
    pub unsafe fn join_forces(self, set: InstructionSet, order: &CellOrder, unit: &Unit) {
        self.each_seam(order, unit, |[to, from]| {
            // SAFETY: the two sets are apart, and the caller promises that no other thread accesses these sums.
            let (to, from) = unsafe { (self.forces.slice_mut(to), self.forces.slice(from)) };
            vectors::run(set, Join { to, from });
        });
    }

    /// Calls `join` with the places of each seam's sums in the unit's set, and in the other.
    fn each_seam(self, order: &CellOrder, unit: &Unit, join: impl Fn([Range<usize>; 2])) {
        let [first, last] = order.seams(unit);
        let [here, before] = self.offsets(order, unit.plane);
        for (offsets, seam) in [(here, &first), (before, &first), (before, &last)] {
            if let Some(offsets) = offsets {
                join([unit.set(), 1 - unit.set()].map(|set| self.places(offsets[set], seam)));
            }
        }
    }

    /// The offsets of the sums of a plane's particles: over the pairs of that plane, and over those of the previous plane.
    fn offsets(self, order: &CellOrder, plane: usize) -> [Option<[isize; 2]>; 2] {
        let before = match plane {
            // The copies of the first plane follow the last particle.
            0 if order.is_periodic() => {
                let offsets = self.offset[order.grid.planes - 1];
                Some(offsets.map(|offset| offset + order.particles() as isize))
            }
            0 => None,
            _ => Some(self.offset[plane - 1]),
        };
        [Some(self.offset[plane]), before]
    }

    /// The places of particles' accumulators.
    fn places(self, offset: isize, particles: &Range<usize>) -> Range<usize> {
        if particles.is_empty() {
            return 0..0;
        }
        let first = (particles.start as isize + offset) as usize;
        assert!(first + particles.len() <= self.forces.len(), "accumulators of particles");
        first..first + particles.len()
    }

    /// The sums of particles of a unit, whose seams have been joined: over the pairs of its plane, and over those of the previous plane.
    ///
    /// # Safety
    /// No thread writes these sums while the result is in use.
    pub unsafe fn of_particles(
        self,
        order: &CellOrder,
        unit: &Unit,
        particles: Range<usize>,
    ) -> (Added<'a>, Option<Added<'a>>) {
        let [here, before] = self.offsets(order, unit.plane).map(|offsets| {
            offsets.map(|offsets| {
                let at = self.places(offsets[unit.set()], &particles);
                let of_densities = self.quads * at.start..self.quads * at.end;
                // SAFETY: the caller promises that no thread writes these.
                unsafe {
                    Added { forces: self.forces.slice(at), densities: self.densities.slice(of_densities) }
                }
            })
        });
        (here.unwrap_or(Added { forces: &[], densities: &[] }), before)
    }
}

/// Sets sums to zero.
struct Clear<'a>(&'a mut [Accumulator]);

impl Loop for Clear<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        self.0.fill(Accumulator::default());
    }
}

/// Adds sums to others.
struct Join<'a> {
    to: &'a mut [Accumulator],
    from: &'a [Accumulator],
}

impl Loop for Join<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            (0..4).for_each(|c| to.0[c] += from.0[c]);
        }
    }
}
