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
    /// A named text.
    pub fn new(name: &str, text: &str) -> Source {
        Source { name: name.to_owned(), text: text.to_owned(), quoted: true }
    }

    /// A named text of which messages tell lines but show none: a model file may name any file as a table.
    pub fn unquoted(name: &str, text: &str) -> Source {
        Source { quoted: false, ..Source::new(name, text) }
    }

    /// The file's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file's text, where messages may show it; else nothing.
    pub fn text(&self) -> &str {
        if self.quoted { &self.text } else { "" }
    }

    /// Line and column, from 1, of a byte offset.
    pub fn line_column(&self, offset: usize) -> (usize, usize) {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let line = 1 + before.iter().filter(|b| **b == b'\n').count();
        let column = 1 + before.iter().rev().take_while(|b| **b != b'\n').count();
        (line, column)
    }
}

/// What is wrong in a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileErrorKind {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// Not TOML.
    #[error("not valid TOML: {0}")]
    Syntax(String),
    /// Brackets nest too deeply.
    #[error("brackets or dotted keys nest deeper than {0}")]
    TooDeep(usize),
    /// A key that means nothing here.
    #[error("unknown key; known here: {known}")]
    UnknownKey {
        /// The keys that would have been read.
        known: String,
    },
    /// A key that must be there.
    #[error("is missing")]
    Missing,
    /// A value of another type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// What should stand there.
        expected: &'static str,
        /// What stands there.
        found: &'static str,
    },
    /// A name that is not one of a list.
    #[error("unknown {what} \"{name}\"; known: {known}")]
    UnknownName {
        /// What the name should be.
        what: &'static str,
        /// What was written.
        name: String,
        /// What could have been.
        known: String,
    },
    /// A formula does not parse or does not compile.
    #[error("{0}")]
    Expression(#[from] ExpressionError),
    /// A value out of its domain, or a set of values that do not fit together.
    #[error("{0}")]
    Value(String),
}

/// An error in a file: what, where, and what to do.
#[derive(Debug, Clone, PartialEq)]
pub struct FileError {
    source: Arc<Source>,
    span: Range<usize>,
    key: String,
    kind: Box<FileErrorKind>,
    help: Option<String>,
}

impl FileError {
    /// An error at the bytes `span` of `source`, about `key` (dotted, may be empty).
    pub fn new(source: &Arc<Source>, span: Range<usize>, key: &str, kind: FileErrorKind) -> FileError {
        let help = suggestion(key, &kind);
        FileError { source: Arc::clone(source), span, key: key.to_owned(), kind: Box::new(kind), help }
    }

    /// The same error with advice.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> FileError {
        self.help = Some(help.into());
        self
    }

    /// The file.
    pub fn file(&self) -> &Source {
        &self.source
    }

    /// The bytes of the file that the error is about.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// The dotted key.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// What is wrong.
    pub fn kind(&self) -> &FileErrorKind {
        &self.kind
    }

    /// What to do about it.
    pub fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Line, from 1.
    pub fn line(&self) -> usize {
        self.source.line_column(self.span.start).0
    }
}

/// The known name that was probably meant.
fn suggestion(key: &str, kind: &FileErrorKind) -> Option<String> {
    let (name, known) = match kind {
        FileErrorKind::UnknownKey { known } => (key.rsplit('.').next().unwrap_or(key), known),
        FileErrorKind::UnknownName { name, known, .. } => (name.as_str(), known),
        _ => return None,
    };
    Some(format!("did you mean `{}`?", closest(name, known.split(", "))?))
}

/// The most characters of a message, and of a key in it: names may be as long as a file.
const LONGEST: usize = 4000;
const LONGEST_KEY: usize = 200;

/// The text, or its beginning.
fn shortened(text: &str, longest: usize) -> Cow<'_, str> {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{} …", &text[..end]).into(),
        None => text.into(),
    }
}

/// One line: `file:line: key: what (what to do)`.
impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = self.source.name.clone();
        if !matches!(*self.kind, FileErrorKind::Unreadable(_)) {
            write!(text, ":{}", self.line())?;
        }
        if !self.key.is_empty() {
            write!(text, ": {}", shortened(&self.key, LONGEST_KEY))?;
        }
        write!(text, ": {}", self.kind)?;
        if let Some(help) = &self.help {
            write!(text, " ({help})")?;
        }
        // Keys and values stand in it as they were written.
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
