//! The change of a configuration's energy when one particle moves, for Metropolis Monte Carlo.
//!
//! ```text
//! U = Σ_i ψ_c(i)(ñ_i) + Σ_{i<j} φ(r_ij)
//! ```
//!
//! A particle that moves changes the densities of its neighbours at the old and the new position, and
//! the distances to them. Only their ψ is evaluated again.

mod cells;

use super::error::EngineError;
use super::excess::ExcessWork;
use super::particles::Particles;
use super::plan::Plan;
use super::vectors::{self, Loop};
use super::walls;
use crate::model::expression::TooLarge;
use crate::model::kernel::{Kernel, Shape, ShapeVisitor};
use crate::model::pair::PairForm;
use crate::model::{Fluid, PairTerm};
pub use cells::{Cells, Near};
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::instruction_set::InstructionSet;

/// Number of particles in an evaluation of all ψ.
const LANES: usize = 128;

/// A density that loses a neighbour and keeps less than this share of `w(0)` is summed anew. Differences leave rounding errors
/// where nothing is left, and powers below one, or that exist for positive densities alone, turn them into wrong energies.
const CANCELLED: f64 = 1e-6;

/// Reasons why a fluid has no such energy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoEnergy {
    /// The forces have no potential.
    #[error(
        "the forces of the model are not the gradient of an energy: {0}; Monte Carlo moves need a psi, and densities without a force_kernel of their own"
    )]
    NotConservative(String),
    /// A derivative grows beyond the limits of the formula engine.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

/// The energy of one fluid in a box, as a function of the positions of single particles. All
/// arithmetic is in double precision.
#[derive(Debug, Clone, Default)]
pub struct LocalEnergy {
    plan: Plan,
    /// The longest range of the interactions; 0 for an ideal gas.
    pub range: f64,
    set: InstructionSet,
    cells: Option<Cells>,
    x: Vec<[f64; 3]>,
    species: Vec<i32>,
    /// Densities that ψ depends on nonlinearly, one for each such density and species, particle by particle.
    n: Vec<f64>,
    psi: Vec<f64>,
    /// Each particle's contribution to its own density, by density: `w(0)`, and its own images.
    own: Vec<f64>,
    near: Near,
    /// The particles near a neighbour whose density is summed anew.
    beside: Near,
    excess: ExcessWork,
    work: Work,
    moved: Moved,
}

/// A trial move of a particle.
#[derive(Debug, Clone, Default)]
struct Moved {
    particle: usize,
    to: [f64; 3],
    /// The particles whose ψ changes, including the moved one, with their densities and ψ.
    ids: Vec<u32>,
    n: Vec<f64>,
    psi: Vec<f64>,
}

/// Scratch arrays for one move.
#[derive(Debug, Clone, Default)]
struct Work {
    /// Changes of densities and the moved particle's new contributions, neighbour by neighbour, for each density.
    change: Vec<f64>,
    after: Vec<f64>,
    /// Rows and densities that cancellation leaves inaccurate.
    cancelled: Vec<[usize; 2]>,
    weights: [Vec<f64>; 2],
    r: Vec<f64>,
    phi: Vec<f64>,
    at: Vec<f64>,
    lanes: Vec<f64>,
    members: Vec<u32>,
    registers: Vec<f64>,
    /// Index of each particle among those whose ψ changes, used if a particle may occur more than once.
    slot: Vec<u32>,
}

impl LocalEnergy {
    /// Creates the energy of a fluid, without particles.
    ///
    /// # Errors
    /// Fails if the fluid has no energy.
    pub fn new(fluid: &Fluid) -> Result<LocalEnergy, NoEnergy> {
        if let Some(species) = fluid.stated_slopes() {
            return Err(NoEnergy::NotConservative(format!("the slopes of {species} are stated")));
        }
        if let Some(density) = fluid.densities.iter().find(|d| d.force_kernel != d.kernel) {
            let what = format!("the density {} has another kernel for forces", density.name);
            return Err(NoEnergy::NotConservative(what));
        }
        Ok(LocalEnergy {
            plan: Plan::new(fluid)?.without_slopes(),
            range: fluid.conservative_range(),
            ..LocalEnergy::default()
        })
    }

