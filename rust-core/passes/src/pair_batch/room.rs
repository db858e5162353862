//! Growth of lists.

/// Makes room for `more` elements plus an eighth of the length: the doubling of `Vec` would waste much memory.
#[inline(always)]
pub fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 8));
    }
}
