//! ψ and its slopes, particle by particle, between the two passes over pairs.

use super::error::EngineError;
use super::excess::{ExcessPlan, ExcessWork};
use super::plan::Plan;
use std::ops::Range;

/// Particles per evaluation of ψ: enough to hide the interpreter, few enough for the first-level cache.
const LANES: usize = 64;

/// Scratch for evaluating ψ in lanes, and what was counted.
#[derive(Debug, Clone, Default)]
pub struct ExcessPass {
    members: Vec<u32>,
    at: Vec<f64>,
    correction: Vec<f64>,
    out: Vec<f64>,
    work: ExcessWork,
    /// Evaluations below and above the bounds of a density.
    pub out_of_bounds: [u64; 2],
}

/// Rows of numbers of consecutive particles, `first` being the number of the one that the first row is of.
pub struct Rows<'a> {
    pub first: usize,
    /// Which variable of ψ each column of the densities is.
    pub columns: &'a [usize],
    pub densities: &'a [f64],
    pub excess: &'a mut [f64],
    pub slopes: &'a mut [f64],
}

impl ExcessPass {
    /// Evaluates ψ and its slopes for particles `range`; `species` is negative for those that have
    /// none, `tag` names them in errors.
    pub fn run(
        &mut self,
        plan: &Plan,
        range: Range<usize>,
        species: impl Fn(usize) -> i32,
        tag: impl Fn(usize) -> i32,
        rows: &mut Rows,
    ) -> Result<(), EngineError> {
        for alpha in 0..plan.species.len() {
            if let ExcessPlan::Constant(value) = plan.excess[alpha] {
                if value != 0.0 {
                    for i in range.clone().filter(|i| species(*i) == alpha as i32) {
                        rows.excess[i - rows.first] = value;
                    }
                }
                continue;
            }
            let mut next = range.start;
            while next < range.end {
                self.members.clear();
                while next < range.end && self.members.len() < LANES {
                    if species(next) == alpha as i32 {
                        self.members.push(next as u32);
                    }
                    next += 1;
                }
                self.evaluate(plan, alpha, &tag, rows)?;
            }
        }
        Ok(())
    }

    /// ψ_α and its slopes, by the chain rule through ρ̃, for the particles in `members`.
    fn evaluate(
        &mut self,
        plan: &Plan,
        alpha: usize,
        tag: &impl Fn(usize) -> i32,
        rows: &mut Rows,
    ) -> Result<(), EngineError> {
        let count = plan.species.len();
        let variables = plan.densities.len() * count;
        let slope_width = plan.slope_width();
        let ExcessPass { members, at, correction, out, work, out_of_bounds } = self;
        let lanes = members.len();
        if lanes == 0 {
            return Ok(());
        }
        at.resize(variables * lanes, 0.0);
        correction.resize(variables * lanes, 0.0);
        if rows.columns.len() < variables {
            at.fill(0.0);
        }
        out.resize((1 + slope_width) * lanes, 0.0);
        let width = rows.columns.len();
        for (column, &v) in rows.columns.iter().enumerate() {
            let (d, beta) = (v / count, v % count);
            let polynomial = &plan.densities[d].correction[alpha * count + beta];
            if polynomial.is_identity() {
                let members = members.iter().map(|m| (*m as usize - rows.first) * width + column);
                for (at, place) in at[v * lanes..][..lanes].iter_mut().zip(members) {
                    *at = rows.densities[place];
                }
                correction[v * lanes..][..lanes].fill(1.0);
                continue;
            }
            for (lane, member) in members.iter().enumerate() {
                let n = rows.densities[(*member as usize - rows.first) * width + column];
                (at[v * lanes + lane], correction[v * lanes + lane]) = polynomial.at(n);
            }
        }
        let [low, high] = plan.excess[alpha].evaluate(lanes, at, out, work);
        out_of_bounds[0] += low;
        out_of_bounds[1] += high;
        for (lane, member) in members.iter().enumerate() {
            let i = *member as usize - rows.first;
            let mut finite = out[lane].is_finite();
            rows.excess[i] = out[lane];
            for k in 0..slope_width {
                let v = plan.passes[k / count] * count + k % count;
                let slope = out[(1 + k) * lanes + lane] * correction[v * lanes + lane];
                finite &= slope.is_finite();
                rows.slopes[i * slope_width + k] = slope;
            }
            if !finite {
                let densities: Vec<String> =
                    (0..variables).map(|v| format!("{:.6}", at[v * lanes + lane])).collect();
                return Err(EngineError::ExcessFreeEnergy {
                    tag: tag(*member as usize),
                    species: plan.species[alpha].clone(),
                    densities: densities.join(", "),
                });
            }
        }
        Ok(())
    }
}
