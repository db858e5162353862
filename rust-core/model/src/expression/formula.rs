//! A scalar function of several variables.

use std::sync::Arc;

use super::error::TooLarge;
use super::function::{integer_power, select};
use super::graph::{Bits, Graph, Id, Node, as_quotient};

/// An immutable scalar function of variables, which are identified by index.
///
/// Equal parts are stored once and constants are folded; cloning is cheap. At most
/// [`MAX_NODES`](super::MAX_NODES) operations.
///
/// Where a function is not smooth its derivative is still defined:
///
/// - abs' is −1, 0 or 1, and 0 at the kink;
/// - min and max have the derivative of the argument they return, and of the first where the two
///   are equal.
///
/// Outside its domain a formula evaluates to an infinity or NaN, which the caller must check.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// Nodes with operands before operations and the whole formula last; never empty.
    nodes: Arc<[Node]>,
}

impl Formula {
    /// The formula with the value `value` everywhere.
    pub fn constant(value: f64) -> Self {
        Self::from_nodes(vec![Node::Constant(Bits::new(value))])
    }

    /// The formula that is variable `i`.
    pub fn variable(i: usize) -> Self {
        // No slice is long enough to have an element beyond this index.
        let index = u32::try_from(i).unwrap_or(u32::MAX);
        Self::from_nodes(vec![Node::Variable(index)])
    }

    pub(super) fn from_nodes(nodes: Vec<Node>) -> Self {
        Self { nodes: nodes.into() }
    }

    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The value, if the formula is a finite number without variables.
    pub fn is_constant(&self) -> Option<f64> {
        match *self.nodes {
            [Node::Constant(bits)] => Some(bits.value()),
            _ => None,
        }
    }

    /// Number of operations, constants and variables in the formula; equal parts count once.
    pub fn operations(&self) -> usize {
        self.nodes.len()
    }

    /// Whether variable `i` occurs in the formula, after simplification.
    pub fn depends_on(&self, i: usize) -> bool {
        self.nodes.iter().any(|node| matches!(*node, Node::Variable(v) if v as usize == i))
    }

    /// The exact derivative ∂/∂xᵢ of the formula.
    ///
    /// Fails only for formulas that are already near the limit of operations.
    pub fn derivative(&self, i: usize) -> Result<Self, TooLarge> {
        let variable = match u32::try_from(i) {
            Ok(variable) if self.depends_on(i) => variable,
            _ => return Ok(Self::constant(0.0)),
        };
        let mut graph = Graph::new();
        let places = graph.import(&self.nodes)?;
        let root = graph.differentiate(places[places.len() - 1], variable)?;
        Ok(Self::from_nodes(graph.extract(root)))
    }

    /// The formula `self − other`.
    ///
    /// Like all arithmetic on formulas, fails only beyond the limit of operations.
    pub fn minus(&self, other: &Self) -> Result<Self, TooLarge> {
        self.with(other, Graph::subtract)
    }

    /// The formula `self · other`.
    pub fn times(&self, other: &Self) -> Result<Self, TooLarge> {
        self.with(other, Graph::multiply)
    }

    /// The formula `self / other`.
    pub fn over(&self, other: &Self) -> Result<Self, TooLarge> {
        self.with(other, Graph::divide)
    }

    /// The formula `constant + Σ coefficient · variable`.
    pub fn linear(constant: f64, terms: impl IntoIterator<Item = (usize, f64)>) -> Result<Self, TooLarge> {
        let mut sum = Self::constant(constant);
        for (variable, coefficient) in terms {
            let term = Self::constant(coefficient).times(&Self::variable(variable))?;
            sum = sum.with(&term, Graph::add)?;
        }
        Ok(sum)
    }

    fn with(
        &self,
        other: &Self,
        operation: fn(&mut Graph, Id, Id) -> Result<Id, TooLarge>,
    ) -> Result<Self, TooLarge> {
        let mut graph = Graph::new();
        let left = graph.import(&self.nodes)?;
        let right = graph.import(&other.nodes)?;
        let root = operation(&mut graph, left[left.len() - 1], right[right.len() - 1])?;
        Ok(Self::from_nodes(graph.extract(root)))
    }

