//! Rewrites scripts for LAMMPS's built-in `mdpd` to the pair style `mdpd/psi`.
//!
//! Only the commands that concern the built-in change; all other lines keep their bytes. A command without a
//! counterpart is kept and reported.

use super::error::LammpsError;
use psidpd_formats::FormatError;
use psidpd_formats::text::{Problem, TextError};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The force law of the new script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Law {
    /// The law of Warren's potential, the default of `mdpd/psi`.
    #[default]
    Conservative,
    /// The law of the built-in, which has no potential.
    Lucy,
}

/// A remark about a line.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Note {
    /// Number of the line in the old script, from 1.
    pub line: usize,
    pub text: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Converted {
    pub script: String,
    /// Data files of the script whose atoms have the column of `atom_style mdpd`, under their old names: they
    /// need [`data_file`].
    pub data: Vec<String>,
    /// Remarks about changed lines.
    pub changed: Vec<Note>,
    /// Remarks about lines that the user must check: kept lines, and lines whose meaning changed.
    pub left: Vec<Note>,
}

/// Converts the script in a file. If `out` names a file, the new script is written there and the data files
/// beside it. Returns the paths of written files, and the new script with its remarks.
///
/// # Errors
/// A file cannot be read or written, a result exists and `overwrite` is not set, or a data file has too few
/// columns.
pub fn files(
    old: &Path,
    law: Law,
    plugin: &str,
    out: Option<&Path>,
    overwrite: bool,
) -> Result<(Vec<PathBuf>, Converted), LammpsError> {
    let read = |path: &Path| {
        let mut text = String::new();
        psidpd_core::document::open_regular(path)
            .and_then(|mut file| file.read_to_string(&mut text))
            .map_err(LammpsError::io("read", path))
            .map(|_| text)
    };
    let mut new = script(&read(old)?, law, plugin);
    let beside = |path: &Path, name: &str| path.parent().unwrap_or(Path::new("")).join(name);
    let mut results: Vec<(PathBuf, String)> =
        out.map(|path| (path.to_owned(), new.script.clone())).into_iter().collect();
    for name in &new.data {
        // LAMMPS looks for data files in its working folder, most often that of the script.
        let from = beside(old, name);
        match out {
            Some(path) if from.is_file() => {
                let text = data_file(&read(&from)?)
                    .map_err(|source| FormatError::Text { path: from.clone(), source })?;
                results.push((beside(path, &without_column(name)), text));
            }
            _ => new.left.push(Note {
                line: 0,
                text: format!("{name} was not rewritten: its atoms have a column for the density, the third"),
            }),
        }
    }
    // No file is written unless all can be: existing files may be somebody's work.
    if let Some((path, _)) = results.iter().find(|(path, _)| !overwrite && path.is_file()) {
        let path = path.display();
        return Err(LammpsError::Request(format!(
            "{path} is there already: replace it with --overwrite, or choose another --out"
        )));
    }
    for (path, text) in &results {
        psidpd_formats::files::write_atomically(path, text.as_bytes())
            .map_err(|e| LammpsError::io("write", path)(e.cause))?;
    }
    Ok((results.into_iter().map(|(path, _)| path).collect(), new))
}

/// The name of a converted data file in the folder of the new script, whatever folder the old file was in.
fn without_column(name: &str) -> String {
    let last = Path::new(name).file_name().map_or(name.into(), |last| last.to_string_lossy());
    format!("{last}{SUFFIX}")
}

/// The suffix of converted data files.
pub const SUFFIX: &str = ".atomic";

/// The sub-styles of densities and of forces.
const DENSITIES: &str = "mdpd/rhosum";
const FORCES: &str = "mdpd";

/// Converts the text of a script; the new script loads the file `plugin`.
pub fn script(old: &str, law: Law, plugin: &str) -> Converted {
    let mut work = Work { law, plugin, ..Work::default() };
    for command in commands(old) {
        work.take(&command);
    }
    work.finish()
}

