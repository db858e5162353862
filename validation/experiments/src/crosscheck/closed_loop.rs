//! The work of a force around a closed loop: three particles tell whether it has a potential.
//!
//! Particles 1 and 2 rest, particle 3 goes once around a circle on which every distance stays below r_d,
//! so that the force is smooth and the trapezoidal rule converges faster than any power. A force with a
//! potential does no work. With the Lucy density and the linear force it does, because `w′` is not
//! proportional to the force (Warren eq. 10).

use super::Context;
use super::setup::Setup;
use crate::ExperimentError;
use crate::code::Code;
use crate::fluids::SET6;
use crate::start::periodic;
use psidpd_core::engine::Want;
use psidpd_core::model::ForceLaw;
use psidpd_dynamics::run::State;
use std::f64::consts::TAU;

const POINTS: usize = 96;
const RADIUS: f64 = 0.2;
/// Off the line half-way between the two: mirror symmetry would make the work vanish.
const CENTRE: [f64; 3] = [5.22, 5.3, 5.0];
const REST: [[f64; 3]; 2] = [[5.0, 5.0, 5.0], [5.3, 5.0, 5.0]];

/// Work of the force on particle 3 around the circle, and the size it is compared with: the integral of
/// the force's magnitude.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    /// ∮ F·dx.
    pub work: f64,
    /// ∮ |F| |dx|.
    pub scale: f64,
}

fn state_at(angle: f64) -> Result<State, ExperimentError> {
    let third = [CENTRE[0] + RADIUS * angle.cos(), CENTRE[1] + RADIUS * angle.sin(), CENTRE[2]];
    Ok(State::at_rest(periodic([10.0; 3])?, vec![1.0], vec![REST[0], REST[1], third]))
}

fn around(mut force: impl FnMut(f64) -> Result<[f64; 3], ExperimentError>) -> Result<Work, ExperimentError> {
    let mut sum = Work { work: 0.0, scale: 0.0 };
    for k in 0..POINTS {
        let angle = TAU * k as f64 / POINTS as f64;
        let f = force(angle)?;
        let arc = RADIUS * TAU / POINTS as f64;
        sum.work += arc * (f[1] * angle.cos() - f[0] * angle.sin());
        sum.scale += arc * (f[0] * f[0] + f[1] * f[1]).sqrt();
    }
    Ok(sum)
}

pub fn native(context: &Context, law: ForceLaw) -> Result<Work, ExperimentError> {
    let model = SET6.model(law, 0.0)?;
    around(|angle| {
        let mut simulation = context.simulation(&model, 1.0, &state_at(angle)?, 1)?;
        simulation.compute(Want::FORCES, None)?;
        Ok(simulation.forces()[2])
    })
}

pub fn lammps(context: &Context, code: Code, law: ForceLaw) -> Result<Work, ExperimentError> {
    let setup = Setup::new(code, &SET6, law);
    let instance = super::forces::open(context, &setup, &state_at(0.0)?, &format!("loop-{}", setup.slug()))?;
    around(|angle| {
        let x = state_at(angle)?.x;
        instance.scatter("x", 3, x.as_flattened())?;
        instance.command("run 0 post no")?;
        let f = instance.gather("f", 3)?;
        Ok([f[6], f[7], f[8]])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force that turns, `k (−y, x)` about the centre, does the work `2πkR²`; a uniform force none, whatever its direction.
    #[test]
    fn the_work_of_known_forces() {
        let turning = around(|a| Ok([-3.0 * RADIUS * a.sin(), 3.0 * RADIUS * a.cos(), 0.0])).unwrap();
        assert!((turning.work / (3.0 * TAU * RADIUS * RADIUS) - 1.0).abs() < 1e-12, "{turning:?}");
        assert!((turning.scale - turning.work).abs() < 1e-12, "{turning:?}");
        let uniform = around(|_| Ok([2.0, -1.5, 0.0])).unwrap();
        assert!(uniform.work.abs() < 1e-12 && (uniform.scale / (2.5 * TAU * RADIUS) - 1.0).abs() < 1e-12);
    }
}
