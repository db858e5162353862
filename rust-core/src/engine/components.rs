//! The order of the components of tensors.

/// Indices of the components of a symmetric tensor, in the order of the virial.
pub const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
