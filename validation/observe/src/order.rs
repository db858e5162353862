//! Whether the particles of a run are a crystal: ordered, and each at its place.
//!
//! Neither suffices alone. A viscous liquid, or a short run, leaves particles where they are; and a start on a lattice is ordered
//! until it melts.
//!
//! ```text
//! order          c_i = ⟨ S_ij/√(S_ii S_jj) ⟩_j      S_ij = Σ_{a,b} P₆(â·b̂) = Σ_m q_im q_jm
//! displacement   u_i² = ⟨ (|r_ij(t)| − |r_ij(0)|)² ⟩_j
//! ```
//!
//! j runs over the nearest neighbours of i, and a, b over the directions from i and from j to theirs. By the addition theorem
//! S_ij is the product of the bond-order vectors of the two, q_im = Σ_a Y_6m(â) with real harmonics of this norm (Steinhardt, Nelson and Ronchetti, Phys. Rev. B 28, 784 (1983)),
//! and c_i the mean product by which ten Wolde, Ruiz-Montero and Frenkel, J. Chem. Phys. 104, 9932 (1996), tell solid particles
//! from liquid ones; in two dimensions cos 6θ takes the place of P₆. c is near 0.1 in liquids, and 0.5 to 1 in crystals, whichever
//! their lattice, also where grains, drops or slabs have no common direction. Distances from neighbours leave out drift and
//! rotation.
//!
//! A run may crystallise at any time. So displacements count from the start while they are small, and else from a later sample, that
//! at which they were found to be large; and a run that was a liquid and is ordered has become a crystal, wherever its particles go.
//! Most runs are liquids: a few particles tell that, and then none are followed.

use crate::meter::linked::density_of_densest_tenth;
use psidpd_core::engine::{Cells, Near, PeriodicBox};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// About the number of particles that are followed, where there are more.
const PROBES: usize = 1000;

/// The number of particles that tell a liquid from what may be a crystal.
const FEW: usize = 50;

/// Below this part of [`SHARE`] the few are those of a liquid.
const LIQUID: f64 = 1.0 / 3.0;

/// A particle with a larger c is ordered.
const ORDERED: f64 = 0.5;

/// The smallest share of ordered particles in a crystal, in two and in three dimensions: half of the particles of a small drop are at
/// its surface. In liquids just above melting less than 1 % are ordered in space, in the plane an eighth and more.
const SHARE: [f64; 2] = [0.5, 0.3];

/// The largest root mean square displacement in a crystal, in distances of neighbours: twice that of vibrations by Lindemann's rule at
/// melting, as it is a difference of four positions.
const CAGE: f64 = 0.35;

/// After a larger one particles are followed anew.
const GONE: f64 = 2.0 * CAGE;

/// The largest growth of the mean square displacement in a crystal while the time doubles; diffusion has 2.
const GROWTH: f64 = 1.4;

/// A shorter run tells nothing: in samples, and in times that a free particle takes from neighbour to neighbour.
const LEAST_SAMPLES: u64 = 16;
const LEAST_FLIGHTS: f64 = 10.0;

/// A configuration as this module needs it.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    pub time: f64,
    pub domain: &'a PeriodicBox,
    pub dimensions: usize,
    /// Positions in the box, the numbers of periods that each particle has crossed, and tags.
    pub x: &'a [[f64; 3]],
    pub images: &'a [[i32; 3]],
    pub tags: &'a [i32],
    /// The range of the forces.
    pub range: f64,
    /// The thermal speed √(kT/m).
    pub speed: f64,
}

/// What is known of the order of a stage. It goes into checkpoints.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Order {
    samples: u64,
    /// The sample from which particles are followed, and its time.
    since: u64,
    start: f64,
    dimensions: usize,
    probes: Vec<Probe>,
    /// The last two looks since then, at times one of which is twice the other.
    looks: Vec<Look>,
    /// The share of ordered particles: at the last two looks, and the least of all.
    ordered: [f64; 2],
    least: f64,
}

