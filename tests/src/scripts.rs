//! The LAMMPS scripts that users are shown.

use crate::root;
use std::path::PathBuf;

/// The scripts in `lammps-plugin/examples`, each in its folder.
pub fn examples() -> Vec<PathBuf> {
    let folder = root().join("lammps-plugin/examples");
    let folders = std::fs::read_dir(folder).expect("the examples are there");
    let folders = folders.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.is_dir());
    let mut found: Vec<PathBuf> = folders
        .filter_map(|p| {
            let name = format!("in.{}", p.file_name()?.to_str()?);
            Some(p.join(name))
        })
        .collect();
    found.sort();
    found
}

/// The first block of the README that is marked with `language` and contains `part`.
///
/// # Panics
/// There is none.
pub fn readme_block(language: &str, part: &str) -> String {
    let text = std::fs::read_to_string(root().join("README.md")).expect("the README is there");
    text.split("```")
        .skip(1)
        .step_by(2)
        .filter_map(|b| b.strip_prefix(language))
        .find(|b| b.contains(part))
        .unwrap_or_else(|| panic!("no {language} block with {part}"))
        .to_owned()
}
