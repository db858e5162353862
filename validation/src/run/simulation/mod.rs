mod operators;

pub(super) use operators::Heat;

use super::bounds::Bounds;
use super::error::RunError;
use super::integrator::Integrator;
use super::integrator::parts::Kept;
use super::reach;
use super::reorder::{self, Reordering};
use crate::particles::{BodyForce, State, Tags, add_body_forces};
use psidpd_core::engine::thermostat::PairThermostat;
use psidpd_core::engine::{
    self, Engine, Particles, PassCounts, PeriodicBox, Plan, Precision, Request, Settings, Step, Tally, Want,
};
use psidpd_core::model::Model;
use std::sync::OnceLock;

/// Particles in a box, and the forces of one fluid on them.
///
/// Every buffer is kept from step to step.
///
/// Directions of the box that are not periodic have walls that reflect.
///
/// Pair noise is keyed by the number of the step whose forces it is in: the forces before the first
/// step are those of step 0, and step `n` ends with forces of number `n`, as in LAMMPS.
#[derive(Debug, Clone)]
pub struct Simulation {
    model: Model,
    kt: f64,
    seed: u64,
    number: u64,
    thermostat: bool,
    all_densities: bool,
    reference_only: bool,
    /// What engines of earlier temperatures counted.
    earlier_out_of_bounds: [u64; 2],
    dimensions: usize,
    domain: PeriodicBox,
    mass: Vec<f64>,
    owned: usize,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    force: Vec<[f64; 3]>,
    species: Vec<i32>,
    tag: Vec<i32>,
    image: Vec<[i32; 3]>,
    forces: Engine,
    tally: Tally,
    /// What Groot and Warren's step keeps over the evaluation of the forces.
    kept: Kept,
    kept_forces: Vec<[f64; 3]>,
    bounds: Bounds,
    /// `None` if particles stay in the order that they were given in.
    reordering: Option<Reordering>,
    /// The time of a kick that ends the present step and is still to be made.
    deferred: Option<f64>,
    /// The thermostat apart from the forces; `None` if the fluid has none.
    coupling: Option<PairThermostat>,
    /// Counts changes of positions, and of their order.
    moves: u64,
    /// Of which positions the thermostat knows the pairs, for what time, and whether with distances.
    found_pairs: Option<(u64, f64, bool)>,
    /// Virial of the thermostat's impulses in the present step.
    impulse_virial: [f64; 6],
    /// Whether drag and noise are among the forces, where the thermostat acts; `None` if the integrator must know.
    drag_in_forces: Option<bool>,
    /// Whether the forces are those of other positions than the present ones.
    stale: bool,
    frozen_tags: Tags,
    /// By particle; empty if none is frozen.
    frozen: Vec<bool>,
    mobile: usize,
    /// Sum of the forces on the frozen particles, in the last evaluation.
    support_force: [f64; 3],
    body_forces: Vec<BodyForce>,
    /// `Σ m v v` of the present velocities, once somebody has asked for it.
    flux: OnceLock<[f64; 6]>,
    /// Square of the longest way that a particle may go in one step.
    longest_move: f64,
}

