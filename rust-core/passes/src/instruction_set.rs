use super::settings::Instructions;

/// An instruction set that this processor has: the owner of a value may run code that is compiled for it.
///
/// [`Instructions`] is what a user asks for; [`InstructionSet::new`] also asks the processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionSet(Instructions);

impl InstructionSet {
    /// These instructions, if the processor has them.
    pub fn new(instructions: Instructions) -> Option<InstructionSet> {
        instructions.available().then_some(InstructionSet(instructions))
    }

    /// The best instruction set that the processor has.
    pub fn best() -> InstructionSet {
        InstructionSet(Instructions::best())
    }

    pub fn instructions(self) -> Instructions {
        self.0
    }
}

impl Default for InstructionSet {
    fn default() -> InstructionSet {
        InstructionSet::best()
    }
}
