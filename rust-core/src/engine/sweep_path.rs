//! The sweep, and what it leaves out: special pairs, which sums over a list of pairs add, and long pairs of rare species.

use super::error::EngineError;
use super::evaluate::Evaluate;
use super::fault::Fault;
use super::long_pairs::{LongPairs, faster_apart};
use super::pair_sums::Corrections;
use super::particles::Particles;
use super::plan::Plan;
use super::request::Request;
use super::surroundings::{Around, SpecialPair, Surroundings};
use super::sweep::{Sweep, Times, lap};
use super::walls;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::{Tally, Want};
use std::time::Instant;

/// The forces of one fluid by a sweep, with special pairs and long pairs.
#[derive(Debug)]
pub struct SweepPath {
    /// The plan of the whole fluid.
    pub plan: Plan,
    /// The sweep of this plan, or of what it is without long pairs.
    pub sweep: Sweep,
    pub long: Option<LongPairs>,
    /// Seconds spent on long pairs since the engine was made.
    time_of_long_pairs: f64,
    pub special: Vec<SpecialPair>,
    /// Whether the sweep leaves the special pairs out.
    excludes_special: bool,
    corrections: Corrections,
    fault: Option<Fault>,
    /// ψ of owned particles and their densities in the last evaluation, if they have been fetched or summed.
    excess: Vec<f64>,
    pub densities: Vec<f64>,
}

impl SweepPath {
    pub fn new(sweep: Sweep) -> SweepPath {
        SweepPath {
            plan: sweep.plan.clone(),
            sweep,
            long: None,
            time_of_long_pairs: 0.0,
            special: Vec::new(),
            excludes_special: true,
            corrections: Corrections::default(),
            fault: Fault::present(),
            excess: Vec::new(),
            densities: Vec::new(),
        }
    }

    /// Sets the pairs with reduced strength; those with a factor of 1 are ordinary pairs.
    pub fn set_special(&mut self, pairs: impl IntoIterator<Item = SpecialPair>) {
        self.special.clear();
        self.special.extend(pairs.into_iter().filter(|pair| pair.factor != 1.0));
        self.excludes_special = false;
    }

    /// Whether all particles in a box are near one image of each other: see [`Sweep::fits`].
    pub fn fits(&self, domain: &PeriodicBox) -> bool {
        self.sweep.fits(domain)
            && self.long.as_ref().is_none_or(|long| long.fit(self.plan.dimensions, domain))
    }

    /// Times of the parts of evaluations, since the engine was made.
    pub fn times(&self) -> Times {
        let times = self.sweep.times();
        Times { first: times.first + self.time_of_long_pairs, ..times }
    }

    /// Maps types to species, as [`Engine::map_kinds`](super::Engine::map_kinds).
    pub fn map_kinds(&mut self, kinds: &[i32]) -> Result<(), EngineError> {
        self.plan.map_kinds(kinds)?;
        self.sweep.plan.map_kinds(kinds)
    }

    /// Decides which pair potentials are apart from the sweep among `particles`; with `None` the sweep has all.
    fn part(&mut self, particles: Option<&Particles>) {
        let mut count = vec![0; self.plan.species.len()];
        let which = match particles.filter(|_| self.plan.has_long_pairs() && !self.leaves_out()) {
            None => Vec::new(),
            Some(particles) => {
                for kind in particles.kind {
                    let species = self.plan.species_of_type.get(*kind as usize);
                    if let Some(count) = species.and_then(|s| count.get_mut(*s as usize)) {
                        *count += 1;
                    }
                }
                faster_apart(&self.plan, &count)
            }
        };
        if self.long.as_ref().map_or(&[][..], |long| &long.which) == which {
            return;
        }
        self.sweep.exchange(self.plan.without_pairs(&which));
        self.long = (!which.is_empty()).then(|| LongPairs::new(&self.plan, which, &count));
    }

    /// Whether special or excluded pairs are set.
    pub fn leaves_out(&self) -> bool {
        !(self.special.is_empty() && self.sweep.exclusions.marks.is_empty())
    }

    /// Discards ψ and densities of the last evaluation.
    pub fn forget(&mut self) {
        self.excess.clear();
        self.densities.clear();
    }

    /// Whether forces need every density of the model.
    pub fn has_all_densities(&self) -> bool {
        let plan = &self.sweep.plan;
        plan.passes.len() == plan.densities().count()
    }

