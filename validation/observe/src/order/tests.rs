//! Configurations of known kind.

use super::*;
use rand::{RngExt, SeedableRng, rngs::StdRng, seq::SliceRandom};
use rand_distr::{Distribution, StandardNormal};

/// A box without faces, in which positions are given unwrapped.
struct Stage {
    domain: PeriodicBox,
    dimensions: usize,
    order: Order,
    time: f64,
}

impl Stage {
    fn new(lengths: [f64; 3], dimensions: usize) -> Stage {
        let domain = PeriodicBox::orthogonal([0.0; 3], lengths, [true; 3]).unwrap();
        Stage { domain, dimensions, order: Order::default(), time: 0.0 }
    }

    /// Shows a configuration; the first `frozen` particles never move.
    fn show(&mut self, x: &[[f64; 3]], frozen: usize, rng: &mut StdRng) {
        let (mut inside, mut images) = (x.to_vec(), vec![[0; 3]; x.len()]);
        for (x, image) in inside.iter_mut().zip(&mut images) {
            self.domain.wrap(x, image);
        }
        // The order of particles changes during a run.
        let mut order: Vec<usize> = (0..x.len()).collect();
        order.shuffle(rng);
        let pick = |k: &usize| (inside[*k], images[*k], *k as i32 + 1);
        let (x, (images, tags)): (Vec<_>, (Vec<_>, Vec<_>)) =
            order.iter().map(pick).map(|(x, image, tag)| (x, (image, tag))).unzip();
        let Stage { domain, dimensions, time, .. } = self;
        let sight = Sight {
            time: *time,
            domain,
            dimensions: *dimensions,
            x: &x,
            images: &images,
            tags: &tags,
            range: 1.5,
            speed: 1.0,
        };
        self.order.sample(&sight, |k| order[k] >= frozen);
        self.time += 1.0;
    }

    /// Shows 64 configurations, each a function of its number.
    fn run(
        &mut self,
        rng: &mut StdRng,
        mut at: impl FnMut(usize, &mut StdRng) -> Vec<[f64; 3]>,
    ) -> Option<Crystal> {
        for k in 0..64 {
            let x = at(k, rng);
            self.show(&x, 0, rng);
        }
        self.order.crystal()
    }
}

const BCC: &[[f64; 3]] = &[[0.0; 3], [0.5; 3]];
const FCC: &[[f64; 3]] = &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];

/// Cells of a lattice along each direction, of edge 1.
fn lattice(base: &[[f64; 3]], cells: [usize; 3]) -> Vec<[f64; 3]> {
    let [a, b, c] = cells;
    let cell = (0..a).flat_map(|x| (0..b).flat_map(move |y| (0..c).map(move |z| [x, y, z])));
    cell.flat_map(|n| base.iter().map(move |s| [0, 1, 2].map(|c| n[c] as f64 + s[c]))).collect()
}

fn shaken(x: &[[f64; 3]], width: f64, dimensions: usize, rng: &mut StdRng) -> Vec<[f64; 3]> {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    x.iter().map(|x| [0, 1, 2].map(|c| if c < dimensions { x[c] + width * normal() } else { x[c] })).collect()
}

fn random(count: usize, lengths: [f64; 3], rng: &mut StdRng) -> Vec<[f64; 3]> {
    (0..count).map(|_| lengths.map(|l| l * rng.random::<f64>())).collect()
}

/// Vibrations up to those at melting: a tenth of the distance of neighbours and a little more, by Lindemann.
#[test]
fn lattices_that_vibrate_are_crystals() {
    let mut rng = StdRng::seed_from_u64(1);
    for (base, nearest) in [(BCC, 0.75f64.sqrt()), (FCC, 0.5f64.sqrt())] {
        for width in [0.02, 0.07, 0.1] {
            let x = lattice(base, [6, 6, 6]);
            let mut stage = Stage::new([6.0; 3], 3);
            // The whole crystal drifts through the faces of the box.
            let found = stage.run(&mut rng, |k, rng| {
                let drift = [0.3, 0.1, 0.0].map(|v| v * k as f64);
                let mut x = shaken(&x, width * nearest, 3, rng);
                x.iter_mut().for_each(|x| (0..3).for_each(|c| x[c] += drift[c]));
                x
            });
            let found = found.unwrap_or_else(|| panic!("{nearest} {width}: {:?}", stage.order.looks));
            let displacement = found.stays.unwrap().displacement;
            assert!(found.ordered > 0.9 && displacement < 0.35, "{found:?}");
            // The positions of two particles at two times, along the line between them.
            let expected = 2.0 * width;
            assert!((displacement / expected - 0.9).abs() < 0.15, "{width}: {found:?}");
        }
    }
}

