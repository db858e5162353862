//! The rules by which sequential updates change pairs.
//!
//! With `u = ê·v_ij`, the reduced mass μ and `a = |g|²/μ = ½ΔtD/μ`, each rule computes a new `u′` that
//! preserves the normal distribution of variance kT/μ, for any Δt.

/// The pair that a rule updates.
#[derive(Debug, Clone, Copy)]
pub struct Encounter {
    /// Relative velocity times `|g|`, `|g| u`.
    pub along: f64,
    /// Ratio `½ Δt D/μ`.
    pub a: f64,
    /// Square `|g|²`.
    pub square: f64,
    pub mu: f64,
    pub kt: f64,
    pub xi: f64,
    /// Uniform random number on (0, 1), for rules that need one.
    pub chance: f64,
}

impl Encounter {
    /// The factor of `g` in the impulse on the first particle that changes `u` to `factor u + noise √(kT/μ) ξ`.
    #[inline(always)]
    fn impulse(&self, factor_less_one: f64, noise: f64) -> f64 {
        self.mu * (factor_less_one * self.along / self.square)
            + (self.mu * self.kt / self.square).sqrt() * noise * self.xi
    }
}

/// The rule `u′ = c u + √(kT/μ (1 − c²)) ξ`, `c = exp(−DΔt/μ)`: exact for a single pair; Peters's scheme II.
pub fn ornstein_uhlenbeck(pair: &Encounter) -> f64 {
    let less_one = (-2.0 * pair.a).exp_m1();
    pair.impulse(less_one, (-(-4.0 * pair.a).exp_m1()).sqrt())
}

/// The rule `u′ = ((1 − a) u + 2 √(kT a/μ) ξ)/(1 + a)`: half an explicit and half an implicit step.
pub fn shardlow(pair: &Encounter) -> f64 {
    let a = pair.a;
    pair.impulse(-2.0 * a / (1.0 + a), 2.0 * a.sqrt() / (1.0 + a))
}

/// The rule `u′ = √(kT/μ) ξ` with the probability `1 − exp(−DΔt/μ)`.
pub fn lowe_andersen(pair: &Encounter) -> f64 {
    if pair.chance < -(-2.0 * pair.a).exp_m1() { pair.impulse(-1.0, 1.0) } else { 0.0 }
}
