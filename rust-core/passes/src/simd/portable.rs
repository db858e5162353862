//! Vectors as plain arrays, which the compiler vectorises for the target's instructions.

use super::{BroadcastPair, Isa, ORDINARY_F32, ORDINARY_F64, Quad, Reals, Words, record_at, wide_record_at};
use crate::simd::OFFSET_BITS;
use psidpd_model::kernel::Real;
use std::ops::{Add, Mul, Sub};

/// The instructions of the compiler's target.
#[derive(Clone, Copy)]
pub struct Portable;

const LANES: usize = 8;

/// Vector of eight numbers.
#[derive(Clone, Copy)]
pub struct Lanes<T>([T; LANES]);

#[inline(always)]
fn of_both<T: Copy, U, const N: usize>(a: [T; N], b: [T; N], of: impl Fn(T, T) -> U) -> [U; N] {
    std::array::from_fn(|k| of(a[k], b[k]))
}

/// Bit `k` is set if flag `k` is.
#[inline(always)]
fn mask(flags: [bool; LANES]) -> u32 {
    (0..LANES).map(|k| (flags[k] as u32) << k).sum()
}

macro_rules! lanes {
    ($scalar:ty, $encode:expr) => {
        impl Add for Lanes<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Lanes(of_both(self.0, other.0, |a, b| a + b))
            }
        }
        impl Sub for Lanes<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Lanes(of_both(self.0, other.0, |a, b| a - b))
            }
        }
        impl Mul for Lanes<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Lanes(of_both(self.0, other.0, |a, b| a * b))
            }
        }
        impl Real for Lanes<$scalar> {
            #[inline(always)]
            fn constant(x: f64) -> Self {
                Lanes([x as $scalar; LANES])
            }
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                Lanes(of_both(self.0, other.0, |a, b| if a > b { a } else { b }))
            }
        }

        impl Reals for Lanes<$scalar> {
            type Scalar = $scalar;
            type Words = Lanes<u32>;
            const LANES: usize = LANES;

            methods! {
                splat(x: $scalar) -> Self = Lanes([x; LANES]);
                load(p: *const $scalar) -> Self = Lanes(p.cast::<[$scalar; LANES]>().read_unaligned());
                store(self, p: *mut $scalar) = p.cast::<[$scalar; LANES]>().write_unaligned(self.0);
                of_signed(words: Lanes<u32>) -> Self = Lanes(words.0.map(|w| w as i32 as $scalar));
                encode(words: Lanes<u32>) -> Self = Lanes(words.0.map($encode));
                mul_add(self, a: Self, b: Self) -> Self = self * a + b;
                inverse_root(self) -> Self = Lanes(self.0.map(|x| 1.0 / x.sqrt()));
                smaller(self, other: Self) -> Self =
                    Lanes(of_both(self.0, other.0, |a, b| if a < b { a } else { b }));
                where_below(self, a: Self, b: Self) -> Self =
                    Lanes(std::array::from_fn(|k| if a.0[k] < b.0[k] { self.0[k] } else { 0.0 }));
                mask_below(self, other: Self) -> u32 = mask(of_both(self.0, other.0, |a, b| a < b));
                pick(table: *const $scalar, which: Lanes<u32>) -> Self =
                    Self::lookup(table, Lanes(which.0.map(|w| w % LANES as u32)));
                lookup(table: *const $scalar, index: Lanes<u32>) -> Self =
                    Lanes(index.0.map(|k| unsafe { *table.add(k as usize) }));
                store_transposed(columns: [Self; 4], p: *mut $scalar) = Self::store_rows(columns, !0, p);
            }
            #[inline(always)]
            unsafe fn store_whole(self, p: *mut i32) {
                for k in 0..LANES {
                    // SAFETY: the caller of `store_whole` promises numbers that fit into an `i32`.
                    unsafe { *p.add(k) = self.0[k].to_int_unchecked() };
                }
            }
            #[inline(always)]
            unsafe fn round(self) -> Self {
                // Adding a number without room for a fraction rounds, without a function call.
                const ROOM: $scalar = 1.5 / <$scalar>::EPSILON;
                Lanes(self.0.map(|x| (x + ROOM) - ROOM))
            }
            #[inline(always)]
            unsafe fn compress(self, mask: u32) -> Self {
                let mut out = [0.0; LANES + 1];
                let mut place = 0;
                for k in 0..LANES {
                    out[place] = self.0[k];
                    place += (mask >> k & 1) as usize;
                }
                let mut first = [0.0; LANES];
                first.copy_from_slice(&out[..LANES]);
                Lanes(first)
            }
            #[inline(always)]
            unsafe fn store_rows(columns: [Self; 4], mask: u32, p: *mut $scalar) {
                let mut place = 0;
                for k in 0..LANES {
                    // A row is loaded at once: as a vector it does not pass through memory number by number.
                    unsafe {
                        p.add(4 * place).cast::<[$scalar; 4]>().write(columns.map(|column| column.0[k]))
                    };
                    place += (mask >> k & 1) as usize;
                }
            }
        }
    };
}

