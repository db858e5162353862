//! Vectors for AVX2 with FMA and BMI2.

use super::x86::{Quad4, operators};
use super::{BroadcastPair, Isa, ORDINARY_F32, ORDINARY_F64, Reals, Words, record_at, wide_record_at};
use crate::simd::OFFSET_BITS;
use psidpd_model::kernel::Real;
use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

#[derive(Clone, Copy)]
pub struct Avx2;

/// Vector of eight `f32`.
#[derive(Clone, Copy)]
pub struct F32x8(__m256);

/// Vector of four `f64`.
#[derive(Clone, Copy)]
pub struct F64x4(__m256d);

/// Vector of eight `u32`.
#[derive(Clone, Copy)]
pub struct U32x8(pub(super) __m256i);

/// Vector of four `u32`.
#[derive(Clone, Copy)]
pub struct U32x4(__m128i);

operators!(F32x8, _mm256_set1_ps as f32, _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_max_ps);
operators!(F64x4, _mm256_set1_pd as f64, _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd, _mm256_max_pd);

/// Permutations of eight words that put those of a mask first: entry `mask` has a byte for each word.
static FIRST: [u64; 256] = first();

const fn first() -> [u64; 256] {
    let mut table = [0u64; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut entry, mut place, mut lane) = (0u64, 0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                entry |= lane << (8 * place);
                place += 1;
            }
            lane += 1;
        }
        table[mask] = entry;
        mask += 1;
    }
    table
}

#[inline(always)]
unsafe fn order(mask: u32) -> __m256i {
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(FIRST[(mask & 0xff) as usize] as i64)) }
}

/// A mask of words from one of pairs of words: each of four bits occurs twice.
#[inline(always)]
fn doubled(mask: u32) -> u32 {
    const DOUBLE: [u8; 16] = [0, 3, 12, 15, 48, 51, 60, 63, 192, 195, 204, 207, 240, 243, 252, 255];
    DOUBLE[(mask & 15) as usize] as u32
}

impl Reals for F32x8 {
    type Scalar = f32;
    type Words = U32x8;
    const LANES: usize = 8;

