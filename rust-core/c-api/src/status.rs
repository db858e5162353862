//! Status codes, the last error, and the wall that no panic gets through.

use psidpd_core::document::{FileError, FileErrorKind};
use psidpd_core::engine::EngineError;
use psidpd_core::model::expression::TooLarge;
use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a call came to. The values keep their meaning in every version; later versions may add some.
#[must_use]
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// An argument out of its domain: a length, an index, a flag, a text that is not UTF-8.
    InvalidArgument = 1,
    /// A pointer that must not be null is.
    NullPointer = 2,
    /// A file cannot be read.
    File = 3,
    /// A model file says something that makes no model, or none at this temperature.
    Model = 4,
    /// Forces cannot be computed for these particles: a position, a tag, a type, psi or a force is not
    /// what it must be. The message names the particle.
    Engine = 5,
    /// A call that must come after another one that has not been made, or has failed.
    CallOrder = 6,
    /// A fault in this library. An engine can be used again after psidpd_engine_densities.
    Panic = 255,
}

/// A status that is not [`Status::Ok`], and its message.
#[derive(Debug)]
pub(super) struct Failure {
    status: Status,
    text: String,
}

impl Failure {
    pub fn new(status: Status, text: impl Into<String>) -> Failure {
        Failure { status, text: text.into() }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Failure {
        let status = match error.kind() {
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

/// A text as C has it; a zero byte, which would end it, becomes U+FFFD.
pub(super) fn c_text(text: &str) -> CString {
    // Without zero bytes this cannot fail.
    CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default()
}

fn record(text: &str) {
    let text = c_text(text);
    // A thread that is ending, and has no last error any more, has nobody to read it either.
    let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = text);
}

/// Does `work`, and turns errors and panics into a status. Errors are turned into text inside `work`, behind
/// the same wall.
pub(super) fn guard(work: impl FnOnce() -> Result<(), Failure>) -> Status {
    // What a panic leaves half done is either thrown away or, in an engine, marked as not ready.
    let outcome = catch_unwind(AssertUnwindSafe(|| match work() {
        Ok(()) => Status::Ok,
        Err(Failure { status, text }) => {
            record(&text);
            status
        }
    }));
    outcome.unwrap_or_else(|payload| {
        let recorded = catch_unwind(AssertUnwindSafe(|| record(&panic_text(payload.as_ref()))));
        // The payload is anything at all, so dropping it may panic once more.
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
