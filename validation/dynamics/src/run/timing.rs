//! Wall times of a run, in a file of their own because they differ from run to run.

use super::error::RunError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// `timing.json`: the sessions of a run, one more each time it is taken up again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Timing {
    /// The sessions. Of one that was killed, the part up to its last checkpoint.
    pub sessions: Vec<Session>,
}

/// A part of a run that went without interruption.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// The step it began after.
    pub from_step: u64,
    /// The last step it counts.
    pub to_step: u64,
    /// Wall time from one to the other, output included, in seconds.
    pub wall_seconds: f64,
    /// Particles times steps over that time.
    pub particle_steps_per_second: f64,
}

impl Timing {
    pub(super) const NAME: &str = "timing.json";

    /// The times of earlier sessions; empty if they are unknown.
    pub(super) fn read(folder: &Path) -> Timing {
        let text = std::fs::read_to_string(folder.join(Self::NAME)).ok();
        text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
    }

    pub(super) fn write(&self, folder: &Path) -> Result<(), RunError> {
        let (path, new) = (folder.join(Self::NAME), folder.join("timing.json.new"));
        let text = serde_json::to_string_pretty(self).map_err(std::io::Error::from);
        text.and_then(|text| std::fs::write(&new, text + "\n"))
            .and_then(|()| std::fs::rename(&new, &path))
            .map_err(RunError::output(&path))
    }
}
