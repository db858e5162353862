//! What an evaluation lists pairs for, and where.

use crate::engine::plan::ThermostatPlan;

/// What pairs are listed for.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedFor {
    /// The drag and noise of the thermostat.
    pub plan: ThermostatPlan,
    /// The time that it acts for.
    pub dt: f64,
}

impl ListedFor {
    /// Whether these pairs are those of a thermostat for a time `dt`.
    pub fn serves(&self, plan: &ThermostatPlan, dt: f64) -> bool {
        self.dt == dt && self.plan == *plan
    }
}

/// A number that is another one for other positions, or for the same in another order, but for one case in 2⁶⁴.
pub fn of_positions(x: &[[f64; 3]]) -> u64 {
    const LANES: usize = 8;
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    let (chunks, rest) = x.as_flattened().as_chunks::<LANES>();
    let mut sums = [0u64; LANES];
    for chunk in chunks {
        for (sum, x) in sums.iter_mut().zip(chunk) {
            *sum = sum.rotate_left(7).wrapping_add(x.to_bits());
            *sum ^= *sum >> 32;
        }
    }
    let rest = rest.iter().map(|x| x.to_bits());
    let all = sums.into_iter().chain(rest);
    all.fold(x.len() as u64, |sum, next| (sum.rotate_left(5) ^ next).wrapping_mul(FACTOR))
}

#[cfg(test)]
mod tests {
    use super::of_positions;

    /// The last bit of one coordinate, two particles that change places, one more: each is other positions. A moved particle in one
    /// of many places never cancels in 10⁴ trials.
    #[test]
    fn other_positions_have_other_numbers() {
        let x: Vec<[f64; 3]> = (0..100).map(|k| [0, 1, 2].map(|c| f64::from(k * k + c).sin())).collect();
        let known = of_positions(&x);
        assert_eq!(known, of_positions(&x.clone()));
        for k in 0..100 {
            for c in 0..3 {
                let mut moved = x.clone();
                moved[k][c] = f64::from_bits(moved[k][c].to_bits() ^ 1);
                assert_ne!(known, of_positions(&moved), "{k} {c}");
                moved[k][c] = -x[k][c];
                assert_ne!(known, of_positions(&moved), "{k} {c}");
            }
            let mut exchanged = x.clone();
            exchanged.swap(k, (k + 1) % 100);
            assert_ne!(known, of_positions(&exchanged), "{k}");
        }
        assert_ne!(known, of_positions(&x[..99]));
        let all = (0..10_000).map(|k| {
            let mut moved = x.clone();
            moved[k % 100][k % 3] += 1e-9 * (k + 1) as f64;
            of_positions(&moved)
        });
        let distinct: std::collections::HashSet<u64> = all.chain([known]).collect();
        assert_eq!(distinct.len(), 10_001);
    }
}
