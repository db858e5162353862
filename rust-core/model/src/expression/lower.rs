//! Compiles formulas to instructions.

use std::collections::HashMap;

use super::Formula;
use super::function::multiply_up;
use super::graph::{Graph, Id, Node, as_quotient};
use super::program::{Instruction, Operation, Output, Program};

impl Program {
    /// Compiles `outputs`, whose values keep this order.
    pub fn new(outputs: &[&Formula]) -> Self {
        let mut graph = Graph::with_limit(usize::MAX);
        let mut roots = Vec::with_capacity(outputs.len());
        for formula in outputs {
            let places = graph.import(formula.nodes());
            // The limit cannot be reached: so many nodes do not fit in memory.
            let places = places.expect("formulas that fit in memory");
            roots.push(places[places.len() - 1]);
        }
        let values = Values::new(graph.nodes());
        let outputs = roots
            .iter()
            .map(|root| match graph.node(*root) {
                Node::Constant(bits) => Output::Constant(bits.value()),
                _ => Output::Place(values.places[root.index()].unwrap_or_default()),
            })
            .collect();
        allocate(values.variables, &values.code, outputs)
    }
}

/// Instructions that each write a new place: variables first, then one place for each instruction.
struct Values<'a> {
    nodes: &'a [Node],
    variables: usize,
    code: Vec<Instruction>,
    known: HashMap<(Operation, u64, [usize; 4]), usize>,
    /// Place of each node's value; constants are part of the instructions.
    places: Vec<Option<usize>>,
}

impl<'a> Values<'a> {
    fn new(nodes: &'a [Node]) -> Self {
        let used = nodes.iter().map(|node| match *node {
            Node::Variable(index) => index as usize + 1,
            _ => 0,
        });
        let mut values = Self {
            nodes,
            variables: used.max().unwrap_or(0),
            code: Vec::new(),
            known: HashMap::new(),
            places: Vec::with_capacity(nodes.len()),
        };
        for &node in nodes {
            let place = values.node(node);
            values.places.push(place);
        }
        values
    }

    fn node(&mut self, node: Node) -> Option<usize> {
        use Operation::*;

        let place = match node {
            Node::Constant(_) => return None,
            Node::Variable(index) => index as usize,
            Node::Add(a, b) => match self.constant(a) {
                Some(c) => self.with_constant(Shift, c, b),
                None => self.of(Add, &[a, b]),
            },
            Node::Subtract(a, b) => match self.constant(a) {
                Some(c) => self.with_constant(SubtractFrom, c, b),
                None => self.of(Subtract, &[a, b]),
            },
            Node::Multiply(a, b) => {
                if let Some((c, base, n)) = as_quotient(self.nodes, node) {
                    let power = self.integer_power(base, n.unsigned_abs());
                    self.emit(DivideInto, c, &[power])
                } else if let Some(c) = self.constant(a) {
                    self.with_constant(Scale, c, b)
                } else {
                    self.of(Multiply, &[a, b])
                }
            }
            Node::Divide(a, b) => match self.constant(a) {
                Some(c) => self.with_constant(DivideInto, c, b),
                None => self.of(Divide, &[a, b]),
            },
            Node::Negate(a) => self.of(Negate, &[a]),
            Node::IntegerPower(a, n) => {
                let power = self.integer_power(a, n.unsigned_abs());
                match n {
                    0.. => power,
                    _ => self.emit(DivideInto, 1.0, &[power]),
                }
            }
            Node::Power(a, b) => match self.constant(b) {
                Some(c) => self.with_constant(PowerConstant, c, a),
                None => self.of(Power, &[a, b]),
            },
            Node::Unary(function, a) => self.of(Unary(function), &[a]),
            Node::Select { left, right, then, otherwise } => self.of(Select, &[left, right, then, otherwise]),
        };
        Some(place)
    }

    fn integer_power(&mut self, base: Id, n: u32) -> usize {
        let base = self.place(base);
        multiply_up(base, n, |a, b| self.emit(Operation::Multiply, 0.0, &[a.min(b), a.max(b)]))
    }

    fn of(&mut self, operation: Operation, operands: &[Id]) -> usize {
        let mut places = [0; 4];
        places.iter_mut().zip(operands).for_each(|(place, &id)| *place = self.place(id));
        if matches!(operation, Operation::Add | Operation::Multiply) {
            places[..2].sort_unstable();
        }
        self.emit(operation, 0.0, &places[..operands.len()])
    }

    fn with_constant(&mut self, operation: Operation, c: f64, operand: Id) -> usize {
        let place = self.place(operand);
        self.emit(operation, c, &[place])
    }

    /// The place of a node as an operand; only here does a constant get a place.
    fn place(&mut self, id: Id) -> usize {
        match (self.places[id.index()], self.constant(id)) {
            (Some(place), _) => place,
            (None, constant) => self.emit(Operation::Set, constant.unwrap_or(f64::NAN), &[]),
        }
    }

    fn emit(&mut self, operation: Operation, constant: f64, operands: &[usize]) -> usize {
        let mut from = [0; 4];
        from[..operands.len()].copy_from_slice(operands);
        let next = self.variables + self.code.len();
        let key = (operation, constant.to_bits(), from);
        let place = *self.known.entry(key).or_insert(next);
        if place == next {
            self.code.push(Instruction { operation, constant, from, operands: operands.len(), to: next });
        }
        place
    }

    fn constant(&self, id: Id) -> Option<f64> {
        self.nodes[id.index()].constant()
    }
}

/// Drops instructions without effect and gives the others as few registers as their order allows.
fn allocate(variables: usize, code: &[Instruction], mut outputs: Vec<Output>) -> Program {
    /// Marks places that are read after the last instruction.
    const FOREVER: usize = usize::MAX;

    // For each place the last instruction that reads it; an instruction that none reads is dead.
    let mut last_use: Vec<Option<usize>> = vec![None; variables + code.len()];
    for output in &outputs {
        if let Output::Place(place) = *output {
            last_use[place] = Some(FOREVER);
        }
    }
    for (index, instruction) in code.iter().enumerate().rev() {
        if last_use[instruction.to].is_some() {
            for &place in &instruction.from[..instruction.operands] {
                last_use[place] = last_use[place].max(Some(index));
            }
        }
    }

    // Variables keep their places; registers follow them.
    let mut moved: Vec<usize> = (0..last_use.len()).collect();
    let mut free = Vec::new();
    let mut registers = 0;
    let mut kept = Vec::new();
    for (index, instruction) in code.iter().enumerate() {
        if last_use[instruction.to].is_none() {
            continue;
        }
        // The register is taken before those of the operands are released, so that it differs from theirs.
        let to = free.pop().unwrap_or_else(|| {
            registers += 1;
            registers - 1
        });
        let mut from = instruction.from;
        for operand in 0..instruction.operands {
            let place = instruction.from[operand];
            from[operand] = moved[place];
            let is_first = !instruction.from[..operand].contains(&place);
            if place >= variables && last_use[place] == Some(index) && is_first {
                free.push(moved[place] - variables);
            }
        }
        moved[instruction.to] = variables + to;
        kept.push(Instruction { from, to, ..*instruction });
    }
    for output in &mut outputs {
        if let Output::Place(place) = output {
            *place = moved[*place];
        }
    }
    Program { variables, registers, code: kept, outputs }
}