    /// Replaces all particles, wraps them into the box, and computes all densities and energies.
    ///
    /// # Errors
    /// Fails for a position that is not finite, and for a ψ that is not a number, or minus infinity.
    pub fn load(&mut self, domain: &PeriodicBox, particles: &Particles) -> Result<(), EngineError> {
        let Particles { x, tag, kind, .. } = *particles;
        if let Some(k) = x.iter().position(|x| !x.iter().all(|c| c.is_finite())) {
            return Err(EngineError::Position { tag: tag[k] });
        }
        self.x.clear();
        self.x.extend_from_slice(x);
        self.species.clear();
        self.species.extend_from_slice(kind);
        let fits = |cells: &Cells| cells.domain == *domain && self.psi.len() == x.len();
        if !self.cells.as_ref().is_some_and(fits) {
            self.cells = Some(Cells::new(domain, self.plan.dimensions, self.range, x.len()));
            self.own = own_densities(&self.plan, domain);
        }
        if let Some(cells) = &mut self.cells {
            cells.fill(x);
        }
        let width = self.plan.slope_width();
        self.n.clear();
        self.n.resize(x.len() * width, 0.0);
        self.psi.clear();
        self.psi.resize(x.len(), 0.0);
        self.work.slot.clear();
        self.work.slot.resize(x.len(), u32::MAX);
        for first in (0..x.len()).step_by(LANES) {
            let block = first..(first + LANES).min(x.len());
            self.moved.ids.clear();
            self.moved.n.clear();
            for k in block.clone() {
                self.moved.ids.push(k as u32);
                self.moved.n.resize((k - first + 1) * width, 0.0);
                if width > 0 {
                    self.find([x[k]; 2], k);
                    self.densities_there(k, k - first);
                }
            }
            self.evaluate_psi();
            self.psi[block.clone()].copy_from_slice(&self.moved.psi);
            self.n[block.start * width..block.end * width].copy_from_slice(&self.moved.n);
        }
        match self.psi.iter().position(|psi| psi.is_nan() || *psi == f64::NEG_INFINITY) {
            Some(k) => Err(self.no_number(k, tag[k], &self.n[k * width..(k + 1) * width])),
            None => Ok(()),
        }
    }

