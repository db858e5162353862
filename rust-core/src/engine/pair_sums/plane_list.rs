//! The pairs of one plane of cells in double precision, which one thread computes.
//!
//! Particles have local numbers: those of the plane, then those of the next plane that pairs reach. Each plane sums over its own
//! pairs, and [`merge`] adds the sums of all planes in their order, so that results do not depend on the number of threads.

use super::densities::add_density;
use super::forces::{Block, ForceInput};
use super::in_box::Pair;
use super::pair_block::PairBlock;
use super::pairs::{BLOCK, PairList};
use crate::engine::plan::Plan;
use crate::engine::sweep::{Images, Places, PlanePairs};
use crate::engine::vectors::{Loop, run_best};
use crate::model::PairTerm;
use crate::model::pair::PairForm;
use psidpd_passes::plane::list::pairs_of_each;

/// Number of pairs in a vector.
const LANES: usize = 8;

/// The pairs of a plane of cells, or of all particles, with sums over them.
#[derive(Debug, Clone, Default)]
pub struct PlaneList {
    /// Index of each particle in the arrays of the host.
    pub(super) hosts: Vec<u32>,
    species: Vec<i32>,
    /// The pairs by local numbers.
    pub(super) list: PairList,
    /// Conservative force of each pair along `ê_ij`, positive if repulsive, divided by its distance, once forces are computed; none
    /// at zero distance.
    pub(super) strengths: Vec<f64>,
    /// Densities of the particles, a number of them for each.
    sums: Vec<f64>,
    /// Energy of the pairs.
    energy: f64,
}

impl PlaneList {
    /// Empties the list, for pairs of all particles in the order of the host.
    pub fn clear(&mut self, species: &[i32]) {
        self.list.clear();
        self.hosts.clear();
        self.hosts.extend(0..species.len() as u32);
        self.species.clear();
        self.species.extend_from_slice(species);
    }

    /// Adds a pair of two particles of the host.
    pub fn push(&mut self, i: usize, j: usize, d: [f64; 3]) {
        self.list.push(i, j, d, &self.species);
    }

    /// Takes the pairs of a plane of the sweep's search. Some may be a little beyond its range.
    pub fn measure(&mut self, plane: &PlanePairs, places: &Places, species: &[i32]) {
        let PlanePairs { own, next, lists } = plane;
        let particles = || own.clone().chain(next.clone());
        self.hosts.clear();
        self.hosts.extend(particles().map(|k| places.host(k) as u32));
        self.species.clear();
        self.species.extend(self.hosts.iter().map(|k| species[*k as usize]));
        let kinds = self.species.iter().map(|species| *species as u8);
        let particles: Vec<([f64; 3], u8)> = particles().map(|k| places.x(k)).zip(kinds).collect();
        let list = &mut self.list;
        list.resize(lists.own.pairs.len());
        for (i, of_i) in pairs_of_each(&lists.own.start) {
            let (at, kind) = particles[i];
            list.i[of_i.clone()].fill(i as u32);
            list.species_i[of_i.clone()].fill(kind);
            let [x, y, z] = list.d.each_mut().map(|d| &mut d[of_i.clone()]);
            let (j, kinds) = (&mut list.j[of_i.clone()], &mut list.species_j[of_i.clone()]);
            let pairs = lists.own.pairs[of_i].iter().zip(j).zip(kinds).zip(x.iter_mut().zip(y).zip(z));
            for (((pair, j), kind), ((x, y), z)) in pairs {
                let (to, species) = particles[pair.j as usize];
                (*j, *kind) = (pair.j, species);
                (*x, *y, *z) = (at[0] - to[0], at[1] - to[1], at[2] - to[2]);
            }
        }
        run_best(Distances { list, images: places.images });
    }

    /// Takes the pairs of another list, stretched by a factor along each axis.
    pub fn stretch(&mut self, of: &PlaneList, factors: [f64; 3]) {
        self.hosts.clone_from(&of.hosts);
        self.species.clone_from(&of.species);
        self.list.copy_from(&of.list);
        run_best(Stretch { list: &mut self.list, factors });
    }

    /// Sums the densities of a plan over the pairs: [`Fluid::variables`](crate::model::Fluid::variables) numbers for each
    /// particle, density-major.
    pub fn add_densities(&mut self, plan: &Plan) {
        let (kinds, count) = (plan.species.len(), self.hosts.len());
        let width = plan.densities.len() * kinds;
        self.sums.clear();
        self.sums.resize(count * width, 0.0);
        for (d, density) in plan.densities.iter().enumerate() {
            add_density(&self.list, &density.kernel, count, &mut self.sums, width, d * kinds);
        }
    }

