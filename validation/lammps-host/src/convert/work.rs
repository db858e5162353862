//! The conversion of a script, command by command.

mod density;
mod files;
mod pairs;

use super::command::{Command, bare, command, commands};
use super::data::Column;
use super::fluid::{Finding, Fluid, Number};
use super::style::{Old, Sort, base};
use super::survey::{Read, Survey};
use super::variables::Variables;
use super::{Converted, Law, Note};

/// Words that only the built-in has.
const OF_BUILT_IN: [&str; 7] =
    ["mdpd/rhosum", "mdpd", "mdpd/diffcut", "mvv/dpd", "sph/rho", "meso/rho", "edpd/source"];

/// Fixes that change velocities behind the integrator.
const CHANGE_VELOCITIES: [&str; 9] = [
    "wall/reflect",
    "wall/reflect/stochastic",
    "momentum",
    "temp/berendsen",
    "temp/rescale",
    "temp/csvr",
    "heat",
    "ehex",
    "viscosity",
];

/// Converts the text of a script; the new script loads the file `plugin`. `read` reads files that it includes.
pub fn script(old: &str, law: Law, plugin: Option<&str>, read: Read) -> Converted {
    let mut work = Work::new(old, law, plugin, read);
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

/// A data file that the script has written: its name, the number of types, and masses by types.
type Written = (String, Option<usize>, Vec<(String, Number)>);

/// A pair style that was converted.
#[derive(Clone)]
struct Place {
    part: usize,
    /// Where it begins in the new text.
    offset: usize,
    note: Note,
    /// The command that requests velocities of ghosts.
    velocities: String,
}

pub(super) struct Work<'a> {
    law: Law,
    plugin: Option<&'a str>,
    read: Read<'a>,
    survey: Survey,
    /// The text of the script.
    own: String,
    parts: Vec<Part>,
    /// The number of the part that the present command is in.
    part: usize,
    pub(super) found: Converted,
    variables: Variables,
    fluid: Fluid,
    /// The style that is being replaced, and whether the new style is in a hybrid.
    old: Option<Old>,
    hybrid: bool,
    /// Whether the script has loaded the plugin already.
    loaded: bool,
    /// The column of densities in data files, if atoms have one; of some hybrids it is not known.
    column: Option<Option<Column>>,
    /// Whether the script requests velocities of ghosts.
    velocities: bool,
    /// The pair styles that were converted since the beginning or the last `clear`.
    styles: Vec<Place>,
    /// Names of files that the script has written, with their types and masses: its new form writes them for the new style.
    written: Vec<Written>,
    /// Names of computes of the density, until the fix that replaces them can be made.
    waiting: Vec<String>,
    /// What replaces them.
    replaced: Vec<(String, String)>,
    /// Whether the integrator kept velocities of its own, and the fixes whose changes it undid.
    kept_velocities: bool,
    undone: Vec<Note>,
    /// Whether commands have no file around them, in which lines could be inserted later.
    pub(super) inline: bool,
}

