//! Prints formulas as text.

use std::fmt::{self, Display, Formatter};

use super::Formula;
use super::graph::{Id, Node, as_quotient};

/// A formula with more operations than this, written out, prints shared parts by name instead of repeating them.
const LONGEST: usize = 200;

/// A formula that prints with names for its variables.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    formula: &'a Formula,
    names: &'a [&'a str],
}

impl Formula {
    /// The formula for printing, with variable `i` as `names[i]`, or `x{i}` beyond the names.
    pub fn with_names<'a>(&'a self, names: &'a [&'a str]) -> Named<'a> {
        Named { formula: self, names }
    }
}

impl Display for Formula {
    /// Prints infix, with variables `x0`, `x1` …; a long formula as `… where t1 = …, t2 = …`.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.with_names(&[]).fmt(f)
    }
}

impl Display for Named<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let nodes = self.formula.nodes();
        let root = nodes.len() - 1;
        let shared = shared(nodes);
        self.infix(f, root, &shared)?;
        let mut introduction = " where ";
        for (index, number) in shared.iter().enumerate() {
            if let Some(number) = number {
                write!(f, "{introduction}t{number} = ")?;
                self.infix(f, index, &shared)?;
                introduction = ", ";
            }
        }
        Ok(())
    }
}

/// Precedence of an operation; one of lower precedence inside a higher needs parentheses.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Strength {
    Sum,
    Product,
    Factor,
    Atom,
}

/// A piece of the formula that is still to be printed.
enum Piece {
    Text(&'static str),
    Number(f64),
    Exponent(i32),
    Variable(u32),
    /// A node, in parentheses if its precedence is lower than this.
    Node(Id, Strength),
}

impl Named<'_> {
    /// Prints one node, with a stack of pieces whose top is printed next.
    fn infix(&self, f: &mut Formatter<'_>, root: usize, shared: &[Option<usize>]) -> fmt::Result {
        let nodes = self.formula.nodes();
        let mut stack = pieces(nodes, nodes[root]).1;
        stack.reverse();
        while let Some(piece) = stack.pop() {
            match piece {
                Piece::Text(text) => f.write_str(text)?,
                Piece::Number(value) => number(f, value)?,
                Piece::Exponent(n) => write!(f, "{n}")?,
                Piece::Variable(index) => match self.names.get(index as usize) {
                    Some(name) => f.write_str(name)?,
                    None => write!(f, "x{index}")?,
                },
                Piece::Node(id, least) => {
                    if let Some(number) = shared[id.index()] {
                        write!(f, "t{number}")?;
                        continue;
                    }
                    let (strength, mut inner) = pieces(nodes, nodes[id.index()]);
                    if strength < least {
                        inner.insert(0, Piece::Text("("));
                        inner.push(Piece::Text(")"));
                    }
                    stack.extend(inner.into_iter().rev());
                }
            }
        }
        Ok(())
    }
}

/// One operation in infix, with operands as nodes.
fn pieces(nodes: &[Node], node: Node) -> (Strength, Vec<Piece>) {
    use Piece::{Exponent, Node as Operand, Number, Text, Variable};
    use Strength::{Atom, Factor, Product, Sum};

    let power = |base, n| match n {
        1 => vec![Operand(base, Factor)],
        _ => vec![Operand(base, Atom), Text("^"), Exponent(n)],
    };
    if let Some((c, base, n)) = as_quotient(nodes, node) {
        let mut text = vec![Number(c), Text(" / ")];
        text.extend(power(base, n));
        return (Product, text);
    }
    match node {
        Node::Constant(bits) => {
            let negative = bits.value().is_sign_negative();
            let strength = if negative { Product } else { Atom };
            (strength, vec![Number(bits.value())])
        }
        Node::Variable(index) => (Atom, vec![Variable(index)]),
        Node::Add(a, b) => match nodes[a.index()].constant() {
            Some(c) if c < 0.0 => (Sum, vec![Operand(b, Sum), Text(" - "), Number(-c)]),
            _ => (Sum, vec![Operand(a, Sum), Text(" + "), Operand(b, Product)]),
        },
        Node::Subtract(a, b) => (Sum, vec![Operand(a, Sum), Text(" - "), Operand(b, Product)]),
        Node::Multiply(a, b) => {
            // A coefficient in front reads the same with and without parentheses.
            let is_coefficient = nodes[a.index()].constant().is_some()
                && !matches!(nodes[b.index()], Node::Multiply(c, _) if nodes[c.index()].constant().is_some());
            let right = if is_coefficient { Product } else { Factor };
            (Product, vec![Operand(a, Product), Text(" * "), Operand(b, right)])
        }
        Node::Divide(a, b) => (Product, vec![Operand(a, Product), Text(" / "), Operand(b, Factor)]),
        Node::Negate(a) => (Product, vec![Text("-"), Operand(a, Product)]),
        Node::IntegerPower(base, n @ ..0) => {
            let mut text = vec![Text("1 / ")];
            text.extend(power(base, -n));
            (Product, text)
        }
        Node::IntegerPower(base, n) => (Factor, power(base, n)),
        Node::Power(a, b) => match nodes[b.index()].constant() {
            Some(exponent) => (Factor, vec![Operand(a, Atom), Text("^"), Number(exponent)]),
            None => (Factor, vec![Operand(a, Atom), Text("^"), Operand(b, Factor)]),
        },
        Node::Unary(function, a) => {
            (Atom, vec![Text(function.name()), Text("("), Operand(a, Sum), Text(")")])
        }
        Node::Select { left, right, then, otherwise } => {
            let mut text = if (left, right) == (then, otherwise) {
                vec![Text("min(")]
            } else if (right, left) == (then, otherwise) {
                vec![Text("max(")]
            } else {
                vec![Text("if("), Operand(left, Sum), Text(" <= "), Operand(right, Sum), Text(", ")]
            };
            text.extend([Operand(then, Sum), Text(", "), Operand(otherwise, Sum), Text(")")]);
            (Atom, text)
        }
    }
}

