//! Vectors of numbers for each instruction set, with common traits.
//!
//! Kernels are written once, generic in [`Isa`], and compiled for an instruction set by [`run`], into
//! which all functions of this module are inlined.
//!
//! Soundness: vectors of an instruction set may be used only where the processor has it. Their types
//! are private to this module. Only [`run`] names them; it takes an [`InstructionSet`], which exists
//! only for instructions of this processor. All other code is generic, and is compiled for these types
//! only below [`run`]. So operators and other safe functions of the traits need no further condition,
//! and `unsafe` functions require valid arguments: pointers are valid for as many elements as a vector
//! has lanes, unless another number is stated.
//!
//! [`InstructionSet`]: crate::instruction_set::InstructionSet

// These two conditions, on types and pointers, are the safety comments of some hundred blocks.
#![allow(clippy::undocumented_unsafe_blocks)]

/// Defines methods of traits that are one expression each: `name(arguments) -> type = expression;`.
macro_rules! methods {
    ($($name:ident($($arguments:tt)*) $(-> $out:ty)? = $value:expr;)*) => {
        $(
            #[inline(always)]
            #[allow(unused_unsafe)] // Some expressions are safe.
            unsafe fn $name($($arguments)*) $(-> $out)? {
                unsafe { $value }
            }
        )*
    };
}

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

/// Indices of particles are shifted by this number of bits: they are byte offsets into accumulators and
/// into packed particles of mixed precision, of 32 bytes each.
pub const OFFSET_BITS: u32 = 5;

/// A number, `f32` or `f64`.
pub trait Scalar: Copy + Default + Send + Sync + PartialOrd + 'static {
    /// Rounds to the nearest number of this type.
    fn of(x: f64) -> Self;
    /// Converts the number to double precision.
    fn wide(self) -> f64;
    /// The word that [`Reals::encode`] stored in this number.
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

/// Bits of a number of ordinary size: words below 2²⁹ are added to them to be stored as numbers.
const ORDINARY_F32: u32 = 0x4000_0000;
/// Bits of an ordinary number in double precision, to which any word is added.
const ORDINARY_F64: u64 = 0x3ff0_0000_0000_0000;

