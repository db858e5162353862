//! The pairs of a plane of cells.

use super::super::workspace::CellOrder;
use psidpd_passes::plane::list::PairList;
use std::ops::Range;

/// The pairs whose first particle is in one plane; the second is in the same plane or in the next.
#[derive(Debug, Clone, Default)]
pub struct PlanePairs {
    /// The sorted particles of this plane, and of the next one.
    pub own: Range<usize>,
    pub next: Range<usize>,
    pub list: PairList,
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
}

impl AsMut<PlanePairs> for PlanePairs {
    fn as_mut(&mut self) -> &mut PlanePairs {
        self
    }
}