    /// The formula with variable `i` fixed at `value`; the other variables keep their indices.
    pub fn substitute(&self, i: usize, value: f64) -> Self {
        self.try_substitute(i, value)
            // This graph has no limit that could be exceeded.
            .unwrap_or_else(|TooLarge| self.clone())
    }

    fn try_substitute(&self, i: usize, value: f64) -> Result<Self, TooLarge> {
        let mut graph = Graph::with_limit(usize::MAX);
        let mut places = Vec::with_capacity(self.nodes.len());
        for &node in self.nodes.iter() {
            let at = |id: Id| places[id.index()];
            let id = match node {
                Node::Variable(v) if v as usize == i => graph.constant(value)?,
                Node::Constant(_) | Node::Variable(_) => graph.add_node(node)?,
                Node::Add(a, b) => graph.add(at(a), at(b))?,
                Node::Subtract(a, b) => graph.subtract(at(a), at(b))?,
                Node::Multiply(a, b) => graph.multiply(at(a), at(b))?,
                Node::Divide(a, b) => graph.divide(at(a), at(b))?,
                Node::Negate(a) => graph.negate(at(a))?,
                Node::IntegerPower(a, n) => graph.integer_power(at(a), n)?,
                Node::Power(a, b) => graph.power(at(a), at(b))?,
                Node::Unary(function, a) => graph.unary(function, at(a))?,
                Node::Select { left, right, then, otherwise } => {
                    graph.select(at(left), at(right), at(then), at(otherwise))?
                }
            };
            places.push(id);
        }
        Ok(Self::from_nodes(graph.extract(places[places.len() - 1])))
    }

    /// The value at a point, for occasional use; a [`Program`](super::Program) computes the same bits faster.
    ///
    /// # Panics
    ///
    /// Panics if `at` lacks a variable of the formula.
    pub fn value(&self, at: &[f64]) -> f64 {
        let values = self.values(at);
        values[values.len() - 1]
    }

    /// The greatest magnitude among constants, variables and results of operations at a point, to which
    /// rounding errors of the value are proportional; NaNs are ignored.
    ///
    /// # Panics
    ///
    /// Panics as [`value`](Self::value).
    pub fn greatest(&self, at: &[f64]) -> f64 {
        self.values(at).iter().fold(0.0, |most, value| value.abs().max(most))
    }

