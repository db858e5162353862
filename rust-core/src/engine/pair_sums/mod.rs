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

mod densities;
mod evaluation;
mod forces;
mod free_energy;
mod in_box;
mod listed;
mod memory;
mod pairs;
mod search;
mod single;
mod special;
mod sweep_pairs;

pub(super) use special::Corrections;

pub use evaluation::{COMPONENTS, Evaluation, Evaluator};
pub use free_energy::Psi;
pub use in_box::{Pair, for_each_pair};

use super::counts::PassCounts;
use super::error::EngineError;
use super::excess_pass::{ExcessPass, Rows};
use super::exclusions::Exclusions;
use super::particles::{Particles, Step};
use super::plan::Plan;
use super::reach::check_reach;
use super::surroundings::{Around, Newton, SpecialPair, Surroundings};
use crate::model::Fluid;
use crate::model::expression::TooLarge;
use densities::sum_densities;
use forces::{ForceInput, ForceOutput, add_forces};
use in_box::BoxSearch;
use listed::add_listed;
use pairs::Pairs;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::noise::PairNoise;
use psidpd_passes::tally::{Tally, Want};
use search::CellSearch;
use special::scale;

/// The forces of one fluid over a list of pairs, with all results that a host may ask for, and
/// the arrays of the computation.
///
/// An evaluation is [`PairSums::first`], copying slopes from owners to ghosts if there are any, and [`PairSums::second`].
#[derive(Debug, Clone)]
pub struct PairSums {
    plan: Plan,
    kinds: Vec<i32>,
    search: CellSearch,
    box_search: BoxSearch,
    pairs: Pairs,
    special: Vec<SpecialPair>,
    exclusions: Exclusions,
    species: Vec<i32>,
    /// Local densities of owned particles, density-major, [`Fluid::variables`] each.
    densities: Vec<f64>,
    /// Whether all densities are summed, or only those that forces need.
    has_all_densities: bool,
    /// ψ of owned particles.
    excess: Vec<f64>,
    slopes: Vec<f64>,
    particle_energy: Vec<f64>,
    particle_virial: Vec<[f64; 6]>,
    excess_pass: ExcessPass,
    counts: PassCounts,
    owned: usize,
    /// Whether pairs, densities and slopes belong to one configuration.
    ready: bool,
}

impl PairSums {
    /// Creates the sums for `fluid`; types are species indices unless [`PairSums::map_kinds`] maps them.
    ///
    /// # Errors
    /// Fails as [`Plan::new`].
    pub fn new(fluid: &Fluid) -> Result<PairSums, TooLarge> {
        Ok(PairSums::of_plan(Plan::new(fluid)?))
    }

    /// Creates the sums of a given plan.
    pub fn of_plan(plan: Plan) -> PairSums {
        let kinds = (0..plan.species.len() as i32).collect();
        PairSums {
            plan,
            kinds,
            search: CellSearch::default(),
            box_search: BoxSearch::default(),
            pairs: Pairs::default(),
            special: Vec::new(),
            exclusions: Exclusions::default(),
            species: Vec::new(),
            densities: Vec::new(),
            has_all_densities: false,
            excess: Vec::new(),
            slopes: Vec::new(),
            particle_energy: Vec::new(),
            particle_virial: Vec::new(),
            excess_pass: ExcessPass::default(),
            counts: PassCounts::default(),
            owned: 0,
            ready: false,
        }
    }

    /// The plan of the fluid's passes.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Number of runs of each pass.
    pub fn counts(&self) -> PassCounts {
        self.counts
    }

