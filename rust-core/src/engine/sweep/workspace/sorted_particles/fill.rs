//! Fills the arrays in the order of cells from those of the host.

use super::SharedParticles;
use crate::engine::sweep::workspace::cell_order::{CellOrder, TWO_TO_32};
use crate::engine::sweep::workspace::input::{Input, VECTOR_PADDING};
use crate::engine::sweep::workspace::prefetch::{PREFETCH_DISTANCE, prefetch};
use crate::engine::vectors::{self, Loop};
use psidpd_passes::ground::arithmetic::PackedParticle;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::fixed_point::FixedPoint16;
use psidpd_passes::instruction_set::InstructionSet;
use std::ops::Range;

/// Number of particles that are prefetched before their coordinates are computed: vector loads wait
/// until the numbers have arrived in the cache.
const FILL_BLOCK: usize = 4 * VECTOR_PADDING;

impl<R: PackedParticle> SharedParticles<'_, R> {
    /// Fills the particles `places`, which begin and end at a multiple of [`VECTOR_PADDING`], or end at
    /// the last particle. Whole vectors are written beyond the last.
    ///
    /// # Safety
    /// No other thread accesses these places meanwhile, nor, if they include the last particle, those after it.
    pub unsafe fn fill(&self, set: InstructionSet, order: &CellOrder, input: &Input, places: Range<usize>) {
        let (moving, multispecies) = (input.thermostat.is_some(), !self.species.is_empty());
        assert!(places.end <= order.particles(), "places of particles");
        assert!(
            self.x.iter().all(|x| x.len() >= places.end + VECTOR_PADDING)
                && self.fixed16.iter().all(|x| x.len() >= places.end + VECTOR_PADDING)
                && self.packed.len() >= places.end
                && (!multispecies || self.species.len() >= places.end),
            "room for the particles"
        );
        let particles = &input.particles;
        assert!(
            particles.x.len() >= order.all
                && particles.tag.len() >= order.all
                && (!moving || input.v.len() >= order.all),
            "the particles that were sorted"
        );
        let fill = &Fill { input, order, to: self };
        match (moving, multispecies) {
            (true, true) => vectors::run(set, FillRange::<_, true, true> { fill, places }),
            (true, false) => vectors::run(set, FillRange::<_, true, false> { fill, places }),
            (false, true) => vectors::run(set, FillRange::<_, false, true> { fill, places }),
            (false, false) => vectors::run(set, FillRange::<_, false, false> { fill, places }),
        }
    }
}

/// The input and the output of filling; `SharedParticles::fill` has checked their sizes.
struct Fill<'a, R> {
    input: &'a Input<'a>,
    order: &'a CellOrder,
    to: &'a SharedParticles<'a, R>,
}

/// The places that one thread fills, beginning at a multiple of [`VECTOR_PADDING`]. Only
/// `SharedParticles::fill` creates it, whose caller promises that no other thread accesses them.
struct FillRange<'a, R, const WITH_VELOCITIES: bool, const MULTISPECIES: bool> {
    fill: &'a Fill<'a, R>,
    places: Range<usize>,
}

impl<R: PackedParticle, const WITH_VELOCITIES: bool, const MULTISPECIES: bool> Loop
    for FillRange<'_, R, WITH_VELOCITIES, MULTISPECIES>
{
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let FillRange { fill, places } = self;
        let coordinates = Coordinates::new(&fill.order.geometry, fill.to.fixed16_scale);
        let mut u = [[0; FILL_BLOCK]; 3];
        for first in places.clone().step_by(FILL_BLOCK) {
            let count = FILL_BLOCK.min(places.end - first);
            // SAFETY: the vectors begin in the places of this range, which `FillRange` has for itself.
            unsafe {
                fill.fetch::<WITH_VELOCITIES, MULTISPECIES>(first, count, &mut u);
                for from in (0..count).step_by(VECTOR_PADDING) {
                    coordinates.fill(
                        fill.to,
                        first + from,
                        u.each_ref().map(|u| &u[from..][..VECTOR_PADDING]),
                    );
                }
            }
        }
    }
}

