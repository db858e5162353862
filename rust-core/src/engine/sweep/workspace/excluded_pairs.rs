//! Excluded pairs in the order of cells.

use super::cell_order::{CellOrder, NOWHERE};
use crate::engine::exclusions::Exclusions;
use psidpd_passes::cells::excluded::{Excluded, Mark};
use psidpd_passes::simd::OFFSET_BITS;

/// The excluded pairs of the sorted particles.
#[derive(Debug, Clone, Default)]
pub struct ExcludedPairs {
    start: Vec<u32>,
    partners: Vec<u32>,
    sides: Vec<u32>,
    molecules: Vec<u32>,
    between_molecules: bool,
    /// Sorted index of each of the host's particles.
    place: Vec<u32>,
}

impl ExcludedPairs {
    /// Finds the sorted indices of the partners of all particles, and sorts their marks.
    pub fn fill(&mut self, order: &CellOrder, exclusions: Option<&Exclusions>) {
        self.start.clear();
        self.partners.clear();
        self.sides.clear();
        self.molecules.clear();
        let Some(exclusions) = exclusions else { return };
        if exclusions.has_partners() {
            self.fill_partners(order, exclusions);
        }
        self.between_molecules = exclusions.between_molecules;
        let marks = &exclusions.marks;
        let [by_rule, by_molecule] = exclusions.kinds;
        for (wanted, to, of) in [
            (by_rule, &mut self.sides, (|mark| mark.sides) as fn(&Mark) -> u32),
            (by_molecule, &mut self.molecules, |mark| mark.molecule),
        ] {
            if wanted {
                to.extend(order.order.iter().map(|k| marks.get(*k as usize).map_or(0, of)));
                to.extend_from_within(..order.copies());
            }
        }
    }

    fn fill_partners(&mut self, order: &CellOrder, exclusions: &Exclusions) {
        order.find_places(&mut self.place);
        let (all, copies) = (order.particles() as u32, order.copies() as u32);
        let last_plane = order.plane_start(order.grid.planes - 1);
        self.start.push(0);
        for (at, k) in order.order.iter().enumerate() {
            for partner in exclusions.of(*k) {
                let place = self.place.get(*partner as usize).copied().unwrap_or(NOWHERE);
                if place == NOWHERE {
                    continue;
                }
                self.partners.push(place << OFFSET_BITS);
                if at >= last_plane && place < copies {
                    self.partners.push((all + place) << OFFSET_BITS);
                }
            }
            self.start.push(self.partners.len() as u32);
        }
    }

    /// Lends the arrays to the passes.
    pub fn share(&self) -> Excluded<'_> {
        Excluded {
            start: &self.start,
            partners: &self.partners,
            sides: &self.sides,
            molecules: &self.molecules,
            between_molecules: self.between_molecules,
        }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        let held = [&self.start, &self.partners, &self.sides, &self.molecules, &self.place];
        held.map(|numbers| numbers.capacity() * size_of::<u32>()).iter().sum()
    }
}
