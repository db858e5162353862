//! The pages of `docs`: links have targets, every page is in the book, and the commands and files on pages work.

use psidpd_tests::{Block, Results, lammps, parts, psidpd, root, said};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

/// Pages outside the book whose links are checked too.
const BESIDE: [&str; 3] = ["README.md", "CONTRIBUTING.md", "lammps-plugin/README.md"];

/// Pages whose blocks are files and commands, to be followed from first to last. `python/tests/test_pages.py`
/// runs Python blocks; keys of models, scenes and observables have tests of their own.
const FOLLOWED: [&str; 3] = ["docs/tutorial.md", "docs/choosing.md", "docs/recipes.md"];

/// The pages of `docs`, by their paths in the checkout.
fn pages() -> BTreeSet<String> {
    let files = std::fs::read_dir(root().join("docs")).unwrap().map(|e| e.unwrap().file_name());
    let names = files.map(|name| name.into_string().unwrap());
    names.filter(|n| n.ends_with(".md")).map(|n| format!("docs/{n}")).collect()
}

/// The paragraphs of a page, without fenced blocks and without text in backquotes, which may span a line break.
fn prose(page: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join(page)).unwrap();
    let mut fenced = false;
    let outside = |line: &&str| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        !fence && !fenced
    };
    let lines: Vec<&str> = text.lines().filter(outside).collect();
    lines.join("\n").split("\n\n").map(|paragraph| paragraph.split('`').step_by(2).collect()).collect()
}

/// The code of a page's paragraphs that a line break divides, from its second line on.
fn broken_code(page: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join(page)).unwrap();
    let outside = text.split("\n```").step_by(2);
    let spans =
        outside.flat_map(|part| part.split("\n\n")).flat_map(|part| part.split('`').skip(1).step_by(2));
    spans.filter_map(|span| Some(span.split_once('\n')?.1.trim_start().to_owned())).collect()
}

/// The targets of links and pictures, except those of the web.
fn links(page: &str) -> Vec<String> {
    let lines = prose(page);
    let all =
        lines.iter().flat_map(|line| line.split("](").skip(1).filter_map(|rest| rest.split(')').next()));
    all.filter(|target| !target.contains("://")).map(str::to_owned).collect()
}

/// The anchors of a page's headings, for mdBook and for forges.
fn anchors(page: &str) -> BTreeSet<String> {
    let text = std::fs::read_to_string(root().join(page)).unwrap();
    let mut counts = BTreeMap::new();
    let headings = text.lines().filter_map(|l| l.strip_prefix('#')).map(|l| l.trim_start_matches('#').trim());
    headings
        .map(|heading| {
            let letters = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            let name: String = letters.collect::<String>().to_lowercase().replace(' ', "-");
            let count = counts.entry(name.clone()).and_modify(|n| *n += 1).or_insert(0);
            if *count == 0 { name } else { format!("{name}-{count}") }
        })
        .collect()
}

/// Normalises a path: `docs/../a` becomes `a`.
fn plain(path: &Path) -> String {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(parts.pop()),
            other => parts.push(other),
        }
    }
    parts.to_str().unwrap().to_owned()
}

