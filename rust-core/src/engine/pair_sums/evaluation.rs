//! Evaluates one configuration in a box for measurements and tests: every density, every ψ with its
//! derivatives, every pair with its force.

use super::free_energy::{Psi, psi};
use super::in_box::{BoxSearch, Pair};
use super::pair_block::PairBlock;
use super::plane_list::{PlaneList, merge};
use super::shares::{PairLoops, ParticleSums, Wanted, has_particle_sums};
use super::sweep_pairs::{Ranges, SweepPairs};
use crate::engine::components::COMPONENTS;
use crate::engine::plan::Plan;
use crate::engine::sweep::Pool;
use crate::engine::walls;
use crate::free_energy::FreeEnergy;
use crate::model::Fluid;
use crate::model::expression::TooLarge;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::instruction_set::InstructionSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Evaluates configurations of one fluid at one temperature.
///
/// The threads of a pool share the planes of cells of a box. Results do not depend on their number.
#[derive(Debug)]
pub struct Evaluator {
    /// The fluid that is evaluated.
    pub fluid: Fluid,
    /// A plan with a pass for every density.
    pub(super) plan: Plan,
    /// The ranges of the conservative interactions.
    ranges: Ranges,
    free_energy: FreeEnergy,
    work: Mutex<Work>,
    loops: Mutex<PairLoops>,
}

/// The search for pairs in wide boxes, and arrays of pairs for reuse.
#[derive(Debug)]
struct Work {
    search: SweepPairs,
    spare: Vec<Vec<PlaneList>>,
}

/// Energy, densities and pairs with their forces of one configuration.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// Potential energy `U`.
    pub energy: f64,
    /// Uncorrected local densities, one for each density and species, density-major, particle by particle.
    pub densities: Vec<f64>,
    /// ψ of the particles with its derivatives.
    pub psi: Psi,
    /// Sum `Σ ψ` over the particles of each species.
    pub excess: Vec<f64>,
    pub(super) planes: Vec<PlaneList>,
    /// The particles in the range of walls.
    pub near_walls: Vec<NearWall>,
    /// Longest range of the conservative interactions, and the shortest one of two species.
    range: f64,
    shortest: f64,
    /// The distance up to which pairs with the longest range are there.
    reach: f64,
}

/// How much farther than their range pairs are kept, in ranges, for [`Evaluator::energy_of_stretched`].
const SLACK: f64 = 3e-4;

/// A particle in the range of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearWall {
    /// Index of the particle.
    pub particle: usize,
    /// Index of the wall.
    pub wall: usize,
    /// The species of the particle.
    pub species: usize,
    /// The distance from the surface.
    pub distance: f64,
    /// The direction from the surface to the particle.
    pub normal: [f64; 3],
    /// The force on the particle in this direction.
    pub push: f64,
}

impl NearWall {
    /// The vector from the nearest point of the surface to the particle.
    pub fn line(&self) -> [f64; 3] {
        self.normal.map(|n| self.distance * n)
    }

    /// The force on the particle.
    pub fn force(&self) -> [f64; 3] {
        self.normal.map(|n| self.push * n)
    }
}

impl Evaluator {
    /// Computes the derivatives of the fluid's formulas.
    ///
    /// # Errors
    /// Fails if a derivative of ψ grows beyond the limits of the formula engine.
    pub fn new(fluid: Fluid) -> Result<Evaluator, TooLarge> {
        let free_energy = FreeEnergy::new(&fluid, usize::MAX).map_err(|_| TooLarge)?;
        let work = Mutex::new(Work { search: SweepPairs::new(fluid.dimensions), spare: Vec::new() });
        let ranges = Ranges::conservative(&fluid);
        let loops = Mutex::new(PairLoops::new(InstructionSet::best(), fluid.dimensions));
        Ok(Evaluator { plan: Plan::whole(&fluid)?, ranges, free_energy, work, loops, fluid })
    }

