//! The pairs in hand: some hundred, in arrays that stay in the first-level cache.

use crate::engine::sweep::ground::arithmetic::IParticles;
use crate::engine::sweep::ground::arithmetic::OFFSET_BITS;
use crate::engine::sweep::pair_batch::batch::Batch;
use crate::engine::sweep::pair_batch::scatter::Accumulator;
use crate::engine::sweep::pair_search::j_clusters::{ICluster, JCluster, MASKS_PER_CLUSTER};
use crate::engine::sweep::simd::{BroadcastPair, Scalar};

/// Most particles that look for others at once.
pub const SEARCH_GROUP: usize = 32;

/// Masks of j-clusters that are turned at once, and lists of which follow each other.
pub const SLOT_BLOCK: usize = 8;

/// Sixteen rows of four numbers, aligned so that no vector of them straddles lines of the cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct CacheLines<T>([[T; 4]; 16]);

/// Pairs of a group of particles, and of a vector's worth of them, in parallel arrays.
#[derive(Debug)]
pub struct PairBuffers<T> {
    /// The first of the group.
    pub first: usize,
    /// Where the pairs of each begin, and of the last end.
    pub begin: [u32; SEARCH_GROUP + 1],
    /// The second particle of each pair of the group: 32 times its place in the order of cells.
    pub j_offsets: Vec<u32>,
    /// The first, a number in the vector's worth of the group that it is of.
    pub i_in_batch: Vec<u8>,
    /// A vector's worth of the group, whose pairs are in hand. All arrays of pairs below begin with their first.
    pub i_particles: IParticles<T>,
    /// Room for [`Pairs`](crate::engine::sweep::ground::arithmetic::Pairs) of a precision and instruction set, a vector each.
    pub pairs: Vec<CacheLines<T>>,
    /// Tags of both particles; then the words of noise are where the first were.
    pub tags: [Vec<u32>; 2],
    /// Rows `fx, fy, fz, −w`.
    pub quads: Vec<CacheLines<T>>,
    /// Rows of weights for the first particles, with several species.
    pub i_quads: Vec<CacheLines<T>>,
    /// Minus the weights, of one density after another.
    pub kernel_weights: Vec<Vec<T>>,
    /// Forces along `ê` of all terms but the first soft one.
    pub conservative: Vec<T>,
    /// How much of each pair counts, if sums are wanted.
    pub pair_weight: Vec<T>,
    /// How many pairs are within the range of each density.
    pub found: Vec<usize>,
    /// Running sums of the rows.
    pub running: Vec<Accumulator>,
    /// Work space of pair terms that are evaluated apart.
    pub fallback: FallbackPairs,
    /// What the group is to be compared with.
    pub j_clusters: Vec<JCluster>,
    pub j_cluster_count: usize,
    /// What is allowed to the second four of an i-cluster.
    pub eligible_high: Vec<u64>,
    /// Who looks together.
    pub i_clusters: [ICluster; SEARCH_GROUP],
    pub i_cluster_count: usize,
    /// For each eight slots, where each four of the i-cluster are that looks at their j-clusters.
    pub i_positions: Vec<[BroadcastPair; 2]>,
    /// Which of the j-cluster of each slot are within reach: for each eight slots, those of each four of an i-cluster. And 32 times
    /// the place of the first particle of the j-cluster of each slot.
    pub masks: Vec<u64>,
    pub j_bases: Vec<u32>,
    capacity: usize,
}

/// Pairs of which potentials are evaluated apart, in double precision.
#[derive(Debug, Default)]
pub struct FallbackPairs {
    /// Distances of all pairs, and the pair of species of each.
    pub all: Vec<f64>,
    pub species_pair: Vec<u32>,
    /// Those that one potential acts on.
    pub index: Vec<u32>,
    pub r: Vec<f64>,
    pub phi: Vec<f64>,
    pub slope: Vec<f64>,
}

/// J-clusters of a group: five cell ranges, in up to three periods each, of two j-clusters for each particle.
const J_CLUSTERS: usize = SEARCH_GROUP * 5 * 3 * 2 + 2;

