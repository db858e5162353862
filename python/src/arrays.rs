//! Arrays of numpy as slices.

use crate::errors::wrong;
use numpy::{PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Contiguous 64-bit floating-point numbers in C order. An array that already has this form is borrowed; all others are
/// copied.
pub fn numbers<'py>(object: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    as_array(object, name, "float64", "iuf", "real numbers")
}

/// Contiguous 32-bit integers in C order.
pub fn integers<'py>(object: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, i32>> {
    refuse_masked(object, name)?;
    let array = object.py().import("numpy")?.call_method1("asarray", (object,))?;
    // The conversion of numpy would wrap numbers that are too large.
    let outside = "iu".contains(&array.getattr("dtype")?.getattr("kind")?.extract::<String>()?)
        && array.getattr("size")?.extract::<usize>()? > 0
        && array.getattr("dtype")?.getattr("itemsize")?.extract::<usize>()? >= 4
        && array.call_method0("max")?.gt(i32::MAX)?;
    if outside {
        return Err(wrong(format!("{name}: a number is too large")));
    }
    as_array(&array, name, "int32", "iu", "whole numbers")
}

fn as_array<'py, T: numpy::Element>(
    object: &Bound<'py, PyAny>,
    name: &str,
    dtype: &str,
    kinds: &str,
    of: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    if let Ok(array) = object.cast_exact::<PyArrayDyn<T>>()
        && array.is_c_contiguous()
    {
        return readonly(array, name);
    }
    refuse_masked(object, name)?;
    let numpy = object.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (object,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let empty = array.getattr("size")?.extract::<usize>()? == 0;
    if !kinds.contains(&kind) && !empty {
        let dtype = array.getattr("dtype")?;
        return Err(wrong(format!("{name} must be an array of {of}, has the type {dtype}")));
    }
    let options = PyDict::new(object.py());
    options.set_item("dtype", dtype)?;
    options.set_item("order", "C")?;
    let array = numpy.call_method("asarray", (array,), Some(&options))?;
    readonly(array.cast()?, name)
}

/// Refuses masked arrays. Numpy would drop the mask silently, and the hidden elements would enter the computation.
fn refuse_masked(object: &Bound<PyAny>, name: &str) -> PyResult<()> {
    let masked = object.py().import("numpy.ma")?.call_method1("isMaskedArray", (object,))?;
    if masked.is_truthy()? {
        return Err(wrong(format!(
            "{name} is a masked array: choose its elements first, as {name}[keep], or fill it, {name}.filled(VALUE)"
        )));
    }
    Ok(())
}

fn readonly<'py, T: numpy::Element>(
    array: &Bound<'py, PyArrayDyn<T>>,
    name: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    use numpy::PyArrayMethods;
    array.try_readonly().map_err(|_| wrong(format!("{name} is being written to")))
}

/// A shape in the notation of numpy: `(3, 2)`, `(3,)`.
pub fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        all => format!("({})", all.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}