    /// The values of all nodes.
    fn values(&self, at: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for &node in self.nodes.iter() {
            let v = |id: Id| values[id.index()];
            let value = match node {
                Node::Constant(bits) => bits.value(),
                Node::Variable(index) => at[index as usize],
                Node::Add(a, b) => v(a) + v(b),
                Node::Subtract(a, b) => v(a) - v(b),
                Node::Multiply(a, b) => match as_quotient(&self.nodes, node) {
                    Some((c, base, n)) => c / integer_power(v(base), n),
                    None => v(a) * v(b),
                },
                Node::Divide(a, b) => v(a) / v(b),
                Node::Negate(a) => -v(a),
                Node::IntegerPower(a, n) => integer_power(v(a), n),
                Node::Power(a, b) => v(a).powf(v(b)),
                Node::Unary(function, a) => function.apply(v(a)),
                Node::Select { left, right, then, otherwise } => {
                    select(v(left), v(right), v(then), v(otherwise))
                }
            };
            values.push(value);
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ast, Variables};
    use super::*;

    fn formula(text: &str) -> Formula {
        let variables =
            Variables { count: 2, names: [("x".to_owned(), vec![0]), ("y".to_owned(), vec![1])].into() };
        Formula::compile(&Ast::parse(text).unwrap(), &Default::default(), &variables).unwrap()
    }

    fn slope(text: &str) -> String {
        let slope = formula(text).derivative(0).unwrap();
        slope.with_names(&["x", "y"]).to_string()
    }

    #[test]
    fn the_greatest_number_on_the_way_is_found() {
        assert_eq!(formula("tanh(1e20*x)").greatest(&[-3.0, 5.0]), 3e20);
        assert_eq!(formula("x").greatest(&[-3.0, 5.0]), 3.0);
        // NaNs are ignored.
        assert_eq!(formula("sqrt(x)").greatest(&[-3.0, 5.0]), 3.0);
    }

    #[test]
    fn derivatives_are_what_one_would_write() {
        for (text, expected) in [
            ("3", "0"),
            ("y", "0"),
            ("x", "1"),
            ("3*x + y", "3"),
            ("x^2", "2 * x"),
            ("x^3*y", "3 * y * x^2"),
            ("1/x", "-1 / x^2"),
            ("y/x", "-y / x / x"),
            ("x^0.3", "0.3 * x^-0.7"),
            ("x^40", "40 * x^39"),
            ("2^x", "0.6931471805599453 * 2^x"),
            ("x^y", "y * x^(y - 1)"),
            ("ln(x)", "1 / x"),
            ("ln(3*x)", "1 / x"),
            ("exp(2*x)", "2 * exp(2 * x)"),
            ("sqrt(x)", "0.5 / sqrt(x)"),
            ("sin(x)", "cos(x)"),
            ("cos(x)", "-sin(x)"),
            ("tanh(x)", "1 - tanh(x)^2"),
            ("abs(x)", "sign(x)"),
            ("min(x, y)", "if(x <= y, 1, 0)"),
            ("max(2*x, x^2)", "if(x^2 <= 2 * x, 2, 2 * x)"),
        ] {
            assert_eq!(slope(text), expected, "{text}");
        }
    }

    #[test]
    fn kinks_have_the_documented_slope() {
        let at_tie = |text: &str| formula(text).derivative(0).unwrap().value(&[1.0, 1.0]);
        assert_eq!(at_tie("abs(x - y)"), 0.0);
        assert_eq!(at_tie("min(x, y)"), 1.0);
        assert_eq!(at_tie("min(y, x)"), 0.0);
        assert_eq!(at_tie("max(x, y)"), 1.0);
        assert_eq!(at_tie("max(y, x)"), 0.0);
    }

    #[test]
    fn repeated_derivatives_stay_small() {
        let text = "exp(-x^2)*ln(1 + x*y)/(1 + tanh(x)*sin(x*y))";
        let mut f = formula(text);
        for _ in 0..3 {
            f = f.derivative(0).unwrap();
        }
        assert!(f.nodes().len() < 600, "{}", f.nodes().len());
    }

    #[test]
    fn a_derivative_that_explodes_is_an_error() {
        let text = vec!["sin(x+exp(x*sin(y)))"; 140].join("*x^y^x/");
        let mut f = formula(&text);
        let outcome = (0..12).try_for_each(|_| {
            f = f.derivative(0)?;
            Ok(())
        });
        assert_eq!(outcome, Err(TooLarge));
    }

    #[test]
    fn substitution_folds() {
        let f = formula("ln(1 + x)*y + x^2");
        assert_eq!(f.substitute(0, 0.0), Formula::constant(0.0));
        assert!(!f.substitute(0, 2.0).depends_on(0));
        assert_eq!(f.substitute(0, 2.0).value(&[f64::NAN, 3.0]), f.value(&[2.0, 3.0]));
        // The value is undefined, which is no error of the substitution.
        let undefined = f.substitute(0, -2.0);
        assert_eq!(undefined.is_constant(), None);
        assert!(undefined.value(&[0.0, 1.0]).is_nan());
    }

    #[test]
    fn leaves() {
        assert_eq!(Formula::constant(2.5).is_constant(), Some(2.5));
        assert_eq!(Formula::variable(3).is_constant(), None);
        assert!(Formula::variable(3).depends_on(3));
        assert!(!Formula::variable(3).depends_on(2));
        assert_eq!(Formula::variable(1).value(&[4.0, 5.0]), 5.0);
        assert_eq!(Formula::variable(usize::MAX).derivative(usize::MAX).unwrap(), Formula::constant(0.0));
    }
}