#[test]
fn a_hexagonal_lattice_is_a_crystal_of_the_plane() {
    let mut rng = StdRng::seed_from_u64(2);
    let (rows, columns) = (14, 12);
    let height = 0.75f64.sqrt();
    let x: Vec<[f64; 3]> = (0..rows * columns)
        .map(|k| {
            [(k % columns) as f64 + 0.5 * ((k / columns) % 2) as f64, (k / columns) as f64 * height, 0.0]
        })
        .collect();
    let lengths = [columns as f64, rows as f64 * height, 1.0];
    let vibrates = Stage::new(lengths, 2).run(&mut rng, |_, rng| shaken(&x, 0.08, 2, rng));
    assert!(vibrates.is_some_and(|c| c.ordered > 0.9));
    let gas = random(x.len(), [lengths[0], lengths[1], 0.0], &mut rng);
    assert_eq!(Stage::new(lengths, 2).run(&mut rng, |_, rng| shaken(&gas, 0.05, 2, rng)), None);
}

/// A slab between vapour, and a ball that turns.
#[test]
fn slabs_and_balls_are_crystals_too() {
    let mut rng = StdRng::seed_from_u64(3);
    let slab: Vec<[f64; 3]> = lattice(BCC, [6, 6, 5]).iter().map(|x| [x[0], x[1], x[2] + 4.0]).collect();
    let lengths = [6.0, 6.0, 14.0];
    let vapour = |rng: &mut StdRng| random(12, lengths, rng);
    let found = Stage::new(lengths, 3).run(&mut rng, |_, rng| {
        let mut x = shaken(&slab, 0.06, 3, rng);
        x.extend(vapour(rng));
        x
    });
    assert!(found.is_some_and(|c| (0.5..0.98).contains(&c.ordered)), "{found:?}");
    let inside = |x: &[f64; 3]| x.iter().map(|c| (c - 4.5).powi(2)).sum::<f64>() < 14.0;
    let ball: Vec<[f64; 3]> = lattice(FCC, [9, 9, 9]).into_iter().filter(inside).collect();
    let found = Stage::new([14.0; 3], 3).run(&mut rng, |k, rng| {
        let (sine, cosine) = (0.05 * k as f64).sin_cos();
        let turned = |x: &[f64; 3]| {
            let [a, b] = [x[0] - 4.5, x[1] - 4.5];
            [cosine * a - sine * b + 7.0, sine * a + cosine * b + 7.0, x[2] + 2.5]
        };
        shaken(&ball.iter().map(turned).collect::<Vec<_>>(), 0.03, 3, rng)
    });
    assert!(found.is_some_and(|c| c.ordered > 0.4), "{} {found:?}", ball.len());
}

