//! The density across a liquid slab, and the width of its interfaces.

use nalgebra::DMatrix;
use std::f64::consts::TAU;

use super::edges::{Edges, edges};
use super::error::ObserveError;
use crate::least_squares::least_squares_with;

/// If the mean of the unit vectors exp(2πi z/L) is shorter than this, it has no direction.
const LEAST_RESULTANT: f64 = 1e-10;

/// The smallest number of bins to which a flank is fitted.
const FLANK_BINS: usize = 6;

/// Moves fractions of a period so that the circular mean (1/2π) arg Σ exp(2πi s) of those that count is ½; false if they have
/// none. Unlike the plain mean it does not depend on where the boundary cuts the slab.
pub fn centre(fractions: &mut [f64], counts: impl Fn(usize) -> bool) -> bool {
    let (mut sine, mut cosine, mut count) = (0.0, 0.0, 0.0);
    for (_, s) in fractions.iter().enumerate().filter(|(k, _)| counts(*k)) {
        let (a, b) = (TAU * s).sin_cos();
        sine += a;
        cosine += b;
        count += 1.0;
    }
    // A species without particles has no centre either.
    let has_centre = f64::hypot(sine, cosine) > LEAST_RESULTANT * count;
    if has_centre {
        let centre = sine.atan2(cosine) / TAU;
        fractions.iter_mut().for_each(|s| *s += 0.5 - centre);
    }
    has_centre
}

/// Histograms of particle positions across a slab, in a periodic box of `length` (r_c) along z and cross-section `area` (r_c²).
/// Each frame is centred on its own slab so that drift does not smear the profile.
#[derive(Debug, Clone)]
pub struct ProfileAccumulator {
    length: f64,
    bins: usize,
    area: f64,
    frames: Vec<Vec<f64>>,
}

impl ProfileAccumulator {
    pub fn new(length: f64, bins: usize, area: f64) -> Self {
        Self { length, bins, area, frames: Vec::new() }
    }

    /// Adds a frame: the `z` (r_c) of all its particles, wrapped or unwrapped. A frame without a centre is left out.
    pub fn add(&mut self, z: &[f64]) -> Result<(), ObserveError> {
        let mut fractions: Vec<f64> = z.iter().map(|z| (z / self.length).fract()).collect();
        if !centre(&mut fractions, |_| true) {
            return Err(ObserveError::NoSlab);
        }
        let mut counts = vec![0.0; self.bins];
        for s in fractions {
            counts[((s.rem_euclid(1.0) * self.bins as f64) as usize).min(self.bins - 1)] += 1.0;
        }
        self.frames.push(counts);
        Ok(())
    }

    fn height(&self) -> f64 {
        self.length / self.bins as f64
    }

    /// The lower end of a bin, from the centre of the slab.
    fn low(&self, bin: usize) -> f64 {
        bin as f64 * self.height() - 0.5 * self.length
    }

    /// The middle of each bin from the centre of the slab, in (−L/2, L/2), increasing and evenly spaced (r_c), with the number
    /// density there (r_c⁻³): the mean of n/(A h) over the frames for n particles in the bin of height h.
    pub fn finish(&self) -> Vec<(f64, f64)> {
        let volume = self.area * self.height() * self.frames.len() as f64;
        let density = |bin: usize| self.frames.iter().map(|counts| counts[bin]).sum::<f64>() / volume;
        (0..self.bins).map(|bin| (self.low(bin) + 0.5 * self.height(), density(bin))).collect()
    }

    /// The number density (r_c⁻³) of each frame within `half_width` (r_c), at most L/2, of the centre of the slab. A bin that the
    /// limit cuts counts in proportion.
    pub fn liquid_density(&self, half_width: f64) -> Vec<f64> {
        let height = self.height();
        let inside = |bin: usize| {
            let low = self.low(bin);
            ((low + height).min(half_width) - low.max(-half_width)).max(0.0) / height
        };
        let weights: Vec<f64> = (0..self.bins).map(inside).collect();
        // The sum of the weights has the same rounding as the counts; the limits do not.
        let volume = self.area * height * weights.iter().sum::<f64>();
        let density =
            |counts: &Vec<f64>| counts.iter().zip(&weights).map(|(n, w)| n * w).sum::<f64>() / volume;
        self.frames.iter().map(density).collect()
    }
}

