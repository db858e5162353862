//! Tests the pool with real threads, and under loom in every order in which its threads may run.

#[cfg(loom)]
mod loom_model;
#[cfg(not(loom))]
mod miri_sized;
