use super::{Simulation, Thermo};

/// The first line of `thermo.csv`.
pub(super) const HEADER: &str = "step,time,temperature,potential,kinetic,pressure,pxx,pyy,pzz,pxy,pxz,pyz";

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

    /// A line of `thermo.csv`.
    pub(super) fn line(&self) -> String {
        let numbers = [self.time, self.temperature, self.potential, self.kinetic, self.pressure];
        let columns: Vec<String> = numbers.iter().chain(&self.tensor).map(|x| format!("{x:?}")).collect();
        format!("{},{}", self.step, columns.join(","))
    }
}
