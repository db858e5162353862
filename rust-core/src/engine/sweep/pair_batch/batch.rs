/// A vector's worth of a group.
#[derive(Clone, Copy)]
pub struct Batch {
    /// From which of the group to before which.
    pub slots: [usize; 2],
    /// The particle that is the first.
    pub first: usize,
    /// Their pairs, among those of the group.
    pub pairs: [usize; 2],
}

impl Batch {
    pub fn count(self) -> usize {
        self.pairs[1] - self.pairs[0]
    }
}