    methods! {
        splat(x: f32) -> Self = F32x8(_mm256_set1_ps(x));
        load(p: *const f32) -> Self = F32x8(_mm256_loadu_ps(p));
        store(self, p: *mut f32) = _mm256_storeu_ps(p, self.0);
        of_signed(words: U32x8) -> Self = F32x8(_mm256_cvtepi32_ps(words.0));
        mul_add(self, a: Self, b: Self) -> Self = F32x8(_mm256_fmadd_ps(self.0, a.0, b.0));
        smaller(self, other: Self) -> Self = F32x8(_mm256_min_ps(self.0, other.0));
        store_whole(self, p: *mut i32) = _mm256_storeu_si256(p.cast(), _mm256_cvttps_epi32(self.0));
        compress(self, mask: u32) -> Self = F32x8(_mm256_permutevar8x32_ps(self.0, order(mask)));
        lookup(table: *const f32, index: U32x8) -> Self = F32x8(_mm256_i32gather_ps::<4>(table, index.0));
    }
    #[inline(always)]
    unsafe fn encode(words: U32x8) -> Self {
        let ordinary = ORDINARY_F32 as i32;
        unsafe { F32x8(_mm256_castsi256_ps(_mm256_add_epi32(words.0, _mm256_set1_epi32(ordinary)))) }
    }
    #[inline(always)]
    unsafe fn inverse_root(self) -> Self {
        unsafe {
            // The estimate has 12 bits; one step of third order refines it.
            let y = _mm256_rsqrt_ps(self.0);
            let e = _mm256_fnmadd_ps(_mm256_mul_ps(self.0, y), y, _mm256_set1_ps(1.0));
            let c = _mm256_fmadd_ps(e, _mm256_set1_ps(0.375), _mm256_set1_ps(0.5));
            F32x8(_mm256_fmadd_ps(_mm256_mul_ps(y, e), c, y))
        }
    }
    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe { F32x8(_mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)) }
    }
    #[inline(always)]
    unsafe fn where_below(self, a: Self, b: Self) -> Self {
        unsafe { F32x8(_mm256_and_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0), self.0)) }
    }
    #[inline(always)]
    unsafe fn mask_below(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    unsafe fn pick(table: *const f32, which: U32x8) -> Self {
        unsafe { F32x8(_mm256_permutevar8x32_ps(_mm256_loadu_ps(table), which.0)) }
    }
    #[inline(always)]
    unsafe fn store_transposed(columns: [Self; 4], p: *mut f32) {
        unsafe {
            let [a, b, c, d] = columns;
            let ab_low = _mm256_castps_pd(_mm256_unpacklo_ps(a.0, b.0));
            let ab_high = _mm256_castps_pd(_mm256_unpackhi_ps(a.0, b.0));
            let cd_low = _mm256_castps_pd(_mm256_unpacklo_ps(c.0, d.0));
            let cd_high = _mm256_castps_pd(_mm256_unpackhi_ps(c.0, d.0));
            // The halves contain rows k and k + 4.
            let r0 = _mm256_unpacklo_pd(ab_low, cd_low);
            let r1 = _mm256_unpackhi_pd(ab_low, cd_low);
            let r2 = _mm256_unpacklo_pd(ab_high, cd_high);
            let r3 = _mm256_unpackhi_pd(ab_high, cd_high);
            let p: *mut f64 = p.cast();
            _mm256_storeu_pd(p, _mm256_permute2f128_pd::<0x20>(r0, r1));
            _mm256_storeu_pd(p.add(4), _mm256_permute2f128_pd::<0x20>(r2, r3));
            _mm256_storeu_pd(p.add(8), _mm256_permute2f128_pd::<0x31>(r0, r1));
            _mm256_storeu_pd(p.add(12), _mm256_permute2f128_pd::<0x31>(r2, r3));
        }
    }
}

/// Copies the first four lanes to all fours.
#[inline(always)]
unsafe fn other_four(x: __m256) -> __m256 {
    unsafe { _mm256_permute2f128_ps::<0x01>(x, x) }
}

/// Loads four columns of eight rows of four words.
#[inline(always)]
unsafe fn transpose_words(low: [__m128i; 4], high: [__m128i; 4]) -> [U32x8; 4] {
    unsafe {
        // Rows k and k + 4 go to the halves of vector k.
        let mut v = [_mm256_setzero_si256(); 4];
        let mut k = 0;
        while k < 4 {
            v[k] = _mm256_inserti128_si256::<1>(_mm256_castsi128_si256(low[k]), high[k]);
            k += 1;
        }
        let a = _mm256_unpacklo_epi32(v[0], v[1]);
        let b = _mm256_unpackhi_epi32(v[0], v[1]);
        let c = _mm256_unpacklo_epi32(v[2], v[3]);
        let d = _mm256_unpackhi_epi32(v[2], v[3]);
        [
            U32x8(_mm256_unpacklo_epi64(a, c)),
            U32x8(_mm256_unpackhi_epi64(a, c)),
            U32x8(_mm256_unpacklo_epi64(b, d)),
            U32x8(_mm256_unpackhi_epi64(b, d)),
        ]
    }
}

