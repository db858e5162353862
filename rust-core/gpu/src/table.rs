//! Splines and equations of state as polynomial pieces, for `m_table` of `wgsl/common.wgsl`.

use psidpd_core::model::Bounds;
use psidpd_core::model::curve::{Curve, Spline};

/// Numbers of a row: knot, inverse width, six coefficients.
const ROW: usize = 8;
/// Most pieces of an equation of state.
const MOST: usize = 4000;
/// Error of ψ′ that a piece may have, relative to its magnitude or 1.
const ACCURACY: f64 = 3e-8;
/// The densities at which an equation of state without bounds is known, unless it is singular.
const DENSITIES: [f64; 2] = [1e-6, 4096.0];

/// Appends rows to the tables, and returns their place. The first row also holds below its knot, the last beyond it.
fn append(rows: &[[f64; ROW]], tables: &mut Vec<f32>) -> usize {
    let from = tables.len();
    tables.push(rows.len() as f32);
    tables.resize(from + ROW, 0.0);
    tables.extend(rows.iter().flatten().map(|x| *x as f32));
    from
}

/// A spline, whose second derivative is constant beyond its ends.
pub fn of_spline(spline: &Spline, tables: &mut Vec<f32>) -> usize {
    let (knots, pieces) = spline.pieces();
    let width = |k: usize| knots[(k + 1).min(knots.len() - 1)] - knots[k.min(knots.len() - 2)];
    let row = |k: usize, third: f64| {
        let ([value, slope, second, _], h) = (pieces[k], width(k));
        [knots[k], 1.0 / h, value, slope * h, 0.5 * second * h * h, third * h.powi(3) / 6.0, 0.0, 0.0]
    };
    let inside = (0..knots.len()).map(|k| row(k, pieces[k][3]));
    let rows: Vec<_> = std::iter::once(row(0, 0.0)).chain(inside).collect();
    append(&rows, tables)
}

/// An equation of state, by pieces with its exact ψ, ψ′ and ψ″ at their ends; not a number where ψ is singular.
pub fn of_curve(curve: &Curve, bounds: Option<Bounds>, tables: &mut Vec<f32>) -> Option<usize> {
    let finite = |n: f64| curve.at(n).iter().all(|x| x.is_finite());
    let (low, high) = match bounds {
        Some(bounds) => (bounds.low, bounds.high),
        None => {
            let low = if finite(0.0) { 0.0 } else { DENSITIES[0] };
            let mut known = low.max(1e-3);
            while known < DENSITIES[1] && finite(2.0 * known) {
                known *= 2.0;
            }
            let mut beyond = 2.0 * known;
            while known < DENSITIES[1] && beyond - known > 1e-4 * known {
                let middle = 0.5 * (known + beyond);
                *(if finite(middle) { &mut known } else { &mut beyond }) = middle;
            }
            (low, known)
        }
    };
    if !(finite(low) && finite(high)) {
        return None;
    }
    let mut rows = Vec::new();
    let mut rest = vec![(low, high)];
    while let Some((from, to)) = rest.pop() {
        let row = hermite(curve, from, to);
        let smallest = to - from < 1e-5 * to.max(1e-3);
        if smallest || is_accurate(curve, &row, from, to) {
            rows.push(row);
        } else {
            let middle = 0.5 * (from + to);
            rest.extend([(middle, to), (from, middle)]);
        }
        if rows.len() + rest.len() > MOST {
            return None;
        }
    }
    if bounds.is_none() {
        // Densities below 0 do not occur; where ψ is singular there is no value.
        let nowhere = |knot: f64| [knot, 1.0, f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0];
        if low > 0.0 {
            rows.insert(0, nowhere(0.0));
        }
        rows.push(nowhere(high));
    }
    Some(append(&rows, tables))
}

/// The polynomial of fifth degree with value and two derivatives of the curve at both ends.
fn hermite(curve: &Curve, from: f64, to: f64) -> [f64; ROW] {
    let h = to - from;
    let [[y, s, k], [to_y, to_s, to_k]] = [from, to].map(|n| {
        let [y, s, k] = curve.at(n);
        [y, s * h, k * h * h]
    });
    let a = to_y - y - s - 0.5 * k;
    let b = to_s - s - k;
    let c = to_k - k;
    let coefficients =
        [y, s, 0.5 * k, 10.0 * a - 4.0 * b + 0.5 * c, -15.0 * a + 7.0 * b - c, 6.0 * a - 3.0 * b + 0.5 * c];
    let mut row = [from, 1.0 / h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    row[2..].copy_from_slice(&coefficients);
    row
}

fn is_accurate(curve: &Curve, row: &[f64; ROW], from: f64, to: f64) -> bool {
    [0.2, 0.35, 0.5, 0.65, 0.8].iter().all(|t| {
        let [exact, slope, _] = curve.at(from + t * (to - from));
        let (value, by_t) = row[2..].iter().rev().fold((0.0, 0.0), |(v, s), c| (v * t + c, s * t + v));
        let close = |a: f64, b: f64| (a - b).abs() <= ACCURACY * b.abs().max(1.0);
        close(by_t * row[1], slope) && close(value, exact)
    })
}
