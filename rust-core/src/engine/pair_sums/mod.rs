//! The Hamiltonian and its forces in double precision, as sums over a list of pairs, for
//! evaluations that the sweep cannot do.
//!
//! ```text
//! pairs        in_box (a box and its images), search (a rank and its ghosts), listed (the host's own)
//!   ↓
//! densities    n_β,i = Σ_j w(r_ij)
//!   ↓
//! ψ            excess_pass: blocks of particles;  free_energy: one particle, with second derivatives
//!   ↓
//! forces       F_ij = −[∂ψ_i/∂n_c(j) + ∂ψ_j/∂n_c(i)] w′ − φ′, drag and noise; energies, virials
//! ```
//!
//! [`PairSums`] computes these steps for a host. [`Evaluator`] computes them for measurements and
//! tests: it sums every density, treats no ψ as a pair potential, and returns every pair with its
//! force. Tests compare both with [`crate::truth`], and all faster code with them.

mod closed_forms;
mod densities;
mod drag;
mod evaluation;
mod forces;
mod free_energy;
mod in_box;
mod laplacians;
mod listed;
mod pair_block;
mod pairs;
mod plane_forces;
mod plane_list;
mod search;
mod shares;
mod shells;
mod single;
mod special;
mod sweep_pairs;

pub(super) use special::Corrections;

pub use super::components::COMPONENTS;
pub use evaluation::{Evaluation, Evaluator, NearWall};
pub use free_energy::Psi;
pub use in_box::{Pair, for_each_pair};
pub use pair_block::PairBlock;
pub use pairs::BLOCK as PAIR_BLOCK;
pub use shares::{ParticleSums, Wanted, has_particle_sums};
pub use shells::count_in_shells;

use super::counts::PassCounts;
use super::error::EngineError;
use super::evaluate::Evaluate;
use super::excess_pass::{ExcessPass, Rows};
use super::exclusions::Exclusions;
use super::particles::Particles;
use super::plan::Plan;
use super::reach::check_reach;
use super::request::{Request, Results};
use super::surroundings::{Around, Newton, SpecialPair, Surroundings};
use super::walls;
use densities::sum_densities;
use forces::{ForceInput, ForceOutput, add_forces};
use in_box::BoxSearch;
use listed::add_listed;
use pairs::Pairs;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::Tally;
use search::CellSearch;
use special::scale;

/// The forces of one fluid over a list of pairs, with all results that a host may ask for, and
/// the arrays of the computation.
#[derive(Debug, Clone, Default)]
pub struct PairSums {
    pub(super) plan: Plan,
    search: CellSearch,
    box_search: BoxSearch,
    pairs: Pairs,
    special: Vec<SpecialPair>,
    exclusions: Exclusions,
    species: Vec<i32>,
    /// What walls add to the densities, in the same order; empty without walls.
    of_walls: Vec<f64>,
    /// Local densities of owned particles, density-major, [`Fluid::variables`] each.
    densities: Vec<f64>,
    /// Whether all densities are summed, or only those that forces need.
    has_all_densities: bool,
    /// ψ of owned particles.
    pub(super) excess: Vec<f64>,
    slopes: Vec<f64>,
    particle_energy: Vec<f64>,
    particle_virial: Vec<[f64; 6]>,
    pub(super) excess_pass: ExcessPass,
    /// Number of runs of each pass.
    pub counts: PassCounts,
    owned: usize,
}

impl PairSums {
    /// Creates the sums of a given plan.
    pub fn of_plan(plan: Plan) -> PairSums {
        PairSums { plan, ..PairSums::default() }
    }

    /// Sets the pairs with reduced strength for later evaluations, by the host's numbers. Within the
    /// cut-off two particles must meet in one image only. The marks of `exclusions` exclude further
    /// pairs. Pairs that a host lists have their factors in its list.
    pub(super) fn set_special_pairs(&mut self, special: &[SpecialPair], exclusions: &Exclusions) {
        let marks = exclusions.marks.iter().copied();
        self.exclusions.mark(marks, exclusions.between_molecules);
        self.special.clear();
        self.special.extend_from_slice(special);
    }

    /// Size in bytes of the arrays over particles and pairs, without the cells of the search.
    pub fn memory(&self) -> usize {
        let PairSums { pairs, species, densities, excess, slopes, particle_energy, particle_virial, .. } =
            self;
        let numbers = [densities, excess, slopes, particle_energy].map(Vec::capacity).iter().sum::<usize>();
        pairs.force.bytes()
            + pairs.density_only.bytes()
            + species.capacity() * size_of::<i32>()
            + numbers * size_of::<f64>()
            + particle_virial.capacity() * size_of::<[f64; 6]>()
    }

