//! Arrays in the order of bins, from the host's.

use super::TWO_TO_32;
use crate::engine::sweep::arithmetic::Record;
use crate::engine::sweep::frame::Frame;
use crate::engine::sweep::layer::Shared;
use crate::engine::sweep::machine::vectors::Loop;
use crate::engine::sweep::machine::{Given, SLACK};
use crate::engine::sweep::quantum::Quantum;
use std::ops::Range;

/// Particles that are fetched before their coordinates are computed: loads of vectors wait for the numbers they are
/// made of to arrive in the cache.
const BLOCK: usize = 4 * SLACK;

/// How many particles ahead what is known of them is called into the cache: no processor foresees where it is.
const AHEAD: usize = 64;

/// What all threads fill the arrays with; positions in the order of bins are those behind the last of which whole
/// vectors may be written.
pub struct Fill<'a, R> {
    pub given: &'a Given<'a>,
    pub frame: &'a Frame,
    pub quantum: Quantum,
    pub order: &'a [u32],
    pub unit: &'a [[u32; 3]],
    pub x: [Shared<f32>; 3],
    pub q: [Shared<u16>; 3],
    pub records: Shared<R>,
    /// Not there with one species.
    pub species: Option<Shared<u8>>,
    /// Whether the host's particles may be beyond the cache.
    pub far: bool,
}

/// The places that one thread fills: from a multiple of [`SLACK`] on.
pub struct FillSome<'a, R, const MOVING: bool, const SEVERAL: bool> {
    pub fill: &'a Fill<'a, R>,
    pub places: Range<usize>,
}

impl<R: Record, const MOVING: bool, const SEVERAL: bool> Loop for FillSome<'_, R, MOVING, SEVERAL> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let FillSome { fill, places } = self;
        let coordinates = Coordinates::new(fill.frame, fill.quantum);
        let mut u = [[0; BLOCK]; 3];
        for first in places.clone().step_by(BLOCK) {
            let count = BLOCK.min(places.end - first);
            // SAFETY: these places are of this thread.
            unsafe {
                fill.fetch::<MOVING, SEVERAL>(first, count, &mut u);
                for from in (0..count).step_by(SLACK) {
                    coordinates.fill(fill, first + from, u.each_ref().map(|u| &u[from..from + SLACK]));
                }
            }
        }
    }
}

impl<R: Record> Fill<'_, R> {
    /// Fills all but coordinates, and collects fractions.
    ///
    /// # Safety
    /// No other thread fills these places; all numbers in the order are of particles.
    #[inline(always)]
    unsafe fn fetch<const MOVING: bool, const SEVERAL: bool>(
        &self,
        first: usize,
        count: usize,
        units: &mut [[u32; BLOCK]; 3],
    ) {
        let particles = &self.given.particles;
        let last = self.order.len().saturating_sub(1);
        for (lane, k) in self.order[first..first + count].iter().enumerate() {
            let (k, s) = (*k as usize, first + lane);
            // SAFETY: the caller's.
            unsafe {
                if self.far {
                    let next = *self.order.get_unchecked((s + AHEAD).min(last)) as usize;
                    call(self.unit.as_ptr().add(next));
                    call(particles.tag.as_ptr().add(next));
                    if MOVING {
                        call(self.given.v.as_ptr().add(next));
                    }
                }
                let u = *self.unit.get_unchecked(k);
                for c in 0..3 {
                    units[c][lane] = u[c];
                }
                let v = if MOVING { *self.given.v.get_unchecked(k) } else { [0.0; 3] };
                let kind = if SEVERAL { self.given.species_of(k).unwrap_or(0) as u32 } else { 0 };
                let tag = *particles.tag.get_unchecked(k) as u32;
                *self.records.at(s) = R::new(u, particles.x.get_unchecked(k), &v, tag, kind);
                if let (true, Some(species)) = (SEVERAL, self.species) {
                    *species.at(s) = kind as u8;
                }
            }
        }
    }
}

/// Calls a value into the cache, both its ends if they may be in two lines.
#[inline(always)]
fn call<T>(value: *const T) {
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
    Straight {
        scale: [f32; 3],
        words: [u32; 3],
    },
    Leaning {
        frame: &'a Frame,
        quantum: Quantum,
    },
}

impl<'a> Coordinates<'a> {
    fn new(frame: &'a Frame, quantum: Quantum) -> Coordinates<'a> {
        match quantum.words(frame) {
            Some(words) => {
                let flat = if frame.dimensions == 3 { 1.0 } else { 0.0 };
                let [a, b, c] = frame.length;
                let scale = [a, b, flat * c].map(|length| (2.0 * length / TWO_TO_32) as f32);
                Coordinates::Straight { scale, words }
            }
            None => Coordinates::Leaning { frame, quantum },
        }
    }

    /// Fills [`SLACK`] places, some perhaps behind the last.
    ///
    /// # Safety
    /// No other thread fills them.
    #[inline(always)]
    unsafe fn fill<R>(&self, fill: &Fill<R>, first: usize, u: [&[u32]; 3]) {
        let (mut x, mut q) = ([[0.0; SLACK]; 3], [[0; SLACK]; 3]);
        match self {
            Coordinates::Straight { scale, words } => {
                for c in 0..3 {
                    for (lane, u) in u[c][..SLACK].iter().enumerate() {
                        // Half, as vectors have no conversion of numbers without sign: 24 bits are left either way.
                        x[c][lane] = (*u >> 1) as i32 as f32 * scale[c];
                        q[c][lane] = ((*u as u64 * words[c] as u64) >> 32) as u16;
                    }
                }
            }
            Coordinates::Leaning { frame, quantum } => {
                for lane in 0..SLACK {
                    let point = frame.point(&[0, 1, 2].map(|c| u[c][lane] as f64 / TWO_TO_32));
                    for c in 0..3 {
                        x[c][lane] = point[c] as f32;
                        // SAFETY: a point of the frame.
                        q[c][lane] = unsafe { quantum.of(point[c]) };
                    }
                }
            }
        }
        for c in 0..3 {
            // SAFETY: the caller's; there is room behind the last.
            unsafe {
                fill.x[c].at(first).cast::<[f32; SLACK]>().write_unaligned(x[c]);
                fill.q[c].at(first).cast::<[u16; SLACK]>().write_unaligned(q[c]);
            }
        }
    }
}
