//! Many-body dissipative particle dynamics from excess free energies.
pub mod model;