/// A command, which may span several lines.
struct Command<'a> {
    /// Number of the command's first line.
    line: usize,
    /// The text of the command with its line breaks.
    text: &'a str,
    /// The words of the command, without comments.
    words: Vec<&'a str>,
}

/// Splits a script into commands. Text in triple quotes belongs to its command.
fn commands(script: &str) -> Vec<Command<'_>> {
    let mut found = Vec::new();
    let (mut start, mut first, mut quoted) = (0, 1, false);
    let mut end = 0;
    for (k, line) in script.split_inclusive('\n').enumerate() {
        end += line.len();
        quoted ^= line.matches("\"\"\"").count() % 2 == 1;
        if !quoted && !line.trim_end().ends_with('&') {
            found.push(command(first, &script[start..end]));
            (start, first) = (end, k + 2);
        }
    }
    if start < script.len() {
        found.push(command(first, &script[start..]));
    }
    found
}

fn command(line: usize, text: &str) -> Command<'_> {
    let code = text.lines().flat_map(|line| line.split('#').next());
    let words = code.flat_map(str::split_whitespace).filter(|word| *word != "&").collect();
    Command { line, text, words }
}

impl Command<'_> {
    /// A command with `words` after `name`, aligned with the old words. If the command name is the same, the
    /// old comment stays.
    fn with(&self, name: &str, words: &[&str]) -> String {
        let indent = &self.text[..self.text.len() - self.text.trim_start().len()];
        let rest = &self.text.trim_start()[self.words[0].len()..];
        let gap = &rest[..rest.len() - rest.trim_start_matches([' ', '\t']).len()];
        let width = self.words[0].len() + gap.len();
        let comment = match self.text.lines().last().and_then(|line| line.split_once('#')) {
            Some((_, comment)) if name == self.words[0] => format!("  #{comment}"),
            _ => String::new(),
        };
        let column = width.max(name.len() + 1);
        format!("{indent}{name:column$}{}{comment}\n", words.join(" "))
    }
}

#[derive(Default)]
struct Work<'a> {
    law: Law,
    plugin: &'a str,
    script: String,
    data: Vec<String>,
    changed: Vec<Note>,
    left: Vec<Note>,
    /// Whether the pair style remains a hybrid.
    hybrid: bool,
    /// Whether the script has loaded the plugin already.
    loaded: bool,
    /// Whether `atom_style mdpd` was the only atom style.
    plain_atoms: bool,
    /// Whether the script requests velocities of ghosts.
    velocities: bool,
    /// Ranges of densities and of forces, by pairs of types as written.
    ranges: BTreeMap<(String, String), [Option<String>; 2]>,
    /// Strengths B, by pairs of types as written.
    strengths: BTreeMap<(String, String), String>,
    /// The line number of the pair style.
    style_line: usize,
}

