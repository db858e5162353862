/// A step that the thermostat acts in.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Seed of the noise.
    pub seed: u64,
    /// Number of the step.
    pub number: u64,
    /// Length of the step.
    pub dt: f64,
}
