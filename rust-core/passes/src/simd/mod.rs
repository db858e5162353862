//! Vectors of numbers for each instruction set, behind one set of traits.
//!
//! Kernels are written once, generic in [`Isa`], and compiled for an instruction set by [`run`], into which everything here
//! is inlined.
//!
//! Why this is sound: vectors of an instruction set may be used only where the processor has it. Their types are private
//! to this module, which names them in one place: [`run`], which takes an [`InstructionSet`], and there is one only of
//! what the processor has. All other code is generic, and is compiled for these types only below [`run`]. So operators and
//! other safe functions of the traits ask for nothing more, and `unsafe` functions ask for what their arguments say:
//! pointers are valid for as many elements as a vector has lanes, unless another number is given.
//!
//! [`InstructionSet`]: crate::instruction_set::InstructionSet

// Those two reasons, the types and the pointers, stand for that of each of some hundred blocks.
#![allow(clippy::undocumented_unsafe_blocks)]

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use dispatch::{Kernel, run};

use psidpd_model::kernel::Real;

/// Indices of particles are shifted by so many bits, to be byte offsets into accumulators and into packed particles of mixed
/// precision, of 32 bytes each.
pub const OFFSET_BITS: u32 = 5;

/// `f32` or `f64`.
pub trait Scalar: Copy + Default + Send + Sync + PartialOrd + 'static {
    /// The nearest.
    fn of(x: f64) -> Self;
    /// Widened.
    fn wide(self) -> f64;
    /// The word that [`Reals::encode`] made this number of.
    fn decode(self) -> u32;
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
    #[inline(always)]
    fn decode(self) -> u32 {
        self.to_bits() - ORDINARY_F32
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
    #[inline(always)]
    fn decode(self) -> u32 {
        self.to_bits() as u32
    }
}

/// Bits of a number of ordinary size, to which words below 2²⁹ are added to pass as numbers.
const ORDINARY_F32: u32 = 0x4000_0000;
/// The same in double precision, for any word.
const ORDINARY_F64: u64 = 0x3ff0_0000_0000_0000;

/// A vector of real numbers.
#[allow(clippy::missing_safety_doc)] // One contract, at the head of the module.
pub trait Reals: Real {
    type Scalar: Scalar;
    /// As many words.
    type Words: Words;
    const LANES: usize;
    unsafe fn splat(x: Self::Scalar) -> Self;
    unsafe fn load(p: *const Self::Scalar) -> Self;
    unsafe fn store(self, p: *mut Self::Scalar);
    /// Signed words as numbers.
    unsafe fn of_signed(words: Self::Words) -> Self;
    /// Words below 2²⁹ as numbers that no arithmetic is done with.
    unsafe fn encode(words: Self::Words) -> Self;
    /// `self · a + b`.
    unsafe fn mul_add(self, a: Self, b: Self) -> Self;
    /// `1/√self`, to the precision of the type, for positive numbers.
    unsafe fn inverse_root(self) -> Self;
    /// The smaller of two.
    unsafe fn smaller(self, other: Self) -> Self;
    /// Writes whole numbers, rounded towards zero; of numbers that an `i32` has room for.
    unsafe fn store_whole(self, p: *mut i32);
    /// The nearest whole number, as long as it is small.
    unsafe fn round(self) -> Self;
    /// `self` where `a < b`, zero elsewhere.
    unsafe fn where_below(self, a: Self, b: Self) -> Self;
    /// Bit `k` is set where lane `k` is below that of `other`.
    unsafe fn mask_below(self, other: Self) -> u32;
    /// The lanes of `mask` one after the other, in the first lanes; anything in the others.
    unsafe fn compress(self, mask: u32) -> Self;
    /// `table[which[k]]` in lane `k`, of a table of as many numbers as there are lanes. Higher bits of `which` than
    /// count lanes are left out.
    unsafe fn pick(table: *const Self::Scalar, which: Self::Words) -> Self;
    /// `table[index[k]]` in lane `k`.
    unsafe fn lookup(table: *const Self::Scalar, index: Self::Words) -> Self;
    /// Writes four columns as rows of four.
    unsafe fn store_transposed(columns: [Self; 4], p: *mut Self::Scalar);
    /// Writes the rows whose bits are set in `mask`, one after the other; may write anything up to where all would end.
    #[inline(always)]
    unsafe fn store_rows(columns: [Self; 4], mask: u32, p: *mut Self::Scalar) {
        // One by one: a closure over the columns would not be inlined, and so not be compiled for their instruction set.
        let [a, b, c, d] = columns;
        unsafe {
            let columns = [a.compress(mask), b.compress(mask), c.compress(mask), d.compress(mask)];
            Self::store_transposed(columns, p);
        }
    }
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
    unsafe fn shift_right<const BY: u32>(self) -> Self;
    /// Bit `k` is set where lane `k` is that of `other`.
    unsafe fn mask_equal(self, other: Self) -> u32;
    /// Bit `k` is set where lane `k` has a bit in common with that of `other`.
    unsafe fn mask_common(self, other: Self) -> u32;
    /// `table[index[k]]` in lane `k`.
    unsafe fn lookup(table: *const u32, index: Self) -> Self;
    /// Bytes, widened.
    unsafe fn load_bytes(p: *const u8) -> Self;
    /// `table[which[k]]` in lane `k`, of a table of as many words as there are lanes.
    unsafe fn pick(table: *const u32, which: Self) -> Self;
}

