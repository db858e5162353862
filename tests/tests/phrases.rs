//! The words of the project: pages, messages and comments contain none of the phrases in `phrases.txt`.

use std::path::{Path, PathBuf};

/// A phrase in lower case, and what to say instead.
struct Phrase {
    words: Vec<String>,
    instead: String,
}

/// The phrases of a list; empty lines and lines that begin with `#` are skipped.
fn phrases(list: &str) -> Vec<Phrase> {
    let lines = list.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    lines
        .map(|line| {
            let (phrase, instead) = line.split_once(" => ").expect("phrase => plain words");
            let words: Vec<String> = phrase.to_lowercase().split_whitespace().map(str::to_owned).collect();
            assert!(!words.is_empty() && !instead.trim().is_empty(), "{line}");
            Phrase { words, instead: instead.trim().to_owned() }
        })
        .collect()
}

/// A line without the marker of a comment, a quotation or a list item at its start, and without the quote or the
/// backslash at its end.
fn bare(line: &str) -> &str {
    let begin = ["///", "//!", "//", "/**", "/*", "*/", "* ", "#", "> ", "- ", "\""];
    let line = line.trim();
    let line = begin.iter().find_map(|marker| line.strip_prefix(marker)).unwrap_or(line);
    let line = line.strip_suffix('\\').unwrap_or(line).trim_end();
    line.strip_suffix('"').unwrap_or(line).trim()
}

/// Whether a character belongs to a word.
fn in_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The phrases in a text, each with the number of the line where it begins. An empty line ends a paragraph, and no
/// phrase continues after it.
fn found<'a>(text: &str, phrases: &'a [Phrase]) -> Vec<(usize, &'a Phrase)> {
    let mut all = Vec::new();
    let mut paragraph = String::new();
    // Where each line of the paragraph begins, with its number.
    let mut begins: Vec<(usize, usize)> = Vec::new();
    for (k, line) in text.lines().chain([""]).enumerate() {
        let line = bare(line);
        if !line.is_empty() {
            begins.push((paragraph.len(), k + 1));
            paragraph += &line.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
            paragraph.push(' ');
            continue;
        }
        for phrase in phrases {
            let words = phrase.words.join(" ");
            for (at, _) in paragraph.match_indices(&words) {
                let before = paragraph[..at].chars().next_back();
                let after = paragraph[at + words.len()..].chars().next();
                // `11 points` and `0.1 points` do not contain `1 points`.
                let number = before == Some('.') && words.starts_with(|c: char| c.is_ascii_digit());
                if !before.is_some_and(in_word) && !after.is_some_and(in_word) && !number {
                    let line = begins.iter().rev().find(|(begin, _)| *begin <= at);
                    all.push((line.expect("a line of the paragraph").1, phrase));
                }
            }
        }
        paragraph.clear();
        begins.clear();
    }
    all.sort_by_key(|(line, _)| *line);
    all
}

/// The files below a path with one of these extensions, without what is built.
fn files(path: &Path, extensions: &[&str], all: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name == "target" || name.starts_with('.') || name.starts_with("__") {
            return;
        }
        let mut entries: Vec<PathBuf> =
            std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect();
        entries.sort();
        for entry in entries {
            files(&entry, extensions, all);
        }
    } else if path.extension().is_some_and(|e| extensions.iter().any(|x| e == *x)) {
        all.push(path.to_owned());
    }
}

#[test]
fn a_planted_phrase_is_found_where_it_is() {
    let list = phrases("# a list\n\nif need be => if necessary\n1 points => 1 point\n");
    assert_eq!(list.len(), 2);
    let lines = |text: &str| found(text, &list).iter().map(|(line, _)| *line).collect::<Vec<_>>();
    assert_eq!(lines("one\ntwo, If Need be.\n"), [2]);
    assert_eq!(lines("x\n\n/// made if\n    /// need be, and if   need\n    /// be again\n"), [3, 4]);
    assert_eq!(lines("warn(\"made if need \"\n     \"be\");\nlet a = \"if \\\n    need be\";\n"), [1, 3]);
    assert_eq!(lines("# a comment: if\n# need be\nkey = 1 # if need be\n"), [1, 3]);
    assert_eq!(lines("> if need\n> be\n"), [1]);
    // The ends of paragraphs and of words, and numbers.
    assert!(lines("if need\n\nbe\n").is_empty());
    assert!(lines("/// if need\n///\n/// be\n").is_empty());
    assert!(lines("if need been; elif need be; 11 points, 0.1 points, 1 pointsize\n").is_empty());
    assert_eq!(lines("1 points and (1 points)"), [1, 1]);
    assert_eq!(found("if need be", &list)[0].1.instead, "if necessary");
}

#[test]
fn pages_messages_and_comments_contain_no_refused_phrase() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let list = phrases(include_str!("phrases.txt"));
    let (pages, sources) = (["md"].as_slice(), ["md", "rs", "cpp", "h", "py", "toml"].as_slice());
    let mut all = Vec::new();
    for page in ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs"] {
        files(&root.join(page), pages, &mut all);
    }
    for folder in ["docs", "fuzz", "lammps-plugin", "python", "rust-core", "tests", "validation"] {
        files(&root.join(folder), sources, &mut all);
    }
    all.sort();
    all.dedup();
    assert!(all.len() > 900, "only {} files were read", all.len());
    let mut refused = String::new();
    // This file plants phrases.
    for file in all.iter().filter(|file| !file.ends_with(file!())) {
        let text = String::from_utf8_lossy(&std::fs::read(file).unwrap()).into_owned();
        for (line, phrase) in found(&text, &list) {
            let name = file.strip_prefix(root).unwrap().display();
            refused +=
                &format!("\n{name}:{line}: \"{}\": say \"{}\"", phrase.words.join(" "), phrase.instead);
        }
    }
    assert!(refused.is_empty(), "refused by tests/tests/phrases.txt:{refused}");
}
