//! Integrals over space of functions of the distance: moments and Fourier transforms.

use std::f64::consts::PI;

/// Abscissae and weights of the Gauss–Legendre rule of `count` points on [−1, 1].
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    (0..count)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                // The recurrence computes P_k and P_{k−1}.
                let (mut p, mut before) = (1.0, 0.0);
                for k in 0..count {
                    let k = k as f64;
                    (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
                }
                slope = n * (x * p - before) / (x * x - 1.0);
                let step = p / slope;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Most panels of an integral; only noise needs more.
const MAX_PANELS: usize = 20_000;

/// `∫_a^b f` by adaptive bisection of panels; `nodes` receives abscissae and weights of the panels that
/// were accepted; `relative` is the error of one panel, compared to `∫|f|`. `None` if a panel cannot be
/// resolved.
fn adaptive(
    f: &dyn Fn(f64) -> f64,
    breaks: &[f64],
    nodes: &mut Vec<(f64, f64)>,
    depth_limit: usize,
    relative: f64,
) -> Option<f64> {
    let rule = gauss_legendre(16);
    let panel = |a: f64, b: f64| -> (f64, f64) {
        let (half, middle) = (0.5 * (b - a), 0.5 * (a + b));
        rule.iter().fold((0.0, 0.0), |(sum, size), (x, w)| {
            let y = half * w * f(middle + half * x);
            (sum + y, size + y.abs())
        })
    };
    let scale: f64 = breaks.windows(2).map(|p| panel(p[0], p[1]).1).sum();
    if !scale.is_finite() {
        return None;
    }
    let (mut total, mut panels) = (0.0, 0);
    let mut waiting: Vec<(f64, f64, usize)> = breaks.windows(2).rev().map(|p| (p[0], p[1], 0)).collect();
    while let Some((a, b, depth)) = waiting.pop() {
        panels += 1;
        if panels > MAX_PANELS {
            return None;
        }
        let middle = 0.5 * (a + b);
        let whole = panel(a, b).0;
        let halves = panel(a, middle).0 + panel(middle, b).0;
        let error = (whole - halves).abs();
        let tolerance = relative * scale;
        if error <= tolerance || (depth == depth_limit && error <= 1e-10 * scale) {
            total += whole;
            let half = 0.5 * (b - a);
            nodes.extend(rule.iter().map(|(x, w)| (middle + half * x, half * w)));
        } else if depth < depth_limit && error.is_finite() {
            waiting.push((middle, b, depth + 1));
            waiting.push((a, middle, depth + 1));
        } else {
            return None;
        }
    }
    Some(total)
}

/// `∫ f` over the panels between `breaks`, to about ten digits; NaN if it does not converge.
pub fn integral(f: &dyn Fn(f64) -> f64, breaks: &[f64]) -> f64 {
    adaptive(f, breaks, &mut Vec::new(), 30, 1e-11).unwrap_or(f64::NAN)
}

/// A function of the distance in two or three dimensions, tabulated for integration over space.
#[derive(Debug, Clone)]
pub struct Radial {
    dimensions: usize,
    /// Distance, and quadrature weight times value times the measure (`2πr` or `4πr²`).
    nodes: Vec<(f64, f64)>,
}

impl Radial {
    /// The function `f` on `0 < r < range`. Panels end at multiples of `range/16`, hence at the knot of
    /// the cubic spline; a knot elsewhere is found by bisection. `None` if `f` is not integrable.
    pub fn new(dimensions: usize, range: f64, f: impl Fn(f64) -> f64) -> Option<Radial> {
        let measure = |r: f64| if dimensions == 2 { 2.0 * PI * r } else { 4.0 * PI * r * r };
        let breaks = super::search::spaced(0.0, range, 16);
        let mut nodes = Vec::new();
        adaptive(&|r| f(r) * measure(r), &breaks, &mut nodes, 40, 1e-14)?;
        nodes.iter_mut().for_each(|(r, weight)| *weight *= f(*r) * measure(*r));
        Some(Radial { dimensions, nodes })
    }

    /// `[r^power f]`, the integral over space.
    pub fn moment(&self, power: i32) -> f64 {
        self.nodes.iter().map(|(r, weight)| weight * r.powi(power)).sum()
    }

    /// The Fourier transform `∫ f e^{ik·r} d^dr`: `∫ f sin(kr)/(kr)` in three dimensions, `∫ f J_0(kr)`
    /// in two. For `k` up to about 200 over the range of the function.
    pub fn transform(&self, k: f64) -> f64 {
        if self.dimensions == 2 {
            self.nodes.iter().map(|(r, weight)| weight * libm::j0(k * r)).sum()
        } else {
            self.nodes.iter().map(|(r, weight)| weight * sinc(k * r)).sum()
        }
    }
}

/// The function `sin(x)/x`.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_function_has_its_tabulated_values() {
        for (x, value) in [
            (0.0, 1.0),
            (1.0, 0.765_197_686_557_966_6),
            (2.404_825_557_695_773, 0.0),
            (10.0, -0.245_935_764_451_348_3),
            (50.0, 0.055_812_327_669_251_82),
            (100.0, 0.019_985_850_304_223_12),
        ] {
            assert!((libm::j0(x) - value).abs() < 2e-14, "{x}: {}", libm::j0(x));
        }
    }

    #[test]
    fn kinks_and_singularities() {
        let kink = Radial::new(3, 1.0, |r| (r - 0.3).abs()).unwrap();
        // The exact value is 4π ∫ |r − c| r² dr = 4π (1/4 − c/3 + c⁴/6).
        let exact = 4.0 * PI * (0.25 - 0.1 + 0.3f64.powi(4) / 6.0);
        assert!((kink.moment(0) - exact).abs() < 1e-13);
        let coulomb = Radial::new(3, 1.0, |r| 1.0 / r).unwrap();
        assert!((coulomb.moment(0) - 2.0 * PI).abs() < 1e-12);
        assert!(Radial::new(3, 1.0, |r| r.powi(-12)).is_none());
    }

    #[test]
    fn transforms_of_a_ball_and_a_disc() {
        let ball = Radial::new(3, 1.0, |_| 1.0).unwrap();
        for k in [0.0f64, 0.1, 3.0, 60.0] {
            let exact =
                if k == 0.0 { 4.0 * PI / 3.0 } else { 4.0 * PI * (k.sin() - k * k.cos()) / k.powi(3) };
            assert!((ball.transform(k) - exact).abs() < 1e-11, "{k}");
        }
        // The integral ∫_0^1 2πr (1 − r²) J_0(kr) dr = 4π J_2(k)/k² has the small-k expansion π/2 (1 − k²/12).
        let cap = Radial::new(2, 1.0, |r| 1.0 - r * r).unwrap();
        assert!((cap.transform(1e-3) - 0.5 * PI * (1.0 - 1e-6 / 12.0)).abs() < 1e-12);
    }
}
