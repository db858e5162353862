//! The fluid that is fitted: Warren's, with one term more.
//!
//! ```text
//! φ(r) = ½ A (1 − r)²         ψ(n) = c₁ n + c₂ n²,  n of the quadratic kernel of range 0.75
//! ```
//!
//! in units of r_c and kT. A makes the tension. c₂ is Warren's B (π r_d⁴ B/30), and c₁ a pair force of the shorter range: with less
//! c₂ and more c₁ the liquid of the same density is softer.

use super::sheet::Liquid;
use serde::Serialize;

/// Drag and noise of weight `(1 − r/range)^exponent`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Drag {
    pub gamma: f64,
    pub range: f64,
    pub exponent: f64,
}

/// What equilibria are measured with, and liquids have whose viscosity is free: Warren's.
pub const USUAL: Drag = Drag { gamma: 18.0, range: 1.0, exponent: 1.0 };

/// Range of the repulsion over that of the attraction.
pub const RANGE: f64 = 0.75;

/// What is sought.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Strengths {
    pub attraction: f64,
    pub linear: f64,
    pub square: f64,
}

impl Strengths {
    pub fn of([attraction, linear, square]: [f64; 3]) -> Strengths {
        Strengths { attraction, linear, square }
    }

    pub fn array(&self) -> [f64; 3] {
        [self.attraction, self.linear, self.square]
    }
}

/// The model file; `head` goes into its comment.
pub fn text(liquid: &Liquid, fluid: &Strengths, drag: &Drag, head: &str) -> String {
    let Strengths { attraction, linear, square } = fluid;
    let units = &liquid.units;
    let comment: String = head.lines().map(|line| format!("# {line}\n").replace("# \n", "#\n")).collect();
    format!(
        "{comment}title   = {title}\nspecies = [\"F\"]\n\n\
         [units]\nlength = {:?}\nmass   = {:?}\nenergy = {:?}\n\n\
         [parameters]\nA  = {attraction:?}\nc1 = {linear:?}\nc2 = {square:?}\n\n\
         [density.n]\nkernel = \"quadratic\"\nrange  = {RANGE}\n\n\
         [excess_free_energy]\nF = \"c1*n + c2*n^2\"\n\n\
         [[pair]]\nbetween  = [\"F\", \"F\"]\nform     = \"soft\"\nstrength = \"A\"\nrange    = 1.0\n\n\
         [[thermostat]]\ngamma    = {:?}\nrange    = {:?}\nexponent = {:?}\n",
        units.length,
        units.mass,
        units.energy,
        drag.gamma,
        drag.range,
        drag.exponent,
        title = toml::Value::String(liquid.name.clone()),
    )
}
