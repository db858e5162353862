//! What a kernel shape is computed with.

use std::ops::{Add, Mul, Sub};

/// A real number, or a vector of them: shapes are written once for single numbers, for both precisions
/// and for every instruction set.
pub trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// A constant of the formula.
    fn constant(x: f64) -> Self;
    /// The larger of two.
    fn larger(self, other: Self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn constant(x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn larger(self, other: f64) -> f64 {
        self.max(other)
    }
}
