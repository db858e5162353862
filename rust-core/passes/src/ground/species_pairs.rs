//! Parameters of each pair of species, and their look-up for a vector of pairs.

use crate::simd::{Reals, Scalar, Words};

/// A number for each pair of species, row by row, padded to a vector.
#[derive(Debug, Clone)]
pub struct SpeciesPairTable<T> {
    entries: Vec<T>,
    count: usize,
}

impl<T: Scalar> SpeciesPairTable<T> {
    pub fn new(entries: impl IntoIterator<Item = T>) -> SpeciesPairTable<T> {
        let mut entries: Vec<T> = entries.into_iter().collect();
        let count = entries.len();
        entries.resize(count.max(16), T::default());
        SpeciesPairTable { entries, count }
    }

    pub fn of(count: usize, value: T) -> SpeciesPairTable<T> {
        SpeciesPairTable::new(std::iter::repeat_n(value, count))
    }

    #[inline(always)]
    pub fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub fn as_ptr(&self) -> *const T {
        self.entries.as_ptr()
    }
}

impl<T> std::ops::Index<usize> for SpeciesPairTable<T> {
    type Output = T;
    fn index(&self, at: usize) -> &T {
        &self.entries[at]
    }
}

impl<T> std::ops::IndexMut<usize> for SpeciesPairTable<T> {
    fn index_mut(&mut self, at: usize) -> &mut T {
        &mut self.entries[at]
    }
}

/// The pair of species of each pair of a vector: the index into tables.
#[derive(Clone, Copy)]
pub struct SpeciesPair<R: Reals>(pub R::Words);

impl<R: Reals> SpeciesPair<R> {
    /// Computes `species_i · species + species_j`.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn new(species_i: R::Words, species_j: R::Words, species: usize) -> SpeciesPair<R> {
        // SAFETY: the caller fulfils the contract of `simd`; the arithmetic reads no memory.
        unsafe {
            let mut row = R::Words::splat(0);
            let mut k = 0;
            while k < species {
                row = row.add(species_i);
                k += 1;
            }
            SpeciesPair(row.add(species_j))
        }
    }
}

/// A table, prepared for a loop over pairs.
#[derive(Clone, Copy)]
pub struct TableLookup<R: Reals> {
    first: R,
    entries: *const R::Scalar,
    fits_vector: bool,
}

impl<R: Reals> TableLookup<R> {
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    pub unsafe fn new(table: &SpeciesPairTable<R::Scalar>) -> TableLookup<R> {
        let entries = table.as_ptr();
        // SAFETY: `SpeciesPairTable::new` gives a table at least sixteen entries.
        TableLookup { first: unsafe { R::splat(*entries) }, entries, fits_vector: table.count() <= R::LANES }
    }

    /// The entries for a vector of pairs. With one species the table has one entry.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`, and passes pairs of the table's species.
    #[inline(always)]
    pub unsafe fn lookup<const MULTISPECIES: bool>(&self, species_pair: SpeciesPair<R>) -> R {
        // SAFETY: the caller promises indices below the number of entries; `SpeciesPairTable::new` pads tables to a vector.
        unsafe {
            if !MULTISPECIES {
                self.first
            } else if self.fits_vector {
                R::pick(self.entries, species_pair.0)
            } else {
                R::lookup(self.entries, species_pair.0)
            }
        }
    }
}

/// `table[index[k]]` in lane `k`; with `fits_vector` the table fits into one vector. Not a closure: closures that are not
/// inlined lack the target features.
///
/// # Safety
/// The caller fulfils the contract of `simd`. The table is padded to a vector, the indices are below its length.
#[inline(always)]
pub unsafe fn table_entry<R: Reals>(table: *const R::Scalar, index: R::Words, fits_vector: bool) -> R {
    // SAFETY: `SpeciesPairTable::new` has padded the table to a vector, and `SpeciesPair::new` computes
    // indices from the table's species.
    unsafe { if fits_vector { R::pick(table, index) } else { R::lookup(table, index) } }
}
