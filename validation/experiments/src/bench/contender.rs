//! Who is timed, under which name.

use crate::code::{Code, Host, Suffix};
use crate::fluids::{DPD, MDPD, MIXTURES, Subject};
use psidpd_core::engine::{Instructions, Precision, Settings};
use std::num::NonZeroUsize;

/// A code with its settings, and on how many MPI ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Contender {
    pub code: Code,
    pub settings: Settings,
    /// Words behind the seed of [`Code::Psi`].
    pub words: String,
    pub ranks: usize,
    /// Whether the box is repeated along x as often as there are ranks: weak scaling.
    pub weak: bool,
}

impl Contender {
    pub fn alone(code: Code) -> Contender {
        Contender { code, settings: Settings::default(), words: String::new(), ranks: 1, weak: false }
    }

    pub fn native(settings: Settings) -> Contender {
        Contender { settings, ..Contender::alone(Code::Native) }
    }

    pub fn plugin(words: impl Into<String>) -> Contender {
        Contender { words: words.into(), ..Contender::alone(Code::Psi) }
    }

    pub fn id(&self) -> String {
        let mut id = self.code.label().to_lowercase();
        if let Some(s) = self.settings() {
            id += &format!(" {} {} {}", s.precision, s.instructions, s.threads);
        }
        if !self.words.is_empty() {
            id += &format!(" {}", self.words);
        }
        if self.ranks > 1 {
            id += &format!(", {} ranks", self.ranks);
        }
        if self.weak {
            id += ", weak";
        }
        id
    }

    pub fn in_lammps(&self) -> bool {
        self.code.host() != Host::Native
    }

    /// Whether it is the plugin on one rank, where it needs no ghosts: decks advise LAMMPS as its manual does.
    pub fn needs_no_ghosts(&self) -> bool {
        self.code == Code::Psi && self.ranks == 1
    }

    pub fn settings(&self) -> Option<Settings> {
        (self.code == Code::Native).then_some(self.settings)
    }

    pub fn threads(&self) -> usize {
        let words = word_after(&self.words, "threads").and_then(|n| n.parse().ok());
        self.settings().map_or(words.unwrap_or(1), |settings| settings.threads.get())
    }

    pub fn precision(&self) -> Option<String> {
        let words = word_after(&self.words, "precision").map(str::to_owned);
        self.settings().map(|settings| settings.precision.to_string()).or(words)
    }

    /// How often the state is repeated along x.
    pub fn copies(&self) -> usize {
        if self.weak { self.ranks } else { 1 }
    }
}

fn word_after<'a>(words: &'a str, key: &str) -> Option<&'a str> {
    words.split_whitespace().skip_while(|w| *w != key).nth(1)
}

/// What the rate of others is compared with: the built-in of the fluid.
pub fn reference(subject: &Subject) -> Option<Contender> {
    if *subject == MDPD {
        Some(Contender::alone(Code::Mdpd))
    } else if *subject == DPD {
        Some(Contender::alone(Code::Dpd(Suffix::None)))
    } else {
        None
    }
}

/// The words of the plugin's fastest setting on one thread, which is timed on several ranks.
pub const MIXED: &str = "precision mixed";
const DOUBLE: &str = "precision double";

#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Whether the host has `mdpd`.
    pub built_in: bool,
    /// Whether it has `eam/alloy` and `dpd/tstat`.
    pub eam: bool,
    /// Versions of `dpd` that it has.
    pub suffixes: Vec<Suffix>,
    /// More words for `pair_style dpd/psi`; each is a contender.
    pub words: Vec<String>,
    /// Thread counts of the native runner.
    pub threads: Vec<NonZeroUsize>,
    /// Whether LAMMPS can be started on two ranks.
    pub two_ranks: bool,
}

