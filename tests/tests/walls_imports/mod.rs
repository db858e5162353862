//! Which file of a crate imports from which: read from `use` statements and paths, without the compiler.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The files of a crate by module path (`engine::plan`; the root is empty), and their imports.
pub struct Crate {
    pub imports: BTreeMap<String, BTreeSet<String>>,
}

struct Module {
    /// Names that the module passes on, with the absolute paths of what they are.
    passed_on: BTreeMap<String, Vec<String>>,
    paths: Vec<Import>,
}

struct Import {
    path: Vec<String>,
    /// The name it is imported as, of a `pub use`.
    passed_on_as: Option<String>,
}

impl Crate {
    /// Reads the crate whose sources are below `folder`.
    pub fn read(folder: &Path) -> Crate {
        let mut files = Vec::new();
        collect(folder, &mut files);
        let texts: BTreeMap<String, String> = files
            .iter()
            .map(|file| (module_of(folder, file), std::fs::read_to_string(file).expect("a source file")))
            .collect();
        // Files of tests are no part of the crate.
        let tests: BTreeSet<String> = texts
            .iter()
            .flat_map(|(module, text)| {
                let children = test_modules(text);
                children.into_iter().map(|child| join(module, &child)).collect::<Vec<_>>()
            })
            .collect();
        let in_tests =
            |module: &str| tests.iter().any(|t| module == t || module.starts_with(&format!("{t}::")));
        let modules: BTreeMap<String, Module> = texts
            .iter()
            .filter(|(module, _)| !in_tests(module))
            .map(|(module, text)| (module.clone(), Module::read(module, &strip(text))))
            .collect();
        let imports =
            modules.iter().map(|(name, module)| (name.clone(), imports_of(name, module, &modules))).collect();
        Crate { imports }
    }

    /// Groups of files that import from each other in a circle.
    pub fn cycles(&self) -> Vec<Vec<&str>> {
        let reach: BTreeMap<&str, BTreeSet<&str>> =
            self.imports.keys().map(|from| (from.as_str(), self.reachable(from))).collect();
        let mut cycles: Vec<Vec<&str>> = Vec::new();
        for from in reach.keys() {
            if !reach[from].contains(from) || cycles.iter().any(|cycle| cycle.contains(from)) {
                continue;
            }
            cycles.push(
                reach
                    .keys()
                    .copied()
                    .filter(|to| reach[from].contains(to) && reach[to].contains(from))
                    .collect(),
            );
        }
        cycles
    }

    fn reachable(&self, from: &str) -> BTreeSet<&str> {
        let mut seen = BTreeSet::new();
        let mut next = vec![from];
        while let Some(module) = next.pop() {
            for to in &self.imports[module] {
                if seen.insert(to.as_str()) {
                    next.push(to);
                }
            }
        }
        seen
    }
}

/// What a module imports: the files that the names come from, not those that pass them on.
fn imports_of(name: &str, module: &Module, modules: &BTreeMap<String, Module>) -> BTreeSet<String> {
    module
        .paths
        .iter()
        .filter_map(|import| {
            let to = resolve(&import.path, modules, 0)?;
            // A module may show the names of its children.
            let of_child = name.is_empty() || to.starts_with(&format!("{name}::"));
            // Of the root itself there are macros only.
            (to != name && !to.is_empty() && !(import.passed_on_as.is_some() && of_child)).then_some(to)
        })
        .collect()
}

/// The file that an absolute path leads to.
fn resolve(path: &[String], modules: &BTreeMap<String, Module>, depth: usize) -> Option<String> {
    let mut module = String::new();
    let mut at = 0;
    while at < path.len() && modules.contains_key(&join(&module, &path[at])) {
        module = join(&module, &path[at]);
        at += 1;
    }
    let passed_on = path.get(at).and_then(|name| modules[&module].passed_on.get(name));
    if let Some(next) = passed_on.filter(|_| depth < 10) {
        let further: Vec<String> = next.iter().chain(&path[at + 1..]).cloned().collect();
        return resolve(&further, modules, depth + 1);
    }
    Some(module)
}

impl Module {
    fn read(name: &str, text: &str) -> Module {
        let paths: Vec<Import> = paths(text)
            .into_iter()
            .filter_map(|(path, public)| {
                let last = path.last()?.clone();
                Some(Import { path: absolute(name, text, &path)?, passed_on_as: public.then_some(last) })
            })
            .collect();
        let passed_on = paths
            .iter()
            .filter_map(|import| Some((import.passed_on_as.clone()?, import.path.clone())))
            .collect();
        Module { passed_on, paths }
    }
}

