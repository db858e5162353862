//! The conversion of a script, command by command.

use super::command::{Command, commands};
use super::data::{Column, DataFile};
use super::{Converted, DATA, INCLUDED, Law, Note, new_name};
use std::collections::BTreeMap;

/// The sub-styles of densities and of forces.
const DENSITIES: &str = "mdpd/rhosum";
const FORCES: &str = "mdpd";

/// Words that only the built-in has.
const OF_BUILT_IN: [&str; 5] = [DENSITIES, FORCES, "mvv/dpd", "sph/rho", "meso/rho"];

/// Converts the text of a script; the new script loads the file `plugin`. `read` reads files that it includes.
pub fn script(old: &str, law: Law, plugin: &str, read: &dyn Fn(&str) -> Option<String>) -> Converted {
    let whole = Part { name: None, text: String::new(), is_open: true };
    let mut work = Work {
        law,
        plugin,
        read,
        parts: vec![whole],
        part: 0,
        found: Converted::default(),
        hybrid: false,
        loaded: false,
        column: None,
        velocities: false,
        ranges: BTreeMap::new(),
        strengths: BTreeMap::new(),
        style: None,
    };
    for command in commands(old) {
        work.take(&command);
    }
    work.finish()
}

/// The new text of the script or of a file that it includes.
struct Part {
    /// The old name of an included file; `None` for the script.
    name: Option<String>,
    text: String,
    /// Whether its commands are being converted.
    is_open: bool,
}

struct Place {
    part: usize,
    /// Where it begins in the new text.
    offset: usize,
    note: Note,
    /// The command that requests velocities of ghosts.
    velocities: String,
}

struct Work<'a> {
    law: Law,
    plugin: &'a str,
    read: &'a dyn Fn(&str) -> Option<String>,
    parts: Vec<Part>,
    /// The number of the part that the present command is in.
    part: usize,
    found: Converted,
    /// Whether the pair style remains a hybrid.
    hybrid: bool,
    /// Whether the script has loaded the plugin already.
    loaded: bool,
    /// The column of densities in data files, if atoms have one; of some hybrids it is not known.
    column: Option<Option<Column>>,
    /// Whether the script requests velocities of ghosts.
    velocities: bool,
    /// Ranges of densities and of forces, by pairs of types as written.
    ranges: BTreeMap<(String, String), [Option<String>; 2]>,
    /// Strengths B, by pairs of types as written.
    strengths: BTreeMap<(String, String), String>,
    /// The last pair style that was converted.
    style: Option<Place>,
}

