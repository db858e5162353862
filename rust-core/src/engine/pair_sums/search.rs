//! Finds pairs within the cut-off, by cells.

/// Cell search over open space: ghosts and images are points like all others.
///
/// Particles are counting-sorted into cells at least as wide as the cut-off; each is compared with the
/// later particles of its own cell and those of half of the neighbouring cells. Cells are contiguous
/// along x, so that half the stencil is five ranges of the sorted array.
#[derive(Debug, Clone, Default)]
pub struct CellSearch {
    cells: [usize; 3],
    /// First sorted index of each cell, and one past the last.
    start: Vec<u32>,
    cell_of: Vec<u32>,
    /// Original index by sorted index.
    order: Vec<u32>,
    x: [Vec<f64>; 3],
    /// Sorted indices near the current particle; the first `near` of them are valid.
    found: Vec<u32>,
    near: usize,
}

/// The cell of a point that is left out.
const OUTSIDE: u32 = u32::MAX;

impl CellSearch {
    /// Calls `visit` with `a`, `b` and `x_a − x_b` of every pair of points closer than `cutoff`, each once, in an
    /// order that depends on the points alone. One of the two is among the first `owned`, and neither is left out.
    ///
    /// Points that are not left out must have finite coordinates. In two dimensions the third coordinate is ignored.
    pub fn find(
        &mut self,
        x: &[[f64; 3]],
        owned: usize,
        takes_part: impl Fn(usize) -> bool,
        dimensions: usize,
        cutoff: f64,
        mut visit: impl FnMut(usize, usize, [f64; 3]),
    ) {
        if cutoff > 0.0 && self.sort(x, takes_part, dimensions, cutoff) > 0 {
            self.sweep(owned, cutoff, &mut visit);
        }
    }

    /// Sorts points into cells; returns the number of points that are not left out.
    fn sort(
        &mut self,
        x: &[[f64; 3]],
        takes_part: impl Fn(usize) -> bool,
        dimensions: usize,
        cutoff: f64,
    ) -> usize {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        let mut count = 0usize;
        for (_, x) in x.iter().enumerate().filter(|(k, _)| takes_part(*k)) {
            count += 1;
            for c in 0..3 {
                low[c] = low[c].min(x[c]);
                high[c] = high[c].max(x[c]);
            }
        }
        if count == 0 {
            return 0;
        }
        // The number of cells is limited by that of particles: a few distant particles must
        // not cause a grid of empty cells.
        let most = (4 * count + 64) as f64;
        let mut width = [cutoff; 3];
        loop {
            for c in 0..3 {
                let cells = if c < dimensions { ((high[c] - low[c]) / width[c]).floor() } else { 1.0 };
                // An extent beyond all numbers over such a width is NaN, which `max` replaces.
                self.cells[c] = cells.max(1.0).min(most) as usize;
            }
            let total: f64 = self.cells.iter().map(|n| *n as f64).product();
            if total <= most {
                break;
            }
            let widest = (0..3).max_by_key(|c| self.cells[*c]).unwrap_or(0);
            width[widest] *= 2.0;
        }
        let [nx, ny, nz] = self.cells;
        let scale: [f64; 3] = std::array::from_fn(|c| {
            let extent = high[c] - low[c];
            if extent > 0.0 { self.cells[c] as f64 / extent } else { 0.0 }
        });
        let total = nx * ny * nz;
        self.start.clear();
        self.start.resize(total + 1, 0);
        self.cell_of.clear();
        for (k, x) in x.iter().enumerate() {
            if !takes_part(k) {
                self.cell_of.push(OUTSIDE);
                continue;
            }
            let at = |c: usize| (((x[c] - low[c]) * scale[c]) as usize).min(self.cells[c] - 1);
            let cell = (at(2) * ny + at(1)) * nx + at(0);
            self.cell_of.push(cell as u32);
            self.start[cell + 1] += 1;
        }
        (0..total).for_each(|cell| self.start[cell + 1] += self.start[cell]);
        self.order.clear();
        self.order.resize(count, 0);
        for c in 0..3 {
            self.x[c].clear();
            self.x[c].resize(count, 0.0);
        }
        // Filling from the back keeps the order of particles within a cell and turns `start` of each
        // cell, which is now its end, into its beginning.
        for k in (0..x.len()).rev() {
            let cell = self.cell_of[k];
            if cell == OUTSIDE {
                continue;
            }
            let end = &mut self.start[cell as usize + 1];
            *end -= 1;
            let slot = *end as usize;
            self.order[slot] = k as u32;
            for c in 0..3 {
                self.x[c][slot] = if c < dimensions { x[k][c] } else { 0.0 };
            }
        }
        // `start[cell + 1]` is now the start of `cell`: the array moves by one.
        self.start.remove(0);
        self.start.push(count as u32);
        count
    }