    /// Evaluates particles at `x`, with one species each, in a box. Particles at positions that
    /// are not finite do not interact.
    pub fn evaluate(&self, pool: &Pool, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> Evaluation {
        let reach = self.ranges.times(1.0 + SLACK);
        let mut planes = self.planes(pool, x, species, domain, &reach);
        let (range, shortest, reach) = (self.ranges.longest(), self.ranges.shortest(), reach.longest());
        let faces = walls::faces(&self.fluid.walls, domain, self.fluid.dimensions);
        let (densities, psi) = self.excess(pool, &mut planes, (x, species), &faces);
        pool.each(&mut planes, |plane| plane.find_forces(&self.plan, &psi.slopes));
        let excess = self.excess_of(species, &psi);
        let mut energy = excess.iter().sum::<f64>() + planes.iter().map(PlaneList::energy).sum::<f64>();
        let mut near_walls = Vec::new();
        self.for_each_near_wall(&faces, x, species, &psi, |near, of_wall| {
            energy += of_wall;
            near_walls.push(near);
        });
        Evaluation { energy, densities, psi, excess, planes, near_walls, range, shortest, reach }
    }

    /// Sums over the pairs of each particle, and the pairs, by loops like those of the sweep, which take less time than [`Evaluator::evaluate`].
    /// `None` where they do not apply: with walls, potentials that are formulas or tables, more than two densities or ranges that differ by
    /// species, and in boxes less than twice as wide as the range.
    pub fn particle_sums(
        &self,
        pool: &Pool,
        x: &[[f64; 3]],
        species: &[i32],
        domain: &PeriodicBox,
        wanted: Wanted,
    ) -> Option<ParticleSums> {
        let fluid = &self.fluid;
        if !has_particle_sums(fluid) {
            return None;
        }
        let mut loops = self.loops();
        let mut found = loops.find(pool, &self.plan, fluid, (x, species), domain, wanted)?;
        let mut densities = found.densities(pool);
        self.add_own(species, &mut densities);
        let psi = self.psi_of(pool, species, &densities);
        let shares = if wanted.shares { found.shares(pool, &psi) } else { Vec::new() };
        let mut planes = std::mem::take(&mut found.planes);
        pool.each(&mut planes, |plane| plane.find(fluid, species, &psi));
        let excess = self.excess_of(species, &psi);
        let range = fluid.conservative_range();
        Some(ParticleSums { shares, densities, excess, found: wanted, planes, range })
    }

    /// Computes the energy `U` only.
    pub fn energy(&self, pool: &Pool, x: &[[f64; 3]], species: &[i32], domain: &PeriodicBox) -> f64 {
        let planes = self.planes(pool, x, species, domain, &self.ranges);
        let faces = walls::faces(&self.fluid.walls, domain, self.fluid.dimensions);
        self.energy_of_pairs(pool, planes, (x, species), &faces)
    }

    /// Computes the energy `U` of an evaluated configuration after it is stretched, with its box, by a factor along each axis; `None` if
    /// pairs may come into range that are not among those of the evaluation, or if the fluid has walls.
    pub fn energy_of_stretched(
        &self,
        pool: &Pool,
        evaluation: &Evaluation,
        species: &[i32],
        factors: [f64; 3],
    ) -> Option<f64> {
        let least = factors.into_iter().fold(f64::INFINITY, f64::min);
        if evaluation.reach * least < evaluation.range || !self.fluid.walls.is_empty() {
            return None;
        }
        let mut planes = self.work().spare.pop().unwrap_or_default();
        planes.resize_with(evaluation.planes.len(), PlaneList::default);
        let mut work: Vec<_> = planes.iter_mut().zip(&evaluation.planes).collect();
        pool.each(&mut work, |(plane, of)| plane.stretch(of, factors));
        Some(self.energy_of_pairs(pool, planes, (&[], species), &[]))
    }

    /// The energy of listed pairs, and of particles near faces.
    fn energy_of_pairs(
        &self,
        pool: &Pool,
        mut planes: Vec<PlaneList>,
        (x, species): (&[[f64; 3]], &[i32]),
        faces: &[walls::Face],
    ) -> f64 {
        let (_, psi) = self.excess(pool, &mut planes, (x, species), faces);
        let mut energy =
            psi.value.iter().sum::<f64>() + pair_energies(pool, &planes, &self.fluid).iter().sum::<f64>();
        self.for_each_near_wall(faces, x, species, &psi, |_, of_wall| energy += of_wall);
        self.work().spare.push(planes);
        energy
    }

    /// Visits every particle in the range of a wall, with the energy that it has there besides ψ.
    fn for_each_near_wall(
        &self,
        faces: &[walls::Face],
        x: &[[f64; 3]],
        species: &[i32],
        psi: &Psi,
        mut visit: impl FnMut(NearWall, f64),
    ) {
        let (variables, count) = (self.fluid.variables(), self.fluid.species.len());
        for (particle, (x, kind)) in x.iter().zip(species).enumerate() {
            walls::for_each_near(faces, x, *kind, |face, field, z| {
                let slope = |d: usize| {
                    psi.slopes.get(particle * variables + d * count + face.wall.wall.species).copied()
                };
                let [push, energy] = walls::force_and_energy(field, z, slope);
                let (wall, species, normal) = (face.index, *kind as usize, face.place.normal(x));
                visit(NearWall { particle, wall, species, distance: z, normal, push }, energy);
            });
        }
    }

    /// Calls `visit` with every pair of particles with finite positions closer than `range`, each once, in an order that depends on
    /// the positions alone.
    pub fn for_each_pair(
        &self,
        pool: &Pool,
        x: &[[f64; 3]],
        domain: &PeriodicBox,
        range: f64,
        mut visit: impl FnMut(Pair),
    ) {
        let planes = self.planes(pool, x, &vec![0; x.len()], domain, &Ranges::all(range));
        planes.iter().flat_map(|plane| plane.pairs(range)).for_each(&mut visit);
        self.work().spare.push(planes);
    }

    /// Keeps the arrays of an evaluation for reuse: allocating new ones costs more than filling them.
    pub fn recycle(&self, evaluation: Evaluation) {
        self.work().spare.push(evaluation.planes);
    }

    /// Keeps the arrays of pairs for reuse.
    pub fn recycle_sums(&self, sums: ParticleSums) {
        if sums.found.pairs {
            self.loops().spare.push(sums.planes);
        }
    }

    pub(super) fn loops(&self) -> MutexGuard<'_, PairLoops> {
        self.loops.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self) -> MutexGuard<'_, Work> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Finds the pairs within their ranges, plane by plane; without a plane of cells all pairs within the longest range together.
    fn planes(
        &self,
        pool: &Pool,
        x: &[[f64; 3]],
        species: &[i32],
        domain: &PeriodicBox,
        ranges: &Ranges,
    ) -> Vec<PlaneList> {
        let mut work = self.work();
        let mut planes = work.spare.pop().unwrap_or_default();
        if !work.search.find(pool, x, species, domain, ranges, &mut planes) {
            let finite = |k: usize| x[k].iter().all(|c| c.is_finite());
            planes.resize_with(1, PlaneList::default);
            let all = &mut planes[0];
            all.clear(species);
            let push = |i, j, d| all.push(i, j, d);
            let range = ranges.longest();
            BoxSearch::default().find(x, x.len(), finite, domain, self.fluid.dimensions, range, push);
        }
        planes
    }

