//! Arrays of numpy that show numbers of this package.

use numpy::ndarray::ArrayView2;
use numpy::{PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// The numbers that an array shows, in rows of three. The array does not own them: it cannot be resized, nor be made
/// writable, and they live as long as it or a view of it.
#[pyclass(frozen, module = "psidpd")]
pub struct Lent {
    bits: Box<[AtomicU64]>,
}

impl Lent {
    /// An array of these numbers, which can only be read.
    pub fn array<'py>(py: Python<'py>, vectors: &[[f64; 3]]) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let bits = vectors.as_flattened().iter().map(|x| AtomicU64::new(x.to_bits())).collect();
        let lent = Bound::new(py, Lent { bits })?;
        let first = lent.get().bits.as_ptr().cast::<f64>();
        // SAFETY: an atomic word has the size and the alignment of a number, and every bit pattern is a number. The box is
        // never replaced, and lives as long as its object, which is the base of the array.
        let array = unsafe {
            let numbers = ArrayView2::from_shape_ptr([vectors.len(), 3], first);
            PyArray2::borrow_from_array(&numbers, lent.into_any())
        };
        array.readwrite().make_nonwriteable();
        Ok(array)
    }

    /// Changes the numbers that an array of [`Lent::array`] shows; does nothing if the user has given it others.
    pub fn renew(array: &Bound<PyArray2<f64>>, vectors: &[[f64; 3]]) -> PyResult<()> {
        if let Ok(lent) = array.getattr("base")?.cast::<Lent>() {
            let numbers = lent.get().bits.iter().zip(vectors.as_flattened());
            numbers.for_each(|(bits, x)| bits.store(x.to_bits(), Ordering::Relaxed));
        }
        Ok(())
    }
}