/// Particles of the many-body fluid above which few are timed, if nothing else is asked for: LAMMPS needs ten
/// and more seconds for the fewest steps, for each of its styles.
pub const FEW_ABOVE: usize = 100_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    Everyone,
    /// All but the reference, whose cost per particle does not depend on the size.
    AllButPlain,
    /// What a user chooses among: the built-in, the plugin in both precisions, on threads and on two ranks, the native
    /// runner in both precisions with the best instructions.
    User,
    /// Who was asked for by name, and of the others those that take few seconds or are compared with: the
    /// built-in, the plugin in mixed precision on one rank and two, the native runner in mixed precision with the
    /// best instructions; of the general fluid only the native runner.
    Few,
}

impl Field {
    /// Few at sizes above `few_above`. Below, with `every_code`, everyone at the smallest size.
    pub fn of(size: usize, smallest: bool, every_code: bool, few_above: usize) -> Field {
        match (size > few_above, every_code, smallest) {
            (true, ..) => Field::Few,
            (false, false, _) => Field::User,
            (false, true, true) => Field::Everyone,
            (false, true, false) => Field::AllButPlain,
        }
    }

    fn has(self, subject: &Subject, contender: &Contender, choice: &Choice) -> bool {
        let Contender { settings, words, .. } = contender;
        let best = settings.instructions == Instructions::best();
        match (self, contender.code) {
            (Field::Everyone, _) => true,
            (Field::AllButPlain, code) => code != Code::PairSums,
            (Field::User, _) if contender.weak => false,
            (Field::User, Code::Psi) => words != DOUBLE || choice.words.contains(words),
            (Field::User, Code::Native) => best,
            (Field::User, Code::Eam | Code::PairSums) => false,
            (Field::User, _) => true,
            (Field::Few, Code::Psi) => {
                (words == MIXED && reference(subject).is_some()) || choice.words.contains(words)
            }
            (Field::Few, Code::Native) => settings.precision == Precision::Mixed && best,
            (Field::Few, _) => reference(subject).as_ref() == Some(contender),
        }
    }
}

pub fn contenders(subject: &Subject, choice: &Choice, field: Field) -> Vec<Contender> {
    let mut all = everyone(subject, choice);
    let natively = MIXTURES.contains(subject);
    all.retain(|contender| {
        field.has(subject, contender, choice) && (contender.code == Code::Native || !natively)
    });
    all
}

