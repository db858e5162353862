//! Vectors of numbers for each instruction set, behind one set of traits.
//!
//! Kernels are written once, generic in [`Isa`], and compiled for an instruction set by a wrapper with
//! `#[target_feature]` into which everything here is inlined. Outside such a wrapper nothing here may
//! be called, except on [`Portable`]: that is the safety contract of every `unsafe fn` of these
//! traits, together with pointers being valid for as many elements as a vector has lanes.

// That contract stands for the reason of each of some hundred blocks.
#![allow(clippy::undocumented_unsafe_blocks)]

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
pub use portable::Portable;

use crate::model::kernel::Real;

/// `f32` or `f64`.
pub trait Scalar: Copy + Default + Send + Sync + PartialOrd + 'static {
    /// The nearest.
    fn of(x: f64) -> Self;
    /// Widened.
    fn wide(self) -> f64;
}

impl Scalar for f32 {
    #[inline(always)]
    fn of(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn wide(self) -> f64 {
        self as f64
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn of(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}

/// A vector of real numbers.
#[allow(clippy::missing_safety_doc)] // One contract, at the head of the module.
pub trait Reals: Real {
    type Scalar: Scalar;
    const LANES: usize;
    unsafe fn splat(x: Self::Scalar) -> Self;
    unsafe fn load(p: *const Self::Scalar) -> Self;
    unsafe fn store(self, p: *mut Self::Scalar);
    /// Signed words as numbers.
    unsafe fn load_signed(p: *const i32) -> Self;
    /// `self · a + b`.
    unsafe fn mul_add(self, a: Self, b: Self) -> Self;
    /// `1/√self`, to the precision of the type, for positive numbers.
    unsafe fn inverse_root(self) -> Self;
    unsafe fn root(self) -> Self;
    /// The smaller of two.
    unsafe fn smaller(self, other: Self) -> Self;
    /// Writes whole numbers, rounded towards zero.
    unsafe fn store_whole(self, p: *mut i32);
    /// The nearest whole number, as long as it is small.
    unsafe fn round(self) -> Self;
    /// `self` where `a < b`, zero elsewhere.
    unsafe fn where_below(self, a: Self, b: Self) -> Self;
    /// Bit `k` is set where lane `k` is below that of `other`.
    unsafe fn mask_below(self, other: Self) -> u32;
    /// Writes the lanes of `mask` one after the other; may write a whole vector.
    unsafe fn compress(self, mask: u32, p: *mut Self::Scalar);
    /// `table[index[k]]` in lane `k`.
    unsafe fn lookup(table: *const Self::Scalar, index: *const u32) -> Self;
    /// The four columns of the rows of four numbers at `base + stride · index[k]` bytes.
    unsafe fn columns(base: *const u8, stride: usize, index: *const u32) -> [Self; 4];
    /// Writes four columns as rows of four.
    unsafe fn rows(columns: [Self; 4], p: *mut Self::Scalar);
}

/// A vector of unsigned words.
#[allow(clippy::missing_safety_doc)]
pub trait Words: Copy {
    const LANES: usize;
    unsafe fn splat(x: u32) -> Self;
    unsafe fn load(p: *const u32) -> Self;
    unsafe fn store(self, p: *mut u32);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn xor(self, other: Self) -> Self;
    unsafe fn min(self, other: Self) -> Self;
    unsafe fn max(self, other: Self) -> Self;
    unsafe fn rotate(self, by: u32) -> Self;
    unsafe fn compress(self, mask: u32, p: *mut u32);
}

/// Four double-precision numbers: what accumulates on a particle.
#[allow(clippy::missing_safety_doc)]
pub trait Quad: Copy {
    unsafe fn zero() -> Self;
    unsafe fn splat(x: f64) -> Self;
    unsafe fn load(p: *const f64) -> Self;
    unsafe fn store(self, p: *mut f64);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn load_f32(p: *const f32) -> Self;
}

/// An instruction set.
#[allow(clippy::missing_safety_doc)]
pub trait Isa: Copy + Send + Sync + 'static {
    type F32: Reals<Scalar = f32>;
    type F64: Reals<Scalar = f64>;
    type U32: Words;
    type Quad: Quad;
    /// Words read as signed numbers.
    unsafe fn signed(words: Self::U32) -> Self::F32;
    /// [`Reals::columns`] of words.
    unsafe fn word_columns(base: *const u8, stride: usize, index: *const u32) -> [Self::U32; 4];
    /// Writes `first + k` for each bit `k` of `mask`, one after the other; may write a whole vector.
    unsafe fn collect(first: u32, mask: u32, p: *mut u32);
}
