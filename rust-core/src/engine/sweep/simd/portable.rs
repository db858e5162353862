//! Plain arrays, which the compiler vectorises for whatever the target has.

use super::{Isa, Quad, Reals, Words};
use crate::model::kernel::Real;
use std::ops::{Add, Mul, Sub};

/// No instruction set in particular.
#[derive(Clone, Copy)]
pub struct Portable;

const LANES: usize = 8;

/// Eight numbers.
#[derive(Clone, Copy)]
pub struct Lanes<T>([T; LANES]);

macro_rules! lanes {
    ($scalar:ty) => {
        impl Add for Lanes<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn add(mut self, other: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] += other.0[k];
                }
                self
            }
        }
        impl Sub for Lanes<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn sub(mut self, other: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] -= other.0[k];
                }
                self
            }
        }
        impl Mul for Lanes<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn mul(mut self, other: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] *= other.0[k];
                }
                self
            }
        }
        impl Real for Lanes<$scalar> {
            #[inline(always)]
            fn constant(x: f64) -> Self {
                Lanes([x as $scalar; LANES])
            }
            #[inline(always)]
            fn larger(mut self, other: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] = if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] };
                }
                self
            }
        }

        impl Reals for Lanes<$scalar> {
            type Scalar = $scalar;
            const LANES: usize = LANES;

            #[inline(always)]
            unsafe fn splat(x: $scalar) -> Self {
                Lanes([x; LANES])
            }
            #[inline(always)]
            unsafe fn load(p: *const $scalar) -> Self {
                Lanes(unsafe { p.cast::<[$scalar; LANES]>().read_unaligned() })
            }
            #[inline(always)]
            unsafe fn store(self, p: *mut $scalar) {
                unsafe { p.cast::<[$scalar; LANES]>().write_unaligned(self.0) }
            }
            #[inline(always)]
            unsafe fn load_signed(p: *const i32) -> Self {
                let words = unsafe { p.cast::<[i32; LANES]>().read_unaligned() };
                let mut out = [0.0; LANES];
                for k in 0..LANES {
                    out[k] = words[k] as $scalar;
                }
                Lanes(out)
            }
            #[inline(always)]
            unsafe fn mul_add(self, a: Self, b: Self) -> Self {
                self * a + b
            }
            #[inline(always)]
            unsafe fn inverse_root(mut self) -> Self {
                for k in 0..LANES {
                    self.0[k] = 1.0 / self.0[k].sqrt();
                }
                self
            }
            #[inline(always)]
            unsafe fn root(mut self) -> Self {
                for k in 0..LANES {
                    self.0[k] = self.0[k].sqrt();
                }
                self
            }
            #[inline(always)]
            unsafe fn smaller(mut self, other: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] = if self.0[k] < other.0[k] { self.0[k] } else { other.0[k] };
                }
                self
            }
            #[inline(always)]
            unsafe fn store_whole(self, p: *mut i32) {
                for k in 0..LANES {
                    // SAFETY: the caller's numbers are in range.
                    unsafe { *p.add(k) = self.0[k].to_int_unchecked() };
                }
            }
            #[inline(always)]
            unsafe fn round(mut self) -> Self {
                for k in 0..LANES {
                    // Adding what has no room for a fraction rounds, without a call.
                    const ROOM: $scalar = 1.5 / <$scalar>::EPSILON;
                    self.0[k] = (self.0[k] + ROOM) - ROOM;
                }
                self
            }
            #[inline(always)]
            unsafe fn where_below(mut self, a: Self, b: Self) -> Self {
                for k in 0..LANES {
                    self.0[k] = if a.0[k] < b.0[k] { self.0[k] } else { 0.0 };
                }
                self
            }
            #[inline(always)]
            unsafe fn mask_below(self, other: Self) -> u32 {
                let mut mask = 0;
                for k in 0..LANES {
                    mask |= ((self.0[k] < other.0[k]) as u32) << k;
                }
                mask
            }
            #[inline(always)]
            unsafe fn compress(self, mask: u32, p: *mut $scalar) {
                let mut place = 0;
                for k in 0..LANES {
                    unsafe { *p.add(place) = self.0[k] };
                    place += (mask >> k & 1) as usize;
                }
            }
            #[inline(always)]
            unsafe fn lookup(table: *const $scalar, index: *const u32) -> Self {
                let mut out = [0.0; LANES];
                for k in 0..LANES {
                    out[k] = unsafe { *table.add(*index.add(k) as usize) };
                }
                Lanes(out)
            }
            #[inline(always)]
            unsafe fn columns(base: *const u8, stride: usize, index: *const u32) -> [Self; 4] {
                let mut out = [[0.0; LANES]; 4];
                for k in 0..LANES {
                    let row = unsafe {
                        base.add(*index.add(k) as usize * stride).cast::<[$scalar; 4]>().read_unaligned()
                    };
                    for c in 0..4 {
                        out[c][k] = row[c];
                    }
                }
                let [a, b, c, d] = out;
                [Lanes(a), Lanes(b), Lanes(c), Lanes(d)]
            }
            #[inline(always)]
            unsafe fn rows(columns: [Self; 4], p: *mut $scalar) {
                for k in 0..LANES {
                    for c in 0..4 {
                        unsafe { *p.add(4 * k + c) = columns[c].0[k] };
                    }
                }
            }
        }
    };
}

