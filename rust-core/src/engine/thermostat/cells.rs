//! Particles sorted into cells: planes of columns of bins.
//!
//! Columns are no narrower than the range, so that half of a particle's neighbours are in its own column, in
//! four others, and nowhere else; bins along a column are narrower, which spares candidates. Within a bin
//! particles are in the order of their tags: the whole order depends on positions and tags alone.

use super::bodies::Bodies;
use crate::engine::error::EngineError;
use crate::engine::sweep::{Pool, part};

/// Bins in the length of the range.
const FINE: usize = 2;

/// Most cells for each particle: in open space there may be many empty ones.
const SPARSE: usize = 16;

/// Particles by cells.
#[derive(Debug, Clone, Default)]
pub struct Cells {
    /// Directions of the box along bins, columns and planes.
    axes: [usize; 3],
    /// How many there are along each.
    count: [usize; 3],
    periodic: [bool; 3],
    edges: [[f64; 3]; 3],
    /// The first particle of each cell; one past the last.
    start: Vec<u32>,
    cell_of: Vec<u32>,
    /// Index of the host by sorted index.
    pub order: Vec<u32>,
    /// Sorted index by index of the host.
    pub place: Vec<u32>,
    /// Coordinates, sorted.
    pub x: [Vec<f64>; 3],
    /// Tags, sorted.
    pub tag: Vec<u32>,
    /// Species, sorted.
    pub species: Vec<u8>,
}

/// A run of sorted particles that may be near, seen at a shift of the box.
#[derive(Debug, Clone, Copy, Default)]
pub struct Segment {
    pub first: usize,
    pub end: usize,
    pub shift: [f64; 3],
    /// What makes a sorted index one of a plane and the next.
    pub offset: isize,
}

impl Cells {
    /// How many planes there are.
    pub fn planes(&self) -> usize {
        self.count[2]
    }

    /// The sorted particles of a plane.
    pub fn of_plane(&self, plane: usize) -> std::ops::Range<usize> {
        let size = self.count[0] * self.count[1];
        self.start[plane * size] as usize..self.start[(plane + 1) * size] as usize
    }

    /// The plane above another.
    pub fn next(&self, plane: usize) -> Option<usize> {
        let wraps = self.periodic[2] && self.count[2] > 1;
        if plane + 1 < self.count[2] { Some(plane + 1) } else { wraps.then_some(0) }
    }

    /// Sorts particles for pairs within `range`.
    pub fn sort(
        &mut self,
        pool: &Pool,
        bodies: &Bodies,
        dimensions: usize,
        range: f64,
    ) -> Result<(), EngineError> {
        let (domain, n) = (bodies.domain, bodies.x.len());
        let flat = dimensions == 2;
        self.axes = if flat { [0, 2, 1] } else { [0, 1, 2] };
        for (along, axis) in self.axes.into_iter().enumerate() {
            let unused = flat && axis == 2;
            self.periodic[along] = domain.periodic()[axis] && !unused;
            self.edges[along] = domain.edge(axis);
            let height = domain.height(axis);
            // Heights come from an inverse matrix: leave room for its rounding.
            if self.periodic[along] && height < 2.0 * range * (1.0 - 1e-12) {
                return Err(EngineError::Host("a box narrower than twice the range of its thermostat"));
            }
            let width = if along == 0 { range / FINE as f64 } else { range };
            let least = if self.periodic[along] { if along == 0 { 2 * FINE } else { 2 } } else { 1 };
            let most = (height / width * (1.0 + 1e-12)).min(1e6) as usize;
            self.count[along] = if unused { 1 } else { most.max(least) };
        }
        while self.count.iter().product::<usize>() > SPARSE * n + 64 {
            // Wider cells find the same pairs.
            let widest = (0..3).max_by_key(|k| self.count[*k]).unwrap_or(0);
            let least = if self.periodic[widest] { if widest == 0 { 2 * FINE } else { 2 } } else { 1 };
            if self.count[widest] / 2 < least {
                break;
            }
            self.count[widest] /= 2;
        }
        self.find_cells(pool, bodies)?;
        self.place(bodies, flat);
        Ok(())
    }

    fn find_cells(&mut self, pool: &Pool, bodies: &Bodies) -> Result<(), EngineError> {
        let (domain, n) = (bodies.domain, bodies.x.len());
        self.cell_of.resize(n, 0);
        let (axes, count) = (self.axes, self.count);
        let (mut rest, threads) = (&mut self.cell_of[..], pool.threads());
        let mut parts: Vec<_> = (0..threads)
            .map(|number| {
                let range = part(n, number, threads);
                (
                    rest.split_off_mut(..range.len()).unwrap_or_default(),
                    &bodies.x[range.clone()],
                    range.start,
                    None,
                )
            })
            .collect();
        pool.each(&mut parts, |(cell_of, x, first, lost)| {
            for (k, (cell, x)) in cell_of.iter_mut().zip(*x).enumerate() {
                let s = domain.fraction(*x);
                if !(s[0] + s[1] + s[2]).is_finite() && lost.is_none() {
                    *lost = Some(*first + k);
                }
                let at = |along: usize| {
                    // Conversions saturate: whoever is outside is counted to the last cell on that side.
                    ((s[axes[along]] * count[along] as f64) as usize).min(count[along] - 1)
                };
                *cell = ((at(2) * count[1] + at(1)) * count[0] + at(0)) as u32;
            }
        });
        match parts.iter().find_map(|part| part.3) {
            Some(k) => Err(EngineError::Position { tag: bodies.tag[k] }),
            None => Ok(()),
        }
    }

