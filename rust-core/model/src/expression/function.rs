//! The functions that an expression may call.

/// A function of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Unary {
    Ln,
    Exp,
    Sqrt,
    Sin,
    Cos,
    Tanh,
    Abs,
    /// The derivative of `Abs`; expressions cannot call it.
    Sign,
}

impl Unary {
    pub fn apply(self, x: f64) -> f64 {
        match self {
            Unary::Ln => x.ln(),
            Unary::Exp => x.exp(),
            Unary::Sqrt => x.sqrt(),
            Unary::Sin => x.sin(),
            Unary::Cos => x.cos(),
            Unary::Tanh => x.tanh(),
            Unary::Abs => x.abs(),
            Unary::Sign => sign(x),
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Unary::Ln => "ln",
            Unary::Exp => "exp",
            Unary::Sqrt => "sqrt",
            Unary::Sin => "sin",
            Unary::Cos => "cos",
            Unary::Tanh => "tanh",
            Unary::Abs => "abs",
            Unary::Sign => "sign",
        }
    }
}

/// A function by the name that expressions use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Function {
    Unary(Unary),
    /// The logarithm to the base 10.
    Log10,
    Min,
    Max,
}

impl Function {
    pub const ALL: [(&str, Function); 11] = [
        ("abs", Function::Unary(Unary::Abs)),
        ("cos", Function::Unary(Unary::Cos)),
        ("exp", Function::Unary(Unary::Exp)),
        ("ln", Function::Unary(Unary::Ln)),
        ("log", Function::Unary(Unary::Ln)),
        ("log10", Function::Log10),
        ("max", Function::Max),
        ("min", Function::Min),
        ("sin", Function::Unary(Unary::Sin)),
        ("sqrt", Function::Unary(Unary::Sqrt)),
        ("tanh", Function::Unary(Unary::Tanh)),
    ];

    pub fn named(name: &str) -> Option<Function> {
        let entry = Self::ALL.iter().find(|entry| entry.0 == name)?;
        Some(entry.1)
    }

    pub fn name(self) -> &'static str {
        match self {
            Function::Unary(unary) => unary.name(),
            Function::Log10 => "log10",
            Function::Min => "min",
            Function::Max => "max",
        }
    }

    pub fn arguments(self) -> usize {
        match self {
            Function::Unary(_) | Function::Log10 => 1,
            Function::Min | Function::Max => 2,
        }
    }
}

/// The sign −1, 0 or 1; unlike [`f64::signum`] it is 0 at 0, the middle of the kink of |x|.
pub(super) fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns `then` if `left <= right`, `otherwise` if not, and NaN if the two cannot be compared.
///
/// min and max are implemented with it, so that an undefined argument makes the result undefined.
pub(super) fn select(left: f64, right: f64, then: f64, otherwise: f64) -> f64 {
    if left <= right {
        then
    } else if left > right {
        otherwise
    } else {
        f64::NAN
    }
}

/// xⁿ for n ≥ 1 by repeated squaring, with any multiplication: of numbers, or of instructions.
///
/// The chain for n starts with the chain for n/2, so powers of one base share their squares.
pub(super) fn multiply_up<T: Copy>(x: T, n: u32, mut multiply: impl FnMut(T, T) -> T) -> T {
    let mut power = x;
    for bit in (0..n.max(1).ilog2()).rev() {
        power = multiply(power, power);
        if n >> bit & 1 == 1 {
            power = multiply(power, x);
        }
    }
    power
}

/// xⁿ by exactly the operations that a program uses.
pub(super) fn integer_power(x: f64, n: i32) -> f64 {
    let power = multiply_up(x, n.unsigned_abs(), |a, b| a * b);
    match n {
        0 => 1.0,
        1.. => power,
        _ => 1.0 / power,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_multiply_up() {
        for n in -32..=32 {
            let expected = 1.25_f64.powi(n);
            assert!((integer_power(1.25, n) / expected - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn undefined_arguments_are_not_hidden() {
        assert!(select(f64::NAN, 1.0, 2.0, 3.0).is_nan());
        assert!(sign(f64::NAN).is_nan());
        assert_eq!(sign(-0.0), 0.0);
    }

    #[test]
    fn every_function_is_found_by_its_own_name() {
        for (_, function) in Function::ALL {
            assert_eq!(Function::named(function.name()), Some(function));
        }
    }
}
