//! Prints programs in WGSL, the language of graphics cards.

use std::fmt::Write;

use super::program::{Operation, Output, Program};

/// A program as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wgsl {
    /// Statements of a function's body, in single precision, which begin with the declarations of registers.
    pub statements: String,
    /// An expression for each output.
    pub outputs: Vec<String>,
}

impl Program {
    /// The program in WGSL. `variable` names the variables and `constant` the numbers; `prefix` begins the names of registers.
    ///
    /// The text calls `m_ln`, `m_exp`, `m_sqrt`, `m_sin`, `m_cos`, `m_tanh`, `m_abs`, `m_sign`, `m_pow(base, exponent)` and
    /// `m_select(left, right, then, otherwise)`, which the caller defines.
    pub fn wgsl(
        &self,
        prefix: &str,
        variable: impl Fn(usize) -> String,
        mut constant: impl FnMut(f64) -> String,
    ) -> Wgsl {
        let place = |place: usize| match place.checked_sub(self.variables) {
            None => variable(place),
            Some(register) => format!("{prefix}{register}"),
        };
        let mut statements = String::new();
        for register in 0..self.registers {
            // Writing to a String cannot fail.
            let _ = writeln!(statements, "    var {prefix}{register}: f32;");
        }
        for instruction in &self.code {
            let [a, b, then, otherwise] = instruction.from.map(place);
            let mut c = || constant(instruction.constant);
            let value = match instruction.operation {
                Operation::Set => c(),
                Operation::Add => format!("{a} + {b}"),
                Operation::Subtract => format!("{a} - {b}"),
                Operation::Multiply => format!("{a} * {b}"),
                Operation::Divide => format!("{a} / {b}"),
                Operation::Negate => format!("-{a}"),
                Operation::Shift => format!("{} + {a}", c()),
                Operation::SubtractFrom => format!("{} - {a}", c()),
                Operation::Scale => format!("{} * {a}", c()),
                Operation::DivideInto => format!("{} / {a}", c()),
                Operation::Power => format!("m_pow({a}, {b})"),
                Operation::PowerConstant => format!("m_pow({a}, {})", c()),
                Operation::Unary(function) => format!("m_{}({a})", function.name()),
                Operation::Select => format!("m_select({a}, {b}, {then}, {otherwise})"),
            };
            let to = place(self.variables + instruction.to);
            let _ = writeln!(statements, "    {to} = {value};");
        }
        let outputs = self
            .outputs
            .iter()
            .map(|output| match *output {
                Output::Constant(value) => constant(value),
                Output::Place(at) => place(at),
            })
            .collect();
        Wgsl { statements, outputs }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ast, Formula, Program, Variables};

    #[test]
    fn every_operation_has_a_text() {
        let variables =
            Variables { count: 2, names: [("x".to_owned(), vec![0]), ("y".to_owned(), vec![1])].into() };
        let text = |formula: &str| {
            let formula =
                Formula::compile(&Ast::parse(formula).unwrap(), &Default::default(), &variables).unwrap();
            let wgsl = Program::new(&[&formula]).wgsl("t", |v| format!("n[{v}]"), |c| format!("{c:?}"));
            let lines = wgsl.statements.lines().filter(|line| line.contains('='));
            lines.chain([&wgsl.outputs[0][..]]).map(str::trim).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(text("7"), "7.0");
        assert_eq!(text("x"), "n[0]");
        assert_eq!(text("(x + y)*(x - y)"), "t0 = n[0] + n[1]; t1 = n[0] - n[1]; t2 = t0 * t1; t2");
        assert_eq!(text("-x/y"), "t0 = n[0] / n[1]; t1 = -t0; t1");
        assert_eq!(text("3 + x"), "t0 = 3.0 + n[0]; t0");
        assert_eq!(text("3 - x"), "t0 = 3.0 - n[0]; t0");
        assert_eq!(text("3/x"), "t0 = 3.0 / n[0]; t0");
        assert_eq!(text("x^y"), "t0 = m_pow(n[0], n[1]); t0");
        assert_eq!(text("3*x^0.7"), "t0 = m_pow(n[0], 0.7); t1 = 3.0 * t0; t1");
        assert_eq!(text("2^x"), "t0 = 2.0; t1 = m_pow(t0, n[0]); t1");
        assert_eq!(text("tanh(x)"), "t0 = m_tanh(n[0]); t0");
        assert_eq!(text("min(x, y)"), "t0 = m_select(n[0], n[1], n[0], n[1]); t0");
    }
}
