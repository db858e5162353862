//! Measured viscosities of usual fluids against drag.
//!
//! Kinetic theory of particles that are not correlated, η = 45 kT/(4πγr_c³) + 2πγρ²r_c⁵/1575, is several times too high at strong drag.
//! So nothing is computed here: a fluid of the table has what was measured at its drag, or between rows what lies between them, and
//! nothing is said of other fluids and beyond the rows. In units of r_c, kT and the mass m.

use psidpd_core::model::Fluid;
use psidpd_core::model::pair::PairPotential;
use psidpd_dynamics::freezing::warren;
use psidpd_dynamics::integrator::Integrator;
use psidpd_dynamics::scene::Scene;
use serde::Serialize;

/// A value and its error.
type Value = [f64; 2];

/// What periodic Poiseuille flow and mean square displacements gave at a drag.
struct Row {
    gamma: f64,
    viscosity: Value,
    diffusion: Option<Value>,
}

const fn row(gamma: f64, viscosity: Value, diffusion: Option<Value>) -> Row {
    Row { gamma, viscosity, diffusion }
}

struct Usual {
    name: &'static str,
    /// a r_c/kT of the soft force a (1 − r/r_c).
    strength: f64,
    /// B/(kT r_c²) of the force B (n_i + n_j) (1 − r/r_d) with r_d = 0.75 r_c.
    many_body: f64,
    density: f64,
    /// By rising drag.
    rows: &'static [Row],
}

const USUAL: &[Usual] = &[
    Usual {
        name: "no forces",
        strength: 0.0,
        many_body: 0.0,
        density: 3.0,
        rows: &[
            // Below, the paths of particles are as long as the flow is wide: at 1 it gave 2.74, 3.52 and 3.85 at heights 12, 24 and 48.
            row(4.5, [1.312, 0.008], Some([0.710, 0.001])),
            row(18.0, [0.958, 0.009], Some([0.2864, 0.0005])),
            row(100.0, [1.664, 0.010], Some([0.098, 0.001])),
            row(300.0, [3.40, 0.03], Some([0.0452, 0.0003])),
            row(1000.0, [9.1, 0.2], Some([0.0158, 0.0002])),
        ],
    },
    Usual {
        name: "standard DPD, a = 25",
        strength: 25.0,
        many_body: 0.0,
        density: 3.0,
        rows: &[
            row(1.0, [0.774, 0.007], Some([0.330, 0.001])),
            row(4.5, [0.838, 0.007], Some([0.294, 0.001])),
            row(18.0, [1.095, 0.002], Some([0.210, 0.001])),
            row(100.0, [2.578, 0.006], Some([0.0861, 0.0003])),
            row(300.0, [5.81, 0.02], Some([0.0375, 0.0002])),
            row(1000.0, [17.04, 0.05], Some([0.0125, 0.0001])),
        ],
    },
    Usual {
        name: "Warren's liquid, A = −40, B = 25",
        strength: -40.0,
        many_body: 25.0,
        density: 6.05,
        rows: &[
            row(4.5, [5.53, 0.13], Some([0.0505, 0.0005])),
            row(18.0, [7.95, 0.08], Some([0.0359, 0.0007])),
            row(50.0, [13.74, 0.14], Some([0.0206, 0.0003])),
            row(100.0, [23.8, 0.4], Some([0.0121, 0.0003])),
        ],
    },
    Usual {
        name: "Warren's liquid, A = −40, B = 40",
        strength: -40.0,
        many_body: 40.0,
        density: 5.08,
        rows: &[
            row(4.5, [7.12, 0.10], Some([0.0378, 0.0003])),
            row(18.0, [8.82, 0.13], Some([0.0298, 0.0003])),
            row(50.0, [13.25, 0.10], Some([0.0195, 0.0002])),
            row(100.0, [20.18, 0.10], Some([0.0126, 0.0002])),
        ],
    },
];

/// Strengths and densities that differ by less are the same.
const SAME: f64 = 0.01;

/// Shear thinning, and the finite size of the boxes: a relative error beside those of the table.
const SYSTEMATIC: f64 = 0.05;

/// The guide's values for a fluid, in its own units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Flow {
    /// The fluid of the table, and its density.
    pub fluid: &'static str,
    pub density: f64,
    pub gamma: f64,
    /// η, D and Sc = η/ρmD, each with its error.
    pub viscosity: Value,
    pub diffusion: Option<Value>,
    pub schmidt: Option<Value>,
    /// Whether the drag is between two of the table.
    pub interpolated: bool,
}

