//! `kT = [from, to]` of a stage: a temperature that changes in equal levels.
//!
//! Each level is a stage of its own, because ψ may depend on kT: forces are computed again at its start, and a
//! LAMMPS input has a `run` for it.

use super::{FileError, Section};

const DEFAULT_LEVELS: u64 = 20;
const MOST_LEVELS: u64 = 1000;

#[derive(Debug, Clone, Copy)]
pub struct Level {
    /// Number of the level in a ramp, from 1, and number of levels; `None` without a ramp.
    pub number: Option<[u64; 2]>,
    pub steps: u64,
    pub kt: f64,
}

/// Reads the temperature of a stage of `steps` steps; the default is `scene_kt`. A ramp is divided into
/// levels: the first is one level after the start of the ramp, the last is at its end.
pub fn read(section: &Section, steps: u64, scene_kt: f64) -> Result<Vec<Level>, FileError> {
    let value = section.get("kT");
    let ramp = value.as_ref().and_then(|v| v.as_array());
    let levels = section.get("levels");
    let Some(ends) = ramp else {
        if let Some(levels) = levels {
            return Err(levels
                .error("only a ramp has levels, and kT is one temperature")
                .with_help("kT = [from, to] is a ramp"));
        }
        let kt = value.map_or(Ok(scene_kt), |value| value.positive())?;
        return Ok(vec![Level { number: None, steps, kt }]);
    };
    let ends: Vec<f64> = ends.iter().map(|end| end.positive()).collect::<Result<_, _>>()?;
    let [from, to] = ends[..] else {
        return Err(section
            .require("kT")?
            .error(format!("expected a temperature, or two of a ramp, found {}", ends.len())));
    };
    let levels = match levels {
        None => DEFAULT_LEVELS.min(steps),
        Some(value) => match value.count()? {
            n if (1..=MOST_LEVELS.min(steps)).contains(&n) => n,
            n => {
                let most = MOST_LEVELS.min(steps);
                return Err(value.error(format!("must be from 1 to {most}, is {n}")));
            }
        },
    };
    let level = |k: u64| Level {
        number: Some([k, levels]),
        // Whole numbers of steps, which add up to the steps of the stage.
        steps: steps / levels + u64::from(k <= steps % levels),
        kt: if k == levels { to } else { from + (to - from) * k as f64 / levels as f64 },
    };
    Ok((1..=levels).map(level).collect())
}
