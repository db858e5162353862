//! The forces of some particles of rare species.

use super::group::Group;
use super::rare::RareParticles;
use crate::engine::components::COMPONENTS;
use crate::engine::sweep::Images;
use crate::engine::vectors::{Loop, run_best};
use crate::model::PairTerm;
use crate::model::pair::PairForm;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_search::around::{Around, Columns};
use psidpd_passes::tally::{Tally, Want};

/// Particles of rare species in a block.
pub const BLOCK: usize = 16;

/// Pairs in a vector.
const LANES: usize = 8;

/// What all blocks read.
pub struct Input<'a> {
    pub set: InstructionSet,
    pub geometry: &'a BoxGeometry,
    pub images: Images,
    /// Positions of the host's particles, and their fractions of the box geometry in units of 2⁻³².
    pub x: &'a [[f64; 3]],
    pub fixed32: &'a [[u32; 3]],
    /// All particles, and those of rare species, each with the host's numbers.
    pub all: (Columns<'a>, &'a [u32]),
    pub rare: (Columns<'a>, &'a [u32]),
    pub of_rare: &'a RareParticles,
    pub groups: &'a [Group],
    /// Whether a search may find a particle twice.
    pub meet_twice: bool,
    pub want: Want,
}

/// The pairs of a block, particle by particle.
#[derive(Debug, Default)]
pub struct Block {
    pub number: usize,
    pub tally: Tally,
    /// The particles of rare species, each with the force on it.
    own: Vec<(u32, [f64; 3])>,
    /// The others, and the forces on the particle of the rare species.
    others: Vec<u32>,
    force: Vec<[f64; 3]>,
    pairs: Pairs,
}

/// The pairs of one particle with those of one species. Arrays are whole vectors.
#[derive(Debug, Default)]
struct Pairs {
    around: Around,
    /// Separations from the others, and their lengths.
    d: [Vec<f64>; 3],
    r: Vec<f64>,
    phi: Vec<f64>,
    slope: Vec<f64>,
    inside: Inside,
}

/// Those of them that are within the range of a term.
#[derive(Debug, Default)]
struct Inside {
    place: Vec<usize>,
    r: Vec<f64>,
    phi: Vec<f64>,
    slope: Vec<f64>,
}

impl Block {
    /// Computes the pairs of the particles of this block.
    pub fn compute(&mut self, input: &Input) {
        let Block { number, tally, own, others, force, pairs } = self;
        *tally = Tally::default();
        own.clear();
        others.clear();
        force.clear();
        let from = BLOCK * *number;
        for k in from..(from + BLOCK).min(input.of_rare.len()) {
            let (host, kind, x) = input.of_rare.particle(k);
            let mut sum = [0.0; 3];
            for group in input.groups.iter().filter(|group| group.rare == kind as usize) {
                let (columns, hosts) = if group.among_rare { &input.rare } else { &input.all };
                // Of two particles of the rare species the first one has the pair.
                let first = if group.other == group.rare { k + 1 } else { 0 };
                let (place, other) = ((input.fixed32[host], x), (group.other as u8, first));
                columns.find(input.set, place, group.range, other, &mut pairs.around);
                let found = &mut pairs.around.found;
                if input.meet_twice {
                    found.sort_unstable();
                    found.dedup();
                }
                let begin = others.len();
                others.extend(found.iter().map(|j| hosts[*j as usize]));
                let count = others.len() - begin;
                pairs.measure(input, host, &others[begin..]);
                let of_group = pairs.evaluate(&group.terms, count, input.want, tally);
                (0..3).for_each(|c| sum[c] += of_group[c]);
                let Pairs { d: [x, y, z], slope, .. } = &*pairs;
                let of_pairs = x[..count].iter().zip(&y[..count]).zip(&z[..count]).zip(&slope[..count]);
                force.extend(of_pairs.map(|(((x, y), z), along)| [along * x, along * y, along * z]));
            }
            own.push((host as u32, sum));
        }
    }

    /// Adds the forces to those of the host's particles, and returns the particles for which they are not finite.
    pub fn add_to(&self, force: &mut [[f64; 3]]) -> impl Iterator<Item = usize> {
        for (j, f) in self.others.iter().zip(&self.force) {
            let other = &mut force[*j as usize];
            (0..3).for_each(|c| other[c] -= f[c]);
        }
        for (host, sum) in &self.own {
            (0..3).for_each(|c| force[*host as usize][c] += sum[c]);
        }
        // A sum that is not finite has a part that is not.
        let is_lost = |sum: &[f64; 3]| !sum.iter().all(|c| c.is_finite());
        self.own.iter().filter(move |(_, sum)| is_lost(sum)).map(|(host, _)| *host as usize)
    }

    /// Size in bytes of the arrays.
    pub fn memory(&self) -> usize {
        let Block { own, others, force, pairs, .. } = self;
        let Pairs { around, d, r, phi, slope, .. } = pairs;
        let numbers = d.iter().chain([r, phi, slope]).map(Vec::capacity).sum::<usize>();
        own.capacity() * size_of::<(u32, [f64; 3])>()
            + (others.capacity() + around.found.capacity()) * size_of::<u32>()
            + force.capacity() * size_of::<[f64; 3]>()
            + numbers * size_of::<f64>()
    }
}

