//! Arithmetic on graph nodes that omits needless operations.
//!
//! A term is treated as `coefficient · rest`. Coefficients are multiplied and divided as numbers and kept in
//! front, so that `2 * (c * n)` is one product, and like terms are summed. Only operations with a finite
//! result are folded; `1/0` stays a node that evaluates to an infinity. `0 * x` is zero for every x.

use super::error::TooLarge;
use super::function::{Unary, integer_power, select};
use super::graph::{Bits, Graph, Id, Node};

/// Largest exponent that is computed by multiplication; beyond it `powf` is as good.
const LARGEST_CHAIN: i32 = 32;

type Built = Result<Id, TooLarge>;

impl Graph {
    pub fn constant(&mut self, value: f64) -> Built {
        self.add_node(Node::Constant(Bits::new(value)))
    }

    pub fn as_constant(&self, id: Id) -> Option<f64> {
        self.node(id).constant()
    }

    pub fn add(&mut self, a: Id, b: Id) -> Built {
        let ((ca, ra), (cb, rb)) = (self.term(a), self.term(b));
        if self.is_zero(a) {
            return Ok(b);
        }
        if self.is_zero(b) {
            return Ok(a);
        }
        if ra == rb && (ca + cb).is_finite() {
            return self.scale(ca + cb, ra);
        }
        // A sum with a negative term becomes a difference.
        match (ra, rb) {
            (_, Some(_)) if cb < 0.0 => {
                let b = self.scale(-cb, rb)?;
                self.add_node(Node::Subtract(a, b))
            }
            (Some(_), _) if ca < 0.0 => {
                let a = self.scale(-ca, ra)?;
                self.add_node(Node::Subtract(b, a))
            }
            _ => self.add_node(Node::Add(a, b)),
        }
    }

    pub fn subtract(&mut self, a: Id, b: Id) -> Built {
        let b = self.negate(b)?;
        self.add(a, b)
    }

    pub fn negate(&mut self, a: Id) -> Built {
        let (c, rest) = self.term(a);
        self.scale(-c, rest)
    }

    pub fn multiply(&mut self, a: Id, b: Id) -> Built {
        let ((ca, ra), (cb, rb)) = (self.term(a), self.term(b));
        let Some(c) = self.folded(a, b, ca * cb) else { return self.add_node(Node::Multiply(a, b)) };
        let rest = match (ra, rb) {
            (Some(ra), Some(rb)) => Some(self.product(ra, rb)?),
            (rest, None) | (None, rest) => rest,
        };
        self.scale(c, rest)
    }

    pub fn divide(&mut self, a: Id, b: Id) -> Built {
        let ((ca, ra), (cb, rb)) = (self.term(a), self.term(b));
        let Some(c) = self.folded(a, b, ca / cb) else { return self.add_node(Node::Divide(a, b)) };
        let rest = match (ra, rb) {
            (rest, None) => rest,
            (None, Some(rb)) => Some(self.integer_power(rb, -1)?),
            (Some(ra), Some(rb)) => Some(match self.node(rb) {
                Node::IntegerPower(base, n) if n < 0 => {
                    let power = self.integer_power(base, -n)?;
                    self.product(ra, power)?
                }
                _ => self.add_node(Node::Divide(ra, rb))?,
            }),
        };
        self.scale(c, rest)
    }

    pub fn power(&mut self, a: Id, b: Id) -> Built {
        let Some(exponent) = self.as_constant(b) else { return self.add_node(Node::Power(a, b)) };
        if exponent.fract() == 0.0 && exponent.abs() <= f64::from(LARGEST_CHAIN) {
            return self.integer_power(a, exponent as i32);
        }
        match self.as_constant(a) {
            Some(base) if base.powf(exponent).is_finite() => self.constant(base.powf(exponent)),
            None if exponent == 0.5 => self.unary(Unary::Sqrt, a),
            _ => self.add_node(Node::Power(a, b)),
        }
    }

    /// The power aⁿ as products, for |n| up to [`LARGEST_CHAIN`].
    pub fn integer_power(&mut self, a: Id, n: i32) -> Built {
        match n {
            0 => return self.constant(1.0),
            1 => return Ok(a),
            _ => {}
        }
        let (c, rest) = self.term(a);
        let power = integer_power(c, n);
        let Some(rest) = rest else {
            return match power.is_finite() {
                true => self.constant(power),
                false => self.add_node(Node::IntegerPower(a, n)),
            };
        };
        if !power.is_normal() {
            return self.add_node(Node::IntegerPower(a, n));
        }
        let (base, n) = match self.node(rest) {
            Node::IntegerPower(base, m) if (m * n).abs() <= LARGEST_CHAIN => (base, m * n),
            _ => (rest, n),
        };
        let rest = match n {
            1 => base,
            _ => self.add_node(Node::IntegerPower(base, n))?,
        };
        self.scale(power, Some(rest))
    }

    pub fn unary(&mut self, function: Unary, a: Id) -> Built {
        match self.as_constant(a).map(|x| function.apply(x)) {
            Some(value) if value.is_finite() => self.constant(value),
            _ => self.add_node(Node::Unary(function, a)),
        }
    }

