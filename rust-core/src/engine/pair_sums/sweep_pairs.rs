//! Finds the pairs of a box by the vectorised search of the sweep, with distances in double precision.

use super::plane_list::PlaneList;
use crate::engine::particles::Particles;
use crate::engine::surroundings::Around;
use crate::engine::sweep::{MARGIN, PairLists, Places, PlanePairs, Pool};
use crate::model::Fluid;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::Exponent;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::plane::list::{ListTerms, WeightTables};

/// The ranges of pairs, by both species.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranges {
    species: usize,
    /// Row by row; a single one if all are alike.
    table: Vec<f64>,
}

impl Ranges {
    /// One range for all pairs.
    pub fn all(range: f64) -> Ranges {
        Ranges { species: 1, table: vec![range] }
    }

    /// Those of the conservative interactions of a fluid.
    pub fn conservative(fluid: &Fluid) -> Ranges {
        let species = fluid.species.len();
        let pairs = (0..species).flat_map(|a| (0..species).map(move |b| (a, b)));
        let table = pairs.map(|(a, b)| fluid.conservative_range_between(a, b)).collect();
        let ranges = Ranges { species, table };
        if ranges.shortest() == ranges.longest() { Ranges::all(ranges.longest()) } else { ranges }
    }

    pub fn longest(&self) -> f64 {
        self.table.iter().copied().fold(0.0, f64::max)
    }

    pub fn shortest(&self) -> f64 {
        self.table.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// All of them longer by a factor.
    pub fn times(&self, factor: f64) -> Ranges {
        Ranges { table: self.table.iter().map(|range| range * factor).collect(), ..*self }
    }

    /// Weights greater than 0 within the ranges.
    fn terms(&self) -> ListTerms {
        let weights = WeightTables {
            species: self.species,
            amplitude: SpeciesPairTable::of(self.table.len(), 1.0),
            inverse_range: WeightTables::inverse_ranges(&self.table),
            exponent: Exponent::One,
        };
        ListTerms::new(weights, MARGIN)
    }
}

/// Finds pairs in boxes at least twice as wide as their range.
#[derive(Debug)]
pub struct SweepPairs {
    lists: PairLists,
    dimensions: usize,
    alike: Vec<i32>,
    tags: Vec<i32>,
    planes: Vec<PlanePairs>,
}

impl SweepPairs {
    pub fn new(dimensions: usize) -> SweepPairs {
        SweepPairs {
            lists: PairLists::new(InstructionSet::best(), dimensions),
            dimensions,
            alike: Vec::new(),
            tags: Vec::new(),
            planes: Vec::new(),
        }
    }

