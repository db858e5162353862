use psidpd_passes::ground::terms::Terms;
use psidpd_passes::instruction_set::InstructionSet;

/// What stays the same for one fluid.
pub struct FluidConstants<T> {
    pub set: InstructionSet,
    pub terms: Terms<T>,
    /// Which variables of ψ the many-body passes sum.
    pub variables: Vec<usize>,
}

impl<T> FluidConstants<T> {
    /// Numbers that a many-body pair needs of each particle.
    pub fn width(&self) -> usize {
        self.variables.len()
    }
}
