//! The drag with which a liquid has its viscosity.

use super::fluid::{Drag, Strengths, USUAL};
use super::instrument::{Care, Flow, Instrument};
use super::sheet::Goals;
use crate::Trouble;
use serde::Serialize;

/// Weights by rising viscosity at the same strength.
const SHAPES: [[f64; 2]; 3] = [[1.0, 1.0], [1.0, 0.25], [1.5, 0.25]];

/// The least and the strongest drag that are tried.
pub const WEAKEST: f64 = 0.5;
pub const STRONGEST: f64 = 400.0;

/// The name of the end of the drags that are tried, for one at it or next to it: by noise the best may be a little before.
pub fn end(gamma: f64) -> Option<&'static str> {
    match gamma {
        gamma if gamma <= 1.5 * WEAKEST => Some("weakest"),
        gamma if gamma >= STRONGEST / 1.5 => Some("strongest"),
        _ => None,
    }
}

/// A wider weight is taken where this one would need more drag.
const COMFORTABLE: f64 = 200.0;

const TRIALS: usize = 6;

/// A drag that was measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Tried {
    pub drag: Drag,
    pub flow: Flow,
}

/// The part of the viscosity that drag makes, over its strength, of particles without correlations: 2πρ²/15 ∫ r⁴ w² dr in units of r_c.
fn per_gamma(drag: &Drag, density: f64) -> f64 {
    // ∫₀¹ s⁴ (1 − s)^p ds = 4! / ((p + 1) … (p + 5)), with p = 2 · exponent.
    let p = 2.0 * drag.exponent;
    let integral = 24.0 / ((p + 1.0) * (p + 2.0) * (p + 3.0) * (p + 4.0) * (p + 5.0));
    2.0 * std::f64::consts::PI / 15.0 * density * density * drag.range.powi(5) * integral
}

/// Seeks the drag: content within `tolerance`. The last of the trials is the best that was found. Without a goal the usual drag is measured.
pub fn search(
    goals: &Goals,
    fluid: &Strengths,
    tolerance: f64,
    instrument: &mut dyn Instrument,
    told: &mut dyn FnMut(&str),
) -> Result<Vec<Tried>, Trouble> {
    let mut trials: Vec<Tried> = Vec::new();
    let mut drag = USUAL;
    let mut guess = 2.0 + per_gamma(&drag, goals.density) * drag.gamma;
    for _ in 0..TRIALS {
        let flow = instrument.flow(fluid, &drag, guess, Care::Search)?;
        told(&format!(
            "gamma = {:.3} (range {}, exponent {}): viscosity {:.2}({:.2})",
            drag.gamma, drag.range, drag.exponent, flow.viscosity.value, flow.viscosity.error
        ));
        trials.push(Tried { drag, flow });
        let Some(goal) = goals.viscosity else { break };
        if (flow.viscosity.value / goal - 1.0).abs() <= tolerance {
            break;
        }
        let Some(better) = next(&trials, goal, goals.density).filter(|better| *better != drag) else { break };
        (drag, guess) = (better, goal);
    }
    if let Some(goal) = goals.viscosity {
        let off = |tried: &Tried| (tried.flow.viscosity.value / goal).ln().abs();
        trials.sort_by(|a, b| off(b).total_cmp(&off(a)));
    }
    Ok(trials)
}

