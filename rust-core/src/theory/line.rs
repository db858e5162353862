//! Coexistence for a free energy of one variable, by the double tangent.

use super::TheoryError;
use super::search::{minimum, turning_point};

/// A free energy `g(x)` of one variable, as a function of a parameter `u` (a logarithm, so that a phase
/// with almost none of one component is no special case).
pub trait Line {
    /// The variable `x(u)`, increasing.
    fn x(&self, u: f64) -> f64;
    /// The parameter `u(x)`.
    fn u(&self, x: f64) -> f64;
    /// The parameter where `x` is `below` less than at `end`. There `x` itself may round to its highest value.
    fn u_below(&self, end: f64, below: f64) -> f64 {
        self.u(self.x(end) - below)
    }
    /// The curvature `g″(x)`, times a positive factor that makes it 1 for an ideal gas or an ideal mixture.
    fn curvature(&self, u: f64) -> f64;
    /// The slope `g′(x)`, which is equal in two coexisting phases.
    fn slope(&self, u: f64) -> f64;
    /// The intercept `x g′ − g`, which is equal in two coexisting phases too.
    fn intercept(&self, u: f64) -> f64;
    /// Values of `u` at which phases are searched.
    fn grid(&self) -> Vec<f64>;
    /// Largest distance of a phase beyond the grid.
    fn limits(&self) -> [f64; 2];
}

/// The intervals of `u` in which `g″ < 0`. An interval that reaches the end of the grid ends at ±∞.
pub fn unstable(line: &dyn Line) -> Vec<[f64; 2]> {
    negative(&line.grid(), &|u| line.curvature(u))
}

/// The intervals in which `f < 0`. An interval that reaches the end of the grid ends at ±∞.
pub fn negative(grid: &[f64], f: &dyn Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let mut points: Vec<(f64, bool)> = Vec::with_capacity(grid.len());
    let values: Vec<f64> = grid.iter().map(|u| f(*u)).collect();
    for (i, u) in grid.iter().enumerate() {
        points.push((*u, values[i] < 0.0));
        // f may dip below zero between two points of the grid.
        if i > 0 && i + 1 < grid.len() && values[i] <= values[i - 1] && values[i] <= values[i + 1] {
            let (place, value) = minimum(grid[i - 1], grid[i + 1], f);
            if value < 0.0 && values[i] >= 0.0 {
                points.push((place, true));
            }
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut all = Vec::new();
    let mut start = points.first().filter(|p| p.1).map(|_| f64::NEG_INFINITY);
    for pair in points.windows(2) {
        let [(a, before), (b, after)] = [pair[0], pair[1]];
        if before != after {
            let edge = turning_point(a, b, |u| f(u) < 0.0);
            match start.take() {
                None => start = Some(edge),
                Some(from) => all.push([from, edge]),
            }
        }
    }
    all.extend(start.map(|from| [from, f64::INFINITY]));
    all
}

/// The place and the smallest value of `f`, from a grid and then between its points.
pub fn smallest(grid: &[f64], f: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let values: Vec<f64> = grid.iter().map(|u| f(*u)).collect();
    let best = (0..grid.len())
        .filter(|i| values[*i].is_finite())
        .min_by(|i, j| values[*i].total_cmp(&values[*j]))
        .unwrap_or(0);
    let (a, b) = (best.saturating_sub(1), (best + 1).min(grid.len() - 1));
    let refined = minimum(grid[a], grid[b], f);
    if refined.1 <= values[best] { refined } else { (grid[best], values[best]) }
}

/// Two coexisting phases: the first double tangent, in order of `x`, with no part of `g` below it
/// between the two phases. A stable phase between the two may be left out.
///
/// # Errors
/// Fails with [`TheoryError::NoCoexistence`].
pub fn coexisting(line: &dyn Line) -> Result<[f64; 2], TheoryError> {
    let regions = unstable(line);
    let grid = line.grid();
    let supported = |[a, b]: [f64; 2]| {
        let (slope, intercept) = (line.slope(a), line.intercept(a));
        grid.iter().filter(|u| a < **u && **u < b).all(|u| {
            let (own_slope, own_intercept, x) = (line.slope(*u), line.intercept(*u), line.x(*u));
            let above = x * (own_slope - slope) - (own_intercept - intercept);
            above.is_nan() || above > -1e-9 * ((x * own_slope).abs() + own_intercept.abs())
        })
    };
    let found = (0..regions.len()).find_map(|first| {
        let partners = (first..regions.len()).rev();
        partners.filter_map(|last| coexistence(line, &regions, first, last)).find(|pair| supported(*pair))
    });
    found.ok_or(TheoryError::NoCoexistence)
}

/// The two phases below unstable interval `first` and above unstable interval `last` of `regions`.
///
/// The slope is monotonic on the two stable branches next to these intervals, so both phases follow from a
/// common slope by bisection; the difference of their intercepts is monotonic in that slope in turn.
fn coexistence(line: &dyn Line, regions: &[[f64; 2]], first: usize, last: usize) -> Option<[f64; 2]> {
    let (a, b) = (regions[first][0], regions[last][1]);
    if !a.is_finite() || !b.is_finite() {
        return None;
    }
    let limits = line.limits();
    let low_end = if first == 0 { limits[0] } else { regions[first - 1][1] };
    let high_end = regions.get(last + 1).map_or(limits[1], |next| next[0]);
    let (top, bottom) = (line.slope(a), line.slope(b));
    // The values are undefined, or rounding has made the two ends equal: there is no interval.
    if top.is_nan() || bottom.is_nan() || top <= bottom {
        return None;
    }
    let low = |slope: f64| -> Option<f64> { reach(a, low_end, -1.0, |u| line.slope(u) <= slope) };
    let high = |slope: f64| -> Option<f64> { reach(b, high_end, 1.0, |u| line.slope(u) >= slope) };
    // The slopes at which both branches have a phase. Where a branch ends first, its end bounds them.
    let from = match low(bottom) {
        Some(_) => bottom,
        None => line.slope(low_end),
    };
    let to = match high(top) {
        Some(_) => top,
        None => line.slope(high_end),
    };
    if from.is_nan() || to.is_nan() || from >= to {
        return None;
    }
    let difference =
        |slope: f64| -> Option<f64> { Some(line.intercept(high(slope)?) - line.intercept(low(slope)?)) };
    let near = 1e-12 * (to - from);
    let positive = |slope: f64| difference(slope).is_some_and(|d| d > 0.0);
    if positive(from + near) || !positive(to - near) {
        return None;
    }
    let slope = turning_point(from + near, to - near, positive);
    Some([low(slope)?, high(slope)?])
}

/// The first point from `start` in `direction`, up to `end`, where `reached` becomes true.
fn reach(start: f64, end: f64, direction: f64, reached: impl Fn(f64) -> bool) -> Option<f64> {
    if reached(start) {
        return Some(start);
    }
    let (mut before, mut step) = (start, 0.01);
    loop {
        let at = start + direction * step;
        let at = if direction * (at - end) >= 0.0 { end } else { at };
        if reached(at) {
            return Some(turning_point(before, at, &reached));
        }
        if at == end {
            return None;
        }
        before = at;
        step *= 1.5;
    }
}
