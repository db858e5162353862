//! Compiles syntax to a formula: names become numbers and variables.

use std::collections::BTreeMap;

use super::Formula;
use super::ast::{Action, Ast, Binary, Step};
use super::error::{ErrorKind, ExpressionError, TooLarge};
use super::function::{Function, Unary};
use super::graph::{Graph, Id, Node};
use super::suggest::closest;

/// The meaning of the names in an expression.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Variables {
    /// Number of variables.
    pub count: usize,
    /// Each name stands for the sum of the variables with these indices: one for `n_A`, all for `n`.
    pub names: BTreeMap<String, Vec<usize>>,
}

impl Formula {
    /// Compiles the formula that `ast` describes.
    ///
    /// A name is searched among the variables first, then among the constants. A part without variables
    /// must be finite, and a division by a constant zero is an error.
    pub fn compile(
        ast: &Ast,
        constants: &BTreeMap<String, f64>,
        variables: &Variables,
    ) -> Result<Self, ExpressionError> {
        let mut compiler = Compiler { graph: Graph::new(), constants, variables };
        let mut operands: Vec<Id> = Vec::new();
        for step in &ast.steps {
            let arguments = match &step.action {
                Action::Number(_) | Action::Name(_) => 0,
                Action::Negate => 1,
                Action::Binary(_) => 2,
                Action::Call(function) => function.arguments(),
            };
            let rest = operands.len() - arguments;
            let id = compiler.step(step, &operands[rest..])?;
            operands.truncate(rest);
            operands.push(id);
        }
        let root = operands[operands.len() - 1];
        Ok(Self::from_nodes(compiler.graph.extract(root)))
    }
}

struct Compiler<'a> {
    graph: Graph,
    constants: &'a BTreeMap<String, f64>,
    variables: &'a Variables,
}

