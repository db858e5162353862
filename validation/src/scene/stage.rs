//! `[[stage]]`.

use super::positive;
use crate::run::Integrator;
use psidpd_core::document::{FileError, FileErrorKind, Section};

/// A part of a run under one set of conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// How many steps.
    pub steps: u64,
    /// Δt.
    pub dt: f64,
    /// How a step is made.
    pub integrator: Integrator,
    /// kT.
    pub kt: f64,
    /// Whether dissipative and random forces act.
    pub thermostat: bool,
}

/// Most steps of a run: step numbers stay exact in every format that tells them.
const MOST_STEPS: u64 = 1 << 53;

/// λ of Groot and Warren's paper.
const DEFAULT_LAMBDA: f64 = 0.65;

/// Reads the stages; `kt` is the temperature of those that do not say.
pub fn read(root: &Section, kt: f64) -> Result<Vec<Stage>, FileError> {
    let value = root.require("stage")?;
    let mut stages: Vec<Stage> = Vec::new();
    let mut total = 0u64;
    for item in value.array()? {
        let section = item.section()?;
        let stage = read_one(&section, kt)?;
        let wrong = |key: &str, message: String| {
            section.require(key).map(|v| v.error(FileErrorKind::Value(message))).unwrap_or_else(|e| e)
        };
        if stages.iter().any(|s| s.name == stage.name) {
            return Err(wrong("name", format!("\"{}\" names two stages", stage.name)));
        }
        total = total.saturating_add(stage.steps);
        if total > MOST_STEPS {
            return Err(wrong("steps", format!("more than {MOST_STEPS} steps in all")));
        }
        section.finish()?;
        stages.push(stage);
    }
    if stages.is_empty() {
        return Err(value.error(FileErrorKind::Value("needs at least one stage".into())));
    }
    Ok(stages)
}

fn read_one(section: &Section, kt: f64) -> Result<Stage, FileError> {
    let name = section.require("name")?.string()?.value;
    let value = section.require("steps")?;
    let steps = value.count()?.value;
    if steps == 0 {
        return Err(value.error(FileErrorKind::Value("must be at least 1".into())));
    }
    Ok(Stage {
        name,
        steps,
        dt: positive(&section.require("dt")?)?,
        integrator: read_integrator(section)?,
        kt: section.get("kT").map_or(Ok(kt), |value| positive(&value))?,
        thermostat: section.get("thermostat").map_or(Ok(true), |value| Ok(value.boolean()?.value))?,
    })
}

fn read_integrator(section: &Section) -> Result<Integrator, FileError> {
    let groot_warren = Integrator::GrootWarren { lambda: DEFAULT_LAMBDA };
    let names = [("velocity-verlet", Integrator::VelocityVerlet), ("groot-warren", groot_warren)];
    let integrator = match section.get("integrator") {
        Some(value) => value.one_of("integrator", &names)?.value,
        None => Integrator::default(),
    };
    let Some(value) = section.get("lambda") else { return Ok(integrator) };
    let lambda = value.number()?.value;
    match integrator {
        Integrator::GrootWarren { .. } if (0.0..=1.0).contains(&lambda) => {
            Ok(Integrator::GrootWarren { lambda })
        }
        Integrator::GrootWarren { .. } => {
            Err(value.error(FileErrorKind::Value(format!("must be from 0 to 1, is {lambda}"))))
        }
        Integrator::VelocityVerlet => {
            let message = "velocity-verlet has no lambda".to_owned();
            Err(value.error(FileErrorKind::Value(message)).with_help("integrator = \"groot-warren\" has"))
        }
    }
}
