//! The positions at which the density across an interface crosses its levels. No shape of the interface is assumed.

/// Properties of one flank of a slab or drop, without a fitted curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edges {
    /// Mean density of the inner plateau.
    pub liquid: f64,
    /// Mean density of the outer plateau.
    pub vapour: f64,
    /// Uncertainty of the inner and the outer density because their plateaus are narrow; 0 for wide plateaus.
    pub doubt: [f64; 2],
    /// The distance from the centre at which the density is halfway.
    pub place: f64,
    /// The distance between the positions at 90 % and 10 % of the density step.
    pub ten_ninety: f64,
    /// The width `(ρ_L − ρ_V)/max|dρ/ds|`. The slope is that of a straight line through three tenths of the interface or
    /// three bins, because differences of neighbouring bins would overrate the slope in proportion to their noise.
    pub steepest: f64,
}

const FEWEST: usize = 6;

/// The distance of a plateau from the interface, in 10–90 % widths. Layers near the surface of a liquid decay within
/// this distance. Averages that include them are too high or too low.
const LAYERS: f64 = 4.0;

/// The smallest depth of a plateau in the flank, in 10–90 % widths.
const DEPTH: f64 = 1.0;

/// The density of a plateau and its uncertainty.
///
/// `bins` are ordered from the farthest from the interface to the nearest. Each bin has its distance from the interface
/// and its density. A plateau is narrow if less than [`DEPTH`] remains beyond [`LAYERS`]. Then its density is the mean over
/// the farther half of the bins beyond one width, and the uncertainty is the difference from the mean over all of these.
/// The result is `None` if no bin is beyond one width.
fn plateau(bins: &[(f64, f64)], width: f64) -> Option<(f64, f64)> {
    let beyond = |distance: f64| &bins[..bins.iter().take_while(|bin| bin.0 > distance).count()];
    let mean = |bins: &[(f64, f64)]| bins.iter().map(|bin| bin.1).sum::<f64>() / bins.len() as f64;
    let (far, near) = (beyond(LAYERS * width), beyond(width));
    let deepest = bins.first()?.0;
    if !far.is_empty() && deepest >= (LAYERS + DEPTH) * width {
        return Some((mean(far), 0.0));
    }
    let half = mean(&near[..near.len().div_ceil(2)]);
    (!near.is_empty()).then(|| (half, (half - mean(near)).abs()))
}

/// The edges of one flank, given as (distance from the centre, density) with distances that increase by `height`.
/// The result is `None` if the density does not fall outwards.
pub fn edges(points: &[(f64, f64)], height: f64) -> Option<Edges> {
    if points.len() < FEWEST || !points.iter().all(|p| p.0.is_finite() && p.1.is_finite()) {
        return None;
    }
    let mean = |p: &[(f64, f64)]| {
        if p.is_empty() { f64::NAN } else { p.iter().map(|p| p.1).sum::<f64>() / p.len() as f64 }
    };
    let quarter = (points.len() / 4).max(1);
    let (mut liquid, mut vapour) = (mean(&points[..quarter]), mean(&points[points.len() - quarter..]));
    let mut doubt = [f64::NAN; 2];
    let mut found = None;
    // A better position of the interface gives better plateaus, so the search is repeated.
    for _ in 0..4 {
        if liquid.is_nan() || vapour.is_nan() || liquid <= vapour {
            return None;
        }
        let level = |part: f64| vapour + part * (liquid - vapour);
        // A sharp step at this bin would hold as many particles.
        let excess: f64 = points.iter().map(|p| p.1 - vapour).sum();
        let step = ((excess / (liquid - vapour)).max(0.0) as usize).min(points.len() - 1);
        let inner = inwards(points, step, level(0.9))?;
        let outer = outwards(points, step, level(0.1))?;
        let place = match points[step].1 >= level(0.5) {
            true => outwards(points, step, level(0.5))?,
            false => inwards(points, step, level(0.5))?,
        };
        let ten_ninety = outer - inner;
        let steepest = (liquid - vapour) / steepest(points, height, [inner, outer])?;
        found = Some(Edges { liquid, vapour, doubt, place, ten_ninety, steepest });
        let inwards = points.iter().map(|p| (place - p.0, p.1)).collect::<Vec<_>>();
        let outwards = points.iter().rev().map(|p| (p.0 - place, p.1)).collect::<Vec<_>>();
        // An interface as wide as the flank leaves no plateau. Then the quarters are kept, and the whole step is uncertain.
        let step = liquid - vapour;
        let (inside, inside_doubt) = plateau(&inwards, ten_ninety).unwrap_or((liquid, step));
        let (outside, outside_doubt) = plateau(&outwards, ten_ninety).unwrap_or((vapour, step));
        (liquid, vapour, doubt) = (inside, outside, [inside_doubt, outside_doubt]);
    }
    found
}

/// The position nearest to bin `from`, towards the centre, at which the density has risen to `level`.
fn inwards(points: &[(f64, f64)], from: usize, level: f64) -> Option<f64> {
    let above = points[..=from].iter().rposition(|p| p.1 >= level)?;
    Some(between(points, above, level))
}

/// The position nearest to bin `from`, away from the centre, at which the density has fallen to `level`.
fn outwards(points: &[(f64, f64)], from: usize, level: f64) -> Option<f64> {
    let below = from + points[from..].iter().position(|p| p.1 <= level)?;
    if below == 0 { None } else { Some(between(points, below - 1, level)) }
}