    /// Finds the pairs of another configuration; after an error there are none, and no results.
    fn find_pairs(&mut self, surroundings: Surroundings, particles: &Particles) -> Result<(), EngineError> {
        let done = self.search_pairs(surroundings, particles);
        if done.is_err() {
            self.pairs.clear(0, Newton::On);
            self.species.clear();
            [&mut self.densities, &mut self.excess, &mut self.slopes].into_iter().for_each(Vec::clear);
            (self.owned, self.has_all_densities) = (0, false);
        }
        done
    }

    fn search_pairs(&mut self, surroundings: Surroundings, particles: &Particles) -> Result<(), EngineError> {
        self.take_species(particles)?;
        self.owned = particles.owned;
        let (dimensions, cutoff) = (self.plan.dimensions, self.plan.cutoff);
        let PairSums { pairs, species, search, box_search, .. } = self;
        let Particles { x, tag, owned, .. } = *particles;
        let takes_part = |k: usize| species[k] >= 0;
        let is_closed = |domain: &PeriodicBox| domain.periodic()[..dimensions].contains(&true);
        match surroundings {
            Surroundings::Box(domain) => {
                particles.check_no_ghosts()?;
                check_reach(domain, dimensions, cutoff, owned)?;
                pairs.clear(owned, Newton::On);
                box_search.find(x, owned, takes_part, domain, dimensions, cutoff, |i, j, d| {
                    pairs.force.push(i, j, d, species);
                });
            }
            Surroundings::Ghosts(Around { domain, images }, newton) if is_closed(domain) => {
                particles.check_images(images)?;
                check_reach(domain, dimensions, cutoff, x.len())?;
                pairs.clear(owned, newton);
                let is_image = |k: usize| k >= owned && images.get(k - owned).is_some_and(|image| *image);
                let takes_part = |k| takes_part(k) && !is_image(k);
                box_search.find(x, owned, takes_part, domain, dimensions, cutoff, |i, j, d| {
                    pairs.push(i, j, d, tag, species);
                });
            }
            Surroundings::Ghosts(_, newton) => {
                pairs.clear(owned, newton);
                search.find(x, owned, takes_part, dimensions, cutoff, |a, b, d| {
                    pairs.push(a, b, d, tag, species);
                });
            }
            Surroundings::Listed(listed, newton) => {
                pairs.clear(owned, newton);
                add_listed(&listed, particles, species, dimensions, cutoff, pairs)?;
            }
        }
        if !self.special.is_empty() || !self.exclusions.marks.is_empty() {
            self.exclusions.check(species.len())?;
            let Some(Around { domain, .. }) = surroundings.around() else {
                return Err(EngineError::Host("special pairs cannot be combined with listed pairs"));
            };
            scale(&mut self.pairs, &self.special, &self.exclusions, domain, dimensions, cutoff)?;
        }
        self.find_walls(surroundings, particles);
        self.counts.search += 1;
        Ok(())
    }

    /// Finds the densities of walls.
    fn find_walls(&mut self, surroundings: Surroundings, particles: &Particles) {
        let PairSums { plan, of_walls, species, .. } = self;
        of_walls.clear();
        let Some(Around { domain, .. }) = surroundings.around() else { return };
        let faces = walls::faces(&plan.walls, domain, plan.dimensions);
        if !faces.is_empty() {
            let count = plan.species.len();
            let width = plan.densities.len() * count;
            of_walls.resize(width * particles.owned, 0.0);
            let column = |d: usize| Some(d * count);
            walls::add_densities(&faces, particles.x, |k| species[k], column, width, of_walls);
        }
    }

    fn take_species(&mut self, particles: &Particles) -> Result<(), EngineError> {
        particles.check(31)?;
        self.species.clear();
        for ((kind, tag), x) in particles.kind.iter().zip(particles.tag).zip(particles.x) {
            let species = usize::try_from(*kind).ok().and_then(|k| self.plan.species_of_type.get(k));
            let Some(species) = species else { return Err(EngineError::Kind { tag: *tag, kind: *kind }) };
            if *tag < 1 {
                return Err(EngineError::Tag { tag: *tag });
            }
            if *species >= 0 && !x.iter().all(|c| c.is_finite()) {
                return Err(EngineError::Position { tag: *tag });
            }
            self.species.push(*species);
        }
        Ok(())
    }

    /// Sums the densities over the pairs that have been found.
    fn sum_densities(&mut self, all: bool) {
        let PairSums { plan, pairs, species, densities, of_walls, counts, .. } = self;
        densities.clear();
        densities.resize(self.owned * plan.densities.len() * plan.species.len(), 0.0);
        let which = (0..plan.densities.len()).filter(|d| all || plan.passes.contains(d));
        counts.density += sum_densities(pairs, plan, which, species, densities);
        densities.iter_mut().zip(of_walls).for_each(|(n, of_walls)| *n += *of_walls);
        self.has_all_densities = all || plan.passes.len() == plan.densities.len();
    }

