//! Particles that stay on the device.

use crate::{Device, GpuError, Particles, Rule, Settings, Totals};
use psidpd_core::model::Fluid;

/// Device time of one kernel.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// Name of the kernel.
    pub kernel: String,
    /// Number of its runs.
    pub runs: u64,
    /// Seconds of all runs, by timestamps of the device.
    pub seconds: f64,
}

/// Particles of one fluid in a box on a device.
///
/// Forces of step `n` have noise of number `n`, as in the native runner: forces before the first step have number 0.
#[derive(Debug)]
pub struct GpuSimulation {
    number: u64,
    count: usize,
}

impl GpuSimulation {
    /// Compiles the kernels of a fluid. There are no particles before [`GpuSimulation::upload`].
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] names what the device cannot compute: for instance boxes narrower than twice the cutoff
    /// along a period, or tilted ones with walls.
    pub fn new(device: &Device, fluid: &Fluid, settings: Settings) -> Result<GpuSimulation, GpuError> {
        let _ = (fluid, settings);
        Err(GpuError::Device { name: device.info().name.clone(), reason: "no kernels".into() })
    }

    /// Replaces all particles, after step `number`. Without forces, [`GpuSimulation::prepare`] must follow.
    ///
    /// # Errors
    /// Lists differ in length, species or tags are invalid, a position is not finite or beyond a wall, or the device
    /// has not enough memory.
    pub fn upload(&mut self, particles: &Particles, number: u64) -> Result<(), GpuError> {
        (self.number, self.count) = (number, particles.x.len());
        Err(GpuError::Host("no kernels"))
    }

    /// Computes the forces with which steps of `dt` by `rule` begin, at the present positions and velocities; with `totals`
    /// also their sums.
    ///
    /// # Errors
    /// [`GpuError::Stopped`] with the number of the present step.
    pub fn prepare(&mut self, dt: f64, rule: Rule, totals: bool) -> Result<(), GpuError> {
        let _ = (dt, rule, totals);
        Err(GpuError::Host("no kernels"))
    }

    /// Makes steps of `dt`; with `totals` the last one also computes the sums of [`GpuSimulation::totals`].
    ///
    /// # Errors
    /// [`GpuError::Stopped`] names the step and a particle. The particles are then those of an unfinished step.
    pub fn advance(&mut self, steps: u64, dt: f64, rule: Rule, totals: bool) -> Result<(), GpuError> {
        let _ = (steps, dt, rule, totals);
        Err(GpuError::Host("no kernels"))
    }

    /// The sums at the end of the last step that computed them. Momenta and forces are those of the present particles.
    ///
    /// # Errors
    /// The device was lost.
    pub fn totals(&mut self) -> Result<Totals, GpuError> {
        Err(GpuError::Host("no kernels"))
    }

    /// Copies all particles to the host, in the device's order, and reuses the memory of the lists. Uploaded again, they
    /// continue with the same bits.
    ///
    /// # Errors
    /// The device was lost.
    pub fn download(&mut self, to: &mut Particles) -> Result<(), GpuError> {
        let _ = to;
        Err(GpuError::Host("no kernels"))
    }

    /// Takes the same model at another temperature, from the next forces on.
    ///
    /// # Errors
    /// As [`GpuSimulation::new`].
    pub fn set_fluid(&mut self, fluid: &Fluid) -> Result<(), GpuError> {
        let _ = fluid;
        Err(GpuError::Host("no kernels"))
    }

    /// Replaces box, masses, seed and body forces; the particles keep their fractions of the box. Forces must be prepared anew.
    ///
    /// # Errors
    /// As [`GpuSimulation::new`].
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), GpuError> {
        let _ = settings;
        Err(GpuError::Host("no kernels"))
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no particles.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of the present step.
    pub fn step_number(&self) -> u64 {
        self.number
    }

    /// Number of evaluations of ψ below and above density bounds since the start.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        [0; 2]
    }

    /// Updates of the implicit thermostat, their iterations, and how many of them ended before they were accurate.
    pub fn effort(&self) -> [u64; 3] {
        [0; 3]
    }

    /// Memory on the device, in bytes.
    pub fn memory_bytes(&self) -> u64 {
        0
    }

    /// Starts measuring the time of each kernel, or ends it. Steps are then slower, because kernels run one by one.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] if the device has no timestamps.
    pub fn measure_time(&mut self, on: bool) -> Result<(), GpuError> {
        let _ = on;
        Err(GpuError::Host("no kernels"))
    }

    /// Times since the last call of [`GpuSimulation::measure_time`], longest first.
    pub fn timings(&self) -> Vec<Timing> {
        Vec::new()
    }
}
