//! Pair potentials of rare species with long ranges, apart from the sweep.
//!
//! A sweep has one range, the longest, and compares all particles within it. A few large particles in a solvent, whose range is a third
//! of theirs, would cost 27 times the comparisons. Potentials of a longer range than the rest of the fluid, one of whose species is rare,
//! are therefore left to a search around each particle of that species, and the sweep does the rest in the shorter range.
//!
//! All is in double precision. Each particle of the rare species collects its pairs by itself, and their forces are added in its order, so that
//! results do not depend on threads.

use super::components::COMPONENTS;
use super::error::EngineError;
use super::particles::Particles;
use super::plan::Plan;
use super::vectors::{Loop, run_best};
use crate::model::PairTerm;
use crate::model::pair::PairForm;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::{Tally, Want};
use psidpd_threads::Pool;
use std::ops::Range;

/// The time of a search for a particle of a rare species, in that of a sweep for a pair of all that are within the same range. Measured with
/// 1 to 20 % of large particles: 3.9 to 5.2.
const AROUND_ONE: f64 = 5.0;

/// Potentials are apart if that takes less than this fraction of the time of the whole sweep.
const WORTH: f64 = 0.8;

/// Cells within a range.
const FINE: f64 = 2.0;

/// A pair potential around particles of the rarer of its species.
#[derive(Debug)]
struct Around {
    rare: usize,
    other: usize,
    term: PairTerm,
}

/// The potentials that are apart from a sweep, and the arrays of their evaluation.
#[derive(Debug)]
pub struct LongPairs {
    /// Their indices among those of the plan.
    pub which: Vec<usize>,
    terms: Vec<Around>,
    limits: Limits,
    cells: Cells,
    found: Vec<Found>,
}

/// The squares of the longest ranges around a particle of a rare species to others, by both; 0 where there is none. Others may be of no species.
#[derive(Debug)]
struct Limits {
    species: usize,
    squares: Vec<f64>,
}

impl Limits {
    fn of(species: usize, terms: &[Around]) -> Limits {
        let mut squares = vec![0.0f64; species * (species + 1)];
        for Around { rare, other, term } in terms {
            let square = &mut squares[rare * (species + 1) + other];
            *square = square.max(term.potential.range().powi(2));
        }
        Limits { species, squares }
    }

    /// Those around a particle of a species.
    fn around(&self, rare: usize) -> &[f64] {
        &self.squares[rare * (self.species + 1)..][..self.species + 1]
    }

    fn longest(&self) -> f64 {
        self.squares.iter().copied().fold(0.0, f64::max).sqrt()
    }
}

/// The species of a term, the rarer one first.
fn rare_first(term: &PairTerm, count: &[usize]) -> [usize; 2] {
    let [a, b] = term.between;
    if count[a] > count[b] { [b, a] } else { [a, b] }
}

/// Which pair potentials of a plan are faster apart from the sweep, for so many particles of each species. The volume does not matter:
/// all numbers of pairs are inversely proportional to it.
pub fn faster_apart(plan: &Plan, count: &[usize]) -> Vec<usize> {
    let volume = |range: f64| range.powi(plan.dimensions as i32);
    let all = count.iter().sum::<usize>() as f64;
    let sweep = |range: f64| 0.5 * all * all * volume(range);
    let base = plan.range_without_pairs();
    let range_of = |k: usize| plan.pairs[k].potential.range();
    let longer = |range: f64| (0..plan.pairs.len()).filter(move |k| range_of(*k) > range);
    let cost = |range: f64| {
        let mut around = vec![0.0f64; count.len()];
        for k in longer(range) {
            let [rare, _] = rare_first(&plan.pairs[k], count);
            around[rare] = around[rare].max(range_of(k));
        }
        let searches = count.iter().zip(around).map(|(count, range)| *count as f64 * volume(range));
        sweep(range) + AROUND_ONE * all * searches.sum::<f64>()
    };
    let ranges = (0..plan.pairs.len()).map(range_of).chain([base]);
    let shorter = ranges.filter(|range| (base..plan.cutoff).contains(range) && *range > 0.0);
    let best = shorter.min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
    best.filter(|range| cost(*range) < WORTH * sweep(plan.cutoff))
        .map_or(Vec::new(), |range| longer(range).collect())
}

