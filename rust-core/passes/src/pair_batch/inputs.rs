//! The input of the evaluation of a batch.

use crate::ground::box_geometry::BoxGeometry;
use crate::ground::terms::Terms;
use crate::noise::PairNoise;
use psidpd_threads::SharedSlice;

/// The particles in the order of cells, and the terms that act between them.
#[derive(Clone, Copy)]
pub struct PairInputs<'a, T, R> {
    pub geometry: &'a BoxGeometry,
    pub terms: &'a Terms<T>,
    /// Noise of this step and `dt^{−1/2}`, if the thermostat acts.
    pub thermostat: Option<(PairNoise, f64)>,
    /// Packed particles, followed by a vector of padding.
    pub packed: SharedSlice<'a, R>,
    /// Species of the particles; empty with one species.
    pub species: SharedSlice<'a, u8>,
}
