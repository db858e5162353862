//! The keys that a file may have, as tables. A file with other keys is refused; editor schemas and
//! pages of documentation are generated from the tables too.

use super::{FileError, Section, Value};

/// A table of a file, or of another table.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    /// Path of the table; parts in capitals stand for names that the user chooses.
    pub path: &'static str,
    /// Title of the table; empty where the path is the title.
    pub title: &'static str,
    /// Whether the file may have several tables of this kind.
    pub array: bool,
    /// Purpose of the table.
    pub about: &'static str,
    /// The key whose value decides which other keys the table has, and its values; empty if there is none.
    pub forms: (&'static str, &'static [&'static str]),
    /// The keys of the table.
    pub keys: &'static [Key],
}

/// A key of a table, with its type and description.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Name of the key; in capitals if it stands for any name.
    pub name: &'static str,
    /// Type of the value.
    pub value: ValueKind,
    /// Whether the key may be left out.
    pub need: Need,
    /// The forms of the table that have this key; empty if all have it.
    pub forms: &'static [&'static str],
    /// Description of the value.
    pub about: &'static str,
    /// A part of a file with the key, or only its value.
    pub example: &'static str,
}

/// Whether a key may be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// A file without the key is refused.
    Required,
    /// The key may be left out; its description says what that means.
    Optional,
    /// The key may be left out and then has this value.
    Default(&'static str),
}

/// A file without the key is refused.
pub const REQUIRED: Need = Need::Required;
/// The key may be left out.
pub const OPTIONAL: Need = Need::Optional;

