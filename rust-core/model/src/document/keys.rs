//! The keys that a file may have, in tables. Schemas for editors and pages of documentation are written from
//! them, and tests hold the readers to them.

use super::{FileError, FileErrorKind, Section, Value};

/// A table of a file, or of one of its tables.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    /// Where it is; the parts in capitals are names of the user's.
    pub path: &'static str,
    /// What it is called, where its path does not say it.
    pub title: &'static str,
    /// Whether there may be several.
    pub array: bool,
    /// What it is for.
    pub about: &'static str,
    /// The key whose value decides which other keys there are, and its values; empty if there is none.
    pub forms: (&'static str, &'static [&'static str]),
    /// Its keys.
    pub keys: &'static [Key],
}

/// A key of a table.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Its name; in capitals if any name may stand there.
    pub name: &'static str,
    /// What its value is.
    pub value: ValueKind,
    /// Whether it may be left out.
    pub need: Need,
    /// The forms that have it; all if empty.
    pub forms: &'static [&'static str],
    /// What it means.
    pub about: &'static str,
    /// A part of a file that has it, or its value.
    pub example: &'static str,
}

/// Whether a key may be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// A file is refused without it.
    Required,
    /// It may be left out; its description says what that means.
    Optional,
    /// It may be left out, and is this then.
    Default(&'static str),
}

/// A file is refused without the key.
pub const REQUIRED: Need = Need::Required;
/// The key may be left out.
pub const OPTIONAL: Need = Need::Optional;

impl Key {
    /// What the key is if it is left out; empty where its description says it.
    pub fn default(&self) -> &'static str {
        if let Need::Default(text) = self.need { text } else { "" }
    }
}

/// A key that every form of its table has.
pub const fn key(
    name: &'static str,
    value: ValueKind,
    need: Need,
    about: &'static str,
    example: &'static str,
) -> Key {
    Key { name, value, need, forms: &[], about, example }
}

/// A key that some forms of its table have.
pub const fn form_key(
    forms: &'static [&'static str],
    name: &'static str,
    value: ValueKind,
    need: Need,
    about: &'static str,
    example: &'static str,
) -> Key {
    Key { forms, ..key(name, value, need, about, example) }
}

