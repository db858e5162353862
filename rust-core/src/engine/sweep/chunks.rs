//! Spans of bins as chunks of sixteen particles, each to be compared with a team of up to four, or eight.

use super::arithmetic::Record;
use super::block::{Block, EIGHT};
use super::layer::Swept;
use super::simd::{Isa, Reals, Scalar};
use super::windows::{Bins, Ends, Spans, View, Windows};

/// Particles that are compared at once.
pub const FOUR: usize = 4;

/// Fours of the largest team.
pub const FOURS: usize = 2;

/// Sixteen particles that a team is to be compared with.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct Chunk {
    /// Which of them: sixteen bits for the first of the first four of the team, then for the second …
    pub allowed: u64,
    pub from: u32,
    /// The slot of its masks, and the shift that the team sees these with, in the lowest eight bits.
    pub note: u32,
}

/// Particles of a group that look together.
#[derive(Debug, Clone, Copy, Default)]
pub struct Team {
    /// The first in the group, and how many.
    pub first: u8,
    pub many: u8,
    /// Their slots, of eight each: from, and to before.
    pub eights: [u32; 2],
}

/// A group of particles of one row, whose spans are to be cut.
pub struct Group<'a> {
    pub view: &'a View,
    pub windows: &'a Windows,
    pub ends: Ends,
    /// The first, and how many.
    pub first: usize,
    pub count: usize,
}

/// Cuts the spans of a group into chunks. Up to `MANY` particles that follow each other closely look together.
#[inline(always)]
pub unsafe fn cut<I: Isa, T: Scalar, const GHOSTS: bool, const MANY: usize>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    spans: &mut Spans,
    block: &mut Block<T>,
) {
    // SAFETY: the arrays are as `Swept` says, chunks have room.
    unsafe {
        let Group { view, windows, count, ends, .. } = *group;
        let mut found = 0;
        let mut teams = 0;
        let mut eights = 0;
        let mut a = 0;
        while a < count {
            let mut many = MANY.min(count - a);
            if ends.together >> (a / I::F32::LANES) & 1 == 0 {
                // Vectors have spans of one or of the other kind.
                many = many.min(I::F32::LANES - a % I::F32::LANES);
                let x = std::slice::from_raw_parts(swept.x[0].at(group.first + a), many);
                many = join(x, view.joined, spans, a);
            }
            let begin = found;
            let look = Look {
                slots: (EIGHT * eights).wrapping_sub(found),
                who: *MEMBERS.get_unchecked(many),
                ghosts: match GHOSTS {
                    // There is room for a vector behind the last.
                    true => ghosts(swept.ghost.as_ptr().add(group.first + a).cast::<u64>().read_unaligned()),
                    false => [0; FOURS],
                },
            };
            // In their own row they look at those behind them.
            let row = *windows.row.get_unchecked(0);
            let range = [(group.first + a + 1) as u32, *row.add(bin(&spans.end, 0, a))];
            found = add::<T, GHOSTS, MANY, true>(swept, group, block, found, range, 5, &look);
            let mut w = 1;
            while w < 5 {
                let row = *windows.row.get_unchecked(w);
                let range = [*row.add(bin(&spans.low, w, a)), *row.add(bin(&spans.end, w, a))];
                found = add::<T, GHOSTS, MANY, false>(swept, group, block, found, range, w + 5, &look);
                w += 1;
            }
            // Rows that go on in the period before, and in the next.
            let bits = (1u32 << many) - 1;
            if ends.before >> a & bits != 0 {
                let mut w = 1;
                while w < 5 {
                    let row = *windows.row.get_unchecked(w);
                    let range = [*row.add(bin(&spans.before, w, a)), *row.add(view.bins as usize)];
                    found = add::<T, GHOSTS, MANY, false>(swept, group, block, found, range, w, &look);
                    w += 1;
                }
            }
            if ends.after >> a & bits != 0 {
                let mut w = 0;
                while w < 5 {
                    let row = *windows.row.get_unchecked(w);
                    let range = [*row, *row.add(bin(&spans.after, w, a))];
                    found = add::<T, GHOSTS, MANY, false>(swept, group, block, found, range, w + 10, &look);
                    w += 1;
                }
            }
            // There is one at least.
            let next = eights + (found - begin).div_ceil(EIGHT);
            *block.teams.get_unchecked_mut(teams) =
                Team { first: a as u8, many: many as u8, eights: [eights as u32, next as u32] };
            eights = next;
            teams += 1;
            a += many;
        }
        block.team_count = teams;
        block.chunk_count = found;
    }
}

#[inline(always)]
unsafe fn bin(bins: &Bins, w: usize, a: usize) -> usize {
    // SAFETY: of a group.
    unsafe { *bins.get_unchecked(w).get_unchecked(a) as usize }
}

/// Makes the spans of particle `a` of a group those of all particles that look together with it: of those at `x` the
/// first ones that are near enough to the first. Returns how many.
#[cold]
#[inline(never)]
fn join(x: &[f32], joined: f32, spans: &mut Spans, a: usize) -> usize {
    let many = x.iter().take_while(|other| (**other - x[0]).abs() <= joined).count().max(1);
    let all = a..a + many;
    for w in 0..5 {
        for lowest in [&mut spans.low[w], &mut spans.before[w]] {
            lowest[a] = lowest[all.clone()].iter().copied().fold(lowest[a], i32::min);
        }
        for highest in [&mut spans.end[w], &mut spans.after[w]] {
            highest[a] = highest[all.clone()].iter().copied().fold(highest[a], i32::max);
        }
    }
    many
}

