//! Spans of bins as chunks of sixteen particles, each to be compared with two.

use super::arithmetic::Record;
use super::block::Block;
use super::layer::Swept;
use super::simd::Scalar;
use super::windows::{Spans, View, Windows};

/// Sixteen particles that two others are to be compared with.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct Chunk {
    pub from: u32,
    /// Which of them: bits from 0 on for the first of the two, from 16 on for the second.
    pub allowed: u32,
    /// The number of the two in the group, and the shift that they see these with, in the lowest eight bits.
    pub note: u32,
}

/// Which of two particles.
const BOTH: u32 = u32::MAX;
const FIRST: u32 = 0xffff;
const SECOND: u32 = 0xffff << 16;

/// A group of particles of one row, whose spans are to be cut.
pub struct Group<'a> {
    pub view: &'a View,
    pub windows: &'a Windows,
    pub spans: &'a Spans,
    /// Whether spans go on in the period before, or in the next.
    pub before: bool,
    pub after: bool,
    /// The first, and how many.
    pub first: usize,
    pub count: usize,
}

/// Cuts the spans of a group into chunks. Particles that follow each other closely look two by two.
#[inline(always)]
pub unsafe fn cut<T: Scalar, const GHOSTS: bool>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
) {
    // SAFETY: the arrays are as `Swept` says, chunks have room.
    unsafe {
        let Group { view, windows, spans, count, .. } = *group;
        let x = swept.x[0].as_ptr().add(group.first);
        let mut found = 0;
        let mut two = 0;
        let mut a = 0;
        while a < count {
            let alone = a + 1 == count || (*x.add(a + 1) - *x.add(a)).abs() > view.joined;
            let b = a + !alone as usize;
            let who = if alone { FIRST } else { BOTH };
            *block.twos.get_unchecked_mut(two) = [a as u8, b as u8];
            let mut w = 0;
            while w < 5 {
                let (low, end) = (spans.low.get_unchecked(w), spans.end.get_unchecked(w));
                let low = (*low.get_unchecked(a)).min(*low.get_unchecked(b));
                let end = (*end.get_unchecked(a)).max(*end.get_unchecked(b));
                let row = *windows.row.get_unchecked(w);
                let behind = *windows.behind.get_unchecked(w);
                // The second of two is the first of those behind the first.
                let own = (group.first + a + 1) as u32;
                let from = if w == 0 { own } else { *row.add(low as usize) + behind };
                let to = *row.add(end as usize) + behind;
                let but = if w == 0 && !alone { 1 << 16 } else { 0 };
                let look = Look { a, b, two, who, but, shift: w + 5 };
                found = add::<T, GHOSTS>(swept, group, block, found, [from, to], look);
                w += 1;
            }
            // Rows that go on in the period before, and in the next.
            if group.before {
                let mut w = 1;
                while w < 5 {
                    let low = spans.before.get_unchecked(w);
                    let low = (*low.get_unchecked(a)).min(*low.get_unchecked(b));
                    let row = *windows.row.get_unchecked(w);
                    let behind = *windows.behind.get_unchecked(w);
                    let range = [*row.add(low as usize) + behind, *row.add(view.bins as usize) + behind];
                    let look = Look { a, b, two, who, but: 0, shift: w };
                    found = add::<T, GHOSTS>(swept, group, block, found, range, look);
                    w += 1;
                }
            }
            if group.after {
                let mut w = 0;
                while w < 5 {
                    let end = spans.after.get_unchecked(w);
                    let end = (*end.get_unchecked(a)).max(*end.get_unchecked(b));
                    let row = *windows.row.get_unchecked(w);
                    let behind = *windows.behind.get_unchecked(w);
                    let range = [*row + behind, *row.add(end as usize) + behind];
                    let look = Look { a, b, two, who, but: 0, shift: w + 10 };
                    found = add::<T, GHOSTS>(swept, group, block, found, range, look);
                    w += 1;
                }
            }
            two += 1;
            a = b + 1;
        }
        block.two_count = two;
        block.chunk_count = found;
    }
}