/// A vector of real numbers.
#[allow(clippy::missing_safety_doc)] // One contract, at the head of the module.
pub trait Reals: Real {
    type Scalar: Scalar;
    /// A vector of as many words.
    type Words: Words;
    const LANES: usize;
    unsafe fn splat(x: Self::Scalar) -> Self;
    unsafe fn load(p: *const Self::Scalar) -> Self;
    unsafe fn store(self, p: *mut Self::Scalar);
    /// Converts signed words to numbers.
    unsafe fn of_signed(words: Self::Words) -> Self;
    /// Stores words below 2²⁹ as numbers, which no arithmetic uses.
    unsafe fn encode(words: Self::Words) -> Self;
    /// Computes `self · a + b`.
    unsafe fn mul_add(self, a: Self, b: Self) -> Self;
    /// Computes `1/√self`, to the precision of the type, for positive numbers.
    unsafe fn inverse_root(self) -> Self;
    /// The smaller of two numbers, lane by lane.
    unsafe fn smaller(self, other: Self) -> Self;
    /// Writes whole numbers, rounded towards zero; the numbers must fit into an `i32`.
    unsafe fn store_whole(self, p: *mut i32);
    /// Rounds to the nearest whole number; for small numbers.
    unsafe fn round(self) -> Self;
    /// Equals `self` where `a < b`, and zero elsewhere.
    unsafe fn where_below(self, a: Self, b: Self) -> Self;
    /// Bit `k` is set where lane `k` is below that of `other`.
    unsafe fn mask_below(self, other: Self) -> u32;
    /// Moves the lanes of `mask` to the first lanes; the others are unspecified.
    unsafe fn compress(self, mask: u32) -> Self;
    /// `table[which[k]]` in lane `k`, for a table with as many numbers as there are lanes.
    /// Higher bits of `which` are ignored.
    unsafe fn pick(table: *const Self::Scalar, which: Self::Words) -> Self;
    /// Loads `table[index[k]]` into lane `k`.
    unsafe fn lookup(table: *const Self::Scalar, index: Self::Words) -> Self;
    /// Writes four columns as rows of four.
    unsafe fn store_transposed(columns: [Self; 4], p: *mut Self::Scalar);
    /// Writes the rows whose bits are set in `mask` one after the other; may overwrite the room of all four rows.
    #[inline(always)]
    unsafe fn store_rows(columns: [Self; 4], mask: u32, p: *mut Self::Scalar) {
        // Each row is written by itself: a closure over the columns would not be inlined and
        // compiled for the instruction set.
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
    /// Bit `k` is set where lane `k` equals that of `other`.
    unsafe fn mask_equal(self, other: Self) -> u32;
    /// Bit `k` is set where lane `k` has a bit in common with that of `other`.
    unsafe fn mask_common(self, other: Self) -> u32;
    /// Loads `table[index[k]]` into lane `k`.
    unsafe fn lookup(table: *const u32, index: Self) -> Self;
    /// Loads bytes and widens them to words.
    unsafe fn load_bytes(p: *const u8) -> Self;
    /// Loads `table[which[k]]` into lane `k`, from a table with as many words as there are lanes.
    unsafe fn pick(table: *const u32, which: Self) -> Self;
}

/// Two points, in the unit of [`Isa::distance_masks`]: each coordinate is stored sixteen times for the
/// first, then sixteen times for the second.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct BroadcastPair(pub [[u16; 32]; 3]);

/// The address of row `k` of those at `offsets`.
///
/// The read is volatile: otherwise the compiler loads offsets as vectors, and extracts their lanes one by one.
#[inline(always)]
unsafe fn record_at(base: *const u8, offsets: *const u32, k: usize) -> *const u8 {
    unsafe { base.add(offsets.add(k).read_volatile() as usize) }
}

/// The address of row `k` of rows that are twice as long.
#[inline(always)]
unsafe fn wide_record_at(base: *const u8, offsets: *const u32, k: usize) -> *const u8 {
    unsafe { base.add(2 * offsets.add(k).read_volatile() as usize) }
}

/// Four double-precision numbers: the sums of a particle.
#[allow(clippy::missing_safety_doc)]
pub trait Quad: Copy {
    unsafe fn zero() -> Self;
    unsafe fn splat(x: f64) -> Self;
    unsafe fn load(p: *const f64) -> Self;
    unsafe fn store(self, p: *mut f64);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    /// Computes `self · a + b`, perhaps rounded once only.
    unsafe fn mul_add(self, a: Self, b: Self) -> Self;
    /// Computes `b − self · a`, perhaps rounded once only.
    unsafe fn neg_mul_add(self, a: Self, b: Self) -> Self;
    unsafe fn splat_f32(x: f32) -> Self;
    unsafe fn load_f32(p: *const f32) -> Self;
    /// Loads the first three of four readable numbers, and sets the fourth to 0.
    unsafe fn load_three_f32(p: *const f32) -> Self;
    /// Loads the first three of four readable numbers, and sets the fourth to 0.
    unsafe fn load_three(p: *const f64) -> Self;
    /// The sum `(x₀ + x₁) + (x₂ + x₃)` of either, in all four elements.
    unsafe fn totals(self, other: Self) -> [Self; 2];
}

/// Asks for the memory at `p`, which need not exist, to be in the cache soon.
#[inline(always)]
pub fn prefetch<T>(p: *const T) {
    // SAFETY: all processors of x86-64 have the instruction, and it faults at no address.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(p.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = p;
}

/// An instruction set.
#[allow(clippy::missing_safety_doc)]
pub trait Isa: Copy + Send + Sync + 'static {
    type F32: Reals<Scalar = f32>;
    type F64: Reals<Scalar = f64>;
    type Quad: Quad;
    /// Bits of the sixteen particles from `x[0]`, `x[1]`, `x[2]` on, moved by `shift`, whose squared
    /// distance to each of four points, in units of 2¹⁶, is below `limit`: sixteen bits for each point.
    /// Coordinates wrap; each half of a word of `shift` contains the shift.
    unsafe fn distance_masks<const SHIFTS: bool>(
        x: [*const u16; 3],
        shift: [u32; 3],
        four: &[BroadcastPair; 2],
        limit: i16,
    ) -> u64;
    /// Writes one word sixteen times.
    unsafe fn broadcast16(x: u16, p: *mut u16);
    /// Transposes eight masks, in each of which four particles have sixteen bits: first the bits of the first
    /// particle in the first four masks, then those of the second …, then the same of the other four masks.
    unsafe fn transpose_masks(masks: *mut u64);
    /// Writes `j_bases[k / 16] + 32 (k % 16)` for each set bit `k`, and returns their number;
    /// may write sixteen elements more.
    unsafe fn expand_mask(j_bases: *const u32, mask: u64, p: *mut u32) -> usize;
    /// An upper bound of √x, at most 1/1000 too large; zero for negative numbers.
    unsafe fn root_or_more(x: Self::F32) -> Self::F32;
    /// The first, the least, and the greatest of each `CLUSTER` lanes, four or eight, copied to all of them.
    unsafe fn cluster_first<const CLUSTER: usize>(x: Self::F32) -> Self::F32;
    unsafe fn cluster_least<const CLUSTER: usize>(x: Self::F32) -> Self::F32;
    unsafe fn cluster_greatest<const CLUSTER: usize>(x: Self::F32) -> Self::F32;
    /// The columns of rows of eight words, `offsets` bytes after `base`; without `ALL` only the first four.
    unsafe fn load_transposed<const ALL: bool>(
        base: *const u8,
        offsets: *const u32,
    ) -> [<Self::F32 as Reals>::Words; 8];
    /// The columns of rows of eight numbers, twice `offsets` bytes after `base`; without `ALL` only the first four.
    unsafe fn load_transposed_wide<const ALL: bool>(base: *const u8, offsets: *const u32) -> [Self::F64; 8];
    /// Reinterprets bits as numbers.
    unsafe fn of_bits(words: <Self::F32 as Reals>::Words) -> Self::F32;
    /// The low and the high words of the bits of the numbers.
    unsafe fn halves(x: Self::F64) -> [<Self::F64 as Reals>::Words; 2];
}
