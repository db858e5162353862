//! Tables of numbers in files beside a model or scene file.

use super::{FileError, Source, Value};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

/// The environment variable that allows tables outside the folder of the file that names them.
const ANYWHERE: &str = "PSIDPD_TABLES_ANYWHERE";

/// Largest size of a table file, in bytes.
const LARGEST: u64 = 16 << 20;

/// Two columns of a table file, and the places of their rows.
#[derive(Debug, Clone)]
pub struct Columns {
    source: Arc<Source>,
    /// The first and the second column.
    pub columns: [Vec<f64>; 2],
    /// Range of bytes of each row in the file.
    rows: Vec<std::ops::Range<usize>>,
}

impl Columns {
    /// Reads the columns called `names` from the file that `value` names, relative to `directory`.
    ///
    /// Rows are lines of numbers separated by commas or blanks; `#` begins a comment. A non-numeric
    /// first row is a header, and the columns may then be in any order among others.
    ///
    /// # Errors
    /// Fails without the file or without a row, and for a row that is too short or not finite numbers.
    pub fn read(value: &Value, directory: &Path, names: [&str; 2]) -> Result<Columns, FileError> {
        let path = directory.join(value.string()?.value);
        let text = read_text(&path, LARGEST)
            .map_err(|message| value.error(format!("cannot read {}: {message}", path.display())))?;
        if !(lies_in(&path, directory) || std::env::var_os(ANYWHERE).is_some_and(|v| v == "1")) {
            let message = format!("{} lies outside the folder of the file that names it", path.display());
            return Err(value
                .error(message)
                .with_help(format!("put it there, or set {ANYWHERE}=1 to read tables from anywhere")));
        }
        Columns::parse(&path.display().to_string(), &text, names)
    }

    /// Reads the columns from a text, as [`Columns::read`]; `name` stands for the file in messages.
    ///
    /// # Errors
    /// Fails as [`Columns::read`].
    pub fn parse(name: &str, text: &str, names: [&str; 2]) -> Result<Columns, FileError> {
        let source = Arc::new(Source::unquoted(name, text));
        let mut table = Columns { source, columns: [Vec::new(), Vec::new()], rows: Vec::new() };
        let mut places = None;
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let span = start..start + line.len();
            start = span.end;
            let line = line.split('#').next().unwrap_or("").trim();
            if line.is_empty() {
                continue;
            }
            let fields: Vec<&str> = line
                .split(|c: char| c == ',' || c == ';' || c.is_whitespace())
                .filter(|f| !f.is_empty())
                .map(|f| f.trim_matches('"'))
                .collect();
            let error = |message: String| FileError::new(&table.source, span.clone(), "", message);
            let is_header = places.is_none() && fields.iter().any(|f| f.parse::<f64>().is_err());
            if is_header {
                let place = |name: &str| {
                    let place = fields.iter().position(|f| *f == name);
                    place.ok_or_else(|| error(format!("no column is called {name}")))
                };
                places = Some([place(names[0])?, place(names[1])?]);
                continue;
            }
            let at = *places.get_or_insert([0, 1]);
            let number = |place: usize| match fields.get(place).map(|f| f.parse::<f64>()) {
                Some(Ok(x)) if x.is_finite() => Ok(x),
                Some(_) => Err(error(format!("field {} is not a finite number", place + 1))),
                None => Err(error(format!("expected {} and {}", names[0], names[1]))),
            };
            let row = [number(at[0])?, number(at[1])?];
            table.rows.push(span);
            table.columns.iter_mut().zip(row).for_each(|(column, x)| column.push(x));
        }
        Ok(table)
    }

    /// An error in row `row`, or in the file as a whole if there is no such row.
    pub fn error(&self, row: usize, message: &str) -> FileError {
        FileError::new(&self.source, self.rows.get(row).cloned().unwrap_or(0..0), "", message)
    }
}

/// Whether the file is in the folder or below it, after links are resolved.
fn lies_in(path: &Path, folder: &Path) -> bool {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => path.starts_with(folder),
        _ => false,
    }
}

/// Opens a file to read. Refuses a pipe or a device, which could block the reader.
///
/// # Errors
/// Fails if the file cannot be opened, or is no regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Opening a pipe would block until it has a writer.
    let refused = || io::Error::new(io::ErrorKind::InvalidInput, "not a regular file");
    if !std::fs::metadata(path)?.is_file() {
        return Err(refused());
    }
    File::open(path)
}

/// Reads a file's text of at most `largest` bytes.
pub(super) fn read_text(path: &Path, largest: u64) -> Result<String, String> {
    let file = open_regular(path).map_err(|e| e.to_string())?;
    let mut bytes = Vec::new();
    file.take(largest + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > largest {
        return Err(format!("more than {largest} bytes"));
    }
    String::from_utf8(bytes).map_err(|_| "not UTF-8".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<[Vec<f64>; 2], String> {
        Columns::parse("t.csv", text, ["n", "psi"]).map(|t| t.columns).map_err(|e| e.to_string())
    }

    #[test]
    fn headers_separators_and_comments() {
        let expected = Ok([vec![0.0, 1.0], vec![2.0, 3.5]]);
        for text in [
            "0,2\n1,3.5\n",
            "n,psi\n0,2\n1,3.5",
            "# from an experiment\n\n\"psi\", \"rho\", \"n\"\r\n2, 7, 0\r\n3.5, 8, 1 # last\r\n",
            "n psi\n0\t2e0\n 1   3.5 \n",
        ] {
            assert_eq!(read(text), expected, "{text}");
        }
        assert_eq!(read(""), Ok([vec![], vec![]]));
    }

    #[test]
    fn errors_name_the_line() {
        for (text, message) in [
            ("0 1\n1\n", "t.csv:2: expected n and psi"),
            ("0 1\nx 2\n", "t.csv:2: field 1 is not a finite number"),
            ("0 1\n2 inf\n", "t.csv:2: field 2 is not"),
            ("n rho\n0 1\n", "t.csv:1: no column is called psi"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
}