    /// Puts particles into the order of cells, and of tags within them.
    fn place(&mut self, bodies: &Bodies, flat: bool) {
        let (n, total) = (bodies.x.len(), self.count.iter().product::<usize>());
        self.start.clear();
        self.start.resize(total + 1, 0);
        for cell in &self.cell_of {
            self.start[*cell as usize + 1] += 1;
        }
        for cell in 0..total {
            self.start[cell + 1] += self.start[cell];
        }
        self.order.resize(n, 0);
        // From behind, so that the end of each cell becomes its beginning.
        for k in (0..n).rev() {
            let end = &mut self.start[self.cell_of[k] as usize + 1];
            *end -= 1;
            self.order[*end as usize] = k as u32;
        }
        self.start.remove(0);
        self.start.push(n as u32);
        for ends in self.start.windows(2).filter(|ends| ends[1] - ends[0] > 1) {
            let cell = &mut self.order[ends[0] as usize..ends[1] as usize];
            cell.sort_unstable_by_key(|k| bodies.tag[*k as usize]);
        }
        self.place.resize(n, 0);
        for (sorted, k) in self.order.iter().enumerate() {
            self.place[*k as usize] = sorted as u32;
        }
        for c in 0..3 {
            self.x[c].clear();
            let planar = flat && c == 2;
            self.x[c].extend(self.order.iter().map(|k| if planar { 0.0 } else { bodies.x[*k as usize][c] }));
        }
        self.tag.clear();
        self.tag.extend(self.order.iter().map(|k| bodies.tag[*k as usize] as u32));
        self.species.clear();
        self.species.extend(self.order.iter().map(|k| bodies.species[*k as usize] as u8));
    }

    /// How many columns a plane has, and how many bins a column.
    pub fn columns(&self) -> [usize; 2] {
        [self.count[1], self.count[0]]
    }

    /// The particles of a bin. `segments` becomes where those behind them in half of their neighbourhood are; the
    /// first segment begins with the bin itself.
    pub fn look_from(
        &self,
        plane: usize,
        column: usize,
        bin: usize,
        segments: &mut Vec<Segment>,
    ) -> std::ops::Range<usize> {
        let base = (plane * self.count[1] + column) * self.count[0];
        let cell = self.start[base + bin] as usize..self.start[base + bin + 1] as usize;
        segments.clear();
        if cell.is_empty() {
            return cell;
        }
        let own = self.of_plane(plane);
        let offset = -(own.start as isize);
        let (first, last) = (bin as isize - FINE as isize, (bin + FINE) as isize);
        self.along(base, [bin as isize, last], [0.0; 3], offset, segments);
        let (y, bins) = (column as isize, [first, last]);
        if let Some((column, shift)) = self.wrapped(y + 1, 1) {
            let base = (plane * self.count[1] + column) * self.count[0];
            self.along(base, bins, shift, offset, segments);
        }
        if let Some(next) = self.next(plane) {
            let up = if next > plane { [0.0; 3] } else { self.edges[2] };
            let offset = own.len() as isize - self.of_plane(next).start as isize;
            for aside in [-1, 0, 1] {
                if let Some((column, shift)) = self.wrapped(y + aside, 1) {
                    let base = (next * self.count[1] + column) * self.count[0];
                    let shift = std::array::from_fn(|c| shift[c] + up[c]);
                    self.along(base, bins, shift, offset, segments);
                }
            }
        }
        cell
    }

    /// Where number `k` along an axis is, with the shift of the box that it is seen at.
    fn wrapped(&self, k: isize, along: usize) -> Option<(usize, [f64; 3])> {
        let count = self.count[along] as isize;
        if (0..count).contains(&k) {
            return Some((k as usize, [0.0; 3]));
        }
        let boxes = if k < 0 { -1.0 } else { 1.0 };
        self.periodic[along].then(|| ((k.rem_euclid(count)) as usize, self.edges[along].map(|e| boxes * e)))
    }

    /// The bins of a column from the first to the last given, in up to three segments.
    fn along(
        &self,
        base: usize,
        [first, last]: [isize; 2],
        shift: [f64; 3],
        offset: isize,
        segments: &mut Vec<Segment>,
    ) {
        let count = self.count[0] as isize;
        for boxes in [0, 1, -1] {
            let leaves = (boxes == 1 && last >= count) || (boxes == -1 && first < 0);
            if boxes != 0 && !(leaves && self.periodic[0]) {
                continue;
            }
            let (from, to) = ((first - boxes * count).max(0), (last - boxes * count).min(count - 1));
            if from > to {
                continue;
            }
            let (first, end) =
                (self.start[base + from as usize] as usize, self.start[base + to as usize + 1] as usize);
            let shift = std::array::from_fn(|c| shift[c] + boxes as f64 * self.edges[0][c]);
            segments.push(Segment { first, end, shift, offset });
        }
    }
}
