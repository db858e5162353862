use super::PairSums;

fn bytes<T>(array: &Vec<T>) -> usize {
    array.capacity() * size_of::<T>()
}

impl PairSums {
    /// Size in bytes of the arrays over particles and pairs, without the cells of the search.
    pub fn memory(&self) -> usize {
        self.pairs.force().bytes()
            + self.pairs.density_only().bytes()
            + bytes(&self.species)
            + bytes(&self.densities)
            + bytes(&self.excess)
            + bytes(&self.slopes)
            + bytes(&self.particle_energy)
            + bytes(&self.particle_virial)
    }
}
