//! Measures the time of the parts of evaluations.

use std::time::Instant;

/// Seconds spent in the parts of evaluations, since the engine was made.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Times {
    /// Time of sorting particles into cells.
    pub sort: f64,
    /// Time of finding pairs, of forces without density terms, noise included, and of weights.
    pub first: f64,
    /// Time of summing densities and evaluating ψ.
    pub excess: f64,
    /// Time of many-body forces.
    pub second: f64,
    /// Time of copying forces to the host.
    pub forces: f64,
}

impl std::ops::AddAssign for Times {
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
