//! What a host hands over.

/// The host's particles: owned ones first, then ghosts. All slices have one length.
#[derive(Debug, Clone, Copy)]
pub struct Particles<'a> {
    /// How many are owned.
    pub owned: usize,
    /// Positions; ghosts where their image is.
    pub x: &'a [[f64; 3]],
    /// Numbers that stay with the particles, from 1; images share their owner's.
    pub tag: &'a [i32],
    /// Types, mapped to species by [`Engine::map_kinds`](super::Engine::map_kinds).
    pub kind: &'a [i32],
}

/// What the thermostat of a step is keyed and scaled by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Seed of the pair noise.
    pub seed: u64,
    /// Number of the step.
    pub number: u64,
    /// Δt.
    pub dt: f64,
}
