//! The pairs of a plane of cells.

use super::super::workspace::CellOrder;
use psidpd_passes::plane::list::{Listed, pairs_of_each};
use std::ops::Range;

/// The pairs whose first particle is in one plane; the second is in the same plane or in the next, or a ghost of any plane.
#[derive(Debug, Clone, Default)]
pub struct PlanePairs {
    /// The sorted particles of this plane, and of the next one.
    pub own: Range<usize>,
    pub next: Range<usize>,
    pub lists: Listed,
}

impl PlanePairs {
    /// Sets the particles of a plane of cells.
    pub fn lie_in(&mut self, cells: &CellOrder, plane: usize) {
        let (next, count) = (plane + 1, cells.grid.planes);
        let next = if next < count { next } else { 0 };
        let follows = next > 0 || cells.is_periodic();
        self.own = cells.particles_of(&(plane..plane + 1));
        self.next = if follows { cells.particles_of(&(next..next + 1)) } else { 0..0 };
    }

    /// Calls `visit` with what [`PlanePairs::pairs`] gives, in a loop that the compiler can see through.
    #[inline(always)]
    pub fn for_each_pair(&self, mut visit: impl FnMut([usize; 3])) {
        let PlanePairs { own, next, lists } = self;
        for (i, of_i) in pairs_of_each(&lists.own.start) {
            for k in of_i {
                let j = lists.own.second(k);
                let second = if j < own.len() { own.start + j } else { next.start + (j - own.len()) };
                visit([own.start + i, second, k]);
            }
        }
    }

    /// The sorted indices of the two particles of each pair without a ghost, and the index of the pair in its list.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 3]> {
        let PlanePairs { own, next, lists } = self;
        let second = |j: usize| j.checked_sub(own.len()).map_or(own.start + j, |k| next.start + k);
        pairs_of_each(&lists.own.start)
            .flat_map(move |(i, of_i)| of_i.map(move |k| [own.start + i, second(lists.own.second(k)), k]))
    }
}