    /// Positions, wrapped into the box.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.x
    }

    /// Densities that ψ depends on nonlinearly, particle by particle; [`Plan::passes`] lists them.
    pub fn densities(&self) -> &[f64] {
        &self.n
    }

    /// The change of `U` if a particle moves to `to`, which may be outside the box along periodic
    /// directions. `tag` names the particle in errors.
    ///
    /// The change is infinite where ψ of some particle becomes infinite or, beyond a pole, is not a
    /// number at a higher density than before; it is minus infinity where both energies are infinite.
    ///
    /// # Errors
    /// Fails if ψ becomes minus infinity, or is not a number at densities that are no higher than before.
    pub fn change(&mut self, particle: usize, to: [f64; 3], tag: i32) -> Result<f64, EngineError> {
        (self.moved.particle, self.moved.to) = (particle, to);
        self.moved.ids.clear();
        self.moved.n.clear();
        self.moved.psi.clear();
        if self.range == 0.0 {
            return Ok(0.0);
        }
        self.find([self.x[particle], to], particle);
        let pairs = self.pair_change(particle) + self.wall_change(particle);
        if self.plan.passes.is_empty() {
            return Ok(if pairs.is_nan() { f64::NEG_INFINITY } else { pairs });
        }
        self.new_densities(particle);
        self.evaluate_psi();
        let Moved { ids, psi, .. } = &self.moved;
        let excess: f64 = ids.iter().zip(psi).map(|(id, psi)| psi - self.psi[*id as usize]).sum();
        let sum = pairs + excess;
        if sum.is_finite() {
            return Ok(sum);
        }
        self.not_finite(sum, tag)
    }

    /// Interprets an energy change that is not finite.
    #[cold]
    fn not_finite(&self, sum: f64, tag: i32) -> Result<f64, EngineError> {
        let width = self.plan.slope_width();
        for ((psi, n), id) in self.moved.psi.iter().zip(self.moved.n.chunks_exact(width)).zip(&self.moved.ids)
        {
            let before = &self.n[*id as usize * width..][..width];
            let is_higher = n.iter().sum::<f64>() > before.iter().sum::<f64>();
            if *psi == f64::NEG_INFINITY || psi.is_nan() && !is_higher {
                return Err(self.no_number(*id as usize, tag, n));
            }
            if psi.is_nan() {
                return Ok(f64::INFINITY);
            }
        }
        Ok(if sum.is_nan() { f64::NEG_INFINITY } else { sum })
    }

    fn no_number(&self, particle: usize, tag: i32, n: &[f64]) -> EngineError {
        let densities: Vec<String> = n.iter().map(|n| format!("{n:.6}")).collect();
        EngineError::ExcessFreeEnergy {
            tag,
            species: self.plan.species[self.species[particle] as usize].clone(),
            densities: densities.join(", "),
        }
    }

    /// Accepts the last trial move, and counts in `image` the boxes that the particle crosses.
    pub fn accept(&mut self, image: &mut [i32; 3]) {
        let Some(cells) = &mut self.cells else { return };
        let Moved { particle, to, ids, n, psi } = &self.moved;
        let mut x = *to;
        cells.domain.wrap(&mut x, image);
        cells.change(*particle, x);
        self.x[*particle] = x;
        let width = self.plan.slope_width();
        for ((id, psi), k) in ids.iter().zip(psi).zip(0..) {
            let id = *id as usize;
            self.psi[id] = *psi;
            self.n[id * width..(id + 1) * width].copy_from_slice(&n[k * width..(k + 1) * width]);
        }
    }

    /// Finds the neighbours at two points, and their distances.
    fn find(&mut self, points: [[f64; 3]; 2], but: usize) {
        let Some(cells) = &self.cells else { return };
        cells.near(self.set, points, Some(but), &mut self.near);
        let Near { count, r: [before, after], .. } = &mut self.near;
        vectors::run(self.set, Roots([&mut before[..*count], &mut after[..*count]]));
    }

    /// `Σ φ` at the new position minus that at the old one, including densities that ψ is linear in.
    fn pair_change(&mut self, particle: usize) -> f64 {
        let LocalEnergy { plan, near, work, species, set, .. } = self;
        let (count, own) = (plan.species.len(), species[particle] as usize);
        let mut sum = 0.0;
        for term in &plan.linear {
            let weights = weigh(*set, &term.kernel, near, &mut work.weights);
            let pair = |other: usize| {
                term.coefficients[own * count + other] + term.coefficients[other * count + own]
            };
            let [before, after] = weights;
            sum += match count {
                1 => pair(0) * (after.iter().sum::<f64>() - before.iter().sum::<f64>()),
                _ => (0..near.count)
                    .map(|k| pair(species[near.id[k] as usize] as usize) * (after[k] - before[k]))
                    .sum(),
            };
        }
        for PairTerm { between, potential } in &plan.pairs {
            let other = match *between {
                [a, b] if a == own => b,
                [a, b] if b == own => a,
                _ => continue,
            };
            let (range, found) = (potential.range(), near.count);
            work.r.resize(2 * near.id.len(), 0.0);
            work.phi.resize(2 * near.id.len(), 0.0);
            // The counts at the new position, then those at the old one.
            let mut ends = [0; 2];
            let mut end = 0;
            for (side, r) in [&near.r[1], &near.r[0]].into_iter().enumerate() {
                for k in 0..found {
                    work.r[end] = r[k];
                    let acts = count == 1 || species[near.id[k] as usize] as usize == other;
                    end += usize::from((r[k] < range) & acts);
                }
                ends[side] = end;
            }
            let phi = &mut work.phi[..end];
            potential.energies(&work.r[..end], phi, &mut work.registers);
            sum += phi[..ends[0]].iter().sum::<f64>() - phi[ends[0]..].iter().sum::<f64>();
        }
        sum
    }

    /// The energy at walls at the new position less that at the old one, without ψ.
    fn wall_change(&self, particle: usize) -> f64 {
        let Some(cells) = self.cells.as_ref().filter(|_| !self.plan.walls.is_empty()) else { return 0.0 };
        let faces = walls::faces(&self.plan.walls, &cells.domain, self.plan.dimensions);
        let at = |x: &[f64; 3]| {
            let mut sum = 0.0;
            walls::for_each_near(&faces, x, self.species[particle], |_, field, z| {
                sum += field.energies.iter().map(|part| part.at(z)[0]).sum::<f64>();
            });
            sum
        };
        at(&self.moved.to) - at(&self.x[particle])
    }

    /// The densities of a particle at the second point of the last search, as row `row` of the new densities.
    fn densities_there(&mut self, particle: usize, row: usize) {
        let LocalEnergy { plan, near, work, species, set, moved, own, x, cells, .. } = self;
        let (count, width) = (plan.species.len(), plan.slope_width());
        let n = &mut moved.n[row * width..(row + 1) * width];
        for (p, d) in plan.passes.iter().enumerate() {
            let [_, after] = weigh(*set, &plan.densities[*d].kernel, near, &mut work.weights);
            add_weights(after, near, species, &mut n[p * count..(p + 1) * count]);
            n[p * count + species[particle] as usize] += own[p];
        }
        add_walls(plan, cells.as_ref(), &x[particle], species[particle], n);
    }

    /// The densities that change, the particles that they belong to, and the densities of the moved particle.
    fn new_densities(&mut self, particle: usize) {
        let LocalEnergy { plan, near, work, species, set, moved, own, n, cells, .. } = self;
        let (count, width, found) = (plan.species.len(), plan.slope_width(), near.count);
        let kind = species[particle] as usize;
        let passes = plan.passes.len();
        work.change.resize(passes * near.id.len(), 0.0);
        work.after.resize(passes * near.id.len(), 0.0);
        work.cancelled.clear();
        // The first row is that of the moved particle.
        moved.ids.push(particle as u32);
        moved.n.resize(width, 0.0);
        for (p, d) in plan.passes.iter().enumerate() {
            let [before, after] = weigh(*set, &plan.densities[*d].kernel, near, &mut work.weights);
            add_weights(after, near, species, &mut moved.n[p * count..(p + 1) * count]);
            moved.n[p * count + kind] += own[p];
            let change = &mut work.change[p * found..(p + 1) * found];
            for ((change, before), after) in change.iter_mut().zip(before).zip(after) {
                *change = after - before;
            }
            work.after[p * found..(p + 1) * found].copy_from_slice(after);
        }
        let to = moved.to;
        add_walls(plan, cells.as_ref(), &to, species[particle], &mut moved.n);
        for k in 0..found {
            let changes = |p: usize| work.change[p * found + k];
            if (0..passes).all(|p| changes(p) == 0.0) {
                continue;
            }
            let id = near.id[k];
            let row = match near.repeats && work.slot[id as usize] != u32::MAX {
                true => work.slot[id as usize] as usize,
                false => {
                    moved.ids.push(id);
                    moved.n.extend_from_slice(&n[id as usize * width..][..width]);
                    moved.ids.len() - 1
                }
            };
            if near.repeats {
                work.slot[id as usize] = row as u32;
            }
            for (p, d) in plan.passes.iter().enumerate() {
                let n = &mut moved.n[row * width + p * count + kind];
                *n += changes(p);
                let least = if species[id as usize] as usize == kind { own[p] } else { 0.0 };
                if changes(p) < 0.0 && *n - least < CANCELLED * plan.densities[*d].kernel.value(0.0) {
                    work.cancelled.push([row, p]);
                }
            }
        }
        if near.repeats {
            moved.ids.iter().for_each(|id| work.slot[*id as usize] = u32::MAX);
        }
        for k in 0..self.work.cancelled.len() {
            let [row, pass] = self.work.cancelled[k];
            self.sum_anew(row, pass, particle);
        }
    }

    /// Sums the density of the species of `particle` at the neighbour in row `row` anew, with `particle` at its new place.
    fn sum_anew(&mut self, row: usize, pass: usize, particle: usize) {
        let LocalEnergy { plan, near, beside, work, species, set, moved, own, x, cells, .. } = self;
        let Some(cells) = cells else { return };
        let (id, kind) = (moved.ids[row] as usize, species[particle]);
        cells.near(*set, [x[id]; 2], Some(id), beside);
        let found = beside.count;
        vectors::run(*set, Roots([&mut beside.r[0][..found], &mut []]));
        let kernel = &plan.densities[plan.passes[pass]].kernel;
        let [weights, _] = weigh(*set, kernel, beside, &mut work.weights);
        let counts = |other: &u32| *other as usize != particle && species[*other as usize] == kind;
        let others: f64 =
            weights.iter().zip(&beside.id).filter(|(_, other)| counts(other)).map(|w| w.0).sum();
        let after = &work.after[pass * near.count..(pass + 1) * near.count];
        let moved_one: f64 =
            after.iter().zip(&near.id).filter(|(_, k)| **k as usize == id).map(|w| w.0).sum();
        let least = if species[id] == kind { own[pass] } else { 0.0 };
        let (count, width) = (plan.species.len(), plan.slope_width());
        let mut of_walls = vec![0.0; if plan.walls.is_empty() { 0 } else { width }];
        add_walls(plan, Some(cells), &x[id], species[id], &mut of_walls);
        let of_walls = of_walls.get(pass * count + kind as usize).copied().unwrap_or(0.0);
        moved.n[row * width + pass * count + kind as usize] = others + moved_one + least + of_walls;
    }

    /// Evaluates ψ of the particles of `moved` at their new densities.
    fn evaluate_psi(&mut self) {
        let LocalEnergy { plan, work, species, moved, excess: excess_work, .. } = self;
        let (count, width, all) = (plan.species.len(), plan.slope_width(), moved.ids.len());
        moved.psi.clear();
        moved.psi.resize(all, 0.0);
        let variables = plan.densities.len() * count;
        for (alpha, excess) in plan.excess.iter().enumerate() {
            if count == 1 && variables == 1 && width == 1 && plan.densities[0].correction[0].is_identity() {
                excess.evaluate(&moved.n, &mut moved.psi, &mut [], excess_work);
                continue;
            }
            work.members.clear();
            let is_one = |row: &u32| species[moved.ids[*row as usize] as usize] == alpha as i32;
            work.members.extend((0..all as u32).filter(is_one));
            let lanes = work.members.len();
            if lanes == 0 {
                continue;
            }
            work.at.clear();
            work.at.resize(variables * lanes, 0.0);
            for (p, d) in plan.passes.iter().enumerate() {
                for beta in 0..count {
                    let at = &mut work.at[(d * count + beta) * lanes..][..lanes];
                    for (at, row) in at.iter_mut().zip(&work.members) {
                        *at = moved.n[*row as usize * width + p * count + beta];
                    }
                    let correction = &plan.densities[*d].correction[alpha * count + beta];
                    if !correction.is_identity() {
                        at.iter_mut().for_each(|at| *at = correction.at(*at).0);
                    }
                }
            }
            work.lanes.resize(lanes, 0.0);
            excess.evaluate(&work.at, &mut work.lanes, &mut [], excess_work);
            work.members.iter().zip(&work.lanes).for_each(|(row, psi)| moved.psi[*row as usize] = *psi);
        }
    }
}

