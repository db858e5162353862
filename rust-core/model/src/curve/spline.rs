use std::cmp::Ordering;

/// A cubic spline through given points: twice continuously differentiable, third derivative continuous
/// across the second and the last but one point ("not a knot"; C. de Boor, A Practical Guide to
/// Splines, ch. IV). Beyond the ends its second derivative is constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    /// Ends of the pieces; one more than there are pieces.
    knots: Vec<f64>,
    /// Value and first three derivatives at each knot, of the piece that begins there; the third
    /// derivative at the last knot is zero.
    pieces: Vec<[f64; 4]>,
    /// Reciprocal of the distance between knots, if they are evenly spaced.
    uniform: Option<f64>,
}

/// Reasons why there is no spline through given points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SplineError {
    /// There are fewer than two points.
    #[error("a table needs at least two rows")]
    TooFew,
    /// Two abscissas are equal, or their order changes, at this point (from 0).
    #[error("the first column must rise, or fall, from row to row")]
    NotMonotone(usize),
    /// Numbers are so far apart or so close that the spline overflows.
    #[error("the rows are too close together or too steep to interpolate")]
    NotFinite,
}

impl Spline {
    /// Builds the spline through `(x, y)`; `x` rises or falls strictly.
    ///
    /// # Errors
    /// Fails as [`SplineError`] lists.
    pub fn new(mut x: Vec<f64>, mut y: Vec<f64>) -> Result<Spline, SplineError> {
        let count = x.len().min(y.len());
        if count < 2 {
            return Err(SplineError::TooFew);
        }
        x.truncate(count);
        y.truncate(count);
        let rising = x[1] > x[0];
        let order = Some(if rising { Ordering::Less } else { Ordering::Greater });
        if let Some(at) = (1..count).find(|&k| x[k - 1].partial_cmp(&x[k]) != order) {
            return Err(SplineError::NotMonotone(at));
        }
        if !rising {
            x.reverse();
            y.reverse();
        }
        let h: Vec<f64> = x.windows(2).map(|x| x[1] - x[0]).collect();
        let rise: Vec<f64> = (0..count - 1).map(|k| (y[k + 1] - y[k]) / h[k]).collect();
        let second = second_derivatives(&h, &rise);
        let mut pieces: Vec<[f64; 4]> = (0..count - 1)
            .map(|k| {
                let slope = rise[k] - h[k] * (2.0 * second[k] + second[k + 1]) / 6.0;
                [y[k], slope, second[k], (second[k + 1] - second[k]) / h[k]]
            })
            .collect();
        let [_, slope, curvature] = piece(&pieces[count - 2], h[count - 2]);
        pieces.push([y[count - 1], slope, curvature, 0.0]);
        if !pieces.iter().flatten().all(|c| c.is_finite()) {
            return Err(SplineError::NotFinite);
        }
        let mean = (x[count - 1] - x[0]) / (count - 1) as f64;
        let even = h.iter().all(|h| (h - mean).abs() <= 1e-9 * mean);
        Ok(Spline { knots: x, pieces, uniform: even.then_some(1.0 / mean) })
    }

    /// Value, first and second derivative.
    pub fn at(&self, x: f64) -> [f64; 3] {
        let last = self.knots.len() - 1;
        if x < self.knots[0] {
            let [value, slope, curvature, _] = self.pieces[0];
            return piece(&[value, slope, curvature, 0.0], x - self.knots[0]);
        }
        let k = match self.uniform {
            // The guess may be off by one piece; there the two pieces join smoothly.
            Some(inverse) => (((x - self.knots[0]) * inverse) as usize).min(last),
            None => self.knots.partition_point(|knot| *knot <= x).max(1) - 1,
        };
        piece(&self.pieces[k], x - self.knots[k])
    }

    /// The first and the last abscissa.
    pub fn ends(&self) -> [f64; 2] {
        [self.knots[0], self.knots[self.knots.len() - 1]]
    }

    /// The knots, and value and first three derivatives at each, of the piece that begins there.
    pub fn pieces(&self) -> (&[f64], &[[f64; 4]]) {
        (&self.knots, &self.pieces)
    }

    /// Intercept and slope, if the points lie on a straight line to rounding.
    pub fn straight(&self) -> Option<[f64; 2]> {
        let slope = self.pieces[0][1];
        let width = self.knots[self.knots.len() - 1] - self.knots[0];
        let bent = self.pieces.iter().any(|p| p[2].abs() * width > 1e-11 * slope.abs());
        (!bent).then(|| [self.pieces[0][0] - slope * self.knots[0], slope])
    }
}

/// Value and two derivatives of `y + y′ t + ½ y″ t² + ⅙ y‴ t³`.
#[inline(always)]
fn piece(&[y, slope, curvature, third]: &[f64; 4], t: f64) -> [f64; 3] {
    [
        y + t * (slope + t * (0.5 * curvature + t * (third / 6.0))),
        slope + t * (curvature + t * (0.5 * third)),
        curvature + t * third,
    ]
}

