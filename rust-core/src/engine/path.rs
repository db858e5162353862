//! Which way an evaluation goes, and why.

use std::fmt;

/// How an evaluation is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Path {
    /// By the sweep over cells: fast, by vector instructions and threads.
    Sweep,
    /// By sums over a list of pairs, in double precision and on one thread: slower, for a reason.
    PairSums(Reason),
}

/// Why the sweep does not do an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// The host lists the pairs that interact.
    ListedPairs,
    /// Energies or virials of single particles are wanted.
    ParticleValues,
    /// A density is wanted that no force needs.
    Densities,
    /// The box is narrower than twice the cut-off, or leans as no box of LAMMPS does.
    Box,
    /// The host has asked for it.
    Asked,
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Path::Sweep => f.write_str("cell sweep"),
            Path::PairSums(reason) => write!(f, "sums over pairs one by one, because {reason}"),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Reason::ListedPairs => "the host lists the pairs",
            Reason::ParticleValues => "energies or virials of single particles are wanted",
            Reason::Densities => "a density is wanted that no force needs",
            Reason::Box => "the box is narrower than twice the cut-off, or its edges are turned",
            Reason::Asked => "it was asked for",
        })
    }
}
