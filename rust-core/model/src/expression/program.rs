//! Formulas as lists of instructions.

use super::function::{Unary, select};

/// Several formulas compiled for evaluation together.
///
/// A program computes shared parts once and leaves out unused parts. Integer powers are products; every other
/// power is [`f64::powf`]. A block evaluation runs each instruction over all lanes before the next, which
/// spreads the cost of interpreting, and plain loops vectorise. One point and a block give the same bits.
#[derive(Debug, Clone)]
pub struct Program {
    /// One more than the largest index of a variable in use.
    pub(super) variables: usize,
    pub(super) registers: usize,
    pub(super) code: Vec<Instruction>,
    pub(super) outputs: Vec<Output>,
}

/// An instruction `registers[to] = operation(from)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instruction {
    pub operation: Operation,
    pub constant: f64,
    /// Places of the operands; entries beyond their number are ignored. A place below the number of
    /// variables is a variable, the others are registers.
    pub from: [usize; 4],
    /// Number of operands.
    pub operands: usize,
    /// A register that contains no operand, so that inputs and output never overlap.
    pub to: usize,
}

/// Operations on operands a, b … and a constant c.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    /// Sets the constant c.
    Set,
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    /// Computes c + a.
    Shift,
    /// Computes c − a.
    SubtractFrom,
    /// Computes c · a.
    Scale,
    /// Computes c / a.
    DivideInto,
    Power,
    /// Computes a ^ c.
    PowerConstant,
    Unary(Unary),
    /// Selects c if a ≤ b, and d otherwise.
    Select,
}

/// The place of a result.
#[derive(Debug, Clone, Copy)]
pub(super) enum Output {
    Constant(f64),
    /// A variable or a register, as in [`Instruction::from`].
    Place(usize),
}

impl Program {
    /// Number of values that one evaluation computes.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Number of variables that one evaluation reads: one more than the largest index in use.
    pub fn variables(&self) -> usize {
        self.variables
    }

    /// Number of operations of one evaluation.
    pub fn operations(&self) -> usize {
        self.code.len()
    }

    /// Evaluates at one point: `at[v]` is variable v, `out[o]` becomes output o.
    ///
    /// `work` is scratch space: it grows when too small and is never shrunk.
    ///
    /// # Panics
    ///
    /// Panics if `at` is shorter than [`variables`](Self::variables) or `out` than [`outputs`](Self::outputs).
    pub fn eval(&self, at: &[f64], out: &mut [f64], work: &mut Vec<f64>) {
        self.eval_block(1, at, out, work);
    }

    /// Evaluates at several points: `at[v * lanes + l]` is variable v in lane l, and
    /// `out[o * lanes + l]` becomes output o.
    ///
    /// `work` is scratch space: it grows when too small and is never shrunk.
    ///
    /// # Panics
    ///
    /// Panics if `at` is shorter than `lanes` times [`variables`](Self::variables) or `out` than
    /// `lanes` times [`outputs`](Self::outputs).
    pub fn eval_block(&self, lanes: usize, at: &[f64], out: &mut [f64], work: &mut Vec<f64>) {
        if lanes > 0 {
            let out = &mut out[..self.outputs.len() * lanes];
            self.eval_block_into(lanes, at, out.chunks_exact_mut(lanes), work);
        }
    }

    /// Evaluates as [`eval_block`](Self::eval_block), with each output in the slice of `lanes` numbers
    /// that `out` returns. The function is inlined, so that the caller decides which vectors the loops
    /// are compiled to: the bits are the same with any.
    ///
    /// # Panics
    ///
    /// Panics if `at` is shorter than `lanes` times [`variables`](Self::variables), or if a
    /// slice of `out` has another length.
    #[inline(always)]
    pub fn eval_block_into<'o>(
        &self,
        lanes: usize,
        at: &[f64],
        out: impl Iterator<Item = &'o mut [f64]>,
        work: &mut Vec<f64>,
    ) {
        let at = &at[..self.variables * lanes];
        if work.len() < self.registers * lanes {
            work.resize(self.registers * lanes, 0.0);
        }
        for instruction in &self.code {
            let (before, rest) = work.split_at_mut(instruction.to * lanes);
            let (to, after) = rest.split_at_mut(lanes);
            let from = |operand: usize| {
                let place = instruction.from[operand];
                match place.checked_sub(self.variables) {
                    None => &at[place * lanes..][..lanes],
                    Some(register) if register < instruction.to => &before[register * lanes..][..lanes],
                    Some(register) => &after[(register - instruction.to - 1) * lanes..][..lanes],
                }
            };
            instruction.run(to, from);
        }
        for (out, output) in out.zip(&self.outputs) {
            match *output {
                Output::Constant(value) => out.fill(value),
                Output::Place(place) => out.copy_from_slice(match place.checked_sub(self.variables) {
                    None => &at[place * lanes..][..lanes],
                    Some(register) => &work[register * lanes..][..lanes],
                }),
            }
        }
    }
}

