//! Particles sorted into cells, for particles that move one by one, and for the neighbours of a few particles.

use crate::engine::vectors::{self, Loop};
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::instruction_set::InstructionSet;

/// Number of particles in a block.
const LANES: usize = 8;

/// Most cells per particle: empty cells cost time too.
const MOST_PER_PARTICLE: f64 = 4.0;

/// Particles of a cell; unused places have infinite coordinates.
#[derive(Debug, Clone, Copy)]
struct Block {
    x: [[f64; LANES]; 3],
    id: [u32; LANES],
}

impl Block {
    const EMPTY: Block = Block { x: [[f64::INFINITY; LANES]; 3], id: [u32::MAX; LANES] };

    fn put(&mut self, lane: usize, id: u32, x: [f64; 3]) {
        self.id[lane] = id;
        (0..3).for_each(|c| self.x[c][lane] = x[c]);
    }
}

/// Cells at least as wide as the range; along open directions the outer cells extend to infinity.
#[derive(Debug, Clone)]
pub struct Cells {
    pub(super) domain: PeriodicBox,
    edges: [[f64; 3]; 3],
    periodic: [bool; 3],
    dimensions: usize,
    range: f64,
    /// Number of cells in each direction.
    count: [i32; 3],
    /// Largest distance, in cells, of another cell within range.
    reach: [i32; 3],
    cells: Vec<Vec<Block>>,
    /// Number of particles in each cell.
    filled: Vec<u32>,
    /// Cell of each particle, and its place in the cell.
    place: Vec<[u32; 2]>,
}

/// Particles within the range of one of two points.
#[derive(Debug, Clone, Default)]
pub struct Near {
    /// Number of particles found.
    pub count: usize,
    /// Their numbers, in the order of [`Cells::fill`].
    pub id: Vec<u32>,
    /// Distances from the first point and from the second; until the roots are taken, their squares.
    pub r: [Vec<f64>; 2],
    /// Whether a particle may be listed more than once.
    pub(super) repeats: bool,
}

impl Cells {
    /// Empty cells for so many particles.
    pub fn new(domain: &PeriodicBox, dimensions: usize, range: f64, particles: usize) -> Cells {
        let heights = [0, 1, 2].map(|k| domain.height(k));
        let most = MOST_PER_PARTICLE * particles as f64 + 64.0;
        // If a cell is as wide as the range, to rounding, the next cell but one is out of range.
        const ROUNDING: f64 = 1e-12;
        let counts = |width: f64| {
            let count = |k: usize| match k < dimensions {
                true => (heights[k] / width * (1.0 + ROUNDING)).floor().max(1.0),
                false => 1.0,
            };
            [count(0), count(1), count(2)]
        };
        let shortest = heights[..dimensions].iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let mut width = if range > 0.0 { range } else { shortest };
        while counts(width).iter().product::<f64>() > most {
            width *= 1.1;
        }
        let count = counts(width).map(|count| count as i32);
        let reach = [0, 1, 2].map(|k| match k < dimensions {
            true => (range * f64::from(count[k]) / heights[k] * (1.0 - ROUNDING)).ceil() as i32,
            false => 0,
        });
        let total = count.iter().map(|count| *count as usize).product();
        Cells {
            edges: [0, 1, 2].map(|k| domain.edge(k)),
            periodic: [0, 1, 2].map(|k| k < dimensions && domain.periodic()[k]),
            domain: domain.clone(),
            dimensions,
            range,
            count,
            reach,
            cells: vec![Vec::new(); total],
            filled: vec![0; total],
            place: Vec::new(),
        }
    }

    /// Sorts particles at `x`, which are inside along periodic directions, into cells.
    pub fn fill(&mut self, x: &[[f64; 3]]) {
        self.filled.fill(0);
        self.cells.iter_mut().for_each(Vec::clear);
        self.place.clear();
        for (id, x) in x.iter().enumerate() {
            let cell = self.cell(*x);
            self.place.push([0; 2]);
            self.insert(id as u32, *x, cell);
        }
    }

    /// Moves a particle to `x`, inside along periodic directions.
    pub(super) fn change(&mut self, id: usize, x: [f64; 3]) {
        let ([from, place], to) = (self.place[id], self.cell(x));
        if from as usize == to {
            let x = self.flat(x);
            return self.cells[to][place as usize / LANES].put(place as usize % LANES, id as u32, x);
        }
        // The last particle fills the place of the moved one.
        let blocks = &mut self.cells[from as usize];
        self.filled[from as usize] -= 1;
        let (place, last) = (place as usize, self.filled[from as usize] as usize);
        let (block, lane) = (blocks[last / LANES], last % LANES);
        blocks[place / LANES].put(place % LANES, block.id[lane], [0, 1, 2].map(|c| block.x[c][lane]));
        blocks[last / LANES].put(lane, u32::MAX, [f64::INFINITY; 3]);
        self.place[block.id[lane] as usize][1] = place as u32;
        if lane == 0 {
            blocks.pop();
        }
        self.insert(id as u32, x, to);
    }

    fn insert(&mut self, id: u32, x: [f64; 3], cell: usize) {
        let (place, x) = (self.filled[cell] as usize, self.flat(x));
        if place.is_multiple_of(LANES) {
            // Vectors would begin with room for four.
            self.cells[cell].reserve_exact(1);
            self.cells[cell].push(Block::EMPTY);
        }
        self.cells[cell][place / LANES].put(place % LANES, id, x);
        self.filled[cell] += 1;
        self.place[id as usize] = [cell as u32, place as u32];
    }

