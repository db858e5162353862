//! Vectors for AVX-512 (F, BW, DQ, VL), with or without VBMI2; with AVX2, FMA and BMI2.

use super::avx2::{Avx2, U32x8};
use super::x86::{Quad4, operators};
use super::{BroadcastPair, Isa, ORDINARY_F32, ORDINARY_F64, Reals, Words, record_at, wide_record_at};
use psidpd_model::kernel::Real;
use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

/// The instruction set; with `VBMI2` it compresses bytes, without it makes the lists of AVX2.
#[derive(Clone, Copy)]
pub struct Avx512<const VBMI2: bool>;

/// Vector of sixteen `f32`.
#[derive(Clone, Copy)]
pub struct F32x16(__m512);

/// Vector of eight `f64`.
#[derive(Clone, Copy)]
pub struct F64x8(__m512d);

/// Vector of sixteen `u32`.
#[derive(Clone, Copy)]
pub struct U32x16(__m512i);

operators!(F32x16, _mm512_set1_ps as f32, _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps, _mm512_max_ps);
operators!(F64x8, _mm512_set1_pd as f64, _mm512_add_pd, _mm512_sub_pd, _mm512_mul_pd, _mm512_max_pd);

impl Reals for F32x16 {
    type Scalar = f32;
    type Words = U32x16;
    const LANES: usize = 16;

    methods! {
        splat(x: f32) -> Self = F32x16(_mm512_set1_ps(x));
        load(p: *const f32) -> Self = F32x16(_mm512_loadu_ps(p));
        store(self, p: *mut f32) = _mm512_storeu_ps(p, self.0);
        of_signed(words: U32x16) -> Self = F32x16(_mm512_cvtepi32_ps(words.0));
        mul_add(self, a: Self, b: Self) -> Self = F32x16(_mm512_fmadd_ps(self.0, a.0, b.0));
        smaller(self, other: Self) -> Self = F32x16(_mm512_min_ps(self.0, other.0));
        store_whole(self, p: *mut i32) = _mm512_storeu_si512(p.cast(), _mm512_cvttps_epi32(self.0));
        mask_below(self, other: Self) -> u32 = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) as u32;
        compress(self, mask: u32) -> Self = F32x16(_mm512_maskz_compress_ps(mask as u16, self.0));
    }
    #[inline(always)]
    unsafe fn encode(words: U32x16) -> Self {
        let ordinary = ORDINARY_F32 as i32;
        unsafe { F32x16(_mm512_castsi512_ps(_mm512_add_epi32(words.0, _mm512_set1_epi32(ordinary)))) }
    }
    #[inline(always)]
    unsafe fn inverse_root(self) -> Self {
        unsafe {
            // The estimate has 14 bits; one step of Newton's method refines it.
            let y = _mm512_rsqrt14_ps(self.0);
            let half = _mm512_mul_ps(_mm512_set1_ps(-0.5), self.0);
            let yy = _mm512_mul_ps(y, y);
            let e = _mm512_fmadd_ps(half, yy, _mm512_set1_ps(0.5));
            F32x16(_mm512_fmadd_ps(y, e, y))
        }
    }
    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe { F32x16(_mm512_roundscale_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)) }
    }
    #[inline(always)]
    unsafe fn where_below(self, a: Self, b: Self) -> Self {
        unsafe { F32x16(_mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a.0, b.0), self.0)) }
    }
    #[inline(always)]
    unsafe fn pick(table: *const f32, which: U32x16) -> Self {
        unsafe { F32x16(_mm512_permutexvar_ps(which.0, _mm512_loadu_ps(table))) }
    }
    #[inline(always)]
    unsafe fn lookup(table: *const f32, index: U32x16) -> Self {
        unsafe { F32x16(_mm512_i32gather_ps::<4>(index.0, table.cast())) }
    }
    #[inline(always)]
    unsafe fn store_transposed(columns: [Self; 4], p: *mut f32) {
        unsafe {
            let [a, b, c, d] = columns;
            let ab_low = _mm512_castps_pd(_mm512_unpacklo_ps(a.0, b.0));
            let ab_high = _mm512_castps_pd(_mm512_unpackhi_ps(a.0, b.0));
            let cd_low = _mm512_castps_pd(_mm512_unpacklo_ps(c.0, d.0));
            let cd_high = _mm512_castps_pd(_mm512_unpackhi_ps(c.0, d.0));
            // The four quarters contain rows k, k + 4, k + 8 and k + 12.
            let r0 = _mm512_castpd_ps(_mm512_unpacklo_pd(ab_low, cd_low));
            let r1 = _mm512_castpd_ps(_mm512_unpackhi_pd(ab_low, cd_low));
            let r2 = _mm512_castpd_ps(_mm512_unpacklo_pd(ab_high, cd_high));
            let r3 = _mm512_castpd_ps(_mm512_unpackhi_pd(ab_high, cd_high));
            let low01 = _mm512_shuffle_f32x4::<0x44>(r0, r1);
            let low23 = _mm512_shuffle_f32x4::<0x44>(r2, r3);
            let high01 = _mm512_shuffle_f32x4::<0xee>(r0, r1);
            let high23 = _mm512_shuffle_f32x4::<0xee>(r2, r3);
            _mm512_storeu_ps(p, _mm512_shuffle_f32x4::<0x88>(low01, low23));
            _mm512_storeu_ps(p.add(16), _mm512_shuffle_f32x4::<0xdd>(low01, low23));
            _mm512_storeu_ps(p.add(32), _mm512_shuffle_f32x4::<0x88>(high01, high23));
            _mm512_storeu_ps(p.add(48), _mm512_shuffle_f32x4::<0xdd>(high01, high23));
        }
    }
}

