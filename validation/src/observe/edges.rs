//! Where the density across an interface crosses its levels, whatever its shape.

/// What the flank of a slab or drop shows by itself, without a curve put through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edges {
    /// Mean density inside, further from the interface than its width.
    pub liquid: f64,
    /// Mean density outside.
    pub vapour: f64,
    /// Where the density is half way, from the centre.
    pub place: f64,
    /// Distance of the places where 90 % and 10 % of the way are left.
    pub ten_ninety: f64,
    /// `(ρ_L − ρ_V)/max|dρ/ds|`, the slope being that of a straight line through three tenths of the interface or three
    /// bins: differences of neighbouring bins would overrate it in proportion to their noise.
    pub steepest: f64,
}

/// Bins that a flank must have.
const FEWEST: usize = 6;

/// The edges of one flank: (distance from the centre, density), distances increasing by `height`. `None` where the density
/// does not fall from the inside to the outside.
pub fn edges(points: &[(f64, f64)], height: f64) -> Option<Edges> {
    if points.len() < FEWEST || !points.iter().all(|p| p.0.is_finite() && p.1.is_finite()) {
        return None;
    }
    let mean = |p: &[(f64, f64)]| {
        if p.is_empty() { f64::NAN } else { p.iter().map(|p| p.1).sum::<f64>() / p.len() as f64 }
    };
    let quarter = (points.len() / 4).max(1);
    let (mut liquid, mut vapour) = (mean(&points[..quarter]), mean(&points[points.len() - quarter..]));
    let mut found = None;
    // The plateaus are known better once the interface between them is.
    for _ in 0..3 {
        if liquid.is_nan() || vapour.is_nan() || liquid <= vapour {
            return None;
        }
        let level = |part: f64| vapour + part * (liquid - vapour);
        // The bin where a step would hold as many particles.
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
        found = Some(Edges { liquid, vapour, place, ten_ninety, steepest });
        let inside = points.iter().take_while(|p| p.0 < place - ten_ninety).count();
        let outside = points.iter().take_while(|p| p.0 <= place + ten_ninety).count();
        // An interface as wide as the flank leaves no plateau, and the quarters stand.
        if inside > 0 && outside < points.len() {
            (liquid, vapour) = (mean(&points[..inside]), mean(&points[outside..]));
        }
    }
    found
}

/// The place nearest to bin `from`, towards the centre, where the density has risen to `level`.
fn inwards(points: &[(f64, f64)], from: usize, level: f64) -> Option<f64> {
    let above = points[..=from].iter().rposition(|p| p.1 >= level)?;
    Some(between(points, above, level))
}

/// The place nearest to bin `from`, away from the centre, where the density has fallen to `level`.
fn outwards(points: &[(f64, f64)], from: usize, level: f64) -> Option<f64> {
    let below = from + points[from..].iter().position(|p| p.1 <= level)?;
    if below == 0 { None } else { Some(between(points, below - 1, level)) }
}

/// Where the straight line from bin `k` to the next crosses `level`.
fn between(points: &[(f64, f64)], k: usize, level: f64) -> f64 {
    let Some(next) = points.get(k + 1) else { return points[k].0 };
    let (fall, part) = (points[k].1 - next.1, points[k].1 - level);
    if fall > 0.0 {
        points[k].0 + (next.0 - points[k].0) * (part / fall).clamp(0.0, 1.0)
    } else {
        points[k].0
    }
}

/// The steepest fall of a line through some bins around any place of the interface.
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

    /// A hyperbolic tangent of d has w = 2d, and 2 artanh(0.8) d from 10 to 90 %; the line takes 2 % off its slope.
    #[test]
    fn a_tanh_has_its_widths() {
        let points = flank(100, 0.1, |s| 3.0 - 2.9 * ((s - 5.0) / 0.6).tanh());
        let found = edges(&points, 0.1).unwrap();
        assert!((found.place - 5.0).abs() < 0.01, "{found:?}");
        assert!((found.liquid - 5.9).abs() < 0.01 && (found.vapour - 0.1).abs() < 0.01, "{found:?}");
        assert!((found.ten_ninety - 2.0 * 0.8f64.atanh() * 0.6).abs() < 0.02, "{found:?}");
        assert!((found.steepest / 1.2 - 1.0).abs() < 0.04, "{found:?}");
    }

    /// A straight ramp and a liquid that is denser at its edge are no tangents, and have widths all the same.
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
