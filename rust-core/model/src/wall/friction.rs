//! The tensor of friction against the matter of a wall.

use super::integral::tensor;
use super::surface::Surface;

/// The tensor of friction by the distance from the surface.
#[derive(Debug, Clone)]
pub struct Friction {
    range: f64,
    /// The components at equal distances.
    nodes: Vec<[f64; 3]>,
}

/// By how much a fluid slips further than Brinkman's equation says, in ranges R: a constant, as next to a wall it has half of its
/// neighbours, and less viscosity; and a part for each `kT R²/(m ν²)`, ν being the kinematic viscosity, which goes as the share of
/// the momentum that moves with particles, past the friction.
/// Measured, see `docs/walls.md`.
pub const SURPLUS: [f64; 2] = [0.04, 0.0145];

/// The largest `kT R²/(m ν²)` for which that is taken.
const MOST_CARRIED: f64 = 20.0;

/// Number of intervals of the friction's table.
const INTERVALS: usize = 256;

impl Friction {
    /// The friction of matter of a number density behind a surface, by drag with the coefficient γ, the range and the exponent of `w_R`.
    pub fn of(
        surface: &Surface,
        dimensions: usize,
        density: f64,
        [gamma, range, exponent]: [f64; 3],
    ) -> Friction {
        let weight = |r: f64| {
            let w = (1.0 - r / range).max(0.0);
            if exponent == 1.0 { w * w } else { w.powf(2.0 * exponent) }
        };
        let tensor = tensor(surface, dimensions, range, weight);
        let node = |k: usize| tensor(range * k as f64 / INTERVALS as f64).map(|sum| density * gamma * sum);
        Friction { range, nodes: (0..=INTERVALS).map(node).collect() }
    }

    /// The distance from which on there is none.
    pub fn range(&self) -> f64 {
        self.range
    }

    /// The components along the surface, across it and around it at the distance `z`, in mass over time. Along a cylinder is along its
    /// axis; other surfaces have one component along them, and none of its own around them.
    pub fn at(&self, z: f64) -> [f64; 3] {
        if z >= self.range {
            return [0.0; 3];
        }
        let at = z.max(0.0) / self.range * INTERVALS as f64;
        let k = (at as usize).min(INTERVALS - 1);
        let t = at - k as f64;
        [0, 1, 2].map(|c| self.nodes[k][c] + t * (self.nodes[k + 1][c] - self.nodes[k][c]))
    }

    /// How far behind the face a flow in a fluid of this viscosity and density extrapolates to the velocity of the wall, by
    /// Brinkman's equation `η u″ = ρ ζ u`: the length of slip, negative where the wall holds a layer in front of the face.
    /// `factor` multiplies the friction.
    pub fn slip(&self, viscosity: f64, density: f64, factor: f64) -> f64 {
        let steps = 4 * INTERVALS;
        let h = self.range / steps as f64;
        let bend = |z: f64, u: f64| factor * density * self.at(z)[0] / viscosity * u;
        // In front of the face there is no stress at it: the face itself holds nothing back.
        let (mut u, mut slope) = (1.0, 0.0);
        for step in 0..steps {
            let z = step as f64 * h;
            let (a, b) = (slope, bend(z, u));
            let (c, d) = (slope + 0.5 * h * b, bend(z + 0.5 * h, u + 0.5 * h * a));
            let (e, f) = (slope + 0.5 * h * d, bend(z + 0.5 * h, u + 0.5 * h * c));
            let (g, i) = (slope + h * f, bend(z + h, u + h * e));
            u += h / 6.0 * (a + 2.0 * c + 2.0 * e + g);
            slope += h / 6.0 * (b + 2.0 * d + 2.0 * f + i);
            // Only their ratio matters.
            (u, slope) = (u / u.max(1.0), slope / u.max(1.0));
        }
        u / slope - self.range
    }

