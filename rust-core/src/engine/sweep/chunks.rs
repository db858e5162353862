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
    /// The number of the two in the group.
    pub two: u32,
    /// The shift they are seen with.
    pub shift: u32,
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

/// The bits of the first of sixteen particles, for both of two that look.
#[inline(always)]
fn first_bits(length: u32) -> u32 {
    let one = (1u32 << length.min(16)) - 1;
    one | one << 16
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
            let all = if ghost[0] { 0 } else { FIRST } | if ghost[1] { 0 } else { SECOND };
            for (k, owned) in owned.iter_mut().enumerate() {
                let here = swept.owned_bits(from as usize + 16 * k);
                *owned = all | here | here << 16;
            }
        }
        let length = to.saturating_sub(from);
        if length > 32 {
            return add_many::<T, GHOSTS>(swept, group, block, found, [from, to], look);
        }
        // Both are written, and counted as needed: there is no branch to foresee.
        let (two, shift) = (look.two as u32, look.shift as u32);
        let out = block.chunks.as_mut_ptr().add(found);
        *out = Chunk { from, allowed: first_bits(length) & look.who & !look.but & owned[0], two, shift };
        let allowed = first_bits(length.saturating_sub(16)) & look.who & owned[1];
        *out.add(1) = Chunk { from: from + 16, allowed, two, shift };
        found + (shift == 5 || length > 0) as usize + (length > 16) as usize
    }
}

#[cold]
#[inline(never)]
fn add_many<T: Scalar, const GHOSTS: bool>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
    mut found: usize,
    [from, to]: [u32; 2],
    look: Look,
) -> usize {
    block.reserve_chunks(found + (to - from).div_ceil(16) as usize);
    let mut but = look.but;
    for begin in (from..to).step_by(16) {
        let mut allowed = first_bits(to - begin) & look.who & !but;
        if GHOSTS {
            // SAFETY: of a chunk.
            let owned = unsafe { swept.owned_bits(begin as usize) };
            allowed &= owned | if swept.ghost[group.first + look.a] { 0 } else { FIRST } | SECOND;
            allowed &= owned << 16 | if swept.ghost[group.first + look.b] { 0 } else { SECOND } | FIRST;
        }
        block.chunks[found] = Chunk { from: begin, allowed, two: look.two as u32, shift: look.shift as u32 };
        found += 1;
        but = 0;
    }
    found
}
