//! The second pass over a plane: the many-body forces `−(∂ψ_i/∂n + ∂ψ_j/∂n) w′ ê` of the pairs
//! that the first pass has listed.
//!
//! A rank knows the slopes of ghosts only after its host has sent them. Its rim, which is its pairs of an owned particle
//! and a ghost, therefore has a second pass of its own then, which adds to the owned particles.

use super::data::PassData;
use super::second_cached::second_pass_cached;
use crate::ground::arithmetic::Arithmetic;
use crate::pair_batch::accumulators::PlaneSums;
use crate::pair_batch::in_range_pairs::{I_CODE_BITS, InRangePairs};
use crate::pair_batch::scatter::add_quad;
use crate::simd::{Isa, OFFSET_BITS, Quad, Scalar};

/// Number of accumulators of each i-particle that are used in turn: four hide the latency of the addition.
const TURNS: usize = 4;

/// Sums over the pairs of up to sixteen i-particles. All are zero between batches.
#[repr(C, align(64))]
struct ISums([[[f64; 4]; TURNS]; 16]);

impl ISums {
    /// The accumulator of i-particle `m` for pair `p`.
    ///
    /// # Safety
    /// `m` is below 16.
    #[inline(always)]
    unsafe fn at(&mut self, m: usize, p: usize) -> *mut f64 {
        // SAFETY: `m` is below 16, so that the address is inside the array.
        unsafe { self.0.as_mut_ptr().cast::<[f64; 4]>().add(TURNS * m + p % TURNS).cast() }
    }

    /// Returns the sum of i-particle `m`, and sets it to zero.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`; `m` is below 16.
    #[inline(always)]
    unsafe fn take<Q: Quad>(&mut self, m: usize) -> Q {
        // SAFETY: the loops over i-particles end at the members of a batch, at most sixteen.
        unsafe {
            let mut sums = [Q::zero(); TURNS];
            let mut p = 0;
            while p < TURNS {
                sums[p] = Q::load(self.at(m, p));
                Q::zero().store(self.at(m, p));
                p += 1;
            }
            sums[0].add(sums[1]).add(sums[2].add(sums[3]))
        }
    }
}

/// Does the second pass over `plane`, and adds to the virial with `TALLY`. With `RIM` it adds rim pairs to an empty `rim`.
///
/// # Safety
/// The caller fulfils the contract of `simd`. [`first_pass`](super::first::first_pass) has filled
/// `in_range` for the plane of these sums, with the same `TALLY`. The slopes of the plane and of the
/// next one are complete, and no thread writes them. With `RIM` the second particles of the pairs are ghosts, whose slopes
/// are complete, and only the first particles have sums.
#[inline(always)]
pub unsafe fn second_pass<
    I: Isa,
    A: Arithmetic<I>,
    const MULTISPECIES: bool,
    const TALLY: bool,
    const RIM: bool,
>(
    data: &PassData<A::Scalar, A::PackedParticle>,
    sums: PlaneSums,
    in_range: &InRangePairs<A::Scalar>,
    virial: &mut [f64; 6],
) {
    // SAFETY: the first pass has listed `found` pairs of each density for each batch; codes name particles of the
    // plane and of the next one, which have accumulators, slopes and species; the caller promises the rest.
    unsafe {
        if MULTISPECIES && data.inputs.terms.full_cache {
            let cache = &in_range.full_cache;
            return second_pass_cached::<I, A, MULTISPECIES, TALLY>(data, sums, cache, RIM, virial);
        }
        let to = sums.forces();
        let plane_first = in_range.plane_first as usize;
        let to_plane = to.at(plane_first << OFFSET_BITS);
        let species = data.inputs.terms.species;
        let species_j = data.inputs.species.as_ptr().wrapping_add(plane_first);
        let passes = in_range.weight_gradients.len();
        let width = passes * species;
        let mut i_sums = ISums([[[0.0; 4]; TURNS]; 16]);
        let mut done = vec![0; passes];
        let mut b = 0;
        while b < in_range.batches.len() {
            let [first, members] = in_range.batches.get_unchecked(b).map(|n| n as usize);
            let mut pass = 0;
            while pass < passes {
                let gradients = in_range.weight_gradients.get_unchecked(pass).as_ptr();
                let separations = in_range.separations.get_unchecked(pass).as_ptr();
                let slopes = data.slopes.values.at(pass * species).cast_const();
                let plane_slopes = slopes.add(width * plane_first);
                let i_slopes = slopes.add(width * first);
                let species_i = data.inputs.species.as_ptr().wrapping_add(first);
                let begin = *done.get_unchecked(pass);
                let end = begin + *in_range.found.get_unchecked(b * passes + pass) as usize;
                let mut p = begin;
                while p < end {
                    let gradient = gradients.add(p).cast::<A::Scalar>();
                    let code = (*gradient.add(3)).decode();
                    let (j, m) = ((code >> I_CODE_BITS) as usize, (code & ((1 << I_CODE_BITS) - 1)) as usize);
                    let j_slopes = plane_slopes.add(width * j);
                    let slope = if MULTISPECIES {
                        let (i, j) = (*species_i.add(m) as usize, *species_j.add(j) as usize);
                        *i_slopes.add(width * m + j) + *j_slopes.add(i)
                    } else {
                        *i_slopes.add(width * m) + *j_slopes
                    };
                    let force = A::load_quad(gradient).mul(I::Quad::splat(slope));
                    if !RIM {
                        let at = to_plane.add(4 * j);
                        I::Quad::load(at).sub(force).store(at);
                    }
                    let at = i_sums.at(m, p);
                    I::Quad::load(at).add(force).store(at);
                    if TALLY {
                        add_dyad(*separations.add(p), *gradients.add(p), slope, virial);
                    }
                    p += 1;
                }
                *done.get_unchecked_mut(pass) = end;
                pass += 1;
            }
            let mut m = 0;
            while m < members {
                add_quad(to.at((first + m) << OFFSET_BITS), i_sums.take::<I::Quad>(m));
                m += 1;
            }
            b += 1;
        }
    }
}

/// Adds the virial of a force `slope · gradient` to `virial`.
#[inline(never)]
fn add_dyad<T: Scalar>(separation: [T; 4], gradient: [T; 4], slope: f64, virial: &mut [f64; 6]) {
    let [x, y, z, pair_weight] = separation.map(T::wide);
    let (d, factor) = ([x, y, z], slope * pair_weight);
    let f = [gradient[0].wide() * factor, gradient[1].wide() * factor, gradient[2].wide() * factor];
    for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        virial[k] += f[a] * d[b];
    }
}