lanes!(f32);
lanes!(f64);

impl Words for Lanes<u32> {
    const LANES: usize = LANES;

    #[inline(always)]
    unsafe fn splat(x: u32) -> Self {
        Lanes([x; LANES])
    }
    #[inline(always)]
    unsafe fn load(p: *const u32) -> Self {
        Lanes(unsafe { p.cast::<[u32; LANES]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut u32) {
        unsafe { p.cast::<[u32; LANES]>().write_unaligned(self.0) }
    }
    #[inline(always)]
    unsafe fn add(mut self, other: Self) -> Self {
        for k in 0..LANES {
            self.0[k] = self.0[k].wrapping_add(other.0[k]);
        }
        self
    }
    #[inline(always)]
    unsafe fn sub(mut self, other: Self) -> Self {
        for k in 0..LANES {
            self.0[k] = self.0[k].wrapping_sub(other.0[k]);
        }
        self
    }
    #[inline(always)]
    unsafe fn xor(mut self, other: Self) -> Self {
        for k in 0..LANES {
            self.0[k] ^= other.0[k];
        }
        self
    }
    #[inline(always)]
    unsafe fn min(mut self, other: Self) -> Self {
        for k in 0..LANES {
            self.0[k] = if self.0[k] < other.0[k] { self.0[k] } else { other.0[k] };
        }
        self
    }
    #[inline(always)]
    unsafe fn max(mut self, other: Self) -> Self {
        for k in 0..LANES {
            self.0[k] = if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] };
        }
        self
    }
    #[inline(always)]
    unsafe fn rotate(mut self, by: u32) -> Self {
        for k in 0..LANES {
            self.0[k] = self.0[k].rotate_left(by);
        }
        self
    }
    #[inline(always)]
    unsafe fn compress(self, mask: u32, p: *mut u32) {
        let mut place = 0;
        for k in 0..LANES {
            unsafe { *p.add(place) = self.0[k] };
            place += (mask >> k & 1) as usize;
        }
    }
}

/// Four numbers.
#[derive(Clone, Copy)]
pub struct Four([f64; 4]);

impl Quad for Four {
    #[inline(always)]
    unsafe fn zero() -> Self {
        Four([0.0; 4])
    }
    #[inline(always)]
    unsafe fn splat(x: f64) -> Self {
        Four([x; 4])
    }
    #[inline(always)]
    unsafe fn load(p: *const f64) -> Self {
        Four(unsafe { p.cast::<[f64; 4]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut f64) {
        unsafe { p.cast::<[f64; 4]>().write_unaligned(self.0) }
    }
    #[inline(always)]
    unsafe fn add(mut self, other: Self) -> Self {
        for k in 0..4 {
            self.0[k] += other.0[k];
        }
        self
    }
    #[inline(always)]
    unsafe fn sub(mut self, other: Self) -> Self {
        for k in 0..4 {
            self.0[k] -= other.0[k];
        }
        self
    }
    #[inline(always)]
    unsafe fn mul(mut self, other: Self) -> Self {
        for k in 0..4 {
            self.0[k] *= other.0[k];
        }
        self
    }
    #[inline(always)]
    unsafe fn load_f32(p: *const f32) -> Self {
        let row = unsafe { p.cast::<[f32; 4]>().read_unaligned() };
        Four([row[0] as f64, row[1] as f64, row[2] as f64, row[3] as f64])
    }
}

impl Isa for Portable {
    type F32 = Lanes<f32>;
    type F64 = Lanes<f64>;
    type U32 = Lanes<u32>;
    type Quad = Four;

    #[inline(always)]
    unsafe fn signed(words: Lanes<u32>) -> Lanes<f32> {
        let mut out = [0.0; LANES];
        for k in 0..LANES {
            out[k] = words.0[k] as i32 as f32;
        }
        Lanes(out)
    }
    #[inline(always)]
    unsafe fn word_columns(base: *const u8, stride: usize, index: *const u32) -> [Lanes<u32>; 4] {
        let mut out = [[0; LANES]; 4];
        for k in 0..LANES {
            let row =
                unsafe { base.add(*index.add(k) as usize * stride).cast::<[u32; 4]>().read_unaligned() };
            for c in 0..4 {
                out[c][k] = row[c];
            }
        }
        let [a, b, c, d] = out;
        [Lanes(a), Lanes(b), Lanes(c), Lanes(d)]
    }
    #[inline(always)]
    unsafe fn collect(first: u32, mask: u32, p: *mut u32) {
        let mut count = 0;
        for k in 0..LANES {
            unsafe { *p.add(count) = first + k as u32 };
            count += (mask >> k & 1) as usize;
        }
    }
}