/// What the value of a key may be.
#[derive(Debug, Clone, Copy)]
pub enum ValueKind {
    /// Any string.
    Text,
    /// A string with the name of a file, relative to the file with the key.
    File,
    /// The same of a table, which must not lie elsewhere.
    TableFile,
    /// A number.
    Number,
    /// A number, or a string with a formula of the parameters and kT.
    NumberOrFormula,
    /// A number, or a string with a formula of other parameters.
    Parameter,
    /// A number above zero.
    Positive,
    /// A whole number from 0.
    Count,
    /// 2 or 3.
    Dimensions,
    /// True or false.
    Flag,
    /// Two numbers or formulas, rising.
    Bounds,
    /// A number for each direction.
    Point,
    /// A length, or one for each direction.
    Lengths,
    /// The same, or the table `[box]`.
    Box,
    /// One of some names.
    Choice(fn() -> Vec<&'static str>),
    /// One of some names, for all directions or for each.
    EachOf(fn() -> Vec<&'static str>),
    /// A temperature, or the two ends of a ramp.
    Temperature,
    /// The names of all species.
    Species,
    /// Two species.
    Between,
    /// Names.
    Names,
    /// A table of fractions by species.
    Fractions,
    /// The first and the last id of a range.
    Ids,
    /// A string with a formula.
    Formula,
    /// A polynomial, or a table of them by pairs of species.
    Correction,
    /// A formula, or a table that stands for one.
    Excess,
    /// A table of formulas by the names of density variables.
    Slopes,
    /// Something else, in these words.
    Words(&'static str),
}

impl ValueKind {
    /// In words.
    pub fn describe(&self) -> String {
        let list = |choices: &fn() -> Vec<&'static str>| {
            choices().iter().map(|c| format!("`\"{c}\"`")).collect::<Vec<_>>().join(", ")
        };
        let words = match self {
            ValueKind::Text => "string",
            ValueKind::File => "name of a file, from the folder of this one on",
            ValueKind::TableFile => "name of a file in the folder of this one or below",
            ValueKind::Number => "number",
            ValueKind::NumberOrFormula => "number, or string with a formula of the parameters and `kT`",
            ValueKind::Parameter => "number, or string with a formula of other parameters",
            ValueKind::Positive => "number above 0",
            ValueKind::Count => "whole number from 0",
            ValueKind::Dimensions => "2 or 3",
            ValueKind::Flag => "true or false",
            ValueKind::Bounds => "array of two numbers or formulas, `[lowest, highest]`",
            ValueKind::Point => "array of a number for each direction",
            ValueKind::Lengths => "number above 0, or an array of one for each direction",
            ValueKind::Box => "number above 0, an array of one for each direction, or the table `[box]`",
            ValueKind::Choice(choices) => return list(choices),
            ValueKind::EachOf(choices) => {
                return format!("{}, or an array of one for each direction", list(choices));
            }
            ValueKind::Temperature => "number above 0, or an array of two, `[from, to]`",
            ValueKind::Species => "array of names (letters, digits, underscores)",
            ValueKind::Between => "array of two species",
            ValueKind::Names => "array of names",
            ValueKind::Fractions => "table of numbers from 0 to 1 by species",
            ValueKind::Ids => "array of two whole numbers, `[first, last]`",
            ValueKind::Formula => "string with a formula",
            ValueKind::Correction => {
                "array of 1 to 16 numbers or formulas, or a table of such arrays by `\"A|B\"`"
            }
            ValueKind::Excess => {
                "string with a formula, `{ table = \"FILE\" }`, `{ pressure = \"FORMULA\" }` or `{ slopes = { … } }`"
            }
            ValueKind::Slopes => "table of formulas by the variables of densities",
            ValueKind::Words(words) => words,
        };
        words.to_owned()
    }
}

impl Table {
    /// The keys that a table of some form has; all without one.
    pub fn keys_of<'a>(&self, form: Option<&'a str>) -> impl Iterator<Item = &'static Key> + use<'a> {
        self.keys.iter().filter(move |k| k.forms.is_empty() || form.is_none_or(|f| k.forms.contains(&f)))
    }

    /// A chapter of a page for each of its keys, with its example.
    pub fn reference(&self) -> String {
        let mut text = format!("{}\n", self.about);
        for key in self.keys {
            let required = if key.need == REQUIRED { ", required" } else { "" };
            let forms = match key.forms {
                [] => String::new(),
                forms => format!(" ({} {})", self.forms.0, forms.join(", ")),
            };
            let value = key.value.describe();
            let capital =
                value.get(..1).unwrap_or_default().to_uppercase() + value.get(1..).unwrap_or_default();
            text += &format!(
                "\n### `{}`{forms}\n\n*{capital}{required}.* {}\n\n```toml\n{}\n```\n",
                key.name, key.about, key.example
            );
        }
        text
    }
}

/// What to say of a file with an error: of what is misspelt rather than of what is missing for it. `more` are tables that
/// are described elsewhere.
pub fn strangers_first(error: FileError, root: &Section, tables: &[Table], more: &[&str]) -> FileError {
    match error.kind() {
        // Of another file, or said already.
        _ if error.file() != root.source().as_ref() => error,
        FileErrorKind::UnknownKey { .. } => error,
        _ => refuse_strangers(root, tables, more).err().unwrap_or(error),
    }
}

/// An error at `key` of a file that is of another kind than the one asked for.
pub fn of_another_kind(root: &Section, key: &str, what: &str) -> FileError {
    let span = root.get(key).map_or(0..0, |value| value.span());
    FileError::new(root.source(), span, key, FileErrorKind::Value(what.to_owned()))
}

fn refuse_strangers(root: &Section, tables: &[Table], more: &[&str]) -> Result<(), FileError> {
    for table in tables {
        let first = |path: &'static str| path.split('.').next().unwrap_or_default();
        for section in sections(root, table.path) {
            // A key of another form is not misspelt.
            let mut known: Vec<&str> = table.keys.iter().map(|k| k.name).collect();
            if table.path.is_empty() {
                known.extend(tables.iter().map(|t| first(t.path)).filter(|name| !name.is_empty()));
                known.extend(more);
            }
            // Names of the user's.
            if known.iter().any(|name| name.chars().all(|c| c.is_ascii_uppercase()) && name.len() > 1) {
                continue;
            }
            known.sort_unstable();
            known.dedup();
            for (name, _) in section.entries() {
                if !known.contains(&name.value.as_str()) {
                    let kind = FileErrorKind::UnknownKey { known: known.join(", ") };
                    return Err(name.error(section.source(), kind));
                }
            }
        }
    }
    Ok(())
}

/// The tables of a file at a path such as `density.NAME`.
fn sections<'a>(root: &Section<'a>, path: &str) -> Vec<Section<'a>> {
    let Some((first, rest)) = path.split_once('.').or((!path.is_empty()).then_some((path, ""))) else {
        return root.again();
    };
    let inner = |value: Value<'a>| -> Vec<Section<'a>> {
        let elements = value.as_array().unwrap_or_else(|| vec![value]);
        elements.iter().filter_map(Value::as_section).flat_map(|s| sections(&s, rest)).collect()
    };
    if first.chars().all(|c| c.is_ascii_uppercase()) {
        return root.entries().into_iter().flat_map(|(_, value)| inner(value)).collect();
    }
    root.get(first).map_or_else(Vec::new, inner)
}

/// Keys in short: `"name" [FORMS]: VALUE, NEED, "meaning" => "example";`. The forms are left out where all have the key.
#[macro_export]
macro_rules! keys {
    ($($name:literal $([$forms:expr])?: $value:expr, $need:expr, $about:expr => $example:expr;)*) => {
        &[$($crate::document::keys::Key {
            $(forms: $forms,)?
            ..$crate::document::keys::key($name, $value, $need, $about, $example)
        }),*]
    };
}

pub use keys;