impl LongPairs {
    /// The potentials `which` of a plan, for so many particles of each species.
    pub fn new(plan: &Plan, which: Vec<usize>, count: &[usize]) -> LongPairs {
        let around = |k: &usize| {
            let term = plan.pairs[*k].clone();
            let [rare, other] = rare_first(&term, count);
            Around { rare, other, term }
        };
        let terms: Vec<Around> = which.iter().map(around).collect();
        let limits = Limits::of(plan.species.len(), &terms);
        LongPairs { which, terms, limits, cells: Cells::default(), found: Vec::new() }
    }

    /// Whether particles meet in one image only.
    pub fn fit(&self, dimensions: usize, domain: &PeriodicBox) -> bool {
        (0..dimensions).all(|k| !domain.periodic()[k] || domain.height(k) >= 2.0 * self.limits.longest())
    }

    /// Adds the forces on particles in a box, and returns energy and virial if they are requested.
    ///
    /// # Errors
    /// Fails for a force that is not finite. Positions of particles that interact are finite, and types in range.
    pub fn add_forces(
        &mut self,
        (pool, plan): (&Pool, &Plan),
        domain: &PeriodicBox,
        particles: &Particles,
        want: Want,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, EngineError> {
        let LongPairs { terms, limits, cells, found, .. } = self;
        let none = limits.species;
        let species =
            |k: usize| usize::try_from(plan.species_of_type[particles.kind[k] as usize]).unwrap_or(none);
        cells.sort(pool, (domain, plan.dimensions, limits.longest()), particles.x, species);
        let is_rare = |s: usize| s != none && limits.around(s).iter().any(|square| *square > 0.0);
        let rare: Vec<usize> = (0..particles.owned).filter(|k| is_rare(species(*k))).collect();
        if found.len() < rare.len() {
            found.resize_with(rare.len(), Found::default);
        }
        let found = &mut found[..rare.len()];
        found.iter_mut().zip(rare).for_each(|(one, i)| (one.i, one.species) = (i, species(i)));
        pool.parts(found, |_, found| {
            for one in found {
                one.search(cells, domain, particles.x[one.i], limits.around(one.species));
                one.evaluate(terms, want);
            }
        });
        let (mut tally, mut lost) = (Tally::default(), None::<i32>);
        for one in &*found {
            tally += one.tally;
            let mut sum = [0.0; 3];
            for (j, f) in one.j.iter().zip(&one.force) {
                let other = &mut force[*j as usize];
                for c in 0..3 {
                    sum[c] += f[c];
                    other[c] -= f[c];
                }
            }
            (0..3).for_each(|c| force[one.i][c] += sum[c]);
            // A sum that is not finite has a part that is not.
            if !sum.iter().all(|c| c.is_finite()) {
                let tag = particles.tag[one.i];
                lost = Some(lost.map_or(tag, |other| other.min(tag)));
            }
        }
        lost.map_or(Ok(tally), |tag| Err(EngineError::Force { tag }))
    }

    /// Size in bytes of the arrays.
    pub fn memory(&self) -> usize {
        let of_found = |one: &Found| {
            one.j.capacity() * (size_of::<u32>() + size_of::<usize>())
                + (one.d.capacity() + one.force.capacity()) * size_of::<[f64; 3]>()
                + one.square.capacity() * size_of::<f64>()
        };
        let Cells { start, placed, x, id, species, .. } = &self.cells;
        self.found.iter().map(of_found).sum::<usize>()
            + (start.capacity() + id.capacity() + species.capacity()) * size_of::<u32>()
            + placed.capacity() * size_of::<([f64; 3], u32)>()
            + x.iter().map(Vec::capacity).sum::<usize>() * size_of::<f64>()
    }
}

/// The pairs of one particle.
#[derive(Debug, Default)]
struct Found {
    i: usize,
    species: usize,
    /// The other particles, their species, the separations `x_i − x_j`, and the squares of their lengths.
    j: Vec<u32>,
    others: Vec<usize>,
    d: Vec<[f64; 3]>,
    square: Vec<f64>,
    /// The forces on the particle.
    force: Vec<[f64; 3]>,
    tally: Tally,
    work: Work,
}

/// The pairs that one term acts on.
#[derive(Debug, Default)]
struct Work {
    place: Vec<usize>,
    r: Vec<f64>,
    phi: Vec<f64>,
    slope: Vec<f64>,
}

impl Found {
    /// Finds the particles within `limits`, the squares of ranges by species, around `x`.
    fn search(&mut self, cells: &Cells, domain: &PeriodicBox, x: [f64; 3], limits: &[f64]) {
        let Found { i, species, j, others, d, square, .. } = self;
        j.clear();
        others.clear();
        d.clear();
        square.clear();
        let own = *i as u32;
        let visit = |id: u32, kind: u32, separation: [f64; 3], length: f64| {
            let kind = kind as usize;
            // Of two particles of the rare species the first one has the pair.
            if length < limits[kind] && (kind != *species || own < id) {
                j.push(id);
                others.push(kind);
                d.push(separation);
                square.push(length);
            }
        };
        let mut inside = x;
        let from = cells.place(domain, x, &mut inside);
        let limit = limits.iter().copied().fold(0.0, f64::max);
        run_best(Near { cells, x: inside, from, limit, visit });
    }

