//! Reading TOML files strictly, with errors that name file, line and key.
//!
//! Model files and scene files are read here. Tables state the keys that a file may have: see [`keys`].

mod columns;
mod error;
pub mod keys;
mod node;
mod printable;
mod section;

pub use columns::{Columns, open_regular};
pub use error::{FileError, FileErrorKind, Place, Source};
pub use printable::printable;
pub use section::{Located, Section, Value};

use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A TOML document read but not yet interpreted.
#[derive(Debug, Clone)]
pub struct Document {
    /// The file's name and text.
    pub source: Arc<Source>,
    /// The directory of the file, to which file names in the document are relative.
    pub directory: PathBuf,
    root: node::Table,
}

/// Largest size of a file, in bytes: far above any real file, and small enough to read.
const LARGEST: u64 = 16 << 20;

/// Deepest nesting of brackets; the TOML reader recurses.
const DEEPEST: usize = 64;

impl Document {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// Fails if the file cannot be read, is too large, is not UTF-8 or not TOML.
    pub fn open(path: &Path) -> Result<Document, FileError> {
        let name = path.display().to_string();
        let unreadable = |message: String| {
            FileError::new(&Arc::new(Source::new(&name, "")), 0..0, "", FileErrorKind::Unreadable(message))
        };
        let text = columns::read_text(path, LARGEST).map_err(unreadable)?;
        let mut document = Document::parse(&name, &text)?;
        document.directory = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(document)
    }

    /// Reads a text; `name` stands for the file in messages, and other files are searched in its folder.
    ///
    /// # Errors
    /// Fails if the text is not TOML or nests too deeply.
    pub fn parse(name: &str, text: &str) -> Result<Document, FileError> {
        let source = Arc::new(Source::new(name, text));
        if let Some(at) = too_deep(text) {
            return Err(FileError::new(&source, at..at + 1, "", FileErrorKind::TooDeep(DEEPEST)));
        }
        match toml::de::DeTable::parse(text) {
            Ok(table) => {
                let directory = Path::new(name).parent().unwrap_or(Path::new("")).to_owned();
                Ok(Document { source, directory, root: node::Table::new(table.into_inner()) })
            }
            Err(error) => Err(FileError::new(
                &source,
                error.span().unwrap_or(0..0),
                "",
                FileErrorKind::Syntax(error.message().to_owned()),
            )),
        }
    }

    /// The table of top-level keys.
    pub fn root(&self) -> Section<'_> {
        let place = Place { source: Arc::clone(&self.source), span: 0..0, key: String::new() };
        Section { place, table: &self.root }
    }
}

/// The offset where brackets or dotted keys first nest deeper than allowed, counting those in strings
/// and comments too: this bounds the recursion of the TOML reader, and is no grammar.
fn too_deep(text: &str) -> Option<usize> {
    let (mut depth, mut dots) = (0usize, 0usize);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            b'\n' => dots = 0,
            b'.' => dots += 1,
            _ => {}
        }
        if depth > DEEPEST || dots > 4 * DEEPEST {
            return Some(at);
        }
    }
    None
}
