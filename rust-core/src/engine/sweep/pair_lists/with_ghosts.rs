//! Adds the pairs of owned particles with ghosts to the pairs of planes.
//!
//! A search lists them for the owned particle, whose ghost may be in the plane before. A plane's list has pairs of its
//! particles with each other and with the next plane: there such a pair is one of the plane before, with the ghost first.

use super::plane_pairs::PlanePairs;
use psidpd_passes::plane::list::{PairList, pairs_of_each};
use psidpd_threads::Pool;
use std::ops::Range;

/// Adds to each plane its pairs with ghosts, and those of the next plane with its ghosts; `with_ghosts` are the pairs of
/// each plane's owned particles, with indices of ghosts that count from the first particle.
pub fn join<T: AsMut<PlanePairs> + Send>(pool: &Pool, planes: &mut [T], with_ghosts: &[PairList]) {
    let next_planes: Vec<Range<usize>> = planes.iter_mut().map(|plane| plane.as_mut().next.clone()).collect();
    let mut work: Vec<_> = planes.iter_mut().map(AsMut::as_mut).enumerate().collect();
    pool.each(&mut work, |(number, plane)| {
        let above = (*number + 1) % with_ghosts.len();
        // With two planes each is the next of the other.
        let has_both = next_planes[above] == plane.own;
        let of_above = (!plane.next.is_empty() && !has_both).then(|| &with_ghosts[above]);
        plane.list = joined(plane, &with_ghosts[*number], of_above);
    });
}

fn joined(plane: &PlanePairs, with_ghosts: &PairList, of_above: Option<&PairList>) -> PairList {
    let PlanePairs { own, next, list } = plane;
    let mut joined = PairList::default();
    joined.clear(own.start, own.start);
    let of_ghosts =
        |row: usize| with_ghosts.start.get(row).copied().unwrap_or(with_ghosts.pairs.len() as u32) as usize;
    for (row, of_row) in pairs_of_each(&list.start) {
        for k in of_row {
            joined.add(list, k, list.pairs[k].j, false);
        }
        for k in of_ghosts(row)..of_ghosts(row + 1) {
            let ghost = with_ghosts.pairs[k].j as usize;
            if own.contains(&ghost) {
                joined.add(with_ghosts, k, (ghost - own.start) as u32, false);
            } else if next.contains(&ghost) {
                joined.add(with_ghosts, k, (own.len() + ghost - next.start) as u32, false);
            }
        }
        joined.end_particle();
    }
    // The remaining particles of the plane are its ghosts. The sort keeps the order of each ghost's pairs.
    let mut backward = Vec::new();
    if let Some(above) = of_above {
        for (row, of_row) in pairs_of_each(&above.start) {
            let pairs = of_row.map(|k| (above.pairs[k].j as usize, k, own.len() + row));
            backward.extend(pairs.filter(|(ghost, ..)| own.contains(ghost)));
        }
        backward.sort_by_key(|(ghost, ..)| *ghost);
        for (ghost, k, j) in backward {
            joined.begin_at(ghost);
            joined.add(above, k, j as u32, true);
        }
    }
    joined.begin_at(own.end);
    joined
}