/// Adds what walls add to the densities of a particle at `x`.
fn add_walls(plan: &Plan, cells: Option<&Cells>, x: &[f64; 3], species: i32, n: &mut [f64]) {
    let Some(cells) = cells.filter(|_| !plan.walls.is_empty()) else { return };
    let faces = walls::faces(&plan.walls, &cells.domain, plan.dimensions);
    let column = |d: usize| plan.passes.iter().position(|p| *p == d).map(|p| p * plan.species.len());
    walls::add_densities(&faces, std::slice::from_ref(x), |_| species, column, plan.slope_width(), n);
}

/// Adds weights to the densities of the species that they are of.
fn add_weights(weights: &[f64], near: &Near, species: &[i32], n: &mut [f64]) {
    match n {
        [n] => *n += weights.iter().sum::<f64>(),
        _ => weights.iter().zip(&near.id).for_each(|(w, id)| n[species[*id as usize] as usize] += w),
    }
}

/// Each particle's contribution to its own density: `w(0)` if it is included, and its images.
fn own_densities(plan: &Plan, domain: &PeriodicBox) -> Vec<f64> {
    let of = |d: &usize| {
        let density = &plan.densities[*d];
        let range = density.kernel.range();
        let shells = [0, 1, 2].map(|k| match domain.periodic()[k] && k < plan.dimensions {
            true => (range / domain.height(k)).ceil() as i32,
            false => 0,
        });
        let mut sum = if density.includes_self { density.kernel.value(0.0) } else { 0.0 };
        let shell = |k: usize| -shells[k]..=shells[k];
        for s in shell(0).flat_map(|a| shell(1).flat_map(move |b| shell(2).map(move |c| [a, b, c]))) {
            if s != [0; 3] {
                let image =
                    [0, 1, 2].map(|c| (0..3).map(|k| f64::from(s[k]) * domain.edge(k)[c]).sum::<f64>());
                sum += density.kernel.value(image.iter().map(|c| c * c).sum::<f64>().sqrt());
            }
        }
        sum
    };
    plan.passes.iter().map(of).collect()
}