/// The width of the interfaces (r_c) of a profile as [`ProfileAccumulator::finish`] gives it, by Warren's definition (eq. 19),
/// w = (ρ_L − ρ_V) / max|dρ/dz|; the mean over the two flanks of the slab.
///
/// Differences of neighbouring bins would overrate the steepest slope in proportion to their noise. Instead all bins of
/// each flank are fitted by least squares, with equal weights, with
///
/// ρ(s) = (ρ_L + ρ_V)/2 − (ρ_L − ρ_V)/2 tanh((s − s₀)/d),
///
/// where s is the distance from the centre. The curve is averaged over the height of each bin so that coarse bins do not
/// widen the interface. Its steepest slope, at s₀, is (ρ_L − ρ_V)/2d, so that w = 2d. The fit averages over layers of the
/// liquid, so its ρ_L is not that of the plateau; see [`slab_edges`].
///
/// The result is `None` if the profile is not that of a slab centred on 0: fewer than six bins in a flank, values that are
/// not finite, no contrast of density, and interfaces beyond the flank, as wide as the flank, or narrower than one bin.
pub fn interface_width(profile: &[(f64, f64)]) -> Option<f64> {
    Some(interface(profile)?.width)
}

/// The parameters that [`interface_width`] fits to a flank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    pub liquid: f64,
    pub vapour: f64,
    /// The position s₀, from the centre.
    pub place: f64,
    /// The width w = 2d.
    pub width: f64,
}

/// The fit of [`interface_width`], as the mean of both flanks; `None` under the same conditions.
pub fn interface(profile: &[(f64, f64)]) -> Option<Interface> {
    interface_from(profile, None)
}

/// The same, of a search that begins at the fit to a profile that is almost the same.
pub fn interface_from(profile: &[(f64, f64)], start: Option<Interface>) -> Option<Interface> {
    let (height, flanks) = flanks(profile)?;
    let [a, b] = flanks.map(|points| flank_interface_from(&points, height, start));
    let (a, b) = (a?, b?);
    Some(Interface {
        liquid: 0.5 * (a.liquid + b.liquid),
        vapour: 0.5 * (a.vapour + b.vapour),
        place: 0.5 * (a.place + b.place),
        width: 0.5 * (a.width + b.width),
    })
}

/// The edges of both flanks without a fitted curve, as the mean of both; see [`edges`].
pub fn slab_edges(profile: &[(f64, f64)]) -> Option<Edges> {
    let (height, flanks) = flanks(profile)?;
    let [a, b] = flanks.map(|points| edges(&points, height));
    let (a, b) = (a?, b?);
    Some(Edges {
        liquid: 0.5 * (a.liquid + b.liquid),
        vapour: 0.5 * (a.vapour + b.vapour),
        doubt: [0, 1].map(|side| 0.5 * (a.doubt[side] + b.doubt[side])),
        place: 0.5 * (a.place + b.place),
        ten_ninety: 0.5 * (a.ten_ninety + b.ten_ninety),
        steepest: 0.5 * (a.steepest + b.steepest),
    })
}

/// A density against the distance from the centre, with increasing distances.
type Flank = Vec<(f64, f64)>;