/// A particle that is followed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Probe {
    tag: i32,
    neighbours: Vec<Neighbour>,
}

/// A neighbour at the sample from which particles are followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Neighbour {
    tag: i32,
    /// What the vector to the image that is near has more than the difference of unwrapped positions.
    image: [f64; 3],
    distance: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Look {
    time: f64,
    /// The share of ordered particles.
    ordered: f64,
    /// The mean square change of distances from the neighbours, the median of ordered particles, in squares of the distance of neighbours.
    square: f64,
    /// The time of a free flight from neighbour to neighbour.
    flight: f64,
}

/// A crystal that a run has become, or has been from the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crystal {
    /// The share of ordered particles.
    pub ordered: f64,
    /// How these stay in place; `None` where the run has become a crystal, and not long been one.
    pub stays: Option<Stays>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stays {
    /// The root mean square displacement of ordered particles against their neighbours, in distances of neighbours.
    pub displacement: f64,
    /// The time over which they were followed.
    pub time: f64,
}

impl Crystal {
    /// A remark beside an observable that assumes a liquid.
    pub fn note(&self) -> String {
        let how = match self.stays {
            Some(Stays { displacement, time }) => format!(
                "and after a time of {time:.3} these are {displacement:.3} of the distance between neighbours from their places"
            ),
            None => "and before they had not: the run has crystallised".to_owned(),
        };
        format!(
            "The particles are a crystal, and this assumes a liquid: {:.0} % of them have ordered neighbours, {how}.",
            100.0 * self.ordered
        )
    }
}

/// The number of nearest neighbours: the two shells of bcc, of which fcc and hcp have one and a part; the shell of the hexagonal lattice.
fn neighbours(dimensions: usize) -> usize {
    if dimensions == 2 { 6 } else { 14 }
}

/// The distance within which a particle of a liquid of density `rho` has at least twice as many neighbours as are needed.
fn reach(dimensions: usize, rho: f64) -> f64 {
    if dimensions == 2 { (4.5 / rho).sqrt() } else { (7.2 / rho).cbrt() }
}

/// A bond-order vector.
type Bonds = [f64; 13];

/// Harmonics of sixth order of a unit vector: for two of them the sum of products is P₆ of the cosine of their angle, in two
/// dimensions cos 6θ.
fn harmonics([x, y, z]: [f64; 3], dimensions: usize) -> Bonds {
    // (x + iy)^m
    let mut powers = [[1.0, 0.0]; 7];
    for m in 1..7 {
        let [re, im] = powers[m - 1];
        powers[m] = [re * x - im * y, re * y + im * x];
    }
    let mut all = [0.0; 13];
    if dimensions == 2 {
        all[..2].copy_from_slice(&powers[6]);
        return all;
    }
    // The derivatives of 16 P₆(z), each with √[2 (6 − m)!/(6 + m)!]/16.
    let s = z * z;
    let derivatives = [
        ((231.0 * s - 315.0) * s + 105.0) * s - 5.0,
        z * ((1386.0 * s - 1260.0) * s + 210.0),
        (6930.0 * s - 3780.0) * s + 210.0,
        z * (27720.0 * s - 7560.0),
        83160.0 * s - 7560.0,
        z * 166_320.0,
        166_320.0,
    ];
    let mut ratio: f64 = 2.0;
    all[0] = derivatives[0] / 16.0;
    for m in 1..7 {
        ratio /= ((7 - m) * (6 + m)) as f64;
        let factor = ratio.sqrt() / 16.0 * derivatives[m];
        (all[2 * m - 1], all[2 * m]) = (factor * powers[m][0], factor * powers[m][1]);
    }
    all
}

fn product(a: &Bonds, b: &Bonds) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The particles that move, in cells as wide as neighbours may be away.
struct Mobile {
    particles: Vec<usize>,
    cells: Cells,
}