impl Instruction {
    #[inline(always)]
    fn run<'a>(&self, to: &mut [f64], from: impl Fn(usize) -> &'a [f64]) {
        let c = self.constant;
        match self.operation {
            Operation::Set => to.fill(c),
            Operation::Add => zip(to, from(0), from(1), |a, b| a + b),
            Operation::Subtract => zip(to, from(0), from(1), |a, b| a - b),
            Operation::Multiply => zip(to, from(0), from(1), |a, b| a * b),
            Operation::Divide => zip(to, from(0), from(1), |a, b| a / b),
            Operation::Negate => map(to, from(0), |a| -a),
            Operation::Shift => map(to, from(0), |a| c + a),
            Operation::SubtractFrom => map(to, from(0), |a| c - a),
            Operation::Scale => map(to, from(0), |a| c * a),
            Operation::DivideInto => map(to, from(0), |a| c / a),
            Operation::Power => zip(to, from(0), from(1), f64::powf),
            Operation::PowerConstant => map(to, from(0), |a| a.powf(c)),
            // Each function has its own loop, so that the simple ones vectorise.
            Operation::Unary(Unary::Ln) => map(to, from(0), |a| Unary::Ln.apply(a)),
            Operation::Unary(Unary::Exp) => map(to, from(0), |a| Unary::Exp.apply(a)),
            Operation::Unary(Unary::Sqrt) => map(to, from(0), |a| Unary::Sqrt.apply(a)),
            Operation::Unary(Unary::Abs) => map(to, from(0), |a| Unary::Abs.apply(a)),
            Operation::Unary(Unary::Sign) => map(to, from(0), |a| Unary::Sign.apply(a)),
            Operation::Unary(function) => map(to, from(0), |a| function.apply(a)),
            Operation::Select => {
                let (left, right) = (from(0), from(1));
                let branches = from(2).iter().zip(from(3));
                let choice = left.iter().zip(right).zip(branches);
                for (to, ((&l, &r), (&then, &otherwise))) in to.iter_mut().zip(choice) {
                    *to = select(l, r, then, otherwise);
                }
            }
        }
    }
}

#[inline(always)]
fn map(to: &mut [f64], a: &[f64], f: impl Fn(f64) -> f64) {
    for (to, &a) in to.iter_mut().zip(a) {
        *to = f(a);
    }
}

#[inline(always)]
fn zip(to: &mut [f64], a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) {
    for (to, (&a, &b)) in to.iter_mut().zip(a.iter().zip(b)) {
        *to = f(a, b);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ast, Formula, Variables};
    use super::*;

    fn formula(text: &str) -> Formula {
        let variables =
            Variables { count: 2, names: [("x".to_owned(), vec![0]), ("y".to_owned(), vec![1])].into() };
        Formula::compile(&Ast::parse(text).unwrap(), &Default::default(), &variables).unwrap()
    }

    #[test]
    fn it_can_be_shared_between_threads() {
        fn shareable<T: Clone + Send + Sync + std::fmt::Debug>() {}
        shareable::<Program>();
        shareable::<Formula>();
    }

    #[test]
    fn every_operation_runs() {
        let texts = [
            "7",
            "x",
            "x + y",
            "x - y",
            "x*y",
            "x/y",
            "-x",
            "x + 3",
            "3 - x",
            "3*x",
            "3/x^2",
            "x^5 + x^-3",
            "x^y",
            "x^0.7",
            "2^x",
            "ln(x) + exp(x) + sqrt(x)",
            "sin(x) + cos(x) + tanh(x)",
            "abs(x - y)",
            "min(x, y) - max(2*x, y)",
        ];
        let formulas = texts.map(formula);
        let program = Program::new(&formulas.iter().collect::<Vec<_>>());
        let (mut out, mut work) = (vec![0.0; texts.len()], Vec::new());
        for at in [[0.7, 1.3], [1.3, 0.7], [2.0, 2.0]] {
            program.eval(&at, &mut out, &mut work);
            for ((formula, text), out) in formulas.iter().zip(texts).zip(&out) {
                assert_eq!(*out, formula.value(&at), "{text}");
            }
        }
    }

    #[test]
    fn what_is_shared_is_computed_once() {
        let f = formula("exp(x*y)");
        let program = Program::new(&[&f, &f.derivative(0).unwrap(), &f.derivative(1).unwrap()]);
        // The operations are xy, exp, and one product for each derivative.
        assert_eq!(program.operations(), 4);

        let powers = [formula("x^2"), formula("x^4"), formula("x^8")];
        let program = Program::new(&powers.iter().collect::<Vec<_>>());
        assert_eq!(program.operations(), 3);
    }

    #[test]
    fn what_is_not_needed_is_left_out() {
        // The program has one division; the reciprocal in the quotient is not computed.
        assert_eq!(Program::new(&[&formula("3/x")]).operations(), 1);
        assert_eq!(Program::new(&[&formula("x")]).operations(), 0);
        assert_eq!(Program::new(&[]).operations(), 0);
    }

    #[test]
    fn registers_are_reused() {
        let chain = (0..50).fold("x".to_owned(), |text, _| format!("sin({text})"));
        let chain = &chain[..];
        assert!(Ast::parse(chain).is_ok());
        let program = Program::new(&[&formula(chain)]);
        assert_eq!(program.operations(), 50);
        assert_eq!(program.registers, 2);
    }

    #[test]
    fn no_allocation_once_the_work_space_is_large_enough() {
        let program = Program::new(&[&formula("exp(x)*ln(y)/(x + y)")]);
        let (at, mut out) = ([1.5; 2 * 64], [0.0; 64]);
        let mut work = Vec::new();
        program.eval_block(64, &at, &mut out, &mut work);
        let before = (work.as_ptr(), work.capacity());
        program.eval_block(64, &at, &mut out, &mut work);
        program.eval(&at, &mut out, &mut work);
        assert_eq!((work.as_ptr(), work.capacity()), before);
    }

    #[test]
    fn no_lanes_is_no_work() {
        Program::new(&[&formula("x")]).eval_block(0, &[], &mut [], &mut Vec::new());
    }
}