    /// Gets all densities of the last evaluation if it computed them; returns whether it did.
    pub fn fetch_densities(&mut self) -> bool {
        if self.densities.is_empty() && self.has_all_densities() {
            self.sweep.local_densities(&mut self.excess, &mut self.densities);
        }
        !self.densities.is_empty()
    }

    /// ψ of owned particles in the last evaluation.
    pub fn excess(&mut self) -> &[f64] {
        if self.excess.is_empty() {
            self.sweep.local_densities(&mut self.excess, &mut Vec::new());
        }
        &self.excess
    }

    /// Computes the contributions of special pairs, and adds those to the densities.
    fn begin(&mut self, around: Around, request: &Request) -> Result<(), EngineError> {
        request.particles.check(26)?;
        request.particles.check_images(around.images)?;
        let SweepPath { sweep, special, corrections, excludes_special, .. } = self;
        let Sweep { plan, exclusions, added_densities, .. } = sweep;
        exclusions.check(request.particles.x.len())?;
        corrections.find(plan, (special, exclusions), around, &request.particles, added_densities)?;
        let faces = walls::faces(&plan.walls, around.domain, plan.dimensions);
        if !faces.is_empty() && plan.slope_width() > 0 {
            let Particles { x, kind, owned, .. } = request.particles;
            let (count, width) = (plan.species.len(), plan.slope_width());
            added_densities.resize(width * owned, 0.0);
            let species = |k: usize| plan.species_of_type.get(kind[k] as usize).copied().unwrap_or(-1);
            let column = |d: usize| plan.passes.iter().position(|p| *p == d).map(|pass| pass * count);
            walls::add_densities(&faces, &x[..owned], species, column, width, added_densities);
        }
        if !*excludes_special {
            exclusions.set(special);
            *excludes_special = true;
        }
        Ok(())
    }

    /// Stores the densities if the request includes them.
    fn fetch(&mut self, want: Want) {
        if want.densities {
            self.sweep.local_densities(&mut self.excess, &mut self.densities);
        }
    }

    /// Size in bytes of the arrays over particles and pairs.
    pub fn memory(&self) -> usize {
        let special = self.special.capacity() * size_of::<SpecialPair>() + self.corrections.pairs.bytes();
        let numbers = self.excess.capacity() + self.densities.capacity();
        let long = self.long.as_ref().map_or(0, LongPairs::memory);
        self.sweep.memory() + special + long + numbers * size_of::<f64>()
    }
}

impl Evaluate for SweepPath {
    fn whole(
        &mut self,
        domain: &PeriodicBox,
        request: &Request,
        force: &mut [[f64; 3]],
        add: bool,
    ) -> Result<Tally, EngineError> {
        self.part(Some(&request.particles));
        self.begin(Around { domain, images: &[] }, request)?;
        let mut tally = self.sweep.evaluate(domain, request, force, add)?;
        if let Some(long) = &mut self.long {
            let mut since = Instant::now();
            let of = (&**self.sweep.pool(), self.sweep.set(), &self.plan);
            let particles = (&request.particles, self.sweep.sorted());
            tally += long.add_forces(of, domain, particles, request.want, force)?;
            lap(&mut since, &mut self.time_of_long_pairs);
        }
        if self.corrections.pairs.len() > 0 {
            self.sweep.fetch_slopes(request.particles.owned);
            tally += self.corrections.add_forces(&self.sweep.plan, &self.sweep.slopes, request, force)?;
        }
        self.fetch(request.want);
        self.fault.into_iter().for_each(|fault| fault.spoil_virial(&mut tally));
        Ok(tally)
    }

    fn first(
        &mut self,
        surroundings: Surroundings,
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<(), EngineError> {
        let around = surroundings.around().ok_or(EngineError::Host("a sweep finds its pairs itself"))?;
        // Ranks would have to agree on what is rare.
        self.part(None);
        self.begin(around, request)?;
        self.sweep.first(around, request, force)
    }

    fn second(&mut self, request: &Request, force: &mut [[f64; 3]]) -> Result<Tally, EngineError> {
        let mut tally = self.sweep.second(&request.particles, force)?;
        if self.corrections.pairs.len() > 0 {
            tally += self.corrections.add_forces(&self.sweep.plan, &self.sweep.slopes, request, force)?;
        }
        self.fetch(request.want);
        Ok(tally)
    }

    fn slopes_mut(&mut self) -> &mut Vec<f64> {
        &mut self.sweep.slopes
    }

    fn fetch_slopes(&mut self, all: usize) {
        self.sweep.fetch_slopes(all);
    }
}
