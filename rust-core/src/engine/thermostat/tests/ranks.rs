//! Compares the midpoint rule on several ranks with that on one.

use super::listed::{engine, request};
use super::*;
use crate::engine::surroundings::{Around, Newton, Surroundings};

/// The particles of one rank: the host's numbers of owned particles and of the owners of ghosts, and the ghosts' periods.
struct Piece {
    owned: Vec<usize>,
    ghosts: Vec<(usize, [f64; 3])>,
    closed: [bool; 3],
}

/// Divides a cloud along x among this number of ranks; y and z are closed, or have images as ghosts.
fn cut(cloud: &Cloud, ranks: usize, closed: bool) -> Vec<Piece> {
    let periodic = cloud.domain.periodic();
    let (origin, edge) = (cloud.domain.origin()[0], cloud.domain.edge(0)[0]);
    let rank_of = |k: usize| {
        let s = (cloud.x[k][0] - origin) / edge;
        ((s * ranks as f64) as usize).min(ranks - 1)
    };
    // A plane has no images above and below.
    let flat = cloud.x.iter().all(|x| x[2] == 0.0);
    let shifts = |c: usize| if periodic[c] && !(flat && c == 2) { vec![-1.0, 0.0, 1.0] } else { vec![0.0] };
    (0..ranks)
        .map(|rank| {
            let owned: Vec<usize> = (0..cloud.x.len()).filter(|k| rank_of(*k) == rank).collect();
            let mut ghosts = Vec::new();
            for k in 0..cloud.x.len() {
                for a in shifts(0) {
                    for b in shifts(1) {
                        for c in shifts(2) {
                            let still = a == 0.0 && b == 0.0 && c == 0.0;
                            let closed = closed && (b != 0.0 || c != 0.0);
                            if closed || still && rank_of(k) == rank {
                                continue;
                            }
                            let edge = |d: usize| cloud.domain.edge(d);
                            let period =
                                std::array::from_fn(|d| a * edge(0)[d] + b * edge(1)[d] + c * edge(2)[d]);
                            ghosts.push((k, period));
                        }
                    }
                }
            }
            let closed = if closed { [false, periodic[1], periodic[2]] } else { [false; 3] };
            Piece { owned, ghosts, closed }
        })
        .collect()
}

/// Computes the velocities after the midpoint rule, the virial, and the iterations of each rank; with pairs that
/// evaluations have `listed`, or with those of the search.
fn by_ranks(
    model: &str,
    cloud: &Cloud,
    pieces: &[Piece],
    virial: bool,
    listed: bool,
) -> (Vec<[f64; 3]>, [f64; 6], Vec<usize>) {
    struct Hand {
        thermostat: PairThermostat,
        vectors: Vec<[f64; 3]>,
        v: Vec<[f64; 3]>,
        need: Need,
    }
    let pool = pool(2);
    let edges = Matrix3::from_columns(&[0, 1, 2].map(|k| cloud.domain.edge(k).into()));
    let mut hands: Vec<Hand> = pieces
        .iter()
        .map(|piece| {
            let all = || piece.owned.iter().map(|k| (*k, [0.0; 3])).chain(piece.ghosts.iter().copied());
            let x: Vec<[f64; 3]> =
                all().map(|(k, period)| std::array::from_fn(|c| cloud.x[k][c] + period[c])).collect();
            let tag: Vec<i32> = all().map(|(k, _)| cloud.tag[k]).collect();
            // Types are numbered from one, as in LAMMPS; the third type is left out.
            let kind: Vec<i32> = all().map(|(k, _)| cloud.species[k] + 1).collect();
            let kinds = [-1, 0, 1, -1];
            let species = cloud.mass.len();
            let mass: Vec<f64> = piece.owned.iter().map(|k| cloud.mass_of(*k)).collect();
            let domain = PeriodicBox::new(cloud.domain.origin(), edges, piece.closed).unwrap();
            let rank = Rank {
                around: Around { domain: &domain, images: &[] },
                particles: Particles { owned: piece.owned.len(), x: &x, tag: &tag, kind: &kind },
                species_of_kind: &kinds[..species + 1],
                mass: &mass,
            };
            let mut thermostat = thermostat(model, 1.0, cloud.precision);
            if listed {
                let mut engine = engine(model, cloud.precision, 2);
                engine.map_kinds(rank.species_of_kind).unwrap();
                thermostat.ask(&mut engine, DT);
                let surroundings = Surroundings::Ghosts(rank.around, Newton::On);
                let mut force = vec![[0.0; 3]; x.len()];
                drop(engine.first(surroundings, &request(rank.particles), &mut force).unwrap());
                thermostat.find_pairs_of_rank_with(&mut engine, &rank, DT, virial).unwrap();
                assert_eq!(thermostat.are_of_forces, engine.path() == Some(crate::engine::Path::Sweep));
            } else {
                thermostat.find_pairs_of_rank(&pool, &rank, DT, virial).unwrap();
            }
            thermostat.draw(11, 5, Stream(0), Law::Gaussian);
            let mut vectors: Vec<[f64; 3]> = all().map(|(k, _)| cloud.v[k]).collect();
            let v = piece.owned.iter().map(|k| cloud.v[*k]).collect();
            let need = thermostat.begin_midpoint(&pool, &mut vectors).unwrap();
            Hand { thermostat, vectors, v, need }
        })
        .collect();
    loop {
        let needs: Vec<Need> = hands.iter().map(|hand| hand.need).collect();
        let mut totals = [0.0; 3];
        match needs[0] {
            Need::Nothing(_) => break,
            Need::Totals(_) => {
                for need in &needs {
                    let Need::Totals(part) = need else { panic!("{needs:?}") };
                    (0..3).for_each(|k| totals[k] += part[k]);
                }
            }
            Need::Ghosts => {
                assert!(needs.iter().all(|need| *need == Need::Ghosts));
                let mut of_all = vec![[f64::NAN; 3]; cloud.x.len()];
                for (hand, piece) in hands.iter().zip(pieces) {
                    piece.owned.iter().zip(&hand.vectors).for_each(|(k, vector)| of_all[*k] = *vector);
                }
                for (hand, piece) in hands.iter_mut().zip(pieces) {
                    let ghosts = &mut hand.vectors[piece.owned.len()..];
                    ghosts.iter_mut().zip(&piece.ghosts).for_each(|(to, (k, _))| *to = of_all[*k]);
                }
            }
        }
        for hand in &mut hands {
            hand.need = hand.thermostat.go_on(&pool, totals, &mut hand.vectors, &mut hand.v).unwrap();
        }
    }
    let mut v = vec![[f64::NAN; 3]; cloud.x.len()];
    let mut sum = [0.0; 6];
    for (hand, piece) in hands.iter().zip(pieces) {
        piece.owned.iter().zip(&hand.v).for_each(|(k, now)| v[*k] = *now);
        let Need::Nothing(part) = hand.need else { panic!() };
        (0..6).for_each(|c| sum[c] += part[c]);
    }
    (v, sum, hands.iter().map(|hand| hand.thermostat.iterations()).collect())
}