impl Key {
    /// The value of the key if it is left out; empty where its description states it.
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

/// The types of values, which [`ValueKind::describe`] describes in words.
#[allow(missing_docs, reason = "the descriptions say what each is")]
#[derive(Debug, Clone, Copy)]
pub enum ValueKind {
    Text,
    File,
    TableFile,
    Number,
    NumberOrFormula,
    Parameter,
    Positive,
    Count,
    Dimensions,
    Flag,
    Bounds,
    Point,
    Lengths,
    Box,
    Choice(fn() -> Vec<&'static str>),
    EachOf(fn() -> Vec<&'static str>),
    Temperature,
    Species,
    Between,
    Names,
    Fractions,
    Ids,
    Formula,
    Correction,
    Excess,
    Pressure,
    Slopes,
    Measured,
    /// From the first to the second; without an end if that is `u64::MAX`.
    Whole(u64, u64),
    /// Two of [`ValueKind::Whole`].
    Wholes(u64, u64),
    /// From the first to the second, which may be infinite.
    Within(f64, f64),
    HalfBox,
    Name(&'static str),
    FlagOrSpecies,
}

impl ValueKind {
    /// Describes the type in words.
    pub fn describe(&self) -> String {
        let list = |choices: fn() -> Vec<&'static str>| {
            choices().iter().map(|c| format!("`\"{c}\"`")).collect::<Vec<_>>().join(", ")
        };
        let short = |x: f64| if x < 1e-4 && x > 0.0 { format!("{x:e}") } else { x.to_string() };
        let words = match *self {
            ValueKind::Text => "string",
            ValueKind::File => "path of a file, relative to the folder of this one",
            ValueKind::TableFile => "path of a file in the folder of this one or below",
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
            ValueKind::Whole(low, u64::MAX) => return format!("whole number from {low}"),
            ValueKind::Whole(low, high) => return format!("whole number from {low} to {high}"),
            ValueKind::Wholes(low, high) => {
                return format!("array of two whole numbers from {low} to {high}");
            }
            ValueKind::Within(low, f64::INFINITY) => return format!("number from {}", short(low)),
            ValueKind::Within(low, high) => return format!("number from {} to {}", short(low), short(high)),
            ValueKind::HalfBox => "number above 0, at most half the box",
            ValueKind::Name(of) => return format!("name of {of}"),
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
            ValueKind::Pressure => "string with a formula, or `{ table = \"FILE\" }`",
            ValueKind::Measured => "array of a number and its error, which is above 0",
            ValueKind::Slopes => "table of formulas by the variables of densities",
            ValueKind::FlagOrSpecies => "true, false, or the name of a species",
        };
        words.to_owned()
    }
}

impl Table {
    /// A table that a file has once, without forms.
    pub const fn new(path: &'static str, about: &'static str, keys: &'static [Key]) -> Table {
        Table { path, title: "", array: false, about, forms: ("", &[]), keys }
    }

    /// A table that a file may have several times, without forms.
    pub const fn array(path: &'static str, about: &'static str, keys: &'static [Key]) -> Table {
        Table { array: true, ..Table::new(path, about, keys) }
    }

    /// The table with a title of its own.
    pub const fn titled(self, title: &'static str) -> Table {
        Table { title, ..self }
    }

    /// The keys that a table of this form has; all keys if `form` is `None`.
    pub fn keys_of<'a>(&self, form: Option<&'a str>) -> impl Iterator<Item = &'static Key> + use<'a> {
        self.keys.iter().filter(move |k| k.forms.is_empty() || form.is_none_or(|f| k.forms.contains(&f)))
    }

    /// Writes a chapter for each key, with its example.
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

/// The names in a list of choices.
pub fn names<T>(choices: &[(&'static str, T)]) -> Vec<&'static str> {
    choices.iter().map(|(name, _)| *name).collect()
}

/// Whether the name of a key, or a part of the path of a table, stands for any name: those in capitals do.
pub fn is_any_name(name: &str) -> bool {
    name.len() > 1 && name.chars().all(|c| c.is_ascii_uppercase())
}

/// An error at `key`, for a file of another kind than the one expected.
pub fn of_another_kind(root: &Section, key: &str, what: &str) -> FileError {
    let span = root.get(key).map_or(0..0, |value| value.place.span);
    FileError::new(&root.place.source, span, key, what)
}

/// Calls `read`, and refuses the keys of a file that its tables do not have. A misspelt key is reported first, before a key
/// that is missing because of it, and a key of another form of its table last. `more` are tables that are described elsewhere.
///
/// # Errors
/// Fails for such keys, and as `read`.
pub fn read_known<T>(
    root: &Section,
    tables: &[Table],
    more: &[&'static str],
    read: impl FnOnce() -> Result<T, FileError>,
) -> Result<T, FileError> {
    refuse_strangers(root, tables, more, |_, _| None)?;
    let found = read()?;
    refuse_strangers(root, tables, more, |section, table| {
        let form = section.get(table.forms.0)?.as_str();
        form.filter(|form| table.forms.1.contains(form))
    })?;
    Ok(found)
}

fn refuse_strangers<'a>(
    root: &Section<'a>,
    tables: &[Table],
    more: &[&'static str],
    form: impl Fn(&Section<'a>, &Table) -> Option<&'a str>,
) -> Result<(), FileError> {
    for table in tables {
        for section in sections(root, table.path) {
            let mut known: Vec<&str> = table.keys_of(form(&section, table)).map(|k| k.name).collect();
            if table.path.is_empty() {
                known.extend(tables.iter().filter_map(|t| t.path.split('.').next()));
                known.retain(|name| !name.is_empty());
                known.extend(more);
            }
            if !known.iter().any(|name| is_any_name(name)) {
                section.only(known)?;
            }
        }
    }
    Ok(())
}

/// The tables of a file at a path such as `density.NAME`.
fn sections<'a>(root: &Section<'a>, path: &str) -> Vec<Section<'a>> {
    let Some((first, rest)) = path.split_once('.').or((!path.is_empty()).then_some((path, ""))) else {
        return vec![root.clone()];
    };
    let inner = |value: Value<'a>| -> Vec<Section<'a>> {
        let elements = value.as_array().unwrap_or_else(|| vec![value]);
        elements.iter().filter_map(Value::as_section).flat_map(|s| sections(&s, rest)).collect()
    };
    if is_any_name(first) {
        return root.entries().into_iter().flat_map(|(_, value)| inner(value)).collect();
    }
    root.get(first).map_or_else(Vec::new, inner)
}

/// Declares keys in short: `"name": VALUE, NEED, "meaning" => "example";`. Constants go before a key, `use AXIS;`, or after the
/// last, `then AXIS;`.
#[macro_export]
macro_rules! keys {
    ($($(use $shared:ident;)* $name:literal: $value:expr, $need:expr, $about:expr => $example:expr;)* $(then $last:ident;)?) => {
        &[$($($shared,)* $crate::document::keys::key($name, $value, $need, $about, $example),)* $($last)?]
    };
}

pub use keys;

/// Keys that a form of a table has: the name of the form, alone in a list, and the keys.
pub type FormKeys = (&'static [&'static str], &'static [Key]);

/// The `first` keys, which all forms have, and those of each form, `N` in all.
pub const fn joined<const N: usize>(first: &[Key], forms: &[FormKeys]) -> [Key; N] {
    let mut keys = [first[0]; N];
    let mut n = 0;
    while n < first.len() {
        keys[n] = first[n];
        n += 1;
    }
    let mut form = 0;
    while form < forms.len() {
        let (name, of_form) = forms[form];
        let mut k = 0;
        while k < of_form.len() {
            keys[n] = Key { forms: name, ..of_form[k] };
            (n, k) = (n + 1, k + 1);
        }
        form += 1;
    }
    keys
}

/// The number of keys of all forms.
pub const fn count(forms: &[FormKeys]) -> usize {
    let (mut n, mut form) = (0, 0);
    while form < forms.len() {
        n += forms[form].1.len();
        form += 1;
    }
    n
}
