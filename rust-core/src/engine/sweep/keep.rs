//! Which pairs a density reaches: kept for the second pass.

use super::arithmetic::{Arithmetic, Pairs};
use super::block::{Block, PLACE_BITS};
use super::layer::{Part, Swept};
use super::many_body::{MEMBER_BITS, NearPairs};
use super::simd::{Isa, Reals, Words};
use super::terms::Pass;
use crate::model::kernel::{Shape, ShapeVisitor};

/// Appends to `near` the pairs within the range of each density; the block knows how many they are.
#[inline(always)]
pub unsafe fn keep<I: Isa, A: Arithmetic<I>, const TALLY: bool>(
    swept: &Swept<A::Scalar, A::Record>,
    block: &mut Block<A::Scalar>,
    near: &mut NearPairs<A::Scalar>,
    part: Part,
) {
    for (pass, term) in swept.terms.passes.iter().enumerate() {
        let found = term.force_kind.visit(Keep::<A::Reals, TALLY> {
            term,
            pairs: block.pairs.as_ptr().cast(),
            vectors: part.count().div_ceil(A::Reals::LANES),
            which: block.which[part.pairs[0]..].as_ptr(),
            places: block.j[part.pairs[0]..].as_ptr(),
            layer_first: near.first,
            share: block.share.as_ptr(),
            rows: near.rows[pass].end(),
            apart: near.apart[pass].end(),
        });
        block.found[pass] = found;
    }
}

/// The loop over vectors, for one kernel.
struct Keep<'a, R: Reals, const TALLY: bool> {
    term: &'a Pass<R::Scalar>,
    pairs: *const Pairs<R>,
    vectors: usize,
    which: *const u8,
    places: *const u32,
    layer_first: u32,
    share: *const R::Scalar,
    rows: *mut [R::Scalar; 4],
    apart: *mut [R::Scalar; 4],
}

impl<R: Reals, const TALLY: bool> ShapeVisitor for Keep<'_, R, TALLY> {
    type Output = usize;

    /// Rows `−w′ ê` and a code of both particles, and how many.
    #[inline(always)]
    fn visit<S: Shape>(self) -> usize {
        // SAFETY: the contract of `simd`, by way of `keep`; `near` has room for whole vectors.
        unsafe {
            let range = R::splat(self.term.force_range);
            let inverse_range = R::splat(self.term.force_inverse_range);
            let factor = R::splat(self.term.force);
            let first = R::Words::splat(self.layer_first << PLACE_BITS);
            let mut found = 0;
            let mut v = 0;
            while v < self.vectors {
                let pairs = &(*self.pairs.add(v)).apart;
                let which = R::Words::load_bytes(self.which.add(v * R::LANES));
                let place = R::Words::load(self.places.add(v * R::LANES)).sub(first);
                let code = R::encode(place.shift_right::<{ PLACE_BITS - MEMBER_BITS }>().add(which));
                // Lanes behind the last pair are out of reach.
                let mask = pairs.r.mask_below(range);
                let g = factor * S::slope(pairs.r * inverse_range) * pairs.inverse;
                let [dx, dy, dz] = pairs.d;
                let (x, y, z) = ((g * dx).compress(mask), (g * dy).compress(mask), (g * dz).compress(mask));
                R::rows([x, y, z, code.compress(mask)], self.rows.add(found).cast());
                if TALLY {
                    let share = R::load(self.share.add(v * R::LANES));
                    let (x, y, z) = (dx.compress(mask), dy.compress(mask), dz.compress(mask));
                    R::rows([x, y, z, share.compress(mask)], self.apart.add(found).cast());
                }
                found += mask.count_ones() as usize;
                v += 1;
            }
            found
        }
    }
}
