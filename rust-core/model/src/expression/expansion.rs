//! Taylor coefficients of a formula in a few of its variables at once, by arithmetic on truncated
//! polynomials instead of symbolic derivatives: those of order twelve would fill pages.

use super::formula::Formula;
use super::function::{Unary, integer_power, multiply_up, select, sign};
use super::graph::{Id, Node};

/// Work space for expanding formulas to second order in each of several variables.
///
/// The coefficients of `f(x + ε)` in `Π ε_k^{m_k}`, `m_k = 0, 1, 2`, are `Π (1/m_k!) ∂^{m_k}/∂x_k^{m_k} f`, mixed
/// derivatives included. Evaluating the formula with polynomials in place of numbers, without every `ε_k³`, yields them.
#[derive(Debug, Clone, Default)]
pub struct Expansion {
    /// For each number of variables the products of monomials that are kept.
    products: Vec<Vec<[u16; 3]>>,
    /// Number of variables of the present expansion.
    variables: usize,
    /// The polynomial of each node.
    values: Vec<f64>,
    nilpotent: Vec<f64>,
    sum: Vec<f64>,
    product: Vec<f64>,
}

impl Expansion {
    /// Most variables that a formula is expanded in: `k` variables have `3^k` coefficients.
    pub const MOST: usize = 6;

    /// The coefficients of `formula` around `at` in the variables `along`; the coefficient of `Π
    /// ε_k^{m_k}` is number `Σ m_k 3^k`.
    ///
    /// # Panics
    ///
    /// Panics if `along` has more than [`Expansion::MOST`] variables, or if `at` lacks a variable of the formula.
    pub fn coefficients(&mut self, formula: &Formula, at: &[f64], along: &[usize]) -> &[f64] {
        let count = along.len();
        assert!(count <= Self::MOST, "expansion in too many variables");
        while self.products.len() <= count {
            self.products.push(products(self.products.len()));
        }
        let size = 3usize.pow(count as u32);
        let nodes = formula.nodes();
        self.variables = count;
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        values.resize(nodes.len() * size, 0.0);
        for (index, node) in nodes.iter().enumerate() {
            let (before, rest) = values.split_at_mut(index * size);
            let of = |id: Id| &before[id.index() * size..][..size];
            let out = &mut rest[..size];
            match *node {
                Node::Constant(bits) => out[0] = bits.value(),
                Node::Variable(variable) => {
                    out[0] = at[variable as usize];
                    if let Some(k) = along.iter().position(|v| *v == variable as usize) {
                        out[3usize.pow(k as u32)] = 1.0;
                    }
                }
                Node::Add(a, b) => combine(out, of(a), of(b), |a, b| a + b),
                Node::Subtract(a, b) => combine(out, of(a), of(b), |a, b| a - b),
                Node::Negate(a) => combine(out, of(a), of(a), |a, _| -a),
                Node::Multiply(a, b) => self.multiply(of(a), of(b), out),
                Node::Divide(a, b) => {
                    let mut inverse = vec![0.0; size];
                    self.compose(of(b), &mut inverse, |b, t| power_series(t, -1.0, |m| b.powi(m as i32)));
                    self.multiply(of(a), &inverse, out);
                }
                Node::IntegerPower(a, n) if n > 0 => self.integer_power(of(a), n as u32, out),
                Node::IntegerPower(a, n) => {
                    let power = |a: f64| move |m: f64| integer_power(a, m as i32);
                    self.compose(of(a), out, |a, t| power_series(t, f64::from(n), power(a)));
                }
                Node::Power(a, b) => self.power(of(a), of(b), out),
                Node::Unary(function, a) => self.unary(function, of(a), out),
                Node::Select { left, right, then, otherwise } => {
                    let choice = select(of(left)[0], of(right)[0], 1.0, 0.0);
                    match choice {
                        1.0 => out.copy_from_slice(of(then)),
                        0.0 => out.copy_from_slice(of(otherwise)),
                        _ => out.fill(f64::NAN),
                    }
                }
            }
        }
        self.values = values;
        &self.values[(nodes.len() - 1) * size..]
    }
}

