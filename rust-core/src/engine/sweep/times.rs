//! Where the time goes.

use std::ops::AddAssign;
use std::time::Instant;

/// Seconds spent in the parts of evaluations, since the engine was made.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Times {
    /// Sorting particles into cells.
    pub sort: f64,
    /// Finding pairs; forces that need no density, noise among them; weights.
    pub first: f64,
    /// Summing densities and evaluating ψ.
    pub excess: f64,
    /// Many-body forces.
    pub second: f64,
    /// Forces to the host.
    pub forces: f64,
}

impl AddAssign for Times {
    fn add_assign(&mut self, other: Times) {
        self.sort += other.sort;
        self.first += other.first;
        self.excess += other.excess;
        self.second += other.second;
        self.forces += other.forces;
    }
}

/// Adds the time since the last lap to `sum`.
pub fn lap(since: &mut Instant, sum: &mut f64) {
    let now = Instant::now();
    *sum += (now - *since).as_secs_f64();
    *since = now;
}
