//! Tests the values of sums over listed pairs on every instruction set.

use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::noise::{Law, PairNoise, threefry2x32};
use psidpd_passes::plane::list::{ExactPair, Listed, Pair, PairList};
use psidpd_passes::plane::listed_noise::{Drawn, ListedNoise};
use psidpd_passes::plane::pair_sums::{Noise, Wide, add_pairs};
use psidpd_passes::settings::Instructions;

const OWN: usize = 80;
const ALL: usize = 250;
/// Number of particles before those of the plane.
const FIRST: usize = 9;

fn uniform(k: usize) -> f64 {
    f64::from(threefry2x32::<20>([k as u32, 0], [7, 7])[0]) / 4_294_967_296.0 - 0.5
}

/// More pairs than noise is drawn for at once.
fn list(own: usize, j_from: usize) -> PairList {
    let mut list = PairList::default();
    list.clear(FIRST, j_from);
    for i in 0..own {
        for j in (i + 1..ALL).filter(|j| (i * 7 + j * 3) % 5 == 0) {
            let g = std::array::from_fn(|c| uniform(1000 + 3 * (i * ALL + j) + c) as f32);
            list.pairs.push(Pair { g, j: j as u32 });
        }
        list.start.push(list.pairs.len() as u32);
    }
    list
}

fn vectors() -> Vec<Wide> {
    (0..FIRST + ALL).map(|k| Wide([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2), 0.0])).collect()
}

/// Converts the pairs to double precision.
fn exact(mut list: PairList) -> PairList {
    let more = |pair: &Pair| ExactPair::new(pair.g.map(|g| f64::from(g) * 1.1), pair.j);
    list.exact = list.pairs.iter().map(more).collect();
    list
}

#[test]
fn sums_are_those_of_a_plain_loop() {
    are_plain(Listed { own: list(OWN, FIRST), ..Listed::default() });
    are_plain(Listed { own: exact(list(OWN, FIRST)), ..Listed::default() });
    // The last particles have no pairs with ghosts.
    are_plain(Listed { own: list(OWN, FIRST), with_ghosts: exact(list(OWN - 3, 0)) });
}

/// Portable sums have the bits of the loop. Instructions that round a product and a sum once differ from it by rounding,
/// and not from each other.
fn are_plain(lists: Listed) {
    let all = vectors();
    let p = &all[FIRST..];
    let tags: Vec<u32> = (0..FIRST + ALL).map(|k| ((k * 37) % 101) as u32 + 1).collect();
    let noise = PairNoise::new(3, 4);
    let of_pairs = ListedNoise { noise, law: Law::Uniform, tags: &tags };
    for with_noise in [None, Some(Noise { amplitude: 1.3, of_pairs })] {
        let mut plain = vec![[0.0; 3]; ALL];
        for (list, second) in [(&lists.own, p), (&lists.with_ghosts, &all[..])] {
            let both = std::ptr::eq(list, &lists.own);
            for (i, ends) in list.start.windows(2).enumerate() {
                let mut sum = plain[i];
                for k in ends[0] as usize..ends[1] as usize {
                    let (g, j) = (list.g(k), list.pairs[k].j as usize);
                    let t: [f64; 3] = std::array::from_fn(|c| (p[i][c] - second[j][c]) * g[c]);
                    let along = (t[0] + t[1]) + t[2];
                    let xi = noise.xi(tags[list.first + i], tags[list.j_from + j]) as f32;
                    let along = if with_noise.is_none() { along } else { f64::from(xi) * -1.3 + along };
                    for c in 0..3 {
                        sum[c] += along * g[c];
                        if both {
                            plain[j][c] -= along * g[c];
                        }
                    }
                }
                plain[i] = sum;
            }
        }
        let mut fused: Option<Vec<Wide>> = None;
        for (name, instructions) in Instructions::ALL {
            let Some(set) = InstructionSet::new(instructions) else { continue };
            let mut sums = vec![Wide([0.1; 4]); ALL];
            // SAFETY: both arrays have entries for the particles of the list.
            unsafe { add_pairs(set, &lists, with_noise, &all, FIRST, &mut sums, &mut Drawn::default()) };
            for (found, plain) in sums.iter().zip(&plain) {
                let apart = (0..3).map(|c| (found[c] - plain[c]).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-13, "{name}: {found:?} {plain:?}");
                assert_eq!(found[3], 0.0, "{name}");
                assert!(instructions != Instructions::Portable || found[..3] == plain[..], "{name}");
            }
            if instructions != Instructions::Portable {
                assert_eq!(fused.get_or_insert_with(|| sums.clone()), &sums, "{name}");
            }
        }
    }
}
