//! ψ and its slopes for blocks of particles of one species.

use super::vectors::{self, Loop};
use crate::model::curve::{Curve, CurveBlock};
use crate::model::expression::{Expansion, Formula, Program, TooLarge};
use crate::model::{Bounds, Fluid, StatedSlopes, Stray, continuation};
use psidpd_passes::instruction_set::InstructionSet;

/// `ψ_α` as a function of the densities with a pass.
#[derive(Debug, Clone)]
pub enum ExcessPlan {
    /// ψ does not depend on any density with a pass.
    Constant(f64),
    /// A formula of several variables.
    Formula(FormulaPlan),
    /// A function of the total of one density.
    Curve(CurvePlan),
}

/// A curve, and the variables whose sum is its argument.
#[derive(Debug, Clone)]
pub struct CurvePlan {
    pub curve: Curve,
    species: usize,
    /// Index of its density among the passes, by which its slopes are stored.
    pass: usize,
    bounds: Option<Bounds>,
}

/// A formula with its slopes.
#[derive(Debug, Clone)]
pub struct FormulaPlan {
    pub formula: Formula,
    /// Computes ψ, then ∂ψ/∂ñ for each variable of the passes.
    program: Program,
    outputs: Vec<Formula>,
    /// Variable of each slope.
    variables: Vec<usize>,
    bounded: Vec<BoundedVariable>,
    /// Whether the slopes are stated in the model, and not derived from `formula`.
    stated: bool,
}

/// A variable with bounds, beyond which ψ continues linearly or quadratically.
#[derive(Debug, Clone, Copy)]
struct BoundedVariable {
    variable: usize,
    bounds: Bounds,
}

/// Scratch arrays of [`ExcessPlan::evaluate`].
#[derive(Debug, Clone, Default)]
pub struct ExcessWork {
    set: InstructionSet,
    registers: Vec<f64>,
    point: Vec<f64>,
    expansion: Expansion,
    /// The variables of one lane that are out of their bounds.
    strays: Vec<Stray>,
    /// The variables, moved to their bounds where they are out of them; empty if none is.
    moved: Vec<f64>,
    totals: Vec<f64>,
    beyond: Vec<f64>,
    curve: CurveBlock,
}

impl ExcessPlan {
    /// Plans `psi` of species `alpha`, with slopes for `variables`.
    ///
    /// # Errors
    /// Fails if a derivative grows beyond the limits of the formula engine.
    pub fn of_formula(fluid: &Fluid, psi: Formula, variables: &[usize]) -> Result<ExcessPlan, TooLarge> {
        if let Some(value) = psi.is_constant() {
            return Ok(ExcessPlan::Constant(value));
        }
        let mut outputs = vec![psi.clone()];
        for v in variables {
            outputs.push(psi.derivative(*v)?);
        }
        let count = fluid.species.len();
        let bounded: Vec<_> = variables
            .iter()
            .enumerate()
            .filter_map(|(slope, &variable)| {
                let bounds = fluid.densities[variable / count].bounds?;
                // A linear ψ needs no continuation.
                outputs[1 + slope].is_constant().is_none().then_some(BoundedVariable { variable, bounds })
            })
            .collect();
        Ok(ExcessPlan::Formula(FormulaPlan {
            program: Program::new(&outputs.iter().collect::<Vec<_>>()),
            bounded,
            formula: psi,
            outputs,
            variables: variables.to_vec(),
            stated: false,
        }))
    }

    /// Plans a law of stated slopes.
    pub fn of_slopes(law: &StatedSlopes, variables: &[usize]) -> ExcessPlan {
        let acts = law.slopes.iter().any(|s| s.is_constant() != Some(0.0));
        if let (false, Some(value)) = (acts, law.energy.is_constant()) {
            return ExcessPlan::Constant(value);
        }
        let slopes = variables.iter().map(|v| law.slopes[*v].clone());
        let outputs: Vec<Formula> = std::iter::once(law.energy.clone()).chain(slopes).collect();
        ExcessPlan::Formula(FormulaPlan {
            program: Program::new(&outputs.iter().collect::<Vec<_>>()),
            bounded: Vec::new(),
            formula: law.energy.clone(),
            outputs,
            variables: variables.to_vec(),
            stated: true,
        })
    }

