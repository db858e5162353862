//! Symbolic differentiation.

use super::error::TooLarge;
use super::function::Unary;
use super::graph::{Graph, Id, Node};

type Built = Result<Id, TooLarge>;

impl Graph {
    /// The derivative of `root` with respect to a variable.
    ///
    /// The derivative visits the graph from the leaves upwards, so that every shared part is differentiated once.
    pub fn differentiate(&mut self, root: Id, variable: u32) -> Built {
        let zero = self.constant(0.0)?;
        let mut slopes: Vec<Id> = Vec::with_capacity(root.index() + 1);
        for index in 0..=root.index() {
            let node = self.nodes()[index];
            let slope = match node {
                Node::Variable(v) if v == variable => self.constant(1.0)?,
                _ if node.operands().all(|id| slopes[id.index()] == zero) => zero,
                _ => self.chain_rule(node, &slopes)?,
            };
            slopes.push(slope);
        }
        Ok(slopes[root.index()])
    }

    /// The derivative of `node`, given those of the nodes before it.
    fn chain_rule(&mut self, node: Node, slopes: &[Id]) -> Built {
        let d = |id: Id| slopes[id.index()];
        match node {
            Node::Constant(_) | Node::Variable(_) => self.constant(0.0),
            Node::Add(a, b) => self.add(d(a), d(b)),
            Node::Subtract(a, b) => self.subtract(d(a), d(b)),
            Node::Negate(a) => self.negate(d(a)),
            Node::Multiply(a, b) => {
                let left = self.multiply(d(a), b)?;
                let right = self.multiply(a, d(b))?;
                self.add(left, right)
            }
            Node::Divide(a, b) => {
                // The quotient rule with q = a/b is (a' − q b')/b, which does not square b.
                let q = self.divide(a, b)?;
                let change = self.multiply(q, d(b))?;
                let difference = self.subtract(d(a), change)?;
                self.divide(difference, b)
            }
            Node::IntegerPower(a, n) => {
                let n_id = self.constant(f64::from(n))?;
                let less = self.constant(f64::from(n - 1))?;
                let power = self.power(a, less)?;
                let outer = self.multiply(n_id, power)?;
                self.multiply(outer, d(a))
            }
            Node::Power(a, b) => self.power_rule(node, a, b, d(a), d(b)),
            Node::Unary(function, a) => {
                let outer = self.slope_of(function, a)?;
                self.multiply(outer, d(a))
            }
            Node::Select { left, right, then, otherwise } => self.select(left, right, d(then), d(otherwise)),
        }
    }

    /// The power rule (aᵇ)' = b aᵇ⁻¹ a' + aᵇ ln(a) b', each term only where its slope is not zero.
    fn power_rule(&mut self, node: Node, a: Id, b: Id, da: Id, db: Id) -> Built {
        let zero = self.constant(0.0)?;
        let mut sum = zero;
        if da != zero {
            let one = self.constant(1.0)?;
            let less = self.subtract(b, one)?;
            let power = self.power(a, less)?;
            let outer = self.multiply(b, power)?;
            sum = self.multiply(outer, da)?;
        }
        if db != zero {
            let power = self.add_node(node)?;
            let log = self.unary(Unary::Ln, a)?;
            let outer = self.multiply(power, log)?;
            let term = self.multiply(outer, db)?;
            sum = self.add(sum, term)?;
        }
        Ok(sum)
    }

    /// The derivative f'(a) of a function.
    fn slope_of(&mut self, function: Unary, a: Id) -> Built {
        match function {
            Unary::Ln => self.integer_power(a, -1),
            Unary::Exp => self.unary(Unary::Exp, a),
            Unary::Sqrt => {
                let half = self.constant(0.5)?;
                let root = self.unary(Unary::Sqrt, a)?;
                self.divide(half, root)
            }
            Unary::Sin => self.unary(Unary::Cos, a),
            Unary::Cos => {
                let sine = self.unary(Unary::Sin, a)?;
                self.negate(sine)
            }
            Unary::Tanh => {
                let one = self.constant(1.0)?;
                let value = self.unary(Unary::Tanh, a)?;
                let square = self.integer_power(value, 2)?;
                self.subtract(one, square)
            }
            Unary::Abs => self.unary(Unary::Sign, a),
            Unary::Sign => self.constant(0.0),
        }
    }
}
