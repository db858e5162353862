//! What goes to the host and comes from it, in its own order.

use super::{Accumulator, SharedArrays, SharedPtr, Workspace};
use crate::engine::sweep::compiled::Compiled;
use crate::engine::tally::Tally;
use crate::engine::vectors::{self, Loop};

/// Where the host wants forces.
#[derive(Clone, Copy)]
pub struct ForceSink<'a> {
    force: SharedPtr<[f64; 3]>,
    /// Whether they are added to what is there.
    add: bool,
    tag: &'a [i32],
}

impl<'a> ForceSink<'a> {
    /// Forces on the particles with these tags, of which there may be more than forces: ghosts.
    pub fn new(force: &'a mut [[f64; 3]], add: bool, tag: &'a [i32]) -> ForceSink<'a> {
        ForceSink { force: SharedPtr(force.as_mut_ptr()), add, tag }
    }
}

impl<P: Compiled> Workspace<P> {
    /// Slopes from the order of cells to the host's, those of particles it owns; those of ghosts are anything.
    pub fn slopes_to_host(&self, out: &mut Vec<f64>) {
        let width = self.width();
        out.resize(width * self.all, 0.0);
        if width == 1 {
            // Far the most common, and the copy of one number is no loop.
            for (k, slope) in self.order.iter().zip(&self.slopes) {
                if let Some(out) = out.get_mut(*k as usize) {
                    *out = *slope;
                }
            }
            return;
        }
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k < self.owned {
                out[width * k..][..width].copy_from_slice(&self.slopes[width * s..][..width]);
            }
        }
    }

    /// Slopes of ghosts from the host.
    pub fn slopes_from_host(&mut self, slopes: &[f64]) {
        let width = self.width();
        let rows = SharedPtr(self.packed_slopes.as_mut_ptr());
        // Where there are no ghosts there are no bits either.
        for (byte, owned) in self.owned_bits.iter().enumerate() {
            let mut ghosts = !owned;
            while ghosts != 0 {
                let s = 8 * byte + ghosts.trailing_zeros() as usize;
                ghosts &= ghosts - 1;
                let Some(k) = self.order.get(s) else { break };
                let slopes = &slopes[width * *k as usize..][..width];
                self.slopes[width * s..][..width].copy_from_slice(slopes);
                // SAFETY: nobody else is at work.
                unsafe { self.write_packed_slopes(rows, s, slopes) };
            }
        }
    }

    /// Writes the forces on owned particles of one plane, or adds them to what is there; `lost` is the lowest tag of
    /// those that are not finite.
    ///
    /// # Safety
    /// No other thread does the same plane, and none adds to the forces on its particles any more. There are forces for
    /// all owned particles.
    pub(super) unsafe fn forces_of_plane(
        &self,
        arrays: SharedArrays<P>,
        plane: usize,
        out: ForceSink,
        lost: &mut Option<i32>,
    ) {
        let (first, count) = self.plane(plane);
        let (here, before) = self.accumulators(plane);
        // SAFETY: accumulators of particles of the plane.
        let sums = |accumulators: isize| unsafe {
            std::slice::from_raw_parts(arrays.sums.at((first as isize + accumulators) as usize), count)
        };
        let forces = PlaneForces {
            order: &self.order[first..first + count],
            owned: self.owned,
            here: sums(here),
            before: before.map(sums),
            out: out.force,
        };
        let fine = match out.add {
            true => vectors::run(self.instructions, WriteForces::<true>(&forces)),
            false => vectors::run(self.instructions, WriteForces::<false>(&forces)),
        };
        if !fine {
            *lost = forces.lost(out.tag).into_iter().chain(*lost).min();
        }
    }

    /// Energies and virials of the last evaluation, summed in the order of planes.
    pub fn tally(&self) -> Tally {
        let mut tally = Tally::default();
        for plane in &self.tallies {
            tally += *plane;
        }
        if self.totals {
            for (s, excess) in self.excess.iter().enumerate() {
                if self.ghost.get(s).is_none_or(|g| !*g) {
                    tally.excess += excess;
                }
            }
        }
        tally
    }

    /// ψ of owned particles and their densities, `variables` each, in the host's order.
    pub fn to_host(&self, variables: usize, excess: &mut Vec<f64>, densities: &mut Vec<f64>) {
        let width = self.width();
        excess.clear();
        excess.resize(self.owned, 0.0);
        densities.clear();
        densities.resize(variables * self.owned, 0.0);
        for (s, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            if k < self.owned {
                excess[k] = self.excess[s];
                for (c, v) in self.variables.iter().enumerate() {
                    densities[variables * k + v] = self.densities_of_particles[width * s + c];
                }
            }
        }
    }

    pub fn out_of_bounds(&self) -> [u64; 2] {
        let mut sum = [0; 2];
        for scratch in &self.scratch {
            for k in 0..2 {
                sum[k] += scratch.excess.out_of_bounds[k];
            }
        }
        sum
    }

    /// Bytes held in arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        fn bytes<T>(array: &Vec<T>) -> usize {
            array.capacity() * size_of::<T>()
        }
        let in_range: usize = self.in_range.iter().map(|n| n.bytes()).sum();
        in_range
            + bytes(&self.cell)
            + bytes(&self.fixed32)
            + bytes(&self.counts)
            + bytes(&self.start)
            + bytes(&self.order)
            + self.x.iter().map(bytes).sum::<usize>()
            + self.fixed16.iter().map(bytes).sum::<usize>()
            + bytes(&self.packed)
            + bytes(&self.species)
            + bytes(&self.ghost)
            + bytes(&self.owned_bits)
            + bytes(&self.sums)
            + bytes(&self.densities)
            + bytes(&self.densities_of_particles)
            + bytes(&self.excess)
            + bytes(&self.slopes)
            + bytes(&self.packed_slopes)
    }
}

