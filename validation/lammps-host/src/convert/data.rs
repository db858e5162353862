//! Data files for `atom_style mdpd`.

use super::Note;
use psidpd_formats::text::{Problem, TextError};
use std::fmt;

/// A data file with a column for densities, under its old name, and where the script reads it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataFile {
    pub name: String,
    pub column: Column,
    pub note: Note,
}

/// The place of the density in an atom's line: the number of columns before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column(pub usize);

impl Column {
    /// `id type rho x y z`, of `atom_style mdpd`.
    pub const OF_MDPD: Column = Column(2);

    /// `id type x y z … rho …`, of `atom_style hybrid` with these styles, or `None` if a style before mdpd has
    /// unknown columns.
    pub fn of_hybrid(styles: &[&str]) -> Option<Column> {
        // A column that two styles have occurs once.
        let mut before: Vec<&str> = vec!["id", "type", "x", "y", "z"];
        for style in styles.iter().take_while(|style| **style != "mdpd") {
            let columns: &[&str] = match *style {
                "atomic" => &[],
                "bond" | "angle" | "molecular" => &["molecule"],
                "charge" => &["q"],
                "full" => &["molecule", "q"],
                "sphere" => &["diameter", "density"],
                "dipole" => &["q", "mux", "muy", "muz"],
                _ => return None,
            };
            before.extend(columns.iter().filter(|column| !before.contains(column)).collect::<Vec<_>>());
        }
        Some(Column(before.len()))
    }
}

impl fmt::Display for Column {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}", self.0 + 1)
    }
}

/// What a data file says besides its atoms.
#[derive(Debug, Default, PartialEq)]
pub struct Header {
    /// The number of atom types.
    pub types: Option<usize>,
    /// Masses by types.
    pub masses: Vec<(String, f64)>,
}

impl Header {
    pub fn of(text: &str) -> Header {
        let mut header = Header::default();
        let mut masses = false;
        for line in text.lines().skip(1) {
            let code = line.split('#').next().unwrap_or_default();
            let words: Vec<&str> = code.split_whitespace().collect();
            match words.as_slice() {
                [count, "atom", "types"] => header.types = count.parse().ok(),
                [section, ..] if section.starts_with(char::is_alphabetic) => masses = *section == "Masses",
                [kind, mass] if masses => {
                    header.masses.extend(mass.parse().ok().map(|mass| ((*kind).to_owned(), mass)));
                }
                _ => {}
            }
        }
        header
    }
}

/// Takes the density out of the atoms of a data file, and its style's name out of the title of the section.
pub fn data_file(old: &str, column: Column) -> Result<String, TextError> {
    let mut new = String::new();
    let mut atoms = false;
    let least = 6.max(column.0 + 1);
    for (k, line) in old.split_inclusive('\n').enumerate() {
        let code = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = code.split_whitespace().collect();
        match words.first() {
            // A section begins with a word, an atom line with a number.
            Some(word) if word.starts_with(char::is_alphabetic) => {
                atoms = words == ["Atoms"];
                let style = line.split_once('#').map_or("", |(_, style)| style.trim());
                new += if atoms && style == "mdpd" { "Atoms # atomic\n" } else { line };
            }
            Some(_) if atoms => {
                if words.len() < least {
                    let expected = format!("at least {least}, as the atom style has them");
                    return Err(Problem::Columns { expected, found: words.len() }.at(k + 1));
                }
                let (before, after) = words.split_at(column.0);
                new += &[before, &after[1..]].concat().join(" ");
                new.push('\n');
            }
            _ => new += line,
        }
    }
    Ok(new)
}
