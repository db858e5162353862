/// Number of runs of each pass; tests check that a fluid runs no needless pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PassCounts {
    /// Number of pair searches.
    pub search: u64,
    /// Number of sums over pairs of one density.
    pub density: u64,
    /// Number of evaluations of ψ over all owned particles.
    pub excess: u64,
    /// Number of force passes.
    pub force: u64,
    /// Number of force passes that drew noise.
    pub noise: u64,
    /// Number of force passes that summed energies.
    pub energy: u64,
    /// Number of force passes that summed virials.
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
