//! What each particle adds to the Laplacian of the energy, and the forces of pairs, by loops like those of the sweep.

use super::free_energy::{Psi, times};
use super::in_box::Pair;
use super::pair_block::PairBlock;
use super::plane_forces::PlaneForces;
use super::sweep_pairs::Ranges;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::engine::sweep::{MARGIN, PairLists, PlaneTerms, Pool, Sought};
use crate::model::Fluid;
use crate::model::pair::PairPotential;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::plane::laplacians::{DensitySums, MOST_DENSITIES};

/// Finds the sums over pairs that the Laplacian of a fluid is made of.
#[derive(Debug)]
pub struct PairLoops {
    lists: PairLists,
    tags: Vec<i32>,
    /// Arrays of pairs for reuse.
    pub spare: Vec<Vec<PlaneForces>>,
}

/// What [`Evaluator::particle_sums`](super::Evaluator::particle_sums) finds besides densities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// [`ParticleSums::shares`]
    pub shares: bool,
    /// The pairs with their forces.
    pub pairs: bool,
}

/// Sums over the pairs of each particle, and the pairs, in single precision.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticleSums {
    /// What each particle adds to the Laplacian `Σ_k ∇_k² U`:
    ///
    /// ```text
    /// s_i = Σ_v [2 ψ_i,v Σ_j ∇²w + Σ_u ψ_i,vu (g_v·g_u + Σ_j w_v′ w_u′)] + Σ_j ∇²φ,   g_v = ∇_i n_iv
    /// ```
    ///
    /// [`Evaluation::laplacians`](super::Evaluation::laplacians) has the terms by the particle that moves, a share those of the energy of
    /// one particle.
    pub shares: Vec<f64>,
    /// Uncorrected local densities, one for each density and species, density-major, particle by particle.
    pub densities: Vec<f64>,
    /// Sum `Σ ψ` over the particles of each species.
    pub excess: Vec<f64>,
    /// What has been found of shares and pairs.
    pub found: Wanted,
    pub(super) planes: Vec<PlaneForces>,
    /// Range of the conservative interactions.
    pub(super) range: f64,
}

impl ParticleSums {
    /// The number of pairs in each of the parts that they are in, as [`Evaluation::parts`](super::Evaluation::parts).
    pub fn parts(&self) -> impl Iterator<Item = usize> {
        self.planes.iter().map(PlaneForces::len)
    }

    /// The pairs of a part with their forces, as [`Evaluation::blocks_of`](super::Evaluation::blocks_of).
    pub fn blocks_of(&self, part: usize) -> impl Iterator<Item = PairBlock<'_, f32>> {
        self.planes[part].blocks()
    }

    /// Whether the pairs closer than a range are there.
    pub fn has_pairs_within(&self, range: f64) -> bool {
        self.found.pairs && range <= self.range
    }

    /// Calls `visit` with the pairs closer than a range that are there.
    pub fn for_each_pair(&self, range: f64, mut visit: impl FnMut(Pair)) {
        self.planes.iter().for_each(|plane| plane.for_each_pair(range, &mut visit));
    }
}

/// Whether [`Evaluator::particle_sums`](super::Evaluator::particle_sums) can do a fluid, in wide boxes.
pub fn has_particle_sums(fluid: &Fluid) -> bool {
    let ranges = Ranges::conservative(fluid);
    let is_closed = |form: &PairPotential| matches!(form, PairPotential::Soft(_) | PairPotential::Spline(_));
    fluid.walls.is_empty()
        && fluid.is_conservative()
        && fluid.densities.len() <= MOST_DENSITIES
        && ranges.longest() == ranges.shortest()
        && fluid.pairs.iter().all(|term| is_closed(&term.potential))
}

impl PairLoops {
    pub fn new(set: InstructionSet, dimensions: usize) -> PairLoops {
        PairLoops { lists: PairLists::new(set, dimensions), tags: Vec::new(), spare: Vec::new() }
    }

