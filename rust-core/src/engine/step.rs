/// Seed, number and length of the time step, on which the thermostat depends.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Seed of the pair noise.
    pub seed: u64,
    /// Number of the step.
    pub number: u64,
    /// Time step, positive.
    pub dt: f64,
}
