//! The continuation of ψ beyond the bounds of a density.

/// The interval where ψ is used as written, and its continuation outside.
///
/// For a variable `x` out of `[low, high]`, with `x_c` the nearer bound and `δ = x − x_c`,
///
/// ```text
/// ψ(x) = ψ(x_c) + δ ∂ψ/∂x(x_c) + ½ δ² ∂²ψ/∂x²(x_c)
/// ```
///
/// so that ψ′ continues linearly; below `low` the last term is left out if ψ′ is to stay constant. With
/// several variables out of bounds the rule applies to each in turn, in any order. A table or an
/// equation of state is bounded in the total density it depends on, a formula in each partial density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lowest value at which ψ is used as written.
    pub low: f64,
    /// The highest value at which ψ is used as written.
    pub high: f64,
    /// The continuation of ψ′ below `low`.
    pub below: Continuation,
}

/// The continuation of ψ′ below the lower bound of a density.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Continuation {
    /// ψ′ keeps its slope at the bound.
    #[default]
    Linear,
    /// ψ′ keeps its value at the bound: particles in thin regions repel each other as in standard DPD, by a
    /// pair force `−(ψ_i′ + ψ_j′) w′` that no longer depends on the density. Trofimov, Nies and Michels, J.
    /// Chem. Phys. 117, 9383 (2002), sections IV A and V, suggest this where ψ is singular at low density.
    Constant,
}

impl Continuation {
    /// Their names in the model file.
    pub const NAMED: [(&str, Continuation); 2] =
        [("linear", Continuation::Linear), ("constant", Continuation::Constant)];
}

impl Bounds {
    /// The highest power of δ in the continuation: 2 where ψ′ is linear, 1 where it is constant.
    pub fn order(&self, beyond: f64) -> usize {
        if beyond < 0.0 && self.below == Continuation::Constant { 1 } else { 2 }
    }

    /// The nearest value within the bounds.
    pub fn clamp(&self, x: f64) -> f64 {
        x.clamp(self.low, self.high)
    }

    /// The excess `δ = x − x_c`: negative below the bounds, positive above, 0 within.
    pub fn beyond(&self, x: f64) -> f64 {
        if x < self.low {
            x - self.low
        } else if x > self.high {
            x - self.high
        } else {
            0.0
        }
    }

    /// ψ, ψ′ and ψ″ at a distance `beyond` from the nearest bound, from those at the bound.
    pub fn continued(&self, [psi, slope, curvature]: [f64; 3], beyond: f64) -> [f64; 3] {
        let curvature = if self.order(beyond) == 2 { curvature } else { 0.0 };
        [psi + beyond * (slope + 0.5 * beyond * curvature), slope + beyond * curvature, curvature]
    }
}

/// A variable out of its bounds.
#[derive(Debug, Clone, Copy)]
pub struct Stray {
    /// Index of the variable.
    pub variable: usize,
    /// The excess `δ` of the variable over the nearest bound.
    pub beyond: f64,
    /// The highest power of `δ` in the continuation.
    pub order: usize,
}

/// The continuation `Σ c_m Π δ_k^{m_k}` of a function with the given [`Expansion::coefficients`] at the bounds of
/// `strays`, differentiated by the variables `by`; those of them that are no strays have no effect.
///
/// [`Expansion::coefficients`]: crate::expression::Expansion::coefficients
pub fn continuation(coefficients: &[f64], strays: &[Stray], by: &[usize]) -> f64 {
    let mut sum = 0.0;
    for (index, coefficient) in coefficients.iter().enumerate() {
        let mut rest = index;
        let mut term = *coefficient;
        for stray in strays {
            let power = rest % 3;
            rest /= 3;
            let times = by.iter().filter(|v| **v == stray.variable).count();
            if power > stray.order || power < times {
                // The term is set to zero, as 0 times an infinite coefficient would be NaN.
                term = 0.0;
                continue;
            }
            let factor: usize = (power - times + 1..=power).product();
            term *= factor as f64 * stray.beyond.powi((power - times) as i32);
        }
        sum += term;
    }
    sum
}
