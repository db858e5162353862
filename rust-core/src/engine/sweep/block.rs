//! The pairs in hand: some hundred, in arrays that stay in the first-level cache.

use super::chunks::Chunk;
use super::simd::Scalar;

/// Pairs of a run of particles, in parallel arrays; `d = r_i − r_j`.
#[derive(Debug, Default)]
pub struct Block<T> {
    /// Indices of the two particles, in the order of cells; those of the first only where they are needed.
    pub i: Vec<u32>,
    pub j: Vec<u32>,
    /// The first particle of each pair as its record has it: position, velocity, tag.
    pub own: [Vec<T>; 6],
    /// How many pairs there are.
    pub count: usize,
    /// The first particles, each once, and where the pairs of each begin, and of the last end.
    pub members: Vec<u32>,
    pub begin: Vec<u32>,
    pub d: [Vec<T>; 3],
    pub r: Vec<T>,
    pub inverse: Vec<T>,
    /// `ê·v_ij`.
    pub along: Vec<T>,
    pub tag_i: Vec<u32>,
    pub tag_j: Vec<u32>,
    pub noise: Vec<i32>,
    /// Which pair of species, and the species: only with several.
    pub kind: Vec<u32>,
    pub species_i: Vec<u8>,
    pub species_j: Vec<u8>,
    /// How much of the pair counts here: one, a half with a ghost, nothing beyond the last.
    pub share: Vec<T>,
    /// Forces along `ê`.
    pub conservative: Vec<T>,
    pub thermostat: Vec<T>,
    /// Weights, of one density after another.
    pub weight: Vec<Vec<T>>,
    /// Rows `fx, fy, fz, −w`.
    pub rows: Vec<T>,
    /// Pairs within the range of a density, one after the other: `−w′ ê`, index.
    pub near: [Vec<T>; 3],
    pub near_d: [Vec<T>; 3],
    pub near_j: Vec<u32>,
    pub near_code: Vec<T>,
    /// Which pairs these are, a bit for each.
    pub bits: Vec<u64>,
    /// Work space of pair terms that are evaluated apart.
    pub apart: Apart,
    /// What the members are to be compared with.
    pub chunks: Vec<Chunk>,
    /// Where the members are.
    pub place: [Vec<f32>; 3],
    pub chunk_count: usize,
    /// Which of each chunk are within reach.
    pub masks: Vec<u32>,
    capacity: usize,
}

/// Pairs that one potential acts on, in double precision.
#[derive(Debug, Default)]
pub struct Apart {
    pub place: Vec<u32>,
    pub r: Vec<f64>,
    pub phi: Vec<f64>,
    pub slope: Vec<f64>,
}

/// Chunks of a group of sixteen particles: five windows, in up to three periods each, of two chunks.
const GROUP: usize = 16 * 5 * 3 * 2 + 2;

/// Room behind the last pair: what whole vectors may touch.
const SLACK: usize = 64;

impl<T: Scalar> Block<T> {
    pub fn clear(&mut self) {
        self.count = 0;
        self.members.clear();
        self.begin.clear();
        self.begin.push(0);
        if self.chunks.is_empty() {
            self.place = std::array::from_fn(|_| vec![0.0; 256]);
            self.reserve_chunks(0);
        }
    }

    /// Makes room for `count` chunks, and for those that the rest of a group may need at two each.
    #[cold]
    #[inline(never)]
    pub fn reserve_chunks(&mut self, count: usize) {
        let room = count + GROUP;
        if room > self.chunks.len() {
            self.chunks.resize(2 * room, Chunk::default());
            self.masks.resize(2 * room, 0);
        }
    }

    /// Makes room for `count` pairs and whole vectors behind.
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
        for indices in [&mut self.i, &mut self.j, &mut self.tag_i, &mut self.tag_j, &mut self.near_j] {
            indices.resize(capacity, 0);
        }
        self.kind.resize(capacity, 0);
        self.noise.resize(capacity, 0);
        self.species_i.resize(capacity, 0);
        self.species_j.resize(capacity, 0);
        let scalars = [
            &mut self.r,
            &mut self.inverse,
            &mut self.along,
            &mut self.share,
            &mut self.conservative,
            &mut self.thermostat,
            &mut self.near_code,
        ];
        let triples = self.d.iter_mut().chain(&mut self.near).chain(&mut self.near_d);
        for values in scalars.into_iter().chain(&mut self.own).chain(triples) {
            values.resize(capacity, T::default());
        }
        for values in &mut self.weight {
            values.resize(capacity, T::default());
        }
        self.rows.resize(4 * capacity, T::default());
        self.bits.resize(capacity / 64 + 2, 0);
        self.apart.place.resize(capacity, 0);
        for values in [&mut self.apart.r, &mut self.apart.phi, &mut self.apart.slope] {
            values.resize(capacity, 0.0);
        }
    }

    /// Fills `i`.
    pub fn spread_members(&mut self) {
        for (m, member) in self.members.iter().enumerate() {
            self.i[self.begin[m] as usize..self.begin[m + 1] as usize].fill(*member);
        }
        self.i[self.count..self.count + 16].fill(0);
    }

    /// Room for the weights of `passes` densities.
    pub fn set_passes(&mut self, passes: usize) {
        let capacity = self.capacity;
        self.weight.resize_with(passes, Vec::new);
        for values in &mut self.weight {
            values.resize(capacity, T::default());
        }
    }
}
