use super::error::RunError;
use super::thermo::Thermo;
use serde::Serialize;
use std::path::Path;

/// What a run came to; also `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Title of the scene.
    pub title: String,
    /// How many particles.
    pub particles: usize,
    /// Steps made, over all stages.
    pub steps: u64,
    /// Wall time of the steps, output included, in seconds.
    pub wall_seconds: f64,
    /// Particles times steps over that time.
    pub particle_steps_per_second: f64,
    /// Evaluations of ψ that met a density below its bounds, and above them.
    pub out_of_bounds: [u64; 2],
    /// Totals after the last step.
    pub last: Thermo,
    /// Plain means over the thermo rows of the last stage, without error bars; `None` without rows.
    pub means: Option<Means>,
}

/// Plain means over thermo rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Means {
    /// How many rows.
    pub rows: u64,
    /// Of kT.
    pub temperature: f64,
    /// Of the potential energy.
    pub potential: f64,
    /// Of the pressure.
    pub pressure: f64,
    /// Of the pressure of conservative forces.
    pub conservative_pressure: f64,
}

impl Means {
    /// The means of `rows`.
    pub(super) fn of(rows: &[Thermo]) -> Option<Means> {
        let count = rows.len() as f64;
        let mean = |f: fn(&Thermo) -> f64| rows.iter().map(f).sum::<f64>() / count;
        (!rows.is_empty()).then(|| Means {
            rows: rows.len() as u64,
            temperature: mean(|t| t.temperature),
            potential: mean(|t| t.potential),
            pressure: mean(|t| t.pressure),
            conservative_pressure: mean(|t| t.conservative_pressure),
        })
    }
}

impl Summary {
    pub(super) fn write(&self, path: &Path) -> Result<(), RunError> {
        let text = serde_json::to_string_pretty(self).map_err(std::io::Error::from);
        text.and_then(|text| std::fs::write(path, text + "\n")).map_err(RunError::output(path))
    }
}

/// For the end of a run in a terminal.
impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "{}: {} particles, {} steps in {:.1} s",
            self.title, self.particles, self.steps, self.wall_seconds
        )?;
        write!(f, "{:.3e} particle-steps per second", self.particle_steps_per_second)?;
        let [below, above] = self.out_of_bounds;
        if below + above > 0 {
            let share = (below + above) as f64 / (self.particles as f64 * self.steps as f64);
            write!(
                f,
                "\nout of bounds: psi was evaluated {below} times below and {above} times above the bounds of a density \
                 ({:.2} % of particle-steps); it went on with a linear slope there",
                100.0 * share
            )?;
        }
        if let Some(m) = &self.means {
            let n = self.particles as f64;
            write!(
                f,
                "\nmeans of {} rows: temperature {:.4}, potential energy per particle {:.4}, pressure {:.4}",
                m.rows,
                m.temperature,
                m.potential / n,
                m.pressure
            )?;
        }
        Ok(())
    }
}
