//! LAMMPS's headers, from which the styles know the sizes and offsets of its classes. Releases with the same version number may
//! differ there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// A digest of each header that files include, directly or through others, and that is in the folder of LAMMPS's headers.
#[cfg_attr(not(test), allow(dead_code))] // The build script calls this.
pub fn digests(sources: &Path, headers: &Path) -> BTreeMap<String, u64> {
    let files = fs::read_dir(sources).into_iter().flatten().flatten();
    let mut names: BTreeSet<String> = BTreeSet::new();
    for file in files {
        names.extend(included(&String::from_utf8_lossy(&fs::read(file.path()).unwrap_or_default())));
    }
    let mut found = BTreeMap::new();
    while let Some(name) = names.pop_first() {
        if let Ok(text) = fs::read(headers.join(&name)) {
            let text = String::from_utf8_lossy(&text);
            names.extend(included(&text).filter(|other| !found.contains_key(other)));
            found.insert(name, digest(&text));
        }
    }
    found
}

/// The names in `#include "name"`.
fn included(text: &str) -> impl Iterator<Item = String> {
    let lines = text
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include"));
    let names = lines.filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next());
    names.map(str::to_owned).collect::<Vec<_>>().into_iter()
}

/// Writes digests as `name=digest name=digest …`.
#[cfg_attr(not(test), allow(dead_code))] // The build script calls this.
pub fn written(digests: &BTreeMap<String, u64>) -> String {
    let words: Vec<String> = digests.iter().map(|(name, digest)| format!("{name}={digest:016x}")).collect();
    words.join(" ")
}

/// The first header of a folder that differs from the written digests. A header that the folder lacks is no difference.
pub fn difference(written: &str, headers: &Path) -> Option<String> {
    written.split(' ').filter_map(|word| word.split_once('=')).find_map(|(name, wanted)| {
        let text = fs::read(headers.join(name)).ok()?;
        let found = format!("{:016x}", digest(&String::from_utf8_lossy(&text)));
        (found != wanted).then(|| name.to_owned())
    })
}

/// A hash (FNV-1a) of a text without comments and blanks.
fn digest(text: &str) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
            continue;
        }
        if rest.starts_with("/*") {
            rest = rest.find("*/").map_or("", |end| &rest[end + 2..]);
            continue;
        }
        if !c.is_whitespace() {
            for byte in c.encode_utf8(&mut [0; 4]).bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
        rest = &rest[c.len_utf8()..];
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_member_that_moves_is_found_and_a_comment_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let (sources, headers) = (folder.path().join("cpp"), folder.path().join("include"));
        for path in [&sources, &headers] {
            fs::create_dir(path).unwrap();
        }
        let write = |name: &str, text: &str| fs::write(headers.join(name), text).unwrap();
        fs::write(sources.join("style.cpp"), "#include <vector>\n#include \"pair.h\"\n#include \"own.h\"\n")
            .unwrap();
        write("pair.h", "#include \"pointers.h\"\nclass Pair { int a, b; };\n");
        write("pointers.h", "class Pointers {};\n");
        write("unused.h", "class Unused {};\n");
        let text = written(&digests(&sources, &headers));
        let names: Vec<&str> = text.split(' ').map(|word| word.split('=').next().unwrap()).collect();
        assert_eq!(names, ["pair.h", "pointers.h"]);
        assert_eq!(difference(&text, &headers), None);
        write("pair.h", "// moved\n#include \"pointers.h\"\nclass Pair {\n  int a,  /* first */ b;\n};\n");
        write("unused.h", "class Unused { int a; };\n");
        assert_eq!(difference(&text, &headers), None);
        write("pointers.h", "class Pointers { int a; };\n");
        assert_eq!(difference(&text, &headers), Some("pointers.h".to_owned()));
        write("pair.h", "#include \"pointers.h\"\nclass Pair { int b, a; };\n");
        assert_eq!(difference(&text, &headers), Some("pair.h".to_owned()));
        // Headers that are not there say nothing.
        assert_eq!(difference(&text, &folder.path().join("none")), None);
    }
}