/// The height of a bin, and both flanks.
fn flanks(profile: &[(f64, f64)]) -> Option<(f64, [Flank; 2])> {
    let count = profile.len();
    if count < 2 * FLANK_BINS || !profile.iter().all(|(z, rho)| z.is_finite() && rho.is_finite()) {
        return None;
    }
    let height = (profile[count - 1].0 - profile[0].0) / (count - 1) as f64;
    if !(height.is_finite() && height > 0.0) {
        return None;
    }
    let flank = |sign: f64| {
        // A middle bin at 0 belongs to neither flank.
        let points = profile.iter().map(|(z, rho)| (sign * z, *rho));
        let mut points: Vec<(f64, f64)> = points.filter(|(s, _)| *s > 0.25 * height).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    Some((height, [flank(1.0), flank(-1.0)]))
}

/// The fit to one flank, given as (distance from the centre, density) with distances that increase by `height`.
pub(super) fn flank_interface(points: &[(f64, f64)], height: f64) -> Option<Interface> {
    flank_interface_from(points, height, None)
}

fn flank_interface_from(points: &[(f64, f64)], height: f64, start: Option<Interface>) -> Option<Interface> {
    if points.len() < FLANK_BINS {
        return None;
    }
    let extent = points[points.len() - 1].0 + 0.5 * height;
    // The units are the bin height and the largest density.
    let scale = points.iter().fold(0.0_f64, |m, p| m.max(p.1.abs()));
    if scale == 0.0 {
        return None;
    }
    let scaled: Vec<(f64, f64)> = points.iter().map(|(s, rho)| (s / height, rho / scale)).collect();
    let extent = extent / height;
    let start = start.map_or_else(
        || sharp_step(&scaled, extent),
        |i| Some([i.liquid / scale, i.vapour / scale, i.place / height, (0.5 * i.width / height).ln()]),
    )?;
    let free = fit_flank(&scaled, start, true)?;
    // A density is never negative. If the fitted ρ_V is, the fit is repeated with ρ_V = 0.
    let fit = if free[1] < 0.0 { fit_flank(&scaled, free, false)? } else { free };
    let width = 2.0 * fit[3].exp();
    let slab = fit[0] > fit[1] && fit[2] > 0.0 && fit[2] < extent;
    (slab && width >= 1.0 && width < extent).then_some(Interface {
        liquid: fit[0] * scale,
        vapour: fit[1] * scale,
        place: fit[2] * height,
        width: width * height,
    })
}

/// A first guess of (ρ_L, ρ_V, s₀, ln d) with lengths in bins: a sharp step that holds as many particles.
fn sharp_step(points: &[(f64, f64)], extent: f64) -> Option<[f64; 4]> {
    let quarter = (points.len() / 4).max(1);
    let mean = |p: &[(f64, f64)]| p.iter().map(|p| p.1).sum::<f64>() / p.len() as f64;
    let (liquid, vapour) = (mean(&points[..quarter]), mean(&points[points.len() - quarter..]));
    let excess: f64 = points.iter().map(|p| p.1 - vapour).sum();
    let step = (excess / (liquid - vapour)).clamp(0.0, extent);
    (liquid > vapour).then(|| [liquid, vapour, step, (0.1 * extent).max(1.0).ln()])
}

/// The best (ρ_L, ρ_V, s₀, ln d) by a search from `start`; ρ_V is 0 unless it is `free`.
fn fit_flank(points: &[(f64, f64)], [l, v, p, w]: [f64; 4], free: bool) -> Option<[f64; 4]> {
    let start = if free { vec![l, v, p, w] } else { vec![l, p, w] };
    let all = |p: &[f64]| if free { [p[0], p[1], p[2], p[3]] } else { [p[0], 0.0, p[1], p[2]] };
    // The upper end of a bin is the lower end of the next.
    let first = points[0].0 - 0.5;
    let ends =
        |curve: &Curve| -> Vec<End> { (0..=points.len()).map(|k| curve.end(first + k as f64)).collect() };
    let residuals = |p: &[f64]| {
        let curve = Curve::of(all(p))?;
        Some(ends(&curve).array_windows().zip(points).map(|(bin, (_, rho))| curve.over(bin) - rho).collect())
    };
    let slopes = |p: &[f64]| {
        let curve = Curve::of(all(p))?;
        let ends = ends(&curve);
        let rows = ends.array_windows().map(|bin| curve.slopes(bin));
        let rows = rows.flat_map(|[l, v, p, w]| [l].into_iter().chain(free.then_some(v)).chain([p, w]));
        Some(DMatrix::from_row_iterator(points.len(), start.len(), rows))
    };
    Some(all(&least_squares_with(&start, residuals, slopes)?.0))
}

/// (ρ_L + ρ_V)/2 − (ρ_L − ρ_V)/2 tanh((s − s₀)/d), averaged over bins of height 1.
struct Curve {
    liquid: f64,
    vapour: f64,
    place: f64,
    d: f64,
}

impl Curve {
    /// The curve of ρ_L, ρ_V, s₀ and ln d; none if d is below a thousandth of a bin or above any box, where the curve no longer
    /// depends on d.
    fn of([liquid, vapour, place, width]: [f64; 4]) -> Option<Curve> {
        (-7.0..30.0).contains(&width).then(|| Curve { liquid, vapour, place, d: width.exp() })
    }

    fn end(&self, s: f64) -> End {
        let x = (s - self.place) / self.d;
        let rest = (-2.0 * x.abs()).exp();
        End { x, ln_cosh: x.abs() + rest.ln_1p(), tanh: ((1.0 - rest) / (1.0 + rest)).copysign(x) }
    }

    /// The mean of tanh over a bin, d [ln cosh b − ln cosh a].
    fn mean_tanh(&self, [a, b]: &[End; 2]) -> f64 {
        self.d * (b.ln_cosh - a.ln_cosh)
    }

    fn over(&self, bin: &[End; 2]) -> f64 {
        0.5 * (self.liquid + self.vapour) - 0.5 * (self.liquid - self.vapour) * self.mean_tanh(bin)
    }

    /// The derivatives with respect to ρ_L, ρ_V, s₀ and ln d.
    fn slopes(&self, bin: &[End; 2]) -> [f64; 4] {
        let (mean, [a, b]) = (self.mean_tanh(bin), bin);
        let half = 0.5 * (self.liquid - self.vapour);
        let by_width = mean - self.d * (b.x * b.tanh - a.x * a.tanh);
        [0.5 * (1.0 - mean), 0.5 * (1.0 + mean), half * (b.tanh - a.tanh), -half * by_width]
    }
}

/// An end of a bin.
#[derive(Clone, Copy)]
struct End {
    /// Its distance from s₀ in units of d.
    x: f64,
    /// ln cosh x + ln 2; only differences of it count.
    ln_cosh: f64,
    tanh: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::estimate;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    const LENGTH: f64 = 20.0;
    const AREA: f64 = 25.0;

    /// A slab of half-width 4 around `centre` with tanh flanks, liquid at 6 and vapour at 0.5, d = 0.4, made by rejection and
    /// wrapped into the box.
    fn slab(centre: f64, rng: &mut StdRng) -> Vec<f64> {
        // The number of trial points would fill the box at density 6.
        (0..3000)
            .filter_map(|_| {
                let s = LENGTH * (rng.random::<f64>() - 0.5);
                let rho = 3.25 - 2.75 * ((s.abs() - 4.0) / 0.4).tanh();
                (6.0 * rng.random::<f64>() < rho).then(|| (s + centre).rem_euclid(LENGTH))
            })
            .collect()
    }

    fn drifting(frames: usize) -> ProfileAccumulator {
        let mut rng = StdRng::seed_from_u64(24);
        let mut accumulator = ProfileAccumulator::new(LENGTH, 100, AREA);
        for frame in 0..frames {
            // The centre crosses the boundary several times.
            let centre = 0.37 * frame as f64;
            accumulator.add(&slab(centre, &mut rng)).unwrap();
        }
        accumulator
    }

    /// The density is within five of its own errors, a false alarm in 10⁶.
    #[test]
    fn drift_does_not_smear() {
        let accumulator = drifting(200);
        let liquid = estimate(&accumulator.liquid_density(2.5)).unwrap();
        assert!((liquid.mean - 6.0).abs() < 5.0 * liquid.error, "{liquid:?}");
        assert!(liquid.error < 0.03);
        let profile = accumulator.finish();
        let mean = profile.iter().map(|(_, rho)| rho).sum::<f64>() / 100.0;
        let particles = accumulator.liquid_density(LENGTH);
        let expected = particles.iter().sum::<f64>() / 200.0;
        assert!((mean - expected).abs() < 1e-9);
        let width = interface_width(&profile).unwrap();
        // The centre of 1500 particles is known only to some hundredths.
        assert!((width - 0.8).abs() < 0.06, "{width}");
    }

    #[test]
    fn width_of_an_exact_profile() {
        for bins in [60, 101, 400] {
            let height = LENGTH / f64::from(bins);
            let centres = (0..bins).map(|i| (f64::from(i) + 0.5) * height - 0.5 * LENGTH);
            let rho = |z: f64| 3.0 - 2.9 * ((z.abs() - 5.2) / 0.7).tanh();
            let density = |z: f64| {
                let fine = (0..100).map(|k| rho(z + ((f64::from(k) + 0.5) / 100.0 - 0.5) * height));
                fine.sum::<f64>() / 100.0
            };
            let profile: Vec<(f64, f64)> = centres.map(|z| (z, density(z))).collect();
            let width = interface_width(&profile).unwrap();
            assert!((width - 1.4).abs() < 1e-3, "{bins}: {width}");
            // Wherever the search begins.
            let begin = Interface { liquid: 5.0, vapour: 0.0, place: 4.5, width: 2.0 };
            let again = interface_from(&profile, Some(begin)).unwrap().width;
            assert!((again / width - 1.0).abs() < 1e-7, "{bins}: {width} {again}");
        }
    }

    /// An interface whose foot is cut off asks for a tangent below zero; the fitted density stays at or above zero.
    #[test]
    fn densities_are_not_negative() {
        let height = 0.1;
        let centres = (0..200).map(|i| (f64::from(i) + 0.5) * height - 10.0);
        let rho = |z: f64| (6.0 * ((6.5 - z.abs()) / 3.0).clamp(0.0, 1.0)).powf(1.2);
        let profile: Vec<(f64, f64)> = centres.map(|z| (z, rho(z))).collect();
        let found = interface(&profile).unwrap();
        assert!(found.vapour >= 0.0 && found.liquid > 0.0, "{found:?}");
        assert!(slab_edges(&profile).unwrap().vapour >= 0.0);
    }

    #[test]
    fn slopes_are_differences() {
        let at = [3.1, 0.2, 5.3, 0.4];
        let curve = |p: [f64; 4]| Curve::of(p).unwrap();
        let bin = |curve: &Curve, s: f64| [s - 0.5, s + 0.5].map(|end| curve.end(end));
        for s in [0.5, 3.5, 5.5, 7.5, 30.5] {
            let found = curve(at).slopes(&bin(&curve(at), s));
            for k in 0..4 {
                let beside = |h: f64| {
                    let mut at = at;
                    at[k] += h;
                    curve(at).over(&bin(&curve(at), s))
                };
                let expected = (beside(1e-5) - beside(-1e-5)) / 2e-5;
                assert!((found[k] - expected).abs() < 1e-9, "{s} {k}: {} {expected}", found[k]);
            }
        }
    }

    #[test]
    fn no_slab_no_width() {
        let flat = |rho: f64| (0..40).map(|i| (f64::from(i) - 19.5, rho)).collect::<Vec<_>>();
        for rho in [0.0, 3.0, f64::NAN] {
            assert_eq!(interface_width(&flat(rho)), None);
        }
        let mut step = flat(0.0);
        step[10..30].iter_mut().for_each(|(_, rho)| *rho = 6.0);
        assert_eq!(interface_width(&step), None);
        step.iter_mut().for_each(|(z, _)| *z = 1.0);
        assert_eq!(interface_width(&step), None);
        step.clear();
        assert_eq!(interface_width(&step), None);
    }

    #[test]
    fn bad_input_is_refused() {
        let mut accumulator = ProfileAccumulator::new(4.0, 8, 1.0);
        assert_eq!(interface_width(&accumulator.finish()), None);
        assert_eq!(accumulator.add(&[]), Err(ObserveError::NoSlab));
        assert_eq!(accumulator.add(&[0.0, 2.0]), Err(ObserveError::NoSlab));
        assert_eq!(accumulator.add(&[0.0, f64::INFINITY]), Err(ObserveError::NoSlab));
        assert!(accumulator.frames.is_empty());
        accumulator.add(&[1e300, -1e300, 0.3, 0.4]).unwrap();
        assert_eq!(accumulator.liquid_density(9.0), vec![1.0]);
    }

    proptest::proptest! {
        #[test]
        fn nothing_panics(
            centres in proptest::collection::vec(proptest::num::f64::ANY, 12..40),
            density in proptest::collection::vec(proptest::num::f64::ANY, 40),
            z in proptest::collection::vec(-1e3_f64..1e3, 1..30),
            length in proptest::num::f64::POSITIVE,
            cut in proptest::num::f64::ANY,
        ) {
            let bins = centres.len();
            let even = (0..bins).map(|i| i as f64 - 0.5 * (bins as f64 - 1.0)).collect();
            for centres in [centres, even] {
                let profile: Vec<(f64, f64)> = centres.into_iter().zip(density.iter().copied()).collect();
                let _ = interface_width(&profile);
            }
            let mut accumulator = ProfileAccumulator::new(length, bins, 1.0);
            for _ in 0..9 {
                let _ = accumulator.add(&z);
            }
            let _ = interface_width(&accumulator.finish());
            let _ = accumulator.liquid_density(cut);
        }
    }
}