/// The absolute path, of names of this crate.
fn absolute(module: &str, text: &str, path: &[String]) -> Option<Vec<String>> {
    let mut here: Vec<String> = module.split("::").filter(|s| !s.is_empty()).map(str::to_owned).collect();
    match path[0].as_str() {
        "crate" => return Some(path[1..].to_vec()),
        "self" => {}
        "super" => {
            let up = path.iter().take_while(|s| *s == "super").count();
            here.truncate(here.len().checked_sub(up)?);
            return Some(here.into_iter().chain(path[up..].iter().cloned()).collect());
        }
        child if declares(text, child) => {
            return Some(here.into_iter().chain(path.iter().cloned()).collect());
        }
        _ => return None,
    }
    Some(here.into_iter().chain(path[1..].iter().cloned()).collect())
}

fn declares(text: &str, child: &str) -> bool {
    text.contains(&format!("mod {child};"))
}

/// All paths of `use` statements, groups written out, and whether they are public; and paths elsewhere in the code that
/// begin with `crate` or `super`.
fn paths(text: &str) -> Vec<(Vec<String>, bool)> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(at) = next_word(rest, &["use", "crate", "super"]) {
        let (before, from) = rest.split_at(at);
        if let Some(statement) = from.strip_prefix("use").filter(|s| s.starts_with(char::is_whitespace)) {
            let end = statement.find(';').unwrap_or(statement.len());
            let line = before.rsplit(['\n', ';', '{', '}']).next().unwrap_or("");
            let public = line.trim_start().starts_with("pub");
            let tree: String = statement[..end].chars().filter(|c| !c.is_whitespace() || *c == ' ').collect();
            let first = found.len();
            write_out(&tree, &[], public, &mut found);
            found[first..].iter_mut().for_each(|(path, _)| leave_inline_modules(before_of(text, from), path));
            rest = &statement[end..];
        } else {
            let end =
                from.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(from.len());
            let path = &from[..end];
            // A macro belongs to no module.
            if path.contains("::")
                && !from[end..].starts_with('!')
                && !line_of(before).trim_start().starts_with("pub(")
            {
                let mut path = path.split("::").filter(|s| !s.is_empty()).map(str::to_owned).collect();
                leave_inline_modules(before_of(text, from), &mut path);
                found.push((path, false));
            }
            rest = &from[end..];
        }
    }
    found
}

/// The text before a part of it.
fn before_of<'a>(text: &'a str, part: &str) -> &'a str {
    &text[..text.len() - part.len()]
}

/// In a module within the file the first `super` is the file itself.
fn leave_inline_modules(before: &str, path: &mut Vec<String>) {
    let mut blocks = Vec::new();
    for (at, c) in before.char_indices() {
        match c {
            '{' => {
                let head = before[..at].trim_end().rsplit([';', '{', '}']).next().unwrap_or("");
                blocks.push(head.split_whitespace().rev().nth(1) == Some("mod"));
            }
            '}' => {
                blocks.pop();
            }
            _ => {}
        }
    }
    for _ in blocks.into_iter().filter(|inline| *inline) {
        match path[0].as_str() {
            "super" => path[0] = "self".to_owned(),
            _ => return,
        }
        if path.get(1).is_some_and(|next| next == "super") {
            path.remove(0);
        }
    }
}

fn line_of(before: &str) -> &str {
    before.rsplit('\n').next().unwrap_or("")
}

/// Where the first of some words begins.
fn next_word(text: &str, words: &[&str]) -> Option<usize> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let starts = words.iter().flat_map(|word| text.match_indices(word).map(|(at, _)| (at, word.len())));
    let whole = starts.filter(|(at, length)| {
        let before = text[..*at].chars().next_back();
        let behind = text[at + length..].chars().next();
        !before.is_some_and(|c| is_name(c) || c == ':' || c == '$') && !behind.is_some_and(is_name)
    });
    whole.map(|(at, _)| at).min()
}

/// `a::{b, c::{d, e as f}}` as `a::b`, `a::c::d` and `a::c::e`.
fn write_out(tree: &str, before: &[String], public: bool, found: &mut Vec<(Vec<String>, bool)>) {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let head = tree[..open].split("::").map(str::trim).filter(|s| !s.is_empty()).map(str::to_owned);
        let before: Vec<String> = before.iter().cloned().chain(head).collect();
        let inner = &tree[open + 1..tree.rfind('}').unwrap_or(tree.len())];
        let mut depth = 0;
        let parts = inner.split(|c| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            c == ',' && depth == 0
        });
        parts.filter(|part| !part.trim().is_empty()).for_each(|part| write_out(part, &before, public, found));
        return;
    }
    let name = tree.split(" as ").next().unwrap_or(tree);
    let segments = name.split("::").map(str::trim).filter(|s| !s.is_empty() && *s != "*" && *s != "self");
    let mut path: Vec<String> = before.to_vec();
    let leading_self = name.trim_start().starts_with("self::") && before.is_empty();
    path.extend(leading_self.then(|| "self".to_owned()));
    path.extend(segments.map(str::to_owned));
    if !path.is_empty() {
        found.push((path, public));
    }
}

