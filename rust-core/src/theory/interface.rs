use super::binary::CompositionLine;
use super::line::{Line, coexisting};
use super::mean_field::add_symmetric;
use super::one_component::DensityLine;
use super::radial::{gauss_legendre, integral};
use super::search::spaced;
use super::{MeanField, TheoryError};
use std::f64::consts::PI;

/// A planar interface between two phases, from the square-gradient free energy
/// `F = ∫ f(x) + ½κ(x)|∇x|²`, `x` a density or a composition.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Values of `x` in the two phases.
    pub phases: [f64; 2],
    /// Surface tension `∫ √(2κW) dx`, with `W` the height of `f` above the double tangent.
    pub tension: f64,
    /// `(x₂ − x₁) / max|dx/dz|`, the width of Warren's eq. (19). For a profile `tanh(z/ξ)` it is `2ξ`.
    pub width: f64,
    /// Lengths `√(κ/f″)` over which the profile decays into either phase. For a profile `tanh(z/ξ)`
    /// they are `ξ/2`.
    pub decay: [f64; 2],
    /// Points `[z, x]` of the profile; at `z = 0` `x` is halfway between the phases.
    pub profile: Vec<[f64; 2]>,
}

impl MeanField {
    /// The moments `[r²w]` and `[r⁴w]` of each density, in the order of the model. With `z` a vector, these
    /// are `[z²w]` and `[z⁴w]` of Pagonabarraga and Frenkel; `n = ρ + [z²w]/(2d) ∇²ρ` (their eq. 27).
    pub fn kernel_moments(&self) -> Vec<[f64; 2]> {
        self.kernels.iter().map(|w| [w.moment(2), w.moment(4)]).collect()
    }

    /// The matrix `κ_st` of `F = ∫ f + ½ Σ_st κ_st ∇ρ_s·∇ρ_t`, row-major:
    ///
    /// ```text
    /// κ_st = −(A_st + A_ts) − [r²φ_st]/(2d)
    /// A_st = Σ_d [r²w_d]/(2d) (∂ψ_t/∂x_ds + Σ_α ρ_α Σ_d′ ∂²ψ_α/∂x_ds∂x_d′t)
    /// ```
    ///
    /// For one density of one species `κ = −([r²w]/d)(ψ′ + ρψ″) − [r²φ]/(2d)`, twice the bracket of
    /// Pagonabarraga–Frenkel eq. (29); for a mixture, their eq. (35).
    pub fn gradient_coefficients(&self, densities: &[f64]) -> Vec<f64> {
        let count = self.species.len();
        let twice_d = 2.0 * self.dimensions as f64;
        let m: Vec<f64> = self.kernels.iter().map(|w| w.moment(2) / twice_d).collect();
        let mut kappa = vec![0.0; count * count];
        for alpha in 0..count {
            let psi = self.psi(alpha, densities);
            let n = psi.gradient.len();
            for u in 0..n {
                let (d, s) = (u / count, u % count);
                let mut add = |s: usize, t: usize, a: f64| {
                    kappa[s * count + t] -= a;
                    kappa[t * count + s] -= a;
                };
                add(s, alpha, m[d] * psi.gradient[u]);
                if densities[alpha] == 0.0 {
                    continue;
                }
                (0..n).for_each(|v| add(s, v % count, m[d] * densities[alpha] * psi.hessian[u * n + v]));
            }
        }
        for (between, phi) in &self.pairs {
            add_symmetric(&mut kappa, count, *between, -(phi.moment(2) / twice_d));
        }
        kappa
    }

    /// The interface between vapour and liquid of one component, with a profile of `points` points.
    /// Pagonabarraga–Frenkel eq. (29); their eq. (30) approximates the tension for phases of nearly equal density.
    ///
    /// # Errors
    /// Fails for more than one species, without coexistence, and for a gradient coefficient that is not positive.
    pub fn interface(&self, points: usize) -> Result<Interface, TheoryError> {
        self.require_species(1)?;
        let line = DensityLine::new(self);
        let phases = coexisting(&line)?;
        planar(&line, &|x| self.gradient_coefficients(&[x])[0], phases, points, self.kt, &|x| x)
    }

    /// The interface between two phases of a binary mixture with constant total density, with `x` the
    /// fraction of the first species and `κ = ρ²(κ_AA − 2κ_AB + κ_BB)`. Pagonabarraga–Frenkel eq.
    /// (36)–(41). Only phases in equilibrium have one.
    ///
    /// # Errors
    /// Fails for other than two species, without coexistence, with [`TheoryError::NotInEquilibrium`],
    /// and for a gradient coefficient that is not positive.
    pub fn composition_interface(&self, density: f64, points: usize) -> Result<Interface, TheoryError> {
        self.composition_binodal(density)?;
        let line = CompositionLine::at_density(self, density);
        let phases = coexisting(&line)?;
        let kappa = |c: f64| {
            let k = self.gradient_coefficients(&[density * c, density * (1.0 - c)]);
            density * density * (k[0] - k[1] - k[2] + k[3])
        };
        planar(&line, &kappa, phases, points, self.kt * density, &|c| c * (1.0 - c))
    }
}

