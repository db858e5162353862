//! Scratch arrays of a batch.

use super::accumulators::Accumulator;
use super::counts::BatchCounts;
use crate::ground::arithmetic::IParticles;
use crate::simd::Scalar;

/// Sixteen quads, aligned so that each vector of them is in one cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct CacheLines<T>([[T; 4]; 16]);

/// Arrays over the pairs of one batch. All begin with its first pair, and have room for whole vectors beyond the last one.
#[derive(Debug)]
pub struct BatchBuffers<T> {
    pub i_particles: IParticles<T>,
    /// [`PairVector`](crate::ground::arithmetic::PairVector)s: their size depends on precision and
    /// instruction set.
    pub pairs: Vec<CacheLines<T>>,
    /// Tags of both particles. The random words of the noise replace those of the first particle.
    pub tags: [Vec<u32>; 2],
    /// A quad `fx, fy, fz, −w` for each pair.
    pub quads: Vec<CacheLines<T>>,
    /// With several species, the quads of weights for the i-particles.
    pub i_quads: Vec<CacheLines<T>>,
    /// For each density the negative weights of the pairs.
    pub kernel_weights: Vec<Vec<T>>,
    /// Conservative forces along `ê` of all terms but the first soft one; then, for the full pair cache, all forces over `r`.
    pub conservative: Vec<T>,
    /// Pair weight, 1 or ½ with a ghost, if energies or virials are requested; zero beyond the last pair.
    pub pair_weight: Vec<T>,
    /// Number of pairs within the range of each density.
    pub found: Vec<usize>,
    /// Prefix sums over the quads.
    pub running: Vec<Accumulator>,
    pub fallback: FallbackPairs,
    /// Counts of operations since the engine was made.
    pub counts: BatchCounts,
    capacity: usize,
}

/// Scratch arrays of potentials without vector code.
#[derive(Debug, Default)]
pub struct FallbackPairs {
    /// Distances of all pairs.
    pub all: Vec<f64>,
    pub species_pair: Vec<u32>,
    /// The pairs that one potential acts on.
    pub index: Vec<u32>,
    pub r: Vec<f64>,
    pub phi: Vec<f64>,
    pub slope: Vec<f64>,
}

/// Number of elements beyond the last pair that whole vectors may read or write.
const PADDING: usize = 64;

impl<T: Scalar> BatchBuffers<T> {
    /// Buffers for the weights of `passes` densities.
    pub fn new(passes: usize) -> BatchBuffers<T> {
        let mut buffers = BatchBuffers {
            i_particles: IParticles::default(),
            pairs: Vec::new(),
            tags: Default::default(),
            quads: Vec::new(),
            i_quads: Vec::new(),
            kernel_weights: vec![Vec::new(); passes],
            conservative: Vec::new(),
            pair_weight: Vec::new(),
            found: vec![0; passes],
            running: Vec::new(),
            fallback: FallbackPairs::default(),
            counts: BatchCounts::default(),
            capacity: 0,
        };
        buffers.reserve(0);
        buffers
    }

    /// Makes room for `count` pairs, and for whole vectors beyond the last.
    #[inline(always)]
    pub fn reserve(&mut self, count: usize) {
        if count + PADDING > self.capacity {
            self.grow(count + PADDING);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, count: usize) {
        let capacity = (2 * count).next_multiple_of(64);
        self.capacity = capacity;
        for tags in &mut self.tags {
            tags.resize(capacity, 0);
        }
        self.quads.resize(capacity / 16, CacheLines::default());
        self.i_quads.resize(capacity / 16, CacheLines::default());
        // A pair has up to eight numbers.
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
}
