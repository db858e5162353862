//! `[[stage]]`, or `steps` at the top level: the stages of a run.

use super::{FileError, Section, Value};
use crate::integrator::{Integrator, Settings, THERMOSTAT_STEPS};
use psidpd_core::engine::noise::Law;

/// A part of a run at constant settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// The name of the stage; all levels of a ramp share it.
    pub name: String,
    /// Number of the level in a ramp, from 1, and number of levels; `None` without a ramp.
    pub level: Option<[u64; 2]>,
    pub steps: u64,
    pub dt: f64,
    pub integrator: Integrator,
    pub kt: f64,
    pub thermostat: bool,
    pub body_forces: bool,
}

impl Stage {
    /// The name in comments and messages: "quench (3 of 20)" for a level of a ramp.
    pub fn label(&self) -> String {
        match self.level {
            Some([level, levels]) => format!("{} ({level} of {levels})", self.name),
            None => self.name.clone(),
        }
    }
}

/// Largest number of steps of a run: up to it, step numbers are exact in every output format.
const MOST_STEPS: u64 = 1 << 53;

/// The time step Δt of stages without `dt`.
const DEFAULT_DT: f64 = 0.01;

/// Numbers of levels of a ramp: without `levels`, and at most.
const DEFAULT_LEVELS: u64 = 20;
const MOST_LEVELS: u64 = 1000;

/// Reads the stages; `kt` is the default of their temperature.
pub fn read(root: &Section, kt: f64) -> Result<Vec<Stage>, FileError> {
    // A stage has these values of the keys that it leaves out.
    let default = Stage {
        name: String::new(),
        level: None,
        steps: 0,
        dt: root.read("dt", Value::positive)?.unwrap_or(DEFAULT_DT),
        integrator: read_integrator(root, Integrator::default())?,
        kt,
        thermostat: true,
        body_forces: true,
    };
    let mut stages = read_all(root, &default)?;
    // A scene whose integrators have no time step must have no `dt`.
    if let Some(dt) = root.get("dt").filter(|_| stages.iter().all(|stage| !stage.integrator.has_time())) {
        return Err(no_time(&dt, "no dt"));
    }
    for stage in stages.iter_mut().filter(|stage| !stage.integrator.has_time()) {
        stage.dt = 1.0;
    }
    Ok(stages)
}

fn read_all(root: &Section, default: &Stage) -> Result<Vec<Stage>, FileError> {
    let (steps, equilibrate) = (root.get("steps"), root.get("equilibrate"));
    let Some(value) = root.get("stage") else { return read_short(root, steps, equilibrate, default) };
    if let Some(other) = steps.or(equilibrate) {
        return Err(other.error("the scene has [[stage]] tables too: keep one of the two"));
    }
    let mut stages: Vec<Stage> = Vec::new();
    let mut total = 0u64;
    for item in value.array()? {
        let section = item.section()?;
        let levels = read_one(&section, default)?;
        let wrong =
            |key: &str, message: String| section.require(key).map(|v| v.error(message)).unwrap_or_else(|e| e);
        if let Some(stage) = levels.iter().find(|l| stages.iter().any(|s| s.name == l.name)) {
            return Err(wrong("name", format!("\"{}\" names two stages", stage.name)));
        }
        for stage in levels {
            total = total.saturating_add(stage.steps);
            if total > MOST_STEPS {
                return Err(wrong("steps", format!("more than {MOST_STEPS} steps in all")));
            }
            stages.push(stage);
        }
    }
    if stages.is_empty() {
        return Err(value.error("needs at least one stage"));
    }
    Ok(stages)
}

/// Reads `steps`, and `equilibrate` for a stage before it.
fn read_short(
    root: &Section,
    steps: Option<Value>,
    equilibrate: Option<Value>,
    default: &Stage,
) -> Result<Vec<Stage>, FileError> {
    let steps = match steps {
        Some(value) => value,
        None if equilibrate.is_some() => root.require("steps")?,
        None => {
            let error = root.error("the scene gives no number of steps");
            return Err(error.with_help("give steps, or [[stage]] tables"));
        }
    };
    let stages = [("equilibrate", equilibrate), ("produce", Some(steps))];
    let stages = stages.into_iter().filter_map(|(name, value)| {
        let stage = |steps| Stage { name: name.to_owned(), steps, ..default.clone() };
        value.map(|value| read_steps(&value).map(stage))
    });
    stages.collect()
}

fn read_steps(value: &Value) -> Result<u64, FileError> {
    match value.count()? {
        0 => Err(value.error("must be at least 1")),
        // Each of two stages may have half of the largest number of steps.
        steps if steps > MOST_STEPS / 2 => Err(value.error(format!("more than {MOST_STEPS} steps in all"))),
        steps => Ok(steps),
    }
}

/// Reads the stages of one table: a ramp makes one stage for each level.
fn read_one(section: &Section, default: &Stage) -> Result<Vec<Stage>, FileError> {
    let stage = Stage {
        name: section.require("name")?.string()?.value,
        steps: read_steps(&section.require("steps")?)?,
        integrator: read_integrator(section, default.integrator)?,
        dt: section.read("dt", Value::positive)?.unwrap_or(default.dt),
        thermostat: section.read("thermostat", Value::boolean)?.unwrap_or(true),
        body_forces: section.read("body_forces", Value::boolean)?.unwrap_or(true),
        ..default.clone()
    };
    if !stage.integrator.has_time() {
        if let Some(dt) = section.get("dt") {
            return Err(no_time(&dt, "no dt"));
        }
        if !stage.thermostat {
            return Err(no_time(
                &section.require("thermostat")?,
                "no thermostat to switch off: it samples at kT",
            ));
        }
    }
    read_levels(section, stage)
}

