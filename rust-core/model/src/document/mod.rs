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

/// Deepest nesting of brackets and of the parts of keys.
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
        Document::parse_in(path, &text)
    }

    /// Reads a text as the content of the file at `path`, whose name may be no valid text.
    ///
    /// # Errors
    /// Fails as [`Document::parse`].
    pub fn parse_in(path: &Path, text: &str) -> Result<Document, FileError> {
        let mut document = Document::parse(&path.display().to_string(), text)?;
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

/// The offset where brackets or the parts of a dotted key first nest deeper than allowed: the TOML reader recurses.
/// Strings and comments may hold any number of both.
fn too_deep(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    // The levels of each open bracket, with the parts of the key before it; parts of the present key, and of the last one.
    let (mut open, mut depth) = (Vec::new(), 0usize);
    let (mut parts, mut key, mut at) = (0usize, 0usize, 0);
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'#' => {
                at += bytes[at..].iter().take_while(|byte| **byte != b'\n').count();
                continue;
            }
            b'"' | b'\'' => {
                at = end_of_string(bytes, at);
                continue;
            }
            b'[' | b'{' => {
                open.push(1 + key);
                depth += 1 + key;
                (parts, key) = (0, 0);
            }
            b']' | b'}' => {
                depth -= open.pop().unwrap_or(0);
                (parts, key) = (0, 0);
            }
            b'=' => (parts, key) = (0, parts),
            b',' | b'\n' => (parts, key) = (0, 0),
            b'.' => parts += 1,
            _ => {}
        }
        if depth + parts > DEEPEST {
            return Some(at);
        }
        at += 1;
    }
    None
}

/// The offset behind the string that begins at `start`; one that is not closed ends with its line, or with the text if it may
/// have several lines.
fn end_of_string(bytes: &[u8], start: usize) -> usize {
    let quote = bytes[start];
    let long = bytes[start..].starts_with(&[quote; 3]);
    let width = if long { 3 } else { 1 };
    let mut at = start + width;
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'\\' if quote == b'"' => at += 1,
            b'\n' if !long => return at,
            byte if *byte == quote && (!long || bytes[at..].starts_with(&[quote; 3])) => {
                // One or two quotes may stand before the closing ones.
                let more = bytes[at + width..].iter().take(2).take_while(|byte| long && **byte == quote);
                return at + width + more.count();
            }
            _ => {}
        }
        at += 1;
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Only what nests counts: not brackets and dots in comments and strings, nor the points of numbers.
    #[test]
    fn strings_and_comments_do_not_nest() {
        let many = "[".repeat(100) + &"{a.".repeat(300);
        let numbers = format!("x = [{}]", "0.5, ".repeat(400));
        for text in [
            format!("# {many}\nx = 1"),
            format!("x = \"{many} \\\" {many}\""),
            format!("x = '{many} # '"),
            format!("x = \"\"\"\n{many} \"\" \\\"\"\"\n\"\"\"\"\""),
            format!("x = '''\n{many} \\'''"),
            numbers,
        ] {
            assert_eq!(too_deep(&text), None, "{text}");
            Document::parse("t", &text).unwrap_or_else(|error| panic!("{error}: {text}"));
        }
        let open = "x = \"no end\ny = ".to_owned() + &"[".repeat(100);
        for text in [open, format!("x = '''a''' \ny={many}"), format!("x = \"\"\ny = {many}"), many] {
            assert!(too_deep(&text).is_some(), "{text}");
        }
        // Keys with many parts nest within each other: as deep as allowed is no overflow of the stack.
        let key = ["a"; 8].join(".");
        for levels in [7, 64] {
            let text = format!("{}{key} = 1{}", format!("{key} = {{").repeat(levels), "}".repeat(levels));
            assert_eq!(too_deep(&text).is_some(), levels > 7);
            let _ = Document::parse("t", &text);
        }
    }
}
