use psidpd_passes::ground::terms::Terms;
use psidpd_passes::instruction_set::InstructionSet;

/// Constants of one fluid.
pub struct FluidConstants<T> {
    pub set: InstructionSet,
    pub terms: Terms<T>,
    /// The variables of ψ that the many-body passes sum.
    pub variables: Vec<usize>,
}

impl<T> FluidConstants<T> {
    /// Number of slopes of each particle that a many-body pair needs.
    pub fn width(&self) -> usize {
        self.variables.len()
    }
}
