//! Scratch arrays and result of the pair search.

use super::cell_ranges::{CellRanges, WHOLE};
use super::clusters::{ICluster, JCluster, MASKS_PER_CLUSTER, SEARCH_GROUP, SLOT_BLOCK};
use crate::simd::BroadcastPair;

/// The pairs of one search group, and scratch arrays of the search. All stay in the first-level cache.
#[derive(Debug)]
pub struct SearchBuffers {
    /// First i-particle of the group.
    pub first: usize,
    /// Whether the j-particles are ghosts.
    pub with_ghosts: bool,
    /// Index of the first pair of each i-particle; the last entry is one past the last pair.
    pub begin: [u32; SEARCH_GROUP + 1],
    /// The j-particle of each pair: its index in the order of cells, shifted by `OFFSET_BITS`.
    pub j_offsets: Vec<u32>,
    /// The i-particle of each pair, counted in its batch.
    pub i_in_batch: Vec<u8>,
    pub i_clusters: [ICluster; SEARCH_GROUP],
    pub i_cluster_count: usize,
    pub j_clusters: Vec<JCluster>,
    pub j_cluster_count: usize,
    /// Candidate masks of i-particles five to eight, for each j-cluster.
    pub high_candidates: Vec<u64>,
    /// For each block of slots the positions of its i-cluster, each repeated sixteen times, with one entry for each mask.
    pub i_positions: Vec<[BroadcastPair; 2]>,
    /// For each block of slots the masks of i-particles one to four, then of five to eight.
    pub masks: Vec<u64>,
    /// Offset of the first candidate of each slot.
    pub j_bases: Vec<u32>,
    /// Scratch array of the search among ghosts.
    pub ranges_of_ghosts: Option<Box<CellRanges<WHOLE>>>,
    /// Number of pairs that fit into the lists.
    capacity: usize,
}

/// Number of j-clusters with which a group usually fits: two for each of nine cell ranges, in up to
/// three periods, of every i-particle.
const USUAL_J_CLUSTERS: usize = SEARCH_GROUP * WHOLE * 3 * 2 + 2;

/// Number of elements after the last pair that whole vectors may read or write.
const PADDING: usize = 64;

impl Default for SearchBuffers {
    fn default() -> SearchBuffers {
        let mut buffers = SearchBuffers {
            first: 0,
            with_ghosts: false,
            begin: [0; SEARCH_GROUP + 1],
            j_offsets: Vec::new(),
            i_in_batch: Vec::new(),
            i_clusters: [ICluster::default(); SEARCH_GROUP],
            i_cluster_count: 0,
            j_clusters: Vec::new(),
            j_cluster_count: 0,
            high_candidates: Vec::new(),
            i_positions: Vec::new(),
            masks: Vec::new(),
            j_bases: Vec::new(),
            ranges_of_ghosts: None,
            capacity: 0,
        };
        buffers.reserve_j_clusters(0);
        buffers.reserve_pairs(0);
        buffers
    }
}

impl SearchBuffers {
    /// Makes room for `count` j-clusters, and for two more for every cell range of the rest of a group.
    #[cold]
    #[inline(never)]
    pub fn reserve_j_clusters(&mut self, count: usize) {
        let room = count + USUAL_J_CLUSTERS;
        if room > self.j_clusters.len() {
            self.j_clusters.resize(2 * room, JCluster::default());
            self.high_candidates.resize(2 * room, 0);
            // Each i-cluster may leave its last block of slots partly empty.
            let blocks = 2 * room / SLOT_BLOCK + SEARCH_GROUP + 1;
            self.i_positions.resize(MASKS_PER_CLUSTER * blocks, Default::default());
            self.masks.resize(MASKS_PER_CLUSTER * SLOT_BLOCK * blocks, 0);
            self.j_bases.resize(SLOT_BLOCK * blocks, 0);
        }
    }

    /// Makes room for `count` pairs, and for whole vectors after the last.
    #[inline(always)]
    pub fn reserve_pairs(&mut self, count: usize) {
        if count + PADDING > self.capacity {
            self.grow(count + PADDING);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, count: usize) {
        self.capacity = (2 * count).next_multiple_of(64);
        self.j_offsets.resize(self.capacity, 0);
        self.i_in_batch.resize(self.capacity, 0);
    }
}