    pub fn select(&mut self, left: Id, right: Id, then: Id, otherwise: Id) -> Built {
        if then == otherwise || left == right {
            return Ok(then);
        }
        if let (Some(l), Some(r)) = (self.as_constant(left), self.as_constant(right)) {
            match select(l, r, 1.0, 0.0) {
                1.0 => return Ok(then),
                0.0 => return Ok(otherwise),
                _ => {}
            }
        }
        self.add_node(Node::Select { left, right, then, otherwise })
    }

    fn is_zero(&self, id: Id) -> bool {
        self.as_constant(id) == Some(0.0)
    }

    /// The coefficient `c` of an operation on `a` and `b`, unless it overflows or underflows.
    fn folded(&self, a: Id, b: Id, c: f64) -> Option<f64> {
        let plain = self.as_constant(a).is_some() && self.as_constant(b).is_some();
        let zero = c == 0.0 && (self.is_zero(a) || self.is_zero(b));
        (c.is_normal() || (plain && c.is_finite()) || zero).then_some(c)
    }

    /// A node as `coefficient · rest`; a constant has no rest.
    fn term(&self, id: Id) -> (f64, Option<Id>) {
        match self.node(id) {
            Node::Constant(c) => (c.value(), None),
            Node::Negate(rest) => (-1.0, Some(rest)),
            Node::Multiply(c, rest) => match self.as_constant(c) {
                Some(c) => (c, Some(rest)),
                None => (1.0, Some(id)),
            },
            _ => (1.0, Some(id)),
        }
    }

    /// The node of `coefficient · rest`.
    fn scale(&mut self, c: f64, rest: Option<Id>) -> Built {
        let Some(rest) = rest else { return self.constant(c) };
        if c == 0.0 {
            return self.constant(0.0);
        }
        if c == 1.0 {
            return Ok(rest);
        }
        if c == -1.0 {
            return match self.node(rest) {
                Node::Subtract(a, b) => self.add_node(Node::Subtract(b, a)),
                _ => self.add_node(Node::Negate(rest)),
            };
        }
        let c = self.constant(c)?;
        self.add_node(Node::Multiply(c, rest))
    }

    /// The product a · b without coefficients. Powers of one base are joined if their exponents have
    /// one sign, since x · x⁻¹ is not 1 at 0.
    fn product(&mut self, a: Id, b: Id) -> Built {
        let power = |id| match self.node(id) {
            Node::IntegerPower(base, n) => (base, n),
            _ => (id, 1),
        };
        let ((base, m), (other, n)) = (power(a), power(b));
        if base == other && (m > 0) == (n > 0) && (m + n).abs() <= LARGEST_CHAIN {
            return self.add_node(Node::IntegerPower(base, m + n));
        }
        self.add_node(Node::Multiply(a, b))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ast, Formula, Variables};

    fn simplified(text: &str) -> String {
        let names = ["x", "y", "z"].map(str::to_owned);
        let variables =
            Variables { count: 3, names: names.into_iter().zip([vec![0], vec![1], vec![2]]).collect() };
        let ast = Ast::parse(text).unwrap();
        let formula = Formula::compile(&ast, &Default::default(), &variables).unwrap();
        formula.with_names(&["x", "y", "z"]).to_string()
    }

    #[test]
    fn arithmetic_is_done_once() {
        for (text, expected) in [
            ("0*x", "0"),
            ("1*x", "x"),
            ("x + 0", "x"),
            ("0 - x", "-x"),
            ("x - x", "0"),
            ("x + x", "2 * x"),
            ("3*x - 2*x", "x"),
            ("2*(3*x)", "6 * x"),
            ("(2*x)*(3*y)", "6 * x * y"),
            ("--x", "x"),
            ("-(x - y)", "y - x"),
            ("x + -y", "x - y"),
            ("-2*y + x", "x - 2 * y"),
            ("x - 1", "x - 1"),
            ("1 - 2*x", "1 - 2 * x"),
            ("x*x", "x^2"),
            ("x*x^2", "x^3"),
            ("(x^2)^3", "x^6"),
            ("x^0", "1"),
            ("x^1", "x"),
            ("x^0.5", "sqrt(x)"),
            ("x^2.5", "x^2.5"),
            ("(2*x)^2", "4 * x^2"),
            ("(-x)^3", "-x^3"),
            ("1/x^6", "1 / x^6"),
            ("3/(2*x)", "1.5 / x"),
            ("x/4", "0.25 * x"),
            ("x/x^-2", "x^3"),
            ("x/y", "x / y"),
            ("x/x", "x / x"),
            ("ln(exp(1))", "1"),
            ("min(x, x)", "x"),
            ("min(1, 2) + max(1, 2)", "3"),
            ("x*y - y*x", "0"),
            ("x - (y - z)", "x + (z - y)"),
        ] {
            assert_eq!(simplified(text), expected, "{text}");
        }
    }

    #[test]
    fn coefficients_do_not_overflow_or_vanish() {
        assert_eq!(simplified("1e-200*(1e-200*x)"), "1e-200 * (1e-200 * x)");
        assert_eq!(simplified("1e-200*1e-200*x"), "0");
        assert_eq!(simplified("1e200*(1e200*x)"), "1e200 * (1e200 * x)");
    }
}
