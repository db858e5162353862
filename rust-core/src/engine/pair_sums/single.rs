//! Computes a single pair, for hosts that ask for one.

use super::PairSums;
use super::forces::{Block, ForceInput};
use super::pairs::PairList;

impl PairSums {
    /// Pair energy, and conservative force along `ê_ij`, of the particles `i` and `j` at the distance `r`, with the given
    /// types and the slopes of an evaluation, [`Plan::slope_width`](crate::engine::Plan::slope_width) for each particle.
    ///
    /// The energy is that of the terms that belong to pairs: `φ`, and ψ where it is linear in a
    /// density. The force includes the many-body part, except for particles without slopes.
    pub fn single(&self, kinds: [i32; 2], r: f64, slopes: &[f64], particles: [usize; 2]) -> (f64, f64) {
        let types = &self.plan.species_of_type;
        let species = kinds.map(|k| usize::try_from(k).ok().and_then(|k| types.get(k)).copied());
        let [Some(a), Some(b)] = species else { return (0.0, 0.0) };
        if a < 0 || b < 0 {
            return (0.0, 0.0);
        }
        let width = self.plan.slope_width();
        let of = |i: usize| slopes.get(i * width..(i + 1) * width);
        let both = match particles.map(of) {
            [Some(i), Some(j)] => [i, j].concat(),
            _ => vec![0.0; 2 * width],
        };
        let mut list = PairList::default();
        list.push(0, 1, [r, 0.0, 0.0], &[a, b]);
        let input = ForceInput::conservative(&self.plan, &list, 2, &both);
        let mut pair = Block::<1>::new();
        pair.conserve(&input, 0..1, true);
        (pair.excess_i[0] + pair.excess_j[0] + pair.pair[0], pair.conservative[0])
    }
}
