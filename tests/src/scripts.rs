//! The LAMMPS scripts of the examples and the README.

use crate::root;
use std::path::PathBuf;

/// The scripts in `lammps-plugin/examples`, each with its path.
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

/// The first block of the README with this `language` that contains `part`; panics if there is none.
pub fn readme_block(language: &str, part: &str) -> String {
    let all = blocks("README.md").into_iter();
    let mut found = all.filter(|b| b.language == language).map(|b| b.text).filter(|text| text.contains(part));
    found.next().unwrap_or_else(|| panic!("no {language} block with {part}"))
}

/// A fenced block of a page, or the text before one.
pub struct Block {
    /// The language after the fence; empty for text.
    pub language: String,
    pub text: String,
}

/// The fenced blocks of a page of the checkout and the text between them, in the order of the page; panics if
/// there is no such page.
pub fn parts(page: &str) -> Vec<Block> {
    let text = std::fs::read_to_string(root().join(page)).unwrap_or_else(|e| panic!("{page}: {e}"));
    let mut found = Vec::new();
    let mut part = Block { language: String::new(), text: String::new() };
    for line in text.lines() {
        if let Some(fence) = line.strip_prefix("```") {
            let language = if part.language.is_empty() { fence.trim() } else { "" };
            let next = Block { language: language.into(), text: String::new() };
            found.push(std::mem::replace(&mut part, next));
        } else {
            part.text += &format!("{line}\n");
        }
    }
    assert!(part.language.is_empty(), "{page}: a block has no end");
    found.push(part);
    found
}

/// The fenced blocks of a page of the checkout, in their order; panics if there is no such page.
pub fn blocks(page: &str) -> Vec<Block> {
    parts(page).into_iter().filter(|part| !part.language.is_empty()).collect()
}