lanes!(f32, |w: u32| f32::from_bits(w.wrapping_add(ORDINARY_F32)));
lanes!(f64, |w: u32| f64::from_bits(ORDINARY_F64 | w as u64));

impl Words for Lanes<u32> {
    const LANES: usize = LANES;

    methods! {
        splat(x: u32) -> Self = Lanes([x; LANES]);
        load(p: *const u32) -> Self = Lanes(p.cast::<[u32; LANES]>().read_unaligned());
        store(self, p: *mut u32) = p.cast::<[u32; LANES]>().write_unaligned(self.0);
        add(self, other: Self) -> Self = Lanes(of_both(self.0, other.0, u32::wrapping_add));
        sub(self, other: Self) -> Self = Lanes(of_both(self.0, other.0, u32::wrapping_sub));
        xor(self, other: Self) -> Self = Lanes(of_both(self.0, other.0, |a, b| a ^ b));
        min(self, other: Self) -> Self = Lanes(of_both(self.0, other.0, Ord::min));
        max(self, other: Self) -> Self = Lanes(of_both(self.0, other.0, Ord::max));
        rotate(self, by: u32) -> Self = Lanes(self.0.map(|x| x.rotate_left(by)));
        mask_equal(self, other: Self) -> u32 = mask(of_both(self.0, other.0, |a, b| a == b));
        mask_common(self, other: Self) -> u32 = mask(of_both(self.0, other.0, |a, b| a & b != 0));
        lookup(table: *const u32, index: Self) -> Self = Lanes(index.0.map(|k| unsafe { *table.add(k as usize) }));
        load_bytes(p: *const u8) -> Self = Lanes(p.cast::<[u8; LANES]>().read_unaligned().map(u32::from));
        pick(table: *const u32, which: Self) -> Self = Self::lookup(table, which);
    }
    #[inline(always)]
    unsafe fn shift_right<const BY: u32>(self) -> Self {
        Lanes(self.0.map(|x| x >> BY))
    }
}

/// Vector of four numbers.
#[derive(Clone, Copy)]
pub struct Four([f64; 4]);

impl Quad for Four {
    methods! {
        zero() -> Self = Four([0.0; 4]);
        splat(x: f64) -> Self = Four([x; 4]);
        load(p: *const f64) -> Self = Four(p.cast::<[f64; 4]>().read_unaligned());
        store(self, p: *mut f64) = p.cast::<[f64; 4]>().write_unaligned(self.0);
        add(self, other: Self) -> Self = Four(of_both(self.0, other.0, |a, b| a + b));
        sub(self, other: Self) -> Self = Four(of_both(self.0, other.0, |a, b| a - b));
        mul(self, other: Self) -> Self = Four(of_both(self.0, other.0, |a, b| a * b));
        mul_add(self, a: Self, b: Self) -> Self = self.mul(a).add(b);
        neg_mul_add(self, a: Self, b: Self) -> Self = b.sub(self.mul(a));
        splat_f32(x: f32) -> Self = Four([f64::from(x); 4]);
        load_f32(p: *const f32) -> Self = Four(p.cast::<[f32; 4]>().read_unaligned().map(f64::from));
    }
    #[inline(always)]
    unsafe fn load_three_f32(p: *const f32) -> Self {
        let [x, y, z] = unsafe { p.cast::<[f32; 3]>().read_unaligned() }.map(f64::from);
        Four([x, y, z, 0.0])
    }
    #[inline(always)]
    unsafe fn load_three(p: *const f64) -> Self {
        let [x, y, z] = unsafe { p.cast::<[f64; 3]>().read_unaligned() };
        Four([x, y, z, 0.0])
    }
    #[inline(always)]
    unsafe fn totals(self, other: Self) -> [Self; 2] {
        [self, other].map(|Four([a, b, c, d])| Four([(a + b) + (c + d); 4]))
    }
}