/// Loads sixteen bytes at each of the rows, `offsets` bytes after `base`.
#[inline(always)]
unsafe fn row(base: *const u8, offsets: *const u32, k: usize) -> [__m128i; 2] {
    unsafe {
        let at: *const __m128i = record_at(base, offsets, k).cast();
        [_mm_loadu_si128(at), _mm_loadu_si128(at.add(1))]
    }
}

/// Transposes four by four words within quarters.
#[inline(always)]
unsafe fn transposed(v: [__m512i; 4]) -> [U32x16; 4] {
    unsafe {
        let a = _mm512_unpacklo_epi32(v[0], v[1]);
        let b = _mm512_unpackhi_epi32(v[0], v[1]);
        let c = _mm512_unpacklo_epi32(v[2], v[3]);
        let d = _mm512_unpackhi_epi32(v[2], v[3]);
        [
            U32x16(_mm512_unpacklo_epi64(a, c)),
            U32x16(_mm512_unpackhi_epi64(a, c)),
            U32x16(_mm512_unpacklo_epi64(b, d)),
            U32x16(_mm512_unpackhi_epi64(b, d)),
        ]
    }
}

impl Reals for F64x8 {
    type Scalar = f64;
    type Words = U32x8;
    const LANES: usize = 8;

    methods! {
        splat(x: f64) -> Self = F64x8(_mm512_set1_pd(x));
        load(p: *const f64) -> Self = F64x8(_mm512_loadu_pd(p));
        store(self, p: *mut f64) = _mm512_storeu_pd(p, self.0);
        of_signed(words: U32x8) -> Self = F64x8(_mm512_cvtepi32_pd(words.0));
        mul_add(self, a: Self, b: Self) -> Self = F64x8(_mm512_fmadd_pd(self.0, a.0, b.0));
        smaller(self, other: Self) -> Self = F64x8(_mm512_min_pd(self.0, other.0));
        store_whole(self, p: *mut i32) = _mm256_storeu_si256(p.cast(), _mm512_cvttpd_epi32(self.0));
        mask_below(self, other: Self) -> u32 = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) as u32;
        compress(self, mask: u32) -> Self = F64x8(_mm512_maskz_compress_pd(mask as u8, self.0));
    }
    #[inline(always)]
    unsafe fn encode(words: U32x8) -> Self {
        unsafe {
            let ordinary = _mm512_set1_epi64(ORDINARY_F64 as i64);
            F64x8(_mm512_castsi512_pd(_mm512_or_si512(_mm512_cvtepu32_epi64(words.0), ordinary)))
        }
    }
    #[inline(always)]
    unsafe fn inverse_root(self) -> Self {
        unsafe {
            // The precision grows from 14 to 28 and 53 bits.
            let half = _mm512_mul_pd(_mm512_set1_pd(-0.5), self.0);
            let mut y = _mm512_rsqrt14_pd(self.0);
            let mut k = 0;
            while k < 2 {
                let e = _mm512_fmadd_pd(half, _mm512_mul_pd(y, y), _mm512_set1_pd(0.5));
                y = _mm512_fmadd_pd(y, e, y);
                k += 1;
            }
            F64x8(y)
        }
    }
    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe { F64x8(_mm512_roundscale_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)) }
    }
    #[inline(always)]
    unsafe fn where_below(self, a: Self, b: Self) -> Self {
        unsafe { F64x8(_mm512_maskz_mov_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a.0, b.0), self.0)) }
    }
    #[inline(always)]
    unsafe fn pick(table: *const f64, which: U32x8) -> Self {
        unsafe { F64x8(_mm512_permutexvar_pd(_mm512_cvtepu32_epi64(which.0), _mm512_loadu_pd(table))) }
    }
    #[inline(always)]
    unsafe fn lookup(table: *const f64, index: U32x8) -> Self {
        unsafe { F64x8(_mm512_i32gather_pd::<8>(index.0, table.cast())) }
    }
    #[inline(always)]
    unsafe fn store_transposed(columns: [Self; 4], p: *mut f64) {
        unsafe {
            let [a, b, c, d] = columns;
            let ab_low = _mm512_unpacklo_pd(a.0, b.0);
            let ab_high = _mm512_unpackhi_pd(a.0, b.0);
            let cd_low = _mm512_unpacklo_pd(c.0, d.0);
            let cd_high = _mm512_unpackhi_pd(c.0, d.0);
            // The quarters of the low vectors contain lanes 0,2,4,6 of the columns, those of
            // the high vectors lanes 1,3,5,7.
            let first = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
            let second = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
            let even01 = _mm512_permutex2var_pd(ab_low, first, cd_low);
            let odd01 = _mm512_permutex2var_pd(ab_high, first, cd_high);
            let even23 = _mm512_permutex2var_pd(ab_low, second, cd_low);
            let odd23 = _mm512_permutex2var_pd(ab_high, second, cd_high);
            _mm512_storeu_pd(p, _mm512_shuffle_f64x2::<0x44>(even01, odd01));
            _mm512_storeu_pd(p.add(8), _mm512_shuffle_f64x2::<0xee>(even01, odd01));
            _mm512_storeu_pd(p.add(16), _mm512_shuffle_f64x2::<0x44>(even23, odd23));
            _mm512_storeu_pd(p.add(24), _mm512_shuffle_f64x2::<0xee>(even23, odd23));
        }
    }
}

