//! Models, which are read from model files.

use crate::arguments::{Output, c_str, free, shared, text};
use crate::status::{Failure, Status, c_text, guard};
use psidpd_core::model;
use std::ffi::{CStr, CString, c_char};
use std::path::PathBuf;

/// A model file, read and checked. Threads may share one.
pub struct Model {
    pub(super) model: model::Model,
    title: CString,
    species: Vec<CString>,
}

impl Model {
    fn boxed(model: model::Model) -> *mut Model {
        let title = c_text(&model.title);
        let species = model.species().iter().map(|s| c_text(s)).collect();
        Box::into_raw(Box::new(Model { model, title, species }))
    }
}

#[cfg(unix)]
fn path_of(path: &CStr) -> Result<PathBuf, Failure> {
    use std::os::unix::ffi::OsStrExt;
    Ok(std::ffi::OsStr::from_bytes(path.to_bytes()).into())
}

#[cfg(not(unix))]
fn path_of(path: &CStr) -> Result<PathBuf, Failure> {
    let path = path.to_str().map_err(|_| Failure::argument("path is not UTF-8"))?;
    Ok(path.into())
}

/// Reads the model file at `path` and puts a new model in `*model`, to be freed with
/// psidpd_model_free. If it fails, `*model` is left alone.
///
/// # Errors
/// PSIDPD_STATUS_FILE if the file cannot be read, PSIDPD_STATUS_MODEL if something in it is
/// wrong; the message has line and key. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `path` ends with a zero byte; `model` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_model_open(path: *const c_char, model: *mut *mut Model) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `path` is null or ends with a zero byte and that `model` can be written to.
        let (path, out) = unsafe { (c_str(path, "path")?, Output::new(model, "model")?) };
        out.put(Model::boxed(model::Model::open(&path_of(path)?)?));
        Ok(())
    })
}

/// Reads a model from `text`, UTF-8; `name` stands for the file in messages. Puts a new model in
/// `*model`, to be freed with psidpd_model_free. If it fails, `*model` is left alone.
///
/// # Errors
/// PSIDPD_STATUS_MODEL if something in the text is wrong; the message has line and key.
/// PSIDPD_STATUS_INVALID_ARGUMENT if `name` or `text` is not UTF-8. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `name` and `text` end with a zero byte; `model` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_model_parse(
    name: *const c_char,
    text: *const c_char,
    model: *mut *mut Model,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `name` and `text` are null or end with a zero byte and
        // that `model` can be written to.
        let (name, text, out) =
            unsafe { (self::text(name, "name")?, self::text(text, "text")?, Output::new(model, "model")?) };
        out.put(Model::boxed(model::Model::parse(name, text)?));
        Ok(())
    })
}

/// Frees a model, and with it the texts that it has given out; NULL is ignored. Engines made from the
/// model live on.
///
/// # Safety
/// `model` is NULL or a model that has not been freed, and no other thread is using it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_model_free(model: *mut Model) {
    // SAFETY: the caller promises null or a handle that has not been freed and is not in use.
    unsafe { free(model) }
}

/// The title of a model, and the number of its dimensions and species.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct ModelFacts {
    /// The title; valid until the model is freed.
    pub title: *const c_char,
    /// The number of dimensions of space, 2 or 3.
    pub dimensions: usize,
    /// The number of species; psidpd_model_species_name has their names.
    pub species: usize,
}

/// Puts in `*facts` the title of the model, and the number of its dimensions and species.
///
/// # Errors
/// PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `facts` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_model_describe(model: *const Model, facts: *mut ModelFacts) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `model` is null or not freed and that `facts` can be written to.
        let (model, out) = unsafe { (shared(model, "model")?, Output::new(facts, "facts")?) };
        out.put(ModelFacts {
            title: model.title.as_ptr(),
            dimensions: model.model.dimensions(),
            species: model.species.len(),
        });
        Ok(())
    })
}

/// Puts in `*name` the name of species `index`, from 0; valid until the model is freed.
///
/// # Errors
/// PSIDPD_STATUS_INVALID_ARGUMENT if there is no such species. PSIDPD_STATUS_NULL_POINTER.
///
/// # Safety
/// `model` is NULL or a model that has not been freed; `name` can be written to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psidpd_model_species_name(
    model: *const Model,
    index: usize,
    name: *mut *const c_char,
) -> Status {
    guard(|| {
        // SAFETY: the caller promises that `model` is null or not freed and that `name` can be written to.
        let (model, out) = unsafe { (shared(model, "model")?, Output::new(name, "name")?) };
        let name = model.species.get(index).ok_or_else(|| {
            let text = format!("there is no species {index}: the model has {}", model.species.len());
            Failure::argument(text)
        })?;
        out.put(name.as_ptr());
        Ok(())
    })
}