#[inline(always)]
unsafe fn transposed([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
    unsafe {
        let (ab_low, ab_high) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (cd_low, cd_high) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        [
            _mm256_permute2f128_pd::<0x20>(ab_low, cd_low),
            _mm256_permute2f128_pd::<0x20>(ab_high, cd_high),
            _mm256_permute2f128_pd::<0x31>(ab_low, cd_low),
            _mm256_permute2f128_pd::<0x31>(ab_high, cd_high),
        ]
    }
}

impl Reals for F64x4 {
    type Scalar = f64;
    type Words = U32x4;
    const LANES: usize = 4;

    methods! {
        splat(x: f64) -> Self = F64x4(_mm256_set1_pd(x));
        load(p: *const f64) -> Self = F64x4(_mm256_loadu_pd(p));
        store(self, p: *mut f64) = _mm256_storeu_pd(p, self.0);
        of_signed(words: U32x4) -> Self = F64x4(_mm256_cvtepi32_pd(words.0));
        mul_add(self, a: Self, b: Self) -> Self = F64x4(_mm256_fmadd_pd(self.0, a.0, b.0));
        inverse_root(self) -> Self = F64x4(_mm256_div_pd(_mm256_set1_pd(1.0), _mm256_sqrt_pd(self.0)));
        smaller(self, other: Self) -> Self = F64x4(_mm256_min_pd(self.0, other.0));
        store_whole(self, p: *mut i32) = _mm_storeu_si128(p.cast(), _mm256_cvttpd_epi32(self.0));
        lookup(table: *const f64, index: U32x4) -> Self = F64x4(_mm256_i32gather_pd::<8>(table, index.0));
    }
    #[inline(always)]
    unsafe fn encode(words: U32x4) -> Self {
        unsafe {
            let ordinary = _mm256_set1_epi64x(ORDINARY_F64 as i64);
            F64x4(_mm256_castsi256_pd(_mm256_or_si256(_mm256_cvtepu32_epi64(words.0), ordinary)))
        }
    }
    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe { F64x4(_mm256_round_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)) }
    }
    #[inline(always)]
    unsafe fn where_below(self, a: Self, b: Self) -> Self {
        unsafe { F64x4(_mm256_and_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a.0, b.0), self.0)) }
    }
    #[inline(always)]
    unsafe fn mask_below(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
    }
    #[inline(always)]
    unsafe fn compress(self, mask: u32) -> Self {
        unsafe {
            let pairs = _mm256_permutevar8x32_ps(_mm256_castpd_ps(self.0), order(doubled(mask)));
            F64x4(_mm256_castps_pd(pairs))
        }
    }
    #[inline(always)]
    unsafe fn pick(table: *const f64, which: U32x4) -> Self {
        unsafe {
            // The indices of words 2k and 2k + 1.
            let even = _mm256_slli_epi64::<1>(_mm256_cvtepu32_epi64(which.0));
            let words = _mm256_or_si256(even, _mm256_slli_epi64::<32>(even));
            let words = _mm256_or_si256(words, _mm256_set1_epi64x(1 << 32));
            let table = _mm256_castpd_ps(_mm256_loadu_pd(table));
            F64x4(_mm256_castps_pd(_mm256_permutevar8x32_ps(table, words)))
        }
    }
    #[inline(always)]
    unsafe fn store_transposed([a, b, c, d]: [Self; 4], p: *mut f64) {
        unsafe {
            let rows = transposed([a.0, b.0, c.0, d.0]);
            let mut k = 0;
            while k < 4 {
                _mm256_storeu_pd(p.add(4 * k), rows[k]);
                k += 1;
            }
        }
    }
}

impl Words for U32x8 {
    const LANES: usize = 8;

