//! Arrays in the order of cells, from the host's.

use super::TWO_TO_32;
use crate::engine::sweep::ground::arithmetic::PackedParticle;
use crate::engine::sweep::ground::box_geometry::BoxGeometry;
use crate::engine::sweep::ground::fixed_point::FixedPoint16;
use crate::engine::sweep::ground::shared_ptr::SharedPtr;
use crate::engine::sweep::workspace::{Input, VECTOR_PADDING};
use crate::engine::vectors::Loop;
use std::ops::Range;

/// Particles that are fetched before their coordinates are computed: loads of vectors wait for the numbers they are
/// made of to arrive in the cache.
const FILL_BLOCK: usize = 4 * VECTOR_PADDING;

/// How many particles ahead what is known of them is called into the cache: no processor foresees where it is.
const PREFETCH_DISTANCE: usize = 64;

/// What all threads fill the arrays with; positions in the order of cells are those behind the last of which whole
/// vectors may be written.
pub struct Fill<'a, R> {
    pub input: &'a Input<'a>,
    pub geometry: &'a BoxGeometry,
    pub fixed16_scale: FixedPoint16,
    pub order: &'a [u32],
    pub fixed32: &'a [[u32; 3]],
    pub x: [SharedPtr<f32>; 3],
    pub fixed16: [SharedPtr<u16>; 3],
    pub packed: SharedPtr<R>,
    /// Not there with one species.
    pub species: Option<SharedPtr<u8>>,
    /// Whether the host's particles may be beyond the cache.
    pub prefetches: bool,
}

/// The places that one thread fills: from a multiple of [`VECTOR_PADDING`] on.
pub struct FillRange<'a, R, const WITH_VELOCITIES: bool, const MULTISPECIES: bool> {
    pub fill: &'a Fill<'a, R>,
    pub sorted_range: Range<usize>,
}

impl<R: PackedParticle, const WITH_VELOCITIES: bool, const MULTISPECIES: bool> Loop
    for FillRange<'_, R, WITH_VELOCITIES, MULTISPECIES>
{
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let FillRange { fill, sorted_range } = self;
        let coordinates = Coordinates::new(fill.geometry, fill.fixed16_scale);
        let mut u = [[0; FILL_BLOCK]; 3];
        for first in sorted_range.clone().step_by(FILL_BLOCK) {
            let count = FILL_BLOCK.min(sorted_range.end - first);
            // SAFETY: these places are of this thread.
            unsafe {
                fill.fetch::<WITH_VELOCITIES, MULTISPECIES>(first, count, &mut u);
                for from in (0..count).step_by(VECTOR_PADDING) {
                    coordinates.fill(
                        fill,
                        first + from,
                        u.each_ref().map(|u| &u[from..from + VECTOR_PADDING]),
                    );
                }
            }
        }
    }
}

impl<R: PackedParticle> Fill<'_, R> {
    /// Fills all but coordinates, and collects fractions.
    ///
    /// # Safety
    /// No other thread fills these places; all numbers in the order are of particles.
    #[inline(always)]
    unsafe fn fetch<const WITH_VELOCITIES: bool, const MULTISPECIES: bool>(
        &self,
        first: usize,
        count: usize,
        fixed32: &mut [[u32; FILL_BLOCK]; 3],
    ) {
        let particles = &self.input.particles;
        let last = self.order.len().saturating_sub(1);
        for (lane, k) in self.order[first..first + count].iter().enumerate() {
            let (k, s) = (*k as usize, first + lane);
            // SAFETY: the caller's.
            unsafe {
                if self.prefetches {
                    let next = *self.order.get_unchecked((s + PREFETCH_DISTANCE).min(last)) as usize;
                    prefetch(self.fixed32.as_ptr().add(next));
                    prefetch(particles.tag.as_ptr().add(next));
                    if WITH_VELOCITIES {
                        prefetch(self.input.v.as_ptr().add(next));
                    }
                }
                let u = *self.fixed32.get_unchecked(k);
                for c in 0..3 {
                    fixed32[c][lane] = u[c];
                }
                let v = if WITH_VELOCITIES { *self.input.v.get_unchecked(k) } else { [0.0; 3] };
                let kind = if MULTISPECIES { self.input.species_of(k).unwrap_or(0) as u32 } else { 0 };
                let tag = *particles.tag.get_unchecked(k) as u32;
                *self.packed.at(s) = R::new(u, particles.x.get_unchecked(k), &v, tag, kind);
                if let (true, Some(species)) = (MULTISPECIES, self.species) {
                    *species.at(s) = kind as u8;
                }
            }
        }
    }
}

/// Calls a value into the cache, both its ends if they may be in two lines.
#[inline(always)]
fn prefetch<T>(value: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: nothing is read, and no address does harm.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(value.cast()) };
        if size_of::<T>() > align_of::<T>() {
            // SAFETY: as above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(value.cast::<i8>().wrapping_add(size_of::<T>() - 1)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

/// How fractions become positions from the origin, and words of sixteen bits.
enum Coordinates<'a> {
    /// Edges along the axes: lengths of half a fraction, words of the length.
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

    /// Fills [`VECTOR_PADDING`] places, some perhaps behind the last.
    ///
    /// # Safety
    /// No other thread fills them.
    #[inline(always)]
    unsafe fn fill<R>(&self, fill: &Fill<R>, first: usize, u: [&[u32]; 3]) {
        let (mut x, mut fixed16) = ([[0.0; VECTOR_PADDING]; 3], [[0; VECTOR_PADDING]; 3]);
        match self {
            Coordinates::Orthogonal { scale, edge_words } => {
                for c in 0..3 {
                    for (lane, u) in u[c][..VECTOR_PADDING].iter().enumerate() {
                        // Half, as vectors have no conversion of numbers without sign: 24 bits are left either way.
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
                        // SAFETY: a point of the box geometry.
                        fixed16[c][lane] = unsafe { fixed16_scale.coordinate(point[c]) };
                    }
                }
            }
        }
        for c in 0..3 {
            // SAFETY: the caller's; there is room behind the last.
            unsafe {
                fill.x[c].at(first).cast::<[f32; VECTOR_PADDING]>().write_unaligned(x[c]);
                fill.fixed16[c].at(first).cast::<[u16; VECTOR_PADDING]>().write_unaligned(fixed16[c]);
            }
        }
    }
}
