use std::marker::PhantomData;
use std::ops::Range;

/// A slice that several threads work on, each on elements of its own.
///
/// While it lives the slice is mutably borrowed, so nobody reaches the elements in another way, and a `Vec` behind them
/// stays where it is. Which thread may access which elements is the promise of those who call the unsafe functions.
pub struct SharedSlice<'a, T> {
    first: *mut T,
    len: usize,
    borrowed: PhantomData<&'a mut [T]>,
}

impl<T> Clone for SharedSlice<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for SharedSlice<'_, T> {}

// SAFETY: it stands for a mutable borrow, which may be sent where `T` may.
unsafe impl<T: Send> Send for SharedSlice<'_, T> {}
// SAFETY: every access to an element is through an unsafe function, whose caller promises that no other thread accesses
// the element meanwhile, but for threads that all read, of a `T` that is `Sync`.
unsafe impl<T: Send> Sync for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    /// Lends the elements of `slice`.
    pub fn new(slice: &'a mut [T]) -> SharedSlice<'a, T> {
        SharedSlice { first: slice.as_mut_ptr(), len: slice.len(), borrowed: PhantomData }
    }

    /// How many elements there are.
    pub fn len(self) -> usize {
        self.len
    }

    /// The first element, to read from.
    #[inline(always)]
    pub fn as_ptr(self) -> *const T {
        self.first
    }

    /// Element `at`, or the end.
    ///
    /// # Safety
    /// `at` is no more than the number of elements.
    #[inline(always)]
    pub unsafe fn at(self, at: usize) -> *mut T {
        debug_assert!(at <= self.len);
        // SAFETY: within the slice or one past its end, as the caller promises.
        unsafe { self.first.add(at) }
    }

    /// Elements to read and write.
    ///
    /// # Safety
    /// While the result is in use nobody else accesses these elements.
    #[allow(clippy::mut_from_ref)] // Elements differ from call to call, as the caller promises.
    pub unsafe fn slice_mut(self, range: Range<usize>) -> &'a mut [T] {
        assert!(range.start <= range.end && range.end <= self.len, "a range of the slice");
        // SAFETY: within the slice, which is mutably borrowed for `'a`; nobody else accesses these elements, as the
        // caller promises.
        unsafe { std::slice::from_raw_parts_mut(self.first.add(range.start), range.len()) }
    }

    /// Elements to read.
    ///
    /// # Safety
    /// While the result is in use nobody writes these elements.
    pub unsafe fn slice(self, range: Range<usize>) -> &'a [T]
    where
        T: Sync,
    {
        assert!(range.start <= range.end && range.end <= self.len, "a range of the slice");
        // SAFETY: within the slice, which is borrowed for `'a`; nobody writes these elements, as the caller promises.
        unsafe { std::slice::from_raw_parts(self.first.add(range.start), range.len()) }
    }
}
