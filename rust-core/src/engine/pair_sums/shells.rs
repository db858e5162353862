//! Histograms of the distances of particles.

mod counts;
mod windows;

use super::in_box::for_each_pair;
use super::sweep_pairs::is_wide;
use crate::engine::particles::Particles;
use crate::engine::sweep::{MARGIN, PairLists, Places, Pool};
use counts::Counts;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::instruction_set::InstructionSet;

/// Pairs in each of `bins` shells of equal thickness up to `range`:
/// `bins` numbers for each species `a` of `kinds` and each `b` from `a` on, those of double precision. Particles without a finite
/// position make no pairs.
///
/// The search of the sweep finds the pairs, and single precision measures them; the few that are so near to the edge of a shell
/// that rounding may matter are measured once more. Where it does not apply, as at a range of half the box, [`windows`] counts them, and
/// [`for_each_pair`] at longer ranges, where two particles may make several pairs.
pub fn count_in_shells(
    pool: &Pool,
    x: &[[f64; 3]],
    species: &[i32],
    kinds: usize,
    (domain, dimensions): (&PeriodicBox, usize),
    range: f64,
    bins: usize,
) -> Vec<u64> {
    let mut counts = Counts::new(kinds, bins, range);
    let is_counted = is_wide(domain, dimensions, range)
        && by_search(&mut counts, InstructionSet::best(), pool, x, species, (domain, dimensions), range);
    let is_single = |k: usize| !domain.periodic()[k] || domain.height(k) >= 2.0 * range;
    if !is_counted && (0..dimensions).all(is_single) {
        windows::count(&mut counts, pool, x, species, (domain, dimensions), range);
    } else if !is_counted {
        for_each_pair(x, domain, dimensions, range, |pair| {
            counts.add([pair.i, pair.j].map(|k| species[k] as usize), pair.r);
        });
    }
    counts.numbers
}

