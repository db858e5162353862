//! The region of the sweep, and its cells.

use super::workspace::{Input, extremes};
use crate::engine::error::EngineError;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use psidpd_passes::ground::fixed_point::FixedPoint16;
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

/// The error of a box that a sweep cannot do.
pub const UNFIT: EngineError =
    EngineError::Host("the box is too narrow, too long or too skew for a sweep without ghost images");

/// The place of a sweep, before it has cells.
#[derive(Debug, Clone, Copy)]
pub struct Region {
    pub geometry: BoxGeometry,
    /// The extent of the owned particles, if some direction is open.
    owned: [[f64; 3]; 2],
}

/// Positions of pairs are fractions of the region in units of 2⁻³²: in a region that extends over this many cutoffs they are as exact as
/// single precision is within a cutoff.
const LONG: f64 = 8192.0;

impl Region {
    /// Whether the region is so long that pairs within `cutoff` have to be computed in double precision.
    pub fn is_long(&self, cutoff: f64) -> bool {
        self.geometry.extent() > LONG * cutoff
    }

    /// The cells for pairs within `cutoff`; directions that are open are stretched as they need.
    ///
    /// # Errors
    /// Fails for a region that is too narrow or too long.
    pub fn cells(self, cutoff: f64, count: usize) -> Result<(BoxGeometry, CellGrid), EngineError> {
        let Region { mut geometry, owned } = self;
        let mut grid = grid_of(&mut geometry, cutoff, count).ok_or(UNFIT)?;
        grid.interior = interior(&geometry, &grid, owned.map(|ends| ends[0]));
        Ok((geometry, grid))
    }
}

/// A pair that the distance filter passes at more than this many cutoffs may be near another image too.
const CLOSE: f64 = 1.05;

/// Most cells, 64 MiB of numbers for each thread, where more than usual are needed.
const MOST_CELLS: usize = 1 << 24;

/// The grid of a region. Where cells are wide, as a few particles are far away, the distance filter passes pairs that are much
/// further apart than the cutoff. The difference of their fractions would wrap in an open direction of half that width, which
/// is stretched; along a period such a pair would be found with another image too, unless cells are narrower.
fn grid_of(geometry: &mut BoxGeometry, cutoff: f64, count: usize) -> Option<CellGrid> {
    let mut most = 4 * count + 64;
    loop {
        let grid = CellGrid::with_cells(geometry, cutoff, count, most)?;
        let reach = FixedPoint16::new(geometry, &grid).reach();
        let axes = 0..geometry.dimensions;
        let (closed, open): (Vec<usize>, Vec<usize>) = axes.partition(|k| geometry.periodic[*k]);
        let narrow = closed.into_iter().any(|k| reach > (CLOSE * cutoff).max(geometry.height(k) - cutoff));
        if narrow {
            most *= 4;
            if most > MOST_CELLS {
                return None;
            }
            continue;
        }
        let short: Vec<usize> = open.into_iter().filter(|k| geometry.length[*k] < 2.0 * reach).collect();
        if short.is_empty() {
            return Some(grid);
        }
        short.into_iter().for_each(|k| geometry.length[k] = 2.5 * reach);
    }
}

/// The region in which a sweep searches pairs within `cutoff`: all of the box along periodic
/// directions, and along the others the extent of the particles, with room for ghosts within reach.
pub fn region(
    set: InstructionSet,
    pool: &Pool,
    (dimensions, cutoff): (usize, f64),
    domain: &PeriodicBox,
    input: &Input,
) -> Result<Region, EngineError> {
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
    Ok(Region { geometry: geometry.ok_or(UNFIT)?, owned })
}
