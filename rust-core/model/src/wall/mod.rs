//! Walls as a continuum: matter behind a face of the box, or outside or inside of a cylinder or a sphere.
//!
//! Matter of density ρ_w adds to the local densities of a particle, and to its energy, what integrals over the matter say:
//!
//! ```text
//! n_w,i += ρ_w ∫ w        U_i = ρ_w [s ∫ φ + Σ_d ∂ψ_w/∂n_d ∫ w_d]
//! ```
//!
//! The factor s is 1, or chosen for a contact angle. The second term of the energy is the response of the matter, whose ψ changes to first order with the densities that the
//! particle adds to it. Forces are the gradient of both. Drag between particle and matter adds up to a tensor of friction,
//! `ζ = ρ_w γ ∫ w_R² r̂ r̂`: Revenga, Zúñiga, Español and Pagonabarraga, Int. J. Mod. Phys. C 9, 1319 (1998).

mod friction;
mod integral;
mod surface;

pub use friction::{Friction, SURPLUS};
pub use integral::MatterIntegral;
pub use surface::{Round, Surface};

/// Matter behind a surface. Faces of directions that are periodic have no walls.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    /// The surface of the matter.
    pub surface: Surface,
    /// Index of the species of the matter.
    pub species: usize,
    /// The number density of the matter.
    pub density: f64,
    /// The local densities of a particle of the matter, at which its ψ responds, for each density of the model; the number density if
    /// there are none.
    pub local_densities: Vec<f64>,
    /// Factor of the pair potentials between particle and matter.
    pub strength: f64,
    /// The velocity of the matter, along its surface.
    pub velocity: [f64; 3],
    /// Drag coefficient and range between particle and matter, in place of those of the model.
    pub drag: [Option<f64>; 2],
}

/// A wall in one fluid: what its matter adds for a particle of each species.
#[derive(Debug, Clone)]
pub struct WallField {
    /// The wall.
    pub wall: Wall,
    /// Fields by the species of the particle.
    pub fields: Vec<Field>,
}

/// What the matter of a wall adds for particles of one species.
#[derive(Debug, Clone)]
pub struct Field {
    /// The range of densities and energy.
    pub range: f64,
    /// Additions to local densities, each with the index of its density; all are densities of the species of the matter.
    pub densities: Vec<(usize, MatterIntegral)>,
    /// Parts of the energy.
    pub energies: Vec<MatterIntegral>,
    /// The friction; `None` without drag.
    pub friction: Option<Friction>,
}
