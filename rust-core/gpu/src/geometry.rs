//! The box in fixed-point coordinates, and its cells.

use crate::{GpuError, Unsupported};
use psidpd_core::engine::PeriodicBox;

/// Most cells along a direction, for the 20 leading bits of coordinates decide.
const MOST_CELLS: f64 = 4096.0;

/// Fixed-point coordinates of a box: 32 bits along periods, 31 between walls, so that no difference overflows.
#[derive(Debug, Clone)]
pub struct Geometry {
    domain: PeriodicBox,
    dimensions: usize,
    walls: [bool; 3],
    pub is_tilted: bool,
}

impl Geometry {
    pub fn new(domain: &PeriodicBox, dimensions: usize, cutoff: f64) -> Result<Geometry, GpuError> {
        let domain = domain.clone();
        let walls = [0, 1, 2].map(|k| k < dimensions && !domain.periodic()[k]);
        let is_tilted = (0..3).any(|k| (0..3).any(|c| c != k && domain.edge(k)[c] != 0.0));
        let refuse = |what: &str| Err(GpuError::Unsupported(Unsupported { what: what.to_owned() }));
        if is_tilted && walls.contains(&true) {
            return refuse("walls in a tilted box");
        }
        if (0..dimensions).any(|k| !walls[k] && domain.height(k) < 2.0 * cutoff * (1.0 - 1e-12)) {
            return refuse("a box narrower than twice the cutoff along a period");
        }
        Ok(Geometry { domain, dimensions, walls, is_tilted })
    }

    /// Number of units along an edge.
    fn units(&self, k: usize) -> f64 {
        if self.walls[k] { 2f64.powi(31) } else { 2f64.powi(32) }
    }

    /// Cells along each direction, about as many as particles at most.
    pub fn cells(&self, cutoff: f64, count: usize) -> [u32; 3] {
        let along = |k: usize| {
            if k >= self.dimensions {
                return 1;
            }
            // A cell boundary is off by 2⁻²⁰ of the edge at most.
            let height = self.domain.height(k);
            let most = (height / (cutoff.max(height * 1e-9) * (1.0 + 1e-6) + height / 2f64.powi(20))).floor();
            most.clamp(1.0, MOST_CELLS) as u32
        };
        let mut cells = [along(0), along(1), along(2)];
        let limit = 8 * count as u64 + 4096;
        while cells.iter().map(|n| u64::from(*n)).product::<u64>() > limit {
            let longest = (0..3).max_by_key(|k| cells[*k]).unwrap_or(0);
            cells[longest] = cells[longest] / 2 + cells[longest] % 2;
        }
        cells
    }

    pub fn walls(&self) -> [u32; 3] {
        self.walls.map(u32::from)
    }

    /// Columns that turn differences of coordinates into vectors.
    pub fn edges(&self) -> [[f32; 4]; 3] {
        [0, 1, 2].map(|k| {
            let [x, y, z] = self
                .domain
                .edge(k)
                .map(|e| if k < self.dimensions { (e / self.units(k)) as f32 } else { 0.0 });
            [x, y, z, 0.0]
        })
    }

    /// Rows that turn vectors into differences of coordinates.
    pub fn rows(&self) -> [[f32; 4]; 3] {
        let inverse = self.domain.inverse();
        [0, 1, 2].map(|k| {
            let [x, y, z] = inverse[k].map(|e| (e * self.units(k)) as f32);
            [x, y, z, 0.0]
        })
    }

    /// Coordinates of a point, and the boxes that they are away; `None` beyond a wall.
    pub fn coordinates(&self, x: [f64; 3]) -> Option<([u32; 3], [i32; 3])> {
        let fraction = self.domain.fraction(x);
        let (mut s, mut boxes) = ([0; 3], [0; 3]);
        for k in 0..3 {
            let at = (fraction[k] * self.units(k)).round();
            if self.walls[k] {
                if !(-1.0..=self.units(k) + 1.0).contains(&at) {
                    return None;
                }
                s[k] = at.clamp(0.0, self.units(k) - 1.0) as u32;
            } else {
                if at.abs() > 1e18 || at.is_nan() {
                    return None;
                }
                s[k] = at as i64 as u32;
                boxes[k] = i32::try_from(at as i64 >> 32).ok()?;
            }
        }
        Some((s, boxes))
    }

    pub fn point(&self, s: [u32; 3]) -> [f64; 3] {
        self.domain.point([0, 1, 2].map(|k| f64::from(s[k]) / self.units(k)))
    }
}