impl Words for U32x16 {
    const LANES: usize = 16;

    methods! {
        splat(x: u32) -> Self = U32x16(_mm512_set1_epi32(x as i32));
        load(p: *const u32) -> Self = U32x16(_mm512_loadu_si512(p.cast()));
        store(self, p: *mut u32) = _mm512_storeu_si512(p.cast(), self.0);
        add(self, other: Self) -> Self = U32x16(_mm512_add_epi32(self.0, other.0));
        sub(self, other: Self) -> Self = U32x16(_mm512_sub_epi32(self.0, other.0));
        xor(self, other: Self) -> Self = U32x16(_mm512_xor_si512(self.0, other.0));
        min(self, other: Self) -> Self = U32x16(_mm512_min_epu32(self.0, other.0));
        max(self, other: Self) -> Self = U32x16(_mm512_max_epu32(self.0, other.0));
        rotate(self, by: u32) -> Self = U32x16(_mm512_rolv_epi32(self.0, _mm512_set1_epi32(by as i32)));
        mask_equal(self, other: Self) -> u32 = _mm512_cmpeq_epi32_mask(self.0, other.0) as u32;
        mask_common(self, other: Self) -> u32 = _mm512_test_epi32_mask(self.0, other.0) as u32;
        load_bytes(p: *const u8) -> Self = U32x16(_mm512_cvtepu8_epi32(_mm_loadu_si128(p.cast())));
    }
    #[inline(always)]
    unsafe fn shift_right<const BY: u32>(self) -> Self {
        unsafe { U32x16(_mm512_srlv_epi32(self.0, _mm512_set1_epi32(BY as i32))) }
    }
    #[inline(always)]
    unsafe fn lookup(table: *const u32, index: Self) -> Self {
        unsafe { U32x16(_mm512_i32gather_epi32::<4>(index.0, table.cast())) }
    }
    #[inline(always)]
    unsafe fn pick(table: *const u32, which: Self) -> Self {
        unsafe { U32x16(_mm512_permutexvar_epi32(which.0, _mm512_loadu_si512(table.cast()))) }
    }
}

