use super::growing::GrowingFile;
use super::{RunError, Simulation, Thermo};
use crate::checkpoint::Written;
use std::io::Write;
use std::path::Path;

impl Thermo {
    /// The totals of the last step, whose evaluation must have used
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

pub(super) struct ThermoFile(GrowingFile);

impl ThermoFile {
    pub const NAME: &str = "thermo.csv";

    pub fn create(folder: &Path) -> Result<ThermoFile, RunError> {
        let mut this = ThermoFile(GrowingFile::create(folder, Self::NAME)?);
        this.line("step,time,temperature,potential,kinetic,pressure,pxx,pyy,pzz,pxy,pxz,pyz")?;
        Ok(this)
    }

    pub fn reopen(folder: &Path, written: Written) -> Result<ThermoFile, RunError> {
        GrowingFile::reopen(folder, Self::NAME, written).map(ThermoFile)
    }

    /// Writes a row and flushes it, so that other programs can follow the file.
    pub fn row(&mut self, t: &Thermo) -> Result<(), RunError> {
        let numbers = [t.time, t.temperature, t.potential, t.kinetic, t.pressure];
        let columns: Vec<String> = numbers.iter().chain(&t.tensor).map(|x| format!("{x:?}")).collect();
        self.line(&format!("{},{}", t.step, columns.join(",")))
    }

    pub fn file(&mut self) -> &mut GrowingFile {
        &mut self.0
    }

    fn line(&mut self, text: &str) -> Result<(), RunError> {
        self.0.attempt(|file| writeln!(file, "{text}").and_then(|()| file.flush()))
    }
}