/// The position at which the straight line from bin `k` to the next bin crosses `level`.
fn between(points: &[(f64, f64)], k: usize, level: f64) -> f64 {
    let Some(next) = points.get(k + 1) else { return points[k].0 };
    let (fall, part) = (points[k].1 - next.1, points[k].1 - level);
    if fall > 0.0 {
        points[k].0 + (next.0 - points[k].0) * (part / fall).clamp(0.0, 1.0)
    } else {
        points[k].0
    }
}

/// The steepest fall of a straight line through several bins, over all positions in the interface.
fn steepest(points: &[(f64, f64)], height: f64, [inner, outer]: [f64; 2]) -> Option<f64> {
    let half = ((0.15 * (outer - inner) / height).round() as usize).max(1);
    let fall = |k: usize| {
        let window = &points[k.checked_sub(half)?..points.len().min(k + half + 1)];
        let count = window.len() as f64;
        let middle = window.iter().map(|p| p.0).sum::<f64>() / count;
        let square: f64 = window.iter().map(|p| (p.0 - middle).powi(2)).sum();
        Some(-window.iter().map(|p| (p.0 - middle) * p.1).sum::<f64>() / square)
    };
    let within = |k: &usize| points[*k].0 >= inner - height && points[*k].0 <= outer + height;
    let most = (0..points.len()).filter(within).filter_map(fall).fold(f64::NAN, f64::max);
    (most > 0.0).then_some(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flank(bins: usize, height: f64, rho: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        (0..bins).map(|k| (k as f64 + 0.5) * height).map(|s| (s, rho(s))).collect()
    }

    /// A hyperbolic tangent of scale d has w = 2d, and 2 artanh(0.8) d from 10 to 90 %. The straight line underrates its slope
    /// by 2 %.
    #[test]
    fn a_tanh_has_its_widths() {
        let points = flank(100, 0.1, |s| 3.0 - 2.9 * ((s - 5.0) / 0.6).tanh());
        let found = edges(&points, 0.1).unwrap();
        assert!((found.place - 5.0).abs() < 0.01, "{found:?}");
        assert!((found.liquid - 5.9).abs() < 0.01 && (found.vapour - 0.1).abs() < 0.01, "{found:?}");
        assert!((found.ten_ninety - 2.0 * 0.8f64.atanh() * 0.6).abs() < 0.02, "{found:?}");
        assert!((found.steepest / 1.2 - 1.0).abs() < 0.04, "{found:?}");
    }

    /// Layers that decay into a plateau do not raise its density, at any phase of the layers. A mean from one width on would
    /// be off by up to 2 %. If the layers leave no room for a plateau, its error is at most five stated uncertainties and 0.02.
    #[test]
    fn layers_are_no_part_of_a_plateau() {
        for phase in [0.0, 1.0, 2.0, 3.0, 4.0, 5.0] {
            let layered = |s: f64| {
                let depth = 6.0 - s;
                let layers = 1.5
                    * (-depth.max(0.0) / 0.45).exp()
                    * (std::f64::consts::TAU * depth / 0.85 + phase).cos();
                3.0 - 3.0 * ((s - 6.0) / 0.25).tanh() + 0.5 * layers * (1.0 - ((s - 6.0) / 0.25).tanh())
            };
            let found = edges(&flank(240, 0.05, layered), 0.05).unwrap();
            assert!((found.liquid - 6.0).abs() < 0.003, "{phase}: {found:?}");
            assert!(found.vapour.abs() < 1e-6 && found.doubt == [0.0; 2], "{found:?}");
            let narrow = |s: f64| layered(s + 4.5);
            let found = edges(&flank(120, 0.05, narrow), 0.05).unwrap();
            let off = (found.liquid - 6.0).abs();
            assert!(found.doubt[0] > 0.0 && off < 5.0 * found.doubt[0] + 0.02, "{phase}: {found:?}");
        }
    }

    /// A straight ramp and a liquid that is denser at its edge are not tangents, but have widths as well.
    #[test]
    fn other_shapes_have_widths_too() {
        let ramp = flank(100, 0.1, |s| 4.0 * ((6.0 - s) / 2.0).clamp(0.0, 1.0));
        let found = edges(&ramp, 0.1).unwrap();
        assert!((found.ten_ninety - 1.6).abs() < 0.02 && (found.steepest - 2.0).abs() < 0.02, "{found:?}");
        assert!((found.place - 5.0).abs() < 0.01 && found.vapour == 0.0, "{found:?}");
        let peaked = flank(100, 0.1, |s| {
            let bulk = 3.0 - 2.9 * ((s - 5.0) / 0.3).tanh();
            bulk + 2.0 * (-((s - 4.2) / 0.2).powi(2)).exp()
        });
        let found = edges(&peaked, 0.1).unwrap();
        assert!((found.place - 5.0).abs() < 0.1 && found.ten_ninety < 0.8, "{found:?}");
    }

    #[test]
    fn what_does_not_fall_has_none() {
        for rho in [0.0, 3.0, f64::NAN] {
            assert_eq!(edges(&flank(40, 0.1, |_| rho), 0.1), None);
        }
        assert_eq!(edges(&flank(40, 0.1, |s| s), 0.1), None);
        assert_eq!(edges(&flank(3, 0.1, |s| -s), 0.1), None);
    }
}
