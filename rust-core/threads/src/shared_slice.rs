use std::marker::PhantomData;
use std::ops::Range;

/// A slice whose elements are divided among several threads.
///
/// While it lives the slice is mutably borrowed, so that no other code accesses the elements, and a `Vec` behind
/// them is not reallocated. Callers of the unsafe functions promise which thread accesses which elements.
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

// SAFETY: the value is a mutable borrow, which may be sent if `T` may.
unsafe impl<T: Send> Send for SharedSlice<'_, T> {}
// SAFETY: every access to an element is through an unsafe function, whose caller promises that no other
// thread accesses the element meanwhile, except that several threads may read a `T` that is `Sync`.
unsafe impl<T: Send> Sync for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    /// Lends the elements of `slice`.
    pub fn new(slice: &'a mut [T]) -> SharedSlice<'a, T> {
        SharedSlice { first: slice.as_mut_ptr(), len: slice.len(), borrowed: PhantomData }
    }

    /// The number of elements.
    pub fn len(self) -> usize {
        self.len
    }

    /// Whether the slice has no elements.
    pub fn is_empty(self) -> bool {
        self.len == 0
    }

    /// A pointer to the first element, for reading.
    #[inline(always)]
    pub fn as_ptr(self) -> *const T {
        self.first
    }

    /// A pointer to element `at`, or to the end.
    ///
    /// # Safety
    /// `at` is at most the number of elements.
    #[inline(always)]
    pub unsafe fn at(self, at: usize) -> *mut T {
        debug_assert!(at <= self.len);
        // SAFETY: the caller promises an element of the slice, or one past its end.
        unsafe { self.first.add(at) }
    }

    /// The elements of a range, for reading and writing.
    ///
    /// # Safety
    /// No other thread accesses these elements while the result is in use.
    #[allow(clippy::mut_from_ref)] // Elements differ from call to call, as the caller promises.
    #[inline]
    pub unsafe fn slice_mut(self, range: Range<usize>) -> &'a mut [T] {
        assert!(range.start <= range.end && range.end <= self.len, "a range of the slice");
        // SAFETY: the range is in the slice, which is mutably borrowed for `'a`; the caller promises
        // that no other thread accesses these elements.
        unsafe { std::slice::from_raw_parts_mut(self.first.add(range.start), range.len()) }
    }

    /// The elements of a range, for reading.
    ///
    /// # Safety
    /// No thread writes these elements while the result is in use.
    #[inline]
    pub unsafe fn slice(self, range: Range<usize>) -> &'a [T]
    where
        T: Sync,
    {
        assert!(range.start <= range.end && range.end <= self.len, "a range of the slice");
        // SAFETY: the range is in the slice, which is borrowed for `'a`; the caller promises that
        // no thread writes these elements.
        unsafe { std::slice::from_raw_parts(self.first.add(range.start), range.len()) }
    }
}
