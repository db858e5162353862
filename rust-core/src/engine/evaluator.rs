mod listed;
mod memory;
mod single;

pub use listed::PairsOfHost;

use super::counts::PassCounts;
use super::density_pass::add_density;
use super::error::EngineError;
use super::excess_pass::{ExcessPass, Rows};
use super::force_pass::{ForceInput, ForceOutput, add_forces};
use super::noise::PairNoise;
use super::pairs::{Newton, Pairs};
use super::particles::{Particles, Step};
use super::plan::Plan;
use super::search::CellSearch;
use super::tally::{Tally, Want};
use crate::model::Fluid;
use crate::model::expression::TooLarge;

/// The forces of one fluid, and the arrays that computing them needs.
#[derive(Debug, Clone)]
pub struct Engine {
    plan: Plan,
    kinds: Vec<i32>,
    search: CellSearch,
    pairs: Pairs,
    species: Vec<i32>,
    /// Local densities of owned particles, density-major, [`Fluid::variables`] each.
    densities: Vec<f64>,
    all_densities: bool,
    /// ψ of owned particles.
    excess: Vec<f64>,
    slopes: Vec<f64>,
    particle_energy: Vec<f64>,
    particle_virial: Vec<[f64; 6]>,
    excess_pass: ExcessPass,
    counts: PassCounts,
    owned: usize,
    /// Whether pairs, densities and slopes are those of one configuration.
    ready: bool,
}

impl Engine {
    /// An engine for `fluid`; types are species indices until [`Engine::map_kinds`] says otherwise.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn new(fluid: &Fluid) -> Result<Engine, TooLarge> {
        Ok(Engine::of_plan(Plan::new(fluid)?))
    }

    /// The engine of a plan that is there already.
    pub fn of_plan(plan: Plan) -> Engine {
        let kinds = (0..plan.species.len() as i32).collect();
        Engine {
            plan,
            kinds,
            search: CellSearch::default(),
            pairs: Pairs::default(),
            species: Vec::new(),
            densities: Vec::new(),
            all_densities: false,
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

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How often each pass has run.
    pub fn counts(&self) -> PassCounts {
        self.counts
    }

    /// How many evaluations of ψ had a density below its bounds, and how many one above, since the
    /// engine was made. Only densities count that the particle's ψ depends on, not linearly.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        self.excess_pass.out_of_bounds
    }

    /// Maps the host's types to species: entry `kind` is the species of type `kind`, negative for
    /// particles that take no part.
    ///
    /// # Errors
    /// A species index out of range.
    pub fn map_kinds(&mut self, kinds: &[i32]) -> Result<(), EngineError> {
        if kinds.iter().any(|s| *s >= self.plan.species.len() as i32) {
            return Err(EngineError::Host("a type is mapped to a species the model does not have"));
        }
        self.kinds = kinds.to_vec();
        Ok(())
    }

    /// Whether every density of the model is to be summed in [`Engine::densities`], or only those that
    /// forces need.
    pub fn sum_all_densities(&mut self, all: bool) {
        self.all_densities = all;
    }

    /// Finds pairs, sums local densities and evaluates ψ and its slopes for owned particles.
    ///
    /// # Errors
    /// A position or ψ that is not finite, a tag or type out of range, arrays of different lengths.
    pub fn densities(&mut self, particles: &Particles, newton: Newton) -> Result<(), EngineError> {
        self.ready = false;
        self.take_species(particles)?;
        self.owned = particles.owned;
        let cutoff = self.plan.cutoff;
        self.search.find(particles, &self.species, self.plan.dimensions, cutoff, newton, &mut self.pairs)?;
        self.counts.search += 1;
        self.sum_densities();
        self.evaluate_excess(particles.tag)?;
        self.ready = true;
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
        for (kind, tag) in particles.kind.iter().zip(particles.tag) {
            let species = usize::try_from(*kind).ok().and_then(|k| self.kinds.get(k));
            let Some(species) = species else {
                return Err(EngineError::Kind { tag: *tag, kind: *kind });
            };
            if *tag < 1 {
                return Err(EngineError::Tag { tag: *tag });
            }
            self.species.push(*species);
        }
        Ok(())
    }

    fn sum_densities(&mut self) {
        let count = self.plan.species.len();
        let width = self.plan.densities.len() * count;
        self.densities.clear();
        self.densities.resize(self.owned * width, 0.0);
        for (d, density) in self.plan.densities.iter().enumerate() {
            if !self.all_densities && !self.plan.passes.contains(&d) {
                continue;
            }
            add_density(&self.pairs, &density.kernel, self.owned, &mut self.densities, width, d * count);
            self.counts.density += 1;
            if density.includes_self {
                let own = density.kernel.value(0.0);
                for (i, species) in self.species[..self.owned].iter().enumerate() {
                    if *species >= 0 {
                        self.densities[i * width + d * count + *species as usize] += own;
                    }
                }
            }
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

    /// Numbers per particle that a host forwards to ghosts: [`Plan::slope_width`].
    pub fn slope_width(&self) -> usize {
        self.plan.slope_width()
    }

    /// `∂ψ/∂n` of owned particles, then room for those of ghosts.
    pub fn slopes(&self) -> &[f64] {
        &self.slopes
    }

    /// The same, for the host to fill in the ghosts.
    pub fn slopes_mut(&mut self) -> &mut Vec<f64> {
        &mut self.slopes
    }

    /// Uncorrected local densities of owned particles, one for each density and species,
    /// density-major. Those that forces do not need are zero unless [`Engine::sum_all_densities`].
    pub fn local_densities(&self) -> &[f64] {
        &self.densities
    }

    /// ψ of owned particles, without the terms that act as pair potentials.
    pub fn excess(&self) -> &[f64] {
        &self.excess
    }

    /// Adds the forces to `force` and returns what was asked for.
    ///
    /// `v` may be empty and `step` `None` where no thermostat acts; with `step` `None` only
    /// conservative forces are computed. Under [`Newton::On`] forces on ghosts are added too, and the
    /// host brings them home.
    ///
    /// # Errors
    /// A force that is not finite; arrays of other lengths than in [`Engine::densities`].
    pub fn forces(
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
            return Err(EngineError::Host("forces without densities of the same configuration"));
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

    /// Energy of each particle and ghost, if the last [`Engine::forces`] was asked for it.
    pub fn particle_energy(&self) -> &[f64] {
        &self.particle_energy
    }

    /// Virial of each particle and ghost, if the last [`Engine::forces`] was asked for it.
    pub fn particle_virial(&self) -> &[[f64; 6]] {
        &self.particle_virial
    }
}
