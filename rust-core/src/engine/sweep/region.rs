//! The region that is swept, and its cells.

use super::workspace::{Input, extremes};
use crate::engine::error::EngineError;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_threads::Pool;

/// Whether no direction is periodic: then edges do not matter.
pub fn is_open(domain: &PeriodicBox, dimensions: usize) -> bool {
    !domain.periodic()[..dimensions].iter().any(|p| *p)
}

/// Whether a box geometry is still one when open directions are as long as they have to be: what leans along one is none.
pub fn can_stretch(geometry: &BoxGeometry) -> bool {
    geometry.is_fully_periodic() || !geometry.is_tilted()
}

/// The region to be swept for pairs within `cutoff`, and its cells: all of the box along its periodic directions, along
/// the others what the particles span, with room for ghosts within reach of them.
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
    grid.ok_or(EngineError::Host("the box is too narrow, or leans, for a sweep without images as ghosts"))
}