impl Mobile {
    /// `None` without particles in the range of forces of others.
    fn new(sight: &Sight, moves: impl Fn(usize) -> bool) -> Option<Mobile> {
        let &Sight { domain, dimensions, x, range, .. } = sight;
        let particles: Vec<usize> = (0..x.len()).filter(|k| moves(*k)).collect();
        let at: Vec<[f64; 3]> = particles.iter().map(|k| x[*k]).collect();
        let sorted = |range: f64| {
            let mut cells = Cells::new(domain, dimensions, range, at.len());
            cells.fill(&at);
            cells
        };
        let rho = {
            let (cells, mut near) = (sorted(range), Near::default());
            let around = |k: usize| {
                cells.around(x[k], &mut near);
                near.count.saturating_sub(1)
            };
            let counts = some(sight, &particles, PROBES).map(around).collect();
            density_of_densest_tenth(counts, dimensions, range)
        };
        // No image of a particle but the nearest is that near.
        let width = (0..dimensions).map(|k| domain.height(k)).fold(f64::INFINITY, f64::min);
        let reach = reach(dimensions, rho).min(0.5 * width);
        let is_known = rho > 0.0 && reach.is_finite();
        is_known.then(|| sorted(reach)).map(|cells| Mobile { particles, cells })
    }
}

