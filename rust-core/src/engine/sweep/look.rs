//! Which particles of the chunks are within reach.

use super::arithmetic::Record;
use super::block::{Block, EIGHT, PLACE_BITS};
use super::chunks::{FOUR, FOURS, Group};
use super::layer::Swept;
use super::simd::{Isa, Scalar, Two};

/// Compares the particles of a group with their chunks, and lists the pairs within reach, those of one particle after
/// those of another; particles are counted in vectors of `lanes`.
#[inline(always)]
pub unsafe fn look<I: Isa, T: Scalar, const SHIFTS: bool, const MANY: usize>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    lanes: usize,
    block: &mut Block<T>,
) {
    // SAFETY: the contract of `simd`; arrays have sixteen particles' room behind their last.
    unsafe {
        let first = group.first;
        let many = block.chunk_count;
        block.reserve(16 * MANY * many);
        let q = [swept.q[0].as_ptr(), swept.q[1].as_ptr(), swept.q[2].as_ptr()];
        let points = block.points.as_mut_ptr();
        let (masks, bases) = (block.masks.as_mut_ptr(), block.bases.as_mut_ptr());
        let fours = const { MANY / FOUR };
        let teams = block.team_count;
        let mut t = 0;
        while t < teams {
            let team = block.teams.get_unchecked(t);
            let from = first + team.first as usize;
            let mut eight = team.eights[0] as usize;
            while eight < team.eights[1] as usize {
                let mut k = 0;
                while k < MANY {
                    let four = points.add(fours * eight + k / FOUR).cast::<Two>();
                    let to = four.add(k % FOUR / 2).cast::<u16>().add(16 * (k % 2));
                    I::fill16(*q[0].add(from + k), to);
                    I::fill16(*q[1].add(from + k), to.add(32));
                    I::fill16(*q[2].add(from + k), to.add(64));
                    k += 1;
                }
                // Slots without a chunk.
                let mut f = 0;
                while f < fours {
                    masks.add(EIGHT * (fours * eight + f)).cast::<[u64; EIGHT]>().write([0; EIGHT]);
                    f += 1;
                }
                eight += 1;
            }
            t += 1;
        }
        let limit = swept.quantum.limit;
        let (chunks, allowed) = (block.chunks.as_ptr(), block.allowed.as_ptr());
        // Masks first, then what they select: the two in one loop wait for each other.
        let mut c = 0;
        while c < many {
            let chunk = &*chunks.add(c);
            let j = chunk.from as usize;
            let slot = chunk.note as usize >> 8;
            let eight = fours * (slot / EIGHT);
            let shift =
                if SHIFTS { *group.windows.shift.get_unchecked(chunk.note as usize & 0xff) } else { [0; 3] };
            let there = [q[0].add(j), q[1].add(j), q[2].add(j)];
            let mut near = [0; FOURS];
            let mut f = 0;
            while f < fours {
                near[f] = I::near::<SHIFTS>(there, shift, &*points.add(eight + f), limit);
                f += 1;
            }
            let masks = masks.add(EIGHT * eight + slot % EIGHT);
            *masks = near[0] & chunk.allowed;
            if fours > 1 {
                *masks.add(EIGHT) = near[1] & *allowed.add(c);
            }
            *bases.add(slot) = chunk.from << PLACE_BITS;
            c += 1;
        }
        let (out, which) = (block.j.as_mut_ptr(), block.which.as_mut_ptr());
        let mut pairs = 0;
        let mut member = 0;
        block.first = first;
        block.begin[0] = 0;
        let mut t = 0;
        while t < teams {
            let team = *block.teams.get_unchecked(t);
            let [from, to] = team.eights.map(|e| e as usize);
            let mut eight = fours * from;
            while eight < fours * to {
                I::turn(masks.add(EIGHT * eight));
                eight += 1;
            }
            let mut k = 0;
            while k < team.many as usize {
                let mut named = pairs;
                let mut eight = from;
                while eight < to {
                    let four = fours * eight + k / FOUR;
                    let (masks, bases) = (masks.add(EIGHT * four + k % FOUR), bases.add(EIGHT * eight));
                    pairs += I::collect(bases, *masks, out.add(pairs));
                    pairs += I::collect(bases.add(4), *masks.add(4), out.add(pairs));
                    eight += 1;
                }
                // Thirty-two at once are mostly enough.
                loop {
                    I::fill16(0x101 * (member & (lanes - 1)) as u16, which.add(named).cast());
                    named += 32;
                    if named >= pairs {
                        break;
                    }
                }
                member += 1;
                *block.begin.get_unchecked_mut(member) = pairs as u32;
                k += 1;
            }
            t += 1;
        }
        // Lanes behind the last pair: some particle.
        let mut k = 0;
        while k < 16 {
            *out.add(pairs + k) = (first as u32) << PLACE_BITS;
            k += 1;
        }
    }
}