/// Two points, in units that [`Isa::distance_masks`] compares: each coordinate sixteen times that of the first, then as often
/// that of the second.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct BroadcastPair(pub [[u16; 32]; 3]);

/// Row `k` of those at `offsets`.
///
/// Read as volatile: the compiler else reads offsets as vectors, and takes their lanes out one by one.
#[inline(always)]
unsafe fn record_at(base: *const u8, offsets: *const u32, k: usize) -> *const u8 {
    unsafe { base.add(offsets.add(k).read_volatile() as usize) }
}

/// The same of rows twice as long.
#[inline(always)]
unsafe fn wide_record_at(base: *const u8, offsets: *const u32, k: usize) -> *const u8 {
    unsafe { base.add(2 * offsets.add(k).read_volatile() as usize) }
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
    /// The first three of four readable numbers, and 0.
    unsafe fn load_three_f32(p: *const f32) -> Self;
    /// The first three of four readable numbers, and 0.
    unsafe fn load_three(p: *const f64) -> Self;
    /// `(x₀ + x₂) + (x₁ + x₃)`, four times.
    unsafe fn total(self) -> Self;
}

/// An instruction set.
#[allow(clippy::missing_safety_doc)]
pub trait Isa: Copy + Send + Sync + 'static {
    type F32: Reals<Scalar = f32>;
    type F64: Reals<Scalar = f64>;
    type Quad: Quad;
    /// Which of the sixteen particles from `x[0]`, `x[1]`, `x[2]` on, all moved by `shift`, have a distance to four
    /// points whose square, in units of 2¹⁶, is below `limit`: sixteen bits for each point. Coordinates wrap; a shift is
    /// there twice, in both halves of a word.
    unsafe fn distance_masks<const SHIFTS: bool>(
        x: [*const u16; 3],
        shift: [u32; 3],
        four: &[BroadcastPair; 2],
        limit: i16,
    ) -> u64;
    /// Sixteen times the same word.
    unsafe fn broadcast16(x: u16, p: *mut u16);
    /// Eight masks, in each of which four particles have sixteen bits each, turned: first the bits of the first particle
    /// in the first four masks, then those of the second …, then the same of the other four masks.
    unsafe fn transpose_masks(masks: *mut u64);
    /// Writes `j_bases[k / 16] + 32 (k % 16)` for each bit `k`, one after the other, and how many; may write sixteen
    /// more.
    unsafe fn expand_mask(j_bases: *const u32, mask: u64, p: *mut u32) -> usize;
    /// √x or up to one part in 1000 more, zero for numbers below.
    unsafe fn root_or_more(x: Self::F32) -> Self::F32;
    /// The first, the least, and the greatest of each `CLUSTER` lanes, four or eight, in all of them.
    unsafe fn cluster_first<const CLUSTER: usize>(x: Self::F32) -> Self::F32;
    unsafe fn cluster_least<const CLUSTER: usize>(x: Self::F32) -> Self::F32;
    unsafe fn cluster_greatest<const CLUSTER: usize>(x: Self::F32) -> Self::F32;
    /// The columns of rows of eight words, `offsets` bytes behind `base`; with `ALL`, else only the first four.
    unsafe fn load_transposed<const ALL: bool>(
        base: *const u8,
        offsets: *const u32,
    ) -> [<Self::F32 as Reals>::Words; 8];
    /// The columns of rows of eight numbers, twice `offsets` bytes behind `base`; with `ALL`, else only the first four.
    unsafe fn load_transposed_wide<const ALL: bool>(base: *const u8, offsets: *const u32) -> [Self::F64; 8];
    /// The numbers of bits.
    unsafe fn of_bits(words: <Self::F32 as Reals>::Words) -> Self::F32;
    /// The low and the high words of the bits of numbers.
    unsafe fn halves(x: Self::F64) -> [<Self::F64 as Reals>::Words; 2];
}
