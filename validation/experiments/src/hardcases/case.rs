//! A hard case: a scene, and what must come of it.

use psidpd_dynamics::integrator::Integrator;
use std::fmt::Write;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Must {
    /// The run ends without a warning, without momentum, and with temperatures that are within this part of kT, and four
    /// errors, of which none is larger than this part.
    Right(f64),
    /// That, or it says what is wrong: it warns of the temperature, or stops and names the step.
    RightOrSaid(f64),
    /// It ends, and has counted the evaluations beyond the bounds of a density.
    Counted,
    Stops,
    /// The run is refused before its first step, with a reason.
    Refused,
    /// Engine and reference agree within this part of the largest force, in double precision; in mixed precision within
    /// single precision's part.
    Agrees(f64),
    /// Momentum and, without thermostat, energy stay within this part of kT per particle.
    Conserves(f64),
}

impl Must {
    pub fn words(self) -> String {
        match self {
            Must::Right(_) => "right".into(),
            Must::RightOrSaid(_) => "right, or warns or stops".into(),
            Must::Counted => "bounded and counted".into(),
            Must::Stops => "stops, names step and particle".into(),
            Must::Refused => "refused with a reason".into(),
            Must::Agrees(_) => "as the reference".into(),
            Must::Conserves(_) => "conserved".into(),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    Ended {
        /// Kinetic and configurational temperature in kT, each with its error, as far as they were measured.
        temperatures: Vec<[f64; 2]>,
        /// |Σ m v| over Σ m |v|.
        momentum: f64,
        counted: [u64; 2],
        warnings: Vec<String>,
    },
    Stopped(String),
    Refused(String),
    /// Largest difference of a force, over the largest force.
    Differs(f64),
    /// Energy per particle in kT, and momentum as above: changes.
    Changed {
        energy: f64,
        momentum: f64,
    },
}

#[derive(Debug, Clone)]
pub struct Inputs {
    pub model: String,
    pub kt: f64,
    /// The scene but for model, kT, integrator and stages.
    pub scene: String,
    /// A data file to start from, if there is one.
    pub data: Option<String>,
    pub dt: f64,
    /// Steps without measurement, and with.
    pub steps: [u64; 2],
}

impl Inputs {
    pub fn new(
        model: impl Into<String>,
        kt: f64,
        scene: impl Into<String>,
        dt: f64,
        steps: [u64; 2],
    ) -> Inputs {
        Inputs { model: model.into(), kt, scene: scene.into(), data: None, dt, steps }
    }
}

#[derive(Debug, Clone)]
pub struct Case {
    pub group: &'static str,
    pub name: &'static str,
    pub run: Inputs,
    pub must: Must,
    /// What must happen with integrators that keep the Maxwell distribution of an ideal gas at any time step, if that is another.
    pub exact: Option<Must>,
}

/// The lines of a scene for a cube.
pub fn cube(edge: f64, density: f64) -> String {
    format!("box = {edge:?}\ndensity = {density:?}\n")
}

/// A data file of one species in a cube.
pub fn data(x: &[[f64; 3]], edge: f64) -> String {
    let mut text = format!(
        "psidpd hard case\n\n{} atoms\n1 atom types\n\n0 {edge:?} xlo xhi\n0 {edge:?} ylo yhi\n0 {edge:?} zlo zhi\n\n\
         Masses\n\n1 1.0\n\nAtoms # atomic\n\n",
        x.len()
    );
    for (k, [x, y, z]) in x.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{} 1 {x:?} {y:?} {z:?}", k + 1);
    }
    text
}

impl Case {
    pub fn new(name: &'static str, run: Inputs, must: Must) -> Case {
        Case { group: "", name, run, must, exact: None }
    }

