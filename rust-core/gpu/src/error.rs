//! Reasons why a device refuses or stops.

/// The reason why a simulation does not start, or stopped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No device with Vulkan or Metal was found.
    #[error(
        "no device with Vulkan or Metal was found: install the driver of the graphics card, or on Debian `apt install \
         mesa-vulkan-drivers` for a device that computes on the processor"
    )]
    NoDevice,
    /// There is no device of this index.
    #[error("there is no device {index}: this machine has {count}")]
    Index {
        /// The index that was asked for.
        index: usize,
        /// The number of devices.
        count: usize,
    },
    /// The device lacks something that every simulation needs, or refused to compile a kernel.
    #[error("device {name}: {reason}")]
    Device {
        /// The device's name.
        name: String,
        /// The reason.
        reason: String,
    },
    /// The device cannot do what the fluid or the scene asks for.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// The arrays of the host do not fit together.
    #[error("host error: {0}")]
    Host(&'static str),
    /// A step failed.
    #[error(transparent)]
    Stopped(#[from] Stop),
}

/// What only the CPU computes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what}: not available on a gpu; run it on the cpu")]
pub struct Unsupported {
    /// What is not available.
    pub what: String,
}

/// A step that failed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("step {step}, particle {tag}: {fault}")]
pub struct Stop {
    /// Number of the step.
    pub step: u64,
    /// The lowest tag among the particles of this fault.
    pub tag: i32,
    /// The reason.
    pub fault: Fault,
}

/// The reason why a step failed, in the order of `status` of `wgsl/common.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A velocity is not finite.
    #[error("its velocity is not finite")]
    Velocity,
    /// A particle moved by half of the box or more in one drift.
    #[error("it moved by half of the box or more")]
    Runaway,
    /// ψ or its derivative is not finite.
    #[error("its excess free energy is not finite")]
    ExcessFreeEnergy,
    /// A force is not finite.
    #[error("its force is not finite")]
    Force,
}