    fn evaluate(&mut self, terms: &[Around], want: Want) {
        let Found { species, j, others, d, square, force, tally, work, .. } = self;
        let Work { place, r, phi, slope } = work;
        force.clear();
        force.resize(j.len(), [0.0; 3]);
        *tally = Tally::default();
        for Around { other, term, .. } in terms.iter().filter(|around| around.rare == *species) {
            let range = term.potential.range();
            place.clear();
            r.clear();
            for k in (0..j.len()).filter(|k| others[*k] == *other) {
                // A root may round to the range.
                let distance = square[k].sqrt();
                if distance < range {
                    place.push(k);
                    r.push(distance);
                }
            }
            phi.resize(r.len(), 0.0);
            slope.resize(r.len(), 0.0);
            term.potential.block(r, phi, slope);
            for ((k, r), slope) in place.iter().zip(&*r).zip(&*slope) {
                // A pair at zero distance has no direction.
                let along = if *r > 0.0 { -slope / r } else { 0.0 };
                (0..3).for_each(|c| force[*k][c] += along * d[*k][c]);
            }
            if want.energy {
                tally.pair += phi.iter().sum::<f64>();
            }
        }
        if want.virial {
            for (d, f) in d.iter().zip(&*force) {
                for (c, (a, b)) in COMPONENTS.into_iter().enumerate() {
                    tally.virial[c] += d[a] * f[b];
                }
            }
        }
    }
}

/// Particles sorted into cells.
#[derive(Debug, Default)]
struct Cells {
    dimensions: usize,
    periodic: [bool; 3],
    edges: [[f64; 3]; 3],
    count: [i64; 3],
    /// How many cells away others are within the range.
    reach: [i64; 3],
    /// The first particle of each cell, and the end of the last.
    start: Vec<u32>,
    /// The image of each particle in the box, and its cell.
    placed: Vec<([f64; 3], u32)>,
    /// In the order of cells positions, numbers of particles and their species.
    x: [Vec<f64>; 3],
    id: Vec<u32>,
    species: Vec<u32>,
}

impl Cells {
    fn sort(
        &mut self,
        pool: &Pool,
        (domain, dimensions, range): (&PeriodicBox, usize, f64),
        x: &[[f64; 3]],
        kind: impl Fn(usize) -> usize,
    ) {
        let heights = [0, 1, 2].map(|k| domain.height(k));
        // Empty cells cost time too.
        let most = ((x.len() + 64) as f64).powf(1.0 / dimensions as f64).ceil();
        let count = |k: usize| (FINE * heights[k] / range).floor().clamp(1.0, most) as i64;
        self.dimensions = dimensions;
        self.periodic = [0, 1, 2].map(|k| k < dimensions && domain.periodic()[k]);
        self.edges = [0, 1, 2].map(|k| domain.edge(k));
        self.count = [0, 1, 2].map(|k| if k < dimensions { count(k) } else { 1 });
        let reach = |k: usize| (range * self.count[k] as f64 / heights[k] * (1.0 + 1e-12)).ceil() as i64;
        self.reach = [0, 1, 2].map(|k| if k < dimensions { reach(k) } else { 0 });
        let mut placed = std::mem::take(&mut self.placed);
        placed.resize(x.len(), Default::default());
        pool.parts(&mut placed, |first, placed| {
            for ((inside, cell), x) in placed.iter_mut().zip(&x[first..]) {
                let [a, b, c] = self.place(domain, *x, inside);
                *cell = (a + self.count[0] * (b + self.count[1] * c)) as u32;
            }
        });
        let Cells { start, id, species, x: sorted, count, .. } = self;
        start.clear();
        start.resize(count.iter().product::<i64>() as usize + 2, 0);
        // Two places further, so that the end of each cell becomes the start of the next while cells are filled.
        placed.iter().for_each(|(_, cell)| start[*cell as usize + 2] += 1);
        (2..start.len()).for_each(|k| start[k] += start[k - 1]);
        id.resize(x.len(), 0);
        species.resize(x.len(), 0);
        sorted.iter_mut().for_each(|sorted| sorted.resize(x.len() + LANES, 0.0));
        for (k, (inside, cell)) in placed.iter().enumerate() {
            let next = &mut start[*cell as usize + 1];
            let to = *next as usize;
            *next += 1;
            (id[to], species[to]) = (k as u32, kind(k) as u32);
            (0..3).for_each(|c| sorted[c][to] = inside[c]);
        }
        self.placed = placed;
    }

