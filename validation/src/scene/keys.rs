//! Every key of the scene file, in one table: the JSON schema for editors and the reference
//! `docs/scene-file.md` are written from it, and tests hold the reader to it.

mod particles;
mod run;
mod scene;

pub use particles::{INITIAL, PART};
pub use run::{BODY_FORCE, OUTPUT, STAGE};
pub use scene::{BOX, MASSES, TOP};

/// A table of the scene file.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    /// Where it is.
    pub path: &'static str,
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
    /// Whether a file is refused without it.
    pub required: bool,
    /// The forms that have it; all if empty.
    pub forms: &'static [&'static str],
    /// What it means.
    pub about: &'static str,
    /// A part of a scene that has it; what a whole scene needs besides is left out.
    pub example: &'static str,
}

/// What the value of a key may be.
#[derive(Debug, Clone, Copy)]
pub enum ValueKind {
    /// Any string.
    Text,
    /// A string with the name of a file, relative to the scene file.
    File,
    /// A number.
    Number,
    /// A number above zero.
    Positive,
    /// A whole number from 0.
    Count,
    /// True or false.
    Flag,
    /// A number for each direction.
    Point,
    /// A length, or one for each direction.
    Lengths,
    /// The same, or the table [`BOX`].
    Box,
    /// One of some names, for all directions or for each.
    EachOf(fn() -> Vec<&'static str>),
    /// A temperature, or the two ends of a ramp.
    Temperature,
    /// One of some names.
    Choice(fn() -> Vec<&'static str>),
    /// Names.
    Names,
    /// A table of fractions by species.
    Fractions,
    /// The first and the last id of a range.
    Ids,
}

impl ValueKind {
    /// In words.
    pub fn describe(&self) -> String {
        let list = |choices: &fn() -> Vec<&'static str>| {
            choices().iter().map(|c| format!("`\"{c}\"`")).collect::<Vec<_>>().join(", ")
        };
        match self {
            ValueKind::Text => "string".into(),
            ValueKind::File => "name of a file, relative to the scene file".into(),
            ValueKind::Number => "number".into(),
            ValueKind::Positive => "number above 0".into(),
            ValueKind::Count => "whole number from 0".into(),
            ValueKind::Flag => "true or false".into(),
            ValueKind::Point => "array of a number for each direction".into(),
            ValueKind::Lengths => "number above 0, or an array of one for each direction".into(),
            ValueKind::Box => {
                "number above 0, an array of one for each direction, or the table `[box]`".into()
            }
            ValueKind::EachOf(choices) => format!("{}, or an array of one for each direction", list(choices)),
            ValueKind::Temperature => "number above 0, or an array of two, `[from, to]`".into(),
            ValueKind::Choice(choices) => list(choices),
            ValueKind::Names => "array of names".into(),
            ValueKind::Fractions => "table of numbers from 0 to 1 by species".into(),
            ValueKind::Ids => "array of two whole numbers, `[first, last]`".into(),
        }
    }
}

/// Every table, in the order of the documentation. What `[observe]` may have is described elsewhere.
pub const TABLES: &[Table] = &[TOP, BOX, MASSES, INITIAL, PART, BODY_FORCE, STAGE, OUTPUT];

const REQUIRED: bool = true;
const OPTIONAL: bool = false;

const fn key(
    name: &'static str,
    value: ValueKind,
    required: bool,
    about: &'static str,
    example: &'static str,
) -> Key {
    Key { name, value, required, forms: &[], about, example }
}

const fn form_key(
    forms: &'static [&'static str],
    name: &'static str,
    value: ValueKind,
    required: bool,
    about: &'static str,
    example: &'static str,
) -> Key {
    Key { name, value, required, forms, about, example }
}

fn axes() -> Vec<&'static str> {
    super::number::AXES.iter().map(|(name, _)| *name).collect()
}