/// The planar interface of `½κ x′² = W`. The curvature of the line times `energy / spread(x)` is `f″`, and
/// `spread(x)` is `dx/du`.
fn planar(
    line: &dyn Line,
    kappa: &dyn Fn(f64) -> f64,
    [u1, u2]: [f64; 2],
    points: usize,
    energy: f64,
    spread: &dyn Fn(f64) -> f64,
) -> Result<Interface, TheoryError> {
    let (x1, x2) = (line.x(u1), line.x(u2));
    let half = 0.5 * (x2 - x1);
    let rule = gauss_legendre(8);
    let (slope, intercept) = (line.slope(u1), line.intercept(u1));
    let second = |u: f64| line.curvature(u) * energy / spread(line.x(u));
    let curvatures = [second(u1), second(u2)];
    // The distances of x from the two phases; x = middle − half cos θ resolves both ends.
    let distance = |theta: f64| [(0.5 * theta).sin(), (0.5 * theta).cos()].map(|s| 2.0 * half * s * s);
    let place = |theta: f64| {
        let [from_first, from_second] = distance(theta);
        if theta < 0.5 * PI { x1 + from_first } else { x2 - from_second }
    };
    for theta in spaced(0.0, PI, 400) {
        let (at, coefficient) = (place(theta), kappa(place(theta)));
        if coefficient.is_nan() || coefficient <= 0.0 {
            return Err(TheoryError::GradientNotPositive { at, coefficient });
        }
    }
    let u_of = |theta: f64| match theta < 0.5 * PI {
        true => line.u(place(theta)),
        false => line.u_below(u2, distance(theta)[1]),
    };
    // W is the height above the double tangent, or the double integral of f″ where that is a difference of large numbers.
    let height = |theta: f64| {
        let x = place(theta);
        let u = u_of(theta);
        let (own_slope, own_intercept) = (line.slope(u), line.intercept(u));
        let below = x * (own_slope - slope) - (own_intercept - intercept);
        if below > 1e-6 * ((x * own_slope).abs() + own_intercept.abs()) {
            return below;
        }
        let near = usize::from(theta > 0.5 * PI);
        let integral = energy * twice_integrated(line, [u1, u2][near], u, distance(theta)[near], &rule);
        if integral < 0.0 { 0.0 } else { integral }
    };
    // dx/dz = √(2W/κ), and dz/dθ = half sin θ / (dx/dz).
    let steepness = |theta: f64| (2.0 * height(theta) / kappa(place(theta))).sqrt();
    let tension = integral(
        &|theta| (2.0 * kappa(place(theta)) * height(theta)).sqrt() * half * theta.sin(),
        &spaced(0.0, PI, 32),
    );
    // dz/dt with θ = 2 atan eᵗ is half sin²θ/(dx/dz): finite at both ends, where t goes like z.
    let count = points.max(16) | 1;
    let ends = 9.0;
    let ts = spaced(-ends, ends, count - 1);
    let theta = |t: f64| 2.0 * t.exp().atan();
    let rate = |t: f64| half * theta(t).sin().powi(2) / steepness(theta(t));
    let mut z = vec![0.0; count];
    for i in 1..count {
        let (a, b) = (ts[i - 1], ts[i]);
        let piece: f64 =
            rule.iter().map(|(x, w)| 0.5 * (b - a) * w * rate(0.5 * (a + b) + 0.5 * (b - a) * x)).sum();
        z[i] = z[i - 1] + piece;
    }
    let origin = z[count / 2];
    let profile = ts.iter().zip(&z).map(|(t, z)| [z - origin, place(theta(*t))]).collect();
    let steepest = spaced(0.0, PI, 2000)
        .windows(3)
        .map(|t| {
            let [a, b, c] = [steepness(t[0]), steepness(t[1]), steepness(t[2])];
            if b >= a && b >= c { -super::search::minimum(t[0], t[2], |t| -steepness(t)).1 } else { b }
        })
        .fold(0.0, f64::max);
    let decay = [0, 1].map(|i| (kappa([x1, x2][i]) / curvatures[i]).sqrt());
    Ok(Interface { phases: [x1, x2], tension, width: 2.0 * half / steepest, decay, profile })
}

/// `∫ (x − x(v)) f″ dx` from a phase at `end` to `u`, in units of the line's energy: there
/// `f″ dx = curvature dv`. `away` is the distance of `x` from the phase. Panels double away from `u`.
fn twice_integrated(line: &dyn Line, end: f64, u: f64, away: f64, rule: &[(f64, f64)]) -> f64 {
    let start = line.x(end);
    let sign = (u - end).signum();
    if !u.is_finite() {
        return f64::NAN;
    }
    let (mut from, mut width, mut total) = (u, 0.25, 0.0);
    while from != end {
        let mut to = from - sign * width;
        if sign * (to - end) <= 0.0 {
            to = end;
        }
        for (t, w) in rule {
            let v = 0.5 * (from + to) + 0.5 * (from - to) * t;
            let lever = sign * away - (line.x(v) - start);
            total += 0.5 * (from - to) * w * lever * line.curvature(v);
        }
        (from, width) = (to, 2.0 * width);
    }
    total
}
