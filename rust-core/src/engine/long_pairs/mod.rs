//! Pair potentials of rare species with long ranges, apart from the sweep.
//!
//! A sweep has one range, the longest, and compares all particles within it. A few large particles in a solvent, whose range is a third
//! of theirs, would cost 27 times the comparisons. Potentials of a longer range than the rest of the fluid, one of whose species is rare,
//! are therefore left to a search around each particle of that species, and the sweep does the rest in the shorter range.
//!
//! Others of a species that is not rare are searched in the cells that the sweep has sorted all particles into.
//!
//! - [`group`]: the potentials between two species.
//! - [`rare`]: the particles of rare species, sorted into cells of their own, in which they find each other.
//! - [`block`]: the forces of some particles of rare species, in double precision.
//!
//! Each block collects the forces of its pairs, and they are added in the order of blocks, so that results do not depend on threads.

mod block;
mod group;
mod rare;

use super::error::EngineError;
use super::particles::Particles;
use super::plan::Plan;
use super::sweep::{Places, Sorted};
use crate::model::PairTerm;
use crate::model::pair::PairForm;
use block::{BLOCK, Block, Input};
use group::Group;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_search::around::{Columns, may_meet_twice};
use psidpd_passes::tally::{Tally, Want};
use psidpd_threads::Pool;
use rare::RareParticles;

/// The time of a pair apart in that of a pair of the sweep, each within its range. Measured with 3 to 20 % of large particles of ranges 1, 2
/// and 3, and with 10 % of ranges 1, 2 and 2: 2.8 to 3.4; with fewer pairs around each particle up to 6.
const APART: f64 = 3.3;

/// Potentials are apart if that takes less than this fraction of the time of the whole sweep.
const WORTH: f64 = 0.8;

/// Blocks that each thread computes before their forces are added.
const BLOCKS_OF_THREAD: usize = 8;

/// The potentials that are apart from a sweep, and the arrays of their evaluation.
#[derive(Debug)]
pub struct LongPairs {
    /// Their indices among those of the plan.
    pub which: Vec<usize>,
    groups: Vec<Group>,
    rare: RareParticles,
    blocks: Vec<Block>,
}

/// The species of a term, the rarer one first.
fn rare_first(term: &PairTerm, count: &[usize]) -> [usize; 2] {
    let [a, b] = term.between;
    if count[a] > count[b] { [b, a] } else { [a, b] }
}

/// Which pair potentials of a plan are faster apart from the sweep, for so many particles of each species. The volume does not matter:
/// all numbers of pairs are inversely proportional to it.
pub fn faster_apart(plan: &Plan, count: &[usize]) -> Vec<usize> {
    let volume = |range: f64| range.powi(plan.dimensions as i32);
    let all = count.iter().sum::<usize>() as f64;
    let sweep = |range: f64| 0.5 * all * all * volume(range);
    let base = plan.range_without_pairs();
    let range_of = |k: usize| plan.pairs[k].potential.range();
    let longer = |range: f64| (0..plan.pairs.len()).filter(move |k| range_of(*k) > range);
    let apart = |k: usize| {
        let [a, b] = plan.pairs[k].between;
        let pairs = if a == b { 0.5 } else { 1.0 } * (count[a] * count[b]) as f64;
        APART * pairs * volume(range_of(k))
    };
    let cost = |range: f64| sweep(range) + longer(range).map(apart).sum::<f64>();
    let ranges = (0..plan.pairs.len()).map(range_of).chain([base]);
    let shorter = ranges.filter(|range| (base..plan.cutoff).contains(range) && *range > 0.0);
    let best = shorter.min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
    best.filter(|range| cost(*range) < WORTH * sweep(plan.cutoff))
        .map_or(Vec::new(), |range| longer(range).collect())
}

impl LongPairs {
    /// The potentials `which` of a plan, for so many particles of each species.
    pub fn new(plan: &Plan, which: Vec<usize>, count: &[usize]) -> LongPairs {
        let mut groups: Vec<Group> = Vec::new();
        for k in &which {
            let term = plan.pairs[*k].clone();
            let ([rare, other], range) = (rare_first(&term, count), term.potential.range());
            match groups.iter_mut().find(|group| [group.rare, group.other] == [rare, other]) {
                Some(group) => {
                    group.range = group.range.max(range);
                    group.terms.push(term);
                }
                None => groups.push(Group { rare, other, among_rare: false, terms: vec![term], range }),
            }
        }
        let rare: Vec<usize> = groups.iter().map(|group| group.rare).collect();
        groups.iter_mut().for_each(|group| group.among_rare = rare.contains(&group.other));
        let mut is_rare = vec![false; plan.species.len()];
        rare.into_iter().for_each(|species| is_rare[species] = true);
        LongPairs { which, groups, rare: RareParticles::new(is_rare), blocks: Vec::new() }
    }

    /// The longest range among all groups, or among those of rare particles with each other.
    fn longest(&self, among_rare: bool) -> f64 {
        let groups = self.groups.iter().filter(|group| group.among_rare || !among_rare);
        groups.map(|group| group.range).fold(0.0, f64::max)
    }

    /// Whether particles meet in one image only.
    pub fn fit(&self, dimensions: usize, domain: &PeriodicBox) -> bool {
        (0..dimensions).all(|k| !domain.periodic()[k] || domain.height(k) >= 2.0 * self.longest(false))
    }

    /// Adds the forces on particles in a box, which a sweep has just sorted, and returns energy and virial if they are requested.
    ///
    /// # Errors
    /// Fails for a force that is not finite.
    pub fn add_forces(
        &mut self,
        (pool, set, plan): (&Pool, InstructionSet, &Plan),
        domain: &PeriodicBox,
        (particles, sorted): (&Particles, Sorted),
        want: Want,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, EngineError> {
        let longest = self.longest(false);
        self.rare.sort(&sorted, self.longest(true));
        let LongPairs { groups, rare, blocks, .. } = self;
        let Sorted { order, x, species } = sorted;
        let cells = [order.grid.along(), order.grid.steps()].map(|of| of.map(|n| n as usize));
        let input = Input {
            set,
            geometry: &order.geometry,
            images: Places::new(plan.dimensions, domain, particles.x, &order.order).images,
            x: particles.x,
            fixed32: &order.fixed32,
            all: (Columns::new(&order.geometry, cells, &order.start, x, species), &order.order),
            rare: rare.columns(&order.geometry),
            of_rare: rare,
            groups,
            meet_twice: may_meet_twice(&order.geometry, longest),
            want,
        };
        let at_once = if pool.threads() == 1 { 1 } else { BLOCKS_OF_THREAD * pool.threads() };
        blocks.resize_with(at_once, Block::default);
        let (mut tally, mut lost) = (Tally::default(), None::<i32>);
        let count = rare.len().div_ceil(BLOCK);
        for first in (0..count).step_by(at_once) {
            let blocks = &mut blocks[..at_once.min(count - first)];
            blocks.iter_mut().zip(first..).for_each(|(block, number)| block.number = number);
            pool.each(blocks, |block| block.compute(&input));
            for block in blocks {
                tally += block.tally;
                for one in block.add_to(force) {
                    let tag = particles.tag[one];
                    lost = Some(lost.map_or(tag, |other| other.min(tag)));
                }
            }
        }
        lost.map_or(Ok(tally), |tag| Err(EngineError::Force { tag }))
    }

    /// Size in bytes of the arrays.
    pub fn memory(&self) -> usize {
        self.rare.memory() + self.blocks.iter().map(Block::memory).sum::<usize>()
    }
}
