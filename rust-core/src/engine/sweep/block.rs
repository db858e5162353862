//! The pairs in hand: some hundred, in arrays that stay in the first-level cache.

use super::arithmetic::Own;
use super::chunks::{Chunk, FOURS, Team};
use super::layer::Part;
use super::scatter::Sum;
use super::simd::{Scalar, Two};

/// Most particles that look for others at once.
pub const GROUP: usize = 32;

/// Places of particles in the order of cells are multiplied by 32, the size of accumulators and of records in mixed
/// precision.
pub const PLACE_BITS: u32 = 5;

/// Masks of chunks that are turned at once, and lists of which follow each other.
pub const EIGHT: usize = 8;

/// Sixteen rows of four numbers, aligned so that no vector of them straddles lines of the cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Lines<T>([[T; 4]; 16]);

/// Pairs of a group of particles, and of a vector's worth of them, in parallel arrays.
#[derive(Debug)]
pub struct Block<T> {
    /// The first of the group.
    pub first: usize,
    /// Where the pairs of each begin, and of the last end.
    pub begin: [u32; GROUP + 1],
    /// The second particle of each pair of the group: 32 times its place in the order of cells.
    pub j: Vec<u32>,
    /// The first, a number in the vector's worth of the group that it is of.
    pub which: Vec<u8>,
    /// A vector's worth of the group, whose pairs are in hand. All arrays of pairs below begin with their first.
    pub own: Own<T>,
    /// Room for [`Pairs`](super::arithmetic::Pairs) of a precision and instruction set, a vector each.
    pub pairs: Vec<Lines<T>>,
    /// Tags of both particles; then the words of noise are where the first were.
    pub tags: [Vec<u32>; 2],
    /// Rows `fx, fy, fz, −w`.
    pub rows: Vec<Lines<T>>,
    /// Rows of weights for the first particles, with several species.
    pub own_rows: Vec<Lines<T>>,
    /// Minus the weights, of one density after another.
    pub weight: Vec<Vec<T>>,
    /// Forces along `ê` of all terms but the first soft one.
    pub conservative: Vec<T>,
    /// How much of each pair counts, if sums are wanted.
    pub share: Vec<T>,
    /// How many pairs are within the range of each density.
    pub found: Vec<usize>,
    /// Running sums of the rows.
    pub running: Vec<Sum>,
    /// Work space of pair terms that are evaluated apart.
    pub aside: Aside,
    /// What the group is to be compared with.
    pub chunks: Vec<Chunk>,
    pub chunk_count: usize,
    /// What is allowed to the second four of a team.
    pub allowed: Vec<u64>,
    /// Who looks together.
    pub teams: [Team; GROUP],
    pub team_count: usize,
    /// For each eight slots, where each four of the team are that looks at their chunks.
    pub points: Vec<[Two; 2]>,
    /// Which of the chunk of each slot are within reach: for each eight slots, those of each four of a team. And 32 times
    /// the place of the first particle of the chunk of each slot.
    pub masks: Vec<u64>,
    pub bases: Vec<u32>,
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

/// Chunks of a group: five windows, in up to three periods each, of two chunks for each particle.
const CHUNKS: usize = GROUP * 5 * 3 * 2 + 2;

/// Room behind the last pair: what whole vectors may touch.
const SLACK: usize = 64;

impl<T: Scalar> Default for Block<T> {
    fn default() -> Self {
        let mut block = Block {
            first: 0,
            begin: [0; GROUP + 1],
            j: Vec::new(),
            which: Vec::new(),
            own: Own::default(),
            pairs: Vec::new(),
            tags: Default::default(),
            rows: Vec::new(),
            own_rows: Vec::new(),
            weight: Vec::new(),
            conservative: Vec::new(),
            share: Vec::new(),
            found: Vec::new(),
            running: Vec::new(),
            aside: Aside::default(),
            chunks: Vec::new(),
            chunk_count: 0,
            allowed: Vec::new(),
            teams: [Team::default(); GROUP],
            team_count: 0,
            points: Vec::new(),
            masks: Vec::new(),
            bases: Vec::new(),
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
            self.allowed.resize(2 * room, 0);
            // Slots of each team come in eights.
            let eights = 2 * room / EIGHT + GROUP + 1;
            self.points.resize(FOURS * eights, Default::default());
            self.masks.resize(FOURS * EIGHT * eights, 0);
            self.bases.resize(EIGHT * eights, 0);
        }
    }

    /// Makes room for `count` pairs, and whole vectors behind.
    #[inline(always)]
    pub fn reserve(&mut self, count: usize) {
        if count + SLACK > self.capacity {
            self.grow(count + SLACK);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, count: usize) {
        let capacity = (2 * count).next_multiple_of(64);
        self.capacity = capacity;
        self.j.resize(capacity, 0);
        self.which.resize(capacity, 0);
        for tags in &mut self.tags {
            tags.resize(capacity, 0);
        }
        self.rows.resize(capacity / 16, Lines::default());
        self.own_rows.resize(capacity / 16, Lines::default());
        // Eight numbers for each pair, at most.
        self.pairs.resize(capacity / 8, Lines::default());
        self.running.resize(capacity + 2, Sum::default());
        self.conservative.resize(capacity, T::default());
        self.share.resize(capacity, T::default());
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

    /// Both particles of pair `p` of those in hand.
    pub fn pair(&self, part: Part, p: usize) -> [usize; 2] {
        let p = part.pairs[0] + p;
        [part.first + self.which[p] as usize, (self.j[p] >> PLACE_BITS) as usize]
    }

    /// Room for the weights of `passes` densities.
    pub fn set_passes(&mut self, passes: usize) {
        self.weight.resize_with(passes, Vec::new);
        self.found.resize(passes, 0);
        self.capacity = 0;
        self.grow(SLACK);
    }
}