    methods! {
        splat(x: u32) -> Self = U32x8(_mm256_set1_epi32(x as i32));
        load(p: *const u32) -> Self = U32x8(_mm256_loadu_si256(p.cast()));
        store(self, p: *mut u32) = _mm256_storeu_si256(p.cast(), self.0);
        add(self, other: Self) -> Self = U32x8(_mm256_add_epi32(self.0, other.0));
        sub(self, other: Self) -> Self = U32x8(_mm256_sub_epi32(self.0, other.0));
        xor(self, other: Self) -> Self = U32x8(_mm256_xor_si256(self.0, other.0));
        min(self, other: Self) -> Self = U32x8(_mm256_min_epu32(self.0, other.0));
        max(self, other: Self) -> Self = U32x8(_mm256_max_epu32(self.0, other.0));
        load_bytes(p: *const u8) -> Self = U32x8(_mm256_cvtepu8_epi32(_mm_loadl_epi64(p.cast())));
    }
    #[inline(always)]
    unsafe fn rotate(self, by: u32) -> Self {
        unsafe {
            let left = _mm256_sll_epi32(self.0, _mm_cvtsi32_si128(by as i32));
            let right = _mm256_srl_epi32(self.0, _mm_cvtsi32_si128(32 - by as i32));
            U32x8(_mm256_or_si256(left, right))
        }
    }
    #[inline(always)]
    unsafe fn shift_right<const BY: u32>(self) -> Self {
        unsafe { U32x8(_mm256_srlv_epi32(self.0, _mm256_set1_epi32(BY as i32))) }
    }
    #[inline(always)]
    unsafe fn mask_equal(self, other: Self) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0))) as u32 }
    }
    #[inline(always)]
    unsafe fn mask_common(self, other: Self) -> u32 {
        unsafe { 0xff & !U32x8(_mm256_and_si256(self.0, other.0)).mask_equal(U32x8(_mm256_setzero_si256())) }
    }
    #[inline(always)]
    unsafe fn lookup(table: *const u32, index: Self) -> Self {
        unsafe { U32x8(_mm256_i32gather_epi32::<4>(table.cast(), index.0)) }
    }
    #[inline(always)]
    unsafe fn pick(table: *const u32, which: Self) -> Self {
        unsafe { U32x8(_mm256_permutevar8x32_epi32(_mm256_loadu_si256(table.cast()), which.0)) }
    }
}

impl Words for U32x4 {
    const LANES: usize = 4;

    methods! {
        splat(x: u32) -> Self = U32x4(_mm_set1_epi32(x as i32));
        load(p: *const u32) -> Self = U32x4(_mm_loadu_si128(p.cast()));
        store(self, p: *mut u32) = _mm_storeu_si128(p.cast(), self.0);
        add(self, other: Self) -> Self = U32x4(_mm_add_epi32(self.0, other.0));
        sub(self, other: Self) -> Self = U32x4(_mm_sub_epi32(self.0, other.0));
        xor(self, other: Self) -> Self = U32x4(_mm_xor_si128(self.0, other.0));
        min(self, other: Self) -> Self = U32x4(_mm_min_epu32(self.0, other.0));
        max(self, other: Self) -> Self = U32x4(_mm_max_epu32(self.0, other.0));
    }
    #[inline(always)]
    unsafe fn rotate(self, by: u32) -> Self {
        unsafe {
            let left = _mm_sll_epi32(self.0, _mm_cvtsi32_si128(by as i32));
            let right = _mm_srl_epi32(self.0, _mm_cvtsi32_si128(32 - by as i32));
            U32x4(_mm_or_si128(left, right))
        }
    }
    #[inline(always)]
    unsafe fn shift_right<const BY: u32>(self) -> Self {
        unsafe { U32x4(_mm_srlv_epi32(self.0, _mm_set1_epi32(BY as i32))) }
    }
    #[inline(always)]
    unsafe fn mask_equal(self, other: Self) -> u32 {
        unsafe { _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(self.0, other.0))) as u32 }
    }
    #[inline(always)]
    unsafe fn mask_common(self, other: Self) -> u32 {
        unsafe { 0xf & !U32x4(_mm_and_si128(self.0, other.0)).mask_equal(U32x4(_mm_setzero_si128())) }
    }
    #[inline(always)]
    unsafe fn lookup(table: *const u32, index: Self) -> Self {
        unsafe { U32x4(_mm_i32gather_epi32::<4>(table.cast(), index.0)) }
    }
    #[inline(always)]
    unsafe fn load_bytes(p: *const u8) -> Self {
        unsafe { U32x4(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(p.cast::<i32>().read_unaligned()))) }
    }
    #[inline(always)]
    unsafe fn pick(table: *const u32, which: Self) -> Self {
        unsafe { U32x4(_mm_castps_si128(_mm_permutevar_ps(_mm_loadu_ps(table.cast()), which.0))) }
    }
}

