//! Many-body dissipative particle dynamics on one graphics card, or on any other device with Vulkan or Metal.
//!
//! Nothing of this crate is compiled without its feature `wgpu`, which is off by default.
//!
//! ```text
//! device      the devices of this machine
//! settings    what is given: box, masses, body forces, particles, the rule of a step
//! shader      the fluid as WGSL: ψ and its slopes, kernels, pair forms, pasted into the kernels of wgsl/
//! simulation  particles that stay on the device: upload, advance, totals, download
//! ```
//!
//! The physics is that of `psidpd_core::model` and the noise that of `psidpd_core::engine::noise`. Coordinates are 32-bit
//! fixed-point numbers and all other numbers single precision. A particle sums over its neighbours in an order that
//! depends on positions and tags only, so that two runs on one device give the same bits.
#![cfg(feature = "wgpu")]
#![warn(missing_docs)]

mod device;
mod error;
mod geometry;
mod kernels;
mod settings;
mod shader;
mod simulation;
mod table;

pub use device::{Device, DeviceInfo, devices};
pub use error::{Fault, GpuError, Stop, Unsupported};
pub use settings::{BodyForce, FROZEN, MOST_BODY_FORCES, Particles, Rule, Settings, Totals, body_force_mark};
pub use simulation::forces::GpuForces;
pub use simulation::{GpuSimulation, Timing};