/// The native runner last: see [`turns`](super::turns).
fn everyone(subject: &Subject, choice: &Choice) -> Vec<Contender> {
    let mut all = Vec::new();
    if *subject == MDPD {
        all.extend(choice.built_in.then(|| Contender::alone(Code::Mdpd)));
        all.extend(choice.eam.then(|| Contender::alone(Code::Eam)));
    } else if *subject == DPD {
        all.extend(choice.suffixes.iter().map(|s| Contender::alone(Code::Dpd(*s))));
    }
    let general = *subject != MDPD && *subject != DPD;
    let threads = choice.threads.iter().filter(|n| n.get() > 1 && !general);
    let words = ["", MIXED, DOUBLE].map(str::to_owned).into_iter();
    let words = words.chain(threads.map(|n| format!("{MIXED} threads {n}"))).chain(choice.words.clone());
    all.extend(words.map(Contender::plugin));
    if *subject == MDPD && choice.two_ranks {
        for weak in [false, true] {
            let built_in = choice.built_in.then(|| Contender::alone(Code::Mdpd));
            let both = built_in.into_iter().chain([Contender::plugin(MIXED)]);
            all.extend(both.map(|alone| Contender { ranks: 2, weak, ..alone }));
        }
    }
    all.push(Contender::alone(Code::PairSums));
    for &threads in &choice.threads {
        for (_, precision) in Precision::ALL {
            for (_, instructions) in Instructions::ALL.into_iter().filter(|(_, i)| i.available()) {
                // Of the general fluid the best instruction set will do.
                if general && instructions != Instructions::best() {
                    continue;
                }
                all.push(Contender::native(Settings { precision, instructions, threads }));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluids::SUBJECTS;
    use std::collections::HashSet;

    #[test]
    fn threads_are_those_of_the_settings_or_of_the_words() {
        let plugin = |words: &str| Contender::plugin(words).threads();
        assert_eq!(["", "threads", "precision mixed", "precision mixed threads 2"].map(plugin), [1, 1, 1, 2]);
        let settings = Settings { threads: NonZeroUsize::new(3).unwrap(), ..Settings::default() };
        assert_eq!(Contender::native(settings).threads(), 3);
        let precision = |words: &str| Contender::plugin(words).precision();
        assert_eq!(precision("threads 2"), None);
        assert_eq!(precision(MIXED).as_deref(), Some("mixed"));
    }

    fn choice() -> Choice {
        Choice {
            built_in: true,
            eam: true,
            suffixes: Suffix::ALL.to_vec(),
            two_ranks: true,
            words: vec!["precision double threads 3".into()],
            threads: [1, 2].map(|n| NonZeroUsize::new(n).unwrap()).to_vec(),
        }
    }

    fn names(subject: &Subject, field: Field) -> Vec<String> {
        contenders(subject, &choice(), field).iter().map(Contender::id).collect()
    }

    #[test]
    fn few_are_timed_in_large_boxes() {
        assert_eq!(Field::of(10, true, true, 10), Field::Everyone);
        assert_eq!(Field::of(10, false, true, 10), Field::AllButPlain);
        assert_eq!(Field::of(10, true, false, 10), Field::User);
        assert_eq!([true, false].map(|smallest| Field::of(11, smallest, true, 10)), [Field::Few; 2]);
        let native = |threads| format!("native mixed {} {threads}", Instructions::best());
        let plugin = "plugin dpd/psi precision mixed".to_owned();
        let asked = "plugin dpd/psi precision double threads 3".to_owned();
        let ranks = [format!("{plugin}, 2 ranks"), format!("{plugin}, 2 ranks, weak")];
        let [one, two] = [1, 2].map(native);
        let [strong, weak] = ranks;
        let built_in = "lammps mdpd".to_owned();
        let few = [built_in, plugin.clone(), asked.clone(), strong, weak, one.clone(), two.clone()];
        assert_eq!(names(&MDPD, Field::Few), few);
        assert_eq!(
            names(&DPD, Field::Few),
            ["lammps dpd".to_owned(), plugin, asked.clone(), one.clone(), two.clone()]
        );
        assert_eq!(names(&SUBJECTS[2], Field::Few), [asked, one, two]);
        for subject in &SUBJECTS {
            let (mut all, most) = (names(subject, Field::Everyone), names(subject, Field::AllButPlain));
            assert!(all.len() > most.len() && names(subject, Field::Few).iter().all(|n| most.contains(n)));
            all.retain(|name| name != "native plain");
            assert_eq!(all, most);
        }
    }

    #[test]
    fn a_user_sees_what_he_chooses_among() {
        let best = Instructions::best();
        for subject in &SUBJECTS {
            let names = names(subject, Field::User);
            assert!(
                names.contains(&"plugin dpd/psi".to_owned())
                    && names.contains(&format!("native double {best} 2"))
            );
            // Threads of the plugin are those of any fluid.
            let specialised = *subject == MDPD || *subject == DPD;
            let two = names.contains(&"plugin dpd/psi precision mixed threads 2".to_owned());
            assert_eq!(two, specialised, "{names:?}");
            let left_out = |name: &String| {
                name.contains("weak")
                    || name.contains("portable")
                    || name.contains("eam")
                    || name.contains("plain")
            };
            assert!(!names.iter().any(left_out), "{names:?}");
            assert_eq!(
                names.iter().filter(|name| name.contains("2 ranks")).count(),
                2 * usize::from(*subject == MDPD)
            );
        }
    }

    #[test]
    fn every_contender_has_a_name_of_its_own() {
        let choice = choice();
        for subject in &SUBJECTS {
            let all = contenders(subject, &choice, Field::Everyone);
            let names: HashSet<String> = all.iter().map(Contender::id).collect();
            assert_eq!(names.len(), all.len());
            assert!(names.contains("plugin dpd/psi precision double threads 3"));
            assert!(names.contains("plugin dpd/psi"));
            assert!(names.contains(&format!("native mixed {} 2", Instructions::best())));
            if let Some(reference) = reference(subject) {
                assert!(all.contains(&reference));
            }
        }
    }
}