impl Work<'_> {
    fn note(&self, command: &Command, text: impl Into<String>) -> Note {
        Note { file: self.parts[self.part].name.clone(), line: command.line, text: text.into() }
    }

    fn changed(&mut self, command: &Command, text: impl Into<String>) {
        let note = self.note(command, text);
        self.found.changed.push(note);
    }

    fn left(&mut self, command: &Command, text: impl Into<String>) {
        let note = self.note(command, text);
        self.found.left.push(note);
    }

    /// Keeps a command as it is, to be rewritten by hand.
    fn by_hand(&mut self, command: &Command, text: impl Into<String>) -> Option<String> {
        let note = self.note(command, text);
        self.found.by_hand.push(note);
        None
    }

    fn take(&mut self, command: &Command) {
        let new = match command.words.as_slice() {
            ["atom_style", style @ ..] => self.atom_style(command, style),
            ["pair_style", style @ ..] => self.pair_style(command, style),
            ["pair_coeff", i, j, rest @ ..] => self.pair_coeff(command, [i, j], rest),
            ["fix", id, group, "mvv/dpd", rest @ ..] => Some(self.integrator(command, [id, group], rest)),
            ["set", rest @ ..] if self.column.is_some() && rest.iter().any(is_density) => {
                self.set(command, rest)
            }
            ["include", file] => self.include(command, file.trim_matches(['"', '\''])),
            ["read_data", file, rest @ ..] => self.read_data(command, file, rest),
            ["comm_modify", rest @ ..] => {
                self.velocities |= rest.windows(2).any(|w| w == ["vel", "yes"]);
                None
            }
            words => self.look(command, words),
        };
        self.parts[self.part].text += new.as_deref().unwrap_or(command.text);
    }

    /// Reports commands that are kept but may depend on the built-in.
    fn look(&mut self, command: &Command, words: &[&str]) -> Option<String> {
        match words {
            ["units", units] if !["lj", "real", "metal"].contains(units) => {
                self.by_hand(command, "the style works in units lj, real and metal")
            }
            ["read_restart", ..] => self
                .by_hand(command, "a restart file of atom_style mdpd cannot be read: begin from a data file"),
            ["compute", id, _, "property/atom", rest @ ..] if rest.contains(&"rho") => {
                let text = format!(
                    "there is no property rho: 'fix {id} all pair 1 mdpd/psi density 0' has the density, as f_{id}"
                );
                self.by_hand(command, text)
            }
            ["atom_style" | "pair_style", name, ..] if name.contains('$') => {
                self.by_hand(command, "a variable has the style: write the style itself, and convert again")
            }
            // The first words of fixes and computes are names of the user.
            ["fix" | "dump" | "compute", _, _, rest @ ..] if names_built_in(rest) => {
                self.by_hand(command, "names the built-in style: rewrite it for mdpd/psi")
            }
            [
                "variable" | "fix_modify" | "pair_coeff" | "pair_modify" | "if" | "run" | "python" | "set"
                | "change_box",
                rest @ ..,
            ] if names_built_in(rest) => {
                self.by_hand(command, "names the built-in style: rewrite it for mdpd/psi")
            }
            _ => None,
        }
    }

    fn atom_style(&mut self, command: &Command, style: &[&str]) -> Option<String> {
        let new = match style {
            ["mdpd"] => vec!["atomic"],
            ["hybrid", rest @ ..] if rest.contains(&"mdpd") => {
                let others: Vec<&str> = rest.iter().copied().filter(|s| *s != "mdpd").collect();
                // The order of columns in data files is that of a hybrid, with a single style too.
                if others.is_empty() { vec!["atomic"] } else { [&["hybrid"], others.as_slice()].concat() }
            }
            _ => return self.look(command, &command.words),
        };
        self.column =
            Some(if style == ["mdpd"] { Some(Column::OF_MDPD) } else { Column::of_hybrid(&style[1..]) });
        self.changed(command, format!("atom_style {}: the style needs none of its own", new.join(" ")));
        Some(command.with("atom_style", &new))
    }

    /// Converts `hybrid/overlay mdpd/rhosum mdpd T cutoff seed`, in any order and with other styles.
    fn pair_style(&mut self, command: &Command, style: &[&str]) -> Option<String> {
        let at = |name| style.iter().position(|word| *word == name);
        let (Some(densities), Some(forces)) = (at(DENSITIES), at(FORCES)) else {
            return if at(DENSITIES).is_some() || at(FORCES).is_some() {
                self.by_hand(command, "mdpd and mdpd/rhosum belong together: one of them is missing")
            } else {
                self.look(command, &command.words)
            };
        };
        let Some(arguments) = style.get(forces + 1..forces + 4) else {
            return self.by_hand(command, "mdpd needs a temperature, a cut-off and a seed");
        };
        let mut new = vec!["mdpd/psi"];
        new.extend(arguments);
        if self.law == Law::Lucy {
            new.extend(["law", "lucy"]);
        }
        let gone = |k: usize| k == densities || (forces..forces + 4).contains(&k);
        let others: Vec<&str> =
            style.iter().enumerate().skip(1).filter(|(k, _)| !gone(*k)).map(|(_, w)| *w).collect();
        self.hybrid = !others.is_empty();
        if self.hybrid {
            new = [&[style[0]], new.as_slice(), &others].concat();
        }
        self.style = Some(Place {
            part: self.part,
            offset: self.parts[self.part].text.len(),
            note: self.note(command, String::new()),
            velocities: command.with("comm_modify", &["vel", "yes"]),
        });
        self.changed(command, "one style sums densities and computes forces");
        if forces < densities {
            self.left(
                command,
                "mdpd stood before mdpd/rhosum and used the densities of the previous step; the new style never does",
            );
        }
        let mut text = String::new();
        if !std::mem::replace(&mut self.loaded, true) {
            let quote = if self.plugin.contains(char::is_whitespace) { "\"" } else { "" };
            text += &command.with("plugin", &["load", &format!("{quote}{}{quote}", self.plugin)]);
        }
        Some(text + &command.with("pair_style", &new))
    }

    fn pair_coeff(&mut self, command: &Command, types: [&str; 2], rest: &[&str]) -> Option<String> {
        let key = (types[0].to_owned(), types[1].to_owned());
        if self.style.is_none() {
            return self.look(command, &command.words);
        }
        match rest {
            [DENSITIES, range, ..] => {
                self.ranges.entry(key).or_default()[0] = Some((*range).to_owned());
                self.changed(command, "the range of the density is the rd of the pair");
                Some(String::new())
            }
            [FORCES, coefficients @ ..] => {
                if let [_, b, _, _, rd] = coefficients {
                    self.ranges.entry(key.clone()).or_default()[1] = Some((*rd).to_owned());
                    self.strengths.insert(key, (*b).to_owned());
                }
                let mut words = types.to_vec();
                if self.hybrid {
                    words.push("mdpd/psi");
                }
                words.extend(coefficients);
                self.changed(command, "the same coefficients");
                Some(command.with("pair_coeff", &words))
            }
            _ => None,
        }
    }

    fn integrator(&mut self, command: &Command, [id, group]: [&str; 2], rest: &[&str]) -> String {
        match rest.first().map(|lambda| lambda.parse::<f64>()) {
            None | Some(Ok(0.5)) => self.changed(command, "mvv/dpd with lambda = 0.5 is velocity Verlet"),
            _ => self.left(
                command,
                format!("mvv/dpd had lambda = {}; fix nve corresponds to lambda = 0.5", rest[0]),
            ),
        }
        command.with("fix", &[id, group, "nve"])
    }

    fn set(&mut self, command: &Command, rest: &[&str]) -> Option<String> {
        let kept: Vec<&str> = {
            let at = rest.iter().position(is_density)?;
            rest.iter().enumerate().filter(|(k, _)| *k != at && *k != at + 1).map(|(_, w)| *w).collect()
        };
        self.changed(command, "densities need no start");
        // The first two words are the style and its argument, so fewer than three set nothing.
        Some(if kept.len() > 2 { command.with("set", &kept) } else { String::new() })
    }

    fn read_data(&mut self, command: &Command, file: &str, rest: &[&str]) -> Option<String> {
        let file = file.trim_matches(['"', '\'']);
        let Some(column) = self.column? else {
            return self.by_hand(
                command,
                "atoms of this hybrid have a column for the density: take it out of the data file",
            );
        };
        if file.contains('$') {
            return self.by_hand(
                command,
                format!("a variable has the data file: take the density out of its atoms, {column}"),
            );
        }
        let new = new_name(file, DATA);
        let names = || self.found.data.iter().map(|data| data.name.as_str());
        if names().any(|other| other != file && new_name(other, DATA) == new) {
            return self.by_hand(
                command,
                format!("{new} would be the new name of two data files: rename one of them"),
            );
        }
        if names().all(|other| other != file) {
            let note = self.note(command, String::new());
            self.found.data.push(DataFile { name: file.to_owned(), column, note });
        }
        self.changed(command, format!("reads {new}, which has no column for the density"));
        let words: Vec<&str> = std::iter::once(new.as_str()).chain(rest.iter().copied()).collect();
        Some(command.with("read_data", &words))
    }

    fn include(&mut self, command: &Command, file: &str) -> Option<String> {
        if file.contains('$') {
            return self
                .by_hand(command, "a variable has the included file: write its name, and convert again");
        }
        let known = self.parts.iter().position(|part| part.name.as_deref() == Some(file));
        if known.is_some_and(|k| self.parts[k].is_open) {
            return self.by_hand(command, "the included file includes itself");
        }
        if known.is_none() {
            let Some(old) = (self.read)(file) else {
                return self.by_hand(
                    command,
                    "the included file cannot be read in the folder of the script: convert it too",
                );
            };
            self.parts.push(Part { name: Some(file.to_owned()), text: String::new(), is_open: true });
            let here = self.parts.len() - 1;
            let outer = std::mem::replace(&mut self.part, here);
            let before = self.found.changed.len();
            for command in commands(&old) {
                self.take(&command);
            }
            self.part = outer;
            self.parts[here].is_open = false;
            if self.found.changed.len() > before {
                self.found.included.push((file.to_owned(), String::new()));
            }
        }
        self.found.included.iter().find(|(name, _)| name == file)?;
        let new = new_name(file, INCLUDED);
        self.changed(command, format!("includes {new}, which was converted"));
        Some(command.with("include", &[&new]))
    }

    fn finish(mut self) -> Converted {
        let style = self.style.take();
        let note = |text: String| match &style {
            Some(place) => Note { text, ..place.note.clone() },
            None => Note { file: None, line: 1, text },
        };
        if let Some(place) = &style {
            for ((i, j), ranges) in &self.ranges {
                if let [Some(density), Some(force)] = ranges
                    && density != force
                {
                    self.found.left.push(note(format!(
                        "types {i} {j}: densities had the range {density}, forces {force}; now both have {force}"
                    )));
                }
            }
            let ranges = self.ranges.values().filter_map(|[_, force]| force.as_ref());
            for (name, values) in [("B", distinct(self.strengths.values())), ("rd", distinct(ranges))] {
                if self.law == Law::Conservative && values.len() > 1 {
                    self.found.by_hand.push(note(format!(
                        "{name} differs between types ({}): no potential has such a force, and the style will refuse it; \
                         --law lucy does not",
                        values.join(", ")
                    )));
                }
            }
            if !self.velocities {
                self.parts[place.part].text.insert_str(place.offset, &place.velocities);
                self.found.changed.push(note("the thermostat needs velocities of ghosts".into()));
            }
            if self.law == Law::Conservative {
                self.found.left.push(note(
                    "the conservative law is another fluid than the built-in's: for A = -40, B = 25, rd = 0.75 its liquid \
                     has the density 6.05, where that has 6.7; --law lucy is the same fluid as before"
                        .into(),
                ));
            }
        } else {
            self.found
                .by_hand
                .push(note("there is no pair style of the built-in mdpd in this script".into()));
        }
        for part in self.parts {
            match part.name {
                None => self.found.script = part.text,
                Some(name) => {
                    if let Some(entry) = self.found.included.iter_mut().find(|(other, _)| *other == name) {
                        entry.1 = part.text;
                    }
                }
            }
        }
        self.found
    }
}

fn is_density(word: &&str) -> bool {
    ["sph/rho", "meso/rho"].contains(word)
}

/// Whether words, or commands in quotes among them, name the built-in.
fn names_built_in(words: &[&str]) -> bool {
    let bare = |word: &&str| OF_BUILT_IN.contains(&word.trim_matches(['"', '\'', ';', ',', '(', ')']));
    words.iter().any(bare)
}

/// The distinct words, in their first order.
fn distinct<'a>(words: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    for word in words {
        if !found.contains(&word.as_str()) {
            found.push(word);
        }
    }
    found
}
