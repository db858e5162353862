//! The region of the sweep, and its cells.

use super::workspace::{Input, extremes};
use crate::engine::error::EngineError;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_threads::Pool;

/// Whether no direction is periodic: then the edges do not matter.
pub fn is_open(domain: &PeriodicBox, dimensions: usize) -> bool {
    !domain.periodic()[..dimensions].iter().any(|p| *p)
}

/// Whether open directions of a box geometry can be extended; a box that is skew along an open direction cannot.
pub fn can_stretch(geometry: &BoxGeometry) -> bool {
    geometry.is_fully_periodic() || !geometry.is_tilted()
}

/// The region in which a sweep searches pairs within `cutoff`, and its cells: all of the box along periodic
/// directions, and along the others the extent of the particles, with room for ghosts within reach.
pub fn region(
    set: InstructionSet,
    pool: &Pool,
    (dimensions, cutoff): (usize, f64),
    domain: &PeriodicBox,
    input: &Input,
) -> Result<(BoxGeometry, CellGrid), EngineError> {
    let mut geometry = BoxGeometry::of_box(domain, dimensions);
    if geometry.is_none_or(|geometry| !geometry.is_fully_periodic()) {
        let margin = if input.particles.owned < input.particles.x.len() { cutoff } else { 0.0 };
        let [low, high] = extremes(pool, set, input)?;
        let (low, high) = (low.map(|x| x - margin), high.map(|x| x + margin));
        geometry = match is_open(domain, dimensions) {
            true => Some(BoxGeometry::enclosing(low, high, dimensions, cutoff)),
            false => geometry.filter(can_stretch).map(|geometry| geometry.stretched(low, high, cutoff)),
        };
    }
    let count = input.particles.x.len();
    let grid =
        geometry.and_then(|geometry| CellGrid::new(&geometry, cutoff, count).map(|grid| (geometry, grid)));
    grid.ok_or(EngineError::Host("the box is too narrow or too skew for a sweep without ghost images"))
}
