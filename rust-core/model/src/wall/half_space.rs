//! Integrals of a radial function over the half of space, or of the plane, that lies behind a face.
//!
//! At the distance z from the face
//!
//! ```text
//! H(z) = ∫_z^R f(r) r^(d−1) A(z/r) dr,    A(c) = 2π (1 − c) in space, 2 arccos c in the plane,
//! ```
//!
//! where `A` is the solid angle, or the angle, under which the half-space is seen at the distance r. One quadrature serves every
//! kernel and every pair form.

use std::f64::consts::PI;

/// Number of panels of a table.
const PANELS: usize = 128;

/// The integral of a function over a half-space, by the distance from its face, as a table of polynomials of fifth degree that
/// have its value, slope and curvature at the ends of every panel. Value and slope belong together exactly.
#[derive(Debug, Clone)]
pub struct HalfSpace {
    range: f64,
    panels: Vec<[f64; 6]>,
}

impl HalfSpace {
    /// The integral of `factor` times `f`, whose value and slope are `f(r)`, and which is zero beyond its `range`. `None` if it is
    /// not finite, as that of a potential with a hard core.
    pub fn of(
        dimensions: usize,
        range: f64,
        factor: f64,
        f: impl Fn(f64) -> (f64, f64),
    ) -> Option<HalfSpace> {
        let node = |k: usize| derivatives(dimensions, range, range * k as f64 / PANELS as f64, &f);
        let nodes: Vec<[f64; 3]> = (0..=PANELS).map(|k| node(k).map(|x| factor * x)).collect();
        let h = range / PANELS as f64;
        let panels = nodes.windows(2).map(|ends| panel(ends[0], ends[1], h)).collect();
        let is_finite = f(0.0).0.is_finite() && nodes.iter().flatten().all(|x| x.is_finite());
        is_finite.then_some(HalfSpace { range, panels })
    }

    /// The integral times a number.
    pub fn times(&self, factor: f64) -> HalfSpace {
        let panels = self.panels.iter().map(|panel| panel.map(|a| factor * a)).collect();
        HalfSpace { panels, ..*self }
    }

    /// The distance from which on it is zero.
    pub fn range(&self) -> f64 {
        self.range
    }

    /// Value, slope and curvature at the distance `z` from the face; places behind it are taken for the face.
    pub fn at(&self, z: f64) -> [f64; 3] {
        if z >= self.range {
            return [0.0; 3];
        }
        let per_length = PANELS as f64 / self.range;
        let at = z.max(0.0) * per_length;
        let k = (at as usize).min(PANELS - 1);
        let t = at - k as f64;
        let [value, slope, curvature] = self.panels[k]
            .iter()
            .rev()
            .fold([0.0; 3], |[v, s, c], a| [v * t + a, s * t + v, c * t + 2.0 * s]);
        [value, slope * per_length, curvature * per_length * per_length]
    }
}

/// The coefficients, in powers of the fraction of the panel's length `h`, of the polynomial with these values, slopes and curvatures.
fn panel([a, b, c]: [f64; 3], [e, f, g]: [f64; 3], h: f64) -> [f64; 6] {
    let (b, c, f, g) = (b * h, 0.5 * c * h * h, f * h, 0.5 * g * h * h);
    // What is left of value, slope and half the curvature at the upper end.
    let (p, q, r) = (e - a - b - c, f - b - 2.0 * c, g - c);
    [a, b, c, 10.0 * p - 4.0 * q + r, -15.0 * p + 7.0 * q - 2.0 * r, 6.0 * p - 3.0 * q + r]
}

/// `H`, `H′` and `H″` at `z`.
fn derivatives(dimensions: usize, range: f64, z: f64, f: &impl Fn(f64) -> (f64, f64)) -> [f64; 3] {
    if z >= range {
        return [0.0; 3];
    }
    let mut sums = [0.0; 3];
    behind(range, z, |r, dr| {
        let (value, slope) = f(r);
        let c = z / r;
        match dimensions {
            2 => {
                let sine = sine(z, r);
                sums[0] += dr * value * r * 2.0 * c.acos();
                sums[1] -= dr * value * 2.0 / sine;
                sums[2] -= dr * slope * 2.0 * c / sine;
            }
            _ => {
                sums[0] += dr * value * r * r * 2.0 * PI * (1.0 - c);
                sums[1] -= dr * value * r * 2.0 * PI;
            }
        }
    });
    if dimensions == 3 {
        sums[2] = 2.0 * PI * z * f(z).0;
    }
    sums
}

/// `√(1 − (z/r)²)`.
fn sine(z: f64, r: f64) -> f64 {
    ((r - z) * (r + z)).sqrt() / r
}

