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

/// A column of which owned particles have at most this fraction is not made for them: the others are wider instead.
const SMALL_PART: f64 = 0.2;

/// The extent of owned particles and of the ghosts near them: so many columns and planes, hardly wider than the cutoff, that
/// the first and the last have ghosts alone.
fn with_margins([low, high]: [[f64; 3]; 2], cutoff: f64) -> [[f64; 3]; 2] {
    let (mut from, mut to) = (low, high);
    for c in 0..3 {
        let extent = high[c] - low[c];
        let columns = (extent / cutoff - SMALL_PART).ceil().max(1.0);
        let width = cutoff.max(extent / columns);
        (from[c], to[c]) = (low[c] - width, low[c] + (columns + 1.0) * width);
    }
    [from, to]
}

/// The cells along x in which ghosts of a rank are beside or above its owned particles only, if these reach from
/// `owned[0]` to `owned[1]`. A ghost may have come half a cell further since its rank has sent it.
fn interior(geometry: &BoxGeometry, grid: &CellGrid, owned: [f64; 2]) -> [usize; 2] {
    let all = grid.cells_per_column;
    if geometry.periodic[0] {
        return [0, all];
    }
    let [first, last] = owned.map(|x| (x - geometry.origin[0]) / geometry.length[0] * all as f64);
    // The conversion clamps numbers that are no cell.
    let from = ((first + 1.5) as usize).min(all);
    [from, ((last - 0.5) as usize).clamp(from, all)]
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
    let mut owned = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
    if geometry.is_none_or(|geometry| !geometry.is_fully_periodic()) {
        owned = extremes(pool, set, input)?;
        let [low, high] = if input.has_ghosts() { with_margins(owned, cutoff) } else { owned };
        geometry = match is_open(domain, dimensions) {
            true => Some(BoxGeometry::enclosing(low, high, dimensions, cutoff)),
            false => geometry.filter(can_stretch).map(|geometry| geometry.stretched(low, high, cutoff)),
        };
    }
    let count = input.particles.x.len();
    let grid =
        geometry.and_then(|geometry| CellGrid::new(&geometry, cutoff, count).map(|grid| (geometry, grid)));
    let grid = grid.map(|(geometry, mut grid)| {
        grid.interior = interior(&geometry, &grid, owned.map(|ends| ends[0]));
        (geometry, grid)
    });
    grid.ok_or(EngineError::Host("the box is too narrow or too skew for a sweep without ghost images"))
}
