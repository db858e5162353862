//! Sweeps over parts of a box, as on the ranks of a host, with ghosts for the rest.

use super::*;

/// The particles of one rank: owned particles, then ghosts.
struct Rank {
    /// The cloud's index of each particle.
    number: Vec<usize>,
    owned: usize,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
    images: Vec<bool>,
}

impl Rank {
    /// Rank `r` of `ranks`, which divide a box along `axis`, and own all of it along the other
    /// directions if these are `closed`. Every other particle and all images are ghosts, near or far.
    fn new(
        cloud: &Cloud,
        dimensions: usize,
        cutoff: f64,
        [r, ranks, axis]: [usize; 3],
        closed: [bool; 3],
    ) -> Rank {
        let n = cloud.x.len();
        let (mut x, mut number) = (cloud.x.clone(), (0..n).collect());
        let mut images = Images::default();
        images.build(&cloud.domain, dimensions, cutoff, n, &mut x);
        images.forward(1, &mut number);
        let part = |k: usize| (cloud.domain.fraction(cloud.x[k])[axis] * ranks as f64) as usize;
        let mut order: Vec<usize> = (0..n).filter(|k| part(*k) == r).collect();
        let owned = order.len();
        order.extend((0..n).filter(|k| part(*k) != r).chain(n..x.len()));
        let is_image = |k: &usize| {
            let s = cloud.domain.fraction(x[*k]);
            (0..3).any(|c| closed[c] && !(0.0..1.0).contains(&s[c]))
        };
        Rank {
            owned,
            images: order[owned..].iter().map(is_image).collect(),
            x: order.iter().map(|k| x[*k]).collect(),
            v: order.iter().map(|k| cloud.v[number[*k]]).collect(),
            tag: order.iter().map(|k| cloud.tag[number[*k]]).collect(),
            kind: order.iter().map(|k| cloud.kind[number[*k]]).collect(),
            number: order.iter().map(|k| number[*k]).collect(),
        }
    }

    fn particles(&self) -> Particles<'_> {
        Particles { owned: self.owned, x: &self.x, tag: &self.tag, kind: &self.kind }
    }
}

/// Computes forces and totals by one sweep for each rank along `axis`.
pub fn on_ranks(
    sweeps: &mut [Sweep],
    cloud: &Cloud,
    axis: usize,
    closed: [bool; 3],
) -> (Vec<[f64; 3]>, Tally) {
    let n = cloud.x.len();
    let edges = Matrix3::from_columns(&[0, 1, 2].map(|k| cloud.domain.edge(k).into()));
    let domain = PeriodicBox::new(cloud.domain.origin(), edges, closed).unwrap();
    let count = sweeps.len();
    let width = sweeps[0].plan.slope_width();
    let mut slopes = vec![0.0; n * width];
    let mut ranks = Vec::new();
    for (r, sweep) in sweeps.iter_mut().enumerate() {
        let (dimensions, cutoff) = (sweep.plan.dimensions, sweep.plan.cutoff);
        let rank = Rank::new(cloud, dimensions, cutoff, [r, count, axis], closed);
        // Without images the array of flags is empty.
        let images = if closed == [false; 3] { &[] } else { &rank.images[..] };
        let around = Around { domain: &domain, images };
        let mut out = vec![[1.0; 3]; rank.owned];
        sweep
            .first(
                around,
                &Request { particles: rank.particles(), v: &rank.v, step: Some(STEP), want: Want::TOTALS },
                &mut out,
            )
            .unwrap();
        for k in 0..rank.owned {
            slopes[width * rank.number[k]..][..width].copy_from_slice(&sweep.slopes[width * k..][..width]);
        }
        ranks.push((rank, out));
    }
    let mut force = vec![[0.0; 3]; n];
    let mut tally = Tally::default();
    for (sweep, (rank, mut out)) in sweeps.iter_mut().zip(ranks) {
        for (k, number) in rank.number.iter().enumerate() {
            sweep.slopes[width * k..][..width].copy_from_slice(&slopes[width * number..][..width]);
        }
        tally += sweep.second(&rank.particles(), &mut out).unwrap();
        for (number, f) in rank.number.iter().zip(out) {
            force[*number] = f.map(|c| c - 1.0);
        }
    }
    (force, tally)
}

/// Computes them on one rank with images for everything beyond the box.
pub fn with_ghosts(sweep: &mut Sweep, cloud: &Cloud) -> (Vec<[f64; 3]>, Tally) {
    on_ranks(std::slice::from_mut(sweep), cloud, 0, [false; 3])
}