    /// Computes densities and ψ of all particles.
    fn excess(
        &self,
        pool: &Pool,
        planes: &mut [PlaneList],
        (x, species): (&[[f64; 3]], &[i32]),
        faces: &[walls::Face],
    ) -> (Vec<f64>, Psi) {
        let Evaluator { fluid, plan, .. } = self;
        let variables = fluid.variables();
        pool.each(planes, |plane| plane.add_densities(plan));
        let mut densities = merge(planes.iter().map(PlaneList::densities), species.len(), variables);
        self.add_own(species, &mut densities);
        let column = |d: usize| Some(d * fluid.species.len());
        walls::add_densities(faces, x, |k| species[k], column, variables, &mut densities);
        let psi = self.psi_of(pool, species, &densities);
        (densities, psi)
    }

    /// Adds what each particle is of its own density.
    fn add_own(&self, species: &[i32], densities: &mut [f64]) {
        let (variables, kinds) = (self.fluid.variables(), self.fluid.species.len());
        let own = self.fluid.densities.iter().enumerate().filter(|(_, density)| density.includes_self);
        for (d, own) in own.map(|(d, density)| (d, density.kernel.value(0.0))) {
            for (k, s) in species.iter().enumerate() {
                densities[k * variables + d * kinds + *s as usize] += own;
            }
        }
    }