    /// Numbers of evaluations of ψ with a density below its bounds, and above, since the sums were
    /// created. Only densities that the particle's ψ depends on nonlinearly count.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        self.excess_pass.out_of_bounds
    }

    /// Maps the host's types to species: entry `kind` is the species of type `kind`, negative for
    /// particles that do not interact.
    ///
    /// # Errors
    /// Fails for a species index out of range.
    pub fn map_kinds(&mut self, kinds: &[i32]) -> Result<(), EngineError> {
        if kinds.iter().any(|s| *s >= self.plan.species.len() as i32) {
            return Err(EngineError::Host("a type is mapped to a species the model does not have"));
        }
        self.kinds = kinds.to_vec();
        Ok(())
    }

    /// Species of each of the host's types.
    pub(super) fn kinds(&self) -> &[i32] {
        &self.kinds
    }

    /// Sets the pairs with reduced strength for later evaluations, by the host's numbers. Within the
    /// cut-off two particles must meet in one image only. The marks of `exclusions` exclude further
    /// pairs. Pairs that a host lists have their factors in its list.
    pub(super) fn set_special_pairs(&mut self, special: &[SpecialPair], exclusions: &Exclusions) {
        let marks = exclusions.marks().iter().copied();
        self.exclusions.mark(marks, exclusions.between_molecules());
        self.special.clear();
        self.special.extend_from_slice(special);
    }

    /// Finds pairs, sums local densities, either all of the model or those that forces need, and
    /// evaluates ψ and its slopes for owned particles.
    ///
    /// # Errors
    /// Fails for a position or ψ that is not finite, a tag or type out of range, arrays of different
    /// lengths, ghosts in an evaluation of the whole box, and pairs of particles that do not exist.
    pub fn first(
        &mut self,
        surroundings: Surroundings,
        particles: &Particles,
        all_densities: bool,
    ) -> Result<(), EngineError> {
        self.find_pairs(surroundings, particles)?;
        self.sum_densities(all_densities);
        self.evaluate_excess(particles.tag)?;
        self.ready = true;
        Ok(())
    }

    /// Finds the pairs of another configuration.
    fn find_pairs(&mut self, surroundings: Surroundings, particles: &Particles) -> Result<(), EngineError> {
        self.ready = false;
        self.take_species(particles)?;
        self.owned = particles.owned;
        let (dimensions, cutoff) = (self.plan.dimensions, self.plan.cutoff);
        let PairSums { pairs, species, search, box_search, .. } = self;
        let Particles { x, tag, owned, .. } = *particles;
        let takes_part = |k: usize| species[k] >= 0;
        let is_closed = |domain: &PeriodicBox| domain.periodic()[..dimensions].contains(&true);
        match surroundings {
            Surroundings::Box(domain) => {
                if owned < x.len() {
                    return Err(EngineError::Host(
                        "ghosts are not allowed in an evaluation of the whole box",
                    ));
                }
                check_reach(domain, dimensions, cutoff, owned)?;
                pairs.clear(owned, Newton::On);
                box_search.find(x, owned, takes_part, domain, dimensions, cutoff, |i, j, d| {
                    pairs.push_in_box(i, j, d, species);
                });
            }
            Surroundings::Ghosts(Around { domain, images }, newton) if is_closed(domain) => {
                if !images.is_empty() && images.len() != x.len() - owned {
                    return Err(EngineError::Host("`images` must have one entry per ghost"));
                }
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
        if !self.special.is_empty() || !self.exclusions.marks().is_empty() {
            self.exclusions.check(species.len())?;
            let domain = match surroundings {
                Surroundings::Box(domain) => domain,
                Surroundings::Ghosts(around, _) => around.domain,
                Surroundings::Listed(..) => {
                    return Err(EngineError::Host("special pairs cannot be combined with listed pairs"));
                }
            };
            scale(&mut self.pairs, &self.special, &self.exclusions, domain, dimensions, cutoff)?;
        }
        self.counts.search += 1;
        Ok(())
    }

    fn take_species(&mut self, particles: &Particles) -> Result<(), EngineError> {
        let all = particles.x.len();
        if particles.tag.len() != all || particles.kind.len() != all || particles.owned > all {
            return Err(EngineError::Host("particle arrays have different lengths"));
        }
        if all > u32::MAX as usize {
            return Err(EngineError::Host("more than 2^32 particles and ghosts on one rank"));
        }
        self.species.clear();
        for ((kind, tag), x) in particles.kind.iter().zip(particles.tag).zip(particles.x) {
            let species = usize::try_from(*kind).ok().and_then(|k| self.kinds.get(k));
            let Some(species) = species else {
                return Err(EngineError::Kind { tag: *tag, kind: *kind });
            };
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
        let PairSums { plan, pairs, species, densities, counts, .. } = self;
        densities.clear();
        densities.resize(self.owned * plan.densities.len() * plan.species.len(), 0.0);
        let which = (0..plan.densities.len()).filter(|d| all || plan.passes.contains(d));
        counts.density += sum_densities(pairs, plan, which, species, densities);
        self.has_all_densities = all || plan.passes.len() == plan.densities.len();
    }

    /// Sums all densities of the model over the pairs of `particles` in `surroundings`, or over the
    /// last pairs that were found. Only in the latter case can forces be computed afterwards.
    ///
    /// # Errors
    /// Fails as [`PairSums::first`].
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

    /// Number of slopes per particle that a host copies to ghosts: [`Plan::slope_width`].
    pub fn slope_width(&self) -> usize {
        self.plan.slope_width()
    }

    /// Slopes `∂ψ/∂n` of owned particles, followed by room for those of ghosts.
    pub fn slopes(&self) -> &[f64] {
        &self.slopes
    }

    /// The slopes, for the host to write those of ghosts.
    pub fn slopes_mut(&mut self) -> &mut Vec<f64> {
        &mut self.slopes
    }

    /// Uncorrected local densities of owned particles, one for each density and species, density-major.
    /// Densities that forces do not need are zero unless they were asked for.
    pub fn local_densities(&self) -> &[f64] {
        &self.densities
    }

    /// ψ of owned particles, without the terms that act as pair potentials.
    pub fn excess(&self) -> &[f64] {
        &self.excess
    }

    /// Adds the forces to `force` and returns the requested totals.
    ///
    /// `v` may be empty and `step` `None` if no thermostat acts; with `step` `None` only conservative forces are
    /// computed. Under [`Newton::On`] forces on ghosts are added too, and the host returns them to the owners.
    ///
    /// # Errors
    /// Fails for a force that is not finite, and for arrays of other lengths than in [`PairSums::first`].
    pub fn second(
        &mut self,
        particles: &Particles,
        v: &[[f64; 3]],
        step: Option<Step>,
        want: Want,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, EngineError> {
        let all = self.species.len();
        let thermostat = step
            .filter(|_| self.plan.thermostat.is_some())
            .map(|s| (PairNoise::new(s.seed, s.number), 1.0 / s.dt.sqrt()));
        let newton = self.pairs.newton();
        let needed = if newton == Newton::On { all } else { self.owned };
        if !self.ready {
            return Err(EngineError::Host("the second half of an evaluation needs the first half before it"));
        }
        if self.slopes.len() != all * self.plan.slope_width() {
            return Err(EngineError::Host("slopes were not forwarded to every ghost"));
        }
        if particles.x.len() != all || particles.owned != self.owned || particles.tag.len() != all {
            return Err(EngineError::Host("particles changed between densities and forces"));
        }
        if force.len() < needed || (thermostat.is_some() && v.len() < all) {
            return Err(EngineError::Host("force or velocity arrays are too short"));
        }
        self.particle_energy.clear();
        self.particle_virial.clear();
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
        let input = ForceInput {
            plan: &self.plan,
            list: self.pairs.force(),
            newton,
            owned: self.owned,
            slopes: &self.slopes,
            v,
            tag: particles.tag,
            thermostat,
            want,
        };
        let mut output = ForceOutput {
            force,
            particle_energy: &mut self.particle_energy,
            particle_virial: &mut self.particle_virial,
            pair_force: &mut [],
            tally: Tally::default(),
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

    /// Energy of each particle and ghost, if the last [`PairSums::second`] was asked for it.
    pub fn particle_energy(&self) -> &[f64] {
        &self.particle_energy
    }

    /// Virial of each particle and ghost, if the last [`PairSums::second`] was asked for it.
    pub fn particle_virial(&self) -> &[[f64; 6]] {
        &self.particle_virial
    }
}