    /// The cell of a point in each direction; writes its image in the box. Along open directions the cells at the ends extend to infinity.
    fn place(&self, domain: &PeriodicBox, x: [f64; 3], inside: &mut [f64; 3]) -> [i64; 3] {
        let mut s = domain.fraction(x);
        *inside = x;
        for k in (0..self.dimensions).filter(|k| self.periodic[*k]) {
            if !(0.0..1.0).contains(&s[k]) {
                let boxes = s[k].floor();
                s[k] -= boxes;
                (0..3).for_each(|c| inside[c] -= boxes * self.edges[k][c]);
            }
        }
        // Conversion rounds to zero, and makes 0 of NaN.
        std::array::from_fn(|k| ((s[k] * self.count[k] as f64) as i64).clamp(0, self.count[k] - 1))
    }
}

/// How many particles are compared at once.
const LANES: usize = 16;

/// Visits the particles whose distance is below the root of `limit`: number, species, separation `x − x_j` of the image there, and its
/// square.
struct Near<'a, V> {
    cells: &'a Cells,
    /// The point in the box, and its cell.
    x: [f64; 3],
    from: [i64; 3],
    limit: f64,
    visit: V,
}

impl<V: FnMut(u32, u32, [f64; 3], f64)> Loop for Near<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run(mut self) {
        let Cells { count, reach, periodic, edges, start, .. } = self.cells;
        let ends = |k: usize| {
            let (low, high) = (self.from[k] - reach[k], self.from[k] + reach[k]);
            if periodic[k] { low..high + 1 } else { low.max(0)..high.min(count[k] - 1) + 1 }
        };
        let (along, rows, planes) = (ends(0), ends(1), ends(2));
        for c in planes {
            for b in rows.clone() {
                let (boxes, row) = ([b.div_euclid(count[1]), c.div_euclid(count[2])], b.rem_euclid(count[1]));
                let first = count[0] * (row + count[1] * c.rem_euclid(count[2]));
                // The cells of a row follow each other, up to the end of the box.
                for turn in along.start.div_euclid(count[0])..=(along.end - 1).div_euclid(count[0]) {
                    let low = (along.start - turn * count[0]).max(0);
                    let end = (along.end - turn * count[0]).min(count[0]);
                    let [from, to] = [low, end].map(|cell| start[(first + cell) as usize] as usize);
                    let shift = |k: usize| {
                        turn as f64 * edges[0][k]
                            + boxes[0] as f64 * edges[1][k]
                            + boxes[1] as f64 * edges[2][k]
                    };
                    self.compare(
                        [self.x[0] - shift(0), self.x[1] - shift(1), self.x[2] - shift(2)],
                        from..to,
                    );
                }
            }
        }
    }
}

impl<V: FnMut(u32, u32, [f64; 3], f64)> Near<'_, V> {
    #[inline(always)]
    fn compare(&mut self, [x, y, z]: [f64; 3], particles: Range<usize>) {
        let Cells { x: [xs, ys, zs], id, species, dimensions, .. } = self.cells;
        let depth = if *dimensions == 2 { 0.0 } else { 1.0 };
        for from in particles.clone().step_by(LANES) {
            // Behind the last particle there is room for a whole step.
            let (xs, ys, zs) = (&xs[from..][..LANES], &ys[from..][..LANES], &zs[from..][..LANES]);
            let square: [f64; LANES] = std::array::from_fn(|k| {
                let d = [x - xs[k], y - ys[k], depth * (z - zs[k])];
                d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
            });
            let mut near = 0u32;
            for (k, square) in square.iter().enumerate() {
                near |= u32::from(*square < self.limit) << k;
            }
            near &= u32::MAX >> (32 - LANES.min(particles.end - from));
            while near != 0 {
                let k = near.trailing_zeros() as usize;
                near &= near - 1;
                let d = [x - xs[k], y - ys[k], depth * (z - zs[k])];
                (self.visit)(id[from + k], species[from + k], d, square[k]);
            }
        }
    }
}
