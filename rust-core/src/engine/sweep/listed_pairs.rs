//! Pairs that an evaluation lists for a thermostat, with the geometry that it computes anyway.

use super::{EitherPrecision, PairLists, PlanePairs, Sweep, with};
use crate::engine::plan::ThermostatPlan;
use psidpd_passes::plane::list::ListTerms;

/// What pairs are listed for.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedFor {
    /// The drag and noise of the thermostat.
    pub plan: ThermostatPlan,
    /// The time that it acts for.
    pub dt: f64,
    /// Whether distances are stored.
    pub virial: bool,
}

impl ListedFor {
    /// Whether these pairs are those of `asked`, perhaps with distances beside.
    fn serves(&self, asked: &ListedFor) -> bool {
        self.dt == asked.dt && (self.virial || !asked.virial) && self.plan == asked.plan
    }
}

/// The pairs of an evaluation, which a thermostat takes once or not at all.
#[derive(Debug)]
pub struct ListedPairs<'a> {
    sweep: &'a mut Sweep,
    listed: ListedFor,
    positions: u64,
}

impl ListedPairs<'_> {
    /// Moves the pairs to `lists` and `planes`, if they are those that are `asked` for between particles at `x`; returns whether they
    /// are. Particles of a cell are in the order of the host.
    pub fn take(
        self,
        asked: &ListedFor,
        x: &[[f64; 3]],
        lists: &mut PairLists,
        planes: &mut Vec<PlanePairs>,
    ) -> bool {
        if !self.listed.serves(asked) || self.positions != of_positions(x) {
            return false;
        }
        with!(&mut self.sweep.workspace, m => {
            let cells = &m.order;
            planes.resize_with(cells.grid.planes, PlanePairs::default);
            planes.iter_mut().enumerate().for_each(|(k, plane)| plane.lie_in(cells, k));
            lists.follow(cells);
            m.move_lists(planes.iter_mut().map(|plane| &mut plane.lists));
        });
        true
    }
}

impl Sweep {
    /// Asks the next evaluation to list pairs. It lists them without excluded pairs, and if drag and noise are not among the forces.
    pub(in crate::engine) fn ask_for_pairs(&mut self, asked: Option<(ListTerms, ListedFor)>) {
        (self.asked, self.listed) = (asked, None);
    }

    /// Takes lists that nobody needs, for the memory of the pairs that the next evaluation lists.
    pub(in crate::engine) fn lend_lists(&mut self, planes: &mut [PlanePairs]) {
        let lists = planes.iter_mut().map(|plane| std::mem::take(&mut plane.lists));
        with!(&mut self.workspace, m => m.lend_lists(lists));
    }

    /// The pairs that the last evaluation has listed, once.
    pub(in crate::engine) fn listed_pairs(&mut self) -> Option<ListedPairs<'_>> {
        let (listed, positions) = self.listed.take().filter(|_| self.is_complete)?;
        Some(ListedPairs { sweep: self, listed, positions })
    }
}

/// A number that is another one for other positions, or for the same in another order, but for one case in 2⁶⁴.
pub(super) fn of_positions(x: &[[f64; 3]]) -> u64 {
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
