//! Indices of pairs of species.

use super::{Deserialize, Serialize};

/// All pairs have index 0; the pairs of two given species follow. With one species there is only index 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpeciesPairs {
    species: Vec<String>,
}

impl SpeciesPairs {
    pub fn new(species: &[String]) -> SpeciesPairs {
        SpeciesPairs { species: species.to_vec() }
    }

    pub fn len(&self) -> usize {
        let count = self.species.len();
        if count > 1 { 1 + count * (count + 1) / 2 } else { 1 }
    }

    /// The two species of each index from 1 on.
    pub fn each(&self) -> impl Iterator<Item = (usize, usize)> {
        let count = if self.species.len() > 1 { self.species.len() } else { 0 };
        (0..count).flat_map(move |a| (a..count).map(move |b| (a, b)))
    }

    /// The number of pairs of each kind among particles of these species.
    pub fn ideal_pairs(&self, species: &[i32]) -> Vec<f64> {
        let numbers = self.numbers(species);
        let n = species.len() as f64;
        let mut all = vec![0.5 * n * (n - 1.0)];
        all.extend(self.each().map(|(a, b)| {
            if a == b { 0.5 * numbers[a] * (numbers[a] - 1.0) } else { numbers[a] * numbers[b] }
        }));
        all
    }

    /// The number of particles of each species.
    pub fn numbers(&self, species: &[i32]) -> Vec<f64> {
        let mut numbers = vec![0.0; self.species.len()];
        species.iter().for_each(|s| numbers[*s as usize] += 1.0);
        numbers
    }

    pub fn names(&self, what: &str) -> Vec<String> {
        let name = |(a, b): (usize, usize)| format!("{what}_{}_{}", self.species[a], self.species[b]);
        std::iter::once(what.to_owned()).chain(self.each().map(name)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_go_together() {
        let pairs = SpeciesPairs::new(&["A".into(), "B".into(), "C".into()]);
        assert_eq!(pairs.names("g"), ["g", "g_A_A", "g_A_B", "g_A_C", "g_B_B", "g_B_C", "g_C_C"]);
        assert_eq!(pairs.each().collect::<Vec<_>>(), [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]);
        assert_eq!(pairs.len(), 7);
        assert_eq!(pairs.ideal_pairs(&[0, 0, 1, 2]), [6.0, 1.0, 2.0, 2.0, 0.0, 1.0, 0.0]);
        let one = SpeciesPairs::new(&["A".into()]);
        assert_eq!((one.len(), one.names("g").len(), one.each().count()), (1, 1, 0));
    }
}
