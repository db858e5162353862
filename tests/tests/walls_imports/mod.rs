//! Imports between the files of a crate, read from `use` statements and paths. Paths in the arguments of
//! macros are not read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use syn::visit::{self, Visit};

/// The files of a crate by module path (`engine::plan`; the root is empty), and the files that each imports from.
pub struct Crate {
    pub imports: BTreeMap<String, BTreeSet<String>>,
}

/// A path within this crate that a file names, from the crate's root.
struct Named {
    path: Vec<String>,
    /// The name by which a `pub use` re-exports the path.
    passed_on_as: Option<String>,
}

/// Reads the paths of one file, without code for tests.
struct File {
    /// The module path of the file, and of the modules around the present place in it.
    module: Vec<String>,
    children: Vec<String>,
    named: Vec<Named>,
}

impl Crate {
    /// Reads the crate whose root is `lib.rs` or `main.rs` in `folder`.
    pub fn read(folder: &Path) -> Crate {
        let mut files = BTreeMap::new();
        let root =
            ["lib.rs", "main.rs"].map(|name| folder.join(name)).into_iter().find(|file| file.is_file());
        read(&root.expect("the root of a crate"), folder, Vec::new(), &mut files);
        let imports = files.iter().map(|(name, file)| (name.clone(), imports(name, file, &files))).collect();
        Crate { imports }
    }

    /// Drops the imports of a file from modules below it: a parent may collect its children, which use the
    /// parent's definitions.
    pub fn without_gathering(mut self) -> Crate {
        for (from, to) in &mut self.imports {
            to.retain(|to| !to.starts_with(&format!("{from}::")));
        }
        self
    }

    /// Groups of files that import from each other in a circle.
    pub fn circles(&self) -> Vec<Vec<&str>> {
        let reach: BTreeMap<&str, BTreeSet<&str>> =
            self.imports.keys().map(|from| (from.as_str(), self.reachable(from))).collect();
        let mut circles: Vec<Vec<&str>> = Vec::new();
        for (from, to) in &reach {
            if to.contains(from) && !circles.iter().any(|circle| circle.contains(from)) {
                circles.push(to.iter().copied().filter(|other| reach[other].contains(from)).collect());
            }
        }
        circles
    }

    fn reachable<'a>(&'a self, from: &str) -> BTreeSet<&'a str> {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&str> = self.imports[from].iter().map(String::as_str).collect();
        while let Some(file) = next.pop() {
            if seen.insert(file) {
                next.extend(self.imports[file].iter().map(String::as_str));
            }
        }
        seen
    }
}

/// Reads a file and the files of the modules that it declares, which lie in `folder`.
fn read(path: &Path, folder: &Path, module: Vec<String>, files: &mut BTreeMap<String, File>) {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let syntax = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut file = File { module: module.clone(), children: Vec::new(), named: Vec::new() };
    for item in &syntax.items {
        if let syn::Item::Mod(child) = item {
            file.children.push(child.ident.to_string());
        }
    }
    file.visit_file(&syntax);
    for child in syntax.items.iter().filter_map(|item| match item {
        syn::Item::Mod(child) if child.content.is_none() && !is_for_tests(&child.attrs) => Some(child),
        _ => None,
    }) {
        let name = child.ident.to_string();
        let below = folder.join(&name);
        let beside =
            [folder.join(format!("{name}.rs")), below.join("mod.rs")].into_iter().find(|p| p.is_file());
        // A module at another path is shared with another crate.
        let Some(path) = beside else { continue };
        read(&path, &below, module.iter().cloned().chain([name]).collect(), files);
    }
    files.insert(module.join("::"), file);
}

/// The files that define the names in `file`, not those that re-export them.
fn imports(name: &str, file: &File, files: &BTreeMap<String, File>) -> BTreeSet<String> {
    let of = |named: &Named| {
        let to = resolve(&named.path, files, 0);
        // A module may re-export the names of its children; the root itself holds macros only.
        let shows_child =
            named.passed_on_as.is_some() && (name.is_empty() || to.starts_with(&format!("{name}::")));
        (to != name && !to.is_empty() && !shows_child).then_some(to)
    };
    file.named.iter().filter_map(of).collect()
}

/// The file that a path leads to.
fn resolve(path: &[String], files: &BTreeMap<String, File>, depth: usize) -> String {
    let mut at = 0;
    while at < path.len() && files.contains_key(&path[..=at].join("::")) {
        at += 1;
    }
    let file = path[..at].join("::");
    let passes = |named: &&Named| named.passed_on_as.as_ref() == path.get(at);
    match files[&file].named.iter().filter(|n| n.passed_on_as.is_some()).find(passes) {
        Some(next) if depth < 10 => {
            let further: Vec<String> = next.path.iter().chain(&path[at + 1..]).cloned().collect();
            resolve(&further, files, depth + 1)
        }
        _ => file,
    }
}

impl File {
    /// Records a path as it is written, if it belongs to this crate.
    fn note(&mut self, written: &[String], passed_on_as: Option<String>) {
        let up = written.iter().take_while(|s| *s == "super").count();
        let (base, rest) = match written[0].as_str() {
            "crate" => (0, &written[1..]),
            "self" => (self.module.len(), &written[1..]),
            "super" => (self.module.len() - up, &written[up..]),
            child if self.children.iter().any(|c| c == child) => (self.module.len(), written),
            _ => return,
        };
        let path = self.module[..base].iter().chain(rest).cloned().collect();
        self.named.push(Named { path, passed_on_as });
    }

    /// Records every path of the tree of a `use` statement.
    fn note_tree(&mut self, tree: &syn::UseTree, before: &[String], public: bool) {
        let with = |name: &syn::Ident| before.iter().cloned().chain([name.to_string()]).collect::<Vec<_>>();
        match tree {
            syn::UseTree::Path(path) => self.note_tree(&path.tree, &with(&path.ident), public),
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|item| self.note_tree(item, before, public));
            }
            syn::UseTree::Glob(_) => self.note(before, None),
            syn::UseTree::Name(name) if name.ident == "self" => self.note(before, None),
            syn::UseTree::Name(name) => {
                self.note(&with(&name.ident), public.then(|| name.ident.to_string()));
            }
            syn::UseTree::Rename(name) => {
                self.note(&with(&name.ident), public.then(|| name.rename.to_string()));
            }
        }
    }
}

impl<'ast> Visit<'ast> for File {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        let attributes = match item {
            syn::Item::Mod(item) => &item.attrs,
            syn::Item::Use(item) => &item.attrs,
            syn::Item::Fn(item) => &item.attrs,
            syn::Item::Impl(item) => &item.attrs,
            _ => &Vec::new(),
        };
        if !is_for_tests(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        self.module.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.module.pop();
    }

    fn visit_item_use(&mut self, statement: &'ast syn::ItemUse) {
        let public = !matches!(statement.vis, syn::Visibility::Inherited);
        self.note_tree(&statement.tree, &[], public);
    }

    fn visit_vis_restricted(&mut self, _: &'ast syn::VisRestricted) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let written: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if written.len() > 1 {
            self.note(&written, None);
        }
        visit::visit_path(self, path);
    }
}

/// Whether an item is compiled for tests alone.
fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string().replace(' ', "");
            condition == "test" || condition.starts_with("all(test,")
        }
        _ => false,
    })
}