#[test]
fn links_lead_somewhere() {
    let book = pages();
    let mut wrong = Vec::new();
    for page in book.iter().map(String::as_str).chain(BESIDE) {
        for link in links(page) {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => page.to_owned(),
                _ => plain(&Path::new(page).parent().unwrap().join(file)),
            };
            let exists = root().join(&target).exists();
            let inside = !book.contains(page) || target.starts_with("docs/");
            if !exists || !inside || !(anchor.is_empty() || anchors(&target).contains(anchor)) {
                wrong.push(format!("{page}: {link}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A line that begins with such a sign begins a list, a heading or a quotation, though it is amid code.
#[test]
fn no_code_is_broken_into_a_list() {
    for page in pages().iter().map(String::as_str).chain(BESIDE) {
        for line in broken_code(page) {
            let word = line.split(' ').next().unwrap();
            let begins = ["-", "+", "*", "#", ">"].contains(&word)
                || word.trim_end_matches(['.', ')']).parse::<u32>().is_ok_and(|_| word.ends_with(['.', ')']));
            assert!(!begins, "{page}: {line}");
        }
    }
}

/// A formula ends in the line that it begins in: neither a forge nor `docs/build` typesets another.
#[test]
fn formulas_end_in_their_line() {
    let mut count = 0;
    for page in pages() {
        let text = std::fs::read_to_string(root().join(&page)).unwrap();
        let outside = text.split("\n```").step_by(2);
        for line in outside.flat_map(str::lines).filter(|line| line.contains("$`")) {
            let ends = line.split("$`").skip(1).filter(|rest| rest.contains("`$")).count();
            assert_eq!(ends, line.matches("$`").count(), "{page}: {line}");
            count += ends;
        }
    }
    assert!(count > 100);
}

#[test]
fn every_page_is_in_the_book() {
    let contents: BTreeSet<String> =
        links("docs/SUMMARY.md").iter().map(|page| format!("docs/{page}")).collect();
    let mut all = pages();
    all.remove("docs/SUMMARY.md");
    assert_eq!(contents, all);
}

/// Every picture stands beside the command or the program that makes it, or its page says that there is none.
#[test]
fn every_picture_says_how_it_was_made() {
    let mut wrong = Vec::new();
    for page in pages().iter().map(String::as_str).chain(BESIDE) {
        let text = std::fs::read_to_string(root().join(page)).unwrap();
        // A notebook is the program itself.
        if text.contains("drawings of this page was not kept") || page.starts_with("docs/notebook-") {
            continue;
        }
        let parts: Vec<&str> = text.split("\n\n").collect();
        for (k, part) in parts.iter().enumerate().filter(|(_, part)| part.contains("![")) {
            let near = &parts[k.saturating_sub(2)..parts.len().min(k + 3)];
            let is_said = |near: &&str| {
                ["psidpd ", "```python", "recipes.md#", "/report.html", "was not kept"]
                    .iter()
                    .any(|how| near.contains(how))
            };
            if !near.iter().any(is_said) {
                wrong.push(format!("{page}: {part}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Pages that are not followed, and the test that compares their blocks of text with what is printed.
const PRINTED_ELSEWHERE: [(&str, &str); 2] =
    [("docs/units.md", "python/tests/test_pages.py"), ("docs/running.md", "tests/tests/resume.rs")];

/// Blocks of text are printed lines, and each page with one is followed, or a test elsewhere prints them;
/// notebooks are executed.
#[test]
fn printed_lines_are_compared() {
    let others = PRINTED_ELSEWHERE.map(|(page, test)| {
        assert!(root().join(test).is_file(), "{test}");
        page
    });
    let all = pages();
    let with_text = all.iter().filter(|page| parts(page).iter().any(|part| part.language == "text"));
    let not_compared = |page: &&String| {
        let page = page.as_str();
        !page.starts_with("docs/notebook-") && !FOLLOWED.contains(&page) && !others.contains(&page)
    };
    assert_eq!(with_text.filter(not_compared).collect::<Vec<_>>(), Vec::<&String>::new());
}

/// Follows a page in an empty folder and compares its claims with the results. A block of TOML begins with
/// the name of its file. Returns the number of compared numbers.
fn follow(page: &str) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let mut results = Results::default();
    for Block { language, text } in parts(page) {
        match language.as_str() {
            "toml" => {
                let name = text.lines().next().and_then(|l| l.strip_prefix("# ")).unwrap_or_default();
                assert!(name.ends_with(".toml"), "{page}: a block does not name its file:\n{text}");
                std::fs::write(folder.path().join(name), &text).unwrap();
            }
            "sh" => {
                for line in text.lines() {
                    let words: Vec<&str> = line.split_whitespace().collect();
                    assert_eq!(words[0], "psidpd", "{page}: {line}");
                    let output = psidpd(folder.path(), &words[1..]);
                    assert!(output.status.success(), "{page}: {line}\n{}", said(&output));
                    // Nor are there rounding errors, as 18.999999999999996 or -4.2633e-14.
                    for never in ["do not trust", "99999999", "e-14"] {
                        assert!(!said(&output).contains(never), "{page}: {line}\n{}", said(&output));
                    }
                    results.add(&output.stdout);
                    let out = words.iter().position(|word| *word == "--out").map(|at| words[at + 1]);
                    results.add_observables(&folder.path().join(out.unwrap_or_default()));
                }
            }
            "lammps" => {
                let (host, plugin) = lammps();
                let there = format!("\"{}\"", plugin.display());
                let script = folder.path().join("in.page");
                std::fs::write(&script, text.replace("target/lammps/psidpdplugin.so", &there)).unwrap();
                let limit = Duration::from_secs(300);
                let run = host.run_script(1, folder.path(), &script, &["-log", "none"], limit).unwrap();
                assert!(run.stdout.contains("Loop time"), "{page}: {}", run.stdout);
            }
            "text" => results.hold_lines(page, &text),
            // The tables of this page are data of `check`, and its tests compare them.
            "" if page == "docs/choosing.md" => {
                let told: Vec<&str> = text.lines().filter(|line| !line.starts_with('|')).collect();
                results.hold_numbers(page, &told.join("\n"));
            }
            "" => results.hold_numbers(page, &text),
            other => panic!("{page}: nothing follows blocks of {other}"),
        }
    }
    results.held
}

#[test]
fn pages_can_be_followed() {
    let held = FOLLOWED.map(follow);
    // The tutorial has nine numbers with errors: six of the slab, three of the drop. The recipes have a viscosity.
    assert_eq!(held, [9, 0, 1]);
}

/// The test finds a block and a number that no command has printed.
#[test]
fn a_page_that_says_something_else_is_seen() {
    let results = || {
        let mut results = Results::default();
        results.add("liquid  16.136 ± 0.044  unit\n".as_bytes());
        results
    };
    let seen = |hold: &dyn Fn(&mut Results)| {
        let hold = std::panic::AssertUnwindSafe(|| hold(&mut results()));
        std::panic::catch_unwind(hold).is_err()
    };
    for (text, wrong) in [("16.14(4)", false), ("16.3(1)", false), ("16.44(4)", true), ("16.14(20)", true)] {
        assert_eq!(seen(&|results| results.hold_numbers("a page", text)), wrong, "{text}");
    }
    for (text, wrong) in
        [("liquid 16.14 ± 0.04 unit", false), ("liquid 16.16 ± 0.04 unit", true), ("liquid", true)]
    {
        assert_eq!(seen(&|results| results.hold_lines("a page", text)), wrong, "{text}");
    }
}

/// The steps of `force-gradient` in a scene: those behind its last header that gives one.
fn long_steps(scene: &str) -> Vec<f64> {
    let value = |part: &str, key: &str| {
        let line = part.lines().find(|line| line.split('=').next().is_some_and(|word| word.trim() == key))?;
        Some(line.split('=').nth(1)?.split('#').next()?.trim().trim_matches('"').to_owned())
    };
    let parts = scene.split("\n[");
    let long = parts.filter(|part| value(part, "integrator").as_deref() == Some("force-gradient"));
    long.filter_map(|part| value(part, "dt")?.parse().ok()).collect()
}

/// Long steps of one fluid are the same in the table of steps, on the first page and in the templates.
#[test]
fn pages_and_templates_have_the_steps_of_the_table() {
    let read = |path: &str| std::fs::read_to_string(root().join(path)).unwrap();
    let table = read("docs/choosing.md");
    let templates = "validation/dynamics/src/scene/templates";
    for (row, scenes) in [
        ("standard DPD, a = 25", vec![format!("{templates}/bulk.toml")]),
        (
            "Warren, sets 5 and 6",
            vec![
                format!("{templates}/slab.toml"),
                format!("{templates}/pendant-drop.toml"),
                "README.md".to_owned(),
            ],
        ),
        ("spline drop", vec![format!("{templates}/droplet.toml")]),
    ] {
        let mut rows = table
            .lines()
            .filter(|line| line.starts_with(&format!("| {row}")) && line.matches('|').count() == 4);
        let cell = rows.next_back().unwrap().split('|').nth(3).unwrap().trim();
        let step: f64 = cell.split([' ', ';']).next().unwrap().parse().unwrap();
        for scene in scenes {
            let found = long_steps(&read(&scene));
            assert!(
                !found.is_empty() && found.iter().all(|dt| *dt == step),
                "{scene}: {found:?}, not {step}"
            );
        }
    }
}
