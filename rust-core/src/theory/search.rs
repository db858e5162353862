//! Roots and minima of functions of one variable.

/// The `x` where `positive` changes, by bisection to the last bit. `lo` and `hi` are on different sides, in any order.
pub fn turning_point(mut lo: f64, mut hi: f64, positive: impl Fn(f64) -> bool) -> f64 {
    let at_lo = positive(lo);
    for _ in 0..200 {
        let middle = 0.5 * (lo + hi);
        if middle == lo || middle == hi {
            break;
        }
        if positive(middle) == at_lo {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    0.5 * (lo + hi)
}

/// The minimum of `f` between `a` and `b`, by golden section: place and value. NaN counts as infinitely high.
pub fn minimum(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let f = |x: f64| {
        let y = f(x);
        if y.is_nan() { f64::INFINITY } else { y }
    };
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    while (b - a).abs() > 1e-10 * (a.abs() + b.abs()) + 1e-300 {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - golden * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + golden * (b - a);
            fd = f(d);
        }
        if c >= d {
            break;
        }
    }
    if fc < fd { (c, fc) } else { (d, fd) }
}

/// `count + 1` evenly spaced points from `a` to `b`.
pub fn spaced(a: f64, b: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| a + (b - a) * i as f64 / count as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_roots_and_minima() {
        assert!((turning_point(0.0, 2.0, |x| x * x > 2.0) - 2f64.sqrt()).abs() < 1e-15);
        assert!((turning_point(2.0, 0.0, |x| x * x > 2.0) - 2f64.sqrt()).abs() < 1e-15);
        let (x, y) = minimum(0.0, 3.0, |x| (x - 1.3).powi(2) + 4.0);
        assert!((x - 1.3).abs() < 1e-7 && (y - 4.0).abs() < 1e-14);
    }
}
