//! Writes forces in the order of the host.

use super::accumulators::Added;
use super::cell_order::CellOrder;
use super::prefetch::{PREFETCH_DISTANCE, prefetch};
use crate::engine::vectors::{self, Loop};
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::accumulators::Accumulator;
use psidpd_threads::SharedSlice;
use std::ops::Range;

/// The host's array of forces.
#[derive(Clone, Copy)]
pub struct ForceSink<'a> {
    force: SharedSlice<'a, [f64; 3]>,
    /// Whether forces are added to those in the array.
    add: bool,
    tag: &'a [i32],
}

impl<'a> ForceSink<'a> {
    /// Creates a sink for forces on the particles with these tags; ghosts have a tag, but no force.
    pub fn new(force: &'a mut [[f64; 3]], add: bool, tag: &'a [i32]) -> ForceSink<'a> {
        ForceSink { force: SharedSlice::new(force), add, tag }
    }

    /// Writes forces on particles or adds them to those in the array; returns the lowest tag whose force is not finite.
    ///
    /// # Safety
    /// No other thread writes the forces on these particles.
    pub unsafe fn write(
        self,
        set: InstructionSet,
        order: &CellOrder,
        particles: Range<usize>,
        (here, before): (Added, Option<Added>),
    ) -> Option<i32> {
        let (numbers, owned) = (&order.order[particles], order.owned);
        assert!(owned <= self.force.len(), "forces of all owned particles");
        let before = before.map(|before| before.forces);
        let forces = PlaneForces { order: numbers, owned, here: here.forces, before, out: self.force };
        let finite = match (self.add, order.exceeds_cache()) {
            (true, true) => vectors::run(set, WriteForces::<true, true>(&forces)),
            (true, false) => vectors::run(set, WriteForces::<true, false>(&forces)),
            (false, true) => vectors::run(set, WriteForces::<false, true>(&forces)),
            (false, false) => vectors::run(set, WriteForces::<false, false>(&forces)),
        };
        if finite { None } else { forces.lost(self.tag) }
    }

    /// Adds to the force on an owned particle; returns its tag if the sum is not finite.
    ///
    /// # Safety
    /// No other thread writes the force on this particle.
    #[inline(always)]
    pub unsafe fn add(self, particle: usize, force: [f64; 3]) -> Option<i32> {
        assert!(particle < self.force.len(), "an owned particle");
        // SAFETY: the array has an entry for the particle; the caller promises that no other thread writes it.
        let sum = unsafe { &mut *self.force.at(particle) };
        for c in 0..3 {
            sum[c] += force[c];
        }
        // The sum is finite unless a component is not, or it exceeds all that forces can be.
        let finite = (sum[0] + sum[1] + sum[2]).is_finite();
        if finite { None } else { Some(self.tag[particle]) }
    }
}

/// Forces on the particles of one plane. Only [`ForceSink::write`] creates it: its caller promises that no
/// other thread writes these forces, and it has checked that the array has room for all owned particles.
struct PlaneForces<'a> {
    /// The host's numbers of the particles.
    order: &'a [u32],
    owned: usize,
    /// The sums over pairs of this plane, and of the previous plane.
    here: &'a [Accumulator],
    before: Option<&'a [Accumulator]>,
    out: SharedSlice<'a, [f64; 3]>,
}

/// Writes forces, or adds them to those in the array, which are prefetched with `FAR`; returns whether all are finite.
struct WriteForces<'a, const ADD: bool, const FAR: bool>(&'a PlaneForces<'a>);

impl<const ADD: bool, const FAR: bool> Loop for WriteForces<'_, ADD, FAR> {
    type Out = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let PlaneForces { order, here, before, .. } = *self.0;
        match before {
            None => self.0.write::<ADD, FAR>(order.iter().zip(here).map(|(k, here)| (*k, here.0))),
            Some(before) => {
                let pairs = order.iter().zip(here.iter().zip(before));
                self.0.write::<ADD, FAR>(pairs.map(|(k, (here, before))| (*k, sum(here.0, before.0))))
            }
        }
    }
}

impl PlaneForces<'_> {
    #[inline(always)]
    fn write<const ADD: bool, const FAR: bool>(&self, sums: impl Iterator<Item = (u32, [f64; 4])>) -> bool {
        let mut lost = false;
        let last = self.order.len().saturating_sub(1);
        for (s, (k, [x, y, z, _])) in sums.enumerate() {
            let mut f = [x, y, z];
            if FAR {
                let next = self.order[(s + PREFETCH_DISTANCE).min(last)] as usize;
                prefetch(self.out.as_ptr().wrapping_add(next));
            }
            if k as usize >= self.owned {
                continue;
            }
            let finite = x.is_finite() & y.is_finite() & z.is_finite();
            lost |= !finite;
            // SAFETY: `PlaneForces` contains an owned particle's number, for which the array has
            // room and no other thread writes.
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