    /// Sum `Σ ψ` over the particles of each species.
    fn excess_of(&self, species: &[i32], psi: &Psi) -> Vec<f64> {
        let mut excess = vec![0.0; self.fluid.species.len()];
        psi.value.iter().zip(species).for_each(|(value, s)| excess[*s as usize] += value);
        excess
    }

    /// ψ of particles at their densities.
    fn psi_of(&self, pool: &Pool, species: &[i32], densities: &[f64]) -> Psi {
        psi(pool, &self.free_energy, &self.fluid, species, densities)
    }
}

/// The sum `Σ φ` over each pair term of a fluid.
fn pair_energies(pool: &Pool, planes: &[PlaneList], fluid: &Fluid) -> Vec<f64> {
    let mut work: Vec<(&PlaneList, Vec<f64>)> = planes.iter().map(|plane| (plane, Vec::new())).collect();
    pool.each(&mut work, |(plane, energies)| {
        *energies = fluid.pairs.iter().map(|term| plane.energy_of(term)).collect();
    });
    let mut sums = vec![0.0; fluid.pairs.len()];
    for (_, energies) in &work {
        sums.iter_mut().zip(energies).for_each(|(sum, energy)| *sum += energy);
    }
    sums
}

impl Evaluation {
    /// Uncorrected local densities of one particle.
    pub fn densities_of(&self, particle: usize) -> &[f64] {
        let variables = self.densities.len() / self.psi.value.len();
        &self.densities[particle * variables..(particle + 1) * variables]
    }

    /// The sum `Σ φ` over each pair term of the fluid.
    pub fn pair_energies(&self, pool: &Pool, fluid: &Fluid) -> Vec<f64> {
        pair_energies(pool, &self.planes, fluid)
    }

    /// Virial `Σ r_ij ⊗ F_ij` of the conservative forces: xx, yy, zz, xy, xz, yz.
    pub fn virial(&self) -> [f64; 6] {
        COMPONENTS.map(|(a, b)| {
            let of_block = |block: PairBlock| -> f64 {
                let [x, y] = [a, b].map(|c| block.d[c]);
                block.strengths.iter().zip(x).zip(y).map(|((strength, x), y)| strength * x * y).sum()
            };
            let of_pairs: f64 = self.planes.iter().flat_map(PlaneList::blocks).map(of_block).sum();
            let of_walls = self.near_walls.iter().map(|near| near.line()[a] * near.force()[b]);
            of_pairs + of_walls.sum::<f64>()
        })
    }

    /// The number of pairs in each of the parts that they are in, for threads that share them. It does not depend on the number of
    /// threads.
    pub fn parts(&self) -> impl Iterator<Item = usize> {
        self.planes.iter().map(PlaneList::len)
    }

    /// The pairs closer than a range, if that is at most the range of the conservative interactions of any two species.
    pub fn pairs_within(&self, range: f64) -> Option<impl Iterator<Item = Pair>> {
        (range <= self.shortest).then(|| self.planes.iter().flat_map(move |plane| plane.pairs(range)))
    }

    /// The pairs of a part in the range of the conservative interactions; those that are further apart than the range of their species may
    /// be missing.
    pub fn pairs_of(&self, part: usize) -> impl Iterator<Item = Pair> {
        self.planes[part].pairs(self.range)
    }

    /// The pairs of a part with their forces, in blocks of at most [`PAIR_BLOCK`](super::PAIR_BLOCK). Pairs a little beyond the range
    /// may be among them, without a force.
    pub fn blocks_of(&self, part: usize) -> impl Iterator<Item = PairBlock<'_>> {
        self.planes[part].blocks()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use psidpd_passes::noise::threefry2x32;