    /// Finds the pairs of particles at `x` in planes, and returns whether it could: it cannot if a particle may be
    /// near two images of another, or if a position is not finite. Pairs may be a little beyond their ranges.
    pub fn find(
        &mut self,
        pool: &Pool,
        x: &[[f64; 3]],
        species: &[i32],
        domain: &PeriodicBox,
        ranges: &Ranges,
        found: &mut Vec<PlaneList>,
    ) -> bool {
        let SweepPairs { lists, dimensions, alike, tags, planes } = self;
        let range = ranges.longest();
        if !is_wide(domain, *dimensions, range) {
            return false;
        }
        tags.resize(x.len(), 0);
        tags.iter_mut().zip(1..).for_each(|(tag, k)| *tag = k);
        // Where all pairs have one range all particles may be of one species.
        alike.resize(x.len(), 0);
        let kind = if ranges.species > 1 { species } else { alike };
        let particles = Particles { x, tag: tags, kind, owned: x.len() };
        let around = Around { domain, images: &[] };
        // In a long region the search would need a margin of its own.
        let kinds: Vec<i32> = (0..ranges.species as i32).collect();
        let terms = |_| ranges.terms();
        if lists.find(pool, around, &particles, &kinds, terms, [range, MARGIN], planes) != Ok(false) {
            return false;
        }
        let places = Places::new(*dimensions, domain, x, lists.order());
        found.resize_with(planes.len(), PlaneList::default);
        let mut work: Vec<_> = planes.iter().zip(found).collect();
        pool.each(&mut work, |(plane, list)| list.measure(plane, &places, species));
        true
    }
}

/// Whether a box is so wide that no particle is near two images of another, and the range positive.
pub fn is_wide(domain: &PeriodicBox, dimensions: usize, range: f64) -> bool {
    let wide = |k: usize| !domain.periodic()[k] || domain.height(k) > 2.0 * range * (1.0 + MARGIN);
    range > 0.0 && range.is_finite() && (0..dimensions).all(wide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::pair_sums::for_each_pair;
    use nalgebra::Matrix3;
    use psidpd_passes::noise::threefry2x32;
    use std::num::NonZeroUsize;

    /// The pairs are those of the search by cells and images, also for particles outside the box, at
    /// one point, and close together.
    #[test]
    fn pairs_are_those_of_the_plain_search() {
        let skew = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 3.0);
        let boxes = [
            (PeriodicBox::orthogonal([-1.0, 0.0, 2.0], [2.0, 4.0, 3.0], [true; 3]).unwrap(), 3),
            (PeriodicBox::orthogonal([0.0; 3], [4.0, 3.0, 5.0], [true, false, true]).unwrap(), 3),
            (PeriodicBox::new([1.0, 2.0, 3.0], skew, [true; 3]).unwrap(), 3),
            (PeriodicBox::orthogonal([0.0, 0.0, -0.5], [5.0, 7.0, 1.0], [true; 3]).unwrap(), 2),
        ];
        let uniform = |k: u32| f64::from(threefry2x32::<20>([k, 0], [5, 9])[0]) / 4_294_967_296.0;
        for (domain, dimensions) in boxes {
            let mut x: Vec<[f64; 3]> = (0..300)
                .map(|k| {
                    let s = [0, 1, 2].map(|c| uniform(3 * k + c));
                    domain.point([s[0], s[1], if dimensions == 3 { s[2] } else { 0.5 }])
                })
                .collect();
            (0..3).for_each(|c| x[3][c] += domain.edge(0)[c]);
            x[11] = x[10];
            x[21] = [x[20][0] + 1e-9, x[20][1], x[20][2]];
            let species: Vec<i32> = (0..x.len() as i32).map(|k| k % 2).collect();
            let (pool, mut planes) = (Pool::new(NonZeroUsize::new(2).unwrap()), Vec::new());
            assert!(SweepPairs::new(dimensions).find(
                &pool,
                &x,
                &species,
                &domain,
                &Ranges::all(0.9),
                &mut planes
            ));
            let signed =
                |i: usize, j: usize, d: [f64; 3]| if i < j { (i, j, d) } else { (j, i, d.map(|c| -c)) };
            let pairs = planes.iter().flat_map(|plane| plane.pairs(0.9));
            let mut found: Vec<_> = pairs.map(|p| signed(p.i, p.j, p.d)).collect();
            let mut expected = Vec::new();
            for_each_pair(&x, &domain, dimensions, 0.9, |p| expected.push(signed(p.i, p.j, p.d)));
            found.sort_by_key(|p| (p.0, p.1));
            expected.sort_by_key(|p| (p.0, p.1));
            assert!(expected.len() > 300 && found.len() == expected.len());
            for (f, e) in found.iter().zip(&expected) {
                let error = (0..3).map(|c| (f.2[c] - e.2[c]).abs()).fold(0.0, f64::max);
                assert!((f.0, f.1) == (e.0, e.1) && error < 1e-14, "{f:?} {e:?}");
            }
        }
    }

    #[test]
    fn what_it_cannot_do_is_said() {
        let (mut search, mut planes) = (SweepPairs::new(3), Vec::new());
        let pool = &Pool::new(NonZeroUsize::MIN);
        let wide = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let narrow = PeriodicBox::orthogonal([0.0; 3], [1.7, 4.0, 4.0], [true; 3]).unwrap();
        assert!(!search.find(pool, &[[0.5; 3]], &[0], &narrow, &Ranges::all(0.9), &mut planes));
        assert!(!search.find(pool, &[[f64::NAN, 0.5, 0.5]], &[0], &wide, &Ranges::all(0.9), &mut planes));
        assert!(search.find(pool, &[], &[], &wide, &Ranges::all(0.9), &mut planes));
        assert!(planes.iter().all(|plane| plane.pairs(0.9).next().is_none()));
    }
}