/// Forces on the particles of one plane.
struct PlaneForces<'a> {
    /// The host's numbers of them.
    order: &'a [u32],
    owned: usize,
    /// What the plane itself has added, and the plane before.
    here: &'a [Accumulator],
    before: Option<&'a [Accumulator]>,
    out: SharedPtr<[f64; 3]>,
}

/// Writes forces, or adds them to what is there; whether all are finite.
struct WriteForces<'a, const ADD: bool>(&'a PlaneForces<'a>);

impl<const ADD: bool> Loop for WriteForces<'_, ADD> {
    type Out = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let PlaneForces { order, here, before, .. } = *self.0;
        match before {
            None => self.0.write::<ADD>(order.iter().zip(here).map(|(k, here)| (*k, here.0))),
            Some(before) => {
                let pairs = order.iter().zip(here.iter().zip(before));
                self.0.write::<ADD>(pairs.map(|(k, (here, before))| (*k, sum(here.0, before.0))))
            }
        }
    }
}

impl PlaneForces<'_> {
    #[inline(always)]
    fn write<const ADD: bool>(&self, sums: impl Iterator<Item = (u32, [f64; 4])>) -> bool {
        let mut lost = false;
        for (k, [x, y, z, _]) in sums {
            let mut f = [x, y, z];
            if k as usize >= self.owned {
                continue;
            }
            let finite = x.is_finite() & y.is_finite() & z.is_finite();
            lost |= !finite;
            // SAFETY: an owned particle, and of this plane alone.
            unsafe {
                let out = self.out.at(k as usize);
                if ADD {
                    for c in 0..3 {
                        f[c] += (*out)[c];
                    }
                }
                *out = f;
            }
        }
        !lost
    }

    /// The lowest tag of particles whose forces are not finite.
    #[cold]
    fn lost(&self, tag: &[i32]) -> Option<i32> {
        let force = |s: usize| self.before.map_or(self.here[s].0, |before| sum(self.here[s].0, before[s].0));
        let numbers = self.order.iter().map(|k| *k as usize).enumerate();
        let lost = numbers.filter(|(s, k)| *k < self.owned && !force(*s)[..3].iter().all(|f| f.is_finite()));
        lost.map(|(_, k)| tag[k]).min()
    }
}

#[inline(always)]
fn sum(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|c| a[c] + b[c])
}