/// The tensor of `f r̂ r̂` over a half-space: the component along the face and the one across it.
pub(super) fn tensor(dimensions: usize, range: f64, z: f64, f: impl Fn(f64) -> f64) -> [f64; 2] {
    if z >= range {
        return [0.0; 2];
    }
    let mut sums = [0.0; 2];
    behind(range, z, |r, dr| {
        let c = z / r;
        let (whole, across) = match dimensions {
            2 => (2.0 * c.acos(), c.acos() + sine(z, r) * c),
            _ => (2.0 * PI * (1.0 - c), 2.0 * PI / 3.0 * (1.0 - c * c * c)),
        };
        let weight = dr * f(r) * r.powi(dimensions as i32 - 1);
        sums[0] += weight * (whole - across) / (dimensions - 1) as f64;
        sums[1] += weight * across;
    });
    sums
}

/// Calls `visit` with places and weights of a quadrature from `z` to `range`: Gauss's of eight points in panels of u, with
/// r = z + (range − z) u², which takes the root at r = z away.
fn behind(range: f64, z: f64, mut visit: impl FnMut(f64, f64)) {
    const PARTS: usize = 16;
    const POINTS: [[f64; 2]; 4] = [
        [0.183_434_642_495_649_8, 0.362_683_783_378_362],
        [0.525_532_409_916_329, 0.313_706_645_877_887_3],
        [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
        [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
    ];
    let half = 0.5 / PARTS as f64;
    for part in 0..PARTS {
        let middle = (2 * part + 1) as f64 * half;
        for [place, weight] in POINTS {
            for u in [middle - half * place, middle + half * place] {
                visit(z + (range - z) * u * u, 2.0 * (range - z) * u * half * weight);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Kernel, KernelKind};

    /// In space the quadratic kernel has a closed form, and so has the soft pair form, which has its shape.
    #[test]
    fn the_quadratic_kernel_has_its_closed_form() {
        for range in [0.75, 1.3] {
            let w = Kernel::new(KernelKind::from_name("quadratic").unwrap(), range, 3);
            let found = HalfSpace::of(3, range, 6.05, |r| (w.value(r), w.slope(r))).unwrap();
            for k in 0..=400 {
                let z = range * f64::from(k) / 400.0;
                let s = z / range;
                let value = 15.0
                    * ((1.0 - s) / 12.0 - (1.0 - s.powi(3)) / 6.0 + (1.0 - s.powi(4)) / 6.0
                        - (1.0 - s.powi(5)) / 20.0);
                let slope =
                    -15.0 / range * (1.0 / 12.0 - s * s / 2.0 + 2.0 * s.powi(3) / 3.0 - s.powi(4) / 4.0);
                let curvature = 15.0 / (range * range) * s * (1.0 - s) * (1.0 - s);
                for (found, exact) in found.at(z).into_iter().zip([value, slope, curvature]) {
                    assert!((found - 6.05 * exact).abs() < 1e-9, "{z}: {found} {}", 6.05 * exact);
                }
            }
            assert!((found.at(0.0)[0] - 0.5 * 6.05).abs() < 1e-10 && found.at(range) == [0.0; 3]);
        }
    }

    /// Sums over strips of a fine grid of points, for every kernel in the plane and in space; at the face half of all.
    #[test]
    fn every_kernel_is_what_a_sum_over_points_is() {
        for &kind in KernelKind::ALL {
            for dimensions in [2, 3] {
                let w = Kernel::new(kind, 1.0, dimensions);
                let found = HalfSpace::of(dimensions, 1.0, 1.0, |r| (w.value(r), w.slope(r))).unwrap();
                assert!((found.at(0.0)[0] - 0.5).abs() < 1e-5, "{}", kind.name());
                for z in [0.0, 0.013, 0.2, 0.5, 0.77, 0.95] {
                    let (steps, mut sum) = (800, 0.0);
                    let h = 1.0 / f64::from(steps);
                    for deep in 0..steps {
                        let depth = z + (f64::from(deep) + 0.5) * h;
                        for aside in 0..steps {
                            let y = (f64::from(aside) + 0.5) * h;
                            let ring = if dimensions == 2 { 2.0 } else { 2.0 * PI * y };
                            sum += ring * h * h * w.value(depth.hypot(y));
                        }
                    }
                    let off = found.at(z)[0] - sum;
                    assert!(off.abs() < 2e-5, "{} {dimensions}-D at {z}: {off}", kind.name());
                }
                for z in [0.004, 0.1, 0.33, 0.6, 0.9] {
                    let h = 1e-5;
                    let [up, here, down] = [z + h, z, z - h].map(|z| found.at(z));
                    assert!(((up[0] - down[0]) / (2.0 * h) - here[1]).abs() < 1e-8);
                    assert!(((up[1] - down[1]) / (2.0 * h) - here[2]).abs() < 1e-5 * (1.0 + here[2].abs()));
                }
            }
        }
    }

    #[test]
    fn a_hard_core_has_no_integral() {
        assert!(HalfSpace::of(3, 1.0, 1.0, |r| (1.0 / (r * r * r) - 1.0, -3.0 / r.powi(4))).is_none());
    }
}
