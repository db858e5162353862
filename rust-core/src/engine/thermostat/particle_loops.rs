//! The loops of conjugate gradients over the particles of a plane.

use super::mass::Mass;
use crate::engine::vectors::Loop;
use psidpd_passes::plane::pair_sums::Wide;
use std::hint::black_box;

/// The data of one plane during a step of the solver.
pub struct Share<'a> {
    pub p: &'a mut [Wide],
    /// Sums over the pairs.
    pub image: &'a mut [Wide],
    pub masses: &'a [Mass],
    pub residual: &'a mut [Wide],
    pub solution: &'a mut [Wide],
}

/// Sets the residual to the negative of `image`, and `p` to `M⁻¹ r`; returns `r · M⁻¹ r`.
pub struct Start<'s, 'a>(pub &'s mut Share<'a>);

impl Loop for Start<'_, '_> {
    type Out = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Share { p, image, masses, residual, .. } = self.0;
        let mut sum = Wide::ZERO;
        let particles = residual.iter_mut().zip(p.iter_mut()).zip(image.iter()).zip(*masses);
        for (((r, p), image), Mass { inverse, .. }) in particles {
            *r = times(Wide([-1.0; 4]), *image);
            *p = times(Wide([*inverse; 4]), *r);
            sum = plus(sum, 1.0, times(*p, *r));
        }
        total(sum)
    }
}

/// Adds `m p` to the sums of the particles of a plane, which become the
/// image `(M + K) p`; returns `p · image` and `image · M⁻¹ image` of the particles that are not frozen.
pub struct Multiply<'s, 'a>(pub &'s mut Share<'a>);

impl Loop for Multiply<'_, '_> {
    type Out = [f64; 2];

    #[inline(always)]
    fn run(self) -> [f64; 2] {
        let Share { p, image, masses, .. } = self.0;
        let (mut curvature, mut square) = (Wide::ZERO, Wide::ZERO);
        let particles = image.iter_mut().zip(p.iter()).zip(*masses);
        for ((image, p), Mass { inertia, inverse }) in particles {
            let momentum = times(Wide([*inertia; 4]), *p);
            *image = plus(*image, 1.0, momentum);
            let change = times(Wide([*inverse; 4]), *image);
            curvature = plus(curvature, 1.0, times(momentum, change));
            square = plus(square, 1.0, times(*image, change));
        }
        [total(curvature), total(square)]
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
        let Share { p, image, masses, residual, solution, .. } = share;
        let particles = solution.iter_mut().zip(residual.iter_mut()).zip(p.iter_mut()).zip(image.iter());
        for ((((s, r), p), image), Mass { inverse, .. }) in particles.zip(*masses) {
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
        let Share { p, image, masses, residual, solution, .. } = share;
        let particles = solution.iter_mut().zip(residual.iter()).zip(p.iter_mut()).zip(image.iter());
        for ((((s, r), p), image), Mass { inverse, .. }) in particles.zip(*masses) {
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
    // A compiler that sees the order of these additions splits the vectors of the loop before.
    let sum = black_box(sum);
    (sum[0] + sum[2]) + (sum[1] + sum[3])
}

/// Writes the sums over the pairs of a plane and those over pairs of the plane before, if there are any, added up.
pub struct Join<'a> {
    pub to: &'a mut [Wide],
    pub own: &'a [Wide],
    pub before: &'a [Wide],
}

impl Loop for Join<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Join { to, own, before } = self;
        match before.is_empty() {
            true => to.iter_mut().zip(own).for_each(|(to, own)| *to = *own),
            false => {
                let vectors = own.iter().zip(before);
                to.iter_mut().zip(vectors).for_each(|(to, (own, before))| *to = plus(*own, 1.0, *before));
            }
        }
    }
}