/// Who looks.
struct Look {
    /// Added to the number of a chunk this is its slot; it wraps.
    slots: usize,
    /// Sixteen bits for each that is there, four by four.
    who: [u64; FOURS],
    /// The same for each that is a ghost.
    ghosts: [u64; FOURS],
}

/// Sixteen bits for each of the first particles of a team, four by four.
static MEMBERS: [[u64; FOURS]; FOURS * FOUR + 1] = members();

const fn members() -> [[u64; FOURS]; FOURS * FOUR + 1] {
    let mut table = [[0; FOURS]; FOURS * FOUR + 1];
    let mut many = 1;
    while many <= FOURS * FOUR {
        let bits = u128::MAX >> (128 - 16 * many);
        table[many] = [bits as u64, (bits >> 64) as u64];
        many += 1;
    }
    table
}

/// The bits of the first of thirty-two particles, for each of four that look: those of the first chunk, and of the
/// second.
static FIRST_BITS: [[u64; 2]; 33] = first_bits();

/// In notes.
const ONE_SLOT: u32 = 1 << 8;

/// Sixteen bits for each of four.
const EACH: u64 = 0x0001_0001_0001_0001;

/// In the chunk that begins behind the first of the team: those behind each of them.
const BEHIND: [u64; FOURS] = [0xfff8_fffc_fffe_ffff, 0xff80_ffc0_ffe0_fff0];

const fn first_bits() -> [[u64; 2]; 33] {
    let mut table = [[0; 2]; 33];
    let mut length = 0;
    while length <= 32 {
        let bits = (1u64 << length) - 1;
        table[length] = [(bits & 0xffff) * EACH, (bits >> 16) * EACH];
        length += 1;
    }
    table
}

/// Appends the chunks of the particles `from..to`, at least one if they are those behind the team in its own row;
/// returns how many there are then.
#[inline(always)]
unsafe fn add<T: Scalar, const GHOSTS: bool, const MANY: usize, const OWN: bool>(
    swept: &Swept<T, impl Record>,
    group: &Group,
    block: &mut Block<T>,
    found: usize,
    [mut from, mut to]: [u32; 2],
    shift: usize,
    look: &Look,
) -> usize {
    // SAFETY: chunks have room for two more; more make room.
    unsafe {
        let mut owned = [[u64::MAX; FOURS]; 2];
        if GHOSTS {
            // Two ghosts are no concern of this rank.
            if both(look.ghosts, look.who) == look.who {
                let [first, last] = *group.windows.owned.get_unchecked(shift % 5);
                if !OWN {
                    from = from.max(first);
                }
                to = to.min(last);
            }
            let from = from as usize;
            owned = [from, from + 16].map(|from| concerned(look.ghosts, swept.owned_bits(from)));
        }
        let length = to.saturating_sub(from) as usize;
        let note = (look.slots.wrapping_add(found) << 8 | shift) as u32;
        let who = if OWN { both(look.who, BEHIND) } else { look.who };
        if length > 32 {
            return add_many(swept, block, found, from, to, who, look, note);
        }
        // Both are written, and counted as needed: there is no branch to foresee.
        let bits = FIRST_BITS.get_unchecked(length).map(|bits| [bits; FOURS]);
        let [first, next] = [both(bits[0], both(who, owned[0])), both(bits[1], both(look.who, owned[1]))];
        let out = block.chunks.as_mut_ptr().add(found);
        *out = Chunk { allowed: first[0], from, note };
        *out.add(1) = Chunk { allowed: next[0], from: from + 16, note: note + ONE_SLOT };
        if MANY > FOUR {
            block.allowed.as_mut_ptr().add(found).cast::<[u64; 2]>().write_unaligned([first[1], next[1]]);
        }
        found + (OWN || length > 0) as usize + (length > 16) as usize
    }
}

#[inline(always)]
fn both(a: [u64; FOURS], b: [u64; FOURS]) -> [u64; FOURS] {
    std::array::from_fn(|f| a[f] & b[f])
}

/// Which of sixteen particles concern this rank, of which `owned` are no ghosts, for a team.
#[inline(always)]
fn concerned(ghosts: [u64; FOURS], owned: u32) -> [u64; FOURS] {
    let owned = EACH * u64::from(owned);
    ghosts.map(|ghosts| !ghosts | owned)
}

/// Sixteen bits for each of eight particles that is a ghost, of a byte for each that is 1 then.
#[inline(always)]
fn ghosts(bytes: u64) -> [u64; FOURS] {
    [bytes & 0xffff_ffff, bytes >> 32].map(|four| {
        let spread =
            four & 0xff | (four & 0xff00) << 8 | (four & 0xff_0000) << 16 | (four & 0xff00_0000) << 24;
        0xffff * spread
    })
}

/// More chunks than two; `first` look at the first of them.
#[cold]
#[inline(never)]
#[allow(clippy::too_many_arguments)]
fn add_many<T: Scalar>(
    swept: &Swept<T, impl Record>,
    block: &mut Block<T>,
    mut found: usize,
    from: u32,
    to: u32,
    first: [u64; FOURS],
    look: &Look,
    mut note: u32,
) -> usize {
    block.reserve_chunks(found + (to - from).div_ceil(16) as usize);
    for begin in (from..to).step_by(16) {
        let bits = [FIRST_BITS[(to - begin).min(16) as usize][0]; FOURS];
        let mut allowed = both(bits, if begin == from { first } else { look.who });
        if !swept.ghost.is_empty() {
            // SAFETY: of a chunk.
            allowed = both(allowed, concerned(look.ghosts, unsafe { swept.owned_bits(begin as usize) }));
        }
        block.chunks[found] = Chunk { allowed: allowed[0], from: begin, note };
        block.allowed[found] = allowed[1];
        note += ONE_SLOT;
        found += 1;
    }
    found
}