impl Compiler<'_> {
    fn step(&mut self, step: &Step, operands: &[Id]) -> Result<Id, ExpressionError> {
        let id = match &step.action {
            Action::Name(name) => self.name(name, step),
            action => self.operation(action, operands).map_err(ErrorKind::from),
        }
        .map_err(|kind| step.span.error(kind))?;

        let graph = &self.graph;
        let value = |&id: &Id| graph.as_constant(id);
        let undefined = match value(&id) {
            Some(value) => !value.is_finite(),
            // A constant operation that was not folded has no finite value.
            None => !operands.is_empty() && operands.iter().all(|id| value(id).is_some()),
        };
        let by_zero =
            step.action == Action::Binary(Binary::Divide) && operands.last().and_then(value) == Some(0.0);
        if undefined || by_zero {
            return Err(step.span.error(ErrorKind::NonFinite));
        }
        Ok(id)
    }

    fn operation(&mut self, action: &Action, operands: &[Id]) -> Result<Id, TooLarge> {
        let graph = &mut self.graph;
        match (action, operands) {
            (Action::Number(value), _) => graph.constant(*value),
            (Action::Negate, &[a]) => graph.negate(a),
            (Action::Call(Function::Unary(function)), &[a]) => graph.unary(*function, a),
            (Action::Call(Function::Log10), &[a]) => {
                let (natural, scale) =
                    (graph.unary(Unary::Ln, a)?, graph.constant(std::f64::consts::LOG10_E)?);
                graph.multiply(natural, scale)
            }
            (Action::Call(Function::Min), &[a, b]) => graph.select(a, b, a, b),
            (Action::Call(Function::Max), &[a, b]) => graph.select(b, a, a, b),
            (Action::Binary(binary), &[a, b]) => match binary {
                Binary::Add => graph.add(a, b),
                Binary::Subtract => graph.subtract(a, b),
                Binary::Multiply => graph.multiply(a, b),
                Binary::Divide => graph.divide(a, b),
                Binary::Power => graph.power(a, b),
            },
            _ => unreachable!("names are resolved before, and the parser counts operands"),
        }
    }

    fn name(&mut self, name: &str, step: &Step) -> Result<Id, ErrorKind> {
        debug_assert_eq!(name.len(), step.span.length);
        if let Some(indices) = self.variables.names.get(name) {
            return self.sum(name, indices);
        }
        if let Some(&value) = self.constants.get(name) {
            return Ok(self.graph.constant(value)?);
        }
        let mut known: Vec<String> = self.variables.names.keys().cloned().collect();
        known.extend(self.constants.keys().cloned());
        known.sort();
        known.dedup();
        Err(ErrorKind::Unknown {
            what: "name",
            name: name.to_owned(),
            suggestion: closest(name, known.iter().map(String::as_str)),
            known,
        })
    }

    fn sum(&mut self, name: &str, indices: &[usize]) -> Result<Id, ErrorKind> {
        let mut sum = self.graph.constant(0.0)?;
        for &index in indices {
            let count = self.variables.count;
            let variable = match u32::try_from(index) {
                Ok(variable) if index < count => variable,
                _ => {
                    let name = name.to_owned();
                    return Err(ErrorKind::NoSuchVariable { name, index, count });
                }
            };
            let variable = self.graph.add_node(Node::Variable(variable))?;
            sum = self.graph.add(sum, variable)?;
        }
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compile(text: &str) -> Result<Formula, ExpressionError> {
        let constants = [("kT", 1.5), ("b", 0.1), ("big", 1e300), ("bad", f64::NAN)];
        let names =
            [("n", vec![0, 1]), ("n_A", vec![0]), ("n_B", vec![1]), ("none", vec![]), ("far", vec![2])];
        Formula::compile(
            &Ast::parse(text)?,
            &constants.map(|(name, value)| (name.to_owned(), value)).into(),
            &Variables { count: 2, names: names.map(|(name, indices)| (name.to_owned(), indices)).into() },
        )
    }

    #[test]
    fn a_name_may_be_a_sum() {
        let f = compile("kT*n^2 + n_A").unwrap();
        assert_eq!(f.value(&[2.0, 3.0]), 1.5 * 25.0 + 2.0);
        assert_eq!(compile("n - n_A").unwrap().value(&[2.0, 3.0]), 3.0);
        assert_eq!(compile("none").unwrap().is_constant(), Some(0.0));
        let slope = compile("n^2").unwrap().derivative(1).unwrap();
        assert_eq!(slope.value(&[2.0, 3.0]), 10.0);
    }

    #[test]
    fn errors_point_at_the_byte() {
        for (text, offset, length, message) in [
            ("1 + KT*n", 4, 2, "unknown name `KT`, did you mean `kT`?"),
            ("n + zzz", 4, 3, "known: b, bad, big, far, kT, n, n_A, n_B, none"),
            ("n + far", 4, 3, "`far` stands for variable 2, but there are only 2"),
            ("n + 1/0", 4, 3, "no finite value"),
            ("n + 1/(2 - 2)*3", 4, 9, "no finite value"),
            ("n/(b - b)", 0, 9, "no finite value"),
            ("n*ln(-b)", 2, 6, "no finite value"),
            ("n + big*big", 4, 7, "no finite value"),
            ("n + 10^400", 4, 6, "no finite value"),
            ("sqrt(-1)*n", 0, 8, "no finite value"),
            ("2*bad*n", 2, 3, "no finite value"),
            ("0^-1", 0, 4, "no finite value"),
            ("(-2)^0.5", 0, 8, "no finite value"),
        ] {
            let error = compile(text).expect_err(text);
            assert_eq!((error.offset, error.length), (offset, length), "{text}");
            let found = error.to_string();
            assert!(found.contains(message), "{text}: {found}");
        }
    }

    #[test]
    fn names_of_the_text() {
        let ast = Ast::parse("-kT*ln(1 - b*n) - pi*n").unwrap();
        let names: Vec<_> = ast.names().collect();
        assert_eq!(names, [("kT", 1), ("b", 11), ("n", 13), ("n", 21)]);
    }
}