/// The code without comments, strings, and modules of tests.
fn strip(text: &str) -> String {
    let code = without_comments(text);
    let mut out = String::with_capacity(code.len());
    let mut rest = code.as_str();
    while let Some((at, end)) = next_test(rest) {
        out.push_str(&rest[..at]);
        rest = skip_item(&rest[end..]);
    }
    out.push_str(rest);
    out
}

/// Where the next `#[cfg(test)]` or `#[cfg(all(test, …))]` begins, and ends.
fn next_test(text: &str) -> Option<(usize, usize)> {
    let found = ["#[cfg(test)]", "#[cfg(all(test,"].iter().filter_map(|attribute| text.find(attribute));
    let at = found.min()?;
    Some((at, at + text[at..].find(")]")? + 2))
}

/// What follows an item: its `;` or its block.
fn skip_item(text: &str) -> &str {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            ';' if depth == 0 => return &text[at + 1..],
            '{' => depth += 1,
            '}' => {
                depth -= 1;
                if depth == 0 {
                    return &text[at + 1..];
                }
            }
            _ => {}
        }
    }
    ""
}

fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skip = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |at| at + 2)
        } else if let Some(length) = raw_string(rest) {
            length
        } else if c == '"' {
            string(rest)
        } else if let Some(length) = character(rest) {
            length
        } else {
            out.push(c);
            c.len_utf8()
        };
        rest = &rest[skip..];
    }
    out
}

fn raw_string(text: &str) -> Option<usize> {
    let body = text.strip_prefix('r')?;
    let hashes = body.chars().take_while(|c| *c == '#').count();
    let body = body[hashes..].strip_prefix('"')?;
    let end = body.find(&format!("\"{}", "#".repeat(hashes)))?;
    Some(1 + hashes + 1 + end + 1 + hashes)
}

fn string(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return at + 1,
            '\\' => escaped = !escaped,
            _ => escaped = false,
        }
    }
    text.len()
}

/// The length of a character literal; `'a` of a lifetime is none.
fn character(text: &str) -> Option<usize> {
    let body = text.strip_prefix('\'')?;
    let first = body.chars().next()?;
    let from = if first == '\\' { 2 } else { first.len_utf8() };
    let end = body.get(from..)?.find('\'')?;
    (end == 0 || first == '\\').then_some(1 + from + end + 1)
}

/// Names of modules that are compiled for tests only.
fn test_modules(text: &str) -> Vec<String> {
    let code = without_comments(text);
    let (mut rest, mut modules) = (code.as_str(), Vec::new());
    while let Some((_, end)) = next_test(rest) {
        rest = &rest[end..];
        let name = rest.trim_start().strip_prefix("mod ").and_then(|item| item.split([';', '{', ' ']).next());
        modules.extend(name.map(str::to_owned));
    }
    modules
}

fn join(module: &str, name: &str) -> String {
    if module.is_empty() { name.to_owned() } else { format!("{module}::{name}") }
}

/// `engine/sweep/mod.rs` and `engine/sweep.rs` are `engine::sweep`.
fn module_of(folder: &Path, file: &Path) -> String {
    let relative = file.strip_prefix(folder).expect("a file of the folder").with_extension("");
    let mut parts: Vec<&str> = relative.iter().filter_map(|part| part.to_str()).collect();
    if matches!(parts.last(), Some(&("mod" | "lib" | "main"))) {
        parts.pop();
    }
    parts.join("::")
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a folder of sources");
    for path in entries.map(|entry| entry.expect("an entry of the folder").path()) {
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

#[test]
fn groups_are_written_out() {
    let paths =
        |text: &str| -> Vec<String> { paths(text).into_iter().map(|(path, _)| path.join("::")).collect() };
    assert_eq!(
        paths("use crate::a::{b, c::{d as e, f}};"),
        ["crate::a::b", "crate::a::c::d", "crate::a::c::f"]
    );
    assert_eq!(paths("pub(super) use super::x::{self, Y};"), ["super::x", "super::x::Y"]);
    assert_eq!(paths("fn f(p: &crate::a::B) {}"), ["crate::a::B"]);
    assert_eq!(
        paths(&strip("// use crate::a;\nlet x = \"use crate::b\";\n#[cfg(test)]\nmod t { use crate::c; }")),
        [""; 0]
    );
}
