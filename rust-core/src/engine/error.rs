use super::reach::ReachError;

/// Why an evaluation stopped. Tags are the particles' own numbers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// A position is NaN or infinite.
    #[error(
        "the position of particle {tag} is not finite: the time step is likely too large for these forces"
    )]
    Position {
        /// Which particle.
        tag: i32,
    },
    /// ψ or its derivative is NaN or infinite.
    #[error(
        "the excess free energy of particle {tag}, species {species}, is not finite at local densities \
         [{densities}]: psi is singular there; set bounds on the density, or lower the time step"
    )]
    ExcessFreeEnergy {
        /// Which particle.
        tag: i32,
        /// Its species.
        species: String,
        /// Its corrected densities, density-major.
        densities: String,
    },
    /// A force is NaN or infinite.
    #[error(
        "the force on particle {tag} is not finite: particles overlap too much for this model or time step"
    )]
    Force {
        /// Which particle.
        tag: i32,
    },
    /// A tag that is not positive: pair noise is keyed by tags.
    #[error("particle tags must be positive, found {tag}")]
    Tag {
        /// The tag.
        tag: i32,
    },
    /// A particle of a kind that was not mapped to a species.
    #[error("particle {tag} has type {kind}, which is not mapped to a species")]
    Kind {
        /// Which particle.
        tag: i32,
        /// Its type.
        kind: i32,
    },
    /// A range much longer than the box.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// Arrays of different lengths, or calls out of order: a fault of the host.
    #[error("host error: {0}")]
    Host(&'static str),
}
