//! The pairs in hand: some hundred, in arrays that stay in the first-level cache.

use super::arithmetic::Own;
use super::chunks::{Chunk, FOUR};
use super::scatter::Sum;
use super::simd::{Scalar, Two};

/// Most particles whose pairs are in hand at once.
pub const GROUP: usize = 16;

/// Sixteen rows of four numbers, aligned so that no vector of them straddles lines of the cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Lines<T>([[T; 4]; 16]);

/// Pairs of a group of particles, in parallel arrays.
#[derive(Debug)]
pub struct Block<T> {
    /// The first particles of the pairs, each once, and where the pairs of each begin, and of the last end.
    pub members: [u32; GROUP],
    pub begin: [u32; GROUP + 1],
    /// The second particle of each pair, in the order of cells.
    pub j: Vec<u32>,
    /// The same, of the first of each four members, of the second …
    pub lists: [Vec<u32>; FOUR],
    /// The first particle of each pair, a number in `own`.
    pub which: Vec<u8>,
    /// A vector's worth of members.
    pub own: Own<T>,
    /// Room for [`Pairs`](super::arithmetic::Pairs) of a precision and instruction set, a vector each.
    pub pairs: Vec<Lines<T>>,
    /// Tags of both particles; then the words of noise are where the first were.
    pub tags: [Vec<u32>; 2],
    /// Rows `fx, fy, fz, −w`.
    pub rows: Vec<Lines<T>>,
    /// Weights, of one density after another.
    pub weight: Vec<Vec<T>>,
    /// Forces along `ê` that are evaluated apart.
    pub conservative: Vec<T>,
    /// How many pairs are within the range of each density.
    pub found: Vec<usize>,
    /// Running sums of the rows.
    pub running: Vec<Sum>,
    /// Work space of pair terms that are evaluated apart.
    pub aside: Aside,
    /// What the members are to be compared with.
    pub chunks: Vec<Chunk>,
    pub chunk_count: usize,
    /// Members that look together: the first, and how many.
    pub fours: [[u8; 2]; GROUP],
    pub four_count: usize,
    /// Where the members are.
    pub points: [Two; 2 * GROUP],
    /// Which of each chunk are within reach.
    pub masks: Vec<u64>,
    capacity: usize,
}

/// Pairs of which potentials are evaluated apart, in double precision.
#[derive(Debug, Default)]
pub struct Aside {
    /// Distances of all pairs, and the pair of species of each.
    pub all: Vec<f64>,
    pub kind: Vec<u32>,
    /// Those that one potential acts on.
    pub place: Vec<u32>,
    pub r: Vec<f64>,
    pub phi: Vec<f64>,
    pub slope: Vec<f64>,
}

/// Chunks of a group: five windows, in up to three periods each, of two chunks.
const CHUNKS: usize = GROUP * 5 * 3 * 2 + 2;

/// Room behind the last pair: what whole vectors may touch.
const SLACK: usize = 64;

impl<T: Scalar> Default for Block<T> {
    fn default() -> Self {
        let mut block = Block {
            members: [0; GROUP],
            begin: [0; GROUP + 1],
            j: Vec::new(),
            lists: Default::default(),
            which: Vec::new(),
            own: Own::default(),
            pairs: Vec::new(),
            tags: Default::default(),
            rows: Vec::new(),
            weight: Vec::new(),
            conservative: Vec::new(),
            found: Vec::new(),
            running: Vec::new(),
            aside: Aside::default(),
            chunks: Vec::new(),
            chunk_count: 0,
            fours: [[0; 2]; GROUP],
            four_count: 0,
            points: [Two::default(); 2 * GROUP],
            masks: Vec::new(),
            capacity: 0,
        };
        block.reserve_chunks(0);
        block
    }
}

impl<T: Scalar> Block<T> {
    /// Makes room for `count` chunks, and for those that the rest of a group may need at two each.
    #[cold]
    #[inline(never)]
    pub fn reserve_chunks(&mut self, count: usize) {
        let room = count + CHUNKS;
        if room > self.chunks.len() {
            self.chunks.resize(2 * room, Chunk::default());
            self.masks.resize(2 * room, 0);
        }
    }

    /// Makes room for `count` pairs of each of four, and whole vectors behind.
    #[inline(always)]
    pub fn reserve(&mut self, count: usize) {
        if FOUR * count + SLACK > self.capacity {
            self.grow(FOUR * count + SLACK);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, count: usize) {
        let capacity = (2 * count).next_multiple_of(64);
        self.capacity = capacity;
        self.j.resize(capacity, 0);
        for list in &mut self.lists {
            list.resize(capacity, 0);
        }
        self.which.resize(capacity, 0);
        for tags in &mut self.tags {
            tags.resize(capacity, 0);
        }
        self.rows.resize(capacity / 16, Lines::default());
        // Eight numbers for each pair, at most.
        self.pairs.resize(capacity / 8, Lines::default());
        self.running.resize(capacity + 2, Sum::default());
        self.conservative.resize(capacity, T::default());
        for values in &mut self.weight {
            values.resize(capacity, T::default());
        }
        let aside = &mut self.aside;
        aside.kind.resize(capacity, 0);
        aside.place.resize(capacity, 0);
        for values in [&mut aside.all, &mut aside.r, &mut aside.phi, &mut aside.slope] {
            values.resize(capacity, 0.0);
        }
    }

    /// Room for the weights of `passes` densities.
    pub fn set_passes(&mut self, passes: usize) {
        self.weight.resize_with(passes, Vec::new);
        self.found.resize(passes, 0);
        self.capacity = 0;
        self.grow(SLACK);
    }
}
