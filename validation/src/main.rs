//! The `psidpd` program.
fn main() {}
