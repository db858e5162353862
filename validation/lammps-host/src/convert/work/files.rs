//! Files that a script reads.

use super::super::command::{Command, commands};
use super::super::data::{DataFile, Header};
use super::super::fluid::Number;
use super::super::{DATA, INCLUDED, new_name};
use super::{Part, Work};

impl Work<'_> {
    pub(super) fn read_data(&mut self, command: &Command, file: &str, rest: &[&str]) -> Option<String> {
        let known = self.variables.expand(file);
        let is_variable = file.contains('$');
        let name = known.as_deref().unwrap_or(file);
        if let Some((_, types, masses)) = self.written.iter().rev().find(|(written, ..)| written == file) {
            (self.fluid.types, self.fluid.masses) = (*types, masses.clone());
            return None;
        }
        if let Some(header) = known.as_ref().and_then(|name| (self.read)(name)).map(|text| Header::of(&text))
        {
            if !rest.contains(&"add") {
                let more = rest.windows(2).find(|words| words[0] == "extra/atom/types");
                let more = more.and_then(|words| words[1].parse().ok()).unwrap_or(0);
                self.fluid.types = header.types.map(|types: usize| types.saturating_add(more));
            }
            let masses = header.masses.into_iter();
            self.fluid
                .masses
                .extend(masses.map(|(t, mass)| (t, Number { text: mass.to_string(), value: Some(mass) })));
        }
        let Some(column) = self.column? else {
            return self.by_hand(
                command,
                "atoms of this hybrid have a column for the density: take it out of the data file",
            );
        };
        if known.is_none() {
            return self.by_hand(
                command,
                format!("a variable has the data file: take the density out of its atoms, {column}"),
            );
        }
        let new = new_name(name, DATA);
        let names = || self.found.data.iter().map(|data| data.name.as_str());
        if names().any(|other| other != name && new_name(other, DATA) == new) {
            return self.by_hand(
                command,
                format!("{new} would be the new name of two data files: rename one of them"),
            );
        }
        if names().all(|other| other != name) {
            let note = self.note(command, String::new());
            self.found.data.push(DataFile { name: name.to_owned(), column, note });
        }
        if is_variable {
            self.left(
                command,
                format!("{file} is {name} here; the new script reads {new} whatever the command line sets"),
            );
        }
        self.changed(command, format!("reads {new}, which has no column for the density"));
        let words: Vec<&str> = std::iter::once(new.as_str()).chain(rest.iter().copied()).collect();
        Some(command.with("read_data", &words))
    }

    /// A script that is read from its beginning, or from a label, in the place of the rest of this one.
    pub(super) fn jump(&mut self, command: &Command, file: &str, label: &[&str]) -> Option<String> {
        let here = self.parts[self.part].name.as_deref();
        let name = self.variables.expand(file);
        let is_own = name.as_ref().and_then(|name| (self.read)(name)).is_some_and(|text| text == self.own);
        if name.is_some() && here == name.as_deref() || here.is_none() && is_own {
            self.changed(command, format!("{file} is this script, which has another name now"));
            return Some(command.with("jump", &[&["SELF"], label].concat()));
        }
        if is_own {
            return self.by_hand(
                command,
                format!("{file} is the script, which has another name now: write its new name"),
            );
        }
        self.include(command, "jump", file, label)
    }

    /// Converts a file that the command `verb` reads.
    pub(super) fn include(
        &mut self,
        command: &Command,
        verb: &str,
        file: &str,
        rest: &[&str],
    ) -> Option<String> {
        let Some(file) = self.variables.expand(file) else {
            return self
                .by_hand(command, "a variable has the included file: write its name, and convert again");
        };
        let file = file.as_str();
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
            let inline = std::mem::replace(&mut self.inline, false);
            let before = self.found.changed.len();
            for command in commands(&old) {
                self.take(&command);
            }
            self.part = outer;
            self.inline = inline;
            self.parts[here].is_open = false;
            if self.found.changed.len() > before {
                self.found.included.push((file.to_owned(), String::new()));
            }
        }
        if let Some(here) = known
            && let Some(old) = (self.read)(file)
        {
            // What the file sets counts once more; its new text and its remarks stay.
            let (found, text) = (self.found.clone(), self.parts[here].text.clone());
            let outer = std::mem::replace(&mut self.part, here);
            self.parts[here].is_open = true;
            for command in commands(&old) {
                self.take(&command);
            }
            self.parts[here].is_open = false;
            self.part = outer;
            (self.found, self.parts[here].text) = (found, text);
        }
        self.found.included.iter().find(|(name, _)| name == file)?;
        let new = new_name(file, INCLUDED);
        self.changed(command, format!("reads {new}, which was converted"));
        Some(command.with(verb, &[&[new.as_str()], rest].concat()))
    }
}
