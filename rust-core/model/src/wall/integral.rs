//! Integrals of a radial function over the part of space, or of the plane, that lies behind a surface.
//!
//! At the distance z from the surface
//!
//! ```text
//! H(z) = ∫_z^R f(r) r^(d−1) A(p) dr,    A(p) = 2π (1 − p) in space, 2 arccos p in the plane,
//! ```
//!
//! where `A` is the solid angle, or the angle, under which the matter is seen at the distance r, and p the cosine of the edge of what is
//! seen: z/r for a half-space, ∓(c² + r² − a²)/2cr for a sphere or a circle of the radius a whose centre is c away, with the fluid inside or
//! outside. A cylinder adds to f what f adds to the plane across its axis, `∫ f(√(ρ² + y²)) dy`: it is a circle of that function. One
//! quadrature serves every surface, every kernel and every pair form.

use super::surface::{Round, Surface};
use std::f64::consts::PI;

/// Number of panels of a table.
const PANELS: usize = 128;

/// The integral of a function over the matter behind a surface, by the distance from it, as a table of polynomials of fifth degree that
/// have its value, slope and curvature at the ends of every panel. Value and slope belong together exactly.
#[derive(Debug, Clone)]
pub struct MatterIntegral {
    range: f64,
    panels: Vec<[f64; 6]>,
}

impl MatterIntegral {
    /// The integral over a half-space of `factor` times `f`, whose value and slope are `f(r)`, and which is zero beyond its `range`.
    /// `None` if it is not finite, as that of a potential with a hard core.
    pub fn of(
        dimensions: usize,
        range: f64,
        factor: f64,
        f: impl Fn(f64) -> (f64, f64),
    ) -> Option<MatterIntegral> {
        MatterIntegral::table((dimensions, None), range, factor, f)
    }

    /// The same over the matter behind a surface, whose radius is no smaller than the range.
    pub fn behind(
        surface: &Surface,
        dimensions: usize,
        range: f64,
        factor: f64,
        f: impl Fn(f64) -> (f64, f64),
    ) -> Option<MatterIntegral> {
        match surface {
            Surface::Round(round) if round.directions() < dimensions => {
                let along = |rho: f64| projection(range, rho, |r| f(r).0);
                let across = Profile::of(range, along);
                let hard = !f(0.0).0.is_finite();
                if hard {
                    None
                } else {
                    MatterIntegral::table((2, Some(round)), range, factor, |r| across.at(r))
                }
            }
            _ => MatterIntegral::table((dimensions, surface.round()), range, factor, f),
        }
    }

    fn table(
        seen: (usize, Option<&Round>),
        range: f64,
        factor: f64,
        f: impl Fn(f64) -> (f64, f64),
    ) -> Option<MatterIntegral> {
        let node = |k: usize| derivatives(seen, range, range * k as f64 / PANELS as f64, &f);
        let nodes: Vec<[f64; 3]> = (0..=PANELS).map(|k| node(k).map(|x| factor * x)).collect();
        let h = range / PANELS as f64;
        let panels = nodes.windows(2).map(|ends| panel(ends[0], ends[1], h)).collect();
        let is_finite = f(0.0).0.is_finite() && nodes.iter().flatten().all(|x| x.is_finite());
        is_finite.then_some(MatterIntegral { range, panels })
    }

