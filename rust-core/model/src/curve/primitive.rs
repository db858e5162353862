//! The integral of a smooth function between two points, as a polynomial.

use std::f64::consts::PI;

/// Number of points of the function's values: about as accurate as Gauss's quadrature with half as many.
const POINTS: usize = 15;

/// Number of partial sums that are independent of each other.
const LANES: usize = 4;

/// `F(n) = ∫ f` from the lower end of an interval, by the Chebyshev expansion of `f`.
#[derive(Debug, Clone)]
pub struct Primitive {
    middle: f64,
    per_half: f64,
    /// Coefficients of the powers of (n − middle)/half, from the zeroth on.
    coefficients: [[f64; LANES]; (POINTS + 1) / LANES],
}

impl Primitive {
    /// Integrates the function whose values `f` computes at a list of points.
    pub fn of(f: impl FnOnce(&[f64; POINTS]) -> [f64; POINTS], from: f64, to: f64) -> Primitive {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let angle = |j: usize| PI * (j as f64 + 0.5) / POINTS as f64;
        let values = f(&std::array::from_fn(|j| middle + half * angle(j).cos()));
        // Coefficient 2/N Σ_j f(x_j) cos(kθ_j); zero beyond the degree.
        let of_f = |k: usize| match k < POINTS {
            true => {
                (0..POINTS).map(|j| values[j] * (k as f64 * angle(j)).cos()).sum::<f64>() * 2.0
                    / POINTS as f64
            }
            false => 0.0,
        };
        let mut primitive = Primitive { middle, per_half: half.recip(), coefficients: Default::default() };
        let powers = primitive.coefficients.as_flattened_mut();
        // The coefficients of T_0 and T_1 in powers.
        let [mut before, mut chebyshev] = [[0.0; POINTS + 1]; 2];
        (before[0], chebyshev[1]) = (1.0, 1.0);
        for k in 1..=POINTS {
            // The integral is ∫T_k = T_{k+1}/2(k+1) − T_{k−1}/2(k−1).
            let of_integral = half * (of_f(k - 1) - of_f(k + 1)) / (2 * k) as f64;
            powers.iter_mut().zip(chebyshev).for_each(|(power, c)| *power += of_integral * c);
            let mut next = before.map(|c| -c);
            next[1..].iter_mut().zip(chebyshev).for_each(|(next, c)| *next += 2.0 * c);
            (before, chebyshev) = (chebyshev, next);
        }
        primitive.coefficients[0][0] -= primitive.at(from);
        primitive
    }

    #[inline(always)]
    pub fn at(&self, n: f64) -> f64 {
        let t = (n - self.middle) * self.per_half;
        let (t2, mut sum) = (t * t, [0.0; LANES]);
        for c in self.coefficients.iter().rev() {
            for k in 0..LANES {
                sum[k] = sum[k] * (t2 * t2) + c[k];
            }
        }
        (sum[0] + t * sum[1]) + t2 * (sum[2] + t * sum[3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_are_those_in_closed_form() {
        for (from, to) in [(0.3, 0.4), (2.0, 2.5), (7.0, 5.5)] {
            let exp = Primitive::of(|n| n.map(f64::exp), from, to);
            let square = Primitive::of(|n| n.map(|n| n * n), from, to);
            for part in [0.0, 0.1, 0.5, 0.77, 1.0] {
                let n = from + part * (to - from);
                assert!((exp.at(n) - (n.exp() - from.exp())).abs() < 1e-14 * to.exp().max(from.exp()));
                assert!((square.at(n) - (n.powi(3) - from.powi(3)) / 3.0).abs() < 1e-13);
            }
        }
    }
}