    /// Computes the force of each pair, and sums energies. `slopes` are those of all particles of the host.
    pub fn find_forces(&mut self, plan: &Plan, slopes: &[f64]) {
        let width = plan.slope_width();
        let slopes: Vec<f64> =
            self.hosts.iter().flat_map(|k| &slopes[*k as usize * width..][..width]).copied().collect();
        let PlaneList { hosts, list, strengths, energy, .. } = self;
        let input = ForceInput::conservative(plan, list, hosts.len(), &slopes);
        strengths.resize(list.len(), 0.0);
        *energy = 0.0;
        let mut block = Block::<BLOCK>::new();
        for from in (0..list.len()).step_by(BLOCK) {
            let pairs = from..(from + BLOCK).min(list.len());
            block.conserve(&input, pairs.clone(), true);
            let count = pairs.len();
            let (force, r, strengths) =
                (&block.conservative[..count], &list.r[pairs.clone()], &mut strengths[pairs]);
            run_best(PerDistance { force, r, strengths });
            *energy += block.pair[..count].iter().sum::<f64>();
        }
    }

    /// The pairs with their forces in blocks. Those a little beyond the range have no force.
    pub fn blocks(&self) -> impl Iterator<Item = PairBlock<'_>> {
        let PlaneList { hosts, list: PairList { i, j, d, .. }, strengths, .. } = self;
        PairBlock::all(hosts, [i, j], d.each_ref().map(|d| &d[..]), strengths)
    }

    /// The pairs within `range`. Particles have the indices of the host.
    pub fn pairs(&self, range: f64) -> impl Iterator<Item = Pair> {
        let PlaneList { hosts, list, .. } = self;
        (0..list.len()).filter(move |k| list.r[*k] < range).map(move |k| {
            let [i, j] = [list.i[k], list.j[k]].map(|k| hosts[k as usize] as usize);
            Pair { i, j, d: list.d.each_ref().map(|d| d[k]), r: list.r[k] }
        })
    }

    /// The densities of the particles, with their indices, for [`merge`].
    pub fn densities(&self) -> (&[u32], &[f64]) {
        (&self.hosts, &self.sums)
    }

    /// Energy of the pairs.
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// The sum `Σ φ` of a pair term.
    pub fn energy_of(&self, term: &PairTerm) -> f64 {
        let list = &self.list;
        let acts =
            |k: &usize| term.acts(list.species_i[*k] as usize, list.species_j[*k] as usize, list.r[*k]);
        (0..list.len()).filter(acts).map(|k| term.potential.at(list.r[k]).0).sum()
    }
}

/// The sums of all planes, `width` numbers for each of `count` particles of the host; a part has the hosts' indices of its
/// particles, and their sums.
pub fn merge<'a>(
    parts: impl Iterator<Item = (&'a [u32], &'a [f64])>,
    count: usize,
    width: usize,
) -> Vec<f64> {
    let mut all = vec![0.0; count * width];
    for (hosts, sums) in parts {
        for (host, sums) in hosts.iter().zip(sums.chunks_exact(width.max(1))) {
            let to = &mut all[*host as usize * width..][..width];
            to.iter_mut().zip(sums).for_each(|(to, sum)| *to += sum);
        }
    }
    all
}

/// Replaces the separations of a list by their nearest images, and computes distances.
struct Distances<'a> {
    list: &'a mut PairList,
    images: Images,
}

impl Loop for Distances<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Distances { list: PairList { d: [x, y, z], r, .. }, images } = self;
        let [(x, x_rest), (y, y_rest), (z, z_rest)] = [x, y, z].map(|c| c.as_chunks_mut::<LANES>());
        let (r, r_rest) = r.as_chunks_mut::<LANES>();
        for (((x, y), z), r) in x.iter_mut().zip(y).zip(z).zip(r) {
            to_nearest(images, [x, y, z], r);
        }
        for (((x, y), z), r) in x_rest.iter_mut().zip(y_rest).zip(z_rest).zip(r_rest) {
            to_nearest(images, [x, y, z].map(std::array::from_mut), std::array::from_mut(r));
        }
    }
}

#[inline(always)]
fn to_nearest<const N: usize>(images: Images, [x, y, z]: [&mut [f64; N]; 3], r: &mut [f64; N]) {
    let mut d = [*x, *y, *z];
    images.find_nearest(&mut d);
    [*x, *y, *z] = d;
    for k in 0..N {
        r[k] = (d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k]).sqrt();
    }
}

/// Stretches the separations of a list, and computes distances.
struct Stretch<'a> {
    list: &'a mut PairList,
    factors: [f64; 3],
}

impl Loop for Stretch<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Stretch { list: PairList { d: [x, y, z], r, .. }, factors: [a, b, c] } = self;
        for (((x, y), z), r) in x.iter_mut().zip(y).zip(z).zip(r) {
            (*x, *y, *z) = (a * *x, b * *y, c * *z);
            *r = (*x * *x + *y * *y + *z * *z).sqrt();
        }
    }
}

/// Divides the forces of pairs by their distances; pairs at zero distance have none.
struct PerDistance<'a> {
    force: &'a [f64],
    r: &'a [f64],
    strengths: &'a mut [f64],
}

impl Loop for PerDistance<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let PerDistance { force, r, strengths } = self;
        for ((strength, force), r) in strengths.iter_mut().zip(force).zip(r) {
            *strength = if *r > 0.0 { force / r } else { 0.0 };
        }
    }
}
