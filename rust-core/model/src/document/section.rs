use super::node::{Content, Entry, Node, Table};
use super::printable::is_control;
use super::{FileError, FileErrorKind, Place};
use std::fmt::Display;
use std::ops::Range;
use std::sync::Arc;

/// A value with its place in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Located<T> {
    /// The value, interpreted.
    pub value: T,
    /// The value's place.
    pub place: Place,
}

impl<T> Located<T> {
    /// An error about this value.
    pub fn error(&self, kind: impl Into<FileErrorKind>) -> FileError {
        self.place.error(kind)
    }

    /// Converts the value and keeps its place.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Located<U> {
        Located { value: f(self.value), place: self.place }
    }
}

impl Located<String> {
    /// The choice of this name; fails if there is none.
    pub fn among<N: AsRef<str>, T>(
        &self,
        what: &'static str,
        choices: impl IntoIterator<Item = (N, T)>,
    ) -> Result<T, FileError> {
        let mut known = Vec::new();
        for (name, choice) in choices {
            if name.as_ref() == self.value {
                return Ok(choice);
            }
            known.push(name);
        }
        let known: Vec<&str> = known.iter().map(|name| name.as_ref()).collect();
        let (name, known) = (self.value.clone(), known.join(", "));
        Err(self.error(FileErrorKind::UnknownName { what, name, known }))
    }
}

/// A table of a document.
#[derive(Debug, Clone)]
pub struct Section<'a> {
    /// The table's place.
    pub place: Place,
    pub(super) table: &'a Table,
}

/// A value of a document, not yet interpreted.
#[derive(Debug, Clone)]
pub struct Value<'a> {
    /// The value's place.
    pub place: Place,
    value: &'a Node,
}

impl<'a> Section<'a> {
    /// The place of a key of this section, or of its value.
    fn place_of(&self, key: &str, span: &Range<usize>) -> Place {
        let path = match (self.place.key.is_empty(), key.is_empty()) {
            (true, _) => key.to_owned(),
            (_, true) => self.place.key.clone(),
            _ => format!("{}.{key}", self.place.key),
        };
        Place { source: Arc::clone(&self.place.source), span: span.clone(), key: path }
    }

    /// An error about this section as a whole.
    pub fn error(&self, kind: impl Into<FileErrorKind>) -> FileError {
        self.place.error(kind)
    }

    /// The value of an optional key.
    pub fn get(&self, key: &str) -> Option<Value<'a>> {
        let value = self.table.get(key)?;
        Some(Value { place: self.place_of(key, &value.span), value })
    }

    /// The value of a required key; fails without it.
    pub fn require(&self, key: &str) -> Result<Value<'a>, FileError> {
        self.get(key).ok_or_else(|| self.place_of(key, &self.place.span).error(FileErrorKind::Missing))
    }

    /// Reads an optional key; `None` if the section lacks it.
    pub fn read<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Value<'a>) -> Result<T, FileError>,
    ) -> Result<Option<T>, FileError> {
        self.get(key).map(|value| read(&value)).transpose()
    }

    /// Every key with its value, in the order of the file: for tables whose keys are names.
    pub fn entries(&self) -> Vec<(Located<String>, Value<'a>)> {
        let located = |entry: &'a Entry| {
            let place = self.place_of(&entry.key, &entry.key_span);
            let value = Value { place: self.place_of(&entry.key, &entry.value.span), value: &entry.value };
            (Located { value: entry.key.clone(), place }, value)
        };
        self.table.entries.iter().map(located).collect()
    }

    /// All strings in the section and what it holds, such as names of files.
    pub fn strings(&self) -> Vec<String> {
        let mut all = Vec::new();
        self.entries().iter().for_each(|(_, value)| value.add_strings(&mut all));
        all
    }

    /// Fails if the section has a key that is not in this list.
    pub fn only<'k>(&self, known: impl IntoIterator<Item = &'k str>) -> Result<(), FileError> {
        let mut known: Vec<&str> = known.into_iter().collect();
        let Some(stranger) = self.table.entries.iter().find(|e| !known.contains(&e.key.as_str())) else {
            return Ok(());
        };
        known.sort_unstable();
        known.dedup();
        let place = self.place_of(&stranger.key, &stranger.key_span);
        Err(place.error(FileErrorKind::UnknownKey { known: known.join(", ") }))
    }
}

impl<'a> Value<'a> {
    fn add_strings(&self, all: &mut Vec<String>) {
        all.extend(self.as_str().map(str::to_owned));
        self.as_array().unwrap_or_default().iter().for_each(|item| item.add_strings(all));
        self.as_section().iter().for_each(|section| all.extend(section.strings()));
    }

    /// An error about this value.
    pub fn error(&self, kind: impl Into<FileErrorKind>) -> FileError {
        self.place.error(kind)
    }

    fn wrong(&self, expected: &'static str) -> FileError {
        self.error(FileErrorKind::WrongType { expected, found: self.value.type_name() })
    }

