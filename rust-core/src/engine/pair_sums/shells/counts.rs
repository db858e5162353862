//! Pairs in shells, by species.

/// Counts of the shells, for each species and each from it on.
pub struct Counts {
    pub kinds: usize,
    pub bins: usize,
    pub per_length: f64,
    pub numbers: Vec<u64>,
}

impl Counts {
    pub fn new(kinds: usize, bins: usize, range: f64) -> Counts {
        let per_length = bins as f64 / range;
        Counts { kinds, bins, per_length, numbers: vec![0; kinds * (kinds + 1) / 2 * bins] }
    }

    /// The first counter of species `a` and `b`, where `a` is not above `b`.
    fn first_of(&self, a: usize, b: usize) -> usize {
        // Species before `a` have kinds, kinds − 1, … rows.
        (a * self.kinds + b - a * (a + 1) / 2) * self.bins
    }

    /// Adds a pair at a distance, if it is in range.
    pub fn add(&mut self, [a, b]: [usize; 2], r: f64) {
        let shell = (r * self.per_length) as usize;
        if shell < self.bins {
            let first = self.first_of(a.min(b), a.max(b));
            self.numbers[first + shell] += 1;
        }
    }

    /// Zeros for each species of the first particle and of the second, and each shell and what lies beyond them.
    pub fn of_ordered_pairs(&self) -> Vec<u64> {
        vec![0; self.kinds * self.kinds * (self.bins + 1)]
    }

    /// Adds such numbers.
    pub fn take(&mut self, of_ordered_pairs: &[u64]) {
        for (pair, numbers) in of_ordered_pairs.chunks_exact(self.bins + 1).enumerate() {
            let [a, b] = [pair / self.kinds, pair % self.kinds];
            let first = self.first_of(a.min(b), a.max(b));
            self.numbers[first..].iter_mut().zip(&numbers[..self.bins]).for_each(|(sum, n)| *sum += n);
        }
    }
}
