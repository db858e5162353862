//! The potentials between two species.

use crate::model::PairTerm;

/// The potentials between each particle of a rare species and others of one species.
#[derive(Debug)]
pub struct Group {
    pub rare: usize,
    pub other: usize,
    /// Whether particles of the other species are among the rare ones too.
    pub among_rare: bool,
    pub terms: Vec<PairTerm>,
    /// The longest of their ranges.
    pub range: f64,
}
