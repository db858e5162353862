//! Loads model files that are valid, and refuses invalid ones with the message that each of them states.

use psidpd_core::document::FileError;
use psidpd_core::engine::Plan;
use psidpd_core::model::Model;
use std::path::{Path, PathBuf};

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models").join(folder);
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    assert!(files.len() > 5, "{}", folder.display());
    files
}

#[test]
fn good_models_load_at_any_temperature_and_make_engines() {
    for file in files("good") {
        let model = Model::open(&file).unwrap_or_else(|e| panic!("{e}"));
        for kt in [0.1, 0.75, 1.0, 3.0] {
            let fluid = model.at(kt).unwrap_or_else(|e| panic!("{e}"));
            let plan = Plan::new(&fluid).unwrap();
            assert!(plan.to_string().contains("fluid"), "{}", file.display());
        }
    }
}

/// The text that the comment `# key: text` at the top of an invalid file requires.
fn wanted<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    text.lines()
        .take_while(|line| line.starts_with('#'))
        .find_map(|line| line.strip_prefix("# ")?.strip_prefix(key)?.strip_prefix(": "))
}

#[test]
fn bad_models_are_refused_with_the_reason() {
    let mut failures = String::new();
    for file in files("bad") {
        let text = std::fs::read_to_string(&file).unwrap();
        let expected = wanted(&text, "expect").unwrap_or_else(|| panic!("{}", file.display()));
        let line = wanted(&text, "line").map(|l| l.parse::<usize>().unwrap());
        let error: Option<FileError> = Model::open(&file).err();
        let found = error.as_ref().map_or("it loads".to_owned(), ToString::to_string);
        let right_line = line.is_none() || error.as_ref().map(FileError::line) == line;
        if !found.contains(expected) || !right_line {
            failures +=
                &format!("{}: expected \"{expected}\" on line {line:?}, found: {found}\n", file.display());
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn straight_tables_need_no_density_pass() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models/good");
    let width = |file: &str| {
        let fluid = Model::open(&folder.join(file)).unwrap().at(1.0).unwrap();
        Plan::new(&fluid).unwrap().slope_width()
    };
    assert_eq!(width("straight_table.toml"), 0);
    assert_eq!(width("table.toml"), 1);
    assert_eq!(width("two_densities.toml"), 4);
    assert_eq!(width("pressure.toml"), 1);
}