    /// The point without the coordinate that a two-dimensional fluid ignores.
    fn flat(&self, x: [f64; 3]) -> [f64; 3] {
        if self.dimensions == 2 { [x[0], x[1], 0.0] } else { x }
    }

    /// The cell of a point in each direction; a point outside the box along a periodic direction has that of an image.
    fn coordinates(&self, x: [f64; 3]) -> [i32; 3] {
        let s = self.domain.fraction(x);
        [0, 1, 2].map(|k| {
            let cell = (s[k] * f64::from(self.count[k])).floor() as i32;
            if self.periodic[k] { cell } else { cell.clamp(0, self.count[k] - 1) }
        })
    }

    fn cell(&self, x: [f64; 3]) -> usize {
        let c = self.coordinates(x);
        let c = [0, 1, 2].map(|k| c[k].clamp(0, self.count[k] - 1) as usize);
        let [nx, ny, _] = self.count.map(|count| count as usize);
        c[0] + nx * (c[1] + ny * c[2])
    }

    /// Finds the particles within the range of a point that is inside along periodic directions, with squares of distances.
    pub fn around(&self, x: [f64; 3], near: &mut Near) {
        self.near(InstructionSet::best(), [x; 2], None, near);
    }

    /// Finds the particles within the range of `from`, which is inside along periodic directions, or of
    /// `to`, which may be outside; leaves out the particle `but`.
    pub(super) fn near(
        &self,
        set: InstructionSet,
        [from, to]: [[f64; 3]; 2],
        but: Option<usize>,
        near: &mut Near,
    ) {
        let (a, b) = (self.coordinates(from), self.coordinates(to));
        let mut ends = [[0; 2]; 3];
        near.repeats = false;
        for k in 0..3 {
            let (low, high) = (a[k].min(b[k]) - self.reach[k], a[k].max(b[k]) + self.reach[k]);
            let last = self.count[k] - 1;
            ends[k] = if self.periodic[k] { [low, high] } else { [low.max(0), high.min(last)] };
            near.repeats |= self.periodic[k] && high - low > last;
        }
        near.count = 0;
        let points = [self.flat(from), self.flat(to)];
        vectors::run(
            set,
            Search { cells: self, points, ends, but: but.map_or(u32::MAX, |but| but as u32), near },
        );
    }
}

/// Searches all blocks of a range of cells.
struct Search<'a> {
    cells: &'a Cells,
    points: [[f64; 3]; 2],
    ends: [[i32; 2]; 3],
    but: u32,
    near: &'a mut Near,
}

impl Loop for Search<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Search { cells, points: [a, b], ends, but, near } = self;
        let square = cells.range * cells.range;
        let [nx, ny, _] = cells.count.map(|count| count as usize);
        for z in ends[2][0]..=ends[2][1] {
            let (z, boxes) = inside(z, cells.count[2]);
            let points = moved([a, b], &cells.edges[2], boxes);
            for y in ends[1][0]..=ends[1][1] {
                let (y, boxes) = inside(y, cells.count[1]);
                let points = moved(points, &cells.edges[1], boxes);
                for x in ends[0][0]..=ends[0][1] {
                    let (x, boxes) = inside(x, cells.count[0]);
                    let points = moved(points, &cells.edges[0], boxes);
                    for block in &cells.cells[x + nx * (y + ny * z)] {
                        look(block, &points, square, but, near);
                    }
                }
            }
        }
    }
}

/// The cell in the box of which `cell` is an image, and the number of boxes between the two.
#[inline(always)]
fn inside(mut cell: i32, count: i32) -> (usize, f64) {
    let mut boxes = 0;
    while cell < 0 {
        (cell, boxes) = (cell + count, boxes - 1);
    }
    while cell >= count {
        (cell, boxes) = (cell - count, boxes + 1);
    }
    (cell as usize, f64::from(boxes))
}

/// Moves the points instead of the particles of an image, by the opposite shift.
#[inline(always)]
fn moved(mut points: [[f64; 3]; 2], edge: &[f64; 3], boxes: f64) -> [[f64; 3]; 2] {
    if boxes != 0.0 {
        for point in &mut points {
            (0..3).for_each(|c| point[c] -= boxes * edge[c]);
        }
    }
    points
}

/// Adds the particles of a block that are near one of two points.
#[inline(always)]
fn look(block: &Block, points: &[[f64; 3]; 2], square: f64, but: u32, near: &mut Near) {
    let mut r = [[0.0; LANES]; 2];
    for (r, p) in r.iter_mut().zip(points) {
        for l in 0..LANES {
            let (x, y, z) = (p[0] - block.x[0][l], p[1] - block.x[1][l], p[2] - block.x[2][l]);
            r[l] = x * x + y * y + z * z;
        }
    }
    let mut found = 0u32;
    for l in 0..LANES {
        found |= u32::from((r[0][l] < square) | (r[1][l] < square)) << l;
    }
    if near.id.len() < near.count + LANES {
        near.grow();
    }
    while found != 0 {
        let l = found.trailing_zeros() as usize % LANES;
        found &= found - 1;
        near.id[near.count] = block.id[l];
        near.r[0][near.count] = r[0][l];
        near.r[1][near.count] = r[1][l];
        near.count += usize::from(block.id[l] != but);
    }
}

impl Near {
    #[cold]
    fn grow(&mut self) {
        let room = 2 * self.id.len() + 16 * LANES;
        self.id.resize(room, 0);
        self.r.iter_mut().for_each(|r| r.resize(room, 0.0));
    }
}
