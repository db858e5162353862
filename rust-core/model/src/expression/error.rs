//! What can be wrong with an expression, and where.

use thiserror::Error;

use super::limits::{MAX_DEPTH, MAX_LENGTH, MAX_NODES};

/// A stretch of the text, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub offset: usize,
    pub length: usize,
}

impl Span {
    pub fn new(offset: usize, length: usize) -> Self {
        Self { offset, length }
    }

    /// The stretch from the start of `self` to the end of `last`.
    pub fn to(self, last: Self) -> Self {
        Self::new(self.offset, last.offset + last.length - self.offset)
    }

    pub fn error(self, kind: ErrorKind) -> ExpressionError {
        ExpressionError { kind, offset: self.offset, length: self.length }
    }
}

/// An expression that cannot be used, with the place in its text that says so.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{kind}")]
pub struct ExpressionError {
    /// What is wrong.
    pub kind: ErrorKind,
    /// The first byte of the offending text.
    pub offset: usize,
    /// How many bytes are offending; zero when something is missing.
    pub length: usize,
}

/// The ways in which an expression can be wrong.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A character that no expression contains.
    #[error("unexpected character {0:?}")]
    UnexpectedCharacter(char),

    /// A token where the grammar wants another.
    #[error("unexpected `{found}`, expected {expected}")]
    Unexpected {
        /// The token as written.
        found: String,
        /// What could have stood there.
        expected: &'static str,
    },

    /// The text ends where an operand is missing.
    #[error("the expression ends where a number, a name or `(` is expected")]
    UnexpectedEnd,

    /// An opening parenthesis without its partner.
    #[error("this `(` is never closed")]
    Unclosed,

    /// A name followed by `(` that is not a function.
    #[error("unknown function `{name}`{}", hint(.suggestion, .known))]
    UnknownFunction {
        /// The name as written.
        name: String,
        /// The functions there are.
        known: Vec<String>,
        /// The function that was probably meant.
        suggestion: Option<String>,
    },

    /// A function with too few or too many arguments.
    #[error("`{function}` takes {expected} argument(s), not {found}")]
    ArgumentCount {
        /// The function.
        function: &'static str,
        /// How many it takes.
        expected: usize,
        /// How many were given.
        found: usize,
    },

    /// A name that is neither a constant nor a variable.
    #[error("unknown name `{name}`{}", hint(.suggestion, .known))]
    UnknownName {
        /// The name as written.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The name that was probably meant.
        suggestion: Option<String>,
    },

    /// A name that stands for a variable beyond the number of variables.
    #[error("`{name}` stands for variable {index}, but there are only {count}")]
    NoSuchVariable {
        /// The name.
        name: String,
        /// The index it stands for.
        index: usize,
        /// The number of variables.
        count: usize,
    },

    /// A part without variables that is infinite or undefined, such as `1/0`.
    #[error("this has no finite value")]
    NonFinite,

    /// More text than [`MAX_LENGTH`].
    #[error("the expression is longer than {MAX_LENGTH} bytes")]
    TooLong,

    /// Deeper nesting than [`MAX_DEPTH`].
    #[error("parentheses, signs and powers are nested deeper than {MAX_DEPTH} levels")]
    TooDeep,

    /// More operations than [`MAX_NODES`].
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

/// A formula, or a derivative of one, with more than [`MAX_NODES`] operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the formula needs more than {MAX_NODES} operations")]
pub struct TooLarge;

fn hint(suggestion: &Option<String>, known: &[String]) -> String {
    match suggestion {
        Some(name) => format!(", did you mean `{name}`? (known: {})", known.join(", ")),
        None if known.is_empty() => ": no names are known here".into(),
        None => format!(" (known: {})", known.join(", ")),
    }
}