    const BOUNDED: &str = r#"
title = "bounded"
species = ["A"]
[density.n]
kernel = "wendland-c2"
range = 1.0
bounds = [2.0, 3.5]
correction = [0.1, 1.1, 0.01]
[excess_free_energy]
A = { pressure = "rho*kT + rho^3" }
"#;

    const STATED: &str = r#"
title = "stated"
species = ["A"]
[density.n]
kernel = "quadratic"
range = 1.0
correction = [0.1, 1.1, 0.01]
[excess_free_energy]
A = { slopes = { n = "0.3*n" }, energy = "n^2" }
"#;

    /// Ranges that differ by species.
    const SIZES: &str = r#"
title = "sizes"
species = ["A", "B"]
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 25.0
range = 0.5
[[pair]]
between = ["A", "B"]
form = "soft"
strength = 15.0
range = 0.9
[[pair]]
between = ["B", "B"]
form = "soft"
strength = -20.0
range = 1.4
[[pair]]
between = ["B", "B"]
form = "soft"
strength = 50.0
range = 0.6
"#;

    /// Species that do not interact with each other.
    const STRANGERS: &str = r#"
title = "strangers"
species = ["A", "B"]
[[pair]]
between = ["A", "B"]
form = "soft"
strength = 0.0
range = 0.1
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 25.0
range = 0.7
[[pair]]
between = ["B", "B"]
form = "soft"
strength = 9.0
range = 1.2
"#;

    const MODELS: [&str; 7] = [
        BOUNDED,
        SIZES,
        STRANGERS,
        include_str!("../../../../validation/models/warren2003-set6.toml"),
        include_str!("../../../../validation/models/huggins.toml"),
        include_str!("../../../../validation/models/binary-2d.toml"),
        include_str!("../../../../validation/models/spline-attractive.toml"),
    ];

    fn alone() -> Pool {
        Pool::new(std::num::NonZeroUsize::MIN)
    }

    fn random(model: &str, seed: u32) -> (Evaluator, Vec<[f64; 3]>, Vec<i32>, PeriodicBox) {
        let fluid = Model::parse("m.toml", model).unwrap().at(1.0).unwrap();
        let flat = fluid.dimensions == 2;
        let domain = PeriodicBox::orthogonal(
            [0.0, 0.0, if flat { -0.5 } else { 0.0 }],
            [3.0, 3.2, if flat { 1.0 } else { 2.9 }],
            [true; 3],
        )
        .unwrap();
        let uniform = |k: u32| f64::from(threefry2x32::<20>([k, seed], [5, 9])[0]) / 4_294_967_296.0;
        let x = (0..90)
            .map(|k| {
                let mut p = domain.point([uniform(3 * k), uniform(3 * k + 1), uniform(3 * k + 2)]);
                if flat {
                    p[2] = 0.0;
                }
                p
            })
            .collect();
        let species = (0..90).map(|k| k % fluid.species.len() as i32).collect();
        (Evaluator::new(fluid).unwrap(), x, species, domain)
    }