impl Simulation {
    /// A simulation of `model` at temperature `kt` from `state`, at step 0. Positions outside the box
    /// are wrapped into it.
    ///
    /// # Errors
    /// The model does not hold at `kt`, or `state` is no state of it.
    pub fn new(model: &Model, kt: f64, state: State, seed: u64) -> Result<Simulation, RunError> {
        let fluid = model.at(kt)?;
        if let Some(fault) = state.fault(fluid.species.len(), fluid.dimensions) {
            return Err(RunError::State(fault));
        }
        let settings = Settings { precision: Precision::Double, ..Settings::default() };
        let forces = Engine::new(&fluid, settings)?;
        let coupling = PairThermostat::new(forces.plan(), kt, forces.settings().instructions);
        let State { domain, mass, mut x, v, species, tag, mut image } = state;
        let owned = x.len();
        reach::check(&domain, fluid.dimensions, fluid.cutoff(), owned)?;
        for (x, image) in x.iter_mut().zip(&mut image) {
            domain.wrap(x, image);
        }
        Ok(Simulation {
            model: model.clone(),
            kt,
            seed,
            number: 0,
            thermostat: true,
            all_densities: false,
            reference_only: false,
            earlier_out_of_bounds: [0; 2],
            dimensions: fluid.dimensions,
            mass,
            owned,
            force: vec![[0.0; 3]; owned],
            x,
            v,
            species,
            tag,
            image,
            forces,
            tally: Tally::default(),
            kept: Kept::default(),
            kept_forces: Vec::new(),
            coupling,
            moves: 0,
            found_pairs: None,
            impulse_virial: [0.0; 6],
            drag_in_forces: None,
            stale: false,
            bounds: Bounds::of(&domain, fluid.dimensions),
            reordering: None,
            deferred: None,
            frozen_tags: Tags::none(),
            frozen: Vec::new(),
            mobile: owned,
            support_force: [0.0; 3],
            body_forces: Vec::new(),
            flux: OnceLock::new(),
            longest_move: domain.lengths().iter().map(|l| l * l).sum(),
            domain,
        })
    }

    /// Another temperature for the thermostat and for every formula with kT.
    ///
    /// # Errors
    /// The model does not hold at `kt`.
    pub fn set_temperature(&mut self, kt: f64) -> Result<(), RunError> {
        if kt != self.kt {
            self.earlier_out_of_bounds = self.out_of_bounds();
            let (settings, pool) = (self.forces.settings(), self.forces.pool().clone());
            self.forces = Engine::with_pool(&self.model.at(kt)?, settings, pool)?;
            self.forces.use_reference_only(self.reference_only);
            self.kt = kt;
            self.renew_coupling();
        }
        Ok(())
    }

