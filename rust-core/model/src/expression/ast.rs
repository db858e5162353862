//! A parsed expression, names not yet resolved.

use super::error::Span;
use super::function::Function;

/// The syntax of an expression.
///
/// | | |
/// |---|---|
/// | numbers | `2`, `0.5`, `.5`, `1e-3` |
/// | names | a letter or `_`, then letters, digits and `_`; `pi` is π |
/// | operators, loosest first | `+ -`, then `* /`, then signs, then `^` |
/// | functions | `ln` (or `log`), `log10`, `exp`, `sqrt`, `sin`, `cos`, `tanh`, `abs`, `min(a, b)`, `max(a, b)` |
///
/// `^` groups to the right and binds tighter than a sign on its left: `-x^2` is −(x²), `2^-1` is ½.
/// There is no implied multiplication.
#[derive(Debug, Clone, PartialEq)]
pub struct Ast {
    /// Steps in postfix order: every operation directly follows its operands. A tree stored as a list
    /// needs no recursion, however deep it is.
    pub(super) steps: Vec<Step>,
}

/// One operation, and the text of the operation with its operands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    pub action: Action,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Action {
    Number(f64),
    Name(String),
    Negate,
    Binary(Binary),
    Call(Function),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

impl Ast {
    /// The names that need a value, in the order of the text and as often as they occur, each with its
    /// first byte. Functions and `pi` are not included.
    pub fn names(&self) -> impl Iterator<Item = (&str, usize)> {
        self.steps.iter().filter_map(|step| match &step.action {
            Action::Name(name) => Some((name.as_str(), step.span.offset)),
            _ => None,
        })
    }
}