/// Loads four numbers of each row, twice `offsets` bytes after `base`.
#[inline(always)]
unsafe fn four_columns(base: *const u8, offsets: *const u32) -> [F64x8; 4] {
    unsafe {
        // The halves contain rows k and k + 4.
        let mut v = [_mm512_setzero_pd(); 4];
        let mut k = 0;
        while k < 4 {
            let low: *const f64 = wide_record_at(base, offsets, k).cast();
            let high: *const f64 = wide_record_at(base, offsets, k + 4).cast();
            let half = _mm512_castpd256_pd512(_mm256_loadu_pd(low));
            v[k] = _mm512_insertf64x4::<1>(half, _mm256_loadu_pd(high));
            k += 1;
        }
        // The vectors are (0,2) of rows 0,1; (1,3) …
        let a = _mm512_unpacklo_pd(v[0], v[1]);
        let b = _mm512_unpackhi_pd(v[0], v[1]);
        let c = _mm512_unpacklo_pd(v[2], v[3]);
        let d = _mm512_unpackhi_pd(v[2], v[3]);
        let even = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
        let odd = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
        [
            F64x8(_mm512_permutex2var_pd(a, even, c)),
            F64x8(_mm512_permutex2var_pd(b, even, d)),
            F64x8(_mm512_permutex2var_pd(a, odd, c)),
            F64x8(_mm512_permutex2var_pd(b, odd, d)),
        ]
    }
}

/// An array aligned to sixty-four bytes.
#[repr(C, align(64))]
struct Line<T>(T);

/// Source indices of the sixteen-bit words of transposed masks.
static TURNED: Line<[u16; 32]> = Line(turned());

const fn turned() -> [u16; 32] {
    let mut from = [0; 32];
    let mut k = 0;
    while k < 32 {
        // Indices of the half, the particle and the j-cluster.
        let (h, p, c) = (k / 16, k / 4 % 4, k % 4);
        from[k] = (16 * h + 4 * c + p) as u16;
        k += 1;
    }
    from
}

/// For each bit of a mask of sixty-four: four times its number within its sixteen, plus the number of the sixteen.
static PLACES: Line<[u8; 64]> = Line(bit_places());

const fn bit_places() -> [u8; 64] {
    let mut places = [0; 64];
    let mut k = 0;
    while k < 64 {
        places[k] = (4 * (k % 16) + k / 16) as u8;
        k += 1;
    }
    places
}

/// Copies the first four lanes of each eight to the second four.
#[inline(always)]
unsafe fn other_fours(x: __m512) -> __m512 {
    unsafe { _mm512_shuffle_f32x4::<0b10_11_00_01>(x, x) }
}

