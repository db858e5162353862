//! Prefetches the host's data into the cache.

/// Number of particles by which prefetching is ahead: the hardware does not predict the order of the host.
pub const PREFETCH_DISTANCE: usize = 64;

/// Prefetches a value, at both ends if it may be in two cache lines.
#[inline(always)]
pub fn prefetch<T>(value: *const T) {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, which reads nothing and accepts any address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(value.cast()) };
        if size_of::<T>() > align_of::<T>() {
            // SAFETY: every x86-64 processor has the instruction, which reads nothing and accepts any address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(value.cast::<i8>().wrapping_add(size_of::<T>() - 1)) };
        }
    }
    #[cfg(not(all(target_arch = "x86_64", not(miri))))]
    let _ = value;
}
