//! Programs in Python that send commands to LAMMPS: `lmp.command("…")`, lists of commands, texts of several lines.
//!
//! Every text in quotes is read as commands, in the order of the program; all other text keeps its bytes.

use super::command::commands;
use super::survey::Read;
use super::work::{Work, names_built_in};
use super::{Converted, Law};

/// Converts the program `old`.
pub fn program(old: &str, law: Law, plugin: Option<&str>, read: Read) -> Converted {
    let texts = literals(old);
    let whole: Vec<String> = texts.iter().map(lines_of).collect();
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
            let result = match (work.convert(&command), piece) {
                (Some(result), true) if result.is_empty() => Some("# not needed: ".to_owned()),
                (Some(result), true) => Some(result + " "),
                (result, _) => result,
            };
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
        new += &text.with(old, &lines);
        at = text.end;
    }
    new += &old[at..];
    let mut found = work.finish();
    found.script = new;
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

    fn is_long(&self) -> bool {
        self.quote.len() == 3
    }

    /// The text in the program for new commands.
    fn with(&self, program: &str, lines: &[String]) -> String {
        let text: Vec<String> = lines.iter().map(|line| restored(line, self.inside)).collect();
        let quoted = |line: &str| format!("{}{line}{}", self.open, self.quote);
        if self.is_long() {
            return quoted(&text.concat());
        }
        let parts: Vec<&str> = text.iter().map(|line| line.trim_end_matches('\n')).collect();
        if self.inside.contains("\\n") || self.is_piece(program) {
            let end = if self.inside.ends_with("\\n") && !self.is_piece(program) { "\\n" } else { "" };
            return quoted(&format!("{}{end}", parts.join("\\n")));
        }
        let before = program[..self.begin].trim_end();
        let call = before.strip_suffix('(').filter(|call| call.ends_with(".command"));
        let between = match call {
            Some(call) => {
                let line = call.rfind('\n').map_or(0, |k| k + 1);
                let receiver = &call[line..];
                let indent = &receiver[..receiver.len() - receiver.trim_start().len()];
                let name = receiver.rsplit([' ', ';', ':', '(', '\t', '=']).next().unwrap_or(receiver);
                format!(")\n{indent}{name}(")
            }
            None => ", ".to_owned(),
        };
        let parts: Vec<String> =
            if parts.is_empty() { vec![quoted("")] } else { parts.iter().map(|p| quoted(p)).collect() };
        parts.join(&between)
    }
}

/// The marks that stand for braces of a formatted text, in whose code there may be blanks and quotes.
const MARK: char = '\u{E000}';

/// The text of a literal as lines, with marks in the place of code.
fn lines_of(text: &Literal) -> String {
    let mut found = String::new();
    let mut rest = text.inside;
    while let Some(at) = rest.find(['{', '\\']) {
        found += &rest[..at];
        rest = &rest[at..];
        let code = if rest.starts_with('{') && text.formatted && !rest.starts_with("{{") {
            end_of_code(rest)
        } else {
            None
        };
        if let Some(end) = code {
            found.push(MARK);
            found += &(text.inside.len() - rest.len()).to_string();
            found.push(MARK);
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
fn restored(line: &str, inside: &str) -> String {
    let mut new = String::new();
    for (k, part) in line.split(MARK).enumerate() {
        match part.parse::<usize>().ok().filter(|at| k % 2 == 1 && *at < inside.len()) {
            Some(at) => new += &inside[at..at + end_of_code(&inside[at..]).unwrap_or(0)],
            None => new += part,
        }
    }
    new
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
