//! Errors in text files of LAMMPS's formats, and readers of their numbers.

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct TextError {
    /// Line numbers are counted from 1.
    pub line: usize,
    pub problem: Problem,
}

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    #[error("the file ends where {0} should be")]
    Ended(String),
    #[error("there is no {0}")]
    Missing(String),
    #[error("'{text}' is not a number for {what}")]
    NotNumber { what: String, text: String },
    #[error("{what} is {text}, but must be {allowed}")]
    OutOfRange { what: String, text: String, allowed: String },
    #[error("{found} columns where {expected} are expected")]
    Columns { expected: String, found: usize },
    #[error("{what}: {found} lines, but {expected} were announced")]
    Count { what: String, expected: usize, found: usize },
    #[error("{0} is given twice")]
    Duplicate(String),
    #[error("'{0}' is not understood")]
    Unknown(String),
    #[error("{0} cannot be read")]
    Unsupported(String),
    #[error("reading stops: {0}")]
    Read(String),
}

impl Problem {
    pub fn at(self, line: usize) -> TextError {
        TextError { line, problem: self }
    }
}

/// At most 40 characters of `text`, for messages.
pub fn shown(text: &str) -> String {
    let mut s: String = text.chars().take(40).collect();
    if s.len() < text.len() {
        s.push('…');
    }
    s
}

/// A number that is not `allowed`.
pub fn out_of_range(what: &str, text: &str, allowed: impl Into<String>, line: usize) -> TextError {
    Problem::OutOfRange { what: what.into(), text: shown(text), allowed: allowed.into() }.at(line)
}

/// Reads any number, including nan and inf.
pub fn any_f64(text: &str, what: &str, line: usize) -> Result<f64, TextError> {
    text.parse().map_err(|_| Problem::NotNumber { what: what.into(), text: shown(text) }.at(line))
}

pub fn finite(text: &str, what: &str, line: usize) -> Result<f64, TextError> {
    let x = any_f64(text, what, line)?;
    if x.is_finite() { Ok(x) } else { Err(out_of_range(what, text, "finite", line)) }
}

/// Reads a whole number from `min` to `max`.
pub fn whole(text: &str, what: &str, min: i64, max: i64, line: usize) -> Result<i64, TextError> {
    let number = |_| Problem::NotNumber { what: what.into(), text: shown(text) }.at(line);
    let n: i128 = text.parse().map_err(number)?;
    match i64::try_from(n) {
        Ok(n) if (min..=max).contains(&n) => Ok(n),
        _ => Err(out_of_range(what, text, format!("between {min} and {max}"), line)),
    }
}