    /// Plans a curve, whose density is one of `passes`.
    pub fn of_curve(fluid: &Fluid, curve: Curve, passes: &[usize]) -> ExcessPlan {
        ExcessPlan::Curve(CurvePlan {
            species: fluid.species.len(),
            pass: passes.iter().position(|d| *d == curve.density).unwrap_or(0),
            bounds: fluid.densities[curve.density].bounds,
            curve,
        })
    }

    /// Omits the slopes from later evaluations, whose callers give no room for them.
    pub fn leave_out_slopes(&mut self) {
        if let ExcessPlan::Formula(plan) = self {
            plan.program = Program::new(&[&plan.formula]);
        }
    }

    /// Writes ψ and its slopes for each of the `lanes` of `psi`: ψ of lane `l` is `psi[l]`, slope `k` is `slopes[k *
    /// lanes + l]`, and variable `v` is `at[v * lanes + l]`. Returns the numbers of lanes with a
    /// variable below its bounds, and above.
    pub fn evaluate(
        &self,
        at: &[f64],
        psi: &mut [f64],
        slopes: &mut [f64],
        work: &mut ExcessWork,
    ) -> [u64; 2] {
        work.moved.clear();
        match self {
            ExcessPlan::Constant(value) => {
                psi.fill(*value);
                slopes.fill(0.0);
                [0; 2]
            }
            ExcessPlan::Formula(plan) => plan.evaluate(at, psi, slopes, work),
            ExcessPlan::Curve(plan) => plan.evaluate(at, psi, slopes, work),
        }
    }
}

impl ExcessWork {
    /// Creates scratch arrays for an instruction set.
    pub fn new(set: InstructionSet) -> ExcessWork {
        ExcessWork { set, ..ExcessWork::default() }
    }

    /// The densities at which a formula was last evaluated when it was asked for `at`.
    pub fn evaluated_at<'a>(&'a self, at: &'a [f64]) -> &'a [f64] {
        if self.moved.is_empty() { at } else { &self.moved }
    }
}

impl CurvePlan {
    fn evaluate(&self, at: &[f64], psi: &mut [f64], slopes: &mut [f64], work: &mut ExcessWork) -> [u64; 2] {
        let lanes = psi.len();
        let ExcessWork { totals, beyond, curve, .. } = work;
        totals.clear();
        totals.resize(lanes, 0.0);
        let first = self.curve.density * self.species;
        for values in at[first * lanes..][..self.species * lanes].chunks_exact(lanes) {
            totals.iter_mut().zip(values).for_each(|(total, value)| *total += value);
        }
        let mut count = [0; 2];
        if let Some(bounds) = self.bounds {
            beyond.clear();
            for total in totals.iter_mut() {
                let delta = bounds.beyond(*total);
                count[0] += (delta < 0.0) as u64;
                count[1] += (delta > 0.0) as u64;
                *total = bounds.clamp(*total);
                beyond.push(delta);
            }
        }
        self.curve.block(totals, curve);
        if let Some(bounds) = self.bounds.filter(|_| count != [0; 2]) {
            for (lane, delta) in beyond.iter().enumerate().filter(|(_, delta)| **delta != 0.0) {
                let at_bound = [curve.psi[lane], curve.slope[lane], curve.curvature[lane]];
                [curve.psi[lane], curve.slope[lane], _] = bounds.continued(at_bound, *delta);
            }
        }
        psi.copy_from_slice(&curve.psi);
        for (k, slope) in slopes.chunks_exact_mut(lanes).enumerate() {
            if k / self.species == self.pass {
                slope.copy_from_slice(&curve.slope);
            } else {
                slope.fill(0.0);
            }
        }
        count
    }
}

impl FormulaPlan {
    /// Variables and their slopes, if these are stated and not zero.
    pub fn stated_slopes(&self) -> Option<impl Iterator<Item = (usize, &Formula)>> {
        let acting = |(_, slope): &(usize, &Formula)| slope.is_constant() != Some(0.0);
        self.stated.then(|| self.variables.iter().copied().zip(&self.outputs[1..]).filter(acting))
    }