    /// Reads a number; integers are numbers too.
    pub fn number(&self) -> Result<f64, FileError> {
        self.as_number().unwrap_or_else(|| Err(self.wrong("a number")))
    }

    /// Reads a number above zero.
    pub fn positive(&self) -> Result<f64, FileError> {
        match self.number()? {
            x if x > 0.0 => Ok(x),
            x => Err(self.error(format!("must be positive, is {x}"))),
        }
    }

    /// Reads the value if it is a number; fails if the number is not finite.
    pub fn as_number(&self) -> Option<Result<f64, FileError>> {
        let number = match &self.value.content {
            Content::Integer(digits, radix) => i64::from_str_radix(digits, *radix).ok().map(|i| i as f64),
            Content::Float(x) => x.parse().ok(),
            _ => return None,
        };
        Some(match number {
            Some(x) if f64::is_finite(x) => Ok(x),
            _ => Err(self.error("is not a finite number")),
        })
    }

    /// Passes on a number that this value gives, if it is from `low` to `high`.
    pub fn within<T: PartialOrd + Display>(&self, number: T, low: T, high: T) -> Result<T, FileError> {
        match (&low..=&high).contains(&&number) {
            true => Ok(number),
            false => Err(self.error(format!("must be from {low} to {high}, is {number}"))),
        }
    }

    /// Reads a whole number from 0.
    pub fn count(&self) -> Result<u64, FileError> {
        match &self.value.content {
            Content::Integer(digits, radix) => {
                u64::from_str_radix(digits, *radix).map_err(|_| self.error("must be a whole number from 0"))
            }
            Content::Float(x) => Err(self.error(not_an_integer(x))),
            _ => Err(self.wrong("an integer")),
        }
    }

    /// Reads a whole number from `low` to `high`; `u64::MAX` is no end.
    pub fn whole(&self, low: u64, high: u64) -> Result<u64, FileError> {
        match self.count()? {
            number if number < low && high == u64::MAX => Err(self.error(format!("must be at least {low}"))),
            number => self.within(number, low, high),
        }
    }

    /// Reads true or false.
    pub fn boolean(&self) -> Result<bool, FileError> {
        match &self.value.content {
            Content::Boolean(b) => Ok(*b),
            _ => Err(self.wrong("true or false")),
        }
    }

    /// Reads a string.
    pub fn string(&self) -> Result<Located<String>, FileError> {
        match self.as_str() {
            // Strings may be printed, and written to other files.
            Some(s) if s.contains(is_control) => Err(self.error("has a control character in it")),
            Some(s) => Ok(Located { value: s.to_owned(), place: self.place.clone() }),
            None => Err(self.wrong("a string")),
        }
    }

    /// The string, if the value is one.
    pub fn as_str(&self) -> Option<&'a str> {
        match &self.value.content {
            Content::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Reads one name of a list.
    pub fn one_of<T: Copy>(&self, what: &'static str, choices: &[(&str, T)]) -> Result<T, FileError> {
        self.string()?.among(what, choices.iter().copied())
    }

    /// Reads the elements of an array.
    pub fn array(&self) -> Result<Vec<Value<'a>>, FileError> {
        self.as_array().ok_or_else(|| self.wrong("an array"))
    }

    /// The elements, if the value is an array.
    pub fn as_array(&self) -> Option<Vec<Value<'a>>> {
        let Content::Array(items) = &self.value.content else { return None };
        let located = |(k, value): (usize, &'a Node)| {
            let key = format!("{}[{}]", self.place.key, k + 1);
            Value { place: Place { span: value.span.clone(), key, ..self.place.clone() }, value }
        };
        Some(items.iter().enumerate().map(located).collect())
    }

    /// Reads a table.
    pub fn section(&self) -> Result<Section<'a>, FileError> {
        self.as_section().ok_or_else(|| self.wrong("a table"))
    }

    /// The table, if the value is one.
    pub fn as_section(&self) -> Option<Section<'a>> {
        let Content::Table(table) = &self.value.content else { return None };
        Some(Section { place: self.place.clone(), table })
    }

    /// Reads an array of `N` numbers.
    pub fn numbers<const N: usize>(&self, expected: &'static str) -> Result<[f64; N], FileError> {
        let items = self.array()?;
        let numbers: Vec<f64> = items.iter().map(Value::number).collect::<Result<_, _>>()?;
        <[f64; N]>::try_from(numbers)
            .map_err(|_| self.error(format!("expected {expected}, found an array of length {}", items.len())))
    }
}

/// The message for a number with a point or an exponent where a count is expected; it shows the integer, if there is one.
fn not_an_integer(written: &str) -> String {
    const LARGEST: f64 = (1u64 << 53) as f64;
    let value = written.replace('_', "").parse::<f64>().ok();
    match value.filter(|x| x.fract() == 0.0 && (0.0..=LARGEST).contains(x)) {
        Some(x) => format!("expected an integer: {x:.0}, not {written}"),
        None => format!("expected an integer, not {written}"),
    }
}