/// The second derivatives at the knots, from a tridiagonal system for the inner knots; the condition
/// that the third derivative is continuous next to the ends eliminates the outer knots.
fn second_derivatives(h: &[f64], rise: &[f64]) -> Vec<f64> {
    let count = h.len() + 1;
    match count {
        2 => return vec![0.0; 2],
        3 => return vec![2.0 * (rise[1] - rise[0]) / (h[0] + h[1]); 3],
        _ => {}
    }
    let inner = count - 2;
    let (first, last) = (h[0] / h[1], h[count - 2] / h[count - 3]);
    let mut diagonal = Vec::with_capacity(inner);
    let mut right = Vec::with_capacity(inner);
    for k in 1..=inner {
        let mut d = 2.0 * (h[k - 1] + h[k]);
        if k == 1 {
            d += h[0] * (1.0 + first);
        }
        if k == inner {
            d += h[count - 2] * (1.0 + last);
        }
        diagonal.push(d);
        right.push(6.0 * (rise[k] - rise[k - 1]));
    }
    // Entries off the diagonal, above and below row k.
    let above = |k: usize| if k == 0 { h[1] - h[0] * first } else { h[k + 1] };
    let below = |k: usize| if k == inner - 1 { h[count - 3] - h[count - 2] * last } else { h[k] };
    for k in 1..inner {
        let factor = below(k) / diagonal[k - 1];
        diagonal[k] -= factor * above(k - 1);
        right[k] -= factor * right[k - 1];
    }
    let mut second = vec![0.0; count];
    for k in (0..inner).rev() {
        let next = if k + 1 < inner { above(k) * second[k + 2] } else { 0.0 };
        second[k + 1] = (right[k] - next) / diagonal[k];
    }
    second[0] = second[1] + first * (second[1] - second[2]);
    second[count - 1] = second[count - 2] + last * (second[count - 2] - second[count - 3]);
    second
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_reproduced_inside_and_slopes_are_linear_outside() {
        let f = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x - 0.3 * x * x * x;
        for x in [
            vec![0.0, 0.3, 1.1, 1.2, 2.0],
            (0..9).map(|k| 0.25 * k as f64).collect(),
            vec![2.0, 1.5, 0.2, 0.0],
        ] {
            let spline = Spline::new(x.clone(), x.iter().map(|x| f(*x)).collect()).unwrap();
            for k in 0..=200 {
                let x = 0.01 * k as f64;
                let [value, slope, curvature] = spline.at(x);
                assert!((value - f(x)).abs() < 1e-12);
                assert!((slope - (-2.0 + x - 0.9 * x * x)).abs() < 1e-12);
                assert!((curvature - (1.0 - 1.8 * x)).abs() < 1e-11);
            }
            let [_, slope, curvature] = spline.at(3.0);
            assert!((curvature - (1.0 - 3.6)).abs() < 1e-11);
            assert!((slope - (-2.0 + 2.0 - 3.6 + curvature)).abs() < 1e-11);
            let [value, slope, _] = spline.at(-1.0);
            assert!((value - 3.5).abs() < 1e-11 && (slope + 3.0).abs() < 1e-11);
        }
    }

    #[test]
    fn pieces_join_with_two_derivatives() {
        let x = vec![0.0, 0.4, 1.0, 1.1, 1.9, 3.0, 3.5];
        let y = x.iter().map(|x: &f64| (3.0 * x).sin()).collect();
        let spline = Spline::new(x.clone(), y).unwrap();
        for x in x {
            let (left, right) = (spline.at(x - 1e-12), spline.at(x + 1e-12));
            for k in 0..3 {
                assert!((left[k] - right[k]).abs() < 1e-9, "{x}: {left:?} {right:?}");
            }
        }
    }

    #[test]
    fn few_points_and_bad_points() {
        let line = Spline::new(vec![0.0, 2.0], vec![1.0, 2.0]).unwrap();
        assert_eq!(line.straight(), Some([1.0, 0.5]));
        assert_eq!(line.at(10.0), [6.0, 0.5, 0.0]);
        let parabola = Spline::new(vec![0.0, 1.0, 3.0], vec![0.0, 1.0, 9.0]).unwrap();
        assert!((parabola.at(2.0)[0] - 4.0).abs() < 1e-13);
        assert_eq!(parabola.straight(), None);
        assert_eq!(Spline::new(vec![1.0], vec![1.0]), Err(SplineError::TooFew));
        assert_eq!(Spline::new(vec![0.0, 1.0, 1.0], vec![0.0; 3]), Err(SplineError::NotMonotone(2)));
        assert_eq!(Spline::new(vec![0.0, 1.0, 0.5], vec![0.0; 3]), Err(SplineError::NotMonotone(2)));
        assert_eq!(Spline::new(vec![0.0, f64::NAN], vec![0.0; 2]), Err(SplineError::NotMonotone(1)));
        assert_eq!(Spline::new(vec![0.0, 1e-300, 1.0], vec![0.0, 1e300, 0.0]), Err(SplineError::NotFinite));
    }
}
