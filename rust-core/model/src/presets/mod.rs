//! Models from the coefficients of pair styles that LAMMPS users know, written as model files.

mod coefficients;
mod lucy;
mod spline;
mod warren;

pub use coefficients::{DragWeight, PresetError, WarrenPair};
pub use lucy::lucy_mdpd;
pub use spline::{SplinePair, spline_dpd};
pub use warren::{ForceLaw, warren_ab};