/// Writes the offsets of sixteen bits.
#[inline(always)]
unsafe fn places(j_bases: __m512, bits: __m128i, p: *mut u32) {
    unsafe {
        let code = _mm512_cvtepu8_epi32(bits);
        // Only the lowest two bits of each word select.
        let base = _mm512_castps_si512(_mm512_permutevar_ps(j_bases, code));
        let place = _mm512_slli_epi32::<3>(_mm512_and_si512(code, _mm512_set1_epi32(0x3c)));
        let sum = _mm512_add_epi32(base, place);
        // The vector is stored in halves: a whole store across cache lines takes more than twice as long.
        _mm256_storeu_si256(p.cast(), _mm512_castsi512_si256(sum));
        _mm256_storeu_si256(p.add(8).cast(), _mm512_extracti64x4_epi64::<1>(sum));
    }
}

/// Expands as [`Isa::expand_mask`], all sixty-four bits at once.
#[inline(always)]
unsafe fn expand_bytes(j_bases: *const u32, mask: u64, p: *mut u32) -> usize {
    unsafe {
        // In each byte the number of the base is in the bits below the bit's number within its sixteen.
        let packed = _mm512_maskz_compress_epi8(mask, _mm512_load_si512((&raw const PLACES).cast()));
        let j_bases = _mm512_castsi512_ps(_mm512_broadcast_i32x4(_mm_loadu_si128(j_bases.cast())));
        let count = mask.count_ones() as usize;
        places(j_bases, _mm512_castsi512_si128(packed), p);
        if count > 16 {
            places(j_bases, _mm512_extracti32x4_epi32::<1>(packed), p.add(16));
            if count > 32 {
                places(j_bases, _mm512_extracti32x4_epi32::<2>(packed), p.add(32));
                places(j_bases, _mm512_extracti32x4_epi32::<3>(packed), p.add(48));
            }
        }
        count
    }
}

impl<const VBMI2: bool> Isa for Avx512<VBMI2> {
    type F32 = F32x16;
    type F64 = F64x8;
    type Quad = Quad4;