impl Pairs {
    /// Computes separations and distances from a particle of the host.
    fn measure(&mut self, input: &Input, host: usize, others: &[u32]) {
        let Pairs { d, r, .. } = self;
        let whole = others.len().next_multiple_of(LANES);
        d.iter_mut().for_each(|d| d.resize(whole, 0.0));
        r.resize(whole, 0.0);
        let [a, b, c] = input.x[host];
        let depth = if input.geometry.dimensions == 2 { 0.0 } else { 1.0 };
        let [x, y, z] = d;
        for (((x, y), z), j) in x.iter_mut().zip(y).zip(z).zip(others) {
            let other = &input.x[*j as usize];
            (*x, *y, *z) = (a - other[0], b - other[1], depth * (c - other[2]));
        }
        run_best(Distances { d, r, images: input.images });
    }

    /// Computes the forces over distances into `slope`, and adds energy and virial if they are requested. Returns the sum of the forces.
    fn evaluate(&mut self, terms: &[PairTerm], count: usize, want: Want, tally: &mut Tally) -> [f64; 3] {
        let Pairs { d, r, phi, slope, inside, .. } = self;
        phi.resize(r.len(), 0.0);
        slope.resize(r.len(), 0.0);
        let within = |range: f64| r[..count].iter().fold(true, |all, r| all & (*r < range));
        match terms {
            [term] if within(term.potential.range()) => {
                term.potential.block(&r[..count], &mut phi[..count], &mut slope[..count]);
            }
            terms => {
                phi.fill(0.0);
                slope.fill(0.0);
                terms.iter().for_each(|term| inside.add(term, &r[..count], phi, slope));
            }
        }
        if want.energy {
            tally.pair += phi[..count].iter().sum::<f64>();
        }
        slope[count..].fill(0.0);
        let sum = run_best(Strengths { d, r, slope });
        if want.virial {
            for k in 0..count {
                let d = [d[0][k], d[1][k], d[2][k]];
                for (c, (a, b)) in COMPONENTS.into_iter().enumerate() {
                    tally.virial[c] += slope[k] * d[a] * d[b];
                }
            }
        }
        sum
    }
}

impl Inside {
    /// Adds energies and slopes of the pairs within the range of a term.
    fn add(&mut self, term: &PairTerm, distances: &[f64], phi: &mut [f64], slope: &mut [f64]) {
        let range = term.potential.range();
        self.place.clear();
        self.place.extend((0..distances.len()).filter(|k| distances[*k] < range));
        self.r.clear();
        self.r.extend(self.place.iter().map(|k| distances[*k]));
        self.phi.resize(self.r.len(), 0.0);
        self.slope.resize(self.r.len(), 0.0);
        term.potential.block(&self.r, &mut self.phi, &mut self.slope);
        for (k, (of_phi, of_slope)) in self.place.iter().zip(self.phi.iter().zip(&self.slope)) {
            phi[*k] += of_phi;
            slope[*k] += of_slope;
        }
    }
}

/// Replaces separations by their nearest images, and computes distances.
struct Distances<'a> {
    d: &'a mut [Vec<f64>; 3],
    r: &'a mut [f64],
    images: Images,
}

impl Loop for Distances<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.d.each_mut().map(|d| d.as_chunks_mut::<LANES>().0);
        for (((x, y), z), r) in x.iter_mut().zip(y).zip(z).zip(self.r.as_chunks_mut::<LANES>().0) {
            let mut d = [*x, *y, *z];
            self.images.find_nearest(&mut d);
            [*x, *y, *z] = d;
            for k in 0..LANES {
                r[k] = (d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k]).sqrt();
            }
        }
    }
}

/// Replaces slopes by forces over distances, and sums the forces; a pair at zero distance has no direction.
struct Strengths<'a> {
    d: &'a [Vec<f64>; 3],
    r: &'a [f64],
    slope: &'a mut [f64],
}

impl Loop for Strengths<'_> {
    type Out = [f64; 3];

    #[inline(always)]
    fn run(self) -> [f64; 3] {
        let [x, y, z] = self.d.each_ref().map(|d| d.as_chunks::<LANES>().0);
        let (r, slope) = (self.r.as_chunks::<LANES>().0, self.slope.as_chunks_mut::<LANES>().0);
        let mut sums = [[0.0; LANES]; 3];
        for ((x, y), (z, (r, slope))) in x.iter().zip(y).zip(z.iter().zip(r.iter().zip(slope))) {
            for k in 0..LANES {
                let along = -slope[k] / if r[k] > 0.0 { r[k] } else { 1.0 };
                slope[k] = if r[k] > 0.0 { along } else { 0.0 };
                sums[0][k] += slope[k] * x[k];
                sums[1][k] += slope[k] * y[k];
                sums[2][k] += slope[k] * z[k];
            }
        }
        sums.map(|lanes| lanes.iter().sum())
    }
}