/// The next drag: of the weight that reaches the goal in comfort, between two trials of this weight by the straight line in logarithms.
fn next(trials: &[Tried], goal: f64, density: f64) -> Option<Drag> {
    let last = trials.last()?;
    let same: Vec<&Tried> = trials
        .iter()
        .filter(|t| [t.drag.range, t.drag.exponent] == [last.drag.range, last.drag.exponent])
        .collect();
    let gamma = match same[..] {
        [.., a, b] if (a.drag.gamma / b.drag.gamma).ln().abs() > 0.01 => {
            let (x, y) = (a.drag.gamma.ln(), a.flow.viscosity.value.ln());
            let slope = (b.flow.viscosity.value.ln() - y) / (b.drag.gamma.ln() - x);
            // Viscosity rises with the drag, and not faster; noise may say otherwise.
            let change = ((goal / b.flow.viscosity.value).ln() / slope.clamp(0.15, 1.2)).clamp(-2.5, 2.5);
            b.drag.gamma * change.exp()
        }
        // Without drag some viscosity is left, so this is too far where there was little.
        _ => last.drag.gamma * (goal / last.flow.viscosity.value).clamp(0.1, 100.0),
    };
    let shape = SHAPES.iter().position(|s| *s == [last.drag.range, last.drag.exponent])?;
    if gamma > COMFORTABLE
        && let Some([range, exponent]) = SHAPES.get(shape + 1).copied()
    {
        let wider = Drag { gamma: 1.0, range, exponent };
        // Of two weights the part of the drag is known to the same factor.
        let factor = per_gamma(&last.drag, density) / per_gamma(&wider, density);
        return Some(Drag { gamma: (gamma * factor).clamp(WEAKEST, STRONGEST), ..wider });
    }
    Some(Drag { gamma: gamma.clamp(WEAKEST, STRONGEST), ..last.drag })
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_observe::Measured;

    /// Of the usual weight it is 2πγρ²r_c⁵/1575, as in textbooks; of others the integral of r⁴ w² over spheres, by a sum.
    #[test]
    fn the_part_of_the_drag_is_that_of_kinetic_theory() {
        let pi = std::f64::consts::PI;
        let usual = per_gamma(&Drag { gamma: 7.0, ..USUAL }, 3.0);
        assert!((usual / (2.0 * pi * 9.0 / 1575.0) - 1.0).abs() < 1e-12, "{usual}");
        for [range, exponent] in SHAPES {
            let steps = 100_000;
            let h = range / f64::from(steps);
            let at = |k: i32| {
                let r = (f64::from(k) + 0.5) * h;
                r.powi(4) * (1.0 - r / range).powf(2.0 * exponent)
            };
            let expected = 2.0 * pi / 15.0 * 25.0 * h * (0..steps).map(at).sum::<f64>();
            let found = per_gamma(&Drag { gamma: 1.0, range, exponent }, 5.0);
            assert!((found / expected - 1.0).abs() < 1e-4, "{range} {exponent}: {found} {expected}");
        }
    }

    /// One trial is followed in proportion, two by a line in logarithms whose slope physics bounds. What takes an uncomfortable drag
    /// takes a wider weight with the same part of the drag.
    #[test]
    fn the_next_drag_is_that_of_the_trials() {
        let trial = |gamma: f64, viscosity: f64| Tried {
            drag: Drag { gamma, ..USUAL },
            flow: Flow { viscosity: viscosity.into(), diffusion: Measured::NONE, dt: 0.01 },
        };
        let gamma = |trials: &[Tried], goal: f64| {
            let next = next(trials, goal, 3.0).unwrap();
            assert_eq!([next.range, next.exponent], [USUAL.range, USUAL.exponent]);
            next.gamma
        };
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        near(gamma(&[trial(2.0, 4.0)], 8.0), 4.0);
        near(gamma(&[trial(8.0, 4.0)], 1.0), 2.0);
        // Slopes of 1/2 and 1, and of 0 and 3, which noise makes: they count as 0.15 and 1.2.
        near(gamma(&[trial(1.0, 2.0), trial(4.0, 4.0)], 6.0), 9.0);
        near(gamma(&[trial(9.0, 9.0), trial(1.0, 2.0), trial(2.0, 4.0)], 6.0), 3.0);
        near(gamma(&[trial(1.0, 2.0), trial(2.0, 2.0)], 2.2), 2.0 * 1.1f64.powf(1.0 / 0.15));
        near(gamma(&[trial(1.0, 1.0), trial(2.0, 8.0)], 4.0), 2.0 * 0.5f64.powf(1.0 / 1.2));
        // Two trials of one drag have no slope, as one of another weight has none with this one.
        near(gamma(&[trial(2.0, 5.0), trial(2.0, 4.0)], 8.0), 4.0);
        let mut other = trial(1.0, 2.0);
        other.drag.exponent = SHAPES[1][1];
        near(gamma(&[other, trial(2.0, 4.0)], 8.0), 4.0);
        let wider = next(&[trial(COMFORTABLE, 4.0)], 6.0, 3.0).unwrap();
        assert_eq!([wider.range, wider.exponent], SHAPES[1]);
        let part = |drag: &Drag| drag.gamma * per_gamma(drag, 3.0);
        near(part(&wider), part(&Drag { gamma: 1.5 * COMFORTABLE, ..USUAL }));
        assert!(next(&[], 6.0, 3.0).is_none());
    }
}
