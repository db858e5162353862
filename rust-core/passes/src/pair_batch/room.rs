//! Growing lists.

/// Makes room for `more`, an eighth of the length in advance: the doubling of `Vec` would be a good part of all memory.
#[inline(always)]
pub fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 8));
    }
}
