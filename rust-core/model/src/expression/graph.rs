//! Formulas as directed acyclic graphs in which equal parts occur once.

use std::collections::HashMap;

use super::MAX_NODES;
use super::error::TooLarge;
use super::function::Unary;

/// Index of a node in its graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Id(u32);

impl Id {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// An operation on earlier nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Node {
    Constant(Bits),
    Variable(u32),
    Add(Id, Id),
    Subtract(Id, Id),
    Multiply(Id, Id),
    Divide(Id, Id),
    Negate(Id),
    /// A power that is computed by multiplication.
    IntegerPower(Id, i32),
    Power(Id, Id),
    Unary(Unary, Id),
    /// The value `then` if `left <= right`, else `otherwise`: min, max and their derivatives.
    Select {
        left: Id,
        right: Id,
        then: Id,
        otherwise: Id,
    },
}

/// A constant; two constants are equal if they have the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Bits(u64);

impl Bits {
    pub fn new(value: f64) -> Self {
        // The addition turns −0 into 0, so that there is one zero.
        Self((value + 0.0).to_bits())
    }

    pub fn value(self) -> f64 {
        f64::from_bits(self.0)
    }
}

impl Node {
    pub fn constant(self) -> Option<f64> {
        if let Node::Constant(bits) = self { Some(bits.value()) } else { None }
    }

    /// The nodes that this operation works on.
    pub fn operands(self) -> impl Iterator<Item = Id> {
        let operands = match self {
            Node::Constant(_) | Node::Variable(_) => [None; 4],
            Node::Negate(a) | Node::IntegerPower(a, _) | Node::Unary(_, a) => [Some(a), None, None, None],
            Node::Add(a, b)
            | Node::Subtract(a, b)
            | Node::Multiply(a, b)
            | Node::Divide(a, b)
            | Node::Power(a, b) => [Some(a), Some(b), None, None],
            Node::Select { left, right, then, otherwise } => {
                [Some(left), Some(right), Some(then), Some(otherwise)]
            }
        };
        operands.into_iter().flatten()
    }

    /// The same operation on other nodes.
    pub fn with_operands(self, mut to: impl FnMut(Id) -> Id) -> Self {
        match self {
            Node::Constant(_) | Node::Variable(_) => self,
            Node::Negate(a) => Node::Negate(to(a)),
            Node::IntegerPower(a, n) => Node::IntegerPower(to(a), n),
            Node::Unary(function, a) => Node::Unary(function, to(a)),
            Node::Add(a, b) => Node::Add(to(a), to(b)),
            Node::Subtract(a, b) => Node::Subtract(to(a), to(b)),
            Node::Multiply(a, b) => Node::Multiply(to(a), to(b)),
            Node::Divide(a, b) => Node::Divide(to(a), to(b)),
            Node::Power(a, b) => Node::Power(to(a), to(b)),
            Node::Select { left, right, then, otherwise } => {
                Node::Select { left: to(left), right: to(right), then: to(then), otherwise: to(otherwise) }
            }
        }
    }
}

/// Matches `c · x⁻ⁿ`, which costs one division instead of a division and a product.
///
/// Returns c, x and n. All code that evaluates or prints a graph calls this function, so that all of it agrees.
pub(super) fn as_quotient(nodes: &[Node], node: Node) -> Option<(f64, Id, i32)> {
    let Node::Multiply(factor, power) = node else { return None };
    match (nodes[factor.index()], nodes[power.index()]) {
        (Node::Constant(c), Node::IntegerPower(base, n)) if n < 0 => Some((c.value(), base, -n)),
        _ => None,
    }
}

/// A growing graph: operands always precede the nodes that use them.
#[derive(Debug)]
pub(super) struct Graph {
    nodes: Vec<Node>,
    places: HashMap<Node, Id>,
    limit: usize,
}

impl Graph {
    /// An empty graph that may grow to [`MAX_NODES`].
    pub fn new() -> Self {
        Self::with_limit(MAX_NODES)
    }

    /// An empty graph with a limit, for work on a formula that was within bounds.
    pub fn with_limit(limit: usize) -> Self {
        Self { nodes: Vec::new(), places: HashMap::new(), limit }
    }

    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.index()]
    }

    /// Returns the index of `node`, added unless it exists; the module `simplify` simplifies.
    pub fn add_node(&mut self, node: Node) -> Result<Id, TooLarge> {
        let node = self.in_order(node);
        if let Some(&id) = self.places.get(&node) {
            return Ok(id);
        }
        if self.nodes.len() >= self.limit {
            return Err(TooLarge);
        }
        let id = Id(u32::try_from(self.nodes.len()).map_err(|_| TooLarge)?);
        self.nodes.push(node);
        self.places.insert(node, id);
        Ok(id)
    }

    /// Copies a list of nodes without simplification; returns the new index of each.
    pub fn import(&mut self, nodes: &[Node]) -> Result<Vec<Id>, TooLarge> {
        let mut places: Vec<Id> = Vec::with_capacity(nodes.len());
        for node in nodes {
            let id = self.add_node(node.with_operands(|id| places[id.index()]))?;
            places.push(id);
        }
        Ok(places)
    }

    /// The nodes that `root` depends on, and no others; `root` is last.
    pub fn extract(&self, root: Id) -> Vec<Node> {
        let mut needed = vec![false; root.index() + 1];
        needed[root.index()] = true;
        for index in (0..needed.len()).rev() {
            if needed[index] {
                self.nodes[index].operands().for_each(|id| needed[id.index()] = true);
            }
        }
        let mut places = vec![Id(0); needed.len()];
        let mut kept = Vec::new();
        for (index, node) in self.nodes[..needed.len()].iter().enumerate() {
            if needed[index] {
                places[index] = Id(kept.len() as u32);
                kept.push(node.with_operands(|id| places[id.index()]));
            }
        }
        kept
    }

    /// Orders operands so that a + b and b + a are one node, constants first.
    fn in_order(&self, node: Node) -> Node {
        let sorted = |of: fn(Id, Id) -> Node, a: Id, b: Id| {
            let key = |id: Id| (self.node(id).constant().is_none(), id);
            if key(b) < key(a) { of(b, a) } else { of(a, b) }
        };
        match node {
            Node::Add(a, b) => sorted(Node::Add, a, b),
            Node::Multiply(a, b) => sorted(Node::Multiply, a, b),
            _ => node,
        }
    }
}