    /// What must happen with an integrator.
    pub fn must(&self, integrator: Integrator) -> Must {
        let approximate = ["velocity-verlet", "groot-warren", "dpd-vv", "self-consistent"];
        match self.exact {
            Some(must) if !approximate.contains(&integrator.name()) => must,
            _ => self.must,
        }
    }
}

/// How much momentum rounding may leave, of Σ m |v|.
const ROUNDING: f64 = 1e-5;

/// Single precision's part of the largest force: rounding of positions to 2⁻³² of the box and of forces.
const SINGLE: f64 = 2e-5;

/// Says what is wrong, if something is.
pub fn judge(must: Must, found: &Found, mixed: bool) -> Result<(), String> {
    let right = |part: f64| match found {
        Found::Ended { warnings, .. } if !warnings.is_empty() => Err(warnings.join("; ")),
        Found::Ended { temperatures, momentum, .. } => {
            for [t, error] in temperatures {
                let near = (t - 1.0).abs() <= part + 4.0 * error;
                // NaN is not near, and a missing error is not small.
                if !near {
                    return Err(format!("a temperature of {t:.3} ± {error:.3} kT"));
                }
                let tells = *error <= part;
                if !tells {
                    return Err(format!("a temperature of {t:.3} ± {error:.3} kT is too uncertain to judge"));
                }
            }
            if *momentum <= ROUNDING { Ok(()) } else { Err(format!("momentum {momentum:.1e}")) }
        }
        other => Err(said(other)),
    };
    match (must, found) {
        (Must::Right(part), _) => right(part),
        (Must::RightOrSaid(_), Found::Stopped(why)) if why.contains("step ") => Ok(()),
        (Must::RightOrSaid(_), Found::Ended { warnings, .. }) if !warnings.is_empty() => Ok(()),
        (Must::RightOrSaid(_), Found::Refused(why)) if !why.is_empty() => Ok(()),
        (Must::RightOrSaid(part), _) => right(part),
        (Must::Counted, Found::Ended { temperatures, counted, .. })
            if counted.iter().sum::<u64>() > 0 && temperatures.iter().flatten().all(|t| t.is_finite()) =>
        {
            Ok(())
        }
        (Must::Stops, Found::Stopped(why)) if why.contains("step ") && why.contains("particle ") => Ok(()),
        (Must::Refused, Found::Refused(why)) if !why.is_empty() => Ok(()),
        (Must::Agrees(part), Found::Differs(d)) if *d <= if mixed { SINGLE } else { part } => Ok(()),
        (Must::Conserves(part), Found::Changed { energy, momentum })
            if energy.abs() <= part && *momentum <= ROUNDING =>
        {
            Ok(())
        }
        (_, other) => Err(said(other)),
    }
}

pub fn said(found: &Found) -> String {
    match found {
        Found::Ended { temperatures, momentum, counted, warnings } => {
            let kinds = ["T_kin", "T_conf"];
            let mut text: Vec<String> = temperatures
                .iter()
                .zip(kinds)
                .map(|([t, e], kind)| format!("{kind} {t:.3} ± {e:.3}"))
                .collect();
            if *momentum > 1e-9 {
                text.push(format!("momentum {momentum:.0e}"));
            }
            if counted.iter().sum::<u64>() > 0 {
                text.push(format!("{} below, {} above bounds", counted[0], counted[1]));
            }
            if !warnings.is_empty() {
                text.push(format!("warned {} times", warnings.len()));
            }
            text.join(", ")
        }
        Found::Stopped(why) => format!("stopped: {}", why.lines().next().unwrap_or_default()),
        Found::Refused(why) => format!("refused: {}", why.lines().next().unwrap_or_default()),
        Found::Differs(d) => format!("forces differ by {d:.1e}"),
        Found::Changed { energy, momentum } => format!("energy {energy:+.1e} kT, momentum {momentum:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A temperature with an error of a thousandth.
    fn ended(t: f64, warnings: &[&str], counted: u64) -> Found {
        measured([t, 0.001], 0.0, warnings, counted)
    }

    fn measured(temperature: [f64; 2], momentum: f64, warnings: &[&str], counted: u64) -> Found {
        Found::Ended {
            temperatures: vec![[1.0, 0.0], temperature],
            momentum,
            counted: [0, counted],
            warnings: warnings.iter().map(|w| (*w).to_owned()).collect(),
        }
    }

    /// A value just within each bound passes, and one just beyond it fails.
    #[test]
    fn bounds_are_where_they_are_said_to_be() {
        let right =
            |must, t, error, momentum| judge(must, &measured([t, error], momentum, &[], 0), true).is_ok();
        for must in [Must::Right(0.01), Must::RightOrSaid(0.01)] {
            // A hundredth and four thousandths.
            for side in [1.0, -1.0] {
                assert!(right(must, 1.0 + side * 0.0139, 0.001, 0.0), "{must:?}");
                assert!(!right(must, 1.0 + side * 0.0141, 0.001, 0.0), "{must:?}");
            }
            // An error of more than a hundredth would let 5 % pass.
            assert!(right(must, 1.0, 0.0099, 0.0) && !right(must, 1.0, 0.0101, 0.0), "{must:?}");
            assert!(!right(must, 1.0, f64::NAN, 0.0), "{must:?}");
            // A start that drifts.
            assert!(right(must, 1.0, 0.001, 0.99e-5) && !right(must, 1.0, 0.001, 1.01e-5), "{must:?}");
            assert!(!right(must, 1.0, 0.001, f64::NAN), "{must:?}");
        }
        let agrees = |d, mixed| judge(Must::Agrees(1e-12), &Found::Differs(d), mixed).is_ok();
        assert!(agrees(0.99e-12, false) && !agrees(1.01e-12, false) && !agrees(f64::NAN, false));
        assert!(agrees(1.99e-5, true) && !agrees(2.01e-5, true));
        let kept = |energy, momentum| {
            judge(Must::Conserves(0.1), &Found::Changed { energy, momentum }, true).is_ok()
        };
        assert!(kept(0.099, 0.0) && kept(-0.099, 0.99e-5));
        assert!(!kept(0.101, 0.0) && !kept(-0.101, 0.0) && !kept(0.0, 1.01e-5) && !kept(f64::NAN, 0.0));
    }

    #[test]
    fn silence_about_a_wrong_temperature_is_no_pass() {
        let stopped = |why: &str| Found::Stopped(why.into());
        assert!(judge(Must::Right(0.01), &ended(1.01, &[], 0), true).is_ok());
        assert!(judge(Must::Right(0.01), &ended(1.1, &[], 0), true).is_err());
        assert!(judge(Must::Right(0.01), &ended(f64::NAN, &[], 0), true).is_err());
        assert!(judge(Must::Right(0.01), &ended(1.0, &["hot"], 0), true).is_err());
        assert!(judge(Must::RightOrSaid(0.01), &ended(1.1, &[], 0), true).is_err());
        assert!(judge(Must::RightOrSaid(0.01), &ended(1.1, &["hot"], 0), true).is_ok());
        assert!(judge(Must::RightOrSaid(0.01), &stopped("step 5: no"), true).is_ok());
        assert!(judge(Must::RightOrSaid(0.01), &stopped("no"), true).is_err());
        let refused = |why: &str| judge(Must::RightOrSaid(0.01), &Found::Refused(why.into()), true);
        assert!(refused("dt: too long").is_ok() && refused("").is_err());
        assert!(judge(Must::Stops, &stopped("step 5: too hot"), true).is_err());
        assert!(judge(Must::Stops, &stopped("step 5: particle 7 is"), true).is_ok());
        assert!(judge(Must::Stops, &ended(1.0, &[], 0), true).is_err());
        assert!(judge(Must::Counted, &ended(1.0, &[], 0), true).is_err());
        assert!(judge(Must::Counted, &ended(1.0, &[], 3), true).is_ok());
        assert!(judge(Must::Agrees(1e-12), &Found::Differs(1e-6), true).is_ok());
        assert!(judge(Must::Agrees(1e-12), &Found::Differs(1e-6), false).is_err());
        assert!(judge(Must::Conserves(0.1), &Found::Changed { energy: 0.2, momentum: 0.0 }, true).is_err());
    }
}
