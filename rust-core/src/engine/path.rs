//! The path of an evaluation, and the reason for it.

use psidpd_passes::settings::Settings;
use std::fmt;

/// The path of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Path {
    /// The sweep over cells, with vector instructions and threads.
    Sweep,
    /// A GPU, in single precision.
    Device,
    /// Sums over a list of pairs, in double precision and on one thread: slower, for the given reason.
    PairSums(Reason),
}

/// Reasons why the sweep cannot do an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// The host lists the pairs that interact.
    ListedPairs,
    /// Energies or virials of single particles are requested.
    ParticleValues,
    /// A density is requested that no force needs.
    Densities,
    /// The box is narrower than twice the cut-off, or its edges have another orientation than those of LAMMPS.
    Box,
    /// The particles are so far apart that the sweep would lose pairs, or count them twice.
    FarApart,
    /// The host has disabled the sweep.
    Asked,
}

impl Path {
    /// Describes the path and its settings: "cell sweep, mixed precision, avx2, 2 threads".
    pub fn describe(self, settings: Settings) -> String {
        let Settings { precision, instructions, threads } = settings;
        match self {
            Path::Sweep => format!("{self}, {precision} precision, {instructions}, {threads} thread(s)"),
            Path::Device => format!("{self}, single precision"),
            Path::PairSums(_) => format!("{self}; double precision, 1 thread"),
        }
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Path::Sweep => f.write_str("cell sweep"),
            Path::Device => f.write_str("GPU"),
            Path::PairSums(reason) => write!(f, "sums over pairs one by one, because {reason}"),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Reason::ListedPairs => "the host lists the pairs",
            Reason::ParticleValues => "energies or virials of single particles are needed",
            Reason::Densities => "a density is requested that no force needs",
            Reason::Box => "the box is narrower than twice the cut-off, or its edges are turned",
            Reason::FarApart => "some particles are too far away from the others",
            Reason::Asked => "it was asked for",
        })
    }
}