    fn evaluate(&self, at: &[f64], psi: &mut [f64], slopes: &mut [f64], work: &mut ExcessWork) -> [u64; 2] {
        let lanes = psi.len();
        let within = |b: &BoundedVariable| {
            let values = &at[b.variable * lanes..][..lanes];
            // The loop has no early return, so that it vectorises.
            !values.iter().fold(false, |out, x| out | (*x < b.bounds.low) | (*x > b.bounds.high))
        };
        let moves = !self.bounded.iter().all(within);
        if moves {
            work.moved.extend_from_slice(at);
            for BoundedVariable { variable, bounds } in &self.bounded {
                let values = &mut work.moved[variable * lanes..][..lanes];
                values.iter_mut().for_each(|x| *x = bounds.clamp(*x));
            }
        }
        let inside = if moves { &work.moved } else { at };
        let outputs = std::iter::once(&mut *psi).chain(slopes.chunks_exact_mut(lanes));
        let registers = &mut work.registers;
        vectors::run(
            work.set,
            EvaluateBlock { program: &self.program, lanes, at: inside, outputs, registers },
        );
        if moves { self.extend(at, psi, slopes, work) } else { [0; 2] }
    }

    /// Replaces ψ and slopes in the moved lanes by the continuation from the bounds. Returns the numbers of lanes with a
    /// variable below its bounds, and above.
    ///
    /// With the operator `E_k ψ = ψ + δ_k ψ_k + ½ δ_k² ψ_kk` at the bound for each variable out of
    /// bounds, ψ becomes `E_1 E_2 … ψ`; these commute with each other and with the slopes along the
    /// other variables.
    fn extend(&self, at: &[f64], psi: &mut [f64], slopes: &mut [f64], work: &mut ExcessWork) -> [u64; 2] {
        let lanes = psi.len();
        let ExcessWork { point, expansion, strays, moved, .. } = work;
        let mut count = [0; 2];
        for lane in 0..lanes {
            let stray = |b: &BoundedVariable| {
                let beyond = b.bounds.beyond(at[b.variable * lanes + lane]);
                (beyond != 0.0).then(|| Stray { variable: b.variable, beyond, order: b.bounds.order(beyond) })
            };
            strays.clear();
            strays.extend(self.bounded.iter().filter_map(stray));
            if strays.is_empty() {
                continue;
            }
            count[0] += strays.iter().any(|s| s.beyond < 0.0) as u64;
            count[1] += strays.iter().any(|s| s.beyond > 0.0) as u64;
            point.clear();
            point.extend(moved.chunks_exact(lanes).map(|values| values[lane]));
            let mut along = [0; Expansion::MOST];
            along.iter_mut().zip(strays.iter()).for_each(|(along, s)| *along = s.variable);
            let along = &along[..strays.len()];
            let coefficients = expansion.coefficients(&self.outputs[0], point, along);
            psi[lane] = continuation(coefficients, strays, &[]);
            if slopes.is_empty() {
                continue;
            }
            for (slope, v) in self.variables.iter().enumerate().filter(|(_, v)| along.contains(v)) {
                slopes[slope * lanes + lane] = continuation(coefficients, strays, &[*v]);
            }
            for (slope, v) in self.variables.iter().enumerate().filter(|(_, v)| !along.contains(v)) {
                let coefficients = expansion.coefficients(&self.outputs[1 + slope], point, along);
                slopes[slope * lanes + lane] = continuation(coefficients, strays, &[*v]);
            }
        }
        count
    }
}

/// Evaluates all outputs of a program.
struct EvaluateBlock<'a, O> {
    program: &'a Program,
    lanes: usize,
    at: &'a [f64],
    outputs: O,
    registers: &'a mut Vec<f64>,
}

impl<'o, O: Iterator<Item = &'o mut [f64]>> Loop for EvaluateBlock<'_, O> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        self.program.eval_block_into(self.lanes, self.at, self.outputs, self.registers);
    }
}