/// The measured viscosity of the fluid of a scene at its density, if all its stages have the drag of the model.
pub fn flow_of_scene(scene: &Scene) -> Option<Flow> {
    let drags = |i: &Integrator| !matches!(i, Integrator::LoweAndersen | Integrator::MonteCarlo { .. });
    let usual = scene.stages.iter().all(|s| s.thermostat && s.kt == scene.kt && drags(&s.integrator));
    let ([mass], [density]) = (&scene.mass[..], &scene.densities()[..]) else { return None };
    usual.then(|| flow(&scene.model.at(scene.kt).ok()?, *mass, Some(*density)))?
}

/// The measured viscosity of a fluid of particles of a mass; without a density, at that of the table.
pub fn flow(fluid: &Fluid, mass: f64, density: Option<f64>) -> Option<Flow> {
    let [Some(drag)] = &fluid.thermostats[..] else { return None };
    let (strength, many_body, range) = forces(fluid, drag.range)?;
    if fluid.dimensions != 3 || drag.exponent != 1.0 || (drag.range / range - 1.0).abs() > 1e-9 {
        return None;
    }
    let near = |x: f64, y: f64| (x - y).abs() <= SAME * y.abs();
    let same = |usual: &&Usual| {
        near(strength, usual.strength)
            && near(many_body, usual.many_body)
            && density.is_none_or(|rho| near(rho * range.powi(3), usual.density))
    };
    let usual = USUAL.iter().find(same)?;
    let speed = (fluid.kt / mass).sqrt();
    let gamma = drag.gamma * range / (mass * speed);
    let interpolated = !usual.rows.iter().any(|row| row.is_at(gamma));
    let widened = |[x, error]: Value| [x, error.hypot(SYSTEMATIC * x)];
    let viscosity = widened(between(usual.rows, gamma, |row| Some(row.viscosity))?);
    let diffusion = between(usual.rows, gamma, |row| row.diffusion).map(widened);
    let times = |value: Value, unit: f64| value.map(|x| x * unit);
    Some(Flow {
        fluid: usual.name,
        density: usual.density / range.powi(3),
        gamma: drag.gamma,
        viscosity: times(viscosity, mass * speed / (range * range)),
        diffusion: diffusion.map(|d| times(d, range * speed)),
        schmidt: diffusion.map(|d| schmidt(viscosity, d, usual.density)),
        interpolated,
    })
}

/// η/ρD in units of the table.
fn schmidt(viscosity: Value, diffusion: Value, density: f64) -> Value {
    let value = viscosity[0] / diffusion[0] / density;
    [value, value * (viscosity[1] / viscosity[0]).hypot(diffusion[1] / diffusion[0])]
}

/// The strengths of the soft and of the many-body force of a fluid that has no others, and their range; without forces that of the drag.
fn forces(fluid: &Fluid, drag: f64) -> Option<(f64, f64, f64)> {
    if let Some([a, b, range]) = warren(fluid) {
        return Some((a * range / fluid.kt, b / (fluid.kt * range * range), range));
    }
    match (&fluid.densities[..], &fluid.pairs[..]) {
        ([], []) => Some((0.0, 0.0, drag)),
        ([], [pair]) => {
            let PairPotential::Soft(soft) = &pair.potential else { return None };
            let range = if soft.strength == 0.0 { drag } else { soft.range };
            Some((soft.strength * range / fluid.kt, 0.0, range))
        }
        _ => None,
    }
}

impl Row {
    fn is_at(&self, gamma: f64) -> bool {
        (self.gamma / gamma - 1.0).abs() < 1e-9
    }
}

/// A value at a drag: that of a row, or between rows the straight line in logarithms. The distance of the line from the parabola through
/// a third row is part of the error, so nothing is said between two rows alone.
fn between(rows: &[Row], gamma: f64, of: impl Fn(&Row) -> Option<Value>) -> Option<Value> {
    if let Some(row) = rows.iter().find(|row| row.is_at(gamma)) {
        return of(row);
    }
    let above = rows.iter().position(|row| row.gamma > gamma).filter(|k| *k > 0)?;
    let below = above - 1;
    let others = [above + 1, below.wrapping_sub(1)].into_iter().filter_map(|k| rows.get(k));
    let far = |row: &&Row| (row.gamma / gamma).ln().abs();
    let third = others.min_by(|a, b| far(a).total_cmp(&far(b)))?;
    let point = |row: &Row| of(row).map(|[value, error]| (row.gamma.ln(), value.ln(), error / value));
    let ((a, fa, ea), (b, fb, eb), (c, fc, _)) = (point(&rows[below])?, point(&rows[above])?, point(third)?);
    let x = gamma.ln();
    let share = (x - a) / (b - a);
    let line = |x: f64| fa + (fb - fa) * (x - a) / (b - a);
    let curved = (fc - line(c)) * (x - a) * (x - b) / ((c - a) * (c - b));
    let measured = ((1.0 - share) * ea).hypot(share * eb);
    let found = line(x).exp();
    Some([found, found * measured.hypot(curved.exp_m1())])
}

#[cfg(test)]
mod tests;