/// Velocities and virial are the same for any number of ranks, to the rounding of the pairs' vectors;
/// momentum is conserved to the rounding of sums.
#[test]
fn ranks_do_what_one_does() {
    for (number, (model, mut cloud)) in clouds().into_iter().enumerate() {
        if number % 2 == 1 {
            cloud.frozen = (0..cloud.x.len()).map(|k| k % 5 == 0).collect();
        }
        let pool = pool(1);
        let mut one = ready(model, 1.0, &cloud, &pool);
        let mut v = cloud.v.clone();
        let virial = one.act(&pool, Update::Midpoint, &mut v);
        let leans = (0..3).any(|k| (0..3).any(|c| c != k && cloud.domain.edge(k)[c] != 0.0));
        for (ranks, closed) in [(1, false), (2, false), (2, true), (3, true), (7, false)] {
            // A skew box cannot have both closed and open directions.
            if leans && closed {
                continue;
            }
            let pieces = cut(&cloud, ranks, closed);
            let (found, w, iterations) = by_ranks(model, &cloud, &pieces, true, false);
            let (also, none, _) = by_ranks(model, &cloud, &pieces, false, false);
            assert!(also == found && none == [0.0; 6], "cloud {number}, {ranks} ranks");
            assert!(iterations.iter().all(|i| *i == one.iterations()), "{iterations:?}");
            let (listed, w_listed, _) = by_ranks(model, &cloud, &pieces, true, true);
            let pairs = found.iter().chain(&listed).flatten().zip(v.iter().chain(&v).flatten());
            let most = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(most < rounding(&cloud), "cloud {number}, {ranks} ranks: {most:e}");
            for (a, b) in w.iter().zip(virial).chain(w_listed.iter().zip(virial)) {
                assert!((a - b).abs() < rounding(&cloud) * (1.0 + v.len() as f64), "cloud {number}: {a} {b}");
            }
            if cloud.frozen.is_empty() {
                for after in [&found, &listed] {
                    for (p, q) in cloud.momentum(after).into_iter().zip(cloud.momentum(&cloud.v)) {
                        assert!(
                            (p - q).abs() < 1e-11 * v.len() as f64,
                            "cloud {number}, {ranks} ranks: {p} {q}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn ranks_refuse_what_does_not_fit() {
    let (model, cloud) = clouds().swap_remove(0);
    let (pool, open) = (pool(1), PeriodicBox::OPEN);
    let (x, tag, kind) = (&cloud.x[..], &cloud.tag[..], &cloud.species[..]);
    let n = x.len();
    let mass = vec![1.0; n - 1];
    let whole = Rank {
        around: Around { domain: &open, images: &[] },
        particles: Particles { owned: n - 1, x, tag, kind },
        species_of_kind: &[0],
        mass: &mass,
    };
    let mut thermostat = thermostat(model, 1.0, cloud.precision);
    let mut vectors = cloud.v.clone();
    let mut v = cloud.v[1..].to_vec();
    assert!(thermostat.go_on(&pool, [1.0; 3], &mut vectors, &mut v).is_err());
    let wrong = [
        Rank { mass: &mass[1..], ..whole },
        Rank { species_of_kind: &[1], ..whole },
        Rank { around: Around { domain: &open, images: &[true; 2] }, ..whole },
        Rank { particles: Particles { tag: &tag[1..], ..whole.particles }, ..whole },
        Rank { particles: Particles { owned: n + 1, ..whole.particles }, ..whole },
    ];
    assert!(wrong.iter().all(|rank| thermostat.find_pairs_of_rank(&pool, rank, DT, false).is_err()));
    thermostat.find_pairs_of_rank(&pool, &whole, DT, false).unwrap();
    thermostat.draw(1, 1, Stream(0), Law::Gaussian);
    assert!(thermostat.begin_midpoint(&pool, &mut vectors[1..]).is_err());
    thermostat.begin_midpoint(&pool, &mut vectors).unwrap();
    assert!(thermostat.go_on(&pool, [1.0; 3], &mut vectors[1..], &mut v).is_err());
    assert!(thermostat.go_on(&pool, [1.0; 3], &mut vectors, &mut v).is_ok());
}