/// Who looks, and how.
#[derive(Clone, Copy)]
struct Look {
    /// The two, in the group; the same if one looks alone.
    a: usize,
    b: usize,
    two: usize,
    who: u32,
    /// Left out of the first chunk: the second of the two is there itself.
    but: u32,
    shift: usize,
}

/// The bits of the first of thirty-two particles, for both of two that look: those of the first chunk, and of the
/// second.
static FIRST_BITS: [[u32; 2]; 33] = first_bits();

const fn first_bits() -> [[u32; 2]; 33] {
    let mut table = [[0; 2]; 33];
    let mut length = 0;
    while length <= 32 {
        let bits = ((1u64 << length) - 1) as u32;
        let (here, next) = (bits & 0xffff, bits >> 16);
        table[length] = [here | here << 16, next | next << 16];
        length += 1;
    }
    table
}

/// Appends the chunks of the particles `from..to`, at least one for a look without a shift at the own row;
/// returns how many there are then.
#[inline(always)]
unsafe fn add<T: Scalar, const GHOSTS: bool>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
    found: usize,
    [mut from, mut to]: [u32; 2],
    look: Look,
) -> usize {
    // SAFETY: chunks have room for two more; more make room.
    unsafe {
        let mut owned = [BOTH; 2];
        if GHOSTS {
            // Two ghosts are no concern of this rank.
            let ghost = [look.a, look.b].map(|k| *swept.ghost.get_unchecked(group.first + k));
            if ghost[0] && ghost[1] {
                let [first, last] = *group.windows.owned.get_unchecked(look.shift % 5);
                if look.but == 0 {
                    from = from.max(first);
                }
                to = to.min(last);
            }
            for (k, owned) in owned.iter_mut().enumerate() {
                *owned = concerned(ghost, swept.owned_bits(from as usize + 16 * k));
            }
        }
        let length = to.saturating_sub(from) as usize;
        let note = (look.two << 8 | look.shift) as u32;
        let who = [look.who & !look.but, look.who];
        if length > 32 {
            if GHOSTS {
                return add_many_with_ghosts(swept, group, block, found, from, to, look);
            }
            return add_many(block, found, from, to, who[0], note);
        }
        // Both are written, and counted as needed: there is no branch to foresee.
        let bits = FIRST_BITS.get_unchecked(length);
        let out = block.chunks.as_mut_ptr().add(found);
        *out = Chunk { from, allowed: bits[0] & who[0] & owned[0], note };
        *out.add(1) = Chunk { from: from + 16, allowed: bits[1] & who[1] & owned[1], note };
        found + (look.shift == 5 || length > 0) as usize + (length > 16) as usize
    }
}

/// Which of sixteen particles concern this rank, of which `owned` are no ghosts, for two that look.
#[inline(always)]
fn concerned(ghost: [bool; 2], owned: u32) -> u32 {
    let [a, b] = ghost.map(|ghost| if ghost { owned } else { 0xffff });
    a | b << 16
}

/// More chunks than two; `who` looks at the first of them, and whoever has bits above the lowest at the others.
#[cold]
#[inline(never)]
fn add_many<T: Scalar>(
    block: &mut Block<T>,
    mut found: usize,
    from: u32,
    to: u32,
    mut who: u32,
    note: u32,
) -> usize {
    block.reserve_chunks(found + (to - from).div_ceil(16) as usize);
    for begin in (from..to).step_by(16) {
        let allowed = FIRST_BITS[(to - begin).min(16) as usize][0] & who;
        block.chunks[found] = Chunk { from: begin, allowed, note };
        found += 1;
        if who & SECOND != 0 {
            who |= SECOND;
        }
    }
    found
}

#[cold]
#[inline(never)]
fn add_many_with_ghosts<T: Scalar>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
    found: usize,
    from: u32,
    to: u32,
    look: Look,
) -> usize {
    let note = (look.two << 8 | look.shift) as u32;
    let end = add_many(block, found, from, to, look.who & !look.but, note);
    let ghost = [look.a, look.b].map(|k| swept.ghost[group.first + k]);
    for chunk in &mut block.chunks[found..end] {
        // SAFETY: of a chunk.
        chunk.allowed &= concerned(ghost, unsafe { swept.owned_bits(chunk.from as usize) });
    }
    end
}
