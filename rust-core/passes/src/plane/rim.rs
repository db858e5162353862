//! The rim of a rank: its pairs of an owned particle and a ghost. The second pass runs before the host
//! has sent the slopes of ghosts, and takes them as zero; the rim keeps the pairs whose forces still
//! lack these slopes.

use crate::simd::Scalar;

/// A pair of an owned particle and a ghost within the range of a density.
#[derive(Debug, Clone, Copy)]
pub struct RimPair<T> {
    /// `−w′ ê`, and an unspecified number; `ê` points from the second particle of the pair to the first.
    gradient: [T; 4],
    /// Both particles' indices in the order of cells.
    pub owned: u32,
    pub ghost: u32,
    /// Which of the ghost's slopes acts: that of this density and of the owned particle's species.
    pub slope: u32,
    /// The bit of the sign, if the owned particle is the second of the pair, else 0.
    side: u32,
}

/// The rim pairs that the first pass over a plane has found, in two lists: those whose owned particle
/// is of this plane, and those whose owned particle is of the next.
#[derive(Debug, Clone)]
pub struct Rim<T> {
    pub pairs: [Vec<RimPair<T>>; 2],
    /// The vector from the second particle of each pair to the first, if virials are requested.
    pub separations: [Vec<[T; 4]>; 2],
    /// The first particle of the next plane.
    next: u32,
    /// Scratch array for the numbers of a batch's rim pairs.
    marked: Vec<u32>,
}

impl<T> Default for Rim<T> {
    fn default() -> Rim<T> {
        Rim {
            pairs: [Vec::new(), Vec::new()],
            separations: [Vec::new(), Vec::new()],
            next: 0,
            marked: Vec::new(),
        }
    }
}

impl<T: Scalar> RimPair<T> {
    /// The force on the owned particle with this slope of the ghost.
    #[inline(always)]
    pub fn force(&self, slope: f64) -> [f64; 3] {
        let slope = f64::from_bits(slope.to_bits() ^ u64::from(self.side) << 32);
        let [x, y, z, _] = self.gradient;
        [x, y, z].map(|g| slope * g.wide())
    }

    /// The virial of that force; `separation` is the one of this pair.
    pub fn virial(&self, slope: f64, separation: &[T; 4]) -> [f64; 6] {
        let (f, d) = (self.gradient.map(|g| slope * g.wide()), separation.map(T::wide));
        [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(a, b)| f[a] * d[b])
    }
}

impl<T: Scalar> Rim<T> {
    /// Empties the rim of a plane; `next` is the first particle of the next plane.
    pub fn clear(&mut self, next: usize) {
        self.next = next as u32;
        self.pairs.iter_mut().for_each(Vec::clear);
        self.separations.iter_mut().for_each(Vec::clear);
    }

    /// A scratch array with room for the numbers of `count` pairs.
    #[inline(always)]
    pub fn marked(&mut self, count: usize) -> *mut u32 {
        if self.marked.len() < count {
            self.marked.resize(2 * count, 0);
        }
        self.marked.as_mut_ptr()
    }

    /// Adds a rim pair of particles `i` and `j`; the other arguments are as in [`RimPair`].
    #[inline(always)]
    pub fn push(
        &mut self,
        [i, j]: [usize; 2],
        i_is_ghost: bool,
        slope: usize,
        gradient: [T; 4],
        separation: Option<[T; 4]>,
    ) {
        let (owned, ghost) = if i_is_ghost { (j, i) } else { (i, j) };
        let list = (owned as u32 >= self.next) as usize;
        self.pairs[list].push(RimPair {
            gradient,
            owned: owned as u32,
            ghost: ghost as u32,
            slope: slope as u32,
            side: (i_is_ghost as u32) << 31,
        });
        if let Some(separation) = separation {
            self.separations[list].push(separation);
        }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.pairs.iter().map(|pairs| pairs.capacity() * size_of::<RimPair<T>>()).sum::<usize>()
            + self.separations.iter().map(|d| d.capacity() * size_of::<[T; 4]>()).sum::<usize>()
    }
}
