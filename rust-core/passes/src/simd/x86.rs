//! Vectors and operators that both instruction sets of x86-64 share.

use super::Quad;
use std::arch::x86_64::*;

/// Four `f64`, the sums of a particle.
#[derive(Clone, Copy)]
pub struct Quad4(__m256d);

impl Quad for Quad4 {
    methods! {
        zero() -> Self = Quad4(_mm256_setzero_pd());
        splat(x: f64) -> Self = Quad4(_mm256_set1_pd(x));
        load(p: *const f64) -> Self = Quad4(_mm256_loadu_pd(p));
        store(self, p: *mut f64) = _mm256_storeu_pd(p, self.0);
        add(self, other: Self) -> Self = Quad4(_mm256_add_pd(self.0, other.0));
        sub(self, other: Self) -> Self = Quad4(_mm256_sub_pd(self.0, other.0));
        mul(self, other: Self) -> Self = Quad4(_mm256_mul_pd(self.0, other.0));
        mul_add(self, a: Self, b: Self) -> Self = Quad4(_mm256_fmadd_pd(self.0, a.0, b.0));
        neg_mul_add(self, a: Self, b: Self) -> Self = Quad4(_mm256_fnmadd_pd(self.0, a.0, b.0));
        splat_f32(x: f32) -> Self = Quad4(_mm256_cvtps_pd(_mm_set1_ps(x)));
        load_f32(p: *const f32) -> Self = Quad4(_mm256_cvtps_pd(_mm_loadu_ps(p)));
    }
    #[inline(always)]
    unsafe fn load_three_f32(p: *const f32) -> Self {
        unsafe { Quad4(_mm256_cvtps_pd(_mm_blend_ps::<0b1000>(_mm_loadu_ps(p), _mm_setzero_ps()))) }
    }
    #[inline(always)]
    unsafe fn load_three(p: *const f64) -> Self {
        unsafe { Quad4(_mm256_blend_pd::<0b1000>(_mm256_loadu_pd(p), _mm256_setzero_pd())) }
    }
    #[inline(always)]
    unsafe fn totals(self, other: Self) -> [Self; 2] {
        unsafe {
            // Sums of two elements, of both in turn.
            let halves = _mm256_hadd_pd(self.0, other.0);
            let sums = _mm256_add_pd(halves, _mm256_permute2f128_pd::<0x01>(halves, halves));
            [Quad4(_mm256_movedup_pd(sums)), Quad4(_mm256_permute_pd::<0b1111>(sums))]
        }
    }
}

/// Defines operators by intrinsics. They are safe functions because operators are; the module above states the contract.
macro_rules! operators {
    ($vector:ident, $constant:ident as $scalar:ty, $add:ident, $sub:ident, $mul:ident, $max:ident) => {
        impl Add for $vector {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                unsafe { Self($add(self.0, other.0)) }
            }
        }
        impl Sub for $vector {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                unsafe { Self($sub(self.0, other.0)) }
            }
        }
        impl Mul for $vector {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                unsafe { Self($mul(self.0, other.0)) }
            }
        }
        impl Real for $vector {
            #[inline(always)]
            fn constant(x: f64) -> Self {
                unsafe { Self($constant(x as $scalar)) }
            }
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                unsafe { Self($max(self.0, other.0)) }
            }
        }
    };
}
pub(super) use operators;