/// Prints the shortest digits that read back as the same number.
fn number(f: &mut Formatter<'_>, value: f64) -> fmt::Result {
    let digits = format!("{value:?}");
    f.write_str(digits.strip_suffix(".0").unwrap_or(&digits))
}

/// Numbers for the nodes that are printed once and then by name; a short formula has none.
fn shared(nodes: &[Node]) -> Vec<Option<usize>> {
    let mut sizes = vec![1_usize; nodes.len()];
    let mut uses = vec![0_usize; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for id in node.operands() {
            sizes[index] = sizes[index].saturating_add(sizes[id.index()]);
            uses[id.index()] += 1;
        }
    }
    let is_long = sizes[nodes.len() - 1] > LONGEST;
    let mut count = 0;
    let name = |(node, &uses): (&Node, &usize)| {
        let is_compound = node.operands().next().is_some();
        (is_long && uses > 1 && is_compound).then(|| {
            count += 1;
            count
        })
    };
    nodes.iter().zip(&uses).map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Ast, Variables};
    use super::*;

    fn formula(text: &str) -> Formula {
        let variables =
            Variables { count: 2, names: [("x0".to_owned(), vec![0]), ("x1".to_owned(), vec![1])].into() };
        Formula::compile(&Ast::parse(text).unwrap(), &Default::default(), &variables).unwrap()
    }

    #[test]
    fn what_is_printed_reads_back() {
        for text in [
            "x0 - 2 * x1 - 3",
            "-x0 * x1",
            "(-2)^x0",
            "2^-x0 + x0^(x1^2) + (x0^x1)^2",
            "x0 / (x1 / x0) / (x0 * x1)",
            "x0 * (x1 / x0) - x0 * x1 / 3",
            "-ln(1 - 0.016 * x0) - (x0 - (1 - x1))",
            "min(x0, x1) + max(x0, -x1)",
            "-3 / x0^2 - 1 / (2 * x1)",
            "1e-200 * (1e-200 * x0)",
            "1e300 * x0^-40 - x1^1e300",
        ] {
            let f = formula(text);
            let printed = f.to_string();
            let again = formula(&printed);
            assert_eq!(printed, again.to_string(), "{text}");
            for at in [[0.7, 1.3], [1.3, 0.4]] {
                let (value, again) = (f.value(&at), again.value(&at));
                let same = value == again || value.is_nan() && again.is_nan();
                assert!(same, "{text} printed as {printed}");
            }
        }
    }

    #[test]
    fn long_formulas_name_what_they_share() {
        // This formula, written out, doubles with every level.
        let text = (0..30).fold("x0".to_owned(), |text, _| format!("sin({text})^1.5"));
        let slope = formula(&text).derivative(0).unwrap();
        let printed = slope.to_string();
        assert!(printed.contains(" where t1 = "), "{printed}");
        assert!(printed.len() < 3000, "{}", printed.len());
    }
}
