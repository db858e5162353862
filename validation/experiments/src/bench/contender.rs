//! Who is timed, under which name.

use crate::fluids::{DPD, MDPD, Subject};
use psidpd_core::engine::{Instructions, Precision, Settings};
use std::num::NonZeroUsize;

#[derive(Debug, Clone, PartialEq)]
pub enum Code {
    /// LAMMPS's `mdpd/rhosum` and `mdpd`.
    BuiltIn,
    /// LAMMPS's `eam/alloy` with tables of the fluid, and `dpd/tstat`.
    Eam,
    /// LAMMPS's `dpd`, or an accelerated version of it.
    Dpd(Suffix),
    /// The plugin's `dpd/psi`, with these words behind the seed.
    Plugin(String),
    Native(Settings),
    /// The native runner with the sums over pairs one by one.
    Plain,
}

/// Accelerated versions of LAMMPS's `dpd`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suffix {
    /// `dpd` itself.
    None,
    /// `dpd/omp` on one thread.
    Omp,
    /// `dpd/intel` on one thread, in its mixed precision.
    Intel,
}

/// A code, and on how many MPI ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Contender {
    pub code: Code,
    /// MPI ranks; 1 for the native runner.
    pub ranks: usize,
    /// Whether the box is repeated along x as often as there are ranks: weak scaling.
    pub weak: bool,
}

impl Suffix {
    pub fn style(self) -> &'static str {
        match self {
            Suffix::None => "dpd",
            Suffix::Omp => "dpd/omp",
            Suffix::Intel => "dpd/intel",
        }
    }
}

impl Contender {
    /// On one rank.
    pub fn alone(code: Code) -> Contender {
        Contender { code, ranks: 1, weak: false }
    }

    /// The name in results.
    pub fn id(&self) -> String {
        let mut id = match &self.code {
            Code::BuiltIn => "lammps mdpd".to_owned(),
            Code::Eam => "lammps eam/alloy".to_owned(),
            Code::Dpd(suffix) => format!("lammps {}", suffix.style()),
            Code::Plugin(words) => format!("plugin dpd/psi {words}").trim_end().to_owned(),
            Code::Native(s) => format!("native {} {} {}", s.precision, s.instructions, s.threads),
            Code::Plain => "native plain".to_owned(),
        };
        if self.ranks > 1 {
            id += &format!(", {} ranks", self.ranks);
        }
        if self.weak {
            id += ", weak";
        }
        id
    }

    pub fn in_lammps(&self) -> bool {
        !matches!(self.code, Code::Native(_) | Code::Plain)
    }

    /// Whether it is the plugin on one rank, where it needs no ghosts: decks advise LAMMPS as its manual does.
    pub fn needs_no_ghosts(&self) -> bool {
        matches!(self.code, Code::Plugin(_)) && self.ranks == 1
    }

    /// The settings of the native runner.
    pub fn settings(&self) -> Option<Settings> {
        match self.code {
            Code::Native(settings) => Some(settings),
            _ => None,
        }
    }

    /// Threads of each rank.
    pub fn threads(&self) -> usize {
        match &self.code {
            Code::Native(settings) => settings.threads.get(),
            Code::Plugin(words) => word_after(words, "threads").and_then(|n| n.parse().ok()).unwrap_or(1),
            _ => 1,
        }
    }

    /// The precision, where one was asked for.
    pub fn precision(&self) -> Option<String> {
        match &self.code {
            Code::Native(settings) => Some(settings.precision.to_string()),
            Code::Plugin(words) => word_after(words, "precision").map(str::to_owned),
            _ => None,
        }
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
        Some(Contender::alone(Code::BuiltIn))
    } else if *subject == DPD {
        Some(Contender::alone(Code::Dpd(Suffix::None)))
    } else {
        None
    }
}

/// The words of the plugin's fastest setting on one thread, which is timed on several ranks.
pub const MIXED: &str = "precision mixed";
/// Those of its default.
const DOUBLE: &str = "precision double";

/// What a LAMMPS has, and what is asked for.
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

/// Which contenders a size is for.
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
        match (self, &contender.code) {
            (Field::Everyone, _) => true,
            (Field::AllButPlain, code) => *code != Code::Plain,
            (Field::User, _) if contender.weak => false,
            (Field::User, Code::Plugin(words)) => words != DOUBLE || choice.words.contains(words),
            (Field::User, Code::Native(settings)) => settings.instructions == Instructions::best(),
            (Field::User, Code::Eam | Code::Plain) => false,
            (Field::User, _) => true,
            (Field::Few, Code::Plugin(words)) => {
                (words == MIXED && reference(subject).is_some()) || choice.words.contains(words)
            }
            (Field::Few, Code::Native(settings)) => {
                settings.precision == Precision::Mixed && settings.instructions == Instructions::best()
            }
            (Field::Few, _) => reference(subject).as_ref() == Some(contender),
        }
    }
}

/// Who is timed with a fluid at a size.
pub fn contenders(subject: &Subject, choice: &Choice, field: Field) -> Vec<Contender> {
    let mut all = everyone(subject, choice);
    all.retain(|contender| field.has(subject, contender, choice));
    all
}

/// The native runner last: see [`turns`](super::turns).
fn everyone(subject: &Subject, choice: &Choice) -> Vec<Contender> {
    let mut all = Vec::new();
    if *subject == MDPD {
        all.extend(choice.built_in.then(|| Contender::alone(Code::BuiltIn)));
        all.extend(choice.eam.then(|| Contender::alone(Code::Eam)));
    } else if *subject == DPD {
        all.extend(choice.suffixes.iter().map(|s| Contender::alone(Code::Dpd(*s))));
    }
    let general = *subject != MDPD && *subject != DPD;
    let threads = choice.threads.iter().filter(|n| n.get() > 1 && !general);
    let words = ["", MIXED, DOUBLE].map(str::to_owned).into_iter();
    let words = words.chain(threads.map(|n| format!("{MIXED} threads {n}"))).chain(choice.words.clone());
    all.extend(words.map(|words| Contender::alone(Code::Plugin(words))));
    if *subject == MDPD && choice.two_ranks {
        for weak in [false, true] {
            let built_in = choice.built_in.then_some(Code::BuiltIn);
            for code in built_in.into_iter().chain([Code::Plugin(MIXED.to_owned())]) {
                all.push(Contender { code, ranks: 2, weak });
            }
        }
    }
    all.push(Contender::alone(Code::Plain));
    for &threads in &choice.threads {
        for (_, precision) in Precision::ALL {
            for (_, instructions) in Instructions::ALL.into_iter().filter(|(_, i)| i.available()) {
                // Of the general fluid the best instruction set will do.
                if general && instructions != Instructions::best() {
                    continue;
                }
                let settings = Settings { precision, instructions, threads };
                all.push(Contender::alone(Code::Native(settings)));
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
        let plugin = |words: &str| Contender::alone(Code::Plugin(words.to_owned())).threads();
        assert_eq!(["", "threads", "precision mixed", "precision mixed threads 2"].map(plugin), [1, 1, 1, 2]);
        let settings = Settings { threads: NonZeroUsize::new(3).unwrap(), ..Settings::default() };
        assert_eq!(Contender::alone(Code::Native(settings)).threads(), 3);
        let precision = |words: &str| Contender::alone(Code::Plugin(words.to_owned())).precision();
        assert_eq!(precision("threads 2"), None);
        assert_eq!(precision(MIXED).as_deref(), Some("mixed"));
    }

    fn choice() -> Choice {
        Choice {
            built_in: true,
            eam: true,
            suffixes: vec![Suffix::None, Suffix::Omp, Suffix::Intel],
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
