use super::Reference;
use super::pairs::PairList;

fn bytes<T>(array: &Vec<T>) -> usize {
    array.capacity() * size_of::<T>()
}

pub fn list_bytes(list: &PairList) -> usize {
    let PairList { i, j, species_i, species_j, d, r, factor, thermostat_factor } = list;
    bytes(i)
        + bytes(j)
        + bytes(species_i)
        + bytes(species_j)
        + d.iter().map(bytes).sum::<usize>()
        + bytes(r)
        + bytes(factor)
        + bytes(thermostat_factor)
}

impl Reference {
    /// Bytes held in arrays over particles and pairs, without the cells of the search.
    pub fn memory(&self) -> usize {
        list_bytes(self.pairs.force())
            + list_bytes(self.pairs.density_only())
            + bytes(&self.species)
            + bytes(&self.densities)
            + bytes(&self.excess)
            + bytes(&self.slopes)
            + bytes(&self.particle_energy)
            + bytes(&self.particle_virial)
    }
}
