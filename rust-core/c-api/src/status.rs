//! Status codes, the last error, and the guard that stops panics.

use psidpd_core::document::{FileError, FileErrorKind};
use psidpd_core::engine::EngineError;
use psidpd_core::model::expression::TooLarge;
use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The outcome of a call. The values keep their meaning in every version; later versions may add some.
#[must_use]
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The call succeeded.
    Ok = 0,
    /// An argument is out of its domain: a length, an index, a flag, a text that is not UTF-8.
    InvalidArgument = 1,
    /// A pointer that must not be null is null.
    NullPointer = 2,
    /// A file cannot be read.
    File = 3,
    /// A model file does not define a valid model, or not at this temperature.
    Model = 4,
    /// Forces cannot be computed for these particles: a position, tag, type, psi or force is invalid.
    /// The message names the particle.
    Engine = 5,
    /// A call that must precede this one has not been made, or has failed.
    CallOrder = 6,
    /// An internal error of this library. The next evaluation makes the engine usable again.
    Panic = 255,
}

/// A status other than [`Status::Ok`], and its message.
#[derive(Debug)]
pub(super) struct Failure {
    status: Status,
    text: String,
}

impl Failure {
    pub fn new(status: Status, text: impl Into<String>) -> Failure {
        Failure { status, text: text.into() }
    }

    /// The failure of an argument out of its domain.
    pub fn argument(text: impl Into<String>) -> Failure {
        Failure::new(Status::InvalidArgument, text)
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Failure {
        let status = match *error.kind {
            FileErrorKind::Unreadable(_) => Status::File,
            _ => Status::Model,
        };
        Failure::new(status, error.to_string())
    }
}

impl From<TooLarge> for Failure {
    fn from(error: TooLarge) -> Failure {
        Failure::new(Status::Model, error.to_string())
    }
}

impl From<EngineError> for Failure {
    fn from(error: EngineError) -> Failure {
        let status = match error {
            EngineError::Host(_) | EngineError::Reach(_) => Status::InvalidArgument,
            _ => Status::Engine,
        };
        Failure::new(status, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Converts a text to a C string; a zero byte, which would end it, becomes U+FFFD.
pub(super) fn c_text(text: &str) -> CString {
    // A text without zero bytes always converts.
    CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default()
}

fn record(text: &str) {
    let text = c_text(text);
    // If the thread is ending and its last error is gone, no caller can read the message.
    let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = text);
}

/// Does `work`, and turns errors and panics into a status. Errors become text inside `work`, so
/// that a panic there is caught too.
pub(super) fn guard(work: impl FnOnce() -> Result<(), Failure>) -> Status {
    // State that a panic leaves incomplete is either discarded or, in an engine, marked as not ready.
    let outcome = catch_unwind(AssertUnwindSafe(|| match work() {
        Ok(()) => Status::Ok,
        Err(Failure { status, text }) => {
            record(&text);
            status
        }
    }));
    outcome.unwrap_or_else(|payload| {
        let recorded = catch_unwind(AssertUnwindSafe(|| record(&panic_text(payload.as_ref()))));
        // Dropping the payload, which may be of any type, could panic again.
        std::mem::forget(payload);
        if let Err(again) = recorded {
            std::mem::forget(again);
        }
        Status::Panic
    })
}

fn panic_text(payload: &(dyn Any + Send)) -> String {
    let what = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message");
    format!("internal error, please report it: {what}")
}

/// The message of the last call on this thread that failed, empty if none has. UTF-8.
///
/// Valid until the next call on this thread that fails, and until the thread ends. Calls that succeed
/// leave it alone, so look at the status first.
#[unsafe(no_mangle)]
pub extern "C" fn psidpd_last_error() -> *const c_char {
    let text = catch_unwind(|| LAST_ERROR.try_with(|last| last.borrow().as_ptr()));
    text.ok().and_then(Result::ok).unwrap_or(c"".as_ptr())
}
