use super::RunError;
use crate::checkpoint::{Checkpoint, Store};
use std::time::{Duration, Instant};

/// Wall time between checkpoints of scenes without a step interval.
const INTERVAL: Duration = Duration::from_secs(600);

pub(super) struct Checkpoints {
    pub store: Store,
    /// The last good state, which a failed run saves.
    pub good: Checkpoint,
    /// The step of the checkpoint on disk.
    pub stored: Option<u64>,
    written: Instant,
    /// Wall time between checkpoints, if the scene gives no steps between them.
    pub interval: Duration,
}

impl Checkpoints {
    pub fn new(store: Store, good: Checkpoint, stored: Option<u64>) -> Checkpoints {
        Checkpoints { store, good, stored, written: Instant::now(), interval: INTERVAL }
    }

    pub fn is_due(&self) -> bool {
        self.written.elapsed() >= self.interval
    }

    pub fn write(&mut self) -> Result<(), RunError> {
        self.store.write(&self.good)?;
        self.stored = Some(self.good.step);
        self.written = Instant::now();
        Ok(())
    }
}
