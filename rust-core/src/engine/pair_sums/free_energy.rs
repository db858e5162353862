//! ψ of particles with first and second derivatives by their uncorrected densities. Tests compare
//! [`ExcessPlan`](crate::engine::excess::ExcessPlan), which evaluates blocks of particles, with it.

use crate::engine::sweep::Pool;
use crate::free_energy::FreeEnergy;
use crate::model::Fluid;
use psidpd_threads::take;

/// ψ of particles with derivatives by their uncorrected densities, particle by particle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Psi {
    /// Values ψ.
    pub value: Vec<f64>,
    /// Slopes ∂ψ/∂n_v.
    pub slopes: Vec<f64>,
    /// Second derivatives ∂²ψ/∂n_v∂n_u, a full matrix by rows.
    pub second: Vec<f64>,
}

/// Number of particles that a thread takes at a time.
const CHUNK: usize = 256;

/// ψ of particles with one species each, at their uncorrected densities, density-major. Threads share the particles.
pub fn psi(pool: &Pool, free_energy: &FreeEnergy, fluid: &Fluid, species: &[i32], densities: &[f64]) -> Psi {
    let (particles, variables) = (species.len(), fluid.variables());
    let square = variables * variables;
    let room = |per_particle: usize| vec![0.0; particles * per_particle];
    let mut psi = Psi { value: room(1), slopes: room(variables), second: room(square) };
    let (mut slopes, mut second) = (&mut psi.slopes[..], &mut psi.second[..]);
    let chunks = psi.value.chunks_mut(CHUNK).zip(species.chunks(CHUNK)).enumerate();
    let mut work: Vec<_> = chunks
        .map(|(k, (value, species))| {
            let count = species.len();
            let densities = &densities[k * CHUNK * variables..][..count * variables];
            let slopes = take(&mut slopes, count * variables);
            (species, densities, Rows { value, slopes, second: take(&mut second, count * square) })
        })
        .collect();
    pool.each(&mut work, |(species, densities, rows)| {
        for alpha in 0..fluid.species.len() {
            let of_species = |k: &usize| species[*k] as usize == alpha;
            let of_species: Vec<usize> = (0..species.len()).filter(of_species).collect();
            rows.evaluate(free_energy, fluid, alpha, &of_species, densities);
        }
    });
    psi
}

/// Results of some particles, as in [`Psi`].
struct Rows<'a> {
    value: &'a mut [f64],
    slopes: &'a mut [f64],
    second: &'a mut [f64],
}

impl Rows<'_> {
    /// Evaluates the particles `rows`, which are of species `alpha`.
    fn evaluate(
        &mut self,
        free_energy: &FreeEnergy,
        fluid: &Fluid,
        alpha: usize,
        rows: &[usize],
        densities: &[f64],
    ) {
        let (count, variables, lanes) = (fluid.species.len(), fluid.variables(), rows.len());
        let correction = |v: usize| &fluid.densities[v / count].correction[alpha * count + v % count];
        // Variable by variable: the corrected density with its derivatives.
        let corrected: Vec<[f64; 3]> = (0..variables)
            .flat_map(|v| {
                rows.iter().map(move |k| polynomial(&correction(v).0, densities[k * variables + v]))
            })
            .collect();
        let at: Vec<f64> = corrected.iter().map(|[value, ..]| *value).collect();
        let found = free_energy.evaluate_block(alpha, lanes, &at);
        for (lane, k) in rows.iter().enumerate() {
            self.value[*k] = found[lane];
            for v in 0..variables {
                let [_, first, bend] = corrected[v * lanes + lane];
                let gradient = found[(1 + v) * lanes + lane];
                self.slopes[k * variables + v] = gradient * first;
                for u in 0..variables {
                    // A slope may be infinite without neighbours.
                    let curved = if u == v && bend != 0.0 { gradient * bend } else { 0.0 };
                    let entry = found[(1 + variables + v * variables + u) * lanes + lane];
                    let other = corrected[u * lanes + lane][1];
                    self.second[(k * variables + v) * variables + u] = entry * (first * other) + curved;
                }
            }
        }
    }
}

/// The product of a derivative of ψ, which may be infinite if no particle is in range, with one of weights, which then is 0.
#[inline(always)]
pub fn times(of_psi: f64, of_weight: f64) -> f64 {
    let product = of_psi * of_weight;
    if of_weight == 0.0 { 0.0 } else { product }
}

/// The value and the first two derivatives of a polynomial.
fn polynomial(coefficients: &[f64], x: f64) -> [f64; 3] {
    coefficients.iter().rev().fold([0.0; 3], |[value, slope, second], c| {
        [value * x + c, slope * x + value, second * x + 2.0 * slope]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    /// Compares slopes and second derivatives with differences, within bounds, beyond one and beyond both.
    #[test]
    fn derivatives_of_psi_are_derivatives() {
        let model = Model::parse(
            "m.toml",
            r#"
title = "m"
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range = 1.0
bounds = [0.5, 3.0]
correction = { "A|A" = [0.1, 1.1, 0.02], "A|B" = [0.0, 1.0], "B|A" = [0.2, 0.9], "B|B" = [0.0, 1.0, 0.01] }
[excess_free_energy]
A = "kT*n_A*ln(n_A) + 0.3*n_A^2*n_B + n_B^3"
B = "n^3 + sqrt(n_A)*n_B^2"
"#,
        )
        .unwrap();
        let fluid = model.at(1.3).unwrap();
        let energies = FreeEnergy::new(&fluid, usize::MAX).unwrap();
        for alpha in 0..2 {
            for n in [[1.0, 1.2], [0.1, 1.0], [5.0, 0.2], [4.0, 6.0], [0.2, 0.1]] {
                let pool = Pool::new(std::num::NonZeroUsize::MIN);
                let here = psi(&pool, &energies, &fluid, &[alpha], &n);
                let h = 1e-5;
                for v in 0..2 {
                    let moved = |h: f64| {
                        let mut n = n;
                        n[v] += h;
                        psi(&pool, &energies, &fluid, &[alpha], &n)
                    };
                    let (up, down) = (moved(h), moved(-h));
                    let slope = (up.value[0] - down.value[0]) / (2.0 * h);
                    assert!((slope - here.slopes[v]).abs() < 1e-7 * (1.0 + slope.abs()), "{alpha} {n:?} {v}");
                    for u in 0..2 {
                        let second = (up.slopes[u] - down.slopes[u]) / (2.0 * h);
                        let found = here.second[v * 2 + u];
                        assert!((second - found).abs() < 1e-6 * (1.0 + second.abs()), "{alpha} {n:?} {v}{u}");
                    }
                }
            }
        }
    }
}
