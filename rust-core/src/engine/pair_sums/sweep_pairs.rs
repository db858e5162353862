//! Finds the pairs of a box by the vectorised search of the sweep, with distances in double precision.

use super::pairs::Pairs;
use crate::engine::particles::Particles;
use crate::engine::surroundings::Around;
use crate::engine::sweep::{MARGIN, PairLists, Places, PlanePairs, Pool};
use crate::model::Fluid;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::Exponent;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::plane::list::{ListTerms, WeightTables, pairs_of_each};
use std::num::NonZeroUsize;

/// Finds the pairs of a fluid in boxes at least twice as wide as their range.
#[derive(Debug)]
pub struct SweepPairs {
    lists: PairLists,
    pool: Pool,
    dimensions: usize,
    range: f64,
    /// Weights greater than 0 within the range.
    terms: ListTerms,
    kinds: Vec<i32>,
    tags: Vec<i32>,
    planes: Vec<PlanePairs>,
}

impl SweepPairs {
    /// Creates the search for pairs in the range of the conservative interactions.
    pub fn new(fluid: &Fluid) -> SweepPairs {
        let (range, species) = (fluid.conservative_range(), fluid.species.len());
        SweepPairs {
            lists: PairLists::new(InstructionSet::best(), fluid.dimensions),
            pool: Pool::new(NonZeroUsize::MIN),
            dimensions: fluid.dimensions,
            range,
            terms: ListTerms::new(
                WeightTables {
                    species,
                    amplitude: SpeciesPairTable::of(species * species, 1.0),
                    inverse_range: SpeciesPairTable::of(species * species, 1.0 / range),
                    exponent: Exponent::One,
                },
                MARGIN,
                false,
            ),
            kinds: (0..species as i32).collect(),
            tags: Vec::new(),
            planes: Vec::new(),
        }
    }

    /// Adds the pairs of particles at `x`, and returns whether it could: it cannot if a particle may be
    /// near two images of another, or if a position is not finite.
    pub fn find(&mut self, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox, pairs: &mut Pairs) -> bool {
        let SweepPairs { lists, pool, dimensions, range, terms, kinds, tags, planes } = self;
        let is_periodic = [0, 1, 2].map(|k| domain.periodic()[k] && k < *dimensions);
        let search_range = *range * (1.0 + MARGIN);
        let is_wide = |k: usize| !is_periodic[k] || domain.height(k) > 2.0 * search_range;
        if !(*range > 0.0 && range.is_finite() && (0..3).all(is_wide)) {
            return false;
        }
        tags.resize(x.len(), 0);
        tags.iter_mut().zip(1..).for_each(|(tag, k)| *tag = k);
        let particles = Particles { x, tag: tags, kind: species, owned: x.len() };
        let around = Around { domain, images: &[] };
        // In a long region the search would need a margin of its own.
        let terms = |_| terms.clone();
        if lists.find(pool, around, &particles, kinds, terms, [*range, MARGIN], planes) != Ok(false) {
            return false;
        }
        let places = Places::new(*dimensions, domain, x, lists.order());
        let images = places.images;
        for PlanePairs { own, lists, .. } in planes {
            for (i, of_i) in pairs_of_each(&lists.own.start) {
                for pair in &lists.own.pairs[of_i] {
                    let (i, j) = (own.start + i, own.start + pair.j as usize);
                    let (a, b) = (places.x(i), places.x(j));
                    let mut d = [0, 1, 2].map(|c| [a[c] - b[c]]);
                    images.find_nearest(&mut d);
                    let d = d.map(|[d]| d);
                    if d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < *range * *range {
                        pairs.force.push(places.host(i), places.host(j), d, species);
                    }
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::pair_sums::for_each_pair;
    use crate::engine::surroundings::Newton;
    use crate::model::Model;
    use nalgebra::Matrix3;
    use psidpd_passes::noise::threefry2x32;

    fn model(dimensions: usize) -> Fluid {
        let text = format!(
            "title = \"m\"\ndimensions = {dimensions}\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"lucy\"\nrange = 0.9\n\
             [excess_free_energy]\nA = \"n^2\"\nB = \"n^3\"\n"
        );
        Model::parse("m.toml", &text).unwrap().at(1.0).unwrap()
    }

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
            let fluid = model(dimensions);
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
            let mut pairs = Pairs::default();
            pairs.clear(x.len(), Newton::On);
            assert!(SweepPairs::new(&fluid).find(&x, &species, &domain, &mut pairs));
            let list = pairs.force;
            let signed =
                |i: usize, j: usize, d: [f64; 3]| if i < j { (i, j, d) } else { (j, i, d.map(|c| -c)) };
            let d = |k: usize| list.d.each_ref().map(|d| d[k]);
            let mut found: Vec<_> =
                (0..list.len()).map(|k| signed(list.i[k] as usize, list.j[k] as usize, d(k))).collect();
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
        let (mut search, mut pairs) = (SweepPairs::new(&model(3)), Pairs::default());
        let wide = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let narrow = PeriodicBox::orthogonal([0.0; 3], [1.7, 4.0, 4.0], [true; 3]).unwrap();
        assert!(!search.find(&[[0.5; 3]], &[0], &narrow, &mut pairs));
        assert!(!search.find(&[[f64::NAN, 0.5, 0.5]], &[0], &wide, &mut pairs));
        assert!(search.find(&[], &[], &wide, &mut pairs) && pairs.force.len() == 0);
    }
}