fn combine(out: &mut [f64], a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) {
    out.iter_mut().zip(a.iter().zip(b)).for_each(|(out, (a, b))| *out = f(*a, *b));
}

/// All pairs of monomials whose product has no power above the second, and the product.
fn products(variables: usize) -> Vec<[u16; 3]> {
    let size = 3usize.pow(variables as u32);
    let digit = |index: usize, k: usize| index / 3usize.pow(k as u32) % 3;
    let stays = |a: usize, b: usize| (0..variables).all(|k| digit(a, k) + digit(b, k) <= 2);
    let mut products = Vec::new();
    for a in 0..size {
        for b in (0..size).filter(|b| stays(a, *b)) {
            products.push([a as u16, b as u16, (a + b) as u16]);
        }
    }
    products
}

/// The binomial series `t_j = (p over j) x^{p−j}`, with the power of `x` as a function.
fn power_series(t: &mut [f64], p: f64, power: impl Fn(f64) -> f64) {
    let mut binomial = 1.0;
    for (j, t) in t.iter_mut().enumerate() {
        let j = j as f64;
        *t = if binomial == 0.0 { 0.0 } else { binomial * power(p - j) };
        binomial *= (p - j) / (j + 1.0);
    }
}

/// Arithmetic of polynomials in several ε, each with ε³ = 0.
impl Expansion {
    fn multiply(&self, a: &[f64], b: &[f64], out: &mut [f64]) {
        multiply(&self.products[self.variables], a, b, out);
    }

    fn integer_power(&self, a: &[f64], n: u32, out: &mut [f64]) {
        let products = &self.products[self.variables];
        // The chain of squares works on indices into a list of polynomials.
        let mut chain = vec![a.to_vec()];
        let last = multiply_up(0usize, n, |x, y| {
            let mut product = vec![0.0; a.len()];
            multiply(products, &chain[x], &chain[y], &mut product);
            chain.push(product);
            chain.len() - 1
        });
        out.copy_from_slice(&chain[last]);
    }

    /// Computes `f(a)` for a function whose Taylor coefficients at a number are written by `series`.
    fn compose(&mut self, a: &[f64], out: &mut [f64], series: impl Fn(f64, &mut [f64])) {
        // Each ε_k that occurs has powers up to the second, so that at most this many factors of
        // the other terms of `a` survive.
        let occurs = |k: u32| {
            let place = 3usize.pow(k);
            a.iter().enumerate().any(|(index, c)| !(index / place).is_multiple_of(3) && *c != 0.0)
        };
        let order = 2 * (0..self.variables as u32).filter(|k| occurs(*k)).count();
        let mut t = [0.0; 2 * Expansion::MOST + 1];
        series(a[0], &mut t[..=order]);
        let products = &self.products[self.variables];
        self.nilpotent.clear();
        self.nilpotent.extend_from_slice(a);
        self.nilpotent[0] = 0.0;
        self.sum.clear();
        self.sum.resize(a.len(), 0.0);
        self.sum[0] = t[order];
        self.product.resize(a.len(), 0.0);
        for j in (0..order).rev() {
            multiply(products, &self.sum, &self.nilpotent, &mut self.product);
            std::mem::swap(&mut self.sum, &mut self.product);
            self.sum[0] += t[j];
        }
        out.copy_from_slice(&self.sum);
    }

    fn power(&mut self, a: &[f64], b: &[f64], out: &mut [f64]) {
        let is_number = |p: &[f64]| p[1..].iter().all(|c| *c == 0.0);
        if is_number(b) {
            let exponent = b[0];
            self.compose(a, out, |a, t| power_series(t, exponent, |p| a.powf(p)));
        } else if is_number(a) {
            let base = a[0];
            self.compose(b, out, |b, t| exponential_series(t, base.powf(b), base.ln()));
        } else {
            let mut exponent = vec![0.0; a.len()];
            let mut logarithm = vec![0.0; a.len()];
            self.unary(Unary::Ln, a, &mut logarithm);
            self.multiply(b, &logarithm, &mut exponent);
            self.unary(Unary::Exp, &exponent, out);
        }
    }