    #[test]
    fn an_evaluation_is_the_truth() {
        for model in MODELS.into_iter().chain([STATED]) {
            let (evaluator, x, species, domain) = random(model, 11);
            let found = evaluator.evaluate(&alone(), &x, &species, &domain);
            let indices: Vec<usize> = species.iter().map(|s| *s as usize).collect();
            let truth = crate::truth::conservative(&evaluator.fluid, &x, &indices, &domain).unwrap();
            let energies =
                found.excess.iter().chain(&found.pair_energies(&alone(), &evaluator.fluid)).sum::<f64>();
            let energy = evaluator.energy(&alone(), &x, &species, &domain);
            assert!((energy - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            assert!((energies - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            let scale = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
            assert!((found.energy - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0));
            for (f, g) in
                found.forces(&alone(), &evaluator.fluid).iter().flatten().zip(truth.forces.iter().flatten())
            {
                assert!((f - g).abs() < 1e-11 * scale, "{f} {g}");
            }
            for (w, v) in found.virial().iter().zip(truth.virial) {
                assert!((w - v).abs() < 1e-10 * scale, "{w} {v}");
            }
        }
    }

    /// In boxes wide and narrow, tilted, open and half open, with particles at one point and outside the box, and with the same bits
    /// on three threads.
    #[test]
    fn an_evaluation_in_any_box_is_the_truth() {
        let skew = nalgebra::Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 3.0);
        let straight =
            |lengths, periodic| PeriodicBox::orthogonal([-1.0, 0.5, 2.0], lengths, periodic).unwrap();
        let boxes = [
            PeriodicBox::new([1.0, 2.0, 3.0], skew, [true; 3]).unwrap(),
            straight([4.0, 3.0, 5.0], [true, false, true]),
            straight([4.0, 3.0, 5.0], [false; 3]),
            straight([2.2, 9.0, 2.2], [true; 3]),
            straight([1.5, 4.0, 4.0], [true; 3]),
        ];
        let three = Pool::new(std::num::NonZeroUsize::new(3).unwrap());
        for (model, domain) in
            MODELS.into_iter().flat_map(|model| boxes.iter().map(move |domain| (model, domain)))
        {
            let (evaluator, x, species, unit) = random(model, 14);
            if evaluator.fluid.dimensions == 2 {
                continue;
            }
            let mut x: Vec<[f64; 3]> = x.iter().map(|x| domain.point(unit.fraction(*x))).collect();
            x[11] = x[10];
            // The truth knows particles in the box only.
            let inside = x.clone();
            if domain.periodic()[0] {
                (0..3).for_each(|c| x[3][c] += domain.edge(0)[c]);
            }
            let found = evaluator.evaluate(&alone(), &x, &species, domain);
            let shared = evaluator.evaluate(&three, &x, &species, domain);
            assert_eq!(
                (found.forces(&alone(), &evaluator.fluid), found.energy, found.virial()),
                (shared.forces(&three, &evaluator.fluid), shared.energy, shared.virial())
            );
            let laplacians = [&alone(), &three].map(|pool| found.laplacians(pool, &evaluator.fluid));
            assert_eq!(laplacians[0], laplacians[1]);
            let indices: Vec<usize> = species.iter().map(|s| *s as usize).collect();
            let truth = crate::truth::conservative(&evaluator.fluid, &inside, &indices, domain).unwrap();
            let scale = truth.forces.iter().flatten().fold(1.0f64, |m, f| m.max(f.abs()));
            assert!((found.energy - truth.energy).abs() < 1e-11 * truth.energy.abs().max(1.0), "{domain:?}");
            for (f, g) in
                found.forces(&alone(), &evaluator.fluid).iter().flatten().zip(truth.forces.iter().flatten())
            {
                assert!((f - g).abs() < 1e-11 * scale, "{domain:?}: {f} {g}");
            }
            for (w, v) in found.virial().iter().zip(truth.virial) {
                assert!((w - v).abs() < 1e-10 * scale, "{domain:?}: {w} {v}");
            }
        }
    }

    /// Pairs beyond the range of their species are not listed, and a caller who needs all pairs is told so.
    #[test]
    fn only_pairs_within_the_ranges_of_their_species_are_listed() {
        let (evaluator, x, species, domain) = random(SIZES, 15);
        let found = evaluator.evaluate(&alone(), &x, &species, &domain);
        let ranges = [[0.5, 0.9], [0.9, 1.4]];
        let [mut within, mut all] = [0; 2];
        evaluator.for_each_pair(&alone(), &x, &domain, 1.4, |p| {
            let [a, b] = [p.i, p.j].map(|k| species[k] as usize);
            within += usize::from(p.r < ranges[a][b]);
            all += 1;
        });
        let listed = found.parts().sum::<usize>();
        assert!((within..within + 3).contains(&listed) && all > 2 * within, "{listed} {within} {all}");
        assert!(found.pairs_within(0.5).is_some() && found.pairs_within(0.6).is_none());
        let (evaluator, x, species, domain) = random(STRANGERS, 15);
        let found = evaluator.evaluate(&alone(), &x, &species, &domain);
        let pairs: Vec<Pair> = (0..found.parts().count()).flat_map(|part| found.pairs_of(part)).collect();
        let far = pairs.iter().filter(|pair| species[pair.i] != species[pair.j] && pair.r > 0.11).count();
        assert!(far == 0 && pairs.len() > 20, "{far} {}", pairs.len());
        let (evaluator, x, species, domain) = random(BOUNDED, 15);
        let found = evaluator.evaluate(&alone(), &x, &species, &domain);
        assert!(found.pairs_within(1.0).is_some() && found.pairs_within(1.1).is_none());
    }

    /// The energy of a stretched configuration is that of its positions in the stretched box; pairs out of reach are not ignored.
    #[test]
    fn stretched_energies_are_those_of_stretched_positions() {
        for (model, axis) in MODELS.into_iter().flat_map(|model| [(model, 0), (model, 1)]) {
            let (evaluator, x, species, domain) = random(model, 12);
            let found = evaluator.evaluate(&alone(), &x, &species, &domain);
            for change in [1e-4, -1e-4] {
                let mut factors = [1.0; 3];
                (factors[axis], factors[1 - axis]) = (1.0 + change, 1.0 / (1.0 + change));
                let lengths = [0, 1, 2].map(|c| domain.lengths()[c] * factors[c]);
                let stretched = PeriodicBox::orthogonal(domain.origin(), lengths, [true; 3]).unwrap();
                let moved: Vec<_> = x.iter().map(|x| stretched.point(domain.fraction(*x))).collect();
                let expected = evaluator.energy(&alone(), &moved, &species, &stretched);
                let energy = evaluator.energy_of_stretched(&alone(), &found, &species, factors).unwrap();
                let close = (energy - expected).abs() < 1e-11 * expected.abs().max(1.0);
                assert!(close && energy != found.energy, "{energy} {expected}");
            }
            assert!(evaluator.energy_of_stretched(&alone(), &found, &species, [1.0, 0.99, 1.0]).is_none());
        }
    }

    /// ψ has no finite slope for an isolated particle, which must not affect pairs out of the range of its density.
    #[test]
    fn pairs_out_of_range_of_a_density_feel_nothing_of_it() {
        let model = r#"
title = "m"
species = ["A"]
[density.n]
kernel = "lucy"
range = 0.5
[excess_free_energy]
A = "sqrt(n)"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 25.0
range = 1.0
"#;
        let (evaluator, ..) = random(model, 13);
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let found = evaluator.evaluate(&alone(), &[[1.0; 3], [1.7, 1.0, 1.0]], &[0, 0], &domain);
        let forces = found.forces(&alone(), &evaluator.fluid);
        assert!((forces[0][0] + 7.5).abs() < 1e-12 && forces[1][0] == -forces[0][0]);
        // φ″ + 2 φ′/r of the soft force.
        let laplacians = found.laplacians(&alone(), &evaluator.fluid);
        assert!(laplacians.iter().all(|l| (l - (25.0 - 15.0 / 0.7)).abs() < 1e-12), "{laplacians:?}");
    }

    /// Compares the Laplacian of U with differences of forces.
    #[test]
    fn laplacians_are_divergences_of_forces() {
        for model in MODELS {
            let (evaluator, x, species, domain) = random(model, 12);
            let found =
                evaluator.evaluate(&alone(), &x, &species, &domain).laplacians(&alone(), &evaluator.fluid);
            let dimensions = evaluator.fluid.dimensions;
            for k in [0, 17, 44] {
                let h = 1e-6;
                let mut divergence = 0.0;
                for c in 0..dimensions {
                    let force = |h: f64| {
                        let mut x = x.clone();
                        x[k][c] += h;
                        evaluator.evaluate(&alone(), &x, &species, &domain).forces(&alone(), &evaluator.fluid)
                            [k][c]
                    };
                    divergence += (force(h) - force(-h)) / (2.0 * h);
                }
                let scale = divergence.abs().max(1.0);
                assert!((found[k] + divergence).abs() < 2e-5 * scale, "{} {divergence}", found[k]);
            }
        }
    }
}
