//! The device that evaluates forces.

use super::{Style, guard};
use crate::error::StyleError;

impl Style {
    /// Evaluates later forces on the device of a name: `cpu`, `gpu` (the first) or `gpu:N`.
    pub fn use_device(&mut self, name: &str) -> Result<(), StyleError> {
        let number = match name.split_once(':') {
            None if name == "cpu" => {
                self.engine.use_device(None);
                return Ok(());
            }
            None if name == "gpu" => Some(0),
            Some(("gpu", number)) => number.parse().ok(),
            _ => None,
        };
        match number {
            None => Err(StyleError(format!("unknown device '{name}': expected 'cpu', 'gpu' or 'gpu:N'"))),
            Some(_) if self.engine.device_name().is_some() => Ok(()),
            Some(number) => guard(|| self.use_gpu(number)),
        }
    }

    #[cfg(feature = "gpu")]
    fn use_gpu(&mut self, number: usize) -> Result<(), StyleError> {
        let failed = |error: psidpd_gpu::GpuError| StyleError(format!("device gpu: {error}"));
        let device = psidpd_gpu::Device::open(Some(number)).map_err(failed)?;
        let fluid = self.model.at(self.engine.plan().kt())?;
        let forces = psidpd_gpu::GpuForces::new(&device, &fluid).map_err(failed)?;
        self.engine.use_device(Some(Box::new(forces)));
        Ok(())
    }

    #[cfg(not(feature = "gpu"))]
    fn use_gpu(&mut self, _: usize) -> Result<(), StyleError> {
        Err(StyleError(
            "device gpu: this plugin was built without support for GPUs; build it with 'PSIDPD_WITH_GPU=1 psidpd lammps \
             plugin', see docs/gpu.md"
                .to_owned(),
        ))
    }
}
