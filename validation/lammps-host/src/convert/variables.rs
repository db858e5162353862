//! Variables of a script whose values are known before it runs.

use super::command::bare;
use std::collections::BTreeMap;

/// Values by name; `None` for values that only LAMMPS knows.
#[derive(Debug, Clone, Default)]
pub struct Variables(BTreeMap<String, Option<String>>);

impl Variables {
    /// Reads the arguments of a `variable` command.
    pub fn define(&mut self, words: &[&str]) {
        let (Some(name), Some(style)) = (words.first(), words.get(1)) else { return };
        let value = match (*style, &words[2..]) {
            // The first definition of these counts.
            ("index" | "loop" | "getenv" | "world" | "universe" | "uloop" | "file" | "atomfile", _)
                if self.0.contains_key(*name) =>
            {
                return;
            }
            ("index" | "string", [value]) => self.expand(bare(value)),
            ("equal", [formula]) => {
                self.expand(bare(formula)).and_then(|text| self.evaluate(&text)).map(|x| x.to_string())
            }
            ("delete", _) => {
                self.0.remove(*name);
                return;
            }
            _ => None,
        };
        self.0.insert((*name).to_owned(), value);
    }

    /// A text with the values of its variables, or `None` if one is not known.
    pub fn expand(&self, text: &str) -> Option<String> {
        let mut found = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            found += &rest[..at];
            rest = &rest[at + 1..];
            if let Some(inside) = rest.strip_prefix('{') {
                let end = inside.find('}')?;
                found += self.0.get(&inside[..end])?.as_ref()?;
                rest = &inside[end + 1..];
            } else if rest.starts_with('(') {
                let end = closing(rest)?;
                let formula = &rest[1..end];
                let formula = formula.split_once(":%").map_or(formula, |(formula, _)| formula);
                found += &self.evaluate(&self.expand(formula)?)?.to_string();
                rest = &rest[end + 1..];
            } else {
                let name = rest.chars().next()?;
                found += self.0.get(name.encode_utf8(&mut [0; 4]) as &str)?.as_ref()?;
                rest = &rest[name.len_utf8()..];
            }
        }
        Some(found + rest)
    }

    /// The number that a word stands for, if it is known.
    pub fn number(&self, word: &str) -> Option<f64> {
        let text = self.expand(bare(word))?;
        text.trim().parse().ok().filter(|x: &f64| x.is_finite())
    }

    /// The value of a formula of numbers, of PI, and of other variables as `v_NAME`.
    fn evaluate(&self, formula: &str) -> Option<f64> {
        let mut rest = formula.trim();
        let value = self.sum(&mut rest)?;
        (rest.is_empty() && value.is_finite()).then_some(value)
    }

    fn sum(&self, rest: &mut &str) -> Option<f64> {
        let mut value = self.product(rest)?;
        loop {
            if take(rest, '+') {
                value += self.product(rest)?;
            } else if take(rest, '-') {
                value -= self.product(rest)?;
            } else {
                return Some(value);
            }
        }
    }

    fn product(&self, rest: &mut &str) -> Option<f64> {
        let mut value = self.power(rest)?;
        loop {
            if take(rest, '*') {
                value *= self.power(rest)?;
            } else if take(rest, '/') {
                value /= self.power(rest)?;
            } else {
                return Some(value);
            }
        }
    }

    fn power(&self, rest: &mut &str) -> Option<f64> {
        // LAMMPS binds a minus more tightly than a power.
        let base = self.atom(rest)?;
        Some(if take(rest, '^') { base.powf(self.power(rest)?) } else { base })
    }

    fn atom(&self, rest: &mut &str) -> Option<f64> {
        if take(rest, '-') {
            return Some(-self.atom(rest)?);
        }
        if take(rest, '(') {
            let value = self.sum(rest)?;
            return take(rest, ')').then_some(value);
        }
        *rest = rest.trim_start();
        if rest.starts_with(char::is_alphabetic) {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            let name = &rest[..end];
            *rest = &rest[end..];
            return match name.strip_prefix("v_") {
                Some(name) => self.0.get(name)?.as_ref()?.trim().parse().ok(),
                None => (name == "PI").then_some(std::f64::consts::PI),
            };
        }
        // A sign belongs to a number only after its exponent.
        let mut end = 0;
        let mut last = ' ';
        for c in rest.chars() {
            if !(c.is_ascii_digit() || ".eE".contains(c) || "+-".contains(c) && "eE".contains(last)) {
                break;
            }
            end += 1;
            last = c;
        }
        let value = rest[..end].parse().ok()?;
        *rest = &rest[end..];
        Some(value)
    }
}

fn take(rest: &mut &str, c: char) -> bool {
    let Some(after) = rest.trim_start().strip_prefix(c) else { return false };
    *rest = after;
    true
}

/// Where the parenthesis at the beginning of a text closes.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (k, c) in text.char_indices() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if depth == 0 {
            return Some(k);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_are_known() {
        let mut variables = Variables::default();
        for words in [
            ["B", "equal", "2.5e1"].as_slice(),
            &["r", "index", "0.75"],
            &["r", "index", "0.8"],
            &["many", "index", "1", "2"],
            &["name", "string", "'a ${r}'"],
            &["k", "equal", "\"v_B*${r}^2 - (1+1)\""],
            &["t", "equal", "temp"],
            &["e", "equal", "1e-1+2"],
        ] {
            variables.define(words);
        }
        for (text, value) in [
            ("${B}", Some("25")),
            ("$r", Some("0.75")),
            ("x${name}y", Some("xa 0.75y")),
            ("$(v_B/v_r:%.3f)", Some("33.333333333333336")),
            ("${many}", None),
            ("${none}", None),
            ("$(", None),
            ("${", None),
            ("$", None),
            ("${e}", Some("2.1")),
            ("$(-2^2)", Some("4")),
        ] {
            assert_eq!(variables.expand(text).as_deref(), value, "{text}");
        }
        assert_eq!(variables.number("${k}"), Some(25.0 * 0.5625 - 2.0));
        assert_eq!(variables.number("${t}"), None);
        variables.define(&["B", "delete"]);
        assert_eq!(variables.number("${B}"), None);
    }
}
