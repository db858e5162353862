//! Programs in Python that send commands to LAMMPS: `lmp.command("…")`, lists of commands, texts of several lines.
//!
//! Every text in quotes is read as commands, in the order of the program; all other text keeps its bytes.

use super::command::{command, commands};
use super::survey::Read;
use super::work::{Work, names_built_in};
use super::{Converted, Law};

/// Converts the program `old`.
pub fn program(old: &str, law: Law, plugin: Option<&str>, read: Read) -> Converted {
    let mut code = Vec::new();
    let texts = literals(old);
    let whole: Vec<String> = texts.iter().map(|text| lines_of(text, old, &mut code)).collect();
    let mut work = Work::new(&whole.join("\n"), law, plugin, read);
    work.inline = true;
    let mut new = String::new();
    let mut at = 0;
    for (text, inside) in texts.iter().zip(&whole) {
        let first = old[..text.begin].matches('\n').count() + 1;
        let mut changed = false;
        let mut lines: Vec<String> = Vec::new();
        for mut command in commands(inside) {
            command.line += first - 1;
            // A piece of a command, to which the program adds its end, keeps its last blank.
            let piece = text.is_piece(old) && inside.ends_with(' ');
            let filled = text.is_filled(old);
            let result = match (work.convert(&command), piece) {
                // The program inserts as many numbers as before.
                (Some(result), _) if result.is_empty() && filled => {
                    Some(format!("# not needed: {}", command.text))
                }
                (Some(result), true) if result.is_empty() => Some("# not needed: ".to_owned()),
                (Some(result), true) => Some(result + " "),
                (result, _) => result,
            };
            let percents = |text: &str| text.matches('%').count();
            if filled && result.as_deref().is_some_and(|new| percents(new) != percents(command.text)) {
                work.by_hand(
                    &command,
                    "the program inserts another number of values by % than the new text has",
                );
            }
            // A piece such as "mvv/dpd", which the program adds to another.
            if result.is_none() && names_built_in(&command.words[..command.words.len().min(1)]) {
                work.by_hand(&command, "names the built-in style: rewrite it for mdpd/psi");
            }
            changed |= result.is_some();
            let result = result.unwrap_or_else(|| command.text.to_owned());
            lines.extend(result.split_inclusive('\n').map(str::to_owned));
        }
        if !changed {
            continue;
        }
        new += &old[at..text.begin];
        let lines: Vec<String> = lines.iter().map(|line| restored(line, &code)).collect();
        let place = text.place(old);
        if lines.len() > 1 && matches!(place, Place::Value) {
            let text = "this text is several commands now, in lines: send them one by one";
            work.by_hand(&command(first, inside), text);
        }
        new += &text.with(&place, &lines);
        at = text.end;
    }
    new += &old[at..];
    let mut found = work.finish();
    found.script = new;
    for note in found.changed.iter_mut().chain(&mut found.left).chain(&mut found.by_hand) {
        note.text = restored(&note.text, &code);
    }
    for (note, _) in &mut found.models {
        note.text = restored(&note.text, &code);
    }
    found
}

/// A text in quotes.
struct Literal<'a> {
    /// Where it begins, with its prefix, and ends.
    begin: usize,
    end: usize,
    /// `f`, `r` and the like, with the quote.
    open: &'a str,
    quote: &'a str,
    formatted: bool,
    inside: &'a str,
}

impl Literal<'_> {
    /// Whether the program adds to the text.
    fn is_piece(&self, program: &str) -> bool {
        let after = program[self.end..].trim_start();
        after.starts_with('+') || after.starts_with(['"', '\'']) && !after.starts_with("\"\"\"")
    }

    /// Whether the program inserts values by `%`.
    fn is_filled(&self, program: &str) -> bool {
        program[self.end..].trim_start().starts_with('%')
    }

    fn is_long(&self) -> bool {
        self.quote.len() == 3
    }

    /// Where more commands than one go.
    fn place(&self, program: &str) -> Place {
        if self.is_long() || self.inside.contains("\\n") || self.is_piece(program) {
            return Place::Text { ends: self.inside.ends_with("\\n") && !self.is_piece(program) };
        }
        if self.names_file(program) {
            return Place::File;
        }
        let line = program[..self.begin].rfind('\n').map_or(0, |k| k + 1);
        let (head, after) = (&program[line..self.begin], program[self.end..].trim_start_matches([' ', '\t']));
        let begin = head.trim_start();
        let indent = &head[..head.len() - begin.len()];
        let after_comma = head.trim_end().ends_with(',') || after.starts_with(',');
        // The statement that has the text, behind others of its line.
        let shared = begin.rfind(": ").map(|k| k + 2).max(begin.rfind(';').map(|k| k + 1));
        let statement = begin[shared.unwrap_or(0)..].trim_start();
        let between = |end: &str| match shared {
            Some(_) => format!("{end}; {statement}"),
            None => format!("{end}\n{indent}{statement}"),
        };
        let name = statement.strip_suffix('(');
        let is_call =
            |name: &str| !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || "._".contains(c));
        match self.bracket(program) {
            Some('(') if name.is_some_and(is_call) && after.starts_with(')') => {
                Place::Statement(between(")"))
            }
            Some('(') if !after_comma => Place::Value,
            None if statement == "yield " => Place::Statement(between("")),
            None if !after_comma => Place::Value,
            _ => Place::Element,
        }
    }

    /// Whether LAMMPS reads a script of this name.
    fn names_file(&self, program: &str) -> bool {
        program[..self.begin].trim_end().ends_with(".file(")
    }

    /// The innermost bracket around the text.
    fn bracket(&self, program: &str) -> Option<char> {
        let mut open = Vec::new();
        let mut at = 0;
        let outside = literals(&program[..self.begin]).into_iter().map(|text| (text.begin, text.end));
        for (begin, end) in outside.chain([(self.begin, self.begin)]) {
            for line in program[at..begin].lines() {
                for c in line.split('#').next().unwrap_or_default().chars() {
                    match c {
                        '(' | '[' | '{' => open.push(c),
                        ')' | ']' | '}' => {
                            open.pop();
                        }
                        _ => {}
                    }
                }
            }
            at = end;
        }
        open.pop()
    }

    /// The text in the program for new commands.
    fn with(&self, place: &Place, lines: &[String]) -> String {
        let quoted = |line: &str| format!("{}{line}{}", self.open, self.quote);
        let parts: Vec<&str> = lines.iter().map(|line| line.trim_end_matches('\n')).collect();
        let between = match place {
            Place::File => return quoted(parts.concat().trim_start_matches("include ").trim()),
            Place::Text { .. } if self.is_long() => return quoted(&lines.concat()),
            Place::Text { ends } => {
                return quoted(&format!("{}{}", parts.join("\\n"), if *ends { "\\n" } else { "" }));
            }
            Place::Value => return quoted(&parts.join("\\n")),
            Place::Statement(between) => between.as_str(),
            Place::Element => ", ",
        };
        let parts: Vec<String> =
            if parts.is_empty() { vec![quoted("")] } else { parts.iter().map(|p| quoted(p)).collect() };
        parts.join(between)
    }
}

