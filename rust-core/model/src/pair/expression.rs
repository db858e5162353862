use super::PairForm;
use crate::expression::{Formula, Program, TooLarge};

/// A potential written as a formula of `r`; not shifted, so it should vanish at its range.
#[derive(Debug, Clone)]
pub struct ExpressionPair {
    /// Program for `φ` and `φ'` of the one variable `r`.
    program: Program,
    /// Program for `φ` alone.
    energy: Program,
    range: f64,
}

/// Number of distances at which a formula is evaluated at once.
const LANES: usize = 64;

impl ExpressionPair {
    /// Builds `φ` from a formula whose variable 0 is `r`, cut at `range`.
    pub fn new(phi: &Formula, range: f64) -> Result<ExpressionPair, TooLarge> {
        let slope = phi.derivative(0)?;
        Ok(ExpressionPair { program: Program::new(&[phi, &slope]), energy: Program::new(&[phi]), range })
    }
}

impl PairForm for ExpressionPair {
    fn range(&self) -> f64 {
        self.range
    }

    fn at(&self, r: f64) -> (f64, f64) {
        let mut out = [0.0; 2];
        self.program.eval(&[r], &mut out, &mut Vec::new());
        (out[0], out[1])
    }

    fn energies(&self, r: &[f64], phi: &mut [f64], work: &mut Vec<f64>) {
        for (r, phi) in r.chunks(LANES).zip(phi.chunks_mut(LANES)) {
            self.energy.eval_block(r.len(), r, phi, work);
        }
    }

    fn block(&self, r: &[f64], phi: &mut [f64], slope: &mut [f64]) {
        let mut work = Vec::new();
        let mut out = [0.0; 2 * LANES];
        for ((r, phi), slope) in r.chunks(LANES).zip(phi.chunks_mut(LANES)).zip(slope.chunks_mut(LANES)) {
            let lanes = r.len();
            let out = &mut out[..2 * lanes];
            self.program.eval_block(lanes, r, out, &mut work);
            phi.copy_from_slice(&out[..lanes]);
            slope.copy_from_slice(&out[lanes..]);
        }
    }
}
