//! Errors of the library as exceptions.

use psidpd::checkpoint::Caller;
use psidpd::cli::Failure;
use pyo3::prelude::*;

pyo3::import_exception!(psidpd.errors, InputError);
pyo3::import_exception!(psidpd.errors, RunStoppedError);

/// The exception for an error, with the text that psidpd would end with: [`RunStoppedError`] if the exit code is 1,
/// else [`InputError`].
pub fn exception(error: impl Into<Failure>) -> PyErr {
    let failure = error.into();
    let text = failure.plain(Caller::Python);
    let text = text.strip_prefix("error: ").unwrap_or(&text).to_owned();
    match failure.exit_code() {
        1 => RunStoppedError::new_err(text),
        _ => InputError::new_err(text),
    }
}

/// The exception for a wrong argument.
pub fn wrong(text: impl Into<String>) -> PyErr {
    InputError::new_err(text.into())
}
