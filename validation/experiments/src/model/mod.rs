//! Models that are sought: of a liquid by its data sheet, of two liquids by the tension between them, of a wall by its contact angle.

pub mod liquid;
pub mod mixture;
mod seek;
mod slabs;
mod steps;
pub mod wall;