    methods! {
        broadcast16(x: u16, p: *mut u16) = _mm256_storeu_si256(p.cast(), _mm256_set1_epi16(x as i16));
        of_bits(words: U32x16) -> F32x16 = F32x16(_mm512_castsi512_ps(words.0));
    }
    #[inline(always)]
    unsafe fn distance_masks<const SHIFTS: bool>(
        x: [*const u16; 3],
        shift: [u32; 3],
        four: &[BroadcastPair; 2],
        limit: i16,
    ) -> u64 {
        unsafe {
            let mut sums = [_mm512_setzero_si512(); 2];
            let mut c = 0;
            while c < 3 {
                let mut there = _mm512_broadcast_i64x4(_mm256_loadu_si256(x[c].cast()));
                if SHIFTS {
                    there = _mm512_add_epi16(there, _mm512_set1_epi32(shift[c] as i32));
                }
                let mut k = 0;
                while k < 2 {
                    let d = _mm512_sub_epi16(_mm512_load_si512(four[k].0[c].as_ptr().cast()), there);
                    sums[k] = _mm512_adds_epi16(sums[k], _mm512_mulhi_epi16(d, d));
                    k += 1;
                }
                c += 1;
            }
            let limit = _mm512_set1_epi16(limit);
            let low = _mm512_cmplt_epi16_mask(sums[0], limit);
            let high = _mm512_cmplt_epi16_mask(sums[1], limit);
            low as u64 | (high as u64) << 32
        }
    }
    #[inline(always)]
    unsafe fn transpose_masks(masks: *mut u64) {
        unsafe {
            let m = _mm512_loadu_si512(masks.cast());
            let to = _mm512_load_si512((&raw const TURNED).cast());
            _mm512_storeu_si512(masks.cast(), _mm512_permutexvar_epi16(to, m));
        }
    }
    #[inline(always)]
    unsafe fn expand_mask(j_bases: *const u32, mask: u64, p: *mut u32) -> usize {
        unsafe { if VBMI2 { expand_bytes(j_bases, mask, p) } else { Avx2::expand_mask(j_bases, mask, p) } }
    }
    #[inline(always)]
    unsafe fn root_or_more(x: F32x16) -> F32x16 {
        unsafe {
            // The estimate has 14 bits.
            let inverse = _mm512_rsqrt14_ps(_mm512_max_ps(x.0, _mm512_set1_ps(f32::MIN_POSITIVE)));
            let x = _mm512_max_ps(x.0, _mm512_setzero_ps());
            F32x16(_mm512_mul_ps(x, _mm512_mul_ps(inverse, _mm512_set1_ps(1.000_1))))
        }
    }
    #[inline(always)]
    unsafe fn cluster_first<const CLUSTER: usize>(x: F32x16) -> F32x16 {
        unsafe {
            let first = _mm512_permute_ps::<0x00>(x.0);
            F32x16(if CLUSTER == 8 { _mm512_shuffle_f32x4::<0b10_10_00_00>(first, first) } else { first })
        }
    }
    #[inline(always)]
    unsafe fn cluster_least<const CLUSTER: usize>(x: F32x16) -> F32x16 {
        unsafe {
            let two = _mm512_min_ps(x.0, _mm512_permute_ps::<0b10_11_00_01>(x.0));
            let four = _mm512_min_ps(two, _mm512_permute_ps::<0b01_00_11_10>(two));
            F32x16(if CLUSTER == 8 { _mm512_min_ps(four, other_fours(four)) } else { four })
        }
    }
    #[inline(always)]
    unsafe fn cluster_greatest<const CLUSTER: usize>(x: F32x16) -> F32x16 {
        unsafe {
            let two = _mm512_max_ps(x.0, _mm512_permute_ps::<0b10_11_00_01>(x.0));
            let four = _mm512_max_ps(two, _mm512_permute_ps::<0b01_00_11_10>(two));
            F32x16(if CLUSTER == 8 { _mm512_max_ps(four, other_fours(four)) } else { four })
        }
    }
    #[inline(always)]
    unsafe fn load_transposed<const ALL: bool>(base: *const u8, offsets: *const u32) -> [U32x16; 8] {
        unsafe {
            // The quarters of vector k receive rows k, k + 4, k + 8 and k + 12.
            let (mut v, mut w) = ([_mm512_setzero_si512(); 4], [_mm512_setzero_si512(); 4]);
            let mut k = 0;
            while k < 4 {
                // Masked broadcasts from memory write a quarter each: they are loads, while
                // insertions need the shuffle port.
                let [low, high] = row(base, offsets, k);
                let (low, high) = (_mm512_castsi128_si512(low), _mm512_castsi128_si512(high));
                let [a, b] = row(base, offsets, k + 4);
                let low = _mm512_mask_broadcast_i32x4(low, 0x00f0, a);
                let high = _mm512_mask_broadcast_i32x4(high, 0x00f0, b);
                let [a, b] = row(base, offsets, k + 8);
                let low = _mm512_mask_broadcast_i32x4(low, 0x0f00, a);
                let high = _mm512_mask_broadcast_i32x4(high, 0x0f00, b);
                let [a, b] = row(base, offsets, k + 12);
                v[k] = _mm512_mask_broadcast_i32x4(low, 0xf000, a);
                if ALL {
                    w[k] = _mm512_mask_broadcast_i32x4(high, 0xf000, b);
                }
                k += 1;
            }
            let ([a, b, c, d], [e, f, g, h]) = (transposed(v), transposed(w));
            [a, b, c, d, e, f, g, h]
        }
    }
    #[inline(always)]
    unsafe fn load_transposed_wide<const ALL: bool>(base: *const u8, offsets: *const u32) -> [F64x8; 8] {
        unsafe {
            let zero = F64x8(_mm512_setzero_pd());
            let [a, b, c, d] = four_columns(base, offsets);
            let [e, f, g, h] = if ALL { four_columns(base.add(32), offsets) } else { [zero; 4] };
            [a, b, c, d, e, f, g, h]
        }
    }
    #[inline(always)]
    unsafe fn halves(x: F64x8) -> [U32x8; 2] {
        unsafe {
            let bits = _mm512_castpd_si512(x.0);
            [U32x8(_mm512_cvtepi64_epi32(bits)), U32x8(_mm512_cvtepi64_epi32(_mm512_srli_epi64::<32>(bits)))]
        }
    }
}
