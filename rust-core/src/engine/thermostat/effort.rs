//! The iterations that implicit updates took.

/// Iterations of a number of implicit updates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Number of updates.
    pub updates: u64,
    /// Iterations of all updates.
    pub iterations: u64,
    /// The most iterations of one update.
    pub most: usize,
    /// Updates of pairs that forces had listed.
    pub listed: u64,
    /// Updates that ended before they were accurate, because of too strong drag.
    pub inaccurate: u64,
}

impl Effort {
    /// Adds an update.
    pub(super) fn add(&mut self, iterations: usize, listed: bool, inaccurate: bool) {
        self.updates += 1;
        self.listed += u64::from(listed);
        self.iterations += iterations as u64;
        self.most = self.most.max(iterations);
        self.inaccurate += u64::from(inaccurate);
    }

    /// Mean number of iterations of an update; `None` without updates.
    pub fn mean(&self) -> Option<f64> {
        (self.updates > 0).then(|| self.iterations as f64 / self.updates as f64)
    }
}

impl std::ops::AddAssign for Effort {
    fn add_assign(&mut self, other: Effort) {
        self.updates += other.updates;
        self.iterations += other.iterations;
        self.most = self.most.max(other.most);
        self.listed += other.listed;
        self.inaccurate += other.inaccurate;
    }
}
