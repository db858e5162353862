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

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand, of masses 1 and 3 at kT = 0.7, over all random numbers: what is left of u in the mean, `exp(−DΔt/μ)` where the rule says
    /// so, and the variance kT/μ, which stays. ξ of ±1 has the moments that count, and chances lie evenly.
    #[test]
    fn rules_leave_what_they_say_and_keep_the_variance() {
        let (mu, kt): (f64, f64) = (0.75, 0.7);
        let exponential = |a: f64| (-2.0 * a).exp();
        type Rule = (fn(&Encounter) -> f64, fn(f64) -> f64);
        let rules: [Rule; 3] = [
            (ornstein_uhlenbeck, exponential),
            (shardlow, |a| (1.0 - a) / (1.0 + a)),
            (lowe_andersen, exponential),
        ];
        for (number, (rule, left)) in rules.into_iter().enumerate() {
            for a in [0.02, 0.3, 0.7, 2.0] {
                let g = (a * mu).sqrt();
                let after = |u: f64| {
                    let (mut mean, mut square) = (0.0, 0.0);
                    let chances = 4000;
                    for k in 0..chances {
                        for xi in [-1.0, 1.0] {
                            let chance = (f64::from(k) + 0.5) / f64::from(chances);
                            let pair = Encounter { along: g * u, a, square: g * g, mu, kt, xi, chance };
                            let u = u + rule(&pair) * g / mu;
                            mean += u / f64::from(2 * chances);
                            square += u * u / f64::from(2 * chances);
                        }
                    }
                    [mean, square]
                };
                let [mean, _] = after(1.3);
                assert!((mean - 1.3 * left(a)).abs() < 1e-3, "{number} {a}: {mean}");
                let [_, square] = after((kt / mu).sqrt());
                assert!((square - kt / mu).abs() < 1e-9, "{number} {a}: {square}");
            }
        }
    }
}