    /// Sums all densities of the model over the pairs of `particles` in `surroundings`, or over the
    /// last pairs that were found. Only in the latter case can forces be computed afterwards.
    ///
    /// # Errors
    /// Fails as the first half of an evaluation.
    pub fn sum_all_densities(
        &mut self,
        of: Option<(Surroundings, &Particles)>,
    ) -> Result<&[f64], EngineError> {
        if let Some((surroundings, particles)) = of {
            self.find_pairs(surroundings, particles)?;
            self.sum_densities(true);
        } else if !self.has_all_densities {
            self.sum_densities(true);
        }
        Ok(&self.densities)
    }

    /// Values of single particles in the last evaluation.
    pub(super) fn results(&self) -> Results<'_> {
        Results {
            densities: &self.densities,
            particle_energy: &self.particle_energy,
            particle_virial: &self.particle_virial,
            order: None,
        }
    }

    fn evaluate_excess(&mut self, tag: &[i32]) -> Result<(), EngineError> {
        let slope_width = self.plan.slope_width();
        self.excess.clear();
        self.excess.resize(self.owned, 0.0);
        self.slopes.clear();
        self.slopes.resize(self.species.len() * slope_width, 0.0);
        let columns: Vec<usize> = (0..self.plan.densities.len() * self.plan.species.len()).collect();
        let mut rows = Rows {
            first: 0,
            columns: &columns,
            densities: &self.densities,
            excess: &mut self.excess,
            slopes: &mut self.slopes,
        };
        let species = &self.species;
        self.counts.excess += self.plan.evaluated_species();
        self.excess_pass.run(&self.plan, Some(|i| species[i]), |i| tag[i], &mut rows)
    }
}

impl Evaluate for PairSums {
    fn whole(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<Tally, EngineError> {
        self.first(Surroundings::Box(domain), request, force)?;
        if !add {
            force.fill([0.0; 3]);
        }
        self.second(request, force)
    }

    /// Finds pairs, sums local densities, either all of the model or those that forces need, and
    /// evaluates ψ and its slopes for owned particles. No forces are added yet.
    fn first(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        _: &mut [[f64; 3]],
    ) -> Result<(), EngineError> {
        self.particle_energy.clear();
        self.particle_virial.clear();
        self.find_pairs(surroundings, &request.particles)?;
        self.sum_densities(request.want.densities);
        self.evaluate_excess(request.particles.tag)
    }

    /// Adds all forces. Under [`Newton::On`] forces on ghosts are added too, and the host returns them to the owners.
    fn second(&mut self, request: &Request, force: &mut [[f64; 3]]) -> Result<Tally, EngineError> {
        let Request { particles, v, step, want } = *request;
        let all = self.species.len();
        if particles.x.len() != all || particles.owned != self.owned || particles.tag.len() != all {
            return Err(EngineError::Host("particles changed between densities and forces"));
        }
        let thermostat = self.plan.noise_of(step, v, all)?;
        let newton = self.pairs.newton;
        if force.len() < (if newton == Newton::On { all } else { self.owned }) {
            return Err(EngineError::Host("the force array is too short"));
        }
        if want.particle_energy {
            self.particle_energy.resize(all, 0.0);
        }
        if want.particle_virial {
            self.particle_virial.resize(all, [0.0; 6]);
        }
        self.counts.force += 1;
        self.counts.noise += thermostat.is_some() as u64;
        self.counts.energy += (want.energy || want.particle_energy) as u64;
        self.counts.virial += (want.virial || want.particle_virial) as u64;
        let (plan, list, slopes) = (&self.plan, &self.pairs.force, &self.slopes[..]);
        let input = ForceInput { plan, list, newton, slopes, request: *request, thermostat };
        let mut output = ForceOutput {
            force,
            particle_energy: &mut self.particle_energy,
            particle_virial: &mut self.particle_virial,
            ..ForceOutput::default()
        };
        add_forces(&input, &mut output);
        let mut tally = output.tally;
        if want.energy || want.particle_energy {
            tally.excess += self.excess.iter().sum::<f64>();
        }
        if want.particle_energy {
            for (energy, excess) in self.particle_energy.iter_mut().zip(&self.excess) {
                *energy += excess;
            }
        }
        match force[..self.owned].iter().position(|f| !f.iter().all(|c| c.is_finite())) {
            None => Ok(tally),
            Some(i) => Err(EngineError::Force { tag: particles.tag[i] }),
        }
    }

    fn slopes_mut(&mut self) -> &mut Vec<f64> {
        &mut self.slopes
    }

    fn fetch_slopes(&mut self, all: usize) {
        self.slopes.resize(self.plan.slope_width() * all, 0.0);
    }
}