impl<'a> Work<'a> {
    pub(super) fn new(old: &str, law: Law, plugin: Option<&'a str>, read: Read<'a>) -> Work<'a> {
        let survey = Survey::of(old, read);
        Work {
            law,
            plugin,
            read,
            survey,
            own: old.to_owned(),
            parts: vec![Part { name: None, text: String::new(), is_open: true }],
            part: 0,
            found: Converted::default(),
            variables: Variables::default(),
            fluid: Fluid::default(),
            old: None,
            hybrid: false,
            loaded: false,
            column: None,
            velocities: false,
            styles: vec![],
            written: vec![],
            waiting: vec![],
            replaced: vec![],
            kept_velocities: false,
            undone: vec![],
            inline: false,
        }
    }

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
    pub(super) fn by_hand(&mut self, command: &Command, text: impl Into<String>) -> Option<String> {
        let note = self.note(command, text);
        self.found.by_hand.push(note);
        None
    }

    fn take(&mut self, command: &Command) {
        let new = self.convert(command);
        self.parts[self.part].text += new.as_deref().unwrap_or(command.text);
    }

    /// The new text of a command, with the commands that go before it; `None` if it stays as it is.
    pub(super) fn convert(&mut self, old: &Command) -> Option<String> {
        let before = self.densities(old);
        // Names of computes that became fixes.
        let text =
            self.replaced.iter().fold(old.text.to_owned(), |text, (from, to)| renamed(&text, from, to));
        if text == old.text {
            let new = self.convert_words(old);
            return match before {
                None => new,
                Some(before) => Some(before + new.as_deref().unwrap_or(old.text)),
            };
        }
        self.changed(old, "the density is that of fix pair");
        let renamed = command(old.line, &text);
        let new = self.convert_words(&renamed).unwrap_or_else(|| text.clone());
        Some(before.unwrap_or_default() + &new)
    }

    fn convert_words(&mut self, command: &Command) -> Option<String> {
        match command.words.as_slice() {
            ["atom_style", style @ ..] => self.atom_style(command, style),
            ["pair_style", style @ ..] => self.pair_style(command, style),
            ["pair_coeff", i, j, rest @ ..] => self.pair_coeff(command, [i, j], rest),
            ["fix", id, group, style, rest @ ..] if base(style) == "mvv/dpd" => {
                self.kept_velocities = true;
                Some(self.integrator(command, [id, group], rest))
            }
            ["fix", _, _, style, ..] if CHANGE_VELOCITIES.contains(style) => {
                let note =
                    self.note(command, "fix mvv/dpd undid what this fix does to velocities; now it acts");
                self.undone.push(note);
                self.look(command)
            }
            ["set", rest @ ..] if self.column.is_some() && rest.iter().any(is_density) => {
                self.set(command, rest)
            }
            ["include", file] => self.include(command, "include", bare(file), &[]),
            ["jump", file, ..] if bare(file) == "SELF" => None,
            ["jump", file, label @ ..] => self.jump(command, bare(file), label),
            ["read_data", file, rest @ ..] => self.read_data(command, bare(file), rest),
            ["comm_modify", rest @ ..] => {
                self.velocities |= rest.windows(2).any(|w| w == ["vel", "yes"]);
                None
            }
            ["clear"] => {
                self.check();
                self.request_velocities();
                (self.velocities, self.loaded, self.old, self.column) = (false, false, None, None);
                (self.fluid, self.hybrid) = (Fluid::default(), false);
                self.replaced.clear();
                None
            }
            ["variable", rest @ ..] => {
                self.variables.define(rest);
                self.look(command)
            }
            ["dimension", dimension] => {
                self.fluid.flat = *dimension == "2";
                None
            }
            ["create_box", types, ..] => {
                self.fluid.types = self.variables.number(types).map(|n| n as usize);
                None
            }
            ["mass", types, mass] => {
                let mass = self.number(mass);
                self.fluid.masses.push((self.variables.expand(types).unwrap_or_default(), mass));
                None
            }
            ["write_data", file, ..] => {
                self.written.push((bare(file).to_owned(), self.fluid.types, self.fluid.masses.clone()));
                None
            }
            ["compute", id, _, "property/atom", rest @ ..] if rest.contains(&"rho") => {
                self.density(command, id, rest)
            }
            ["run_style", "respa", rest @ ..] => self.levels(command, rest),
            ["pair_modify", "pair", style, rest @ ..] if self.is_old(style) => {
                self.pair_modify(command, style, rest)
            }
            ["if", ..] => self.nested(command, |words| {
                (1..words.len())
                    .filter(|k| {
                        *k > 1 && !["then", "else", "elif"].contains(&words[*k]) && words[*k - 1] != "elif"
                    })
                    .collect()
            }),
            ["run", rest @ ..] => {
                self.check();
                match rest.iter().position(|word| *word == "every") {
                    Some(at) => self.nested(command, move |words| (at + 3..words.len()).collect()),
                    None => self.look(command),
                }
            }
            ["minimize" | "rerun", ..] => {
                self.check();
                None
            }
            ["special_bonds", rest @ ..] => {
                let scaled =
                    rest.iter().filter_map(|word| word.parse::<f64>().ok()).any(|x| x > 0.0 && x < 1.0);
                if scaled {
                    self.left(
                        command,
                        "a factor between 0 and 1 scaled drag and noise too; in the new style they keep their strength",
                    );
                }
                None
            }
            _ => self.look(command),
        }
    }

    fn number(&self, word: &str) -> Number {
        Number { text: word.to_owned(), value: self.variables.number(word) }
    }

    /// Whether a word names a style that is being replaced.
    fn is_old(&self, word: &str) -> bool {
        self.old.as_ref().is_some_and(|old| old.names.iter().any(|name| base(name) == base(word)))
    }

    /// Converts the commands among the words of a command, as `if` and `run every` have them. `which` returns their numbers.
    fn nested(&mut self, outer: &Command, which: impl Fn(&[&str]) -> Vec<usize>) -> Option<String> {
        let mut new = Vec::new();
        for k in which(&outer.words) {
            let word = outer.words[k];
            let inside = bare(word);
            let inline = std::mem::replace(&mut self.inline, true);
            let result = self.convert(&command(outer.line, inside));
            self.inline = inline;
            let Some(result) = result else { continue };
            let quote = if word.starts_with('\'') || inside.contains('"') || result.contains('"') {
                "'"
            } else {
                "\""
            };
            let quoted: Vec<String> = result
                .lines()
                .filter(|line| !line.trim().is_empty())
                .map(|line| format!("{quote}{}{quote}", line.trim()))
                .collect();
            // `then` needs a command.
            new.push((
                k,
                if quoted.is_empty() {
                    "\"print 'mdpd/psi needs no such command'\"".to_owned()
                } else {
                    quoted.join(" ")
                },
            ));
        }
        (!new.is_empty()).then(|| outer.replaced(&new))
    }

    /// Reports commands that are kept but may depend on the built-in.
    fn look(&mut self, command: &Command) -> Option<String> {
        match command.words.as_slice() {
            ["units", units]
                if !["lj", "real", "metal"]
                    .contains(&self.variables.expand(units).as_deref().unwrap_or(units)) =>
            {
                self.by_hand(command, "the style works in units lj, real and metal")
            }
            ["read_restart", ..] => {
                self.left(
                    command,
                    "a restart file of the built-in keeps its atom_style, which the new style takes if this LAMMPS has it; it needs \
                     pair_style and pair_coeff after it",
                );
                None
            }
            ["atom_style" | "pair_style", name, ..] if name.contains('$') => {
                self.by_hand(command, "a variable has the style: write the style itself, and convert again")
            }
            // The value of a variable is converted where it is used.
            ["variable", name, "index" | "string", value]
                if names_built_in(&[value]) && self.variables.expand(&format!("${{{name}}}")).is_some() =>
            {
                None
            }
            // The first words of fixes and computes are names of the user.
            ["fix" | "dump" | "compute", _, _, rest @ ..] if names_built_in(rest) => {
                self.by_hand(command, "names the built-in style: rewrite it for mdpd/psi")
            }
            [
                "variable" | "fix_modify" | "pair_coeff" | "pair_modify" | "if" | "run" | "python" | "set"
                | "change_box" | "run_style",
                rest @ ..,
            ] if names_built_in(rest) => {
                self.by_hand(command, "names the built-in style: rewrite it for mdpd/psi")
            }
            _ => None,
        }
    }

    fn atom_style(&mut self, command: &Command, style: &[&str]) -> Option<String> {
        let expanded = self.expanded(style);
        let style: Vec<&str> = expanded.iter().map(String::as_str).collect();
        let new = match style.as_slice() {
            ["mdpd"] => vec!["atomic"],
            ["hybrid", rest @ ..] if rest.contains(&"mdpd") => {
                let others: Vec<&str> = rest.iter().copied().filter(|s| *s != "mdpd").collect();
                // The order of columns in data files is that of a hybrid, with a single style too.
                if others.is_empty() { vec!["atomic"] } else { [&["hybrid"], others.as_slice()].concat() }
            }
            _ => return self.look(command),
        };
        self.column =
            Some(if style == ["mdpd"] { Some(Column::OF_MDPD) } else { Column::of_hybrid(&style[1..]) });
        self.changed(
            command,
            format!("atom_style {}: the pair style of psidpd needs no special atom style", new.join(" ")),
        );
        Some(command.with("atom_style", &new))
    }

    /// Words in which a variable stands for the name of a built-in style, with its value.
    fn expanded(&self, words: &[&str]) -> Vec<String> {
        let mut found = Vec::new();
        for word in words {
            match self
                .variables
                .expand(bare(word))
                .filter(|text| word.contains('$') && text.parse::<f64>().is_err())
            {
                Some(text) => found.extend(text.split_whitespace().map(str::to_owned)),
                None => found.push((*word).to_owned()),
            }
        }
        found
    }

    fn integrator(&mut self, command: &Command, [id, group]: [&str; 2], rest: &[&str]) -> String {
        match rest.first().map(|lambda| self.variables.number(lambda)) {
            None | Some(Some(0.5)) => self.changed(command, "mvv/dpd with lambda = 0.5 is velocity Verlet"),
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

    /// Takes the level of the densities out of `run_style respa … hybrid`.
    fn levels(&mut self, command: &Command, rest: &[&str]) -> Option<String> {
        let Some(at) = rest.iter().position(|word| *word == "hybrid") else { return self.look(command) };
        let Some(old) = self.old.clone().filter(|old| old.hybrid) else {
            return self.by_hand(
                command,
                "levels of sub-styles, of a pair_style that is not known here: there is one sub-style less",
            );
        };
        let count = rest[at + 1..].iter().take_while(|word| self.variables.number(word).is_some()).count();
        if count != old.styles.len() {
            return self.by_hand(
                command,
                format!("levels of {count} sub-styles, of which the pair_style had {}", old.styles.len()),
            );
        }
        let level = |k: usize| rest[at + 1 + k];
        let of = |names: &[&str]| old.styles.iter().position(|name| names.contains(&base(name)));
        let forces = of(&["mdpd", "mdpd/diffcut", "dpd"])?;
        let densities = of(&["mdpd/rhosum"]).filter(|_| old.sort != Sort::Dpd);
        if densities.is_some_and(|k| self.variables.number(level(k)) != self.variables.number(level(forces)))
        {
            self.left(command, "densities and forces had different levels; now both have that of the forces");
        }
        let (before, after) = (&rest[..at], &rest[at + 1 + count..]);
        let levels: Vec<&str> = if self.hybrid {
            // The new style stands where the first of the two stood.
            let first = densities.map_or(forces, |k| k.min(forces));
            let kept = (0..count).filter(|k| *k == first || ![Some(forces), densities].contains(&Some(*k)));
            let levels = kept.map(|k| if k == first { level(forces) } else { level(k) });
            std::iter::once("hybrid").chain(levels).collect()
        } else {
            vec!["pair", level(forces)]
        };
        self.changed(command, "one sub-style has the level of the two");
        Some(command.with("run_style", &[&["respa"], before, &levels, after].concat()))
    }

    /// Compares the fluid of a run with the new style's.
    fn check(&mut self) {
        let (Some(old), Some(place)) = (&self.old, self.styles.last()) else { return };
        let note = |text: String| Note { text, ..place.note.clone() };
        for finding in self.fluid.check(self.law, old.sort != Sort::Dpd) {
            let (list, note) = match finding {
                Finding::Look(text) => (&mut self.found.left, note(text)),
                Finding::ByHand(text) => (&mut self.found.by_hand, note(text)),
                Finding::NoPotential(text, nearest) => {
                    let known =
                        self.found.models.iter().position(|(_, model)| Some(model) == nearest.as_ref());
                    if let (None, Some(model)) = (known, nearest) {
                        self.found.models.push((note(text), model));
                    }
                    continue;
                }
            };
            if !list.contains(&note) {
                list.push(note);
            }
        }
    }

    /// Requests velocities of ghosts before the first style that was converted since the last `clear`, unless the script does.
    fn request_velocities(&mut self) {
        let styles = std::mem::take(&mut self.styles);
        if self.velocities {
            return;
        }
        if let Some(place) = styles.first() {
            self.parts[place.part].text.insert_str(place.offset, &place.velocities);
            self.found.changed.push(Note {
                text: "the thermostat needs velocities of ghosts".into(),
                ..place.note.clone()
            });
        }
    }

    pub(super) fn finish(mut self) -> Converted {
        self.check();
        if self.kept_velocities {
            self.found.left.append(&mut self.undone);
        }
        let first = Note { file: None, line: 1, text: String::new() };
        let last = self.styles.last().map_or(first, |place| place.note.clone());
        self.request_velocities();
        for id in std::mem::take(&mut self.waiting) {
            let text = format!("there is no property rho, which nothing uses: c_{id} is left out");
            self.found.changed.push(Note { text, ..last.clone() });
        }
        let count = |texts: [&str; 2]| {
            self.found.changed.iter().filter(|note| texts.iter().any(|text| note.text.contains(text))).count()
        };
        let many_body = count(["one style sums densities", "\0"]) > 0;
        if !many_body && count(["is mdpd/psi without", "\0"]) == 0 {
            let text = "there is no pair style of the built-in mdpd or dpd in this script".into();
            self.found.by_hand.push(Note { text, ..last.clone() });
        }
        if many_body && self.law == Law::Conservative {
            let text = "the conservative law is another fluid than the built-in's: for A = -40, B = 25, rd = 0.75 its liquid \
                 has the density 6.05, where that has 6.7; --law lucy is the same fluid as before"
                .into();
            self.found.left.push(Note { text, ..last });
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
pub(super) fn names_built_in(words: &[&str]) -> bool {
    let of = |word: &str| OF_BUILT_IN.contains(&base(word.trim_matches(['"', '\'', ';', ',', '(', ')'])));
    words.iter().flat_map(|word| word.split_whitespace()).any(of)
}

/// A text in which a name, where it stands alone, is another one.
fn renamed(text: &str, from: &str, to: &str) -> String {
    let mut new = String::new();
    let mut rest = text;
    let inside = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    while let Some(at) = rest.find(from) {
        let (before, after) = (&rest[..at], &rest[at + from.len()..]);
        new += before;
        let alone = !inside(new.chars().last()) && !inside(after.chars().next());
        new += if alone { to } else { from };
        rest = after;
    }
    new + rest
}
