//! What must be known of a script before its first command is converted.

use super::command::{bare, commands};
use super::style::base;
use super::variables::Variables;

/// Reads a file that the script names.
pub type Read<'a> = &'a dyn Fn(&str) -> Option<String>;

#[derive(Debug, Default)]
pub struct Survey {
    /// Whether a pair of types has no interaction, which only a hybrid can say.
    pub none: bool,
    /// Whether the script requests velocities of ghosts.
    pub velocities: bool,
    /// The longest range of a pair; 0 if none is known.
    pub longest: f64,
}

impl Survey {
    /// Looks through a script and the files that it includes.
    pub fn of(script: &str, read: Read) -> Survey {
        let mut survey = Survey::default();
        survey.look(script, read, &mut Variables::default(), 0);
        survey
    }

    fn look(&mut self, script: &str, read: Read, variables: &mut Variables, depth: usize) {
        for command in commands(script) {
            match command.words.as_slice() {
                ["variable", rest @ ..] => variables.define(rest),
                // A script may jump to itself.
                [verb @ ("include" | "jump"), file, ..] if depth < if *verb == "jump" { 3 } else { 10 } => {
                    if let Some(text) = variables.expand(bare(file)).and_then(|name| read(&name)) {
                        self.look(&text, read, variables, depth + 1);
                    }
                }
                ["comm_modify", rest @ ..] => self.velocities |= rest.windows(2).any(|w| w == ["vel", "yes"]),
                ["pair_coeff", _, _, "none"] => self.none = true,
                ["pair_coeff", _, _, style, numbers @ ..] => {
                    let ranges = match base(style) {
                        "mdpd" | "mdpd/diffcut" => numbers.get(3..numbers.len().min(6)),
                        "dpd" => numbers.get(2..),
                        // Outside a hybrid `pair_coeff I J A gamma cutoff` of dpd.
                        _ if variables.number(style).is_some() && numbers.len() == 2 => numbers.get(1..),
                        _ => None,
                    };
                    let ranges = ranges.unwrap_or_default().iter().filter_map(|word| variables.number(word));
                    self.longest = ranges.fold(self.longest, f64::max);
                }
                _ => {}
            }
        }
    }
}
