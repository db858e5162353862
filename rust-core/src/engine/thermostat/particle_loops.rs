//! The loops of conjugate gradients over the particles of a plane.

use super::pass::Wide;
use crate::engine::vectors::Loop;

/// The data of one plane during a step of the solver.
pub struct Share<'a> {
    pub p: &'a mut [Wide],
    /// Sums over the pairs of the plane itself.
    pub image: &'a mut [Wide],
    /// Contributions of the plane below; empty if it has no pairs with these particles.
    pub below: &'a [Wide],
    /// Mass of each particle; 0 if it is frozen.
    pub inertia: &'a [f64],
    pub inverse_mass: &'a [f64],
    pub residual: &'a mut [Wide],
    pub solution: &'a mut [Wide],
}

/// Sets the residual to the negative sum of `image` and `below`, and `p` to `M⁻¹ r`; returns `r · M⁻¹ r`.
pub struct Start<'s, 'a>(pub &'s mut Share<'a>);

impl Loop for Start<'_, '_> {
    type Out = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Share { p, image, below, inverse_mass, residual, .. } = self.0;
        let mut sum = Wide::ZERO;
        let particles = residual.iter_mut().zip(p.iter_mut()).zip(image.iter()).zip(*inverse_mass);
        let each = |(((r, p), image), inverse): (((&mut Wide, &mut Wide), &Wide), &f64), below: Wide| {
            *r = times(Wide([-1.0; 4]), plus(*image, 1.0, below));
            *p = times(Wide([*inverse; 4]), *r);
            sum = plus(sum, 1.0, times(*p, *r));
        };
        with_below(particles, below, each);
        total(sum)
    }
}

/// Adds `m p` and the contributions of the plane below to the sums of the particles of a plane, which become the
/// image `(M + K) p`; returns `p · image` and `image · M⁻¹ image` of the particles that are not frozen.
pub struct Multiply<'s, 'a>(pub &'s mut Share<'a>);

impl Loop for Multiply<'_, '_> {
    type Out = [f64; 2];

    #[inline(always)]
    fn run(self) -> [f64; 2] {
        let Share { p, image, below, inertia, inverse_mass, .. } = self.0;
        let (mut curvature, mut square) = (Wide::ZERO, Wide::ZERO);
        let particles = image.iter_mut().zip(p.iter()).zip(*inertia).zip(*inverse_mass);
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
pub struct Advance<'s, 'a> {
    pub share: &'s mut Share<'a>,
    pub is_first: bool,
    pub alpha: f64,
    pub beta: f64,
}

impl Loop for Advance<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Advance { share, is_first, alpha, beta } = self;
        let Share { p, image, inverse_mass, residual, solution, .. } = share;
        let particles = solution.iter_mut().zip(residual.iter_mut()).zip(p.iter_mut()).zip(image.iter());
        for ((((s, r), p), image), inverse) in particles.zip(*inverse_mass) {
            *s = plus(if is_first { Wide::ZERO } else { *s }, alpha, *p);
            *r = plus(*r, -alpha, *image);
            *p = plus(times(Wide([beta; 4]), *p), *inverse, *r);
        }
    }
}

/// The last step: computes `p ← solution + alpha p` and `solution ← p + rest M⁻¹ (residual − alpha image)`, without
/// the old solution if there is none yet.
pub struct Finish<'s, 'a> {
    pub share: &'s mut Share<'a>,
    pub is_first: bool,
    pub alpha: f64,
    pub rest: f64,
}

impl Loop for Finish<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Finish { share, is_first, alpha, rest } = self;
        let Share { p, image, inverse_mass, residual, solution, .. } = share;
        let particles = solution.iter_mut().zip(residual.iter()).zip(p.iter_mut()).zip(image.iter());
        for ((((s, r), p), image), inverse) in particles.zip(*inverse_mass) {
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
