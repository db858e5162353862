//! Lends memory to the thermostat, which acts between evaluations: arrays that only an evaluation needs.

use super::Workspace;
use psidpd_passes::compiled::PairPrecision;
use psidpd_passes::plane::pair_sums::Wide;
use std::alloc::Layout;
use std::mem::{ManuallyDrop, replace, take};

impl<P: PairPrecision> Workspace<P> {
    /// Exchanges the memory of packed particles, if they are those of mixed precision, and that of accumulators for that of vectors.
    /// What these contain afterwards is unspecified. The next evaluation needs its memory back, or takes new.
    pub fn exchange_memory(&mut self, [of_packed, of_sums]: [&mut Vec<Wide>; 2]) {
        // SAFETY: packed particles of the size of a vector, and accumulators, are numbers without padding.
        unsafe {
            exchange(&mut self.particles.packed, of_packed);
            exchange(&mut self.accumulators.forces, of_sums);
        }
    }
}

/// Exchanges the memory of two arrays, if the layout of their elements is the same.
///
/// # Safety
/// If so, elements are numbers of any bits, without padding.
unsafe fn exchange<T: Copy>(array: &mut Vec<T>, vectors: &mut Vec<Wide>) {
    if Layout::new::<T>() == Layout::new::<Wide>() {
        // SAFETY: the layouts are the same, and the caller promises that all bits are elements.
        unsafe { *array = with_elements(replace(vectors, with_elements(take(array)))) };
    }
}

/// The same memory as an array of other elements.
///
/// # Safety
/// Both have the same layout, and the bits of each element are an element of the other type.
unsafe fn with_elements<T: Copy, U: Copy>(array: Vec<T>) -> Vec<U> {
    let mut array = ManuallyDrop::new(array);
    // SAFETY: the caller promises the layout of the allocation and the elements; `array` does not release it.
    unsafe { Vec::from_raw_parts(array.as_mut_ptr().cast(), array.len(), array.capacity()) }
}
