//! What is known of the fluid before it runs.

use super::fluid::Strengths;
use super::sheet::Goals;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Warren's equation of state (Phys. Rev. E 68, 066702 (2003), eq. 18), `p = ρ + αAρ² + 2αB r_d⁴ (ρ³ − cρ² + d)`.
const ALPHA: f64 = 0.101;
const C: f64 = 4.16;
const D: f64 = 18.0;

/// Tension, strength and density of his set 6; between that and set 5 it grows with this power of the density.
const TENSION: f64 = 7.45;
const ATTRACTION: f64 = -40.0;
const DENSITY: f64 = 6.05;
const POWER: f64 = 2.3;

/// How much of A a c₁ takes away in the tension: 0 to 3 in fluids with c₁ of 0.5 to 4.3.
const REACH: f64 = 1.5;

/// What the theory says of the liquid at a density: pressure, ∂p/∂ρ and tension, and in rows their slopes by A, c₁ and c₂.
///
/// The pressure is that of Warren, who measured what mean field has not: in these fluids correlations take away half of the pressure. The
/// part of c₁ is that of mean field, with Warren's α. The tension grows as the square of the attraction, and is that of the liquid in
/// its vapour: with a pressure at `density` it is thinner by p/(ρ ∂p/∂ρ), and its tension less.
pub fn theory(at: &Strengths, density: f64) -> ([f64; 3], [[f64; 3]; 3]) {
    let rho = density;
    let share = 30.0 / PI * ALPHA;
    let pressures = [ALPHA * rho * rho, share * rho * rho, 2.0 * share * (rho.powi(3) - C * rho * rho + D)];
    let stiffnesses = [2.0 * ALPHA * rho, 2.0 * share * rho, 2.0 * share * (3.0 * rho * rho - 2.0 * C * rho)];
    let sum = |of: [f64; 3]| of.iter().zip(at.array()).map(|(slope, x)| slope * x).sum::<f64>();
    let (pressure, stiffness) = (rho + sum(pressures), 1.0 + sum(stiffnesses));
    let attraction = (at.attraction + REACH * at.linear).min(-1.0);
    let dense = TENSION * (attraction / ATTRACTION).powi(2) * (rho / DENSITY).powf(POWER);
    let by_pressure = POWER / (rho * stiffness.max(5.0));
    let thinner = (1.0 - by_pressure * pressure).clamp(0.2, 2.0);
    let slope = 2.0 * dense / attraction * thinner;
    let own = [slope, REACH * slope, 0.0];
    let tensions = std::array::from_fn(|k| own[k] - by_pressure * dense * pressures[k]);
    ([pressure, stiffness, dense * thinner], [pressures, stiffnesses, tensions])
}

/// Which strengths are free: as many as there are goals.
pub fn free(goals: &Goals) -> [bool; 3] {
    let count = usize::from(goals.stiffness.is_some()) + usize::from(goals.tension.is_some());
    [count > 0, count > 1, true]
}

/// The strengths that have the goals by the theory.
pub fn start(goals: &Goals) -> Strengths {
    let per_density = (goals.density / DENSITY).powf(POWER);
    let of_tension = |tension: f64| ATTRACTION * (tension / (TENSION * per_density)).sqrt();
    let attraction = match (goals.tension, goals.stiffness) {
        (Some(tension), Some(stiffness)) => {
            let (_, [pressure, slopes, _]) = theory(&Strengths::of([0.0; 3]), goals.density);
            let matrix = Matrix3::from_row_slice(&[pressure, slopes, [1.0, REACH, 0.0]].concat());
            let wanted = Vector3::new(-goals.density, stiffness - 1.0, of_tension(tension));
            if let Some(found) = matrix.lu().solve(&wanted) {
                return Strengths::of([found[0].clamp(-150.0, -5.0), found[1], found[2].max(0.01)]);
            }
            of_tension(tension)
        }
        (Some(tension), None) => of_tension(tension),
        // Without c₁ and at no pressure the stiffness is linear in A.
        (None, Some(stiffness)) => {
            let of = |attraction: f64| theory(&at_no_pressure(attraction, goals.density), goals.density).0[1];
            let (low, high) = (of(-20.0), of(-60.0));
            -20.0 - 40.0 * (stiffness - low) / (high - low)
        }
        (None, None) => ATTRACTION,
    };
    at_no_pressure(attraction.clamp(-150.0, -5.0), goals.density)
}

fn at_no_pressure(attraction: f64, density: f64) -> Strengths {
    let without = Strengths { attraction, linear: 0.0, square: 0.0 };
    let (values, slopes) = theory(&without, density);
    Strengths { square: -values[0] / slopes[0][2], ..without }
}