/// Counts by the search of the sweep, and returns whether that was possible.
fn by_search(
    counts: &mut Counts,
    set: InstructionSet,
    pool: &Pool,
    x: &[[f64; 3]],
    species: &[i32],
    (domain, dimensions): (&PeriodicBox, usize),
    range: f64,
) -> bool {
    let Counts { kinds, bins, .. } = *counts;
    let tags: Vec<i32> = (1..=x.len() as i32).collect();
    let particles = Particles { x, tag: &tags, kind: species, owned: x.len() };
    let all: Vec<i32> = (0..kinds as i32).collect();
    let mut lists = PairLists::new(set, dimensions);
    let Ok(shares) = lists.count(pool, domain, &particles, &all, [range, MARGIN], bins) else {
        return false;
    };
    let places = Places::new(dimensions, domain, x, lists.order());
    for share in shares {
        counts.take(&share.numbers);
        for [i, j] in share.unsure {
            let kinds = [i, j].map(|k| species[places.host(k)] as usize);
            counts.add(kinds, places.distance(i, j));
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::pair_sums::for_each_pair;
    use nalgebra::Matrix3;
    use psidpd_passes::noise::threefry2x32;
    use psidpd_passes::settings::Instructions;
    use std::num::NonZeroUsize;

    /// Uniform numbers, one after the other.
    fn uniform() -> impl FnMut() -> f64 {
        let mut k = 0;
        move || {
            k += 1;
            f64::from(threefry2x32::<20>([k, 0], [5, 9])[0]) / 4_294_967_296.0
        }
    }

    /// The counts agree with all pairs one by one, for any box, whether the search of the sweep applies or not.
    #[test]
    fn counts_are_those_of_single_pairs() {
        let mut random = uniform();
        let skew = Matrix3::new(7.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 4.0);
        let along = |a, b, c| Matrix3::new(a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c);
        let cases = [
            (along(4.0, 4.0, 4.0), [true; 3], 3, 2.0, false),
            (along(4.0, 4.0, 4.0), [true; 3], 3, 1.9999, true),
            (along(9.0, 5.0, 4.0), [true; 3], 3, 0.9, true),
            (along(9.0, 5.0, 4.0), [true, false, true], 3, 1.7, true),
            (along(3.0, 4.0, 8.0), [false; 3], 3, 5.0, true),
            (skew, [true; 3], 3, 1.5, true),
            (skew, [true, true, false], 3, 1.5, false),
            (along(12.0, 7.0, 1.0), [true, true, false], 2, 3.5, false),
            (along(12.0, 7.0, 1.0), [true, true, false], 2, 3.4, true),
            (along(6.0, 12.0, 1.0), [false, true, false], 2, 0.7, true),
            (along(9e4, 4.0, 4.0), [true; 3], 3, 1.9, false),
        ];
        let (bins, species): (usize, Vec<i32>) = (11, (0..400).map(|k| k % 5 / 2).collect());
        for (edges, periodic, dimensions, range, searched) in cases {
            let domain = PeriodicBox::new([-1.0, 0.5, 2.0], edges, periodic).unwrap();
            let mut place = || domain.point([0, 1, 2].map(|k| if k < dimensions { random() } else { 0.0 }));
            let mut x: Vec<[f64; 3]> = (0..400).map(|_| place()).collect();
            // Two at one place.
            x[5] = x[4];
            let is_open = periodic == [false; 3];
            for (changed, nowhere) in [(x[17], false), ([f64::NAN; 3], true), ([3e10; 3], true)] {
                if changed[0] > 1e9 && !is_open {
                    continue;
                }
                x[17] = changed;
                let mut expected = vec![0; 6 * bins];
                for_each_pair(&x, &domain, dimensions, range, |p| {
                    let (a, b) = (species[p.i].min(species[p.j]), species[p.i].max(species[p.j]));
                    let kind = (a * 3 - a * (a + 1) / 2 + b) as usize;
                    expected[bins * kind + ((p.r / range * bins as f64) as usize).min(bins - 1)] += 1;
                });
                assert!(domain.height(0) > 1e3 || expected.iter().sum::<u64>() > 400, "pairs to count");
                for threads in [1, 3] {
                    let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
                    let found = count_in_shells(&pool, &x, &species, 3, (&domain, dimensions), range, bins);
                    assert_eq!(found, expected, "{edges} {periodic:?}");
                    let mut counts = Counts::new(3, bins, range);
                    windows::count(&mut counts, &pool, &x, &species, (&domain, dimensions), range);
                    assert_eq!(counts.numbers, expected, "{edges} {periodic:?}");
                    let sets =
                        Instructions::ALL.map(|(_, set)| set).into_iter().filter_map(InstructionSet::new);
                    for set in sets {
                        let mut counts = Counts::new(3, bins, range);
                        let is_found = is_wide(&domain, dimensions, range)
                            && by_search(&mut counts, set, &pool, &x, &species, (&domain, dimensions), range);
                        assert_eq!(is_found, searched && !nowhere, "{set:?} {edges} {periodic:?} {range}");
                        assert!(
                            !is_found || counts.numbers == expected,
                            "{set:?} {edges} {periodic:?} {range}"
                        );
                    }
                }
            }
        }
    }

    /// Pairs a billionth of a shell below and above the edge of each shell, in every direction, each alone in its part of the box: their
    /// shells are known, and single precision does not tell them.
    #[test]
    fn pairs_at_edges_are_in_their_shell() {
        let mut random = uniform();
        let (bins, range) = (16, 1.0);
        let domain = PeriodicBox::orthogonal([0.3, -7.0, 1.1], [30.0, 31.0, 29.0], [true; 3]).unwrap();
        let (mut x, mut expected) = (Vec::new(), vec![0; bins]);
        for place in 0..1000 {
            let (shell, is_above) = (1 + place / 2 % 16, place % 2 == 1);
            if shell < 16 || !is_above {
                expected[shell - usize::from(!is_above)] += 1;
            }
            let r = (shell as f64 + if is_above { 1e-9 } else { -1e-9 }) / bins as f64 * range;
            let (u, turn) = (random() * 2.0 - 1.0, std::f64::consts::TAU * random());
            let flat = (1.0 - u * u).sqrt();
            let at = [place % 10, place / 10 % 10, place / 100].map(|k| 2.9 * k as f64 + random() * 0.5);
            x.push(at);
            x.push([at[0] + r * flat * turn.cos(), at[1] + r * flat * turn.sin(), at[2] + r * u]);
        }
        let species = vec![0; x.len()];
        let alone = Pool::new(NonZeroUsize::MIN);
        assert_eq!(count_in_shells(&alone, &x, &species, 1, (&domain, 3), range, bins), expected);
        let mut counts = Counts::new(1, bins, range);
        windows::count(&mut counts, &alone, &x, &species, (&domain, 3), range);
        assert_eq!(counts.numbers, expected);
    }

    /// A particle so far away in an open box that single precision has a unit of 1.5 there: a pair near the range is found all the same.
    #[test]
    fn far_particles_hide_no_pair() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [10.0, 9.0, 8.0], [false; 3]).unwrap();
        // At a distance of 4.9797, where 1.34 counts as a unit.
        let x = [[-3e9, 0.0, 0.0], [0.0; 3], [1.34, 0.0, 4.796]];
        let found = count_in_shells(&Pool::new(NonZeroUsize::MIN), &x, &[0; 3], 1, (&domain, 3), 5.0, 1000);
        assert_eq!((found[995], found.iter().sum::<u64>()), (1, 1));
    }

    /// In a box of edge 2 with a range of 1.5 two particles make a pair by each image in range, and a particle none with its own at 2.
    #[test]
    fn images_in_range_make_pairs_of_their_own() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [2.0, 9.0, 9.0], [true; 3]).unwrap();
        let x = [[0.1, 1.0, 1.0], [0.9, 1.0, 1.0]];
        let found = count_in_shells(&Pool::new(NonZeroUsize::MIN), &x, &[0, 1], 2, (&domain, 3), 1.5, 3);
        // At 0.8 and, beyond the face, at 1.2, of particles of two species.
        assert_eq!(found, [0, 0, 0, 0, 1, 1, 0, 0, 0]);
    }

    #[test]
    fn nothing_makes_no_pairs() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let alone = Pool::new(NonZeroUsize::MIN);
        assert_eq!(count_in_shells(&alone, &[], &[], 1, (&domain, 3), 1.0, 2), [0, 0]);
    }
}