    fn sweep(&mut self, owned: usize, cutoff: f64, visit: &mut impl FnMut(usize, usize, [f64; 3])) {
        let [nx, ny, nz] = self.cells;
        let cutoff_squared = cutoff * cutoff;
        let mut windows: [(usize, usize); 5] = [(0, 0); 5];
        for cz in 0..nz {
            for cy in 0..ny {
                // The other rows of half the stencil are (y+1, z), (y−1, z+1), (y, z+1) and (y+1, z+1).
                let rows = [(1, 0), (-1, 1), (0, 1), (1, 1)].map(|(dy, dz): (isize, isize)| {
                    let (y, z) = (cy as isize + dy, cz as isize + dz);
                    let inside = y >= 0 && y < ny as isize && z < nz as isize;
                    inside.then(|| (z as usize * ny + y as usize) * nx)
                });
                let row = (cz * ny + cy) * nx;
                for cx in 0..nx {
                    let (first, last) = (cx.saturating_sub(1), (cx + 1).min(nx - 1));
                    for (window, other) in windows[1..].iter_mut().zip(rows) {
                        *window = other.map_or((0, 0), |base| self.span(base + first, base + last));
                    }
                    let (begin, end) = self.span(row + cx, row + cx);
                    let row_end = self.span(row + cx, row + last).1;
                    for i in begin..end {
                        windows[0] = (i + 1, row_end);
                        self.collect(i, &windows, cutoff_squared);
                        self.tell(i, owned, visit);
                    }
                }
            }
        }
    }

    /// Sorted indices of the cells `first` to `last` of one row.
    fn span(&self, first: usize, last: usize) -> (usize, usize) {
        (self.start[first] as usize, self.start[last + 1] as usize)
    }

    /// Writes the sorted indices in range of `i` to `found`, without a branch for each candidate.
    #[inline(always)]
    fn collect(&mut self, i: usize, windows: &[(usize, usize); 5], cutoff_squared: f64) {
        let candidates: usize = windows.iter().map(|(a, b)| b.saturating_sub(*a)).sum();
        if self.found.len() < candidates {
            self.found.resize(candidates, 0);
        }
        let [x, y, z] = &self.x;
        let (xi, yi, zi) = (x[i], y[i], z[i]);
        let mut count = 0;
        let found = &mut self.found;
        for &(first, last) in windows {
            if first >= last {
                continue;
            }
            let (x, y, z) = (&x[first..last], &y[first..last], &z[first..last]);
            for (offset, ((xj, yj), zj)) in x.iter().zip(y).zip(z).enumerate() {
                let (dx, dy, dz) = (xi - xj, yi - yj, zi - zj);
                let near = dx * dx + dy * dy + dz * dz < cutoff_squared;
                found[count] = (first + offset) as u32;
                count += near as usize;
            }
        }
        self.near = count;
    }

    #[inline(always)]
    fn tell(&self, i: usize, owned: usize, visit: &mut impl FnMut(usize, usize, [f64; 3])) {
        let a = self.order[i] as usize;
        for &j in &self.found[..self.near] {
            let j = j as usize;
            let b = self.order[j] as usize;
            if a < owned || b < owned {
                visit(a, b, std::array::from_fn(|c| self.x[c][i] - self.x[c][j]));
            }
        }
    }
}
