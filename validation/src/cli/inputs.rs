//! No verb overwrites a file that it reads, nor one of the user's without leave.

use super::{CliError, Document, ErrorKind, Path, PathBuf, Told, may_replace, protect};
use psidpd_dynamics::scene::Edit;
use psidpd_formats::files::{PathError, Protected, is_protected};

/// The input and output files of a verb.
#[derive(Debug, Default)]
pub struct Files {
    /// The input files as the user named them.
    pub given: Vec<PathBuf>,
    reads: Vec<PathBuf>,
    writes: Vec<PathBuf>,
    makes: Vec<PathBuf>,
}

/// The depth of references: a scene names a model, and a model names tables.
const DEEPEST: usize = 2;

impl Files {
    /// Adds input files, and for scenes and models also the files that they name.
    pub fn reads<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Files {
        let given: Vec<PathBuf> = paths.into_iter().cloned().collect();
        let mut reads = Vec::new();
        given.iter().for_each(|path| named(path, DEEPEST, &mut reads));
        Files { given, reads, ..Files::default() }
    }

    /// Adds output files that the user named.
    pub fn writes(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Files {
        self.writes.extend(paths);
        self
    }

    /// Adds files that a verb writes into a folder by its own rules, beside what the user named.
    pub fn makes(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Files {
        self.makes.extend(paths);
        self
    }

    /// Adds the values of `--set` and `--over`, which may name files beside the first input.
    pub fn edits<'a>(mut self, edits: impl IntoIterator<Item = &'a Edit>) -> Files {
        let folder = self.given.first().and_then(|path| path.parent()).unwrap_or(Path::new("")).to_owned();
        for edit in edits {
            let path = folder.join(edit.value().trim_matches(['"', '\'']));
            if path.is_file() {
                named(&path, DEEPEST - 1, &mut self.reads);
            }
        }
        self
    }

    /// Adds input files that the user did not name.
    pub fn also_reads(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Files {
        self.reads.extend(paths);
        self
    }

    /// Keeps the inputs as they are while the verb works.
    pub fn protect(&self) -> Protected {
        protect(&self.reads)
    }

    /// Refuses results that would replace an input, or a file of the user's without leave. The inputs are protected already.
    pub fn check(&self, told: Told) -> Result<(), CliError> {
        let mut all = self.writes.iter().chain(&self.makes).map(PathBuf::as_path).chain(told.json);
        if let Some(path) = all.find(|path| is_protected(path)) {
            return Err(CliError::WrittenOver(path.to_owned()));
        }
        let results = self.writes.iter().map(PathBuf::as_path).chain(told.json);
        results
            .map(|path| may_replace(path, told.existing))
            .find(Result::is_err)
            .unwrap_or(Ok(()))
            .or_else(refused)
    }
}

/// An error of the system comes again when the verb writes, after what is wrong with its inputs.
fn refused(error: PathError) -> Result<(), CliError> {
    if error.cause.kind() == ErrorKind::AlreadyExists { Err(error.into()) } else { Ok(()) }
}

/// Adds a file; for a TOML file also the files named by strings in it.
fn named(path: &Path, deeper: usize, all: &mut Vec<PathBuf>) {
    all.push(path.to_owned());
    if deeper == 0 || path.extension().is_none_or(|e| e != "toml") {
        return;
    }
    let Ok(document) = Document::open(path) else { return };
    let folder = path.parent().unwrap_or(Path::new(""));
    for name in document.root().strings() {
        let path = folder.join(name);
        if path.is_file() && !all.contains(&path) {
            named(&path, deeper - 1, all);
        }
    }
}