/// Compares distances of sixteen particles to a point; a bit is set where the square is below the limit.
#[inline(always)]
fn below(there: &[[u16; 16]; 3], two: &BroadcastPair, which: usize, limit: i16) -> u32 {
    /// An array aligned for reads of eight bytes.
    #[repr(align(16))]
    struct Flags([u8; 16]);
    let mut near = Flags([0; 16]);
    for k in 0..16 {
        // The sum of three squares fits into 16 bits without a sign.
        let mut sum = 0;
        for c in 0..3 {
            let d = two.0[c][16 * which + k].wrapping_sub(there[c][k]) as i16;
            sum += ((i32::from(d) * i32::from(d)) >> 16) as u16;
        }
        near.0[k] = (sum < limit as u16) as u8;
    }
    // The read is volatile: otherwise the compiler computes each bit by itself, without vectors.
    let eights = (&raw const near).cast::<u64>();
    // SAFETY: `near` has sixteen bytes, aligned for words of eight.
    let eights = [unsafe { eights.read_volatile() }, unsafe { eights.add(1).read_volatile() }];
    // A multiplication gathers eight flags, each 0 or 1.
    let bits = eights.map(|flags| (u64::from_le(flags).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u32);
    bits[0] | bits[1] << 8
}

impl Isa for Portable {
    type F32 = Lanes<f32>;
    type F64 = Lanes<f64>;
    type Quad = Four;

    #[inline(always)]
    unsafe fn distance_masks<const SHIFTS: bool>(
        x: [*const u16; 3],
        shift: [u32; 3],
        four: &[BroadcastPair; 2],
        limit: i16,
    ) -> u64 {
        let mut there = [[0; 16]; 3];
        for c in 0..3 {
            there[c] = unsafe { x[c].cast::<[u16; 16]>().read_unaligned() };
            if SHIFTS {
                there[c] = there[c].map(|x| x.wrapping_add(shift[c] as u16));
            }
        }
        let mut mask = 0;
        for k in 0..4 {
            mask |= (below(&there, &four[k / 2], k % 2, limit) as u64) << (16 * k);
        }
        mask
    }
    #[inline(always)]
    unsafe fn broadcast16(x: u16, p: *mut u16) {
        unsafe { p.cast::<[u16; 16]>().write_unaligned([x; 16]) }
    }
    #[inline(always)]
    unsafe fn transpose_masks(masks: *mut u64) {
        let masks = unsafe { &mut *masks.cast::<[u64; 8]>() };
        let before = *masks;
        for (k, mask) in masks.iter_mut().enumerate() {
            let (half, particle) = (k / 4, k % 4);
            *mask = (0..4).map(|c| (before[4 * half + c] >> (16 * particle) & 0xffff) << (16 * c)).sum();
        }
    }
    #[inline(always)]
    unsafe fn expand_mask(j_bases: *const u32, mut mask: u64, p: *mut u32) -> usize {
        let mut count = 0;
        while mask != 0 {
            let bit = mask.trailing_zeros();
            unsafe { *p.add(count) = *j_bases.add(bit as usize / 16) + ((bit % 16) << OFFSET_BITS) };
            count += 1;
            mask &= mask - 1;
        }
        count
    }
    #[inline(always)]
    unsafe fn root_or_more(x: Lanes<f32>) -> Lanes<f32> {
        Lanes(x.0.map(|x| x.max(0.0).sqrt()))
    }
    #[inline(always)]
    unsafe fn cluster_first<const CLUSTER: usize>(x: Lanes<f32>) -> Lanes<f32> {
        of_each::<CLUSTER>(x, |first, _| first)
    }
    #[inline(always)]
    unsafe fn cluster_least<const CLUSTER: usize>(x: Lanes<f32>) -> Lanes<f32> {
        of_each::<CLUSTER>(x, f32::min)
    }
    #[inline(always)]
    unsafe fn cluster_greatest<const CLUSTER: usize>(x: Lanes<f32>) -> Lanes<f32> {
        of_each::<CLUSTER>(x, f32::max)
    }
    #[inline(always)]
    unsafe fn load_transposed<const ALL: bool>(base: *const u8, offsets: *const u32) -> [Lanes<u32>; 8] {
        let mut out = [Lanes([0; LANES]); 8];
        for k in 0..LANES {
            let row = unsafe { record_at(base, offsets, k).cast::<[u32; 8]>().read_unaligned() };
            for c in 0..if ALL { 8 } else { 4 } {
                out[c].0[k] = row[c];
            }
        }
        out
    }
    #[inline(always)]
    unsafe fn load_transposed_wide<const ALL: bool>(base: *const u8, offsets: *const u32) -> [Lanes<f64>; 8] {
        let mut out = [Lanes([0.0; LANES]); 8];
        for k in 0..LANES {
            let row = unsafe { wide_record_at(base, offsets, k).cast::<[f64; 8]>().read_unaligned() };
            for c in 0..if ALL { 8 } else { 4 } {
                out[c].0[k] = row[c];
            }
        }
        out
    }
    #[inline(always)]
    unsafe fn of_bits(words: Lanes<u32>) -> Lanes<f32> {
        Lanes(words.0.map(f32::from_bits))
    }
    #[inline(always)]
    unsafe fn halves(x: Lanes<f64>) -> [Lanes<u32>; 2] {
        let bits = x.0.map(f64::to_bits);
        [Lanes(bits.map(|b| b as u32)), Lanes(bits.map(|b| (b >> 32) as u32))]
    }
}

/// Folds each `CLUSTER` lanes, and copies the result to all of them.
#[inline(always)]
fn of_each<const CLUSTER: usize>(x: Lanes<f32>, fold: impl Fn(f32, f32) -> f32 + Copy) -> Lanes<f32> {
    let mut out = x.0;
    for (lanes, out) in x.0.chunks_exact(CLUSTER).zip(out.chunks_exact_mut(CLUSTER)) {
        out.fill(lanes.iter().copied().reduce(fold).unwrap_or_default());
    }
    Lanes(out)
}
