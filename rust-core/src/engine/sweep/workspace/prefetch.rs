//! Fetching the host's data into the cache before they are needed.

/// How many particles ahead the host's data of a particle are prefetched: the order of the host looks random.
pub const PREFETCH_DISTANCE: usize = 64;

/// Prefetches a value, both its ends if they may be in two lines of the cache.
#[inline(always)]
pub fn prefetch<T>(value: *const T) {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor prefetches; nothing is read, and no address does harm.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(value.cast()) };
        if size_of::<T>() > align_of::<T>() {
            // SAFETY: every x86-64 processor prefetches; nothing is read, and no address does harm.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(value.cast::<i8>().wrapping_add(size_of::<T>() - 1)) };
        }
    }
    #[cfg(not(all(target_arch = "x86_64", not(miri))))]
    let _ = value;
}
