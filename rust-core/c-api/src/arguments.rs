//! Checks of the arguments that C callers pass.

use crate::status::{Failure, Status, guard};
use std::ffi::{CStr, c_char};

/// Fails for pointers that are null or not aligned for a `T`.
fn check<T>(pointer: *const T, name: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(Status::NullPointer, format!("{name} is NULL")));
    }
    if !pointer.is_aligned() {
        return Err(Failure::argument(format!("{name} is not aligned")));
    }
    Ok(())
}

/// # Safety
/// `pointer` is null or at a `T` that nobody writes to during `'a`.
pub(super) unsafe fn shared<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, Failure> {
    check(pointer, name)?;
    // SAFETY: `check` found it aligned and not null; the caller promises a `T` there that nobody writes to during `'a`.
    Ok(unsafe { &*pointer })
}

/// # Safety
/// `pointer` is null or at a `T` that nobody else reads or writes during `'a`.
pub(super) unsafe fn exclusive<'a, T>(pointer: *mut T, name: &str) -> Result<&'a mut T, Failure> {
    check(pointer, name)?;
    // SAFETY: `check` found it aligned and not null; the caller promises a `T` there that is nobody else's during `'a`.
    Ok(unsafe { &mut *pointer })
}

/// Frees what a function of this library has made and given out; null is ignored.
///
/// # Safety
/// `pointer` is null or at a `T` in a box that has been given out, not freed, and that no other thread is using.
pub(super) unsafe fn free<T>(pointer: *mut T) {
    let _ = guard(|| {
        if !pointer.is_null() {
            // SAFETY: the caller promises that the pointer came from `Box::into_raw` and has not been freed.
            drop(unsafe { Box::from_raw(pointer) });
        }
        Ok(())
    });
}

/// Copies the `T` at `pointer`.
///
/// # Safety
/// `pointer` is null or at a `T`.
pub(super) unsafe fn copied<T: Copy>(pointer: *const T, name: &str) -> Result<T, Failure> {
    check(pointer, name)?;
    // SAFETY: `check` found it aligned and not null; the caller promises a `T` there, which is `Copy`.
    Ok(unsafe { pointer.read() })
}

/// Copies the `T` at `pointer`, if there is one.
///
/// # Safety
/// `pointer` is null or at a `T`.
pub(super) unsafe fn optional<T: Copy>(pointer: *const T, name: &str) -> Result<Option<T>, Failure> {
    // SAFETY: the caller promises a `T` at a pointer that is not null.
    (!pointer.is_null()).then(|| unsafe { copied(pointer, name) }).transpose()
}

/// A place for a result, which may be uninitialised.
pub(super) struct Output<T>(*mut T);

impl<T> Output<T> {
    /// # Safety
    /// `pointer` is null or at memory for a `T` that can be written until [`Output::put`].
    pub unsafe fn new(pointer: *mut T, name: &str) -> Result<Output<T>, Failure> {
        check(pointer, name)?;
        Ok(Output(pointer))
    }

    pub fn put(self, value: T) {
        // SAFETY: `new` has checked the pointer; its caller promised that it can be written to.
        unsafe { self.0.write(value) }
    }
}

/// Fails for lengths that no array of `T` can have.
fn check_array<T>(pointer: *const T, length: usize, name: &str) -> Result<(), Failure> {
    check(pointer, name)?;
    match length.checked_mul(size_of::<T>()) {
        Some(bytes) if isize::try_from(bytes).is_ok() => Ok(()),
        _ => Err(Failure::argument(format!("{name} cannot be as long as {length}"))),
    }
}

/// An array of `length` elements; the pointer may be null if that is zero.
///
/// # Safety
/// `pointer` is null or at `length` times `T` that nobody writes to during `'a`.
pub(super) unsafe fn array<'a, T>(pointer: *const T, length: usize, name: &str) -> Result<&'a [T], Failure> {
    if length == 0 {
        return Ok(&[]);
    }
    check_array(pointer, length, name)?;
    // SAFETY: `check_array` found it aligned, not null, and no longer than an array can be; the caller promises that many
    // `T` there that nobody writes to during `'a`.
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// A writable array, as [`array`].
///
/// # Safety
/// `pointer` is null or at `length` times `T` that nobody else reads or writes during `'a`.
pub(super) unsafe fn array_mut<'a, T>(
    pointer: *mut T,
    length: usize,
    name: &str,
) -> Result<&'a mut [T], Failure> {
    if length == 0 {
        return Ok(&mut []);
    }
    check_array(pointer, length, name)?;
    // SAFETY: `check_array` found it aligned, not null, and no longer than an array can be; the caller promises that many
    // `T` there that are nobody else's during `'a`.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, length) })
}

/// Fails if the `length` vectors at `a`, which may be null, overlap those at `b`.
pub(super) fn check_apart(a: *const f64, b: *const f64, length: usize, what: &str) -> Result<(), Failure> {
    let bytes = length.saturating_mul(size_of::<[f64; 3]>());
    if !a.is_null() && a.addr().abs_diff(b.addr()) < bytes {
        return Err(Failure::argument(format!("{what} overlap")));
    }
    Ok(())
}

/// A UTF-8 text that ends with a zero byte.
///
/// # Safety
/// `pointer` is null or at bytes that end with a zero and that nobody writes to during `'a`.
pub(super) unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, Failure> {
    // SAFETY: `c_str` asks for what this function does: null, or bytes up to a zero that nobody writes to during `'a`.
    let bytes = unsafe { c_str(pointer, name) }?;
    bytes.to_str().map_err(|error| Failure::argument(format!("{name} is not UTF-8: {error}")))
}

/// # Safety
/// `pointer` is null or at bytes that end with a zero and that nobody writes to during `'a`.
pub(super) unsafe fn c_str<'a>(pointer: *const c_char, name: &str) -> Result<&'a CStr, Failure> {
    check(pointer, name)?;
    // SAFETY: `check` found it not null; the caller promises bytes up to a zero that nobody writes to during `'a`.
    Ok(unsafe { CStr::from_ptr(pointer) })
}

/// Reads a flag, which must be 0 or 1.
pub(super) fn flag(value: i32, name: &str) -> Result<bool, Failure> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Failure::argument(format!("{name} is {value}, not 0 or 1"))),
    }
}
