//! The arithmetic that kernel shapes use.

use std::ops::{Add, Mul, Sub};

/// A real number, or a vector of them: a shape is written once for single numbers, for both precisions
/// and for every instruction set.
pub trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Converts a constant of the formula.
    fn constant(x: f64) -> Self;
    /// The larger of two numbers.
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
