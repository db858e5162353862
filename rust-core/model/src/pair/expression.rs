use super::{FormEntry, PairForm};
use crate::document::keys::{Key, REQUIRED, ValueKind, keys};
use crate::document::{FileError, Located, Section};
use crate::expression::{Ast, Formula, Program, Variables};
use crate::number::{Number, formula_error, read_formula};
use std::collections::BTreeMap;
use std::path::Path;

/// A potential written as a formula of `r`; not shifted, so it should vanish at its range.
#[derive(Debug, Clone)]
pub struct ExpressionPair {
    /// Program for `φ` and `φ'` of the one variable `r`.
    pub program: Program,
    /// Program for `φ` alone.
    energy: Program,
    range: f64,
}

/// Number of distances at which a formula is evaluated at once.
const LANES: usize = 64;

/// The form `expression` in the model file.
#[derive(Debug, Clone)]
pub struct ExpressionEntry {
    phi: Located<Ast>,
    range: Number,
}

impl FormEntry for ExpressionEntry {
    type Form = ExpressionPair;

    const KEYS: &'static [Key] = keys! {
        "phi": ValueKind::Formula, REQUIRED,
            "The potential as a formula of `r`, the parameters and `kT`. It is not shifted, and should vanish \
             at the range."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\nphi = \"2*(1 - r^2)^2\"\nrange = \
             1.0";
        "range": ValueKind::NumberOrFormula, REQUIRED,
            "The distance at and beyond which the potential is zero."
            => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"expression\"\nphi = \"8*(0.5 - r)^2\"\nrange = \
             0.5";
    };

    fn read(table: &Section, _: &Path) -> Result<ExpressionEntry, FileError> {
        let phi = read_formula(&table.require("phi")?)?;
        Ok(ExpressionEntry { phi, range: Number::require(table, "range")? })
    }

    fn bind(&self, constants: &BTreeMap<String, f64>) -> Result<ExpressionPair, FileError> {
        let variables = Variables { count: 1, names: BTreeMap::from([("r".to_owned(), vec![0])]) };
        let range = self.range.positive(constants)?;
        Formula::compile(&self.phi.value, constants, &variables)
            .and_then(|phi| {
                let program = Program::new(&[&phi, &phi.derivative(0)?]);
                Ok(ExpressionPair { program, energy: Program::new(&[&phi]), range })
            })
            .map_err(|e| formula_error(&self.phi, e))
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
        for ((r, phi), slope) in r.chunks(LANES).zip(phi.chunks_mut(LANES)).zip(slope.chunks_mut(LANES)) {
            self.program.eval_block_into(r.len(), r, [phi, slope].into_iter(), &mut work);
        }
    }
}
