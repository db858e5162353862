//! The pairs of one plane of cells in double precision, which one thread computes.
//!
//! Particles have local numbers: those of the plane, then those of the next plane that pairs reach. Each plane sums over its own
//! pairs, and [`merge`] adds the sums of all planes in their order, so that results do not depend on the number of threads.

use super::densities::add_density;
use super::forces::{Block, ForceInput};
use super::in_box::Pair;
use super::pairs::PairList;
use crate::engine::plan::Plan;
use crate::engine::sweep::{Images, Places, PlanePairs};
use crate::engine::vectors::{Loop, run_best};
use crate::model::PairTerm;
use crate::model::pair::PairForm;
use psidpd_passes::plane::list::pairs_of_each;
use psidpd_passes::tally::Tally;

/// Number of pairs in a block, whose scalars stay in the first-level cache.
pub const BLOCK: usize = 256;

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
    /// Conservative force of each pair along `ê_ij`, once forces are computed.
    forces: Vec<f64>,
    /// Sums of the particles, a number of them for each.
    sums: Vec<f64>,
    /// Energy and virial of the pairs.
    tally: Tally,
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
        let x: Vec<[f64; 3]> = particles().map(|k| places.x(k)).collect();
        let list = &mut self.list;
        list.resize(lists.own.pairs.len());
        for (i, of_i) in pairs_of_each(&lists.own.start) {
            let (at, kind) = (x[i], self.species[i] as u8);
            for k in of_i {
                let j = lists.own.pairs[k].j as usize;
                (list.i[k], list.j[k]) = (i as u32, j as u32);
                (list.species_i[k], list.species_j[k]) = (kind, self.species[j] as u8);
                (0..3).for_each(|c| list.d[c][k] = at[c] - x[j][c]);
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

    /// Computes the force of each pair, and sums forces, energies and virials. `slopes` are those of all particles of the host.
    pub fn add_forces(&mut self, plan: &Plan, slopes: &[f64]) {
        let width = plan.slope_width();
        let slopes: Vec<f64> =
            self.hosts.iter().flat_map(|k| &slopes[*k as usize * width..][..width]).copied().collect();
        let PlaneList { hosts, list, forces, sums, tally, .. } = self;
        let input = ForceInput::conservative(plan, list, hosts.len(), &slopes);
        sums.clear();
        sums.resize(3 * hosts.len(), 0.0);
        forces.resize(list.len(), 0.0);
        *tally = Tally::default();
        let mut block = Block::<BLOCK>::new();
        let mut per_distance = [0.0; BLOCK];
        for from in (0..list.len()).step_by(BLOCK) {
            let pairs = from..(from + BLOCK).min(list.len());
            block.conserve(&input, pairs.clone(), true);
            let count = pairs.len();
            forces[pairs.clone()].copy_from_slice(&block.conservative[..count]);
            let d = list.d.each_ref().map(|d| &d[pairs.clone()]);
            let virial = run_best(Virial {
                force: &block.conservative[..count],
                r: &list.r[pairs.clone()],
                d,
                per_distance: &mut per_distance[..count],
            });
            (0..6).for_each(|c| tally.virial[c] += virial[c]);
            tally.pair += block.pair[..count].iter().sum::<f64>();
            for (k, scale) in per_distance[..count].iter().enumerate() {
                let (i, j) = (3 * list.i[from + k] as usize, 3 * list.j[from + k] as usize);
                for c in 0..3 {
                    let f = scale * d[c][k];
                    sums[i + c] += f;
                    sums[j + c] -= f;
                }
            }
        }
    }

    /// The pairs within `range`, with their force along `ê_ij = (r_i − r_j)/r_ij`, positive if repulsive; that of an earlier
    /// configuration, or 0, before forces are computed. Particles have the indices of the host.
    pub fn pairs(&self, range: f64) -> impl Iterator<Item = (Pair, f64)> {
        let PlaneList { hosts, list, forces, .. } = self;
        (0..list.len()).filter(move |k| list.r[*k] < range).map(move |k| {
            let [i, j] = [list.i[k], list.j[k]].map(|k| hosts[k as usize] as usize);
            let d = list.d.each_ref().map(|d| d[k]);
            (Pair { i, j, d, r: list.r[k] }, forces.get(k).copied().unwrap_or(0.0))
        })
    }

    /// The sums of the particles, with their indices, for [`merge`].
    pub fn sums(&self) -> (&[u32], &[f64]) {
        (&self.hosts, &self.sums)
    }

    /// Energy and virial of the pairs.
    pub fn tally(&self) -> &Tally {
        &self.tally
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

/// The virial of a block of pairs, and the force of each divided by its distance; pairs at zero distance have none.
struct Virial<'a> {
    force: &'a [f64],
    r: &'a [f64],
    d: [&'a [f64]; 3],
    per_distance: &'a mut [f64],
}

impl Loop for Virial<'_> {
    type Out = [f64; 6];

    #[inline(always)]
    fn run(self) -> [f64; 6] {
        let Virial { force, r, d: [x, y, z], per_distance } = self;
        for ((scale, force), r) in per_distance.iter_mut().zip(force).zip(r) {
            *scale = if *r > 0.0 { force / r } else { 0.0 };
        }
        let mut sums = [[0.0; LANES]; 6];
        let ((scale, scale_rest), [(x, x_rest), (y, y_rest), (z, z_rest)]) =
            (per_distance.as_chunks::<LANES>(), [x, y, z].map(|c| c.as_chunks::<LANES>()));
        for (((scale, x), y), z) in scale.iter().zip(x).zip(y).zip(z) {
            for k in 0..LANES {
                add_dyad(&mut sums, k, scale[k], [x[k], y[k], z[k]]);
            }
        }
        for (((scale, x), y), z) in scale_rest.iter().zip(x_rest).zip(y_rest).zip(z_rest) {
            add_dyad(&mut sums, 0, *scale, [*x, *y, *z]);
        }
        sums.map(|lanes| lanes.iter().sum())
    }
}

#[inline(always)]
fn add_dyad(sums: &mut [[f64; LANES]; 6], lane: usize, scale: f64, [x, y, z]: [f64; 3]) {
    let terms = [x * x, y * y, z * z, x * y, x * z, y * z];
    for (sum, term) in sums.iter_mut().zip(terms) {
        sum[lane] += scale * term;
    }
}