    /// The integral times a number.
    pub fn times(&self, factor: f64) -> MatterIntegral {
        let panels = self.panels.iter().map(|panel| panel.map(|a| factor * a)).collect();
        MatterIntegral { panels, ..*self }
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

/// What is seen of the matter at the distance `r` from a place at the distance `z` from the surface: by the cosine p of its edge.
struct View {
    cosine: f64,
    /// 1 − p.
    rest: f64,
    /// √(1 − p²).
    sine: f64,
    /// arccos p.
    angle: f64,
    /// r ∂p/∂z.
    turn: f64,
    /// r ∂²p/∂z².
    bend: f64,
}

fn view(round: Option<&Round>, z: f64, r: f64) -> View {
    let Some(round) = round else {
        let (cosine, sine) = (z / r, ((r - z) * (r + z)).sqrt() / r);
        return View { cosine, rest: 1.0 - cosine, sine, angle: cosine.acos(), turn: 1.0, bend: 0.0 };
    };
    let (a, side) = (round.radius, round.side());
    let c = a - side * z;
    let rest = (r - z) * (a + c + side * r) / (2.0 * c * r);
    View {
        cosine: 1.0 - rest,
        rest,
        sine: (rest * (2.0 - rest)).sqrt(),
        angle: 2.0 * (0.5 * rest).sqrt().asin(),
        turn: (c * c + (a - r) * (a + r)) / (2.0 * c * c),
        bend: side * (a - r) * (a + r) / (c * c * c),
    }
}

/// `H`, `H′` and `H″` at `z`.
fn derivatives(
    (dimensions, round): (usize, Option<&Round>),
    range: f64,
    z: f64,
    f: &impl Fn(f64) -> (f64, f64),
) -> [f64; 3] {
    if z >= range {
        return [0.0; 3];
    }
    let mut sums = [0.0; 3];
    behind(range, z, |r, dr| {
        let (value, slope) = f(r);
        let View { cosine, rest, sine, angle, turn, bend } = view(round, z, r);
        match dimensions {
            2 => {
                sums[0] += dr * value * r * 2.0 * angle;
                sums[1] -= dr * value * 2.0 / sine * turn;
                sums[2] -= dr * slope * 2.0 * cosine / sine * turn;
            }
            _ => {
                sums[0] += dr * value * r * r * 2.0 * PI * rest;
                sums[1] -= dr * value * r * 2.0 * PI * turn;
                sums[2] -= dr * value * r * 2.0 * PI * bend;
            }
        }
    });
    if dimensions == 3 {
        sums[2] += 2.0 * PI * z * f(z).0 * view(round, z, z).turn;
    }
    sums
}

/// The tensor of `f r̂ r̂` over the matter behind a surface: the components along it, across it, and around a cylinder, where along is along the
/// axis.
pub(super) fn tensor(
    surface: &Surface,
    dimensions: usize,
    range: f64,
    f: impl Fn(f64) -> f64,
) -> impl Fn(f64) -> [f64; 3] {
    let round = surface.round().copied();
    let projected = round.filter(|round| round.directions() < dimensions).map(|_| {
        let of = |rho: f64, r: f64| (rho / r).powi(2);
        let across = Profile::of(range, |rho| {
            projection(range, rho, |r| if r > 0.0 { f(r) * of(rho, r) } else { 0.0 })
        });
        let along = Profile::of(range, |rho| {
            projection(range, rho, |r| if r > 0.0 { f(r) * (1.0 - of(rho, r)) } else { f(r) })
        });
        [across, along]
    });
    let seen = if projected.is_some() { 2 } else { dimensions };
    move |z: f64| {
        if z >= range {
            return [0.0; 3];
        }
        let (mut sums, mut axial) = ([0.0; 2], 0.0);
        behind(range, z, |r, dr| {
            let View { cosine: c, rest, sine, angle, .. } = view(round.as_ref(), z, r);
            let (whole, across) = match seen {
                2 => (2.0 * angle, angle + sine * c),
                _ => (2.0 * PI * rest, 2.0 * PI / 3.0 * (1.0 - c * c * c)),
            };
            let of_ring = |f: f64| dr * f * r.powi(seen as i32 - 1);
            let weight = match &projected {
                None => of_ring(f(r)),
                Some([across, along]) => {
                    axial += of_ring(along.at(r).0) * whole;
                    of_ring(across.at(r).0)
                }
            };
            sums[0] += weight * (whole - across) / (seen - 1) as f64;
            sums[1] += weight * across;
        });
        [if projected.is_some() { axial } else { sums[0] }, sums[1], sums[0]]
    }
}

/// `∫ f(√(ρ² + y²)) dy`, the integral of a function along a line at the distance `rho`.
fn projection(range: f64, rho: f64, f: impl Fn(f64) -> f64) -> f64 {
    let mut sum = 0.0;
    if rho < range {
        behind(range, rho, |r, dr| sum += dr * f(r) * 2.0 * r / ((r - rho) * (r + rho)).sqrt());
    }
    sum
}

/// A function of the distance as cubic polynomials, which is even at 0 and zero beyond its range.
struct Profile {
    range: f64,
    nodes: Vec<f64>,
}

impl Profile {
    const PANELS: usize = 1024;

    fn of(range: f64, f: impl Fn(f64) -> f64) -> Profile {
        let node = |k: usize| f(range * k as f64 / Profile::PANELS as f64);
        Profile { range, nodes: (0..=Profile::PANELS).map(node).collect() }
    }

    /// Value and slope.
    fn at(&self, r: f64) -> (f64, f64) {
        if r >= self.range {
            return (0.0, 0.0);
        }
        let per_length = Profile::PANELS as f64 / self.range;
        let k = ((r * per_length) as usize).min(Profile::PANELS - 1);
        let t = r * per_length - k as f64;
        let node = |k: usize| self.nodes.get(k).copied().unwrap_or(0.0);
        let [before, a, b, after] = [node(k.abs_diff(1)), node(k), node(k + 1), node(k + 2)];
        let [p, q] = [0.5 * (b - before), 0.5 * (after - a)];
        let (second, third) = (3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q);
        (a + t * (p + t * (second + t * third)), (p + t * (2.0 * second + 3.0 * t * third)) * per_length)
    }
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
pub(super) mod tests {
    use super::*;
    use crate::kernel::{Kernel, KernelKind};

    /// In space the quadratic kernel has a closed form, and so has the soft pair form, which has its shape.
    #[test]
    fn the_quadratic_kernel_has_its_closed_form() {
        for range in [0.75, 1.3] {
            let w = Kernel::new(KernelKind::from_name("quadratic").unwrap(), range, 3);
            let found = MatterIntegral::of(3, range, 6.05, |r| (w.value(r), w.slope(r))).unwrap();
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
                let found = MatterIntegral::of(dimensions, 1.0, 1.0, |r| (w.value(r), w.slope(r))).unwrap();
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
        assert!(MatterIntegral::of(3, 1.0, 1.0, |r| (1.0 / (r * r * r) - 1.0, -3.0 / r.powi(4))).is_none());
    }

    fn round(directions: usize, radius: f64, inside: bool) -> Surface {
        let across = [true, true, directions == 3];
        Surface::Round(Round { across, center: [0.0; 3], radius, inside })
    }

    /// Circles, spheres and cylinders, of the smallest radius and wider, with the fluid inside and outside.
    fn rounds() -> impl Iterator<Item = (usize, Surface)> {
        let kinds = [(2, 2), (3, 3), (3, 2)].into_iter();
        let radii = kinds.flat_map(|kind| [1.0, 1.7].map(|radius| (kind, radius)));
        radii.flat_map(|((dimensions, directions), radius)| {
            [true, false].map(|inside| (dimensions, round(directions, radius, inside)))
        })
    }

    /// The sum of a function of the vector from the particle over fine points of the matter, in polar coordinates around the centre of
    /// the surface: along the axis, across the surface, around it, and the distance. On the rings of a sphere half is around.
    pub(in crate::wall) fn sum_over_points(
        dimensions: usize,
        surface: &Surface,
        z: f64,
        mut add: impl FnMut([f64; 3], f64, f64),
    ) {
        let Round { radius, inside, .. } = *surface.round().unwrap();
        let (directions, c) =
            (surface.round().unwrap().directions(), radius - surface.round().unwrap().side() * z);
        let (layers, turns) = if directions < dimensions { (100, 120) } else { (500, 600) };
        let widest = if c.min(radius) < 1.2 { PI } else { 1.4 / c.min(radius) };
        let along = if directions < dimensions { 100 } else { 1 };
        let depth = if inside { 1.0 } else { radius.min(1.0) };
        for (layer, turn) in (0..layers).flat_map(|layer| (0..turns).map(move |turn| (layer, turn))) {
            let deep = depth * (f64::from(layer) + 0.5) / f64::from(layers);
            let rho = if inside { radius + deep } else { radius - deep };
            let angle = widest * (f64::from(turn) + 0.5) / f64::from(turns);
            let d = [rho * angle.cos() - c, rho * angle.sin()];
            let area = rho * depth / f64::from(layers) * widest / f64::from(turns);
            let ring = if directions == 3 { 2.0 * PI * d[1] } else { 2.0 };
            for k in 0..along {
                let (y, length) = if along == 1 { (0.0, 1.0) } else { ((f64::from(k) + 0.5) / 100.0, 0.02) };
                let r = d[0].hypot(d[1]).hypot(y);
                if r < 1.0 {
                    add([y, d[0], d[1]], r, area * ring * length);
                }
            }
        }
    }

    /// Values are sums over fine points; slopes and curvatures belong to them.
    #[test]
    fn matter_behind_round_surfaces_is_what_a_sum_over_points_is() {
        for name in ["quadratic", "lucy", "cubic-spline"] {
            let kind = KernelKind::from_name(name).unwrap();
            for (dimensions, surface) in rounds() {
                let w = Kernel::new(kind, 1.0, dimensions);
                let found =
                    MatterIntegral::behind(&surface, dimensions, 1.0, 3.0, |r| (w.value(r), w.slope(r)))
                        .unwrap();
                for z in [0.0, 0.013, 0.3, 0.77] {
                    let mut sum = 0.0;
                    sum_over_points(dimensions, &surface, z, |_, r, weight| sum += 3.0 * weight * w.value(r));
                    let off = found.at(z)[0] - sum;
                    assert!(
                        off.abs() < 6e-4 && (z > 0.5 || sum > 0.02),
                        "{name} {dimensions} {surface:?} {z}: {sum} {off}"
                    );
                }
                for z in [0.004, 0.1, 0.33, 0.6, 0.9] {
                    let h = 1e-5;
                    let [up, here, down] = [z + h, z, z - h].map(|z| found.at(z));
                    assert!(((up[0] - down[0]) / (2.0 * h) - here[1]).abs() < 1e-8);
                    let bend = (up[1] - down[1]) / (2.0 * h);
                    assert!((bend - here[2]).abs() < 2e-5 * (1.0 + here[2].abs()), "{bend} {}", here[2]);
                }
            }
        }
    }

    /// Value, slope and curvature of the quadrature, of which the table is made, are derivatives of each other, and what is not behind a
    /// surface is behind that of which the other side is the fluid.
    #[test]
    fn round_surfaces_share_all_matter() {
        for (dimensions, directions) in [(2, 2), (3, 3), (3, 2)] {
            let w = Kernel::new(KernelKind::from_name("quadratic").unwrap(), 1.0, dimensions);
            let f = |r: f64| (w.value(r), w.slope(r));
            for radius in [1.0, 2.3] {
                let [inside, outside] = [true, false].map(|side| {
                    MatterIntegral::behind(&round(directions, radius, side), dimensions, 1.0, 1.0, f).unwrap()
                });
                let all = inside.at(0.0)[0] + outside.at(0.0)[0];
                assert!((all - 1.0).abs() < 1e-7 && inside.at(0.0)[0] > 0.52, "{dimensions} {radius}: {all}");
                assert_eq!(inside.at(1.0), [0.0; 3]);
                if directions < dimensions {
                    continue;
                }
                for side in [true, false] {
                    let surface = round(directions, radius, side);
                    let at = |z: f64| derivatives((dimensions, surface.round()), 1.0, z, &f);
                    for z in [0.05, 0.3, 0.7] {
                        let h = 1e-4;
                        let [up, here, down] = [z + h, z, z - h].map(at);
                        for k in 0..2 {
                            let slope = (up[k] - down[k]) / (2.0 * h);
                            assert!(
                                (slope - here[k + 1]).abs() < 1e-5,
                                "{radius} {side} {z} {k}: {slope} {here:?}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// A wide surface is plane: what is left falls with the radius.
    #[test]
    fn wide_surfaces_are_plane() {
        for (dimensions, directions) in [(2, 2), (3, 3), (3, 2)] {
            let w = Kernel::new(KernelKind::from_name("lucy").unwrap(), 1.0, dimensions);
            let f = |r: f64| (w.value(r), w.slope(r));
            let plane = MatterIntegral::of(dimensions, 1.0, 1.0, f).unwrap();
            for side in [true, false] {
                let wide = |radius: f64| {
                    MatterIntegral::behind(&round(directions, radius, side), dimensions, 1.0, 1.0, f).unwrap()
                };
                let (wide, wider) = (wide(100.0), wide(10_000.0));
                for z in [0.0, 0.2, 0.6] {
                    for k in 0..3 {
                        let [off, less] = [&wide, &wider].map(|table| table.at(z)[k] - plane.at(z)[k]);
                        assert!(
                            (less - 0.01 * off).abs() < 1e-4 * off.abs() + 1e-5,
                            "{dimensions} {side} {z} {k}: {off} {less}"
                        );
                        assert!(off.abs() < 0.05 && (k > 0 || off.abs() > 1e-5), "{off}");
                    }
                }
            }
        }
    }
}
