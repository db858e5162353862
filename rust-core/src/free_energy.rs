//! ψ of one particle and its derivatives, for the theory, and for many particles, for measurements. The engine evaluates blocks of
//! particles without second derivatives instead; both continue ψ beyond the bounds of a density by [`crate::model::continuation`].

use crate::model::curve::Curve;
use crate::model::expression::{Expansion, Formula, Program, TooLarge};
use crate::model::{Bounds, ExcessFreeEnergy, Fluid, StatedSlopes, Stray, continuation};
use psidpd_passes::vectors::{Loop, run_best};

/// The `ψ_α` of a fluid with exact first and second derivatives.
#[derive(Debug, Clone)]
pub struct FreeEnergy {
    species: usize,
    variables: usize,
    /// Bounds of each density.
    bounds: Vec<Option<Bounds>>,
    excess: Vec<Excess>,
}

/// The free energy `ψ_α` of one species.
#[derive(Debug, Clone)]
enum Excess {
    /// ψ, its gradient, and the upper triangle of its Hessian.
    Formula { program: Program, outputs: Vec<Formula> },
    /// A function of the total of one density.
    Curve(Curve),
    /// There is no ψ: the energy and the slopes are stated.
    Stated(StatedSlopes),
}

/// Value and derivatives of `ψ_α` at one point.
#[derive(Debug, Clone, Default)]
pub struct Psi {
    /// Value `ψ_α`.
    pub value: f64,
    /// Gradient `∂ψ_α/∂x_v`.
    pub gradient: Vec<f64>,
    /// Second derivatives `∂²ψ_α/∂x_u∂x_v`, row-major.
    pub hessian: Vec<f64>,
}

impl FreeEnergy {
    /// The free energies of `fluid`; fails with the index of a species whose second derivatives have more than `most`
    /// operations, or grow beyond the limits of formulas.
    pub fn new(fluid: &Fluid, most: usize) -> Result<FreeEnergy, usize> {
        let variables = fluid.variables();
        let excess = fluid
            .excess
            .iter()
            .enumerate()
            .map(|(alpha, excess)| match excess {
                ExcessFreeEnergy::Formula(psi) => differentiated(psi, variables, most)
                    .map(|outputs| Excess::Formula {
                        program: Program::new(&outputs.iter().collect::<Vec<_>>()),
                        outputs,
                    })
                    .map_err(|_| alpha),
                ExcessFreeEnergy::Curve(curve) => Ok(Excess::Curve(curve.clone())),
                ExcessFreeEnergy::Slopes(law) => Ok(Excess::Stated(law.clone())),
            })
            .collect::<Result<Vec<_>, _>>()?;
        let bounds = fluid.densities.iter().map(|d| d.bounds).collect();
        Ok(FreeEnergy { species: fluid.species.len(), variables, bounds, excess })
    }

    /// `ψ_α` of species `alpha` at the corrected densities `x`, density-major, continued where these are out of bounds.
    pub fn at(&self, alpha: usize, x: &[f64]) -> Psi {
        let mut psi = Psi::default();
        self.evaluate(alpha, x, &mut psi, &mut Work::default());
        psi
    }

    /// The value of `ψ_α` only.
    pub fn value(&self, alpha: usize, x: &[f64]) -> f64 {
        match &self.excess[alpha] {
            Excess::Formula { outputs, .. } if self.strays(outputs, x).is_empty() => outputs[0].value(x),
            _ => self.at(alpha, x).value,
        }
    }

    /// Computes [`FreeEnergy::at`] in the arrays of `psi`. Stated slopes have second derivatives of zero.
    pub fn evaluate(&self, alpha: usize, x: &[f64], psi: &mut Psi, work: &mut Work) {
        let n = self.variables;
        psi.gradient.clear();
        psi.gradient.resize(n, 0.0);
        psi.hessian.clear();
        psi.hessian.resize(n * n, 0.0);
        match &self.excess[alpha] {
            Excess::Formula { program, outputs } => {
                let strays = self.strays(outputs, x);
                let Work { values, registers } = work;
                values.resize(outputs.len(), 0.0);
                if strays.is_empty() {
                    program.eval(x, values, registers);
                } else {
                    self.continued(outputs, &strays, x, values);
                }
                psi.value = values[0];
                psi.gradient.copy_from_slice(&values[1..=n]);
                let places = (0..n).flat_map(|u| (u..n).map(move |v| [u, v]));
                for ([u, v], entry) in places.zip(&values[1 + n..]) {
                    psi.hessian[u * n + v] = *entry;
                    psi.hessian[v * n + u] = *entry;
                }
            }
            Excess::Curve(curve) => self.of_curve(curve, x, psi),
            Excess::Stated(law) => {
                psi.value = law.energy.value(x);
                psi.gradient.iter_mut().zip(&law.slopes).for_each(|(to, slope)| *to = slope.value(x));
            }
        }
    }

