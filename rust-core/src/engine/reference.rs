//! The plain evaluation of the Hamiltonian: every pair of particles and images, in double precision,
//! in the order of the formulas. Slow on purpose; everything faster is tested against it.

use super::domain::PeriodicBox;
use super::noise::PairNoise;
use super::particles::Step;
use crate::model::curve::Curve;
use crate::model::expression::{Formula, TooLarge};
use crate::model::pair::PairForm;
use crate::model::{Continuation, ExcessFreeEnergy, Fluid};
use std::collections::BTreeMap;

/// Energy, densities, forces and virial of one configuration.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// `U`.
    pub energy: f64,
    /// Uncorrected local densities, one for each density and species, of each particle.
    pub densities: Vec<Vec<f64>>,
    /// Conservative forces.
    pub forces: Vec<[f64; 3]>,
    /// `Σ r_ij ⊗ F_ij` of the conservative forces: xx, yy, zz, xy, xz, yz.
    pub virial: [f64; 6],
}

/// A pair of particles, one of them perhaps an image: `d = r_i − r_j`.
struct Pair {
    i: usize,
    j: usize,
    d: [f64; 3],
    r: f64,
}

/// Every pair within `cutoff`, each once; a particle and its own image counts as a pair too.
fn pairs(x: &[[f64; 3]], domain: &PeriodicBox, dimensions: usize, cutoff: f64) -> Vec<Pair> {
    // A pair of particles that are both inside is at most this many boxes from its nearest image.
    let shells: [i32; 3] = std::array::from_fn(|k| {
        if domain.periodic()[k] && k < dimensions { (cutoff / domain.height(k)).ceil() as i32 + 1 } else { 0 }
    });
    let mut found = Vec::new();
    for i in 0..x.len() {
        for j in 0..=i {
            for a in -shells[0]..=shells[0] {
                for b in -shells[1]..=shells[1] {
                    for c in -shells[2]..=shells[2] {
                        // Of a particle's images, +s and −s are one pair.
                        if i == j && (a, b, c) <= (0, 0, 0) {
                            continue;
                        }
                        let shift = [a as f64, b as f64, c as f64];
                        let d: [f64; 3] = std::array::from_fn(|m| {
                            let images: f64 = (0..3).map(|k| shift[k] * domain.edge(k)[m]).sum();
                            if m < dimensions { x[i][m] - x[j][m] + images } else { 0.0 }
                        });
                        let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                        if r < cutoff {
                            found.push(Pair { i, j, d, r });
                        }
                    }
                }
            }
        }
    }
    found
}

/// ψ and ψ′ of a curve, at the total of its density, continued outside its bounds.
fn curve_at(curve: &Curve, fluid: &Fluid, at: &[f64]) -> (f64, f64) {
    let count = fluid.species.len();
    let total: f64 = (0..count).map(|beta| at[curve.density * count + beta]).sum();
    let Some(bounds) = fluid.densities[curve.density].bounds else {
        let [psi, slope, _] = curve.at(total);
        return (psi, slope);
    };
    let edge = total.max(bounds.low).min(bounds.high);
    let [psi, slope, mut curvature] = curve.at(edge);
    let delta = total - edge;
    if delta < 0.0 && bounds.below == Continuation::Constant {
        curvature = 0.0;
    }
    (psi + delta * slope + 0.5 * delta * delta * curvature, slope + delta * curvature)
}

/// A formula ψ, continued outside the bounds of its variables, by the definition.
struct Extended<'a> {
    fluid: &'a Fluid,
    /// Derivatives of ψ by how often each variable was differentiated by: they are asked for often.
    derivatives: BTreeMap<Vec<u8>, Formula>,
}

