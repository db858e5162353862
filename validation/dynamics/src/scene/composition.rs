//! `composition` and `species` of a filled region.

use super::{FileError, Section};

/// Number fractions of the species, in the order of the model; they add up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Composition(pub(super) Vec<f64>);

impl Composition {
    /// Reads the fractions; equal ones if the file gives none. Species without an entry get none.
    pub(super) fn read(initial: &Section, species: &[String]) -> Result<Composition, FileError> {
        let mut fractions = vec![0.0; species.len()];
        if let Some(value) = initial.get("species") {
            let index: usize = value.string()?.among("species", species.iter().zip(0..))?;
            fractions[index] = 1.0;
            if let Some(both) = initial.get("composition") {
                return Err(both.error("species is given too: give one of them"));
            }
            return Ok(Composition(fractions));
        }
        let Some(value) = initial.get("composition") else {
            fractions.fill(1.0 / species.len() as f64);
            return Ok(Composition(fractions));
        };
        let section = value.section()?;
        for (name, value) in section.entries() {
            let index: usize = name.among("species", species.iter().zip(0..))?;
            fractions[index] = value.within(value.number()?, 0.0, 1.0)?;
        }
        let sum: f64 = fractions.iter().sum();
        if (sum - 1.0).abs() > 1e-6 {
            return Err(value.error(format!("the fractions add up to {sum}, not to 1")));
        }
        Ok(Composition(fractions))
    }

    /// The most frequent species.
    pub fn main(&self) -> usize {
        (0..self.0.len()).max_by(|a, b| self.0[*a].total_cmp(&self.0[*b])).unwrap_or(0)
    }

    /// Divides `count` particles among the species: whole numbers that add up to `count`, each less than one
    /// from its exact share.
    pub fn share(&self, count: usize) -> Vec<usize> {
        let exact: Vec<f64> = self.0.iter().map(|f| f * count as f64).collect();
        let mut shares: Vec<usize> = exact.iter().map(|e| *e as usize).collect();
        let mut order: Vec<usize> = (0..shares.len()).collect();
        let rest = |k: &usize| exact[*k] - exact[*k].floor();
        order.sort_by(|a, b| rest(b).total_cmp(&rest(a)));
        // Rounding of the fractions can leave the sum too small or too large by a few particles.
        let mut turn = order.iter().cycle().filter(|k| self.0[**k] > 0.0);
        while shares.iter().sum::<usize>() < count {
            if let Some(k) = turn.next() {
                shares[*k] += 1;
            }
        }
        while shares.iter().sum::<usize>() > count {
            if let Some(largest) = shares.iter_mut().max() {
                *largest -= 1;
            }
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up() {
        let third = Composition(vec![1.0 / 3.0; 3]);
        assert_eq!(third.share(10), [4, 3, 3]);
        assert_eq!(Composition(vec![0.25, 0.0, 0.75]).share(6), [2, 0, 4]);
        assert_eq!(Composition(vec![1.0]).share(7), [7]);
        assert_eq!(Composition(vec![0.0, 1.0 + 1e-7]).share(100_000_000), [0, 100_000_000]);
    }
}
