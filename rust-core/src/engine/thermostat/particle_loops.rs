//! The loops of conjugate gradients over the particles of a plane.

use super::pass::Wide;
use crate::engine::vectors::Loop;

/// Sets the residual to the negative sum of `own` and `below`, and `p` to `M⁻¹ r`; returns `r · M⁻¹ r`.
pub struct Start<'a> {
    pub inverse_mass: &'a [f64],
    pub own: &'a [Wide],
    /// Contributions of the plane below; empty if it has no pairs with these particles.
    pub below: &'a [Wide],
    pub residual: &'a mut [Wide],
    pub p: &'a mut [Wide],
}

impl Loop for Start<'_> {
    type Out = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Start { inverse_mass, own, below, residual, p } = self;
        let mut sum = Wide::ZERO;
        let particles = residual.iter_mut().zip(p).zip(own).zip(inverse_mass);
        let each = |(((r, p), own), inverse): (((&mut Wide, &mut Wide), &Wide), &f64), below: Wide| {
            *r = times(Wide([-1.0; 4]), plus(*own, 1.0, below));
            *p = times(Wide([*inverse; 4]), *r);
            sum = plus(sum, 1.0, times(*p, *r));
        };
        with_below(particles, below, each);
        total(sum)
    }
}

/// Adds `m p` and the contributions of the plane below to the sums of the particles of a plane, which become the
/// image `(M + K) p`; returns `p · image` and `image · M⁻¹ image` of the particles that are not frozen.
pub struct Multiply<'a> {
    pub p: &'a [Wide],
    /// Mass of each particle; 0 if it is frozen.
    pub inertia: &'a [f64],
    pub inverse_mass: &'a [f64],
    pub image: &'a mut [Wide],
    /// Contributions of the plane below; empty if it has no pairs with these particles.
    pub below: &'a [Wide],
}

impl Loop for Multiply<'_> {
    type Out = [f64; 2];

    #[inline(always)]
    fn run(self) -> [f64; 2] {
        let Multiply { p, inertia, inverse_mass, image, below } = self;
        let (mut curvature, mut square) = (Wide::ZERO, Wide::ZERO);
        let particles = image.iter_mut().zip(p).zip(inertia).zip(inverse_mass);
        let each = |(((image, p), inertia), inverse): (((&mut Wide, &Wide), &f64), &f64), below: Wide| {
            let momentum = times(Wide([*inertia; 4]), *p);
            *image = plus(plus(*image, 1.0, below), 1.0, momentum);
            let change = times(Wide([*inverse; 4]), *image);
            curvature = plus(curvature, 1.0, times(momentum, change));
            square = plus(square, 1.0, times(*image, change));
        };
        with_below(particles, below, each);
        [total(curvature), total(square)]
    }
}

/// Calls `each` for all particles, with the contribution of the plane below or zero.
#[inline(always)]
fn with_below<P>(particles: impl Iterator<Item = P>, below: &[Wide], mut each: impl FnMut(P, Wide)) {
    match below.is_empty() {
        true => particles.for_each(|particle| each(particle, Wide::ZERO)),
        false => particles.zip(below).for_each(|(particle, below)| each(particle, *below)),
    }
}

/// Computes `solution ← solution + alpha p`, or `alpha p` if there is none yet, `residual ← residual − alpha image` and then
/// `p ← M⁻¹ residual + beta p`.
pub struct Advance<'a> {
    pub is_first: bool,
    pub alpha: f64,
    pub beta: f64,
    pub inverse_mass: &'a [f64],
    pub image: &'a [Wide],
    pub solution: &'a mut [Wide],
    pub residual: &'a mut [Wide],
    pub p: &'a mut [Wide],
}

impl Loop for Advance<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Advance { is_first, alpha, beta, inverse_mass, image, solution, residual, p } = self;
        for ((((s, r), p), image), inverse) in
            solution.iter_mut().zip(residual).zip(p).zip(image).zip(inverse_mass)
        {
            *s = plus(if is_first { Wide::ZERO } else { *s }, alpha, *p);
            *r = plus(*r, -alpha, *image);
            *p = plus(times(Wide([beta; 4]), *p), *inverse, *r);
        }
    }
}

/// The last step: computes `p ← solution + alpha p` and `solution ← p + rest M⁻¹ (residual − alpha image)`, without
/// the old solution if there is none yet.
pub struct Finish<'a> {
    pub is_first: bool,
    pub alpha: f64,
    pub rest: f64,
    pub inverse_mass: &'a [f64],
    pub p: &'a mut [Wide],
    pub image: &'a [Wide],
    pub residual: &'a [Wide],
    pub solution: &'a mut [Wide],
}

impl Loop for Finish<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Finish { is_first, alpha, rest, inverse_mass, p, image, residual, solution } = self;
        for ((((s, r), p), image), inverse) in
            solution.iter_mut().zip(residual).zip(p).zip(image).zip(inverse_mass)
        {
            *p = plus(if is_first { Wide::ZERO } else { *s }, alpha, *p);
            *s = plus(*p, rest * *inverse, plus(*r, -alpha, *image));
        }
    }
}

/// The vector `a + factor b`.
#[inline(always)]
fn plus(a: Wide, factor: f64, b: Wide) -> Wide {
    Wide(std::array::from_fn(|c| a[c] + factor * b[c]))
}

#[inline(always)]
fn times(a: Wide, b: Wide) -> Wide {
    Wide(std::array::from_fn(|c| a[c] * b[c]))
}

/// The sum of all four components, the last of which is 0.
#[inline(always)]
fn total(sum: Wide) -> f64 {
    (sum[0] + sum[2]) + (sum[1] + sum[3])
}
