use super::reach::ReachError;

/// Reasons why an evaluation stopped. Tags are the host's numbers of particles.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// A position is NaN or infinite.
    #[error(
        "the position of particle {tag} is not finite: the time step is likely too large for these forces"
    )]
    Position {
        /// Tag of the particle.
        tag: i32,
    },
    /// ψ or its derivative is NaN or infinite.
    #[error(
        "the excess free energy of particle {tag}, species {species}, is not finite at local densities \
         [{densities}]: psi is singular there; set bounds on the density, or lower the time step"
    )]
    ExcessFreeEnergy {
        /// Tag of the particle.
        tag: i32,
        /// Name of the particle's species.
        species: String,
        /// Corrected densities of the particle, density-major.
        densities: String,
    },
    /// A force is NaN or infinite.
    #[error(
        "the force on particle {tag} is not finite: particles overlap too much for this model or time step"
    )]
    Force {
        /// Tag of the particle.
        tag: i32,
    },
    /// A tag is not positive; the noise of a pair depends on its tags.
    #[error("particle tags must be positive, found {tag}")]
    Tag {
        /// The invalid tag.
        tag: i32,
    },
    /// A particle has a type without a species.
    #[error("particle {tag} has type {kind}, which is not mapped to a species")]
    Kind {
        /// Tag of the particle.
        tag: i32,
        /// Type of the particle.
        kind: i32,
    },
    /// A range is much longer than the box.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// A GPU failed, or cannot do what was asked for.
    #[error("{0}")]
    Device(String),
    /// The host has passed arrays of different lengths, or made calls in the wrong order.
    #[error("host error: {0}")]
    Host(&'static str),
}
