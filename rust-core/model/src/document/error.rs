use super::printable::printable;
use crate::expression::{ExpressionError, closest};
use std::borrow::Cow;
use std::fmt::{self, Write};
use std::ops::Range;
use std::sync::Arc;

/// A file's name and text, kept for messages.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    name: String,
    text: String,
    quoted: bool,
}

impl Source {
    /// Keeps the text `text` of the file `name`.
    pub fn new(name: &str, text: &str) -> Source {
        Source { name: name.to_owned(), text: text.to_owned(), quoted: true }
    }

    /// Keeps a text whose lines messages number but never show: a model file may name any file as a table.
    pub fn unquoted(name: &str, text: &str) -> Source {
        Source { quoted: false, ..Source::new(name, text) }
    }

    /// The file's name, as messages show it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file's text if messages may show it; otherwise empty.
    pub fn text(&self) -> &str {
        if self.quoted { &self.text } else { "" }
    }
}

/// The kinds of errors in a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileErrorKind {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// The text is not TOML.
    #[error("not valid TOML: {0}")]
    Syntax(String),
    /// Brackets nest too deeply.
    #[error("brackets or dotted keys nest deeper than {0}")]
    TooDeep(usize),
    /// A key is not known here.
    #[error("unknown key; known here: {known}")]
    UnknownKey {
        /// The keys that are known here.
        known: String,
    },
    /// A required key is missing.
    #[error("is missing")]
    Missing,
    /// A value has the wrong type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// Description of the expected type.
        expected: &'static str,
        /// Description of the type found.
        found: &'static str,
    },
    /// A name is not in a list of known names.
    #[error("unknown {what} \"{name}\"; known: {known}")]
    UnknownName {
        /// The kind of thing that is named.
        what: &'static str,
        /// The name in the file.
        name: String,
        /// The known names.
        known: String,
    },
    /// A formula does not parse or does not compile.
    #[error("{0}")]
    Expression(#[from] ExpressionError),
    /// A value is out of its domain, or values contradict each other.
    #[error("{0}")]
    Value(String),
}

/// A message in words about a value that is out of its domain.
impl From<String> for FileErrorKind {
    fn from(message: String) -> FileErrorKind {
        FileErrorKind::Value(message)
    }
}

impl From<&str> for FileErrorKind {
    fn from(message: &str) -> FileErrorKind {
        FileErrorKind::Value(message.to_owned())
    }
}

/// A place in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The file.
    pub source: Arc<Source>,
    /// The bytes of the file.
    pub span: Range<usize>,
    /// The dotted key of the value there; empty if there is none.
    pub key: String,
}

impl Place {
    /// An error at this place.
    pub fn error(&self, kind: impl Into<FileErrorKind>) -> FileError {
        FileError::new(&self.source, self.span.clone(), &self.key, kind)
    }
}

/// An error in a file: its kind, its place, and advice.
#[derive(Debug, Clone, PartialEq)]
pub struct FileError {
    /// The place that the error is about.
    pub place: Place,
    /// The kind of the error.
    pub kind: Box<FileErrorKind>,
    /// Advice how to mend the file.
    pub help: Option<String>,
}

impl FileError {
    /// An error at the bytes `span` of `source`, about `key` (dotted, may be empty).
    pub fn new(
        source: &Arc<Source>,
        span: Range<usize>,
        key: &str,
        kind: impl Into<FileErrorKind>,
    ) -> FileError {
        let kind = kind.into();
        let help = suggestion(key, &kind);
        let place = Place { source: Arc::clone(source), span, key: key.to_owned() };
        FileError { place, kind: Box::new(kind), help }
    }

    /// The same error with advice.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> FileError {
        self.help = Some(help.into());
        self
    }

    /// The line of the error, from 1.
    pub fn line(&self) -> usize {
        let text = self.place.source.text.as_bytes();
        let before = &text[..self.place.span.start.min(text.len())];
        1 + before.iter().filter(|b| **b == b'\n').count()
    }
}

/// Suggests the known name that was probably meant.
fn suggestion(key: &str, kind: &FileErrorKind) -> Option<String> {
    let (name, known) = match kind {
        FileErrorKind::UnknownKey { known } => (key.rsplit('.').next().unwrap_or(key), known),
        FileErrorKind::UnknownName { name, known, .. } => (name.as_str(), known),
        _ => return None,
    };
    Some(format!("did you mean `{}`?", closest(name, known.split(", "))?))
}

/// Most characters of a message, and of a key in it: names may be as long as a file.
const LONGEST: usize = 4000;
const LONGEST_KEY: usize = 200;

/// The text, cut after `longest` characters.
fn shortened(text: &str, longest: usize) -> Cow<'_, str> {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{} …", &text[..end]).into(),
        None => text.into(),
    }
}

/// Formats the error in one line: `file:line: key: what (what to do)`.
impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Place { source, key, .. } = &self.place;
        let mut text = source.name.clone();
        if !matches!(*self.kind, FileErrorKind::Unreadable(_)) {
            write!(text, ":{}", self.line())?;
        }
        if !key.is_empty() {
            write!(text, ": {}", shortened(key, LONGEST_KEY))?;
        }
        write!(text, ": {}", self.kind)?;
        if let Some(help) = &self.help {
            write!(text, " ({help})")?;
        }
        // The message shows keys and values as the file has them, control characters included.
        f.write_str(&shortened(&printable(&text), LONGEST))
    }
}

impl std::error::Error for FileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &*self.kind {
            FileErrorKind::Expression(error) => Some(error),
            _ => None,
        }
    }
}