/// What a text in quotes is in its program.
enum Place {
    /// Commands in lines; `ends` if the last one has an end.
    Text { ends: bool },
    /// An element of a list.
    Element,
    /// The only argument of a statement, with what goes between two of them.
    Statement(String),
    /// The name of a script.
    File,
    /// A value for one command.
    Value,
}

/// The marks around the number of a piece of code in a formatted text, in which there may be blanks and quotes.
const MARK: char = '\u{E000}';

/// The commands of a literal as lines, with marks in the place of code, which is added to `code`.
fn lines_of<'a>(text: &Literal<'a>, program: &str, code: &mut Vec<&'a str>) -> String {
    if text.names_file(program) {
        return format!("include {}", text.inside);
    }
    let mut found = String::new();
    let mut rest = text.inside;
    while let Some(at) = rest.find(['{', '\\']) {
        found += &rest[..at];
        rest = &rest[at..];
        let end = if rest.starts_with('{') && text.formatted && !rest.starts_with("{{") {
            end_of_code(rest)
        } else {
            None
        };
        if let Some(end) = end {
            let inside = rest[1..end - 1].trim();
            if inside.parse::<f64>().is_ok() {
                found += inside;
            } else {
                found += &format!("{MARK}{}{MARK}", code.len());
                code.push(&rest[..end]);
            }
            rest = &rest[end..];
        } else if !text.is_long() && rest.starts_with("\\n") {
            found.push('\n');
            rest = &rest[2..];
        } else {
            let step = if rest.starts_with("{{") { 2 } else { 1 };
            found += &rest[..step];
            rest = &rest[step..];
        }
    }
    found + rest
}

/// A line with the code of the marks.
fn restored(line: &str, code: &[&str]) -> String {
    let parts = line.split(MARK).enumerate().map(|(k, part)| {
        let known = part.parse::<usize>().ok().filter(|_| k % 2 == 1).and_then(|k| code.get(k));
        known.copied().unwrap_or(part)
    });
    parts.collect()
}

/// Where the code in braces at the beginning of a text ends.
fn end_of_code(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (k, c) in text.char_indices() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if depth == 0 {
            return Some(k + 1);
        }
    }
    None
}

/// The texts in quotes of a program, without those in comments.
fn literals(program: &str) -> Vec<Literal<'_>> {
    let mut found = Vec::new();
    let bytes = program.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            b'#' => at += program[at..].find('\n').unwrap_or(program.len() - at),
            b'"' | b'\'' => {
                let single = &program[at..=at];
                let triple = single.repeat(3);
                let quote = if program[at..].starts_with(&triple) { &program[at..at + 3] } else { single };
                let letters = program[..at].bytes().rev().take_while(|b| b"rRbBfFuU".contains(b)).count();
                let begin = at - letters;
                // Letters that end a longer name are no prefix.
                let begin = if program[..begin].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
                    at
                } else {
                    begin
                };
                let start = at + quote.len();
                let mut end = start;
                while end < bytes.len() && !program[end..].starts_with(quote) {
                    if quote.len() == 1 && bytes[end] == b'\n' {
                        break;
                    }
                    end += if bytes[end] == b'\\' { 2 } else { 1 };
                    while end < bytes.len() && !program.is_char_boundary(end) {
                        end += 1;
                    }
                }
                let end = end.min(bytes.len());
                let after = if program[end..].starts_with(quote) { end + quote.len() } else { end };
                found.push(Literal {
                    begin,
                    end: after,
                    open: &program[begin..start],
                    quote,
                    formatted: program[begin..at].contains(['f', 'F']),
                    inside: &program[start..end],
                });
                at = after;
            }
            _ => at += 1,
        }
    }
    found
}
