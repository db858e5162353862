use super::error::RunError;
use super::simulation::Simulation;
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// One row of totals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Thermo {
    /// Number of the step.
    pub step: u64,
    /// Time since the start of the run.
    pub time: f64,
    /// kT from the kinetic energy.
    pub temperature: f64,
    /// `U`.
    pub potential: f64,
    /// `½ Σ m v²`.
    pub kinetic: f64,
    /// A third (in two dimensions half) of the trace of `tensor`.
    pub pressure: f64,
    /// xx, yy, zz, xy, xz, yz; thermostat forces included.
    pub tensor: [f64; 6],
    /// The pressure with conservative forces alone.
    pub conservative_pressure: f64,
}

impl Thermo {
    /// The totals of the last step, which must have been computed with
    /// [`Want::TOTALS`](psidpd_core::engine::Want::TOTALS).
    pub fn of(simulation: &Simulation, time: f64) -> Thermo {
        let tensor = simulation.pressure_tensor();
        Thermo {
            step: simulation.step_number(),
            time,
            temperature: simulation.temperature(),
            potential: simulation.potential_energy(),
            kinetic: simulation.kinetic_energy(),
            pressure: simulation.scalar_pressure(tensor),
            tensor,
            conservative_pressure: simulation.scalar_pressure(simulation.conservative_pressure_tensor()),
        }
    }
}

/// `thermo.csv`.
pub(super) struct ThermoFile {
    path: PathBuf,
    file: BufWriter<File>,
}

impl ThermoFile {
    pub fn create(path: &Path) -> Result<ThermoFile, RunError> {
        let file = File::create(path).map_err(RunError::output(path))?;
        let mut this = ThermoFile { path: path.to_owned(), file: BufWriter::new(file) };
        this.line("step,time,temperature,potential,kinetic,pressure,pxx,pyy,pzz,pxy,pxz,pyz")?;
        Ok(this)
    }

    /// Writes a row, and makes it visible to whoever follows the file.
    pub fn row(&mut self, t: &Thermo) -> Result<(), RunError> {
        let numbers = [t.time, t.temperature, t.potential, t.kinetic, t.pressure];
        let columns: Vec<String> = numbers.iter().chain(&t.tensor).map(|x| format!("{x:?}")).collect();
        self.line(&format!("{},{}", t.step, columns.join(",")))
    }

    fn line(&mut self, text: &str) -> Result<(), RunError> {
        writeln!(self.file, "{text}").and_then(|()| self.file.flush()).map_err(RunError::output(&self.path))
    }
}