/// Along some directions a rank has ghosts, along others it applies the period: in each of these,
/// columns, planes and cells may meet their copies, and ghosts among these.
#[test]
fn ranks_that_have_all_of_some_directions_have_the_forces_of_the_plain_engine() {
    let fluids = [
        shipped("warren2003-set6.toml"),
        shipped("standard-dpd.toml"),
        many(),
        shipped("van-der-waals-2d.toml"),
    ];
    for fluid in fluids {
        let (dimensions, cutoff) = (fluid.dimensions, fluid.cutoff());
        let density = if dimensions == 3 { 3.5 } else { 6.0 };
        let straight = boxes(dimensions, 4.3 * cutoff).swap_remove(0);
        let count = (density * straight.volume(dimensions) / cutoff.powi(dimensions as i32)) as usize | 1;
        let cloud = Cloud::new(straight, dimensions, fluid.species.len(), count, 5);
        let (force, tally) = plain(&fluid, &cloud);
        for (precision, instructions) in every() {
            for set in 0..1 << dimensions {
                let closed = [0, 1, 2].map(|c| set >> c & 1 == 1 && c < dimensions);
                // Ranks divide open directions; along closed ones there is one rank.
                for axis in 0..dimensions {
                    let ranks = if closed[axis] { 1 } else { 2 };
                    let mut sweeps: Vec<Sweep> = (0..ranks)
                        .map(|r| Sweep::new(&fluid, settings(precision, instructions, 1 + r)).unwrap())
                        .collect();
                    let (here, totals) = on_ranks(&mut sweeps, &cloud, axis, closed);
                    let what =
                        format!("closed {closed:?}, {ranks} along {axis}, {precision}, {instructions}");
                    let off = difference(&force, &here).max(tally_difference(&tally, &totals));
                    assert!(off < tolerance(precision), "{what}: {off:.1e}");
                }
            }
        }
    }
}

#[test]
fn what_is_around_a_rank_has_to_fit() {
    let fluid = shipped("warren2003-set6.toml");
    let skew = boxes(3, 5.0).swap_remove(1);
    let cloud = Cloud::new(skew, 3, 1, 301, 5);
    let mut sweep = Sweep::new(&fluid, Settings::default()).unwrap();
    let edges = Matrix3::from_columns(&[0, 1, 2].map(|k| cloud.domain.edge(k).into()));
    let half = PeriodicBox::new(cloud.domain.origin(), edges, [true, true, false]).unwrap();
    assert!(sweep.fits(&cloud.domain) && !sweep.fits(&half));
    // A box without periodic directions may be skew.
    let open = PeriodicBox::new(cloud.domain.origin(), edges, [false; 3]).unwrap();
    assert!(sweep.fits(&open));
    let open = Cloud { domain: open, ..cloud.clone() };
    let (force, tally) = plain(&fluid, &open);
    let (here, totals) = swept(&mut sweep, &open, Want::TOTALS);
    assert!(difference(&force, &here).max(tally_difference(&tally, &totals)) < tolerance(Precision::Mixed));
    let around = |domain, images| Around { domain, images };
    let mut force = vec![[0.0; 3]; cloud.x.len()];
    let mut first = |around| {
        sweep.first(
            around,
            &Request { particles: cloud.particles(), v: &cloud.v, step: Some(STEP), want: Want::FORCES },
            &mut force,
        )
    };
    assert!(matches!(first(around(&half, &[])), Err(EngineError::Host(_))));
    assert!(matches!(first(around(&cloud.domain, &[true])), Err(EngineError::Host(_))));
    assert!(first(around(&cloud.domain, &[])).is_ok());
}

/// Forces of ghosts' slopes are added plane by plane, and a plane's in the order of its list.
#[test]
fn ranks_have_the_same_bits_on_any_number_of_threads() {
    for fluid in [shipped("warren2003-set6.toml"), many()] {
        let cutoff = fluid.cutoff();
        let domain =
            PeriodicBox::orthogonal([0.0; 3], [3.1, 10.4, 4.3].map(|l| l * cutoff), [true; 3]).unwrap();
        let count = (3.0 * domain.volume(3) / cutoff.powi(3)) as usize | 1;
        let cloud = Cloud::new(domain, 3, fluid.species.len(), count, 8);
        let on = |threads, axis, closed| {
            let settings = settings(Precision::Mixed, Instructions::Portable, threads);
            let mut sweeps = [0, 1].map(|_| Sweep::new(&fluid, settings).unwrap());
            on_ranks(&mut sweeps, &cloud, axis, closed)
        };
        for (axis, closed) in [(2, [false; 3]), (0, [false, false, true])] {
            let one = on(1, axis, closed);
            for threads in [3, 7, 64] {
                assert!(one == on(threads, axis, closed), "{}, {threads} threads", fluid.title);
            }
        }
    }
}

/// A rank keeps the pairs of a few planes, as a box does. All pairs in range would take 85 bytes for each particle:
/// 16 for each, of 6 · 4π/3 · 0.75³ / 2 pairs. The ranks of this test have three and a half particles or ghosts,
/// nearly all far away, for each of the box; the place, the cell and the slope of each take 24 bytes.
#[test]
fn a_rank_keeps_the_pairs_of_few_planes() {
    let fluid = shipped("warren2003-set6.toml");
    let domain = PeriodicBox::orthogonal([0.0; 3], [6.3, 6.3, 60.0], [true; 3]).unwrap();
    let count = (6.0 * domain.volume(3)) as usize | 1;
    let cloud = Cloud::new(domain, 3, 1, count, 8);
    let mut sweep = Sweep::new(&fluid, settings(Precision::Mixed, Instructions::Portable, 1)).unwrap();
    swept(&mut sweep, &cloud, Want::FORCES);
    let alone = sweep.memory() as f64 / count as f64;
    let mut ranks = [0, 1].map(|_| Sweep::of_plan(sweep.plan.clone(), sweep.settings, sweep.pool.clone()));
    on_ranks(&mut ranks, &cloud, 2, [true, true, false]);
    let both = ranks.iter().map(|sweep| sweep.memory()).sum::<usize>() as f64 / count as f64;
    assert!(both < alone + 24.0 * 2.5 + 85.0, "{both:.0} bytes a particle instead of {alone:.0}");
}
