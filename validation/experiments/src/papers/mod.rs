//! Figures and tables of the papers that the models come from, one case each, compared with what is printed.
//!
//! A case runs at a [`Size`] and gives named values, each beside the published one. Numbers are those of the
//! text and tables of the papers; of a curve without numbers, the stated trend or the theory is compared.
//!
//! The rule is the same for every value: the deviation, in units of the combined error of both sides, is at most
//! [`case::LIMIT`]; a trend counts on its wrong side only. A published number without an error bar has that of its last
//! printed digit. Where the paper prints neither, the error is ours and the value says so ([`Source::Read`]). A value that
//! disagrees at full size fails at quick size too, whatever that resolves: [`long`] has these.

mod berendsen;
mod case;
mod context;
mod long;
mod pagonabarraga;
mod trofimov;
mod wang;
mod warren;

use crate::ExperimentError;
pub use case::{AtFullSize, Compared, Reproduction, Rule, Source};
pub use context::{Context, Size};

#[derive(Debug, Clone)]
pub struct Case {
    /// `PAPER-figN`, `PAPER-tableN`, or another short name.
    pub id: String,
    pub paper: &'static str,
    pub what: &'static str,
    add: Add,
}

/// Makes the runs of a case and adds its values and plots.
type Add = fn(&Context, &mut Reproduction) -> Result<(), ExperimentError>;

/// A paper: a short name, a reference, and its cases: figure or table, the comparison in a line, and the function that makes it.
type Paper = (&'static str, &'static str, &'static [(&'static str, &'static str, Add)]);

const PAPERS: [Paper; 5] =
    [pagonabarraga::PAPER, trofimov::PAPER, warren::PAPER, wang::PAPER, berendsen::PAPER];

impl Case {
    /// Runs the case.
    ///
    /// # Errors
    /// A run stops, or a file cannot be written. A value that does not agree is no error.
    pub fn run(&self, context: &Context) -> Result<Reproduction, ExperimentError> {
        let mut outcome = Reproduction::default();
        (self.add)(context, &mut outcome)?;
        if context.size == Size::Quick {
            long::mark(&self.id, &mut outcome.values);
        }
        Ok(outcome)
    }
}

pub fn cases() -> Vec<Case> {
    let of = |(name, paper, cases): Paper| {
        cases.iter().map(move |(of, what, add)| Case { id: format!("{name}-{of}"), paper, what, add: *add })
    };
    PAPERS.into_iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::{Context, Size};
    use psidpd_core::engine::Fault;
    use psidpd_formats::files::Existing;
    use std::num::NonZeroUsize;

    /// The values that disagree in a case at its small size, with forces of which a term is 5 % too strong.
    fn failing(id: &str, fault: Option<Fault>) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let case = super::cases().into_iter().find(|case| case.id == id).unwrap();
        let folder = folder.path().join(id);
        let context =
            Context { size: Size::Quick, folder, threads: NonZeroUsize::MIN, existing: Existing::Keep };
        let outcome = Fault::during(fault, || case.run(&context)).unwrap();
        outcome.values.iter().filter(|value| !value.passes()).map(|value| value.name.clone()).collect()
    }

    /// Tolerances that pass these would be too wide.
    #[test]
    fn a_case_tells_of_wrong_forces() {
        let (id, fault) = ("pagonabarraga-fig3", Fault::ManyBodyForce);
        let known = failing(id, None);
        assert_eq!(known, ["alpha of the quadratic kernel, density 3"]);
        assert!(failing(id, Some(fault)).len() > known.len() + 1, "{fault:?}");
    }

    /// The rest of this case does not depend on the noise: nothing else is wrong.
    #[test]
    fn a_case_tells_of_wrong_noise() {
        assert_eq!(failing("pagonabarraga-fig7", Some(Fault::Noise)), ["kinetic temperature"]);
    }

    #[test]
    fn ids_are_unique_and_begin_with_their_paper() {
        let mut ids: Vec<String> = super::cases().into_iter().map(|case| case.id).collect();
        let papers = ["pagonabarraga-", "trofimov-", "warren-", "wang-", "berendsen-"];
        assert!(ids.iter().all(|id| papers.iter().any(|paper| id.starts_with(paper))), "{ids:?}");
        let count = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), count);
    }
}