    /// The sums, and the pairs without their forces; `None` if the box is too narrow or too long. `plan` has a pass for every density of the
    /// fluid.
    pub fn find<'a>(
        &'a mut self,
        pool: &Pool,
        plan: &Plan,
        fluid: &'a Fluid,
        (x, species): (&[[f64; 3]], &[i32]),
        domain: &PeriodicBox,
        wanted: Wanted,
    ) -> Option<Sums<'a>> {
        let PairLoops { lists, tags, spare } = self;
        if tags.len() != x.len() {
            *tags = (1..=i32::try_from(x.len()).ok()?).collect();
        }
        let particles = Particles { owned: x.len(), x, tag: tags, kind: species };
        let range = [fluid.conservative_range(), MARGIN];
        let mut planes = if wanted.pairs { spare.pop().unwrap_or_default() } else { Vec::new() };
        let mut pairs: Vec<PlaneTerms> =
            planes.iter_mut().map(|plane| std::mem::take(&mut plane.terms)).collect();
        let sought = Sought { second: wanted.shares, pairs: wanted.pairs.then_some(&mut pairs) };
        let sums = lists.sum_laplacians(pool, domain, &particles, plan, range, sought).ok()?;
        planes.resize_with(pairs.len(), PlaneForces::default);
        planes.iter_mut().zip(pairs).for_each(|(plane, pairs)| plane.terms = pairs);
        Some(Sums { sums, fluid, place: &lists.place, planes })
    }
}

/// The sums of particles in the order of cells, and the place of each particle there.
pub struct Sums<'a> {
    sums: Vec<DensitySums>,
    fluid: &'a Fluid,
    place: &'a [u32],
    /// The pairs, if asked for.
    pub planes: Vec<PlaneForces>,
}

