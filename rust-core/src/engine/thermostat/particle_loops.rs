//! The loops of conjugate gradients over the particles of a plane.

use super::pass::Wide;
use crate::engine::vectors::Loop;

/// Computes `image ← m p + K p`, where `K p` is the sum of `own` and `below`; returns `p · image` of
/// the particles that are not frozen.
pub struct Multiply<'a> {
    pub p: &'a [Wide],
    /// Mass of each particle; infinite if it is frozen.
    pub mass: &'a [f64],
    pub own: &'a [Wide],
    /// Contributions of the plane below; empty if it has no pairs with these particles.
    pub below: &'a [Wide],
    pub image: &'a mut Vec<Wide>,
}

impl Loop for Multiply<'_> {
    type Out = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Multiply { p, mass, own, below, image } = self;
        image.clear();
        image.extend_from_slice(&own[..p.len()]);
        for (image, below) in image.iter_mut().zip(below) {
            *image = plus(*image, 1.0, *below);
        }
        let mut sum = [0.0; 4];
        for ((image, p), m) in image.iter_mut().zip(p).zip(mass) {
            let (inertia, counts) = if m.is_finite() { (*m, 1.0) } else { (0.0, 0.0) };
            *image = plus(*image, inertia, *p);
            sum = plus(sum, counts, times(*p, *image));
        }
        total(sum)
    }
}

/// Computes `solution ← solution + alpha p` and `residual ← residual − alpha image`;
/// returns `r · M⁻¹ r` of the new residual.
pub struct Descend<'a> {
    pub alpha: f64,
    pub p: &'a [Wide],
    pub inverse_mass: &'a [f64],
    pub image: &'a [Wide],
    pub solution: &'a mut [Wide],
    pub residual: &'a mut [Wide],
}

impl Loop for Descend<'_> {
    type Out = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Descend { alpha, p, inverse_mass, image, solution, residual } = self;
        let mut sum = [0.0; 4];
        for ((((s, r), p), image), inverse) in
            solution.iter_mut().zip(residual).zip(p).zip(image).zip(inverse_mass)
        {
            *s = plus(*s, alpha, *p);
            let now = plus(*r, -alpha, *image);
            *r = now;
            sum = plus(sum, *inverse, times(now, now));
        }
        total(sum)
    }
}

/// Computes `p ← M⁻¹ r + beta p`.
pub struct Direct<'a> {
    pub beta: f64,
    pub inverse_mass: &'a [f64],
    pub residual: &'a [Wide],
    pub p: &'a mut [Wide],
}

impl Loop for Direct<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Direct { beta, inverse_mass, residual, p } = self;
        for ((p, r), inverse) in p.iter_mut().zip(residual).zip(inverse_mass) {
            *p = plus(times([beta; 4], *p), *inverse, *r);
        }
    }
}

/// The vector `a + factor b`.
#[inline(always)]
fn plus(a: Wide, factor: f64, b: Wide) -> Wide {
    std::array::from_fn(|c| a[c] + factor * b[c])
}

#[inline(always)]
fn times(a: Wide, b: Wide) -> Wide {
    std::array::from_fn(|c| a[c] * b[c])
}

/// The sum of all four components, the last of which is 0.
#[inline(always)]
fn total(sum: Wide) -> f64 {
    (sum[0] + sum[2]) + (sum[1] + sum[3])
}
