//! Large arrays in large pages.
//!
//! A step goes through some twenty arrays over all particles, at many places of each at once: more pages of 4 KiB than
//! a processor keeps the addresses of, from some ten thousand particles on. Where Linux leaves the choice to programs
//! (`/sys/kernel/mm/transparent_hugepage/enabled` says `madvise`, as most distributions have it), it gives pages of
//! 2 MiB to those that ask.

use std::alloc::{GlobalAlloc, Layout, System};

/// A large page.
const PAGE: usize = 2 << 20;

/// Smaller arrays fit into few pages as they are, and would leave most of a large one empty, all of which Linux clears when it
/// gives it: observables allocate anew for each sample.
const LARGE: usize = PAGE / 4;

/// The allocator of the system, but that large arrays begin and end with large pages, and ask for them.
pub struct LargePages;

/// How a large array is allocated; `None` for others.
fn in_pages(layout: Layout) -> Option<Layout> {
    if layout.size() < LARGE {
        return None;
    }
    let size = layout.size().checked_next_multiple_of(PAGE)?;
    Layout::from_size_align(size, layout.align().max(PAGE)).ok()
}

// SAFETY: memory is the system's, of the same layout when it is allocated and when it is given back: that is a function
// of the layout alone.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let Some(pages) = in_pages(layout) else {
            // SAFETY: the caller promises a layout of more than zero bytes, as the system's allocator asks.
            return unsafe { System.alloc(layout) };
        };
        // SAFETY: a large layout is of more than zero bytes.
        let memory = unsafe { System.alloc(pages) };
        #[cfg(target_os = "linux")]
        if !memory.is_null() {
            use rustix::mm::{Advice, madvise};
            // Without large pages everything works as well.
            // SAFETY: advice changes nothing that a program sees.
            let _ = unsafe { madvise(memory.cast(), pages.size(), Advice::LinuxHugepage) };
        }
        memory
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller promises the layout that `alloc` had, so this is the one that the system's allocator had.
        unsafe { System.dealloc(memory, in_pages(layout).unwrap_or(layout)) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if layout.size() < LARGE && size < LARGE {
            // SAFETY: small before and after, so it is the system's with this very layout; the caller promises that it is
            // allocated, and a size above zero that does not overflow when rounded up to the alignment.
            return unsafe { System.realloc(memory, layout, size) };
        }
        // SAFETY: the caller promises a size above zero that does not overflow when rounded up to the alignment, so `new` is
        // a layout; `to` has `size` bytes, `memory` those of `layout`, and they do not overlap; `memory` is given back with
        // the layout that it was allocated with.
        unsafe {
            let new = Layout::from_size_align_unchecked(size, layout.align());
            if let (Some(old), Some(new)) = (in_pages(layout), in_pages(new))
                && old == new
            {
                return memory;
            }
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

    /// Arrays that grow and shrink over the limits keep what is in them, and begin where their alignment says.
    #[test]
    fn arrays_keep_their_contents() {
        let sizes =
            [1, 1000, LARGE - 8, LARGE, LARGE + 8, PAGE, PAGE + 8, 3 * PAGE, LARGE, 64, 5 * PAGE + 16];
        for align in [1, 8, 64, 4096] {
            let layout = |size| Layout::from_size_align(size, align).unwrap();
            // SAFETY: sizes are not zero, layouts those of before; contents are written before they are read.
            unsafe {
                let mut memory = LargePages.alloc(layout(sizes[0]));
                for of in 0..sizes.len() {
                    let size = sizes[of];
                    assert!(!memory.is_null() && memory.addr().is_multiple_of(align));
                    assert!(size < LARGE || memory.addr().is_multiple_of(PAGE));
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
