//! Errors in expressions, with their places.

use thiserror::Error;

use super::{MAX_DEPTH, MAX_LENGTH, MAX_NODES};

/// A range of the text, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub offset: usize,
    pub length: usize,
}

impl Span {
    pub fn new(offset: usize, length: usize) -> Self {
        Self { offset, length }
    }

    /// The range from the start of `self` to the end of `last`.
    pub fn to(self, last: Self) -> Self {
        Self::new(self.offset, last.offset + last.length - self.offset)
    }

    pub fn error(self, kind: ErrorKind) -> ExpressionError {
        ExpressionError { kind, offset: self.offset, length: self.length }
    }
}

/// An expression that cannot be used, and the place of the error in its text.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{kind}")]
pub struct ExpressionError {
    /// The kind of the error.
    pub kind: ErrorKind,
    /// The first byte of the offending text.
    pub offset: usize,
    /// Number of offending bytes; zero when something is missing.
    pub length: usize,
}

/// The ways in which an expression can be wrong.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The text has a character that no expression contains.
    #[error("unexpected character {0:?}")]
    UnexpectedCharacter(char),

    /// The text has a token where the grammar expects another.
    #[error("unexpected `{found}`, expected {expected}")]
    Unexpected {
        /// The token in the text.
        found: String,
        /// Description of the expected token.
        expected: &'static str,
    },

    /// The text ends where an operand is missing.
    #[error("the expression ends where a number, a name or `(` is expected")]
    UnexpectedEnd,

    /// An opening parenthesis has no closing one.
    #[error("this `(` is never closed")]
    Unclosed,

    /// A function has too few or too many arguments.
    #[error("`{function}` takes {expected} argument(s), not {found}")]
    ArgumentCount {
        /// Name of the function.
        function: &'static str,
        /// Number of arguments that it takes.
        expected: usize,
        /// Number of arguments in the text.
        found: usize,
    },

    /// A name followed by `(` is no function, or another name is neither a constant nor a variable.
    #[error("unknown {what} `{name}`{}", hint(.suggestion, .known))]
    Unknown {
        /// What the name should be: `function` or `name`.
        what: &'static str,
        /// The name in the text.
        name: String,
        /// The known names.
        known: Vec<String>,
        /// The name that was probably meant.
        suggestion: Option<String>,
    },

    /// A name stands for a variable beyond the number of variables.
    #[error("`{name}` stands for variable {index}, but there are only {count}")]
    NoSuchVariable {
        /// The name of the variable.
        name: String,
        /// The index of the variable.
        index: usize,
        /// The number of variables.
        count: usize,
    },

    /// A part without variables is infinite or undefined, such as `1/0`.
    #[error("this has no finite value")]
    NonFinite,

    /// The text is longer than [`MAX_LENGTH`].
    #[error("the expression is longer than {MAX_LENGTH} bytes")]
    TooLong,

    /// The text nests deeper than [`MAX_DEPTH`].
    #[error("parentheses, signs and powers are nested deeper than {MAX_DEPTH} levels")]
    TooDeep,

    /// The formula has more operations than [`MAX_NODES`].
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

/// A formula, or a derivative of one, has more than [`MAX_NODES`] operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the formula needs more than {MAX_NODES} operations")]
pub struct TooLarge;

/// An error of the whole expression.
impl From<TooLarge> for ExpressionError {
    fn from(error: TooLarge) -> ExpressionError {
        Span::new(0, 0).error(ErrorKind::TooLarge(error))
    }
}

fn hint(suggestion: &Option<String>, known: &[String]) -> String {
    match suggestion {
        Some(name) => format!(", did you mean `{name}`? (known: {})", known.join(", ")),
        None if known.is_empty() => ": no names are known here".into(),
        None => format!(" (known: {})", known.join(", ")),
    }
}