impl Isa for Avx2 {
    type F32 = F32x8;
    type F64 = F64x4;
    type Quad = Quad4;

    methods! {
        broadcast16(x: u16, p: *mut u16) = _mm256_storeu_si256(p.cast(), _mm256_set1_epi16(x as i16));
        of_bits(words: U32x8) -> F32x8 = F32x8(_mm256_castsi256_ps(words.0));
    }
    #[inline(always)]
    unsafe fn distance_masks<const SHIFTS: bool>(
        x: [*const u16; 3],
        shift: [u32; 3],
        four: &[BroadcastPair; 2],
        limit: i16,
    ) -> u64 {
        unsafe {
            let mut sums = [_mm256_setzero_si256(); 4];
            let mut c = 0;
            while c < 3 {
                let mut there = _mm256_loadu_si256(x[c].cast());
                if SHIFTS {
                    there = _mm256_add_epi16(there, _mm256_set1_epi32(shift[c] as i32));
                }
                let mut k = 0;
                while k < 4 {
                    let here: *const __m256i = four[k / 2].0[c].as_ptr().add(16 * (k % 2)).cast();
                    let d = _mm256_sub_epi16(_mm256_load_si256(here), there);
                    sums[k] = _mm256_adds_epi16(sums[k], _mm256_mulhi_epi16(d, d));
                    k += 1;
                }
                c += 1;
            }
            let limit = _mm256_set1_epi16(limit);
            let mut mask = 0;
            let mut k = 0;
            while k < 4 {
                let this = _mm256_cmpgt_epi16(limit, sums[k]);
                let next = _mm256_cmpgt_epi16(limit, sums[k + 1]);
                // The halves of both masks are joined first, then those of each mask.
                let bytes = _mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_packs_epi16(this, next));
                mask |= (_mm256_movemask_epi8(bytes) as u32 as u64) << (16 * k);
                k += 2;
            }
            mask
        }
    }
    #[inline(always)]
    unsafe fn transpose_masks(masks: *mut u64) {
        unsafe {
            // The words are interleaved in halves, words 0 of both masks, words 1, …; then the halves are joined.
            let words = _mm256_setr_epi8(
                0, 1, 8, 9, 2, 3, 10, 11, 4, 5, 12, 13, 6, 7, 14, 15, 0, 1, 8, 9, 2, 3, 10, 11, 4, 5, 12, 13,
                6, 7, 14, 15,
            );
            let halves = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
            let mut k = 0;
            while k < 8 {
                let p: *mut __m256i = masks.add(k).cast();
                let m = _mm256_shuffle_epi8(_mm256_loadu_si256(p), words);
                _mm256_storeu_si256(p, _mm256_permutevar8x32_epi32(m, halves));
                k += 4;
            }
        }
    }
    #[inline(always)]
    unsafe fn expand_mask(j_bases: *const u32, mask: u64, p: *mut u32) -> usize {
        unsafe {
            let mut found = 0;
            let mut k = 0;
            while k < 8 {
                let mask = (mask >> (8 * k)) as u32 & 0xff;
                let mut base = _mm256_set1_epi32(*j_bases.add(k / 2) as i32);
                if k % 2 == 1 {
                    base = _mm256_add_epi32(base, _mm256_set1_epi32(8 << OFFSET_BITS));
                }
                let places = _mm256_slli_epi32::<{ OFFSET_BITS as i32 }>(order(mask));
                _mm256_storeu_si256(p.add(found).cast(), _mm256_add_epi32(base, places));
                found += mask.count_ones() as usize;
                k += 1;
            }
            found
        }
    }
    #[inline(always)]
    unsafe fn root_or_more(x: F32x8) -> F32x8 {
        unsafe {
            // The relative error of the estimate is below 1/2700.
            let inverse = _mm256_rsqrt_ps(_mm256_max_ps(x.0, _mm256_set1_ps(f32::MIN_POSITIVE)));
            let x = _mm256_max_ps(x.0, _mm256_setzero_ps());
            F32x8(_mm256_mul_ps(x, _mm256_mul_ps(inverse, _mm256_set1_ps(1.000_5))))
        }
    }
    #[inline(always)]
    unsafe fn cluster_first<const CLUSTER: usize>(x: F32x8) -> F32x8 {
        unsafe {
            let first = _mm256_permute_ps::<0x00>(x.0);
            F32x8(if CLUSTER == 8 { _mm256_permute2f128_ps::<0x00>(first, first) } else { first })
        }
    }
    #[inline(always)]
    unsafe fn cluster_least<const CLUSTER: usize>(x: F32x8) -> F32x8 {
        unsafe {
            let two = _mm256_min_ps(x.0, _mm256_permute_ps::<0b10_11_00_01>(x.0));
            let four = _mm256_min_ps(two, _mm256_permute_ps::<0b01_00_11_10>(two));
            F32x8(if CLUSTER == 8 { _mm256_min_ps(four, other_four(four)) } else { four })
        }
    }
    #[inline(always)]
    unsafe fn cluster_greatest<const CLUSTER: usize>(x: F32x8) -> F32x8 {
        unsafe {
            let two = _mm256_max_ps(x.0, _mm256_permute_ps::<0b10_11_00_01>(x.0));
            let four = _mm256_max_ps(two, _mm256_permute_ps::<0b01_00_11_10>(two));
            F32x8(if CLUSTER == 8 { _mm256_max_ps(four, other_four(four)) } else { four })
        }
    }
    #[inline(always)]
    unsafe fn load_transposed<const ALL: bool>(base: *const u8, offsets: *const u32) -> [U32x8; 8] {
        unsafe {
            let mut records = [[_mm_setzero_si128(); 8]; 2];
            let mut k = 0;
            while k < 8 {
                let at: *const __m128i = record_at(base, offsets, k).cast();
                records[0][k] = _mm_loadu_si128(at);
                records[1][k] = _mm_loadu_si128(at.add(1));
                k += 1;
            }
            let [[a0, a1, a2, a3, a4, a5, a6, a7], [b0, b1, b2, b3, b4, b5, b6, b7]] = records;
            let [a, b, c, d] = transpose_words([a0, a1, a2, a3], [a4, a5, a6, a7]);
            let zero = U32x8(_mm256_setzero_si256());
            let [e, f, g, h] =
                if ALL { transpose_words([b0, b1, b2, b3], [b4, b5, b6, b7]) } else { [zero; 4] };
            [a, b, c, d, e, f, g, h]
        }
    }
    #[inline(always)]
    unsafe fn load_transposed_wide<const ALL: bool>(base: *const u8, offsets: *const u32) -> [F64x4; 8] {
        unsafe {
            let mut records = [[_mm256_setzero_pd(); 4]; 2];
            let mut k = 0;
            while k < 4 {
                let at: *const f64 = wide_record_at(base, offsets, k).cast();
                records[0][k] = _mm256_loadu_pd(at);
                records[1][k] = _mm256_loadu_pd(at.add(4));
                k += 1;
            }
            let [a, b, c, d] = transposed(records[0]);
            let [e, f, g, h] = if ALL { transposed(records[1]) } else { records[1] };
            [F64x4(a), F64x4(b), F64x4(c), F64x4(d), F64x4(e), F64x4(f), F64x4(g), F64x4(h)]
        }
    }
    #[inline(always)]
    unsafe fn halves(x: F64x4) -> [U32x4; 2] {
        unsafe {
            let low = _mm_castpd_ps(_mm256_castpd256_pd128(x.0));
            let high = _mm_castpd_ps(_mm256_extractf128_pd::<1>(x.0));
            [
                U32x4(_mm_castps_si128(_mm_shuffle_ps::<0x88>(low, high))),
                U32x4(_mm_castps_si128(_mm_shuffle_ps::<0xdd>(low, high))),
            ]
        }
    }
}
