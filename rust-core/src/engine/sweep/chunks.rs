//! Spans of bins as chunks, a vector's worth of particles each.

use super::arithmetic::Record;
use super::block::Block;
use super::layer::Swept;
use super::simd::{Isa, Reals, Scalar};
use super::windows::{Spans, View, Windows};

/// A vector's worth of particles that one particle is to be compared with: from the first to one past the last
/// of them, of which those beyond a vector are in the next chunk.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct Chunk {
    pub from: u32,
    pub to: u32,
    /// The particle's number in the block, and the shift it sees them with.
    pub member: u32,
    pub shift: u32,
}

/// Cuts the spans of `count` particles from `i` on into chunks.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub unsafe fn cut<I: Isa, T: Scalar>(
    swept: &Swept<T, impl Record>,
    view: &View,
    windows: &Windows,
    spans: &Spans,
    across: u32,
    i: usize,
    count: usize,
    block: &mut Block<T>,
) {
    // SAFETY: the arrays are as `Swept` says, chunks have room.
    unsafe {
        let lanes = I::F32::LANES;
        let mut found = 0;
        let first_member = block.members.len();
        let mut k = 0;
        while k < count {
            block.members.push((i + k) as u32);
            k += 1;
        }
        let mut c = 0;
        while c < 3 {
            let from = swept.x[c].as_ptr().add(i);
            I::F32::load(from).store(block.place[c].as_mut_ptr().add(first_member));
            c += 1;
        }
        let rows = windows.row;
        let behind = windows.behind;
        let mut k = 0;
        while k < count {
            let i = i + k;
            let member = first_member + k;
            if across >> k & 1 == 1 {
                found = cut_across(view, windows, spans, k, i, member, lanes, block, found);
                k += 1;
                continue;
            }
            let mut w = 0;
            while w < 5 {
                let low = *spans.low.get_unchecked(w).get_unchecked(k) as usize;
                let end = *spans.end.get_unchecked(w).get_unchecked(k) as usize;
                let to = *rows[w].add(end) + behind[w];
                let from = if w == 0 { i as u32 + 1 } else { *rows[w].add(low) + behind[w] };
                let length = to.saturating_sub(from);
                found = add_chunks(block, found, from, length, member, w + 5, w == 0, lanes);
                w += 1;
            }
            k += 1;
        }
        block.chunk_count = found;
    }
}

/// The same in open space with ghosts: these look for owned particles only, and are no members of the block
/// if there are none.
#[inline(always)]
pub unsafe fn cut_with_ghosts<I: Isa, T: Scalar>(
    swept: &Swept<T, impl Record>,
    windows: &Windows,
    spans: &Spans,
    i: usize,
    count: usize,
    block: &mut Block<T>,
) {
    // SAFETY: the arrays are as `Swept` says, chunks have room.
    unsafe {
        let lanes = I::F32::LANES;
        let mut found = 0;
        let mut k = 0;
        while k < count {
            let i = i + k;
            let member = block.members.len();
            let is_ghost = *swept.ghost.get_unchecked(i) > 0.0;
            let before = found;
            let mut w = 0;
            while w < 5 {
                let low = *spans.low.get_unchecked(w).get_unchecked(k) as usize;
                let end = *spans.end.get_unchecked(w).get_unchecked(k) as usize;
                let mut to = *windows.row[w].add(end);
                let mut from = if w == 0 { i as u32 + 1 } else { *windows.row[w].add(low) };
                if is_ghost {
                    let [first, last] = windows.owned[w];
                    from = from.max(first);
                    to = to.min(last);
                }
                let always = w == 0 && !is_ghost;
                found = add_chunks(block, found, from, to.saturating_sub(from), member, w + 5, always, lanes);
                w += 1;
            }
            if found > before || !is_ghost {
                block.members.push(i as u32);
                let mut c = 0;
                while c < 3 {
                    *block.place[c].get_unchecked_mut(member) = *swept.x[c].get_unchecked(i);
                    c += 1;
                }
            }
            k += 1;
        }
        block.chunk_count = found;
    }
}

/// The same for a particle whose spans go on in other periods.
#[inline(never)]
#[allow(clippy::too_many_arguments)]
unsafe fn cut_across<T: Scalar>(
    view: &View,
    windows: &Windows,
    spans: &Spans,
    k: usize,
    i: usize,
    member: usize,
    lanes: usize,
    block: &mut Block<T>,
    mut found: usize,
) -> usize {
    // SAFETY: bins are of the row; chunks have room.
    unsafe {
        let bins = view.bins;
        let mut w = 0;
        while w < 5 {
            let own = w == 0;
            let mut low = *spans.far_low.get_unchecked(w).get_unchecked(k) - bins;
            let end = *spans.far_end.get_unchecked(w).get_unchecked(k) - bins;
            let row = *windows.row.get_unchecked(w);
            let behind = *windows.behind.get_unchecked(w);
            if own {
                low = 0;
            } else if *windows.there.get_unchecked(w) == 0.0 {
                w += 1;
                continue;
            }
            if low < 0 {
                let (from, to) = (*row.add((low + bins) as usize) + behind, *row.add(bins as usize) + behind);
                found = add_chunks(block, found, from, to - from, member, w, false, lanes);
                low = 0;
            }
            let to = *row.add(end.min(bins) as usize) + behind;
            let from = if own { i as u32 + 1 } else { *row.add(low as usize) + behind };
            found = add_chunks(block, found, from, to.saturating_sub(from), member, w + 5, own, lanes);
            if end > bins {
                let (from, to) = (*row + behind, *row.add((end - bins) as usize) + behind);
                found = add_chunks(block, found, from, to - from, member, w + 10, false, lanes);
            }
            w += 1;
        }
    }
    found
}

/// Appends the chunks of the `length` particles from `from` on, at least one if `always`; returns how many
/// chunks there are then.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
unsafe fn add_chunks<T: Scalar>(
    block: &mut Block<T>,
    found: usize,
    from: u32,
    length: u32,
    member: usize,
    shift: usize,
    always: bool,
    lanes: usize,
) -> usize {
    // SAFETY: chunks have room for two more; more make room.
    unsafe {
        let lanes = lanes as u32;
        if length > 2 * lanes {
            return add_many_chunks(block, found, from, length, member, shift, lanes);
        }
        // Both are written, and counted as needed: there is no branch to foresee.
        let chunk = Chunk { from, to: from + length, member: member as u32, shift: shift as u32 };
        let out = block.chunks.as_mut_ptr().add(found);
        *out = chunk;
        *out.add(1) = Chunk { from: from + lanes, ..chunk };
        found + (always || length > 0) as usize + (length > lanes) as usize
    }
}

#[cold]
#[inline(never)]
fn add_many_chunks<T: Scalar>(
    block: &mut Block<T>,
    found: usize,
    from: u32,
    length: u32,
    member: usize,
    shift: usize,
    lanes: u32,
) -> usize {
    let pieces = length.div_ceil(lanes);
    let end = from + length;
    block.reserve_chunks(found + pieces as usize);
    for p in 0..pieces {
        let from = from + p * lanes;
        let to = end.min(from + lanes);
        block.chunks[found + p as usize] = Chunk { from, to, member: member as u32, shift: shift as u32 };
    }
    found + pieces as usize
}