impl<R: PackedParticle> Fill<'_, R> {
    /// Fills everything but coordinates, and gathers fractions.
    ///
    /// # Safety
    /// The places belong to a [`FillRange`].
    #[inline(always)]
    unsafe fn fetch<const WITH_VELOCITIES: bool, const MULTISPECIES: bool>(
        &self,
        first: usize,
        count: usize,
        fixed32: &mut [[u32; FILL_BLOCK]; 3],
    ) {
        let (particles, order) = (&self.input.particles, &self.order.order[..]);
        let (units, v) = (&self.order.fixed32[..], self.input.v);
        let prefetches = self.order.exceeds_cache();
        let last = order.len().saturating_sub(1);
        for (lane, k) in order[first..first + count].iter().enumerate() {
            let (k, s) = (*k as usize, first + lane);
            // SAFETY: an order contains numbers of sorted particles, and `SharedParticles::fill` has
            // checked that the host's arrays are as long and that the places have room; the caller
            // promises that they belong to a `FillRange`.
            unsafe {
                if prefetches {
                    let next = *order.get_unchecked((s + PREFETCH_DISTANCE).min(last)) as usize;
                    prefetch(units.as_ptr().add(next));
                    prefetch(particles.tag.as_ptr().add(next));
                    if WITH_VELOCITIES {
                        prefetch(v.as_ptr().add(next));
                    }
                }
                let u = *units.get_unchecked(k);
                for c in 0..3 {
                    fixed32[c][lane] = u[c];
                }
                let v = if WITH_VELOCITIES { *v.get_unchecked(k) } else { [0.0; 3] };
                let kind = if MULTISPECIES { self.input.species_of(k).unwrap_or(0) as u32 } else { 0 };
                let tag = *particles.tag.get_unchecked(k) as u32;
                *self.to.packed.at(s) = R::new(u, particles.x.get_unchecked(k), &v, tag, kind);
                if MULTISPECIES {
                    *self.to.species.at(s) = kind as u8;
                }
            }
        }
    }
}

/// Constants that convert fractions to positions relative to the origin, and to words of sixteen bits.
enum Coordinates<'a> {
    /// Edges along the axes, with the length per half fraction and the length in words.
    Orthogonal {
        scale: [f32; 3],
        edge_words: [u32; 3],
    },
    Tilted {
        geometry: &'a BoxGeometry,
        fixed16_scale: FixedPoint16,
    },
}

impl<'a> Coordinates<'a> {
    fn new(geometry: &'a BoxGeometry, fixed16_scale: FixedPoint16) -> Coordinates<'a> {
        match fixed16_scale.edge_words(geometry) {
            Some(edge_words) => {
                let flat = if geometry.dimensions == 3 { 1.0 } else { 0.0 };
                let [a, b, c] = geometry.length;
                let scale = [a, b, flat * c].map(|length| (2.0 * length / TWO_TO_32) as f32);
                Coordinates::Orthogonal { scale, edge_words }
            }
            None => Coordinates::Tilted { geometry, fixed16_scale },
        }
    }

    /// Fills [`VECTOR_PADDING`] places, some of which may be after the last particle.
    ///
    /// # Safety
    /// No other thread accesses these places, and there is room for all of them.
    #[inline(always)]
    unsafe fn fill<R>(&self, to: &SharedParticles<R>, first: usize, u: [&[u32]; 3]) {
        let (mut x, mut fixed16) = ([[0.0; VECTOR_PADDING]; 3], [[0; VECTOR_PADDING]; 3]);
        match self {
            Coordinates::Orthogonal { scale, edge_words } => {
                for c in 0..3 {
                    for (lane, u) in u[c][..VECTOR_PADDING].iter().enumerate() {
                        // The fraction is halved, as vectors convert signed numbers only: 24 bits are left either way.
                        x[c][lane] = (*u >> 1) as i32 as f32 * scale[c];
                        fixed16[c][lane] = ((*u as u64 * edge_words[c] as u64) >> 32) as u16;
                    }
                }
            }
            Coordinates::Tilted { geometry, fixed16_scale } => {
                for lane in 0..VECTOR_PADDING {
                    let point = geometry.point(&[0, 1, 2].map(|c| u[c][lane] as f64 / TWO_TO_32));
                    for c in 0..3 {
                        x[c][lane] = point[c] as f32;
                        fixed16[c][lane] = fixed16_scale.coordinate(point[c]);
                    }
                }
            }
        }
        for c in 0..3 {
            // SAFETY: the caller promises room in these places, and that no other thread accesses them.
            unsafe {
                to.x[c].at(first).cast::<[f32; VECTOR_PADDING]>().write_unaligned(x[c]);
                to.fixed16[c].at(first).cast::<[u16; VECTOR_PADDING]>().write_unaligned(fixed16[c]);
            }
        }
    }
}
