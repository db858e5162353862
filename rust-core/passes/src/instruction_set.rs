use super::settings::Instructions;

/// An instruction set that this processor has: whoever holds one may run code that is compiled for it.
///
/// [`Instructions`] says what a user asks for; this is made of it only where the processor was asked too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionSet(Instructions);

impl InstructionSet {
    /// These instructions, if the processor has them.
    pub fn new(instructions: Instructions) -> Option<InstructionSet> {
        instructions.available().then_some(InstructionSet(instructions))
    }

    /// The best that the processor has.
    pub fn best() -> InstructionSet {
        InstructionSet(Instructions::best())
    }

    /// Which instructions these are.
    pub fn instructions(self) -> Instructions {
        self.0
    }
}