/// About so many of the particles at random, the same whatever their order.
fn some<'a>(sight: &'a Sight, all: &'a [usize], count: usize) -> impl Iterator<Item = usize> + 'a {
    let mixed = |tag: i32| (tag as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
    let below = (count << 32) as u64 / all.len().max(1) as u64;
    all.iter().copied().filter(move |k| mixed(sight.tags[*k]) < below)
}

/// A near particle: distance, index and unit vector.
type Beside = (f64, usize, [f64; 3]);

/// The nearest neighbours of some particles, by distance.
#[derive(Default)]
struct Nearest {
    /// The place of each particle in `lists`.
    at: HashMap<usize, usize>,
    lists: Vec<Vec<Beside>>,
}

impl Nearest {
    /// The neighbours of the particles `of` and of their neighbours; those with too few are left out.
    fn of_shells(sight: &Sight, mobile: &Mobile, of: impl Iterator<Item = usize>) -> Nearest {
        let mut all = Nearest::default();
        all.find(sight, mobile, of);
        let beside: Vec<usize> = all.lists.iter().flatten().map(|near| near.1).collect();
        all.find(sight, mobile, beside);
        all
    }

    fn find(&mut self, sight: &Sight, mobile: &Mobile, of: impl IntoIterator<Item = usize>) {
        let most = neighbours(sight.dimensions);
        let (mut near, mut by_distance) = (Near::default(), Vec::new());
        for k in of {
            if self.at.contains_key(&k) {
                continue;
            }
            mobile.cells.around(sight.x[k], &mut near);
            by_distance.clear();
            let others = near.r[0].iter().zip(&near.id).take(near.count).filter(|(square, _)| **square > 0.0);
            by_distance.extend(others.map(|(square, id)| (*square, *id)));
            if by_distance.len() < most {
                continue;
            }
            let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            by_distance.select_nth_unstable_by(most - 1, order);
            by_distance.truncate(most);
            by_distance.sort_unstable_by(order);
            let beside = |(square, id): &(f64, u32)| {
                let other = mobile.particles[*id as usize];
                let d = sight.domain.minimum_image(sight.x[other], sight.x[k]);
                let r = square.sqrt();
                (r, other, d.map(|d| d / r))
            };
            self.at.insert(k, self.lists.len());
            self.lists.push(by_distance.iter().map(beside).collect());
        }
    }

    fn of(&self, particle: usize) -> Option<&Vec<Beside>> {
        self.at.get(&particle).map(|k| &self.lists[*k])
    }

    /// The bond-order vector of each particle, divided by its length.
    fn bonds(&self, dimensions: usize) -> Vec<Bonds> {
        let of_list = |list: &Vec<Beside>| {
            let mut sum = [0.0; 13];
            for (_, _, direction) in list {
                let harmonics = harmonics(*direction, dimensions);
                sum.iter_mut().zip(harmonics).for_each(|(sum, q)| *sum += q);
            }
            let length = product(&sum, &sum).sqrt();
            sum.map(|q| q / length)
        };
        self.lists.iter().map(of_list).collect()
    }

    /// The order c of a particle, from these vectors.
    fn order(&self, bonds: &[Bonds], particle: usize) -> Option<f64> {
        let list = self.of(particle)?;
        let share = |j: usize| Some(product(&bonds[*self.at.get(&particle)?], &bonds[*self.at.get(&j)?]));
        Some(list.iter().filter_map(|n| share(n.1)).sum::<f64>() / list.len() as f64)
    }
}

/// The share of ordered particles among a few of those that have neighbours.
fn share_of_few(sight: &Sight, mobile: &Mobile) -> f64 {
    let few: Vec<usize> = some(sight, &mobile.particles, FEW).collect();
    let all = Nearest::of_shells(sight, mobile, few.iter().copied());
    let bonds = all.bonds(sight.dimensions);
    let orders: Vec<f64> = few.iter().filter_map(|k| all.order(&bonds, *k)).collect();
    orders.iter().filter(|c| **c > ORDERED).count() as f64 / orders.len().max(1) as f64
}

/// The smallest share of ordered particles in a crystal.
fn share_in_crystals(dimensions: usize) -> f64 {
    SHARE[usize::from(dimensions > 2)]
}

/// Particles with the neighbours that they have now.
fn probes(sight: &Sight, mobile: &Mobile) -> Vec<Probe> {
    let chosen: Vec<usize> = some(sight, &mobile.particles, PROBES).collect();
    let mut found = Nearest::default();
    found.find(sight, mobile, chosen.iter().copied());
    let probe = |k: usize| {
        let list = found.of(k)?;
        let neighbour = |&(distance, j, e): &Beside| {
            let apart = apart(sight, k, j);
            let image = std::array::from_fn(|c| distance * e[c] - apart[c]);
            Neighbour { tag: sight.tags[j], image, distance }
        };
        Some(Probe { tag: sight.tags[k], neighbours: list.iter().map(neighbour).collect() })
    };
    chosen.into_iter().filter_map(probe).collect()
}

impl Order {
    /// Takes a sample; `moves` tells mobile particles from frozen ones, which do not count.
    pub fn sample(&mut self, sight: &Sight, moves: impl Fn(usize) -> bool) {
        self.samples = self.samples.saturating_add(1);
        // Few looks, however long the run, and none that is too early to tell.
        let (passed, unit) = (self.samples.saturating_sub(self.since), (self.since / 2).max(1));
        let looks = self.samples >= LEAST_SAMPLES / 4 && passed.is_multiple_of(unit);
        if self.samples > 1 && !(looks && (passed / unit).is_power_of_two()) {
            return;
        }
        let Some(mobile) = Mobile::new(sight, moves) else { return };
        if self.samples == 1 {
            self.least = 1.0;
        }
        self.dimensions = sight.dimensions;
        let share = share_of_few(sight, &mobile);
        if share < LIQUID * share_in_crystals(sight.dimensions) {
            self.follow(sight, Vec::new());
            return self.note(share);
        }
        if self.probes.is_empty() {
            self.follow(sight, probes(sight, &mobile));
        }
        let look = self.look(sight, &mobile);
        self.note(look.map_or(0.0, |look| look.ordered));
        match look.filter(|look| look.square.sqrt() <= GONE) {
            Some(look) => {
                if self.looks.len() > 1 {
                    self.looks.remove(0);
                }
                self.looks.push(look);
            }
            None if self.since < self.samples => self.follow(sight, probes(sight, &mobile)),
            None => {}
        }
    }

    /// Follows particles from now on; a liquid has none.
    fn follow(&mut self, sight: &Sight, probes: Vec<Probe>) {
        (self.since, self.start, self.probes) = (self.samples, sight.time, probes);
        self.looks.clear();
    }

    /// Keeps the share of ordered particles at a look.
    fn note(&mut self, ordered: f64) {
        self.ordered = [self.ordered[1], ordered];
        self.least = self.least.min(ordered);
    }

    fn look(&self, sight: &Sight, mobile: &Mobile) -> Option<Look> {
        let dimensions = sight.dimensions;
        let needed = self.probes.iter().flat_map(|p| p.neighbours.iter().map(|n| n.tag).chain([p.tag]));
        let mut index: HashMap<i32, usize> = needed.map(|tag| (tag, usize::MAX)).collect();
        for (k, tag) in sight.tags.iter().enumerate() {
            index.entry(*tag).and_modify(|at| *at = k);
        }
        let at = |tag: &i32| index.get(tag).copied().filter(|k| *k < sight.x.len());
        let probes = || self.probes.iter().filter_map(|p| at(&p.tag));
        let all = Nearest::of_shells(sight, mobile, probes());
        let bonds = all.bonds(dimensions);
        let (mut ordered, mut of_each, mut spacing) = (0.0, Vec::new(), 0.0);
        for probe in &self.probes {
            let found = at(&probe.tag).and_then(|k| Some((k, all.of(k)?, all.order(&bonds, k)?)));
            let Some((k, list, c)) = found else { continue };
            let stretched = |n: &Neighbour| {
                let d = apart(sight, k, at(&n.tag)?);
                let r = (0..dimensions).map(|c| (d[c] + n.image[c]).powi(2)).sum::<f64>().sqrt();
                Some((r - n.distance).powi(2))
            };
            let squares: Vec<f64> = probe.neighbours.iter().filter_map(stretched).collect();
            let distance = list.iter().map(|n| n.0).sum::<f64>() / list.len() as f64;
            if c > ORDERED {
                ordered += 1.0;
                spacing += distance;
                of_each.push(squares.iter().sum::<f64>() / squares.len() as f64 / (distance * distance));
            }
        }
        // The median: vapour that came by or went is far from where it was.
        of_each.sort_unstable_by(f64::total_cmp);
        let square = of_each.get(of_each.len() / 2).copied().unwrap_or(f64::NAN);
        let share = ordered / self.probes.len() as f64;
        let look = Look {
            time: sight.time - self.start,
            ordered: share,
            square,
            flight: spacing / ordered / sight.speed,
        };
        (ordered > 0.0 && [look.time, look.square, look.flight].iter().all(|x| x.is_finite())).then_some(look)
    }

    /// The crystal, if the run is one and was long enough to tell.
    pub fn crystal(&self) -> Option<Crystal> {
        let share = share_in_crystals(self.dimensions);
        let ordered = self.ordered[1];
        if self.samples < LEAST_SAMPLES || ordered < share {
            return None;
        }
        let followed = self.samples.saturating_sub(self.since) >= LEAST_SAMPLES - 1;
        let stays = match self.looks[..] {
            [before, last] if followed && last.time >= LEAST_FLIGHTS * last.flight => {
                (last.square.sqrt() <= CAGE && last.square <= GROWTH * before.square)
                    .then(|| Stays { displacement: last.square.sqrt(), time: last.time })
            }
            _ => None,
        };
        let became = self.ordered[0] >= share && self.least < 0.5 * share;
        (stays.is_some() || became).then_some(Crystal { ordered, stays })
    }
}

/// The difference of the unwrapped positions of two particles.
fn apart(sight: &Sight, from: usize, to: usize) -> [f64; 3] {
    let edges = [0, 1, 2].map(|e| sight.domain.edge(e));
    let images = [from, to].map(|k| sight.images[k].map(f64::from));
    std::array::from_fn(|c| {
        let boxes = (0..3).map(|e| (images[1][e] - images[0][e]) * edges[e][c]).sum::<f64>();
        sight.x[to][c] - sight.x[from][c] + boxes
    })
}

#[cfg(test)]
mod tests;
