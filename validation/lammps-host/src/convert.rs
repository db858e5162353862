//! Rewrites scripts for LAMMPS's built-in `mdpd` and `dpd`, and programs in Python that drive it, to the pair style `mdpd/psi`.
//!
//! Only the commands that concern the built-in change; all other lines keep their bytes. A command without a
//! counterpart is kept and reported.

mod command;
mod data;
mod fluid;
mod python;
mod style;
mod survey;
mod variables;
mod work;

#[cfg(test)]
mod tests;

use super::error::LammpsError;
use data::{DataFile, data_file};
use psidpd_core::document::open_regular;
use psidpd_formats::files::{Existing, may_replace, protect, write_bytes};
use psidpd_formats::{FormatError, PathError};
use std::path::{Path, PathBuf};
use work::script;

/// The force law of the new script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Law {
    /// The law of Warren's potential, the default of `mdpd/psi`.
    #[default]
    Conservative,
    /// The law of the built-in, which has no potential.
    Lucy,
}

/// A remark about a line.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Note {
    /// The included file that has the line; `None` for the script itself.
    pub file: Option<String>,
    /// Number of the line in the old file, from 1.
    pub line: usize,
    pub text: String,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Converted {
    pub script: String,
    /// Included files that changed: their old names, and their new text.
    pub included: Vec<(String, String)>,
    /// Data files of the script whose atoms have the column of `atom_style mdpd`.
    pub data: Vec<DataFile>,
    pub changed: Vec<Note>,
    /// Remarks about lines whose meaning changed.
    pub left: Vec<Note>,
    /// Remarks about what the user must rewrite by hand.
    pub by_hand: Vec<Note>,
    /// Models with the potentials nearest to coefficients that have none; a note says so, with `NEAREST` for the model.
    models: Vec<(Note, String)>,
}

/// Converts the script in a file, with the files that it includes. If `out` names a file, the new script is written
/// there, and included files and data files beside it. Returns the paths of written files, and the new script with its
/// remarks.
pub fn files(
    old: &Path,
    law: Law,
    plugin: Option<&str>,
    out: Option<&Path>,
    existing: Existing,
) -> Result<(Vec<PathBuf>, Converted), LammpsError> {
    let read = |path: &Path| {
        open_regular(path).and_then(std::io::read_to_string).map_err(PathError::at("read", path))
    };
    // LAMMPS looks for files in its working folder, most often that of the script.
    let beside = |path: &Path, name: &str| path.parent().unwrap_or(Path::new("")).join(name);
    let convert = if old.extension().is_some_and(|end| end == "py") { python::program } else { script };
    let mut new = convert(&read(old)?, law, plugin, &|name| read(&beside(old, name)).ok());
    let mut results: Vec<(PathBuf, String)> =
        out.map(|path| (path.to_owned(), new.script.clone())).into_iter().collect();
    let without_out = "was not rewritten: choose an --out";
    for (name, text) in &new.included {
        match out {
            Some(path) => results.push((beside(path, &new_name(name, INCLUDED)), text.clone())),
            None => new.left.push(Note { file: Some(name.clone()), line: 1, text: without_out.into() }),
        }
    }
    for DataFile { name, column, note } in &new.data {
        let from = beside(old, name);
        match out {
            Some(path) if from.is_file() => {
                let text = data_file(&read(&from)?, *column).map_err(FormatError::content(&from))?;
                results.push((beside(path, &new_name(name, DATA)), text));
            }
            Some(_) => new.by_hand.push(Note {
                text: format!("{name} does not exist: take the density out of its atoms, {column}"),
                ..note.clone()
            }),
            None => new.left.push(Note { text: format!("{name} {without_out}"), ..note.clone() }),
        }
    }
    for (k, (note, text)) in std::mem::take(&mut new.models).into_iter().enumerate() {
        let nearest = match out {
            Some(path) => {
                let number = if k == 0 { String::new() } else { (k + 1).to_string() };
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let name = format!("{name}.nearest{number}.toml");
                let path = path.with_file_name(&name);
                results.push((path, text));
                format!("is {name}")
            }
            None => format!("is\n\n{text}"),
        };
        new.by_hand.push(Note { text: note.text.replace("NEAREST", &nearest), ..note });
    }
    let named = new.included.iter().map(|(name, _)| name).chain(new.data.iter().map(|data| &data.name));
    let _inputs = protect(named.map(|name| beside(old, name)).chain([old.to_owned()]));
    // No file is written unless all can be: existing files may be somebody's work.
    results.iter().try_for_each(|(path, _)| may_replace(path, existing))?;
    for (path, text) in &results {
        write_bytes(path, existing, text.as_bytes())?;
    }
    Ok((results.into_iter().map(|(path, _)| path).collect(), new))
}

/// The name of a converted file in the folder of the new script, whatever folder the old file was in.
fn new_name(name: &str, suffix: &str) -> String {
    let last = Path::new(name).file_name().map_or(name.into(), |last| last.to_string_lossy());
    format!("{last}{suffix}")
}

/// The suffixes of converted data files and of converted included files.
const DATA: &str = ".atomic";
const INCLUDED: &str = ".psi";
