//! Allocates large arrays in large pages.
//!
//! A step accesses some twenty arrays over all particles, each at many places at once. From some ten
//! thousand particles on, these are more pages of 4 KiB than the processor's address cache holds. Where
//! Linux leaves the choice to programs (`/sys/kernel/mm/transparent_hugepage/enabled` says `madvise`,
//! as in most distributions), it gives pages of 2 MiB to programs that ask for them.

use std::alloc::{GlobalAlloc, Layout, System};

/// Size of a large page in bytes.
const PAGE: usize = 2 << 20;

/// The allocator of the system, except that arrays of a large page or more are mapped by themselves: they begin at a large page, and ask for
/// all that they fill. What is left at their end stays in small pages: of arrays of each plane, some megabytes long, it is a third. Their memory goes
/// back to the system when they are released; the system's allocator would keep that of lists that grew, a sixth of all.
pub struct LargePages;

/// Lets the allocator of glibc keep the memory of smaller arrays that are released, some megabytes in all. It gives back what is free at the
/// end of its heap beyond twice the largest array that had a mapping of its own, at first 256 KiB, and pages that it takes again are
/// cleared: that of the arrays of each sample took 2 to 7 % of short runs.
pub fn keep_released() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(PAGE - 1)));
}

/// The layout of an array that fills large pages; `None` for other arrays.
fn in_pages(layout: Layout) -> Option<Layout> {
    if layout.size() < PAGE {
        return None;
    }
    Layout::from_size_align(layout.size(), layout.align().max(PAGE)).ok()
}

#[cfg(target_os = "linux")]
mod mapped {
    use super::{Layout, PAGE};
    use rustix::mm::{Advice, MapFlags, ProtFlags, madvise, mmap_anonymous, munmap};
    use std::ptr::null_mut;

    /// Size of a small page in bytes, or a multiple of it.
    const SMALL: usize = 1 << 16;

    /// Maps zeros for an array that fills large pages.
    ///
    /// # Safety
    /// The size of the layout is not zero.
    pub unsafe fn alloc(layout: Layout) -> *mut u8 {
        let size = layout.size().next_multiple_of(SMALL);
        let Some(all) = size.checked_add(layout.align()) else { return null_mut() };
        // SAFETY: the new mapping overlaps nothing.
        let mapped =
            unsafe { mmap_anonymous(null_mut(), all, ProtFlags::READ | ProtFlags::WRITE, MapFlags::PRIVATE) };
        let Ok(mapped) = mapped else { return null_mut() };
        let before = mapped.cast::<u8>().align_offset(layout.align());
        let behind = all - before - size;
        // SAFETY: both ends are parts of the mapping that nothing uses, and whole pages; the advice does not change what memory contains.
        unsafe {
            let first = mapped.cast::<u8>().add(before);
            if before > 0 {
                let _ = munmap(mapped, before);
            }
            if behind > 0 {
                let _ = munmap(first.add(size).cast(), behind);
            }
            // Without large pages the program is slower, but correct.
            let _ = madvise(first.cast(), layout.size() / PAGE * PAGE, Advice::LinuxHugepage);
            first
        }
    }

    /// # Safety
    /// The memory is that of [`alloc`] for this layout.
    pub unsafe fn dealloc(memory: *mut u8, layout: Layout) {
        // SAFETY: the caller promises a whole mapping.
        let _ = unsafe { munmap(memory.cast(), layout.size().next_multiple_of(SMALL)) };
    }
}

#[cfg(not(target_os = "linux"))]
mod mapped {
    use super::{GlobalAlloc, Layout, System};

    /// # Safety
    /// The size of the layout is not zero.
    pub unsafe fn alloc(layout: Layout) -> *mut u8 {
        // SAFETY: the caller promises a size above zero.
        unsafe { System.alloc_zeroed(layout) }
    }

    /// # Safety
    /// The memory is that of [`alloc`] for this layout.
    pub unsafe fn dealloc(memory: *mut u8, layout: Layout) {
        // SAFETY: the memory is the system allocator's, with this layout.
        unsafe { System.dealloc(memory, layout) }
    }
}

// SAFETY: memory is released as it was allocated: how is a function of the caller's layout alone.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller promises a layout of more than zero bytes.
        unsafe { in_pages(layout).map_or_else(|| System.alloc(layout), |pages| mapped::alloc(pages)) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above; mapped memory is zero.
        unsafe { in_pages(layout).map_or_else(|| System.alloc_zeroed(layout), |pages| mapped::alloc(pages)) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller promises the layout given to `alloc`, so that this is how the memory was allocated.
        unsafe {
            match in_pages(layout) {
                None => System.dealloc(memory, layout),
                Some(pages) => mapped::dealloc(memory, pages),
            }
        }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if layout.size() < PAGE && size < PAGE {
            // SAFETY: both sizes are small, so that the memory is the system's with this layout; the caller promises
            // that it is allocated, and a size above zero that does not overflow when rounded up to the alignment.
            return unsafe { System.realloc(memory, layout, size) };
        }
        // SAFETY: the caller promises a size above zero that does not overflow when rounded up to the
        // alignment, so that `new` is a layout; `to` has `size` bytes, `memory` those of `layout`, and
        // they do not overlap; `memory` is released with the layout of its allocation.
        unsafe {
            let new = Layout::from_size_align_unchecked(size, layout.align());
            let to = self.alloc(new);
            if !to.is_null() {
                std::ptr::copy_nonoverlapping(memory, to, layout.size().min(size));
                self.dealloc(memory, layout);
            }
            to
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arrays that grow and shrink across the limits keep their contents and their alignment.
    #[test]
    fn arrays_keep_their_contents() {
        let sizes =
            [1, 1000, PAGE - 8, PAGE, PAGE + 8, 2 * PAGE, 2 * PAGE + 8, 3 * PAGE, PAGE, 64, 5 * PAGE + 16];
        for align in [1, 8, 64, 4096] {
            let layout = |size| Layout::from_size_align(size, align).unwrap();
            // SAFETY: sizes are not zero, each layout is that of the allocation; contents are written before they are read.
            unsafe {
                let mut memory = LargePages.alloc(layout(sizes[0]));
                for of in 0..sizes.len() {
                    let size = sizes[of];
                    assert!(!memory.is_null() && memory.addr().is_multiple_of(align));
                    assert!(size < PAGE || memory.addr().is_multiple_of(PAGE));
                    for at in (0..size).step_by(61) {
                        memory.add(at).write((at % 251) as u8);
                    }
                    let Some(&next) = sizes.get(of + 1) else { break };
                    memory = LargePages.realloc(memory, layout(size), next);
                    for at in (0..size.min(next)).step_by(61) {
                        assert_eq!(memory.add(at).read(), (at % 251) as u8, "{size} to {next}");
                    }
                }
                LargePages.dealloc(memory, layout(sizes[sizes.len() - 1]));
                let zeros = LargePages.alloc_zeroed(layout(PAGE + 1));
                assert!((0..=PAGE).all(|at| zeros.add(at).read() == 0));
                LargePages.dealloc(zeros, layout(PAGE + 1));
            }
        }
    }
}