/// Room behind the last pair: what whole vectors may touch.
const PAIR_PADDING: usize = 64;

impl<T: Scalar> Default for PairBuffers<T> {
    fn default() -> Self {
        let mut buffers = PairBuffers {
            first: 0,
            begin: [0; SEARCH_GROUP + 1],
            j_offsets: Vec::new(),
            i_in_batch: Vec::new(),
            i_particles: IParticles::default(),
            pairs: Vec::new(),
            tags: Default::default(),
            quads: Vec::new(),
            i_quads: Vec::new(),
            kernel_weights: Vec::new(),
            conservative: Vec::new(),
            pair_weight: Vec::new(),
            found: Vec::new(),
            running: Vec::new(),
            fallback: FallbackPairs::default(),
            j_clusters: Vec::new(),
            j_cluster_count: 0,
            eligible_high: Vec::new(),
            i_clusters: [ICluster::default(); SEARCH_GROUP],
            i_cluster_count: 0,
            i_positions: Vec::new(),
            masks: Vec::new(),
            j_bases: Vec::new(),
            capacity: 0,
        };
        buffers.reserve_j_clusters(0);
        buffers
    }
}

impl<T: Scalar> PairBuffers<T> {
    /// Makes room for `count` j-clusters, and for those that the rest of a group may need at two each.
    #[cold]
    #[inline(never)]
    pub fn reserve_j_clusters(&mut self, count: usize) {
        let room = count + J_CLUSTERS;
        if room > self.j_clusters.len() {
            self.j_clusters.resize(2 * room, JCluster::default());
            self.eligible_high.resize(2 * room, 0);
            // Slots of each i-cluster come in eights.
            let slot_blocks = 2 * room / SLOT_BLOCK + SEARCH_GROUP + 1;
            self.i_positions.resize(MASKS_PER_CLUSTER * slot_blocks, Default::default());
            self.masks.resize(MASKS_PER_CLUSTER * SLOT_BLOCK * slot_blocks, 0);
            self.j_bases.resize(SLOT_BLOCK * slot_blocks, 0);
        }
    }

    /// Makes room for `count` pairs, and whole vectors behind.
    #[inline(always)]
    pub fn reserve(&mut self, count: usize) {
        if count + PAIR_PADDING > self.capacity {
            self.grow(count + PAIR_PADDING);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, count: usize) {
        let capacity = (2 * count).next_multiple_of(64);
        self.capacity = capacity;
        self.j_offsets.resize(capacity, 0);
        self.i_in_batch.resize(capacity, 0);
        for tags in &mut self.tags {
            tags.resize(capacity, 0);
        }
        self.quads.resize(capacity / 16, CacheLines::default());
        self.i_quads.resize(capacity / 16, CacheLines::default());
        // Eight numbers for each pair, at most.
        self.pairs.resize(capacity / 8, CacheLines::default());
        self.running.resize(capacity + 2, Accumulator::default());
        self.conservative.resize(capacity, T::default());
        self.pair_weight.resize(capacity, T::default());
        for values in &mut self.kernel_weights {
            values.resize(capacity, T::default());
        }
        let fallback = &mut self.fallback;
        fallback.species_pair.resize(capacity, 0);
        fallback.index.resize(capacity, 0);
        for values in [&mut fallback.all, &mut fallback.r, &mut fallback.phi, &mut fallback.slope] {
            values.resize(capacity, 0.0);
        }
    }

    /// Both particles of pair `p` of those in hand.
    pub fn pair(&self, batch: Batch, p: usize) -> [usize; 2] {
        let p = batch.pairs[0] + p;
        [batch.first + self.i_in_batch[p] as usize, (self.j_offsets[p] >> OFFSET_BITS) as usize]
    }

    /// Room for the weights of `passes` densities.
    pub fn set_passes(&mut self, passes: usize) {
        self.kernel_weights.resize_with(passes, Vec::new);
        self.found.resize(passes, 0);
        self.capacity = 0;
        self.grow(PAIR_PADDING);
    }
}