/// Computes square roots in place.
struct Roots<'a>([&'a mut [f64]; 2]);

impl Loop for Roots<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        self.0.into_iter().flatten().for_each(|r| *r = r.sqrt());
    }
}

/// The weights of a kernel at the distances that the search found.
fn weigh<'w>(set: InstructionSet, kernel: &Kernel, near: &Near, to: &'w mut [Vec<f64>; 2]) -> [&'w [f64]; 2] {
    let count = near.count;
    for (w, r) in to.iter_mut().zip(&near.r) {
        w.resize(near.id.len(), 0.0);
        kernel.kind().visit(Weights { set, kernel, r: &r[..count], w: &mut w[..count] });
    }
    to.each_ref().map(|w| &w[..count])
}

struct Weights<'a> {
    set: InstructionSet,
    kernel: &'a Kernel,
    r: &'a [f64],
    w: &'a mut [f64],
}

impl ShapeVisitor for Weights<'_> {
    type Output = ();

    fn visit<S: Shape>(self) {
        struct OfShape<'a, S>(Weights<'a>, std::marker::PhantomData<S>);
        impl<S: Shape> Loop for OfShape<'_, S> {
            type Out = ();

            #[inline(always)]
            fn run(self) {
                let Weights { kernel, r, w, .. } = self.0;
                let (factor, inverse) = (kernel.value_factor(), 1.0 / kernel.range());
                for (w, r) in w.iter_mut().zip(r) {
                    let s = r * inverse;
                    *w = if s < 1.0 { factor * S::value(s) } else { 0.0 };
                }
            }
        }
        vectors::run(self.set, OfShape::<S>(self, std::marker::PhantomData));
    }
}