impl Work<'_> {
    fn changed(&mut self, command: &Command, text: impl Into<String>) {
        self.changed.push(Note { line: command.line, text: text.into() });
    }

    fn left(&mut self, command: &Command, text: impl Into<String>) {
        self.left.push(Note { line: command.line, text: text.into() });
    }

    fn take(&mut self, command: &Command) {
        let new = match command.words.as_slice() {
            ["atom_style", style @ ..] => self.atom_style(command, style),
            ["pair_style", style @ ..] => self.pair_style(command, style),
            ["pair_coeff", i, j, rest @ ..] => self.pair_coeff(command, [i, j], rest),
            ["fix", id, group, "mvv/dpd", rest @ ..] => Some(self.integrator(command, [id, group], rest)),
            ["set", rest @ ..] if self.plain_atoms && rest.contains(&"sph/rho") => self.set(command, rest),
            ["read_data", file, rest @ ..] => self.read_data(command, file, rest),
            ["comm_modify", rest @ ..] => {
                self.velocities |= rest.windows(2).any(|w| w == ["vel", "yes"]);
                None
            }
            words => {
                self.look(command, words);
                None
            }
        };
        self.script += new.as_deref().unwrap_or(command.text);
    }

    /// Reports commands that are kept but may depend on the built-in.
    fn look(&mut self, command: &Command, words: &[&str]) {
        match words {
            ["units", units] if !["lj", "real", "metal"].contains(units) => {
                self.left(command, "the style works in units lj, real and metal");
            }
            ["read_restart", ..] => {
                self.left(
                    command,
                    "a restart file of atom_style mdpd cannot be read: begin from a data file",
                );
            }
            ["compute", id, _, "property/atom", rest @ ..] if rest.contains(&"rho") => {
                let text = format!(
                    "there is no property rho: 'fix {id} all pair 1 mdpd/psi density 0' has the density, as f_{id}"
                );
                self.left(command, text);
            }
            ["variable" | "fix" | "dump" | "compute" | "fix_modify" | "pair_modify", ..]
                if words[1..].iter().any(|w| w.split('/').next() == Some("mdpd")) =>
            {
                self.left(command, "names the built-in style");
            }
            _ => {}
        }
    }

    fn atom_style(&mut self, command: &Command, style: &[&str]) -> Option<String> {
        let new = match style {
            ["mdpd"] => vec!["atomic"],
            ["hybrid", rest @ ..] if rest.contains(&"mdpd") => {
                let others: Vec<&str> = rest.iter().copied().filter(|s| *s != "mdpd").collect();
                match others.len() {
                    0 => vec!["atomic"],
                    1 => others,
                    _ => [&["hybrid"], others.as_slice()].concat(),
                }
            }
            _ => return None,
        };
        self.plain_atoms = style == ["mdpd"];
        self.changed(command, format!("atom_style {}: the style needs none of its own", new.join(" ")));
        Some(command.with("atom_style", &new))
    }

    /// Converts `hybrid/overlay mdpd/rhosum mdpd T cutoff seed`, in any order and with other styles.
    fn pair_style(&mut self, command: &Command, style: &[&str]) -> Option<String> {
        let at = |name| style.iter().position(|word| *word == name);
        let (Some(densities), Some(forces)) = (at(DENSITIES), at(FORCES)) else {
            if at(DENSITIES).is_some() || at(FORCES).is_some() {
                self.left(command, "mdpd and mdpd/rhosum belong together: one of them is not here");
            }
            return None;
        };
        let Some(arguments) = style.get(forces + 1..forces + 4) else {
            self.left(command, "mdpd needs a temperature, a cut-off and a seed");
            return None;
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
        self.style_line = command.line;
        self.changed(command, "one style sums densities and computes forces");
        if forces < densities {
            self.left(
                command,
                "mdpd stood before mdpd/rhosum and took the densities of the step before; the new style never does",
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
            let at = rest.iter().position(|w| *w == "sph/rho")?;
            rest.iter().enumerate().filter(|(k, _)| *k != at && *k != at + 1).map(|(_, w)| *w).collect()
        };
        self.changed(command, "densities need no start");
        // The first two words are the style and its argument, so fewer than three set nothing.
        Some(if kept.len() > 2 { command.with("set", &kept) } else { String::new() })
    }

    fn read_data(&mut self, command: &Command, file: &str, rest: &[&str]) -> Option<String> {
        if !self.plain_atoms {
            return None;
        }
        if file.contains('$') {
            self.left(
                command,
                "the atoms of the file have a column for the density, which atom_style atomic has not: take it out",
            );
            return None;
        }
        let new = without_column(file);
        if self.data.iter().any(|other| other != file && without_column(other) == new) {
            self.left(command, format!("{new} would be the new name of two data files: rename one of them"));
            return None;
        }
        self.data.push(file.to_owned());
        self.changed(command, format!("reads {new}, which has no column for the density"));
        let words: Vec<&str> = std::iter::once(new.as_str()).chain(rest.iter().copied()).collect();
        Some(command.with("read_data", &words))
    }

    fn finish(mut self) -> Converted {
        let line = self.style_line;
        let mut note = |text: String| self.left.push(Note { line, text });
        if line == 0 {
            note("there is no pair style of the built-in mdpd in this script".into());
        } else {
            for ((i, j), ranges) in &self.ranges {
                if let [Some(density), Some(force)] = ranges
                    && density != force
                {
                    note(format!(
                        "types {i} {j}: densities had the range {density}, forces {force}; now both have {force}"
                    ));
                }
            }
            let ranges = self.ranges.values().filter_map(|[_, force]| force.as_ref());
            for (name, values) in [("B", distinct(self.strengths.values())), ("rd", distinct(ranges))] {
                if self.law == Law::Conservative && values.len() > 1 {
                    note(format!(
                        "{name} differs between types ({}): no potential has such a force, and the style will refuse it; \
                         --law lucy does not",
                        values.join(", ")
                    ));
                }
            }
            if !self.velocities {
                note("the thermostat needs velocities of ghosts: add 'comm_modify vel yes'".into());
            }
            if self.law == Law::Conservative {
                note(
                    "the conservative law is another fluid than the built-in's: for A = -40, B = 25, rd = 0.75 its liquid \
                     has the density 6.05, where that has 6.7; --law lucy is the same fluid as before"
                        .into(),
                );
            }
        }
        self.left.sort_by_key(|note| note.line);
        let Work { script, data, changed, left, .. } = self;
        Converted { script, data, changed, left }
    }
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

/// Converts a data file for `atom_style mdpd` (`id type rho x y z …`) to one for `atom_style atomic`.
///
/// # Errors
/// An atom has too few columns.
pub fn data_file(old: &str) -> Result<String, TextError> {
    let mut new = String::new();
    let mut atoms = false;
    for (k, line) in old.split_inclusive('\n').enumerate() {
        let code = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = code.split_whitespace().collect();
        match words.first() {
            // A section begins with a word, an atom line with a number.
            Some(word) if word.starts_with(char::is_alphabetic) => {
                atoms = words == ["Atoms"];
                let style = line.split_once('#').map_or("", |(_, style)| style.trim());
                new += if atoms && style == "mdpd" { "Atoms # atomic\n" } else { line };
            }
            Some(_) if atoms => {
                if words.len() < 6 {
                    let expected = "at least 6, as atom_style mdpd has them".to_owned();
                    return Err(Problem::Columns { expected, found: words.len() }.at(k + 1));
                }
                let kept: Vec<&str> = words[..2].iter().chain(&words[3..]).copied().collect();
                new += &kept.join(" ");
                new.push('\n');
            }
            _ => new += line,
        }
    }
    Ok(new)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: &str = "# a slab\nunits lj\natom_style  mdpd\ncomm_modify vel yes\nread_data   slab.data\n\
        set type 1 sph/rho 0.0\n\
        pair_style  hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 9872598  # both\n\
        pair_coeff  1 1 mdpd/rhosum  0.75\npair_coeff  1 1 mdpd &\n  -40 25 18.0 1.0 0.75\n\
        fix mvv all mvv/dpd\nprint \"\"\"atom_style mdpd\nfix x all mvv/dpd\n\"\"\"\nrun 10\n";

    fn texts(notes: &[Note]) -> String {
        notes.iter().map(|n| format!("{}: {}\n", n.line, n.text)).collect()
    }

    #[test]
    fn only_what_knows_of_the_built_in_is_changed() {
        let new = script(OLD, Law::Lucy, "psidpdplugin.so");
        assert_eq!(
            new.script,
            "# a slab\nunits lj\natom_style  atomic\ncomm_modify vel yes\nread_data   slab.data.atomic\n\
             plugin      load psidpdplugin.so\n\
             pair_style  mdpd/psi 1.0 1.0 9872598 law lucy  # both\n\
             pair_coeff  1 1 -40 25 18.0 1.0 0.75\n\
             fix mvv all nve\nprint \"\"\"atom_style mdpd\nfix x all mvv/dpd\n\"\"\"\nrun 10\n"
        );
        assert_eq!(new.left, []);
        assert_eq!(new.changed.iter().map(|n| n.line).collect::<Vec<_>>(), [3, 5, 6, 7, 8, 9, 11]);
        assert_eq!(new.data, ["slab.data"]);
        let conservative = script(OLD, Law::Conservative, "p.so");
        assert!(conservative.script.contains("mdpd/psi 1.0 1.0 9872598  #"));
        assert!(texts(&conservative.left).contains("another fluid"));
    }

    #[test]
    fn other_styles_stay_beside() {
        let new = script(
            "atom_style hybrid mdpd bond\npair_style hybrid/overlay mdpd 1 1 $s mdpd/rhosum lj/cut 2.5\n\
             pair_coeff * * mdpd/rhosum 0.8\npair_coeff * * mdpd -40 25 18 1 0.75\npair_coeff 1 1 lj/cut 1 1\n",
            Law::Lucy,
            "p.so",
        );
        assert_eq!(
            new.script,
            "atom_style bond\nplugin     load p.so\npair_style hybrid/overlay mdpd/psi 1 1 $s law lucy lj/cut 2.5\n\
             pair_coeff * * mdpd/psi -40 25 18 1 0.75\npair_coeff 1 1 lj/cut 1 1\n"
        );
        let left = texts(&new.left);
        for said in ["densities of the step before", "had the range 0.8, forces 0.75", "comm_modify vel yes"]
        {
            assert!(left.contains(said), "{said}: {left}");
        }
    }

    #[test]
    fn what_is_left_is_said() {
        let old = "units si\natom_style mdpd\nread_data $f\nread_restart r\ncompute n all property/atom rho\n\
            pair_style hybrid/overlay mdpd/rhosum mdpd 1 1 5\npair_coeff 1 1 mdpd -40 25 18 1 0.75\n\
            pair_coeff 1 2 mdpd -40 20 18 1 0.75\nfix 1 all mvv/dpd 0.65\npair_modify pair mdpd shift no\n";
        let left = texts(&script(old, Law::Conservative, "p.so").left);
        for said in [
            "1: the style works in units lj, real and metal",
            "3: the atoms of the file have a column",
            "4: a restart file",
            "5: there is no property rho",
            "9: mvv/dpd had lambda = 0.65",
            "10: names the built-in style",
            "6: B differs between types (25, 20)",
        ] {
            assert!(left.contains(said), "{said}: {left}");
        }
        let none = script("units lj\npair_style dpd 1 1 5\n", Law::Lucy, "p.so");
        assert_eq!(none.script, "units lj\npair_style dpd 1 1 5\n");
        assert!(texts(&none.left).contains("no pair style of the built-in"));
        let half = script("pair_style mdpd 1 1 5", Law::Lucy, "p.so");
        assert_eq!(half.script, "pair_style mdpd 1 1 5");
        assert!(texts(&half.left).contains("belong together"));
    }

    #[test]
    fn the_column_of_densities_goes() {
        let old = "title\n\n2 atoms\n1 atom types\n0 1 xlo xhi\n\nAtoms # mdpd\n\n1 1 0.0 0.1 0.2 0.3\n\
            2 1 6.5 0.4 0.5 0.6 1 0 0 # last\n\nVelocities\n\n1 0 0 0\n";
        assert_eq!(
            data_file(old).unwrap(),
            "title\n\n2 atoms\n1 atom types\n0 1 xlo xhi\n\nAtoms # atomic\n\n1 1 0.1 0.2 0.3\n\
             2 1 0.4 0.5 0.6 1 0 0\n\nVelocities\n\n1 0 0 0\n"
        );
        assert_eq!(data_file("t\n\nAtoms\n\n1 1 0 0 0\n").unwrap_err().line, 5);
    }
}
