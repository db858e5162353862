//! The particles and the time step that a host passes.

/// The host's particles: owned ones first, then ghosts. All slices have one length.
#[derive(Debug, Clone, Copy)]
pub struct Particles<'a> {
    /// Number of owned particles.
    pub owned: usize,
    /// Positions; ghosts are at the position of their image.
    pub x: &'a [[f64; 3]],
    /// Particle numbers from 1 that never change; an image has its owner's.
    pub tag: &'a [i32],
    /// Types, mapped to species by [`Engine::map_kinds`](super::Engine::map_kinds).
    pub kind: &'a [i32],
}

/// Seed, number and length of the time step, on which the thermostat depends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Seed of the pair noise.
    pub seed: u64,
    /// Number of the step.
    pub number: u64,
    /// Time step Δt.
    pub dt: f64,
}
