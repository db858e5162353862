//! Computes of the density, which become fixes.

use super::super::command::Command;
use super::{Work, renamed};

impl Work<'_> {
    /// Remembers a compute of the density, which becomes a fix once coefficients are known.
    pub(super) fn density(&mut self, command: &Command, id: &str, rest: &[&str]) -> Option<String> {
        if rest != ["rho"] {
            let text = format!(
                "there is no property rho: 'fix {id} all pair 1 mdpd/psi density 0' has the density, as f_{id}; take rho out of this command"
            );
            return self.by_hand(command, text);
        }
        self.changed(
            command,
            format!("there is no property rho: fix pair has the density, instead of c_{id}"),
        );
        self.waiting.push(id.to_owned());
        Some(String::new())
    }

    /// The fixes for densities that wait, where a command needs them.
    pub(super) fn densities(&mut self, next: &Command) -> Option<String> {
        if self.waiting.is_empty() {
            return None;
        }
        let runs = matches!(next.words.first(), Some(&("run" | "minimize" | "rerun")));
        let used = self.waiting.iter().any(|id| renamed(next.text, &format!("c_{id}"), "") != next.text);
        if !runs && !used {
            return None;
        }
        let mut text = String::new();
        for id in std::mem::take(&mut self.waiting) {
            let members = self.fluid.members();
            if members.is_empty() || self.fluid.types.is_none() || !self.fluid.has_one_range() {
                self.by_hand(
                    next,
                    format!(
                        "there is no property rho: 'fix {id} all pair 1 mdpd/psi density 0', after pair_coeff, has the density of each \
                         type, instead of c_{id}"
                    ),
                );
                continue;
            }
            text += &format!("fix {id} all pair 1 mdpd/psi density 0\n");
            let plain = members.len() == 1 && members[0].1 == 1.0;
            if plain {
                self.replaced.push((format!("c_{id}"), format!("f_{id}")));
                continue;
            }
            // The built-in's density is the sum over types, with their masses.
            let terms: Vec<String> = members
                .iter()
                .enumerate()
                .map(|(k, (_, mass))| {
                    let column =
                        if members.len() == 1 { format!("f_{id}") } else { format!("f_{id}[{}]", k + 1) };
                    if *mass == 1.0 { column } else { format!("{mass}*{column}") }
                })
                .collect();
            text += &format!("variable {id}_rho atom {}\n", terms.join("+"));
            self.replaced.push((format!("c_{id}"), format!("v_{id}_rho")));
        }
        Some(text)
    }
}