    /// [`FreeEnergy::at`] at as many points as there are `lanes`: `x[v * lanes + l]` is density v in lane l. The result has ψ, its
    /// gradient and its second derivatives, row-major, each in all lanes.
    pub fn evaluate_block(&self, alpha: usize, lanes: usize, x: &[f64]) -> Vec<f64> {
        let n = self.variables;
        let mut all = vec![0.0; (1 + n + n * n) * lanes];
        let in_block = match &self.excess[alpha] {
            Excess::Formula { program, .. } => {
                let mut found = vec![0.0; program.outputs() * lanes];
                run_best(EvaluateBlock { program, lanes, x, found: &mut found });
                let (first, second) = found.split_at((1 + n) * lanes);
                all[..(1 + n) * lanes].copy_from_slice(first);
                let places = (0..n).flat_map(|u| (u..n).map(move |v| [u, v]));
                for ([u, v], entry) in places.zip(second.chunks_exact(lanes.max(1))) {
                    for row in [u * n + v, v * n + u] {
                        all[(1 + n + row) * lanes..][..lanes].copy_from_slice(entry);
                    }
                }
                true
            }
            _ => false,
        };
        let (mut psi, mut work, mut at) = (Psi::default(), Work::default(), vec![0.0; n]);
        for lane in 0..lanes {
            (0..n).for_each(|v| at[v] = x[v * lanes + lane]);
            if in_block && !self.is_beyond(&at) {
                continue;
            }
            self.evaluate(alpha, &at, &mut psi, &mut work);
            all[lane] = psi.value;
            for (k, entry) in psi.gradient.iter().chain(&psi.hessian).enumerate() {
                all[(1 + k) * lanes + lane] = *entry;
            }
        }
        all
    }

    /// Whether a density is out of its bounds.
    fn is_beyond(&self, x: &[f64]) -> bool {
        let beyond =
            |(v, x): (usize, &f64)| self.bounds[v / self.species].is_some_and(|b| b.beyond(*x) != 0.0);
        x.iter().enumerate().any(beyond)
    }

    fn of_curve(&self, curve: &Curve, x: &[f64], psi: &mut Psi) {
        let n = self.variables;
        let own = curve.density * self.species..(curve.density + 1) * self.species;
        let total = x[own.clone()].iter().sum();
        let [value, slope, curvature] = match self.bounds[curve.density] {
            Some(bounds) if bounds.beyond(total) != 0.0 => {
                bounds.continued(curve.at(bounds.clamp(total)), bounds.beyond(total))
            }
            _ => curve.at(total),
        };
        psi.value = value;
        for u in own.clone() {
            psi.gradient[u] = slope;
            psi.hessian[u * n..][own.clone()].fill(curvature);
        }
    }

    /// The variables out of bounds in which ψ is not linear.
    fn strays(&self, outputs: &[Formula], x: &[f64]) -> Vec<Stray> {
        let stray = |v: usize| {
            let bounds = self.bounds[v / self.species]?;
            let beyond = bounds.beyond(x[v]);
            // A linear ψ needs no continuation.
            let goes_on = beyond == 0.0 || outputs[1 + v].is_constant().is_some();
            (!goes_on).then(|| Stray { variable: v, beyond, order: bounds.order(beyond) })
        };
        (0..self.variables).filter_map(stray).collect()
    }

    /// The continuation of [`Bounds`]: a polynomial of second order in each variable that is out of
    /// bounds, whose coefficients are ψ and its derivatives at the bounds.
    fn continued(&self, outputs: &[Formula], strays: &[Stray], x: &[f64], values: &mut [f64]) {
        let n = self.variables;
        let mut edge = x.to_vec();
        strays.iter().for_each(|s| edge[s.variable] -= s.beyond);
        let along: Vec<usize> = strays.iter().map(|s| s.variable).collect();
        let mut expansion = Expansion::default();
        // Derivatives with respect to strays are those of the polynomial, the others those of its coefficients.
        let mut derivative = |by: &[usize]| -> f64 {
            let others: Vec<usize> = by.iter().copied().filter(|v| !along.contains(v)).collect();
            let output = match others[..] {
                [] => 0,
                [u] => 1 + u,
                [u, v, ..] => 1 + n + u * n - u * (u + 1) / 2 + v,
            };
            continuation(expansion.coefficients(&outputs[output], &edge, &along), strays, by)
        };
        values[0] = derivative(&[]);
        (0..n).for_each(|u| values[1 + u] = derivative(&[u]));
        let pairs = (0..n).flat_map(|u| (u..n).map(move |v| [u, v]));
        values[1 + n..].iter_mut().zip(pairs).for_each(|(to, pair)| *to = derivative(&pair));
    }
}

/// Runs a program for a block of points.
struct EvaluateBlock<'a> {
    program: &'a Program,
    lanes: usize,
    x: &'a [f64],
    found: &'a mut [f64],
}

impl Loop for EvaluateBlock<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let EvaluateBlock { program, lanes, x, found } = self;
        program.eval_block_into(lanes, x, found.chunks_exact_mut(lanes.max(1)), &mut Vec::new());
    }
}

/// Scratch arrays of [`FreeEnergy::evaluate`].
#[derive(Debug, Default)]
pub struct Work {
    values: Vec<f64>,
    registers: Vec<f64>,
}

/// ψ, its gradient, and the upper triangle of its Hessian.
fn differentiated(psi: &Formula, variables: usize, most: usize) -> Result<Vec<Formula>, TooLarge> {
    let mut formulas = vec![psi.clone()];
    for v in 0..variables {
        formulas.push(psi.derivative(v)?);
    }
    let mut operations = 0;
    for u in 0..variables {
        for v in u..variables {
            let second = formulas[1 + u].derivative(v)?;
            operations += second.operations();
            if operations > most {
                return Err(TooLarge);
            }
            formulas.push(second);
        }
    }
    Ok(formulas)
}
