//! Wall times of a run, in a file of their own because they differ from run to run.

use super::RunError;
use psidpd_core::engine::thermostat::Effort;
use psidpd_formats::files::{PathError, read_json_if_there, replace_inside};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};

/// The contents of `timing.json`: one session for the start and each resumption of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Timing {
    /// The sessions; a killed session is listed up to its last checkpoint.
    pub sessions: Vec<Session>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// The step after which the session began.
    pub from_step: u64,
    pub to_step: u64,
    /// Wall time of the session, output included, in seconds.
    pub wall_seconds: f64,
    pub particle_steps_per_second: f64,
    /// The GPU that made the steps, with its driver; left out for the CPU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// Iterations of an implicit thermostat; left out without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thermostat: Option<Iterations>,
    /// Time in which one thread did the work of all, as other programs used the processors of the others; left out if there
    /// was none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub one_thread_seconds: f64,
}

fn is_zero(seconds: &f64) -> bool {
    *seconds == 0.0
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Iterations {
    pub mean: f64,
    /// `None` from a GPU, which does not count them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub most: Option<usize>,
    /// Updates that ended before they were accurate.
    pub inaccurate: u64,
}

impl Iterations {
    pub(super) fn of(effort: Effort) -> Option<Iterations> {
        let Effort { most, inaccurate, .. } = effort;
        effort.mean().map(|mean| Iterations { mean, most: (most > 0).then_some(most), inaccurate })
    }
}

pub(super) struct Clock {
    pub earlier: Timing,
    from_step: u64,
    since: Instant,
}

impl Clock {
    pub fn new(earlier: Timing, from_step: u64) -> Clock {
        Clock { earlier, from_step, since: Instant::now() }
    }

    pub fn restart(&mut self, from_step: u64) {
        (self.from_step, self.since) = (from_step, Instant::now());
    }

    /// All sessions, this one up to `step`.
    pub fn until(
        &self,
        step: u64,
        particles: usize,
        effort: Effort,
        device: Option<String>,
        alone: Duration,
    ) -> Timing {
        let wall_seconds = self.since.elapsed().as_secs_f64();
        let made = step.saturating_sub(self.from_step) as f64 * particles as f64;
        let mut timing = self.earlier.clone();
        timing.sessions.push(Session {
            from_step: self.from_step,
            to_step: step,
            wall_seconds,
            // The clock may not have advanced, and JSON has no infinity.
            particle_steps_per_second: made / wall_seconds.max(1e-9),
            device,
            thermostat: Iterations::of(effort),
            one_thread_seconds: alone.as_secs_f64(),
        });
        timing
    }
}

impl Timing {
    pub(super) const NAME: &str = "timing.json";

    /// Reads the times of earlier sessions; empty if the file cannot be read.
    pub(super) fn read(folder: &Path) -> Timing {
        read_json_if_there(&folder.join(Self::NAME)).ok().flatten().unwrap_or_default()
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), RunError> {
        let path = folder.join(Self::NAME);
        let text = serde_json::to_string_pretty(self).map_err(|e| PathError::at("write", &path)(e.into()))?;
        Ok(replace_inside(&path, (text + "\n").as_bytes(), false)?)
    }
}
