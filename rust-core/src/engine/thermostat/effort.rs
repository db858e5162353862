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

#[cfg(test)]
mod tests {
    use super::*;

    /// Updates of 3, 7 and 5 iterations, one after the other and as the sum of two records, in both orders.
    #[test]
    fn records_of_updates_add_up() {
        let record = |updates: &[(usize, bool, bool)]| {
            let mut effort = Effort::default();
            updates.iter().for_each(|update| effort.add(update.0, update.1, update.2));
            effort
        };
        let (first, last) = ([(3, true, false), (7, true, true)], [(5, false, false)]);
        let expected = Effort { updates: 3, iterations: 15, most: 7, listed: 2, inaccurate: 1 };
        assert_eq!(record(&[first[0], first[1], last[0]]), expected);
        for [a, b] in [[&first[..], &last[..]], [&last[..], &first[..]]] {
            let mut sum = record(a);
            sum += record(b);
            assert_eq!(sum, expected);
        }
        assert_eq!((expected.mean(), Effort::default().mean()), (Some(5.0), None));
    }
}