    /// How forces are computed from now on; in double precision, on one thread, unless told otherwise.
    ///
    /// # Errors
    /// The model does not hold at the present temperature: never, since it did before.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), RunError> {
        self.earlier_out_of_bounds = self.out_of_bounds();
        self.forces = Engine::new(&self.model.at(self.kt)?, settings)?;
        self.forces.use_reference_only(self.reference_only);
        self.renew_coupling();
        Ok(())
    }

    fn renew_coupling(&mut self) {
        let instructions = self.forces.settings().instructions;
        self.coupling = PairThermostat::new(self.forces.plan(), self.kt, instructions);
        self.found_pairs = None;
    }

    /// How forces are computed.
    pub fn settings(&self) -> Settings {
        self.forces.settings()
    }

    /// Whether particles are brought, at the end of some steps, into an order in which those near each other in
    /// space are so in memory, which is faster in large systems: after that, what belongs to a particle is told
    /// by its tag alone. Off unless told otherwise.
    ///
    /// The steps depend on their number only. Trajectories differ from those without by the rounding of sums.
    pub fn set_reordering(&mut self, on: bool) {
        self.reordering = on.then(Reordering::default);
    }

    /// Brings all arrays over particles into the order of the last sweep, if there was one.
    fn reorder(&mut self) {
        let Simulation {
            reordering: Some(reordering), forces, x, v, force, species, tag, image, frozen, ..
        } = self
        else {
            return;
        };
        let Some(order) = forces.order().filter(|order| order.len() == self.owned) else { return };
        self.found_pairs = None;
        let pool = forces.pool();
        reordering.vectors(pool, order, x);
        reordering.vectors(pool, order, v);
        reordering.vectors(pool, order, force);
        let ordered = reordering.numbers(pool, order, |k| image[k]);
        for (image, ordered) in image.iter_mut().zip(ordered) {
            *image = ordered;
        }
        let rests = |k: usize| frozen.get(k).is_some_and(|frozen| *frozen);
        let ordered = reordering.numbers(pool, order, |k| [tag[k], species[k], i32::from(rests(k))]);
        for (k, [of_tag, of_species, rests]) in ordered.enumerate() {
            (tag[k], species[k]) = (of_tag, of_species);
            if let Some(frozen) = frozen.get_mut(k) {
                *frozen = rests != 0;
            }
        }
    }

    /// The engine, for what it can tell of itself.
    pub fn engine(&self) -> &Engine {
        &self.forces
    }

    /// The way that steps take of which only forces are wanted, for people.
    pub fn evaluation(&self) -> String {
        let want = Want { densities: self.all_densities, ..Want::FORCES };
        self.forces.describe(self.forces.path_for(engine::Surroundings::Box(&self.domain), want))
    }

    /// Switches dissipative and random forces off, or on again.
    pub fn set_thermostat(&mut self, on: bool) {
        self.thermostat = on;
    }

    /// Freezes the particles of these tags, and no others: they rest where they are, and act on the others.
    /// Their temperature and momentum do not count.
    pub fn set_frozen(&mut self, tags: &Tags) {
        self.frozen_tags = tags.clone();
        self.find_frozen();
    }

    /// Finds the frozen particles by their tags, whose order may have changed, and stops them.
    fn find_frozen(&mut self) {
        let frozen: Vec<bool> = self.tags().iter().map(|t| self.frozen_tags.contain(*t)).collect();
        let count = frozen.iter().filter(|f| **f).count();
        self.mobile = self.owned - count;
        self.flux.take();
        self.frozen = if count > 0 { frozen } else { Vec::new() };
        for (v, _) in self.v.iter_mut().zip(&self.frozen).filter(|(_, frozen)| **frozen) {
            *v = [0.0; 3];
        }
    }

    /// The body forces that act from the next evaluation of forces on.
    pub fn set_body_forces(&mut self, forces: &[BodyForce]) {
        self.body_forces = forces.to_vec();
    }

    /// Whether there are any.
    pub fn has_body_forces(&self) -> bool {
        !self.body_forces.is_empty()
    }

    /// The number that the next forces are keyed by: for a run that goes on from step `number`.
    pub fn set_step_number(&mut self, number: u64) {
        self.number = number;
    }

    /// Takes up a run where a checkpoint left it: after step `number`, with the forces of that step, so
    /// that the next step is bit for bit the one that would have followed. Unlike [`Simulation::new`] it
    /// wraps no position: one that rounding left on a face must stay there.
    ///
    /// `state` must be of the particles, the box and the masses that the simulation was made with.
    pub(super) fn restore(
        &mut self,
        number: u64,
        state: &State,
        forces: &[[f64; 3]],
        out_of_bounds: [u64; 2],
    ) {
        self.owned = state.len();
        self.x.clone_from(&state.x);
        self.v.clone_from(&state.v);
        self.species.clone_from(&state.species);
        self.tag.clone_from(&state.tag);
        self.image.clone_from(&state.image);
        self.force.clear();
        self.force.extend_from_slice(forces);
        // A start that failed has left none.
        self.force.resize(self.owned, [0.0; 3]);
        self.number = number;
        self.earlier_out_of_bounds = out_of_bounds;
        self.deferred = None;
        self.found_pairs = None;
        self.drag_in_forces = None;
        self.stale = false;
        self.find_frozen();
    }

    /// Computes the forces of the present step at the present velocities, thermostat included, as a run or a stage
    /// needs before its first step.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn prepare(&mut self, dt: f64, want: Want) -> Result<(), RunError> {
        self.prepare_for(Integrator::default(), dt, want)
    }

    /// The same for steps of an integrator: without thermostat, if it acts apart from the forces there.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn prepare_for(&mut self, integrator: Integrator, dt: f64, want: Want) -> Result<(), RunError> {
        self.end_step()?;
        self.impulse_virial = [0.0; 6];
        self.stale = false;
        match integrator.drag_in_forces() {
            true => self.forces_with_thermostat(dt, want),
            false => self.conservative_forces(want),
        }
    }

    /// Body forces; and none at all on what is frozen, so that every integrator leaves it alone.
    fn add_external_forces(&mut self) {
        if !self.body_forces.is_empty() {
            let Simulation { body_forces, forces, domain, mass, x, species, tag, force, owned, .. } = self;
            add_body_forces(body_forces, forces.pool(), &mut force[..*owned], |body, k| {
                let mass = mass[species[k] as usize];
                body.acts_on(species[k], tag[k]).then(|| body.at(domain, x[k]).map(|a| mass * a))
            });
        }
        self.support_force = [0.0; 3];
        for (force, _) in self.force.iter_mut().zip(&self.frozen).filter(|(_, frozen)| **frozen) {
            for (sum, f) in self.support_force.iter_mut().zip(std::mem::take(force)) {
                *sum += f;
            }
        }
    }

    /// Computes forces between particles, with noise and drag of `step`, or conservative ones only; no body
    /// forces.
    ///
    /// # Errors
    /// The box is too narrow for the noise, or a position, ψ or force is not finite.
    pub fn compute(&mut self, want: Want, step: Option<Step>) -> Result<(), RunError> {
        if let Some(step) = step {
            if !(step.dt > 0.0 && step.dt.is_finite()) {
                return Err(RunError::TimeStep(step.dt));
            }
            check_width(&self.domain, self.forces.plan())?;
        }
        let step = step.filter(|_| self.forces.plan().needs_velocities());
        let number = self.number;
        let failed = |source| RunError::Engine { step: number, source };
        let Simulation { forces, domain, x, v, tag, species, force, owned, all_densities, .. } = self;
        let particles = Particles { owned: *owned, x, tag, kind: species };
        let want = Want { densities: want.densities || *all_densities, ..want };
        let request = Request { particles, v, step, want };
        self.tally = forces.forces(domain, &request, force, false).map_err(failed)?;
        Ok(())
    }

    /// One step of `dt`. The forces of the step before must be there: see [`Simulation::prepare_for`].
    ///
    /// # Errors
    /// A position, velocity or force that is not finite, ψ singular, or a particle that moved further
    /// than across the box.
    pub fn step(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        self.begin_step(dt, integrator, want)?;
        self.end_step()?;
        if want == Want::FORCES { Ok(()) } else { self.refresh(want) }
    }

    /// Steps of `dt` that nothing is wanted of.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn advance(&mut self, steps: u64, dt: f64, integrator: Integrator) -> Result<(), RunError> {
        for _ in 0..steps {
            self.begin_step(dt, integrator, Want::FORCES)?;
        }
        self.end_step()
    }

    /// A step but for a kick that may as well be made when the next begins, with the same bits: until then, or until
    /// [`Simulation::end_step`], velocities are not those at the end of the step.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub(super) fn begin_step(&mut self, dt: f64, integrator: Integrator, want: Want) -> Result<(), RunError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(RunError::TimeStep(dt));
        }
        let drags = integrator.drag_in_forces();
        if self.drag_in_forces.is_some_and(|there| there != drags) && self.thermostat {
            // Forces of another integrator.
            self.prepare_for(integrator, dt, Want::FORCES)?;
        }
        self.number += 1;
        self.impulse_virial = [0.0; 6];
        integrator.step(self, dt, want)?;
        (0..6).for_each(|c| self.tally.thermostat_virial[c] += self.impulse_virial[c]);
        self.stale = !integrator.forces_at_end();
        if reorder::is_due(self.number) {
            self.end_step()?;
            self.reorder();
        }
        Ok(())
    }

    /// Ends the step that [`Simulation::begin_step`] has begun, if it is not at its end.
    ///
    /// # Errors
    /// A velocity that is not finite.
    pub(super) fn end_step(&mut self) -> Result<(), RunError> {
        self.make_deferred_kick()
    }

    /// Computes what is wanted at the end of the present step, where the integrator has computed forces at other positions
    /// only; trajectories do not depend on it.
    ///
    /// # Errors
    /// As [`Simulation::compute`].
    pub(super) fn refresh(&mut self, want: Want) -> Result<(), RunError> {
        if !self.stale {
            return Ok(());
        }
        self.conservative_forces(want)?;
        self.stale = false;
        (0..6).for_each(|c| self.tally.thermostat_virial[c] += self.impulse_virial[c]);
        Ok(())
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The plan of the engine.
    pub fn plan(&self) -> &Plan {
        self.forces.plan()
    }

    /// How many evaluations of ψ met a density below its bounds, and above them.
    pub fn out_of_bounds(&self) -> [u64; 2] {
        let now = self.forces.out_of_bounds();
        std::array::from_fn(|k| self.earlier_out_of_bounds[k] + now[k])
    }

    /// How often each pass of the engine has run, since the temperature was last changed.
    pub fn counts(&self) -> PassCounts {
        self.forces.counts()
    }

    /// Local densities of the particles in the last evaluation, if [`Simulation::sum_all_densities`] asked for them: one
    /// for each density and species, density-major.
    pub fn local_densities(&self) -> &[f64] {
        self.forces.local_densities()
    }

    /// Whether evaluations bring every density of the model with them.
    pub fn sum_all_densities(&mut self, all: bool) {
        self.all_densities = all;
    }

    /// Whether every evaluation is done by the reference, the slower way in double precision.
    pub fn use_reference_only(&mut self, only: bool) {
        self.reference_only = only;
        self.forces.use_reference_only(only);
    }

    /// kT.
    pub fn kt(&self) -> f64 {
        self.kt
    }

    /// The number of the present step.
    pub fn step_number(&self) -> u64 {
        self.number
    }

    /// 2 or 3.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Which particles are frozen, one by one; empty if none is.
    pub fn frozen(&self) -> &[bool] {
        &self.frozen
    }

    /// How many particles move.
    pub fn mobile(&self) -> usize {
        self.mobile
    }

    /// The sum of all forces on the frozen particles in the last evaluation, which nothing follows: what holds
    /// them bears it.
    pub fn support_force(&self) -> [f64; 3] {
        self.support_force
    }

    /// How many particles there are.
    pub fn len(&self) -> usize {
        self.owned
    }

    /// Whether there are none: never.
    pub fn is_empty(&self) -> bool {
        self.owned == 0
    }

    /// The box.
    pub fn domain(&self) -> &PeriodicBox {
        &self.domain
    }

    /// Positions, in the box.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.x[..self.owned]
    }

    /// Velocities.
    pub fn velocities(&self) -> &[[f64; 3]] {
        debug_assert!(self.deferred.is_none(), "a step is not at its end");
        &self.v[..self.owned]
    }

    /// Forces of the last evaluation.
    pub fn forces(&self) -> &[[f64; 3]] {
        &self.force[..self.owned]
    }

    /// Species.
    pub fn species(&self) -> &[i32] {
        &self.species[..self.owned]
    }

    /// Tags.
    pub fn tags(&self) -> &[i32] {
        &self.tag[..self.owned]
    }

    /// Boxes travelled.
    pub fn image_flags(&self) -> &[[i32; 3]] {
        &self.image
    }

    /// Mass of each species.
    pub fn masses(&self) -> &[f64] {
        &self.mass
    }

    /// Energies and virials of the last evaluation, as far as they were wanted.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// A copy of the particles.
    pub fn state(&self) -> State {
        let mut state = State {
            domain: self.domain.clone(),
            mass: self.mass.clone(),
            x: Vec::new(),
            v: Vec::new(),
            species: Vec::new(),
            tag: Vec::new(),
            image: Vec::new(),
        };
        self.copy_state(&mut state);
        state
    }

    /// Copies the particles into `state`, which keeps its memory.
    pub fn copy_state(&self, state: &mut State) {
        fn copy<T: Copy>(to: &mut Vec<T>, from: &[T]) {
            to.clear();
            to.extend_from_slice(from);
        }
        state.domain.clone_from(&self.domain);
        copy(&mut state.mass, &self.mass);
        copy(&mut state.x, self.positions());
        copy(&mut state.v, self.velocities());
        copy(&mut state.species, self.species());
        copy(&mut state.tag, self.tags());
        copy(&mut state.image, &self.image);
    }

    /// `U` of the last evaluation that wanted energies.
    pub fn potential_energy(&self) -> f64 {
        self.tally.energy()
    }

    /// `½ Σ m v²`.
    pub fn kinetic_energy(&self) -> f64 {
        let k = self.momentum_flux();
        0.5 * (k[0] + k[1] + k[2])
    }

    /// How many degrees of freedom the kinetic energy is shared by: `d` for each particle that moves, less one
    /// for each direction along which the total momentum is conserved. Frozen particles conserve none of it,
    /// walls not that across them.
    pub fn degrees_of_freedom(&self) -> usize {
        let conserved = match self.frozen.is_empty() {
            true => self.domain.periodic()[..self.dimensions].iter().filter(|p| **p).count(),
            false => 0,
        };
        self.dimensions * self.mobile - conserved.min(self.dimensions * self.mobile)
    }

    /// `kT` from the kinetic energy of the particles that move, as LAMMPS's `compute temp`; 0 without degrees
    /// of freedom. A flow counts as heat.
    pub fn temperature(&self) -> f64 {
        match self.degrees_of_freedom() {
            0 => 0.0,
            freedom => 2.0 * self.kinetic_energy() / freedom as f64,
        }
    }

    /// `Σ m v`.
    pub fn momentum(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (v, s) in self.velocities().iter().zip(&self.species) {
            for c in 0..3 {
                sum[c] += self.mass[*s as usize] * v[c];
            }
        }
        sum
    }

    /// `Σ m v v`, in the order xx, yy, zz, xy, xz, yz.
    fn momentum_flux(&self) -> [f64; 6] {
        *self.flux.get_or_init(|| {
            let mut sum = [0.0; 6];
            for (v, s) in self.velocities().iter().zip(&self.species) {
                let m = self.mass[*s as usize];
                for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                    sum[k] += m * v[a] * v[b];
                }
            }
            sum
        })
    }

    fn over_volume(&self, virial: [f64; 6]) -> [f64; 6] {
        let volume = self.domain.volume(self.dimensions);
        let flux = self.momentum_flux();
        std::array::from_fn(|k| (flux[k] + virial[k]) / volume)
    }

    /// `(Σ m v v + W)/V` with the virial of all forces, thermostat included, as LAMMPS's
    /// `compute pressure`; order xx, yy, zz, xy, xz, yz. Needs a virial.
    pub fn pressure_tensor(&self) -> [f64; 6] {
        self.over_volume(self.tally.total_virial())
    }

    /// The same with the virial of conservative forces alone, which has less noise.
    ///
    /// The two means differ by a term of order Δt: the drag of velocity Verlet sees the velocity that
    /// brought particles to where they are, which is correlated with their distance.
    pub fn conservative_pressure_tensor(&self) -> [f64; 6] {
        self.over_volume(self.tally.virial)
    }

    /// The trace of a pressure tensor over the number of dimensions.
    pub fn scalar_pressure(&self, tensor: [f64; 6]) -> f64 {
        tensor[..self.dimensions].iter().sum::<f64>() / self.dimensions as f64
    }
}

/// Refuses boxes in which a particle meets two images of one neighbour within the range of the noise.
fn check_width(domain: &PeriodicBox, plan: &Plan) -> Result<(), RunError> {
    let Some(range) = plan.noise_range() else { return Ok(()) };
    let periodic = domain.periodic();
    let height = (0..plan.dimensions())
        .filter(|k| periodic[*k])
        .map(|k| domain.height(k))
        .fold(f64::INFINITY, f64::min);
    // Widths come from an inverse matrix: leave room for its rounding.
    if height < 2.0 * range * (1.0 - 1e-12) { Err(RunError::BoxTooNarrow { height, range }) } else { Ok(()) }
}