    /// The factor of the friction at which a fluid of this viscosity and density, whose particles have this temperature and mass,
    /// does not slip. By [`Friction::slip`] alone it would: that has [`SURPLUS`].
    pub fn factor_without_slip(&self, viscosity: f64, density: f64, [kt, mass]: [f64; 2]) -> f64 {
        let carried = kt / mass * (self.range * density * mass / viscosity).powi(2);
        let surplus = (SURPLUS[0] + SURPLUS[1] * carried.min(MOST_CARRIED)) * self.range;
        let (mut low, mut high) = (1e-9f64, 1e9f64);
        for _ in 0..80 {
            let middle = (low * high).sqrt();
            match self.slip(viscosity, density, middle) > -surplus {
                true => low = middle,
                false => high = middle,
            }
        }
        (low * high).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::integral::tests::sum_over_points;
    use super::super::surface::Round;
    use super::*;

    const FLAT: Surface = Surface::Face { axis: 0, high: false };

    /// The usual weight has a closed form: `ζ_zz = ρ_w γ ∫_z^1 2πh² [−ln h − 2(1 − h) + (1 − h²)/2] dh`, and the trace
    /// `ρ_w γ ∫_z^1 2π [1/12 − h²/2 + 2h³/3 − h⁴/4] dh`.
    #[test]
    fn friction_of_the_usual_weight_has_its_closed_form() {
        let friction = Friction::of(&FLAT, 3, 3.0, [4.5, 1.0, 1.0]);
        for z in [0.0f64, 0.1, 0.25, 0.5, 0.8] {
            let steps = 20000;
            let h = (1.0 - z) / f64::from(steps);
            let (mut across, mut trace) = (0.0, 0.0);
            for k in 0..steps {
                let t = z + (f64::from(k) + 0.5) * h;
                let two_pi = 2.0 * std::f64::consts::PI;
                across += h * two_pi * t * t * (-t.ln() - 2.0 * (1.0 - t) + 0.5 * (1.0 - t * t));
                trace += h * two_pi * (1.0 / 12.0 - t * t / 2.0 + 2.0 * t.powi(3) / 3.0 - t.powi(4) / 4.0);
            }
            let [along, found, _] = friction.at(z);
            assert!(
                (found - 13.5 * across).abs() < 1e-4 && (2.0 * along + found - 13.5 * trace).abs() < 1e-4
            );
        }
        assert_eq!(friction.at(1.0), [0.0; 3]);
    }

    /// Sums of `γ w_R² r̂ r̂` over a fine grid of points behind the face, in the plane and in space, for three exponents.
    #[test]
    fn friction_is_what_a_sum_over_points_is() {
        let (range, gamma, density) = (1.3, 2.5, 4.0);
        for dimensions in [2, 3] {
            for exponent in [0.25, 1.0, 1.5] {
                let friction = Friction::of(&FLAT, dimensions, density, [gamma, range, exponent]);
                for z in [0.0, 0.2, 0.7, 1.1] {
                    let (steps, mut sums) = (1000, [0.0; 2]);
                    let h = range / f64::from(steps);
                    for deep in 0..steps {
                        let depth = z + (f64::from(deep) + 0.5) * h;
                        for aside in 0..steps {
                            let y = (f64::from(aside) + 0.5) * h;
                            let r = depth.hypot(y);
                            let ring = if dimensions == 2 { 2.0 } else { 2.0 * std::f64::consts::PI * y };
                            let weight = density
                                * gamma
                                * ring
                                * h
                                * h
                                * (1.0 - r / range).max(0.0).powf(2.0 * exponent);
                            // On a ring half of y² is along each direction of the face.
                            sums[0] += weight * (y / r).powi(2) / (dimensions - 1) as f64;
                            sums[1] += weight * (depth / r).powi(2);
                        }
                    }
                    for (found, sum) in friction.at(z).into_iter().zip(sums) {
                        let off = (found - sum).abs() / friction.at(0.0)[0];
                        assert!(off < 1e-3, "{dimensions}-D, exponent {exponent}, {z}: {found} {sum}");
                    }
                }
            }
        }
    }

    /// The strength without slip is that of the same fluid in other units of mass, length and energy.
    #[test]
    fn the_strength_without_slip_has_no_units() {
        for dimensions in [2usize, 3] {
            let of = |mass: f64, length: f64, energy: f64| {
                let time = length * (mass / energy).sqrt();
                let per_volume = length.powi(-(dimensions as i32));
                let friction =
                    Friction::of(&FLAT, dimensions, 3.0 * per_volume, [4.5 * mass / time, length, 1.0]);
                let viscosity = 0.9 * energy * time * per_volume;
                friction.factor_without_slip(viscosity, 3.0 * per_volume, [0.7 * energy, 1.5 * mass])
            };
            let expected = of(1.0, 1.0, 1.0);
            for units in [[3.0, 1.0, 1.0], [1.0, 1.4, 1.0], [1.0, 1.0, 0.3], [0.4, 2.5, 1.7]] {
                let found = of(units[0], units[1], units[2]);
                assert!(
                    (found / expected - 1.0).abs() < 1e-9,
                    "{dimensions}-D {units:?}: {found} {expected}"
                );
            }
        }
    }

    /// Strong friction holds all within its range, weak friction next to nothing: in between one strength has no slip. Where ζ is
    /// weak the momentum that the face takes is ρ∫ζ u, and the length of slip η/ρ∫ζ less the mean place of the friction.
    #[test]
    fn one_strength_has_no_slip() {
        let friction = Friction::of(&FLAT, 3, 6.05, [18.0, 1.0, 1.0]);
        let (eta, rho, kt, mass) = (7.8, 6.05, 0.7, 3.0);
        let factor = friction.factor_without_slip(eta, rho, [kt, mass]);
        let surplus = SURPLUS[0] + SURPLUS[1] * kt / mass * (mass * rho / eta).powi(2);
        assert!((friction.slip(eta, rho, factor) + surplus).abs() < 1e-9 && factor > 1.0, "{factor}");
        let (mut sum, mut place) = (0.0, 0.0);
        for k in 0..1000 {
            let z = (f64::from(k) + 0.5) / 1000.0;
            (sum, place) = (sum + friction.at(z)[0] / 1000.0, place + z * friction.at(z)[0] / 1000.0);
        }
        let weak = 1e-3;
        let expected = eta / (weak * rho * sum) - place / sum;
        assert!((friction.slip(eta, rho, weak) / expected - 1.0).abs() < 1e-3);
        assert!(friction.slip(eta, rho, 1e6) < -0.5);
    }

    /// Sums of `γ w_R² r̂ r̂` over fine points behind round surfaces: along the axis, across the surface and around it.
    #[test]
    fn friction_of_round_walls_is_what_a_sum_over_points_is() {
        for (dimensions, directions) in [(2, 2), (3, 3), (3, 2)] {
            for (radius, inside) in [(1.0, true), (1.6, true), (1.0, false), (1.6, false)] {
                let across = [true, true, directions == 3];
                let surface = Surface::Round(Round { across, center: [0.0; 3], radius, inside });
                let friction = Friction::of(&surface, dimensions, 4.0, [2.5, 1.0, 1.0]);
                for z in [0.0, 0.2, 0.6] {
                    let mut sums = [0.0; 3];
                    sum_over_points(dimensions, &surface, z, |d, r, weight| {
                        let weight = 10.0 * weight * (1.0 - r).powi(2);
                        (0..3).for_each(|c| sums[c] += weight * (d[c] / r).powi(2));
                    });
                    if directions == 3 {
                        sums[2] *= 0.5;
                    }
                    if directions == dimensions {
                        sums[0] = sums[2];
                    }
                    for (found, sum) in friction.at(z).into_iter().zip(sums) {
                        let off = (found - sum).abs() / friction.at(0.0)[0];
                        assert!(off < 2e-3, "{dimensions}-D {surface:?} {z}: {found} {sum}");
                    }
                }
            }
        }
    }
}
