//! Tests the values of sums over listed pairs, and that they have the same bits on every instruction set.

use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::noise::threefry2x32;
use psidpd_passes::plane::list::{ExactPair, Pair, PairList};
use psidpd_passes::plane::pair_sums::{Terms, Wide, add_pairs};
use psidpd_passes::settings::Instructions;

const OWN: usize = 40;
const ALL: usize = 70;

fn uniform(k: usize) -> f64 {
    f64::from(threefry2x32::<20>([k as u32, 0], [7, 7])[0]) / 4_294_967_296.0 - 0.5
}

fn list() -> PairList {
    let mut list = PairList { start: vec![0], ..PairList::default() };
    for i in 0..OWN {
        for j in (i + 1..ALL).filter(|j| (i * 7 + j * 3) % 5 == 0) {
            let g = std::array::from_fn(|c| uniform(1000 + 3 * (i * ALL + j) + c) as f32);
            list.pairs.push(Pair { g, j: j as u32 });
        }
        list.start.push(list.pairs.len() as u32);
    }
    list
}

fn vectors() -> Vec<Wide> {
    (0..ALL).map(|k| Wide([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2), 0.0])).collect()
}

/// Converts the pairs to double precision.
fn exact(mut list: PairList) -> PairList {
    let more = |pair: &Pair| ExactPair { g: pair.g.map(|g| f64::from(g) * 1.1), j: pair.j.into() };
    list.exact = list.pairs.iter().map(more).collect();
    list
}

#[test]
fn sums_are_those_of_a_plain_loop_to_the_last_bit() {
    are_plain(&list());
    are_plain(&exact(list()));
}

fn are_plain(list: &PairList) {
    let p = vectors();
    let xi: Vec<f32> = (0..list.pairs.len()).map(|k| uniform(90_000 + k) as f32).collect();
    for terms in [Terms { noise: 0.0, drag: -1.0 }, Terms { noise: 1.3, drag: 0.7 }] {
        let mut plain = vec![[0.1; 3]; ALL];
        for (i, ends) in list.start.windows(2).enumerate() {
            let mut sum = [0.0; 3];
            for k in ends[0] as usize..ends[1] as usize {
                let (g, j) = (list.g(k), list.pairs[k].j as usize);
                let t: [f64; 3] = std::array::from_fn(|c| (p[i][c] - p[j][c]) * g[c]);
                let noise = if terms.noise == 0.0 { 0.0 } else { terms.noise * f64::from(xi[k]) };
                let factor = noise - terms.drag * ((t[0] + t[2]) + t[1]);
                for c in 0..3 {
                    sum[c] += factor * g[c];
                    plain[j][c] -= factor * g[c];
                }
            }
            (0..3).for_each(|c| plain[i][c] += sum[c]);
        }
        for (name, instructions) in Instructions::ALL {
            let Some(set) = InstructionSet::new(instructions) else { continue };
            let mut sums = vec![Wide([0.1, 0.1, 0.1, 0.0]); ALL];
            add_pairs(set, list, &xi, terms, &p, &mut sums);
            for (found, plain) in sums.iter().zip(&plain) {
                assert_eq!(found[..3], plain[..], "{name}");
                assert_eq!(found[3], 0.0, "{name}");
            }
        }
    }
}
