//! `kT = [from, to]` of a stage: a temperature that rises or falls in equal levels.
//!
//! A level is a stage of its own, as psi may depend on kT: forces are computed anew where it begins, and a deck for
//! LAMMPS has a `run` for it.

use super::Stage;
use super::number::positive;
use psidpd_core::document::{FileError, FileErrorKind, Section};

/// Levels of a ramp that does not say.
const DEFAULT_LEVELS: u64 = 20;
/// Most levels.
const MOST_LEVELS: u64 = 1000;

/// Reads the temperature of `stage`, and divides it into levels if it is a ramp. The last level is at the end
/// of the ramp, the first one level after its start.
pub fn read(section: &Section, stage: Stage) -> Result<Vec<Stage>, FileError> {
    let value = section.get("kT");
    let ramp = value.as_ref().and_then(|v| v.as_array());
    let levels = section.get("levels");
    let Some(ends) = ramp else {
        if let Some(levels) = levels {
            let message = "kT is one temperature, which has no levels".to_owned();
            return Err(levels.error(FileErrorKind::Value(message)).with_help("kT = [from, to] has"));
        }
        let kt = value.map_or(Ok(stage.kt), |value| positive(&value))?;
        return Ok(vec![Stage { kt, ..stage }]);
    };
    let ends: Vec<f64> = ends.iter().map(positive).collect::<Result<_, _>>()?;
    let [from, to] = ends[..] else {
        let message = format!("expected a temperature, or two of a ramp, found {}", ends.len());
        return Err(section.require("kT")?.error(FileErrorKind::Value(message)));
    };
    let levels = match levels {
        None => DEFAULT_LEVELS.min(stage.steps),
        Some(value) => match value.count()?.value {
            n if (1..=MOST_LEVELS.min(stage.steps)).contains(&n) => n,
            n => {
                let most = MOST_LEVELS.min(stage.steps);
                return Err(value.error(FileErrorKind::Value(format!("must be from 1 to {most}, is {n}"))));
            }
        },
    };
    let level = |k: u64| Stage {
        level: Some([k, levels]),
        // Whole numbers of steps that add up.
        steps: stage.steps / levels + u64::from(k <= stage.steps % levels),
        kt: if k == levels { to } else { from + (to - from) * k as f64 / levels as f64 },
        ..stage.clone()
    };
    Ok((1..=levels).map(level).collect())
}