impl<'a> Extended<'a> {
    fn new(fluid: &'a Fluid, alpha: usize) -> Extended<'a> {
        let formula = match &fluid.excess[alpha] {
            ExcessFreeEnergy::Formula(formula) => formula.clone(),
            ExcessFreeEnergy::Curve(_) | ExcessFreeEnergy::Slopes(_) => Formula::constant(0.0),
        };
        let derivatives = BTreeMap::from([(vec![0; fluid.variables()], formula)]);
        Extended { fluid, derivatives }
    }

    fn value(&mut self, at: &[f64]) -> Result<f64, TooLarge> {
        self.continued(&vec![0; at.len()], at, 0)
    }

    /// `∂ψ/∂x_v`: beyond a bound `ψ_v + δ ψ_vv` there, within them that of ψ as it is.
    fn slope(&mut self, v: usize, at: &[f64]) -> Result<f64, TooLarge> {
        let (edge, delta, curved) = self.nearest(v, at);
        let mut order = vec![0; at.len()];
        order[v] = 1;
        let first = self.continued(&order, &edge, 0)?;
        if !curved {
            return Ok(first);
        }
        order[v] = 2;
        Ok(first + delta * self.continued(&order, &edge, 0)?)
    }

    /// The derivative of order `order`, continued in the variables from `v` on: in variable `v` as
    /// `f + δ f_v + ½ δ² f_vv` at its bound, each of these continued in the others.
    fn continued(&mut self, order: &[u8], at: &[f64], v: usize) -> Result<f64, TooLarge> {
        if v == at.len() {
            return Ok(self.derivative(order)?.value(at));
        }
        let (edge, delta, curved) = self.nearest(v, at);
        let mut sum = self.continued(order, &edge, v + 1)?;
        if delta != 0.0 {
            let mut order = order.to_vec();
            order[v] += 1;
            sum += delta * self.continued(&order, &edge, v + 1)?;
            if curved {
                order[v] += 1;
                sum += 0.5 * delta * delta * self.continued(&order, &edge, v + 1)?;
            }
        }
        Ok(sum)
    }

    /// The point with variable `v` within its bounds, how far it was outside, and whether ψ′ goes on
    /// linearly there.
    fn nearest(&self, v: usize, at: &[f64]) -> (Vec<f64>, f64, bool) {
        let mut edge = at.to_vec();
        let Some(bounds) = self.fluid.densities[v / self.fluid.species.len()].bounds else {
            return (edge, 0.0, false);
        };
        edge[v] = at[v].max(bounds.low).min(bounds.high);
        let delta = at[v] - edge[v];
        (edge, delta, delta > 0.0 || (delta < 0.0 && bounds.below == Continuation::Linear))
    }

    fn derivative(&mut self, order: &[u8]) -> Result<Formula, TooLarge> {
        if let Some(known) = self.derivatives.get(order) {
            return Ok(known.clone());
        }
        let mut less = order.to_vec();
        let v = less.iter().rposition(|m| *m > 0).unwrap_or(0);
        less[v] -= 1;
        let derivative = self.derivative(&less)?.derivative(v)?;
        self.derivatives.insert(order.to_vec(), derivative.clone());
        Ok(derivative)
    }
}

/// Evaluates `U` and its gradient for particles at `x`, inside `domain` along its periodic directions.
///
/// # Errors
/// A derivative of ψ grows beyond the limits of the formula engine.
pub fn evaluate(
    fluid: &Fluid,
    x: &[[f64; 3]],
    species: &[usize],
    domain: &PeriodicBox,
) -> Result<Evaluation, TooLarge> {
    let count = fluid.species.len();
    let pairs = pairs(x, domain, fluid.dimensions, fluid.cutoff());

    // n_β,i = Σ_j w(r_ij)
    let mut n = vec![vec![0.0; fluid.variables()]; x.len()];
    for (d, density) in fluid.densities.iter().enumerate() {
        for pair in &pairs {
            let w = density.kernel.value(pair.r);
            n[pair.i][d * count + species[pair.j]] += w;
            n[pair.j][d * count + species[pair.i]] += w;
        }
        if density.includes_self {
            for (n, s) in n.iter_mut().zip(species) {
                n[d * count + s] += density.kernel.value(0.0);
            }
        }
    }

    // Σ_i ψ(ñ_i), and ∂ψ_i/∂n_β = ∂ψ/∂ñ_β ρ̃′
    let mut energy = 0.0;
    let mut slopes = vec![vec![0.0; fluid.variables()]; x.len()];
    let mut excess: Vec<Extended> = (0..count).map(|alpha| Extended::new(fluid, alpha)).collect();
    for (i, alpha) in species.iter().copied().enumerate() {
        let corrected: Vec<(f64, f64)> = (0..fluid.variables())
            .map(|v| fluid.densities[v / count].correction[alpha * count + v % count].at(n[i][v]))
            .collect();
        let at: Vec<f64> = corrected.iter().map(|c| c.0).collect();
        if let ExcessFreeEnergy::Curve(curve) = &fluid.excess[alpha] {
            let (psi, slope) = curve_at(curve, fluid, &at);
            energy += psi;
            for beta in 0..count {
                let v = curve.density * count + beta;
                slopes[i][v] = slope * corrected[v].1;
            }
            continue;
        }
        if let ExcessFreeEnergy::Slopes(law) = &fluid.excess[alpha] {
            energy += law.energy.value(&at);
            for (v, slope) in law.slopes.iter().enumerate() {
                slopes[i][v] = slope.value(&at) * corrected[v].1;
            }
            continue;
        }
        energy += excess[alpha].value(&at)?;
        for v in 0..fluid.variables() {
            slopes[i][v] = excess[alpha].slope(v, &at)? * corrected[v].1;
        }
    }

    let mut forces = vec![[0.0; 3]; x.len()];
    let mut virial = [0.0; 6];
    for pair in &pairs {
        let (i, j) = (pair.i, pair.j);
        // Along ê_ij: −[∂ψ_i/∂n_c(j) + ∂ψ_j/∂n_c(i)] w′ − φ′
        let mut force = 0.0;
        for (d, density) in fluid.densities.iter().enumerate() {
            let slope = slopes[i][d * count + species[j]] + slopes[j][d * count + species[i]];
            force -= slope * density.force_kernel.slope(pair.r);
        }
        for term in &fluid.pairs {
            let between = [species[i], species[j]];
            let acts = term.between == between || term.between == [between[1], between[0]];
            if acts && pair.r < term.potential.range() {
                let (phi, slope) = term.potential.at(pair.r);
                energy += phi;
                force -= slope;
            }
        }
        add(pair, force, &mut forces, &mut virial);
    }
    Ok(Evaluation { energy, densities: n, forces, virial })
}

/// Dissipative and random forces, and their virial.
pub fn thermostat(
    fluid: &Fluid,
    x: &[[f64; 3]],
    v: &[[f64; 3]],
    tag: &[i32],
    species: &[usize],
    domain: &PeriodicBox,
    step: Step,
) -> (Vec<[f64; 3]>, [f64; 6]) {
    let count = fluid.species.len();
    let noise = PairNoise::new(step.seed, step.number);
    let mut forces = vec![[0.0; 3]; x.len()];
    let mut virial = [0.0; 6];
    for pair in &pairs(x, domain, fluid.dimensions, fluid.cutoff()) {
        let (i, j) = (pair.i, pair.j);
        let Some(thermostat) = fluid.thermostats[species[i] * count + species[j]] else {
            continue;
        };
        if pair.r < thermostat.range && pair.r > 0.0 {
            let w = (1.0 - pair.r / thermostat.range).powf(thermostat.exponent);
            let approach: f64 = (0..3).map(|k| pair.d[k] / pair.r * (v[i][k] - v[j][k])).sum();
            let sigma = (2.0 * thermostat.gamma * fluid.kt).sqrt();
            let xi = noise.xi(tag[i] as u32, tag[j] as u32);
            let force = -thermostat.gamma * w * w * approach + sigma * w * xi / step.dt.sqrt();
            add(pair, force, &mut forces, &mut virial);
        }
    }
    (forces, virial)
}

fn add(pair: &Pair, force: f64, forces: &mut [[f64; 3]], virial: &mut [f64; 6]) {
    // Two particles on one point have no direction to push along.
    if pair.r == 0.0 {
        return;
    }
    let f = pair.d.map(|c| force * c / pair.r);
    for k in 0..3 {
        forces[pair.i][k] += f[k];
        forces[pair.j][k] -= f[k];
    }
    for (w, (a, b)) in virial.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
        *w += pair.d[a] * f[b];
    }
}
