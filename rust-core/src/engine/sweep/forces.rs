//! What each term adds to a vector of pairs, along `ê`.

use super::arithmetic::Apart;
use super::simd::{Reals, Words};
use super::terms::{Linear, Soft, Spline, Table};
use crate::model::kernel::{CubicSpline, KernelKind, Shape, ShapeVisitor};

/// Which pair of species each pair of a vector is: the entry of tables.
#[derive(Clone, Copy)]
pub struct Kind<R: Reals>(pub R::Words);

impl<R: Reals> Kind<R> {
    /// Entries of a table; with one species there is but one.
    #[inline(always)]
    pub unsafe fn of<const SEVERAL: bool>(self, table: &Table<R::Scalar>) -> R {
        // SAFETY: the contract of `simd`; kinds are below the number of entries, and tables have room for a vector.
        unsafe {
            let entries = table.as_ptr();
            if !SEVERAL {
                R::splat(*entries)
            } else if table.count() <= R::LANES {
                R::pick(entries, self.0)
            } else {
                R::lookup(entries, self.0)
            }
        }
    }

    /// Of the species of both particles.
    #[inline(always)]
    pub unsafe fn new(species_i: R::Words, species_j: R::Words, species: usize) -> Kind<R> {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut row = R::Words::splat(0);
            let mut k = 0;
            while k < species {
                row = row.add(species_i);
                k += 1;
            }
            Kind(row.add(species_j))
        }
    }
}

/// What is summed over pairs, where it is asked for.
#[derive(Clone, Copy)]
pub struct Sums<R> {
    pub pair: R,
    pub excess: R,
    pub virial: [R; 6],
    pub thermostat: [R; 6],
}

impl<R: Reals> Sums<R> {
    #[inline(always)]
    pub fn zero() -> Sums<R> {
        let zero = R::constant(0.0);
        Sums { pair: zero, excess: zero, virial: [zero; 6], thermostat: [zero; 6] }
    }
}

/// Adds a force along `ê` to a virial.
#[inline(always)]
pub unsafe fn add_virial<R: Reals>(force: R, pairs: &Apart<R>, share: R, sum: &mut [R; 6]) {
    // SAFETY: the contract of `simd`.
    unsafe {
        let f = force * (share * pairs.inverse);
        let d = pairs.d;
        let fd = [f * d[0], f * d[1], f * d[2]];
        sum[0] = fd[0].mul_add(d[0], sum[0]);
        sum[1] = fd[1].mul_add(d[1], sum[1]);
        sum[2] = fd[2].mul_add(d[2], sum[2]);
        sum[3] = fd[0].mul_add(d[1], sum[3]);
        sum[4] = fd[0].mul_add(d[2], sum[4]);
        sum[5] = fd[1].mul_add(d[2], sum[5]);
    }
}

/// The sum of the lanes.
#[inline(always)]
pub unsafe fn sum<R: Reals>(x: R) -> f64 {
    use super::simd::Scalar;
    let mut lanes = [R::Scalar::default(); 16];
    // SAFETY: no vector has more lanes.
    unsafe { x.store(lanes.as_mut_ptr()) };
    let mut sum = 0.0;
    for lane in &lanes[..R::LANES] {
        sum += lane.wide();
    }
    sum
}

impl<T: super::simd::Scalar> Soft<T> {
    /// `before + a (1 − r/R)`, and the energy.
    #[inline(always)]
    pub unsafe fn add<R: Reals<Scalar = T>, const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let t = (one - r * kind.of::<SEVERAL>(&self.inverse_range)).larger(zero);
            if TALLY {
                *energy = (t * t).mul_add(share * kind.of::<SEVERAL>(&self.energy), *energy);
            }
            t.mul_add(kind.of::<SEVERAL>(&self.strength), before)
        }
    }
}

impl<T: super::simd::Scalar> Linear<T> {
    /// `before − (c_αβ + c_βα) w′(r)`, and the energy.
    #[inline(always)]
    pub unsafe fn add<R: Reals<Scalar = T>, const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let one = R::constant(1.0);
            if TALLY {
                let s = r * R::splat(self.inverse_range);
                let w = kind.of::<SEVERAL>(&self.energy) * value(self.kind, s);
                *energy = w.where_below(s, one).mul_add(share, *energy);
            }
            let s = r * R::splat(self.force_inverse_range);
            let force = kind.of::<SEVERAL>(&self.force) * slope(self.force_kind, s);
            before + force.where_below(s, one)
        }
    }
}

impl<T: super::simd::Scalar> Spline<T> {
    /// `before − φ′(r)`, and the energy.
    #[inline(always)]
    pub unsafe fn add<R: Reals<Scalar = T>, const SEVERAL: bool, const TALLY: bool>(
        &self,
        r: R,
        kind: Kind<R>,
        before: R,
        share: R,
        energy: &mut R,
    ) -> R {
        // SAFETY: the contract of `simd`.
        unsafe {
            let (one, zero) = (R::constant(1.0), R::constant(0.0));
            let inverse_a = kind.of::<SEVERAL>(&self.repulsion_inverse_range);
            let inverse_b = kind.of::<SEVERAL>(&self.attraction_inverse_range);
            // At s = 1 the shape and its slope vanish; beyond, it stays there.
            let a = one - (one - r * inverse_a).larger(zero);
            let b = one - (one - r * inverse_b).larger(zero);
            let repulsion = kind.of::<SEVERAL>(&self.repulsion);
            let attraction = kind.of::<SEVERAL>(&self.attraction);
            if TALLY {
                let phi = repulsion * CubicSpline::value(a) - attraction * CubicSpline::value(b);
                *energy = phi.mul_add(share, *energy);
            }
            let slope = repulsion * inverse_a * CubicSpline::slope(a)
                - attraction * inverse_b * CubicSpline::slope(b);
            before - slope
        }
    }
}

/// `W(s)`.
#[inline(always)]
pub fn value<R: Reals>(kind: KernelKind, s: R) -> R {
    struct Value<R>(R);
    impl<R: Reals> ShapeVisitor for Value<R> {
        type Output = R;
        #[inline(always)]
        fn visit<S: Shape>(self) -> R {
            S::value(self.0)
        }
    }
    kind.visit(Value(s))
}

/// `W′(s)`.
#[inline(always)]
pub fn slope<R: Reals>(kind: KernelKind, s: R) -> R {
    struct Slope<R>(R);
    impl<R: Reals> ShapeVisitor for Slope<R> {
        type Output = R;
        #[inline(always)]
        fn visit<S: Shape>(self) -> R {
            S::slope(self.0)
        }
    }
    kind.visit(Slope(s))
}
