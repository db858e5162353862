/// How often each pass has run: proof that what a fluid does not need is left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PassCounts {
    /// Pair searches.
    pub search: u64,
    /// Sums over pairs of one density.
    pub density: u64,
    /// Evaluations of ψ over all owned particles.
    pub excess: u64,
    /// Force passes.
    pub force: u64,
    /// Force passes that drew noise.
    pub noise: u64,
    /// Force passes that summed energies.
    pub energy: u64,
    /// Force passes that summed virials.
    pub virial: u64,
}

impl std::ops::Add for PassCounts {
    type Output = PassCounts;

    fn add(self, other: PassCounts) -> PassCounts {
        PassCounts {
            search: self.search + other.search,
            density: self.density + other.density,
            excess: self.excess + other.excess,
            force: self.force + other.force,
            noise: self.noise + other.noise,
            energy: self.energy + other.energy,
            virial: self.virial + other.virial,
        }
    }
}