    fn unary(&mut self, function: Unary, a: &[f64], out: &mut [f64]) {
        match function {
            Unary::Ln => self.compose(a, out, |x, t| {
                let mut power = 1.0;
                for (j, t) in t.iter_mut().enumerate() {
                    *t = if j == 0 { x.ln() } else { -power / j as f64 };
                    power /= -x;
                }
            }),
            Unary::Exp => self.compose(a, out, |x, t| exponential_series(t, x.exp(), 1.0)),
            Unary::Sqrt => {
                let root = |x: f64| move |p: f64| if p == 0.5 { x.sqrt() } else { x.powf(p) };
                self.compose(a, out, |x, t| power_series(t, 0.5, root(x)));
            }
            Unary::Sin => self.compose(a, out, |x, t| circular_series(t, [x.sin(), x.cos()])),
            Unary::Cos => self.compose(a, out, |x, t| circular_series(t, [x.cos(), -x.sin()])),
            Unary::Tanh => self.compose(a, out, |x, t| {
                // The recurrence follows from tanh′ = 1 − tanh².
                t[0] = x.tanh();
                for j in 1..t.len() {
                    let square: f64 = (0..j).map(|i| t[i] * t[j - 1 - i]).sum();
                    t[j] = (if j == 1 { 1.0 } else { 0.0 } - square) / j as f64;
                }
            }),
            Unary::Abs => {
                let sign = sign(a[0]);
                combine(out, a, a, |a, _| sign * a);
            }
            Unary::Sign => out[0] = sign(a[0]),
        }
    }
}

fn multiply(products: &[[u16; 3]], a: &[f64], b: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    products.iter().for_each(|&[i, j, k]| out[k as usize] += a[i as usize] * b[j as usize]);
}

/// The series `t_j = value · rateʲ / j!`.
fn exponential_series(t: &mut [f64], value: f64, rate: f64) {
    let mut term = value;
    for (j, t) in t.iter_mut().enumerate() {
        *t = term;
        term *= rate / (j as f64 + 1.0);
    }
}

/// The series `t_j = f⁽ʲ⁾/j!` of a function with `f″ = −f`, from `f` and `f′`.
fn circular_series(t: &mut [f64], [f, slope]: [f64; 2]) {
    let mut factorial = 1.0;
    for (j, t) in t.iter_mut().enumerate() {
        *t = [f, slope, -f, -slope][j % 4] / factorial;
        factorial *= j as f64 + 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ast, Variables};
    use super::*;

    fn formula(text: &str) -> Formula {
        let names = ["x", "y", "z"].map(str::to_owned);
        let variables =
            Variables { count: 3, names: names.into_iter().zip((0..3).map(|v| vec![v])).collect() };
        Formula::compile(&Ast::parse(text).unwrap(), &Default::default(), &variables).unwrap()
    }

    /// Compares every coefficient with symbolic derivatives.
    #[test]
    fn coefficients_are_derivatives() {
        let at = [0.7, 1.3, 0.4];
        let mut expansion = Expansion::default();
        for text in [
            "3",
            "x",
            "x*y - z/x",
            "(x + y)^5*z - 2/(x*y)^3",
            "ln(1 + x*y)*exp(-z*x)",
            "sqrt(x + y*z) + (x*y)^1.7 + 2^(x*z)",
            "sin(x*y + z)*cos(z - x)",
            "tanh(x*y*z + x)",
            "(x + z)^y",
            "abs(x - y)*z^2 + min(x*y, z)*max(x, y*z)",
            "(x*y + z)^40",
        ] {
            let f = formula(text);
            for along in [&[] as &[usize], &[0], &[2], &[1, 0], &[0, 1, 2]] {
                let found = expansion.coefficients(&f, &at, along).to_vec();
                for (index, found) in found.iter().enumerate() {
                    let (mut derivative, mut factorials) = (f.clone(), 1.0);
                    for (k, variable) in along.iter().enumerate() {
                        for m in 0..index / 3usize.pow(k as u32) % 3 {
                            derivative = derivative.derivative(*variable).unwrap();
                            factorials *= (m + 1) as f64;
                        }
                    }
                    let expected = derivative.value(&at) / factorials;
                    assert!(
                        (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
                        "{text} along {along:?}, {index}: {found} against {expected}"
                    );
                }
            }
        }
    }
}
