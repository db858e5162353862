//! No verb overwrites a file that it reads.

use super::{CliError, Document, Path, PathBuf};
use psidpd_core::document::{Section, Value};
use std::os::unix::fs::MetadataExt;

/// The input and output files of a verb.
#[derive(Debug, Default)]
pub struct Files {
    /// The input files as the user named them.
    pub given: Vec<PathBuf>,
    reads: Vec<PathBuf>,
    writes: Vec<PathBuf>,
}

/// The depth of references: a scene names a model, and a model names tables.
const DEEPEST: usize = 2;

impl Files {
    /// Adds input files, and for scenes and models also the files that they name.
    pub fn reads<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Files {
        let given: Vec<PathBuf> = paths.into_iter().cloned().collect();
        let mut reads = Vec::new();
        given.iter().for_each(|path| named(path, DEEPEST, &mut reads));
        Files { given, reads, writes: Vec::new() }
    }

    /// Adds output files.
    pub fn writes(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Files {
        self.writes.extend(paths);
        self
    }

    pub fn check(&self, json: Option<&Path>) -> Result<(), CliError> {
        let id =
            |path: &Path| std::fs::metadata(path).ok().filter(|m| m.is_file()).map(|m| (m.dev(), m.ino()));
        let read: Vec<_> = self.reads.iter().filter_map(|path| id(path)).collect();
        let mut writes = self.writes.iter().map(PathBuf::as_path).chain(json);
        let both = writes.find(|path| id(path).is_some_and(|id| read.contains(&id)));
        both.map_or(Ok(()), |path| Err(CliError::WrittenOver(path.to_owned())))
    }
}

/// Adds a file; for a TOML file also the files named by strings in it.
fn named(path: &Path, deeper: usize, all: &mut Vec<PathBuf>) {
    all.push(path.to_owned());
    if deeper == 0 || path.extension().is_none_or(|e| e != "toml") {
        return;
    }
    let Ok(document) = Document::open(path) else { return };
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut names = Vec::new();
    strings(&document.root(), &mut names);
    for name in names {
        let path = folder.join(name);
        if path.is_file() && !all.contains(&path) {
            named(&path, deeper - 1, all);
        }
    }
}

fn strings(section: &Section, all: &mut Vec<String>) {
    section.entries().iter().for_each(|(_, value)| strings_of(value, all));
}

fn strings_of(value: &Value, all: &mut Vec<String>) {
    if let Some(text) = value.as_str() {
        all.push(text.to_owned());
    }
    value.as_array().unwrap_or_default().iter().for_each(|item| strings_of(item, all));
    if let Some(section) = value.as_section() {
        strings(&section, all);
    }
}