/// Neither order nor rest alone make a crystal: a lattice whose particles walk away, one that has only begun to move, a glass, and
/// a gas. A frozen lattice beside a glass, as of a wall, does not count.
#[test]
fn liquids_glasses_and_short_runs_are_none() {
    let mut rng = StdRng::seed_from_u64(4);
    let start = lattice(BCC, [6, 6, 6]);
    for step in [0.01, 0.02, 0.05, 0.2] {
        let mut x = start.clone();
        let found = Stage::new([6.0; 3], 3).run(&mut rng, |_, rng| {
            x = shaken(&x, step, 3, rng);
            x.clone()
        });
        assert_eq!(found, None, "{step}");
    }
    let mut short = Stage::new([6.0; 3], 3);
    for k in 1..=17 {
        short.show(&shaken(&start, 0.05, 3, &mut rng), 0, &mut rng);
        assert_eq!(short.order.crystal().is_some(), k == 17, "{k}");
    }
    let glass = random(432, [6.0; 3], &mut rng);
    let mut resting = Stage::new([6.0; 3], 3);
    assert_eq!(resting.run(&mut rng, |_, rng| shaken(&glass, 0.03, 3, rng)), None);
    // A few particles tell that it is none, so that no others are followed.
    assert!(resting.order.probes.is_empty() && resting.order.since > 32, "{:?}", resting.order);
    assert_eq!(Stage::new([6.0; 3], 3).run(&mut rng, |_, rng| random(432, [6.0; 3], rng)), None);
    assert_eq!(Stage::new([6.0; 3], 3).run(&mut rng, |_, _| Vec::new()), None);
    let mut walled = Stage::new([6.0, 6.0, 12.0], 3);
    for _ in 0..64 {
        let mut x = start.clone();
        x.extend(shaken(&glass, 0.03, 3, &mut rng).iter().map(|x| [x[0], x[1], x[2] + 6.0]));
        walled.show(&x, start.len(), &mut rng);
    }
    assert_eq!(walled.order.crystal(), None);
    assert!(walled.order.looks.iter().all(|look| look.ordered < 0.05), "{:?}", walled.order.looks);
}

/// A gas that becomes a crystal early, in the middle and late in a run, in space and in the plane; a crystal that becomes a gas is none.
#[test]
fn what_crystallises_during_a_run_is_a_crystal() {
    let mut rng = StdRng::seed_from_u64(7);
    let height = 0.75f64.sqrt();
    let plane = (0..168).map(|k| {
        let row = k / 12;
        [(k % 12) as f64 + 0.5 * (row % 2) as f64, row as f64 * height, 0.0]
    });
    let cases =
        [(lattice(BCC, [6, 6, 6]), [6.0; 3], 3), (plane.collect::<Vec<_>>(), [12.0, 14.0 * height, 1.0], 2)];
    for (sites, lengths, dimensions) in cases {
        let show = |freezes: bool, at: usize, rng: &mut StdRng| {
            let mut stage = Stage::new(lengths, dimensions);
            for k in 0..200 {
                let x = match (k < at) == freezes {
                    true => random(sites.len(), lengths, rng)
                        .iter()
                        .map(|x| [x[0], x[1], if dimensions == 2 { 0.0 } else { x[2] }])
                        .collect(),
                    false => shaken(&sites, 0.05, dimensions, rng),
                };
                stage.show(&x, 0, rng);
            }
            stage.order.crystal()
        };
        for at in [0, 3, 20, 60, 90] {
            let found = show(true, at, &mut rng);
            assert!(
                found.is_some_and(|c| c.ordered > 0.9 && c.note().contains("are a crystal")),
                "{at}: {found:?}"
            );
            assert!(at > 20 || found.is_some_and(|c| c.stays.is_some()), "{at}: {found:?}");
            assert_eq!(show(false, at, &mut rng), None, "{at}");
        }
    }
}

/// A run that continues from a checkpoint ends with the same.
#[test]
fn order_comes_back_from_a_checkpoint() {
    let x = lattice(BCC, [4, 4, 4]);
    let (mut whole, mut parts) = (Stage::new([4.0; 3], 3), Stage::new([4.0; 3], 3));
    for (stage, stops) in [(&mut whole, false), (&mut parts, true)] {
        let mut rng = StdRng::seed_from_u64(6);
        for k in 0..40 {
            stage.show(&shaken(&x, 0.05, 3, &mut rng), 0, &mut rng);
            if stops && k % 7 == 3 {
                let bytes = postcard::to_allocvec(&stage.order).unwrap();
                stage.order = postcard::from_bytes(&bytes).unwrap();
            }
        }
    }
    assert!(whole.order == parts.order && whole.order.crystal().is_some_and(|c| c.stays.is_some()));
}
