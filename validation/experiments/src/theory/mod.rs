//! Mean field of a model: as a page, and beside what is measured.

pub mod measure;
pub mod page;