impl Sums<'_> {
    /// Those of a particle with its neighbours of a species, in all densities.
    fn of(&self, particle: usize, species: usize) -> &[DensitySums] {
        let (place, width) = (self.place[particle] as usize, self.fluid.densities.len().max(1));
        &self.sums[(place * self.fluid.species.len() + species) * width..][..width]
    }

    /// Densities without what particles are of their own.
    pub fn densities(&self, pool: &Pool) -> Vec<f64> {
        let (variables, kinds) = (self.fluid.variables(), self.fluid.species.len());
        let mut densities = vec![0.0; self.place.len() * variables];
        pool.parts(&mut densities, |first, densities| {
            for (at, n) in (first..).zip(densities) {
                let (k, v) = (at / variables, at % variables);
                *n = self.of(k, v % kinds)[v / kinds].first[3];
            }
        });
        densities
    }

    /// The share of each particle in the Laplacian, see [`ParticleSums::shares`].
    pub fn shares(&self, pool: &Pool, psi: &Psi) -> Vec<f64> {
        let (variables, kinds) = (self.fluid.variables(), self.fluid.species.len());
        let share = |k: usize| {
            let of = |v: usize| &self.of(k, v % kinds)[v / kinds];
            let mut share = 0.0;
            for v in 0..variables {
                share += times(psi.slopes[k * variables + v], 2.0 * of(v).second[0]);
                for u in 0..variables {
                    let along = (0..3).map(|c| of(v).first[c] * of(u).first[c]).sum::<f64>();
                    let of_same = match (v % kinds == u % kinds, v / kinds == u / kinds) {
                        (true, true) => of(v).second[1],
                        (true, false) => of(v % kinds).second[2],
                        (false, _) => 0.0,
                    };
                    share += times(psi.second[(k * variables + v) * variables + u], along + of_same);
                }
            }
            share + (0..kinds).map(|b| self.of(k, b)[0].second[3]).sum::<f64>()
        };
        let mut shares = vec![0.0; self.place.len()];
        pool.parts(&mut shares, |first, shares| {
            (first..).zip(shares).for_each(|(k, to)| *to = share(k));
        });
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::pair_sums::{Evaluation, Evaluator};
    use crate::model::Model;
    use crate::model::wall::{Surface, Wall};
    use nalgebra::Matrix3;
    use psidpd_passes::noise::threefry2x32;
    use psidpd_passes::settings::Instructions;
    use std::collections::BTreeMap;
    use std::num::NonZeroUsize;

    /// Two densities of two species, one with a self term, and potentials of all forms with loops.
    const BOTH: &str = r#"
title = "both"
species = ["A", "B"]
[density.n]
kernel = "wendland-c2"
range = 1.0
bounds = [0.2, 9.0]
correction = [0.1, 1.1, 0.01]
[density.m]
kernel = "cubic-spline"
range = 0.8
self = true
[excess_free_energy]
A = "kT*n_A*n_B + 0.3*m_A^2*n_A + 0.2*m^3"
B = "n^2*m_A + 0.1*m_B^3"
[[pair]]
between = ["A", "A"]
form = "soft"
strength = -20.0
range = 1.0
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 35.0
range = 0.6
[[pair]]
between = ["A", "B"]
form = "spline"
strength = 18.75
A = 2
B = 1
range_A = 0.8
range_B = 1.0
"#;

    const TWO_DENSITIES: &str =
        include_str!("../../../../validation/models/warren2003-set6-two-densities.toml");

    const MODELS: [&str; 12] = [
        BOTH,
        TWO_DENSITIES,
        include_str!("../../../../validation/models/standard-dpd.toml"),
        include_str!("../../../../validation/models/warren2003-set6.toml"),
        include_str!("../../../../validation/models/huggins.toml"),
        include_str!("../../../../validation/models/binary-2d.toml"),
        include_str!("../../../../validation/models/van-der-waals-2d.toml"),
        include_str!("../../../../validation/models/spline-attractive.toml"),
        include_str!("../../../../validation/models/spline-eos.toml"),
        include_str!("../../../../validation/models/power-law-k3.toml"),
        include_str!("../../../../validation/models/lennard-jones-corrected.toml"),
        include_str!("../../../../validation/models/groot-warren-linear.toml"),
    ];

    fn fluid(model: &str) -> Fluid {
        Model::parse("m.toml", model).unwrap().at(0.7).unwrap()
    }

    fn pool(threads: usize) -> Pool {
        Pool::new(NonZeroUsize::new(threads).unwrap())
    }

    /// Particles at random in a box, which may be skew and open, at a density of four.
    fn crowd(fluid: &Fluid, skew: bool, periodic: bool) -> (Vec<[f64; 3]>, Vec<i32>, PeriodicBox) {
        let range = fluid.conservative_range();
        let (flat, tilt) = (fluid.dimensions == 2, if skew { range } else { 0.0 });
        let [a, b, c] = [5.3 * range, 3.1 * range, if flat { 1.0 } else { 2.6 * range }];
        let edges = Matrix3::new(a, tilt, 0.0, 0.0, b, 0.0, 0.0, 0.0, c);
        let periodic = [true, periodic, true];
        let domain = PeriodicBox::new([-1.0, 0.5, if flat { -0.5 } else { 2.0 }], edges, periodic).unwrap();
        let uniform = |k: u32| f64::from(threefry2x32::<20>([k, 17], [5, 9])[0]) / 4_294_967_296.0;
        let count = (4.0 * domain.volume(fluid.dimensions) / range.powi(fluid.dimensions as i32)) as u32;
        let place = |k: u32| {
            let mut x = domain.point([0, 1, 2].map(|c| uniform(3 * k + c)));
            x[2] = if flat { 0.0 } else { x[2] };
            x
        };
        let species = (0..count as i32).map(|k| k % 7 % fluid.species.len() as i32).collect();
        ((0..count).map(place).collect(), species, domain)
    }

    const ALL: Wanted = Wanted { shares: true, pairs: true };

    /// Pairs by particles, the smaller index first: `r_i − r_j`, and the force on particle `i`.
    type Forces = BTreeMap<[usize; 2], [[f64; 3]; 2]>;

    fn forces<'a, T: Copy + Into<f64> + 'a>(blocks: impl Iterator<Item = PairBlock<'a, T>>) -> Forces {
        let mut all = Forces::new();
        for block in blocks {
            for (k, [i, j]) in block.particles().enumerate() {
                let sign = if i < j { 1.0 } else { -1.0 };
                let d = block.d.map(|d| sign * d[k].into());
                let known = all.insert([i.min(j), i.max(j)], [d, d.map(|d| d * block.strengths[k].into())]);
                assert!(known.is_none(), "{i} {j} twice");
            }
        }
        all
    }

    /// The pairs and their forces are those of an evaluation; few have no force in either.
    fn assert_same_pairs(sums: &ParticleSums, evaluation: &Evaluation, title: &str) {
        let found = forces((0..sums.parts().count()).flat_map(|part| sums.blocks_of(part)));
        let truth = forces((0..evaluation.parts().count()).flat_map(|part| evaluation.blocks_of(part)));
        assert_eq!(found.len(), sums.parts().sum::<usize>(), "{title}");
        let strongest = truth.values().flat_map(|[_, f]| f).fold(0.0f64, |most, f| most.max(f.abs()));
        let mut count = 0;
        for (pair, [d, f]) in &truth {
            let Some([of_d, of_f]) = found.get(pair) else {
                assert!(f.iter().all(|f| f.abs() < 1e-3 * strongest), "{title}: {pair:?} is missing");
                continue;
            };
            for c in 0..3 {
                assert!((of_d[c] - d[c]).abs() < 3e-6, "{title} {pair:?}: {of_d:?} {d:?}");
                assert!((of_f[c] - f[c]).abs() < 3e-6 * strongest, "{title} {pair:?}: {of_f:?} {f:?}");
            }
            count += 1;
        }
        let near = sums.range * (1.0 - 1e-5);
        let [mut within, mut expected] = [0; 2];
        sums.for_each_pair(near, |pair| {
            let d = found[&[pair.i.min(pair.j), pair.i.max(pair.j)]][0].map(f64::abs);
            assert!(pair.r < near && pair.d.map(f64::abs) == d, "{title}: {pair:?} {d:?}");
            within += 1;
        });
        evaluation.pairs_within(near).unwrap().for_each(|_| expected += 1);
        assert!(within == expected && count >= within && sums.has_pairs_within(near), "{title} {within}");
    }

    /// Shares sum up to the Laplacian of the evaluation in double precision, on each instruction set, and forces are the same; any number of
    /// threads finds the same bits, also of shares or pairs alone.
    #[test]
    fn sums_and_pairs_are_those_of_the_evaluation() {
        for (model, [skew, periodic]) in MODELS
            .into_iter()
            .flat_map(|model| [[false, true], [true, true], [false, false]].map(|shape| (model, shape)))
        {
            let evaluator = Evaluator::new(fluid(model)).unwrap();
            let fluid = &evaluator.fluid;
            let (x, species, domain) = crowd(fluid, skew, periodic);
            let (alone, three) = (pool(1), pool(3));
            let found = evaluator.particle_sums(&three, &x, &species, &domain, ALL);
            assert!(found.is_some(), "{}", fluid.title);
            let evaluation = evaluator.evaluate(&alone, &x, &species, &domain);
            let laplacians = evaluation.laplacians(&alone, fluid);
            let sizes = laplacians.iter().map(|l| l.abs()).sum::<f64>();
            for (_, set) in Instructions::ALL {
                let Some(set) = InstructionSet::new(set) else { continue };
                for pool in [&alone, &three] {
                    *evaluator.loops() = PairLoops::new(set, fluid.dimensions);
                    let sums = evaluator.particle_sums(pool, &x, &species, &domain, ALL).unwrap();
                    let ParticleSums { shares, densities, excess, .. } = &sums;
                    assert_same_pairs(&sums, &evaluation, &fluid.title);
                    let [sum, truth] = [shares, &laplacians].map(|of| of.iter().sum::<f64>());
                    assert!((sum - truth).abs() < 2e-7 * sizes, "{} {sum} {truth}", fluid.title);
                    let of_particles = [(densities, &evaluation.densities), (excess, &evaluation.excess)];
                    for (n, truth) in of_particles.iter().flat_map(|(n, truth)| n.iter().zip(*truth)) {
                        assert!(
                            (n - truth).abs() < 1e-6 * truth.abs().max(1.0),
                            "{} {n} {truth}",
                            fluid.title
                        );
                    }
                    // In arrays that have been in use.
                    evaluator.recycle_sums(sums.clone());
                    for found in [Wanted { pairs: false, ..ALL }, Wanted { shares: false, ..ALL }] {
                        let part = evaluator.particle_sums(pool, &x, &species, &domain, found).unwrap();
                        let shares = if found.shares { sums.shares.clone() } else { Vec::new() };
                        let planes = if found.pairs { sums.planes.clone() } else { Vec::new() };
                        let expected = ParticleSums { shares, planes, found, ..sums.clone() };
                        assert!(part == expected, "{} {found:?}", fluid.title);
                    }
                    if set.instructions() == InstructionSet::best().instructions() {
                        assert!(Some(&sums) == found.as_ref(), "{}", fluid.title);
                    }
                }
            }
        }
    }

    /// With ranges that differ by species, three densities, a potential that is a formula, a wall and in a narrow box.
    #[test]
    fn what_has_no_loops_is_said() {
        let with = |text: &str| format!("title = \"m\"\nspecies = [\"A\", \"B\"]\n{text}");
        let pair = |form: &str, a: &str, b: &str, range: f64| {
            let form = match form {
                "soft" => "form = \"soft\"\nstrength = 25.0".to_owned(),
                _ => "form = \"expression\"\nphi = \"(1 - r)^2\"".to_owned(),
            };
            format!("[[pair]]\nbetween = [\"{a}\", \"{b}\"]\n{form}\nrange = {range:?}\n")
        };
        let all = |form: &str, range: f64| {
            with(&(pair(form, "A", "A", 1.0) + &pair("soft", "A", "B", 1.0) + &pair("soft", "B", "B", range)))
        };
        let density = |name: &str| format!("[density.{name}]\nkernel = \"lucy\"\nrange = 1.0\n");
        let three = with(&(density("l") + &density("m") + &density("n")))
            + "[excess_free_energy]\nA = \"l^2 + m^2 + n^2\"\nB = \"l^2 + m^2 + n^2\"\n";
        let wide = PeriodicBox::orthogonal([0.0; 3], [5.0; 3], [true; 3]).unwrap();
        let narrow = PeriodicBox::orthogonal([0.0; 3], [5.0, 5.0, 1.9], [true; 3]).unwrap();
        let x = [[1.0; 3], [1.5, 1.0, 1.0]];
        for (model, domain, expected) in [
            (all("soft", 1.0), &wide, true),
            (all("soft", 1.0), &narrow, false),
            (all("soft", 1.2), &wide, false),
            (all("expression", 1.0), &wide, false),
            (three, &wide, false),
        ] {
            let evaluator = Evaluator::new(fluid(&model)).unwrap();
            let found = evaluator.particle_sums(&pool(1), &x, &[0, 1], domain, ALL);
            assert_eq!(found.is_some(), expected, "{model}");
        }
        let wall = Wall {
            surface: Surface::Face { axis: 2, high: false },
            species: 0,
            density: 4.0,
            local_densities: Vec::new(),
            strength: 1.0,
            velocity: [0.0; 3],
            drag: [None; 2],
        };
        let model = Model::parse("m.toml", &all("soft", 1.0)).unwrap().with_walls(vec![wall]);
        assert!(!has_particle_sums(&model.at(0.7).unwrap()));
    }
}