/// Reads the temperature of a stage. In a ramp, `kT = [from, to]`, it changes in equal levels: the first is one level after
/// the start of the ramp, the last is at its end.
///
/// Each level is a stage of its own, because ψ may depend on kT: forces are computed again at its start, and a
/// LAMMPS input has a `run` for it.
fn read_levels(section: &Section, stage: Stage) -> Result<Vec<Stage>, FileError> {
    let value = section.get("kT");
    let ramp = value.as_ref().and_then(|v| v.as_array());
    let levels = section.get("levels");
    let Some(ends) = ramp else {
        if let Some(levels) = levels {
            return Err(levels
                .error("only a ramp has levels, and kT is one temperature")
                .with_help("kT = [from, to] is a ramp"));
        }
        let kt = value.map_or(Ok(stage.kt), |value| value.positive())?;
        return Ok(vec![Stage { kt, ..stage }]);
    };
    let ends: Vec<f64> = ends.iter().map(|end| end.positive()).collect::<Result<_, _>>()?;
    let [from, to] = ends[..] else {
        return Err(section
            .require("kT")?
            .error(format!("expected a temperature, or two of a ramp, found {}", ends.len())));
    };
    let steps = stage.steps;
    let most = MOST_LEVELS.min(steps);
    let levels = match levels {
        None => DEFAULT_LEVELS.min(steps),
        Some(value) => value.whole(1, most)?,
    };
    let level = |k: u64| Stage {
        level: Some([k, levels]),
        // Whole numbers of steps, which add up to the steps of the stage.
        steps: steps / levels + u64::from(k <= steps % levels),
        kt: if k == levels { to } else { from + (to - from) * k as f64 / levels as f64 },
        ..stage.clone()
    };
    Ok((1..=levels).map(level).collect())
}

/// Reads the integrator of a stage or of the scene; `default` if the file gives none.
fn read_integrator(section: &Section, default: Integrator) -> Result<Integrator, FileError> {
    let named = section.read("integrator", |value| value.one_of("integrator", &Integrator::NAMED))?;
    let mut integrator = named.unwrap_or(default);
    let kind = integrator;
    let own = |key: &str, has: fn(&mut Integrator) -> bool| match section.get(key) {
        Some(value) if !has(&mut { kind }) => Err(has_none(&value, kind.name(), key, has)),
        value => Ok(value),
    };
    let Settings { lambda, gradient, mut coupling, noise, trials } = integrator.settings();
    if let (Some(value), Some((lambda, [low, high]))) =
        (own("lambda", |other| other.settings().lambda.is_some())?, lambda)
    {
        *lambda = value.within(value.number()?, low, high)?;
    }
    if let (Some(value), Some(gradient)) =
        (own("gradient", |other| other.settings().gradient.is_some())?, gradient)
    {
        *gradient = value.within(value.number()?, 0.0, 1.0)?;
    }
    let couples = |other: &mut Integrator| other.settings().coupling.is_some();
    if let (Some(value), Some(coupling)) = (own("thermostat_step", couples)?, &mut coupling) {
        coupling.update = value.one_of("thermostat_step", &THERMOSTAT_STEPS)?;
    }
    if let (Some(value), Some(coupling)) = (own("thermostat_every", couples)?, &mut coupling) {
        coupling.every = read_steps(&value)?;
    }
    let tries = |other: &mut Integrator| other.settings().trials.is_some();
    let [sweeps_key, move_key] = [own("sweeps", tries)?, own("max_move", tries)?];
    if let Some((sweeps, max_move)) = trials {
        if let Some(value) = sweeps_key {
            *sweeps = read_steps(&value)?;
        }
        if let Some(value) = move_key {
            *max_move = Some(value.positive()?);
        }
    }
    let noise = noise.or(coupling.map(|coupling| &mut coupling.noise));
    if let (Some(value), Some(noise)) = (own("noise", |other| other.noise().is_some())?, noise) {
        *noise = value.one_of("noise", &Law::ALL)?;
    }
    Ok(integrator)
}

/// The value that sets the integrator of a stage, for error messages.
pub fn place_of_integrator<'a>(root: &Section<'a>, stage: &str) -> Option<Value<'a>> {
    let tables = root.get("stage").and_then(|value| value.array().ok()).unwrap_or_default();
    let mut sections = tables.iter().filter_map(|item| item.section().ok());
    let own = sections.find(|s| s.get("name").is_some_and(|name| name.as_str() == Some(stage)));
    own.and_then(|section| section.get("integrator")).or_else(|| root.get("integrator"))
}

/// The error of a time setting in a Monte Carlo stage.
fn no_time(value: &Value, what: &str) -> FileError {
    value.error(format!("monte-carlo has {what}"))
}

/// The error of a key that an integrator does not have; its help lists the integrators that have it.
fn has_none(value: &Value, name: &str, key: &str, has: fn(&mut Integrator) -> bool) -> FileError {
    let mut owners = Vec::from(Integrator::NAMED);
    owners.retain_mut(|(_, integrator)| has(integrator));
    let owners: Vec<String> = owners.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let error = value.error(format!("{name} has no {key}"));
    error.with_help(format!("integrator = {}", owners.join(", ")))
}
